"""One scene, from its start to a finished trajectory file."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from verlet_numba.buffers import CONTACTS, ERROR_MAX, FRAME, PENETRATION, RELAXATIONS, Array, Frames
from verlet_numba.frame import DIVERGED, OK
from verlet_numba.run.contents import contents, now, observables
from verlet_numba.run.engine import State, run_chunk, spread_over, start, warm
from verlet_numba.run.postmortem import Divergence, examine
from verlet_numba.run.progress import Progress
from verlet_numba.run.signals import StopSignals
from verlet_numba.run.trajectory import TrajectoryFile
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.plan import CHUNK_BYTES, frame_bytes, frame_count
from verlet_numba.scene.prepare import Prepared

CHUNK_SECONDS = 0.4         # wall time of a chunk, so that signals and progress stay responsive
COMPLETE, STOPPED, BROKEN = "complete", "stopped", "diverged"


@dataclass
class Summary:
    """What a run was like. Extremes are over the frames of the file."""

    output: str
    frames: int = 0
    substeps: int = 0
    simulated_seconds: float = 0.0
    status: str = COMPLETE
    relaxations: int = 0
    contacts: int = 0                       # most of any frame
    constraint_error_max: float = 0.0
    penetration_max: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)      # wall time by phase
    chunks: list[tuple[int, float, float]] = field(default_factory=list)    # frames, seconds simulated, seconds handed over
    divergence: Divergence | None = None
    signal: int | None = None

    @property
    def steps_per_second(self) -> float:
        return self.substeps / self.seconds["simulate"] if self.seconds.get("simulate") else 0.0

    @property
    def real_time_factor(self) -> float:
        return self.simulated_seconds / self.seconds["simulate"] if self.seconds.get("simulate") else 0.0

    def timing(self) -> dict[str, Any]:
        """Wall seconds by phase and by chunk."""
        frames, simulate, write = zip(*self.chunks, strict=True) if self.chunks else ((), (), ())
        return {"phases": self.seconds, "chunks": {"frames": frames, "simulate": simulate, "write": write}}

    def as_dict(self) -> dict[str, Any]:
        keys = ("output", "status", "frames", "substeps", "simulated_seconds", "relaxations", "contacts",
                "constraint_error_max", "penetration_max", "steps_per_second", "real_time_factor", "seconds", "signal")
        return {key: getattr(self, key) for key in keys} | {
            "divergence": self.divergence.as_dict() if self.divergence else None}


def simulate(prepared: Prepared, output: Path, *, count: int | None = None, command: str = "", overwrite: bool = False,
             threads: int = 2, quiet: bool = False) -> Summary:
    """Simulate a scene and write its trajectory; `count`: frames after frame 0 instead of the scene's duration.

    Raises OSError (FileExistsError among them) if the file cannot be made or written; frames written before stay.
    """
    summary = Summary(str(output))
    clock = time.perf_counter()
    model = build(prepared.scene, prepared.bodies, prepared.loaded.folder)
    total = frame_count(prepared.scene) if count is None else count + 1
    summary.seconds["build"] = time.perf_counter() - clock
    with Progress(total, prepared.scene.solver.substeps, quiet) as progress:
        compile_kernels(spread_over(model, threads), progress, summary)
        with StopSignals() as signals, TrajectoryFile(output, contents(prepared, model, command), total, overwrite,
                                                      beside=threads > 1) as file:
            advance_all(model, file, total, progress, summary, signals)
            clock = time.perf_counter()
            file.flush()
            summary.seconds["write"] += time.perf_counter() - clock
            file.finish(summary.status, now(), summary.timing())
    return summary


def compile_kernels(model: Model, progress: Progress, summary: Summary) -> None:
    """Make or load the machine code of this scene's run, and put the model at its start."""
    clock = time.perf_counter()
    progress.may_compile()
    warm(start(model))
    progress.compiled()
    summary.seconds["compile"] = time.perf_counter() - clock


def advance_all(model: Model, file: TrajectoryFile, total: int, progress: Progress, summary: Summary,
                signals: StopSignals) -> None:
    """Chunk after chunk, each handed to the file while the next is simulated, until the end, a divergence or a signal."""
    summary.seconds.update(simulate=0.0, write=0.0)
    most = max(1, CHUNK_BYTES // frame_bytes(model))
    size, chunk = 1, frames(model, 1)
    while summary.frames < total and summary.divergence is None and not signals.stop():
        size = min(size, most, total - summary.frames)
        if size != len(chunk.measures):
            chunk = frames(model, size)
        before = State.of(model)
        clock = time.perf_counter()
        status = run_chunk(model, chunk, signals.stop)
        took = time.perf_counter() - clock
        sound = size if status == OK else int(model.world.clock[FRAME])
        clock = time.perf_counter()
        store(model, file, chunk, sound, summary)
        wrote = time.perf_counter() - clock
        summary.seconds["simulate"] += took
        summary.seconds["write"] += wrote
        summary.chunks.append((sound, took, wrote))
        progress.update(summary.frames)
        if status == DIVERGED:
            summary.status = BROKEN
            summary.divergence = examine(model, before, (sound + 2) * model.world.solver.substeps)
        size = next_size(size, took)
    if signals.number and summary.status == COMPLETE and summary.frames < total:
        summary.status, summary.signal = STOPPED, signals.number


def next_size(size: int, took: float) -> int:
    """Frames of the next chunk: a power of two, so that it seldom changes, of about CHUNK_SECONDS; at most eight times as many."""
    wished = min(8.0 * size, size * CHUNK_SECONDS / max(took, 1e-6))
    return 1 << max(0, int(wished).bit_length() - 1)


def store(model: Model, file: TrajectoryFile, chunk: Frames, sound: int, summary: Summary) -> None:
    """Hand the sound frames of a chunk to the file, and take their extremes into the summary."""
    if not sound:
        return
    scene, measures = model.scene, chunk.measures[:sound]
    number = summary.frames + np.arange(sound)
    fields: dict[str, Array] = {"position": chunk.position[:sound]}
    if chunk.velocity is not None:
        fields["velocity"] = chunk.velocity[:sound]
    file.append(number / scene.time.frame_rate, number * scene.solver.substeps, fields,
                observables(measures) if scene.output.observables else {})
    summary.frames += sound
    summary.substeps = (summary.frames - 1) * scene.solver.substeps
    summary.simulated_seconds = (summary.frames - 1) / scene.time.frame_rate
    summary.relaxations += int(measures[:, RELAXATIONS].sum())
    summary.contacts = max(summary.contacts, int(measures[:, CONTACTS].max()))
    summary.constraint_error_max = max(summary.constraint_error_max, float(measures[:, ERROR_MAX].max()))
    summary.penetration_max = max(summary.penetration_max, float(measures[:, PENETRATION].max()))
