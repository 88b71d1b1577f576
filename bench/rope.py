"""Cost of one whole substep of a rope of 50 sticks: gravity, Verlet, relaxation, and frames where there are any."""

from collections.abc import Callable, Iterator
from functools import partial

import naive
import numpy as np
from cases import ROPE, prepared, scene_of
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.run.engine import run_chunk, start
from verlet_numba.scene.build import build, frames

STUDY, CASE = "rope", "rope of 50 sticks"
BAR = 1.0                           # us
MANY, DEFAULT = 1000, 8             # substeps a frame: frames cost nothing, frames as they are
SUBSTEPS = {True: 8_000, False: 80_000}
REPETITIONS = {True: 7, False: 21}


def measure(quick: bool) -> Iterator[Figure]:
    substeps = SUBSTEPS[quick]
    jobs = [frame_loop(MANY, substeps), frame_loop(DEFAULT, substeps), naive_loop(substeps)]
    alone, with_frames, slow = interleaved(REPETITIONS[quick], *jobs) * 1e6 / substeps
    yield figure(STUDY, CASE, "substep", "us", alone, at_most=BAR)
    yield figure(STUDY, CASE, f"substep, frame every {DEFAULT}", "us", with_frames)
    yield figure(STUDY, CASE, "naive substep", "us", slow)
    yield figure(STUDY, CASE, "naive / substep", "x", slow / alone)


def frame_loop(substeps_a_frame: int, substeps: int) -> Callable[[], float]:
    scene = prepared(scene_of(ROPE, solver={"substeps": substeps_a_frame}))
    model = start(build(scene.scene, scene.bodies))
    chunk = frames(model, substeps // substeps_a_frame)
    return lambda: computed(lambda: run_chunk(model, chunk))


def naive_loop(substeps: int) -> Callable[[], float]:
    scene = prepared(scene_of(ROPE, solver={"substeps": MANY}))
    model = build(scene.scene, scene.bodies)
    position, *sticks = naive.body_major(model)
    gravity, h = np.array([0, 0, -9.81]), model.world.solver.step
    work = partial(naive.advance, position, position.copy(), *sticks, gravity, h, substeps)
    return lambda: computed(work)
