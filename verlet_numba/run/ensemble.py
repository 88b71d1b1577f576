"""Many scenes in one process: those of equal topology side by side as the instances of one world, blocks spread over threads.

What is simulated together is settled by the scenes alone, never by the threads, and an instance has the bits that it has
alone (scene/ensemble.py): so the files are the same for any number of threads. An instance that diverges is left behind;
the others go on. What went wrong in it is found out by simulating it again, alone.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.world import COLUMNS, FRAME, Frames
from verlet_numba.frame import DIVERGED, OK
from verlet_numba.run import checkpoint
from verlet_numba.run.contents import contents, now
from verlet_numba.run.engine import State, run_chunk, start, warm
from verlet_numba.run.lock import Lock
from verlet_numba.run.postmortem import Divergence, examine
from verlet_numba.run.simulate import BROKEN, COMPLETE, STOPPED, Summary, remove_leftovers, store
from verlet_numba.run.trajectory import TrajectoryFile
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.capacity import CrowdedError
from verlet_numba.scene.ensemble import likeness, most_beside, together
from verlet_numba.scene.plan import CHUNK_BYTES, frame_bytes, frame_count
from verlet_numba.scene.prepare import Prepared

BLOCK_BYTES = 1 << 20           # of a block's particles and constraints: they stay in the second level of the cache
BLOCK_CHUNK_BYTES = 16 << 20    # of a block's frames on their way to the files


@dataclass
class Instance:
    """One scene of an ensemble and what becomes of it."""

    number: int
    prepared: Prepared
    output: Path
    command: str
    model: Model
    total: int = field(init=False)          # frames
    summary: Summary = field(init=False)
    file: TrajectoryFile | None = None
    failure: Exception | None = None

    def __post_init__(self) -> None:
        self.total, self.summary = frame_count(self.prepared.scene), Summary(str(self.output))

    @property
    def goes_on(self) -> bool:
        return self.failure is None and self.summary.status == COMPLETE and self.summary.frames < self.total


def simulate_together(scenes: Sequence[Prepared], outputs: Sequence[Path], commands: Sequence[str] = (), *, overwrite: bool = False,
                      threads: int = 1, stop: Callable[[], bool] = bool) -> Iterator[tuple[int, Summary | Exception]]:
    """Simulate scenes and write a trajectory each, equal to those of `simulate`, bit for bit.

    Scenes of equal topology and solver settings are simulated side by side, all others one after another. `stop` is asked
    every so often whether to leave off: what is not done then has the status stopped, its file the frames so far.

    Yields the number of each scene, as its block ends, with its summary or with what kept its file from being made or written:
    one that fails leaves the others alone. Of what its block took a summary has its share.
    """
    instances = [Instance(number, *each, model_alone(each[0]))
                 for number, each in enumerate(zip(scenes, outputs, commands or [""] * len(scenes), strict=True))]
    with ThreadPoolExecutor(max(1, threads)) as pool:
        for block in pool.map(partial(simulate_block, stop=stop, overwrite=overwrite), blocks(instances)):
            yield from ((member.number, member.failure or member.summary) for member in block)


def blocks(instances: Sequence[Instance]) -> list[list[Instance]]:
    """Instances that are simulated side by side, in blocks that fit the cache; blocks as their first instances come."""
    alike: dict[object, list[Instance]] = {}
    for instance in instances:
        alike.setdefault(likeness(instance.model) or id(instance), []).append(instance)
    return [members[first:first + most] for members in alike.values()
            for most in (most_beside(members[0].model, BLOCK_BYTES),) for first in range(0, len(members), most)]


def simulate_block(members: list[Instance], stop: Callable[[], bool], overwrite: bool) -> list[Instance]:
    """Simulate the instances of one world to their ends, divergences, failures or a stop, and write their files."""
    clock = time.perf_counter()
    model = model_of(members)
    warm(start(model))
    spend(members, "compile", time.perf_counter() - clock)
    with ExitStack() as stack:
        for member in members:
            with guarded(member):
                stack.enter_context(Lock(member.output))
                remove_leftovers(member.output)
                checkpoint.remove(member.output)
                member.file = stack.enter_context(TrajectoryFile(
                    member.output, contents(member.prepared, member.model, member.command), member.total, overwrite))
        try:
            advance_all(model, members, stop)
        except CrowdedError as error:
            for member in members:
                member.failure = member.failure or error
        for member in sorted(members, key=lambda member: member.summary.status == BROKEN):      # the sound ones first
            if member.failure is None:
                with guarded(member):
                    finish(member, stop)
    return members


def model_alone(prepared: Prepared) -> Model:
    return build(prepared.scene, prepared.bodies, prepared.loaded.folder)


def model_of(members: list[Instance]) -> Model:
    return together([member.model for member in members]) if len(members) > 1 else members[0].model


def advance_all(model: Model, members: list[Instance], stop: Callable[[], bool]) -> None:
    """Chunk after chunk, as long as memory allows, until no instance goes on: `run_chunk` asks in between whether to stop."""
    most = max(1, BLOCK_CHUNK_BYTES // (frame_bytes(model) * len(members)))
    total, done = members[0].total, 0
    while any(member.goes_on for member in members) and not stop():
        chunk = frames(model, min(most, total - done))
        clock = time.perf_counter()
        status = run_chunk(model, chunk, stop)
        spend(members, "simulate", time.perf_counter() - clock)
        came = len(chunk.measures) if status == OK else int(model.world.clock[FRAME]) + (status == DIVERGED)
        for i, member in enumerate(members):
            if member.goes_on:
                with guarded(member):
                    hand_over(member, part_of(chunk, i, model.particles, came))
        done += came
    for member in members:
        if member.goes_on:
            member.summary.status = STOPPED


def spend(members: list[Instance], phase: str, seconds: float) -> None:
    """Share out what a block took."""
    for member in members:
        member.summary.seconds[phase] = member.summary.seconds.get(phase, 0.0) + seconds / len(members)


@contextmanager
def guarded(member: Instance) -> Iterator[None]:
    """What may fail for one instance without the others; its seconds are those of writing."""
    clock = time.perf_counter()
    try:
        yield
    except Exception as error:      # whatever is wrong with one instance is its own failure
        member.failure = error
    spend([member], "write", time.perf_counter() - clock)


def part_of(chunk: Frames, i: int, particles: int, came: int) -> Frames:
    """The first frames of a chunk, of instance i alone."""
    own, measures = slice(i * particles, (i + 1) * particles), slice(i * COLUMNS, (i + 1) * COLUMNS)
    velocity: Array | None = None if chunk.velocity is None else chunk.velocity[:came, own]
    return Frames(chunk.position[:came, own], velocity, chunk.measures[:came, measures], chunk.sound[:came, i:i + 1])


def hand_over(member: Instance, chunk: Frames) -> None:
    """Give the sound frames of an instance to its file; one that is not sound is its last."""
    lost = np.flatnonzero(chunk.sound[:, 0] == 0)
    sound = int(lost[0]) if len(lost) else len(chunk.sound)
    assert member.file is not None
    store(member.prepared.scene, member.file, chunk, sound, member.summary)
    if len(lost):
        member.summary.status = BROKEN


def finish(member: Instance, stop: Callable[[], bool]) -> None:
    """Complete the file, and find out where a divergence was, unless there is no time for that."""
    assert member.file is not None
    if member.summary.status == BROKEN and not stop():
        member.summary.divergence = broken_at(member.prepared, member.summary.frames)
    member.file.finish(member.summary.status, now(), member.summary.timing())


def broken_at(prepared: Prepared, sound: int) -> Divergence:
    """Simulate a scene again, alone, that has so many sound frames, and look where it diverges."""
    model = start(model_alone(prepared))
    most, done = max(1, CHUNK_BYTES // frame_bytes(model)), 0
    while done < sound:
        chunk = frames(model, min(most, sound - done))
        run_chunk(model, chunk)
        done += len(chunk.measures)
    return examine(model, State.of(model), 2 * model.world.solver.substeps)
