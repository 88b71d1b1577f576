"""Cost of the constraint-graph order: `python bench/relaxation_order.py [--quick]`.

Nanoseconds for every constraint visited (an entry of a list for one body), relaxed or left alone, in the passes of one
substep of the paper: 10 passes, tolerance 1 %, particles 3 % of a stick's length off at first. Against the plain runs
with the same tolerance, which visit all bodies in the same order. Bodies hit have random particles moved most.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
import report
from cases import icosahedra, prepared, scene_of
from numba import njit
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.kernels.relax import relax_runs, relax_sticks
from verlet_numba.kernels.relax_graph import relax_graph, sort_bodies
from verlet_numba.run.engine import start
from verlet_numba.scene.build import Model, build
from verlet_numba.scene.constraint_graph import graph_of

STUDY, RESULTS = "order", Path(__file__).parent / "results"
COPIES, PASSES, TOLERANCE, JITTER = (50, 1_000, 10_000), 10, 0.01, 0.03
HIT = {"nobody hit": 0.0, "half hit": 0.5, "all hit": 1.0}
VISITS = {True: 400_000, False: 1_000_000}          # a repetition, by `quick`
REPETITIONS = {True: 7, False: 15}


@njit
def plain(position, start, runs, sticks, times):
    """`times` substeps' passes of plain order from the same start; returns constraints relaxed."""
    relaxed = 0
    for _ in range(times):
        position[:] = start
        for _ in range(PASSES):
            relaxed += relax_runs(position, runs, None, TOLERANCE, None) + relax_sticks(position, sticks, None, TOLERANCE, None)
    return relaxed


@njit
def ordered(position, start, graph, moved, times):
    """The same in the order of the constraint graph, bodies sorted once a substep."""
    relaxed = 0
    for _ in range(times):
        position[:] = start
        sort_bodies(graph, moved)
        for _ in range(PASSES):
            relaxed += relax_graph(position, graph, TOLERANCE, None)
    return relaxed


@njit
def sorting(graph, moved, times):
    for _ in range(times):
        sort_bodies(graph, moved)


def measure(quick: bool) -> Iterator[Figure]:
    for precision in ("float32", "float64"):
        for copies in COPIES:
            yield from compare(f"icosahedra, {copies:,}", model_of(precision, icosahedra(copies)), quick)
        bodies = [{"kind": "icosahedron", "name": f"die_{k}", "radius": 0.1 + 1e-4 * k, "mass": 1, "position": [k, 0, 0]}
                  for k in range(1_000)]
        yield from compare("icosahedra, 1,000 sizes", model_of(precision, *bodies), quick)


def model_of(precision: str, *bodies: dict[str, Any]) -> Model:
    scene = prepared(scene_of(*bodies, effects={}, solver={"precision": precision}))
    return start(build(scene.scene, scene.bodies))


def compare(case: str, model: Model, quick: bool) -> Iterator[Figure]:
    """Plain runs, then the graph with more and more bodies hit, and the sort alone."""
    world, rng = model.world, np.random.default_rng(0)
    real = world.particles.position.dtype
    first = world.particles.position + rng.normal(0, JITTER * world.observed.rest.mean(), world.particles.position.shape)
    first = first.astype(real)
    graph = graph_of(model.bodies, model.numbering, world.particles.inverse_mass.astype(float), "by_level", real)
    assert graph is not None
    count = len(graph.bucket)
    kept = [np.where(rng.random(count) < hit, rng.integers(0, 12, count), -1) for hit in HIT.values()]
    visits = [36 * count, *(int(np.where(moved < 0, 36, 73).sum()) for moved in kept)]
    times = -(-VISITS[quick] // (PASSES * 36 * count))
    jobs = [partial(plain, first.copy(), first, world.runs, world.sticks, times),
            *(partial(ordered, first.copy(), first, graph, moved, times) for moved in kept)]
    if not 0 < jobs[0]() == jobs[1]():
        raise RuntimeError(f"{case}: with nobody hit, the graph must relax what the runs relax")
    found = interleaved(REPETITIONS[quick], *(partial(computed, job) for job in jobs))
    found *= 1e9 / (PASSES * times * np.array(visits)[:, None])
    yield figure(STUDY, case, f"runs, {real}", "ns", found[0])
    for hit, samples in zip(HIT, found[1:], strict=True):
        yield figure(STUDY, case, f"graph, {hit}, {real}", "ns", samples)
        yield figure(STUDY, case, f"graph / runs, {hit}, {real}", "x", samples / found[0])
    sort = interleaved(REPETITIONS[quick], partial(computed, partial(sorting, graph, kept[1], 10 * times)))
    yield figure(STUDY, case, f"sort a body, {real}", "ns", sort * 1e9 / (10 * times * count))


@click.command()
@click.option("--quick", is_flag=True, help="Fewer and shorter repetitions.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, results: Path) -> None:
    """Measure the constraint-graph order against plain runs."""
    where, figures = report.machine() + (", quick" if quick else ""), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in measure(quick):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "relaxation_order.csv")


if __name__ == "__main__":
    main()
