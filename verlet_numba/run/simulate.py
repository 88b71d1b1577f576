"""One scene, from its start or from where an earlier process stopped, to a finished trajectory file."""

import glob
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.world import FRAME, Frames
from verlet_numba.frame import DIVERGED, OK
from verlet_numba.run import checkpoint
from verlet_numba.run.contents import contents, now, observables
from verlet_numba.run.engine import State, run_chunk, spread_over, start, warm
from verlet_numba.run.lock import Lock
from verlet_numba.run.postmortem import examine
from verlet_numba.run.progress import Progress
from verlet_numba.run.resume import Found, ended, find, hold_against, usable
from verlet_numba.run.signals import Interrupted, StopSignals
from verlet_numba.run.space import require
from verlet_numba.run.summary import BROKEN, COMPLETE, STOPPED, Summary
from verlet_numba.run.trajectory import TEMPORARY, TrajectoryFile
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.plan import CHUNK_BYTES, file_bytes, frame_bytes, frame_count
from verlet_numba.scene.prepare import Prepared
from verlet_numba.scene.schema import Scene

__all__ = ["BROKEN", "COMPLETE", "STOPPED", "Summary", "simulate"]

CHUNK_SECONDS = 0.4         # wall time of a chunk, so that signals and progress stay responsive
CHECKPOINT_SECONDS = 10.0   # from one checkpoint to the next, at least
CHECKPOINT_SHARE = 50       # and as many times what the last one took: 2 % of the run at most
CHECKPOINTS = 3             # on the disk at a time: the last, the one before, and the next in the making


def simulate(prepared: Prepared, output: Path, *, count: int | None = None, command: str = "", overwrite: bool = False,
             resume: bool = False, threads: int = 2, max_time: float | None = None, quiet: bool = False) -> Summary:
    """Simulate a scene and write its trajectory; `count`: frames after frame 0 instead of the scene's duration.

    `resume`: go on with the file if there is one; one that is complete or diverged is left as it is. `max_time`: wall
    seconds after which to stop with a checkpoint. The summary's `status` is complete, diverged or stopped: by a signal if
    `signal` is a number, else by the time. May be called in any thread; signals are noticed in the main one.

    Raises BusyError if somebody else writes the file, ResumeError (a ValueError) if it is not of this run, SpaceError or
    another OSError (FileExistsError among them) if it cannot be made or written. Frames that are written stay, and the run
    can be resumed.
    """
    clock = time.perf_counter()
    total = frame_count(prepared.scene) if count is None else count + 1
    if (over := at_its_end(prepared, output, total, resume)) is not None:       # nothing is written: perhaps nothing may be
        return over
    with Lock(output), StopSignals() as signals, Progress(total, prepared.scene.solver.substeps, quiet) as progress:
        remove_leftovers(output)
        if (over := at_its_end(prepared, output, total, resume)) is not None:   # whoever had the lock has ended it
            return over
        found = find(output) if resume and output.exists() else None
        run = Run(prepared, output, total, threads, progress, found,
                  lambda: signals.stop() or (max_time is not None and time.perf_counter() - clock > max_time))
        try:
            with signals.prompt():
                run.make_ready()
        except Interrupted:
            run.summary.status, run.summary.frames = STOPPED, 0 if found is None else found.frames
        else:
            run.write(command, overwrite)
    if run.summary.status == STOPPED:
        run.summary.signal = signals.number
    return run.summary


def at_its_end(prepared: Prepared, output: Path, total: int, resume: bool) -> Summary | None:
    """The summary of a run to be resumed that has ended already; None if there is something to do. Raises ResumeError."""
    if not (resume and output.exists()):
        return None
    found = find(output)
    hold_against(output, found, prepared.scene, total)
    if found.status not in (COMPLETE, BROKEN):
        return None
    with suppress(OSError):
        checkpoint.remove(output)
    return ended(output, found, prepared.scene)


def remove_leftovers(output: Path) -> None:
    """Trajectories without a name that killed processes have left behind: whoever has the lock may."""
    for path in output.parent.glob(f".{glob.escape(output.name)}.{TEMPORARY}.part"):
        path.unlink(missing_ok=True)


@dataclass
class Run:
    """A run under way. `found`: what an earlier process has written of it; `stop` is asked whether to leave off."""

    prepared: Prepared
    output: Path
    total: int
    threads: int
    progress: Progress
    found: Found | None
    stop: Callable[[], bool]
    summary: Summary = field(init=False)
    model: Model = field(init=False)
    origin: dict[str, str] = field(init=False)
    due: float = field(init=False)              # when the next checkpoint is

    def __post_init__(self) -> None:
        self.summary = Summary(str(self.output))

    def make_ready(self) -> None:
        """Build the world, make or load its machine code, and put it where the run begins or goes on."""
        clock = time.perf_counter()
        self.model = start(build(self.prepared.scene, self.prepared.bodies, self.prepared.loaded.folder))
        self.origin = checkpoint.origin(self.model.world)
        last = None if self.found is None else usable(self.output, self.found, self.origin)
        if last is not None:
            self.summary = Summary.going_on(str(self.output), last.summary)
        elif self.found is not None:
            self.summary.resumed_at = 0
        self.summary.spend("build", time.perf_counter() - clock)
        require(self.output, self.bytes_to_write())
        self.tell_where()
        spread_over(self.model, self.threads)
        self.compile_kernels()
        if last is not None:
            self.model.world = checkpoint.restored(self.model.world, last.arrays)

    def bytes_to_write(self) -> int:
        """What this process may still add to the disk, at most."""
        there = self.output.stat().st_size if self.found is not None else 0
        return max(0, file_bytes(self.prepared, self.model, self.total) - there) + max(
            0, CHECKPOINTS * checkpoint.size(self.model.world) - checkpoint.there(self.output))

    def tell_where(self) -> None:
        if self.found is not None and self.summary.resumed_at:
            more = self.found.frames - self.summary.frames
            again = f", that of its last checkpoint; {more} more that are there are simulated again" if more else ""
            self.progress.tell(f"{self.output}: goes on with frame {self.summary.frames} of {self.total}{again}")
        elif self.found is not None:
            self.progress.tell(f"{self.output}: no checkpoint can be used; simulated again from frame 0 on, and held against the "
                               f"{self.found.frames} frames that are there")

    def compile_kernels(self) -> None:
        clock = time.perf_counter()
        self.progress.may_compile()
        warm(self.model)
        self.progress.compiled(self.summary.frames)
        self.summary.spend("compile", time.perf_counter() - clock)

    def write(self, command: str, overwrite: bool) -> None:
        """Simulate to the end, a divergence or a stop, and finish the file; without its end reached, keep a checkpoint."""
        with TrajectoryFile(self.output, contents(self.prepared, self.model, command), self.total, overwrite,
                            resume_at=None if self.found is None else self.summary.frames, beside=self.threads > 1) as file:
            if self.found is None:
                checkpoint.remove(self.output)      # it belongs to a file that is no more, or will be replaced
            self.advance_all(file)
            if self.summary.status == STOPPED:
                self.keep(file)
            clock = time.perf_counter()
            file.flush()
            self.summary.spend("write", time.perf_counter() - clock)
            file.finish(self.summary.status, now(), self.summary.timing())
        if self.summary.status != STOPPED:
            checkpoint.remove(self.output)

    def advance_all(self, file: TrajectoryFile) -> None:
        """Chunk after chunk, each handed to the file while the next is simulated, until the end, a divergence or a stop.

        Something is always done before `stop` is asked: a command with a short `--max-time` that is repeated comes to its end.
        """
        summary, model = self.summary, self.model
        most = max(1, CHUNK_BYTES // frame_bytes(model))
        size, chunk = 1, frames(model, 1)
        self.due = time.perf_counter() + CHECKPOINT_SECONDS
        while summary.status == COMPLETE and summary.frames < self.total:
            size = min(size, most, self.total - summary.frames)
            if size != len(chunk.measures):
                chunk = frames(model, size)
            before = State.of(model)
            clock = time.perf_counter()
            status = run_chunk(model, chunk, self.stop)
            took = time.perf_counter() - clock
            sound = size if status == OK else int(model.world.clock[FRAME])
            self.store(file, chunk, sound, took)
            if status == DIVERGED:
                summary.status = BROKEN
                summary.divergence = examine(model, before, (sound + 2) * model.world.solver.substeps)
            elif summary.frames < self.total and self.stop():
                summary.status = STOPPED
            elif time.perf_counter() > self.due:
                self.keep(file)
            size = next_size(size, took)

    def store(self, file: TrajectoryFile, chunk: Frames, sound: int, took: float) -> None:
        """Hand the sound frames of a chunk, which took so many seconds, to the file and to the summary."""
        clock, summary = time.perf_counter(), self.summary
        store(self.prepared.scene, file, chunk, sound, summary)
        wrote = time.perf_counter() - clock
        summary.spend("simulate", took)
        summary.spend("write", wrote)
        summary.chunks.append((sound, took, wrote))
        self.progress.update(summary.frames)

    def keep(self, file: TrajectoryFile) -> None:
        """A checkpoint, behind the frames that it counts."""
        clock = time.perf_counter()
        file.flush(sync=True)
        if file.frames:
            checkpoint.write(self.output, self.origin, self.summary.so_far(), self.model.world)
        took = time.perf_counter() - clock
        self.summary.spend("write", took)
        self.due = clock + took + max(CHECKPOINT_SECONDS, CHECKPOINT_SHARE * took)


def store(scene: Scene, file: TrajectoryFile, chunk: Frames, sound: int, summary: Summary) -> None:
    """Hand the sound frames of a chunk to the file, and count them in the summary."""
    if not sound:
        return
    number, measures = summary.frames + np.arange(sound), chunk.measures[:sound]
    fields: dict[str, Array] = {"position": chunk.position[:sound]}
    if chunk.velocity is not None:
        fields["velocity"] = chunk.velocity[:sound]
    file.append(number / scene.time.frame_rate, number * scene.solver.substeps, fields,
                observables(measures) if scene.output.observables else {})
    summary.count(scene, measures)


def next_size(size: int, took: float) -> int:
    """Frames of the next chunk: a power of two, so that it seldom changes, of about CHUNK_SECONDS; at most eight times as many."""
    wished = min(8.0 * size, size * CHUNK_SECONDS / max(took, 1e-6))
    return 1 << max(0, int(wished).bit_length() - 1)
