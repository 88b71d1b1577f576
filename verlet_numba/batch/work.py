"""What a worker does with a batch, on any engine: simulate its runs, measure their files, write their results to the disk.

The process that hands out batches imports this too, but never Numba: what needs it is imported by the functions below.
"""

import contextlib
import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from verlet_numba._version import __version__, digest
from verlet_numba.scene.load import validate
from verlet_numba.scene.overrides import override
from verlet_numba.scene.problems import SceneError, one_line
from verlet_numba.scene.source import Source, compose
from verlet_numba.study import figures, reader
from verlet_numba.study.sweep_folder import FAILED, LASTING, RESULT, TRAJECTORY, Result, read_result, run_folder, write_result

if TYPE_CHECKING:
    from verlet_numba.batch.group import Job
    from verlet_numba.run.simulate import Summary

APART = "complete, but a stick ends at more than twice its length: what it belongs to has come apart"
SIGNED = ("physics", "kernels", "effects", "scene", "run", "buffers", "frame.py")       # what a result comes from


class Named(NamedTuple):
    """A run by its id, and the overrides `PATH=VALUE` that make its scene."""

    id: str
    overrides: tuple[str, ...]


@dataclass(frozen=True)
class Batch:
    """Runs of one group for one worker. Plain data: it is sent to other processes and other machines.

    `scene_name` and `folder` are paths that hold there too: those of a disk that all share.
    """

    scene_text: str
    scene_name: str
    sets: tuple[str, ...]
    folder: Path                    # of the sweep
    measures: tuple[str, ...]
    runs: tuple[Named, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(run.id for run in self.runs)

    def only(self, keys: Sequence[str]) -> "Batch":
        """The same with these runs alone."""
        return Batch(self.scene_text, self.scene_name, self.sets, self.folder, self.measures,
                     tuple(run for run in self.runs if run.id in keys))


def load() -> None:
    """Import what simulating needs, so that workers do while the first of them compiles."""
    import verlet_numba.batch.group  # noqa: F401


def simulate_batch(batch: Batch, begin: Callable[[str], None], done: Callable[[str, Result], None]) -> None:
    """Every run of a batch that has no result yet. `begin(id)` before, `done(id, result)` after each.

    Ends the process after a signal, when the frames of the run at hand are in its file.
    """
    from verlet_numba.batch.group import advance_group

    jobs = []
    for run in batch.runs:
        result = read_result(batch.folder, run.id)
        if result is not None and result.status in LASTING:
            done(run.id, result)
            continue
        try:
            jobs.append(job_of(batch, run))
        except (OSError, ValueError) as error:
            done(run.id, Result(run.id, FAILED, 0.0, {}, reason=one_line(error), program=program()))
    for job, outcome in advance_group(jobs, begin):
        if not isinstance(outcome, Exception) and outcome.signal is not None:
            raise SystemExit(128 + outcome.signal)
        result = result_of(job, outcome, batch.measures)
        try:
            write_result(batch.folder, result)
        except OSError as error:
            result = Result(job.id, FAILED, result.seconds, result.measures, result.frames, one_line(error), program())
        done(job.id, result)


def warm_batch(batch: Batch, begin: Callable[[str], None], done: Callable[[str, None], None]) -> None:
    """Machine code for the runs of a batch, without simulating them. What is wrong with one is told when it is run."""
    from verlet_numba.batch.group import warm_group

    for run in batch.runs:
        begin(run.id)
    with contextlib.suppress(Exception):
        warm_group([job_of(batch, run) for run in batch.runs])
    for run in batch.runs:
        done(run.id, None)


def job_of(batch: Batch, run: Named) -> "Job":
    """A run's scene from its text and overrides, and where it goes; an earlier result of it is gone."""
    from verlet_numba.batch.group import Job

    place = run_folder(batch.folder, run.id)
    place.mkdir(parents=True, exist_ok=True)
    (place / RESULT).unlink(missing_ok=True)
    sets = (*batch.sets, *run.overrides)
    words = ["verlet-numba", "run", batch.scene_name, *(word for text in sets for word in ("--set", text))]
    source, problems = override(document(batch.scene_text, batch.scene_name), sets)
    if problems:
        raise SceneError(problems)
    return Job(run.id, validate(source), place / TRAJECTORY, shlex.join(words))


@lru_cache(1)
def document(text: str, name: str) -> Source:
    return compose(text, name)[0]


def result_of(job: "Job", outcome: "Summary | Exception", measures: Sequence[str]) -> Result:
    """How a run ended and what its file measures."""
    if isinstance(outcome, Exception):
        return Result(job.id, FAILED, 0.0, {}, reason=one_line(outcome), program=program())
    found: dict[str, float | None] = {}
    reason = str(outcome.divergence) if outcome.divergence is not None else APART if outcome.torn else ""
    if outcome.frames:
        try:
            with reader.open(job.output) as trajectory:
                found = figures.figures(trajectory, measures)
        except Exception as error:      # the run is whole, but cannot be measured
            reason = one_line(error)
            return Result(job.id, FAILED, seconds(outcome), {}, outcome.frames, reason, program())
    return Result(job.id, outcome.status, seconds(outcome), found, outcome.frames, reason, program())


def seconds(summary: "Summary") -> float:
    """Wall seconds of a run: building, simulating, writing; making or loading machine code is not counted."""
    return round(sum(spent for phase, spent in summary.seconds.items() if phase != "compile"), 6)


@cache
def program() -> str:
    """The program that makes a result: its version and a hash of the sources that a trajectory comes from."""
    return f"{__version__}+{digest(SIGNED)[:8]}"
