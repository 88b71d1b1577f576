"""What a trajectory file costs beside the simulation: a run with its file against the same chunks of frames without."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from cases import cloth, prepared, scene_of
from report import Figure, figure
from timing import interleaved, timed

from verlet_numba.buffers.world import Frames
from verlet_numba.run import simulate as simulation
from verlet_numba.run.engine import run_chunk, start
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.prepare import Prepared

STUDY = "writing"
BAR = 1.10
SUBSTEPS = (8, 30)
SECONDS = {True: 1.0, False: 4.0}       # of a run, about
PAIRS = {True: 3, False: 9}


def measure(quick: bool) -> Iterator[Figure]:
    for substeps in SUBSTEPS:
        scene = prepared(scene_of(cloth(40, pinned="corners"), solver={"substeps": substeps}))
        count = frames_that_take(SECONDS[quick], scene)
        case = f"cloth 40x40, {substeps} substeps a frame"
        with tempfile.TemporaryDirectory() as folder:
            yield from compare(case, scene, count, Path(folder) / "cloth.vtkhdf", PAIRS[quick])


def compare(case: str, scene: Prepared, count: int, path: Path, pairs: int) -> Iterator[Figure]:
    """Pairs of runs with and without a file; of the runs with one, where their time goes."""
    sizes: list[int] = []
    phases: list[dict[str, float]] = []

    def with_file() -> float:
        sizes.clear()
        with chunks_seen(sizes.append):
            return timed(lambda: phases.append(
                simulation.simulate(scene, path, count=count, overwrite=True, threads=2, quiet=True).seconds))

    with_file()     # leaves its chunks behind, should the first pair begin without a file
    written, plain = interleaved(pairs, with_file, lambda: timed(lambda: without_file(scene, sizes)))
    simulated, waited = (np.array([phase[name] for phase in phases[-pairs:]]) for name in ("simulate", "write"))
    yield figure(STUDY, case, "without file", "us", plain * 1e6 / (count + 1))
    yield figure(STUDY, case, "with / without file", "x", written / plain, at_most=BAR)
    yield figure(STUDY, case, "simulation beside the file", "x", simulated / plain)
    yield figure(STUDY, case, "handing over and waiting", "x", waited / plain)


def without_file(scene: Prepared, sizes: Sequence[int]) -> None:
    """The chunks of a run, their frames dropped."""
    model = start(build(scene.scene, scene.bodies))
    chunk = frames(model, 1)
    for size in sizes:
        if size != len(chunk.measures):
            chunk = frames(model, size)
        run_chunk(model, chunk)


def frames_that_take(seconds: float, scene: Prepared) -> int:
    trial = 100
    without_file(scene, [0])
    return int(trial * seconds / timed(lambda: without_file(scene, [trial])))


@contextmanager
def chunks_seen(tell: Callable[[int], Any]) -> Iterator[None]:
    """Tells the number of frames of every chunk that `simulate` has simulated."""

    def seen(model: Model, chunk: Frames, stop: Callable[[], object]) -> int:
        status = run_chunk(model, chunk, stop)
        tell(len(chunk.measures))
        return status

    with mock.patch.object(simulation, "run_chunk", seen):
        yield
