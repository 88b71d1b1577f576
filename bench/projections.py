"""Cost of one distance projection: the simulator's runs against a naive loop over sticks, and against directions at the start.

A projection is one real stick once; lanes that are masked out do not count. Every repetition starts from the same
positions, about 3 % of a stick's length off.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import naive
import numpy as np
from cases import cloth, icosahedra, prepared, scene_of
from numba import njit
from numpy.typing import NDArray
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.kernels.relax import relax_runs
from verlet_numba.kernels.relax_started import relax_started_runs
from verlet_numba.run.engine import start
from verlet_numba.scene.build import Model, build

STUDY = "projections"
CASES = {"icosahedra, 1,000 copies": icosahedra(1_000), "icosahedra, 10,000 copies": icosahedra(10_000),
         "cloth 20x20": cloth(20), "cloth 40x40": cloth(40), "cloth 100x100": cloth(100), "cloth 20x20, 32 copies": cloth(20, 32)}
BARS = {("icosahedra, 1,000 copies", "float32"): 1.6, ("icosahedra, 1,000 copies", "float64"): 3.2,
        ("cloth 40x40", "float32"): 3.0, ("cloth 40x40", "float64"): 4.2}                           # ns
GAINS = {("icosahedra, 1,000 copies", "float32"): 8.0}                                              # naive / runs
STARTED = 1.8           # the direction at the start of the substep against the present one
PROJECTIONS = {True: 400_000, False: 3_000_000}         # a repetition, by `quick`
REPETITIONS = {True: 7, False: 21}
JITTER = 0.03


@njit
def relax(position, runs, passes):
    """`passes` over all runs in one call, so that the call itself does not count."""
    for _ in range(passes):
        relax_runs(position, runs, None, None, None)


@njit
def relax_started(position, previous, runs, marks, passes):
    """The same along the direction at the start of the substep."""
    for _ in range(passes):
        relax_started_runs(position, previous, runs, None, None, None, marks, 0)


def measure(quick: bool) -> Iterator[Figure]:
    for case, body in CASES.items():
        for precision in ("float32", "float64"):
            yield from compare(case, body, precision, quick)


def compare(case: str, body: dict[str, Any], precision: str, quick: bool) -> Iterator[Figure]:
    """Nanoseconds a projection of both, and their ratio."""
    scene = prepared(scene_of(body, effects={}, solver={"precision": precision}))
    model = start(build(scene.scene, scene.bodies))
    runs = model.world.runs
    passes = -(-PROJECTIONS[quick] // runs.active)
    flat = naive.body_major(model)
    position, own = jittered(model.world.particles.position, flat, model)
    check(position, own, flat, model, (runs, passes))
    before = model.world.particles.position
    jobs = [partial(repetition, relax, position, (runs, passes)), partial(repetition, naive.relax, own, (*flat[1:], passes)),
            partial(repetition, relax_started, position, (before, runs, np.zeros_like(before[0]), passes))]
    fast, slow, started = interleaved(REPETITIONS[quick], *jobs) * 1e9 / (passes * runs.active)
    at = (case, precision)
    yield figure(STUDY, case, f"runs, {precision}", "ns", fast, at_most=BARS.get(at))
    yield figure(STUDY, case, f"naive, {precision}", "ns", slow)
    yield figure(STUDY, case, f"naive / runs, {precision}", "x", slow / fast, at_least=GAINS.get(at))
    yield figure(STUDY, case, f"step_start / runs, {precision}", "x", started / fast, at_most=STARTED)


def repetition(relaxation: Any, start: NDArray[Any], arguments: tuple[Any, ...]) -> float:
    position = start.copy()
    return computed(lambda: relaxation(position, *arguments))


def jittered(position: NDArray[Any], flat: tuple[NDArray[Any], ...], model: Model) -> tuple[NDArray[Any], NDArray[Any]]:
    """The same displaced particles in the simulator's order (3, n) and body-major (n, 3)."""
    own = flat[0] + np.random.default_rng(0).normal(0, JITTER * flat[2].mean(), flat[0].shape).astype(flat[0].dtype)
    position = position.copy()
    position[:, model.numbering.scene_order] = own.T
    return position, own


def check(position: NDArray[Any], own: NDArray[Any], flat: tuple[NDArray[Any], ...], model: Model, work: tuple[Any, int]) -> None:
    """Both really relax the same sticks. Raises RuntimeError if they do not bring them nearer to their rest lengths."""
    _, sticks, rest, inverse_mass = flat
    before, by_runs, by_loop = own.copy(), position.copy(), own.copy()
    relax(by_runs, *work)
    naive.relax(by_loop, sticks, rest, inverse_mass, work[1])
    errors = []
    for x in (before, by_runs[:, model.numbering.scene_order].T, by_loop):
        length = np.linalg.norm(x[sticks[:, 1]] - x[sticks[:, 0]], axis=1)
        errors.append(float(np.sqrt(np.mean((length / rest - 1) ** 2))))
    if len(rest) != work[0].active or not max(errors[1:]) < 0.9 * errors[0]:
        raise RuntimeError(f"{work[0].active} of {len(rest)} sticks relaxed, from an error of {errors[0]:.2g} to {errors[1:]}")
