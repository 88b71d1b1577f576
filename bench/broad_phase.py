"""How long it takes to list the pairs of hulls that are near each other: `python bench/broad_phase.py [--quick]`.

Prints a table and writes broad_phase.csv. Exit code 1 if a bar is missed. Spheres about icosahedra that fill a tenth of
a cube; with one hull more, the floor, that is as wide as the cube; and with radii from 1 to 1,000 (even in the logarithm).
Every call works on another scene than the one before: no branch predictor learns one by heart.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
import report
from numba import njit
from numpy.typing import NDArray
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.buffers.hulls import Hulls
from verlet_numba.kernels.broad import all_pairs, sweep
from verlet_numba.kernels.candidates import KEPT, RENEWED, refresh
from verlet_numba.scene.capacity import pairs_of
from verlet_numba.scene.capacity import search_of as search_for

RESULTS = Path(__file__).parent / "results"
STUDY = "broad phase"
SIZES = (50, 1_000, 10_000, 100_000)
MOST = 10_000                                           # spheres that are searched as all pairs
BARS = {("icosahedra", 1_000): 0.15, ("icosahedra", 10_000): 2.0}                                   # ms
GROWTH, KEPT_BAR = 1.1, 15.0                            # of the exponent; us, for 10,000
WORK = {True: 50_000, False: 200_000}                   # spheres a repetition, by `quick`
REPETITIONS = {True: 5, False: 15}
SCENES = 20_000                                         # spheres in all scenes of a size
RADIUS, VOLUME, FILL, SLACK = 0.2, 2.536, 0.1, 1.1      # m; of an icosahedron of radius 1; radius searched over radius


@njit
def sweeps(centre, radius, body, still, first, second, search, rounds):
    """List the pairs of every scene, so many times. The number of pairs of the last."""
    listed = 0
    for _ in range(rounds):
        for scene in range(centre.shape[0]):
            listed = sweep(centre[scene], radius[scene], body, still, first, second, search)
    return listed


@njit
def all_in_all(centre, radius, body, still, first, second, rounds):
    """The same with every pair looked at."""
    listed = 0
    for _ in range(rounds):
        for scene in range(centre.shape[0]):
            listed = all_pairs(centre[scene], radius[scene], body, still, first, second)
    return listed


@njit
def refreshes(hulls, still, pairs, spare, search, rounds):
    """Look whether the list is stale. How many times it was kept."""
    kept = 0
    for _ in range(rounds):
        kept += refresh(hulls, still, pairs, spare, search, 0.01, 4, False) == KEPT
    return kept


def scenes(case: str, size: int) -> tuple[NDArray[Any], ...]:
    """Centres (S, 3, H), radii (S, H), bodies and what is still (H,) of as many scenes as are worth it."""
    rng, count = np.random.default_rng(size), max(1, SCENES // size)
    radius = RADIUS * (10 ** rng.uniform(-1.5, 1.5, (count, size)) if case == "sizes 1:1,000" else np.ones((count, size)))
    edge = (VOLUME * (radius**3).sum(1) / FILL) ** (1 / 3)
    centre, body = rng.uniform(0, edge[:, None, None], (count, 3, size)), np.arange(size)
    if case == "icosahedra, floor":
        floor = np.stack([edge / 2, edge / 2, -0.7 * edge], 1)[:, :, None]
        centre, radius = np.concatenate([centre, floor], 2), np.concatenate([radius, edge[:, None]], 1)
        body = np.append(body, -1)
    return centre, SLACK * radius, body, body < 0


def searches(case: str, size: int, quick: bool) -> Iterator[Figure]:
    """Milliseconds a list, by grids and, where that is bearable, by all pairs."""
    centre, radius, body, still = scenes(case, size)
    room = 20 * body.size
    first, second = np.zeros((2, room), np.int64)
    arguments, search = (centre, radius, body, still, first, second), search_for(body.size, room)
    rounds = max(1, WORK[quick] // (centre.shape[0] * size))
    jobs = [partial(computed, partial(sweeps, *arguments, search, rounds))]
    found = sweeps(*arguments, search, 1)
    if size <= MOST:
        if all_in_all(*arguments, 1) != found:
            raise AssertionError(f"{case}, {size}: the searches differ")
        jobs.append(partial(computed, partial(all_in_all, *(value[:1] for value in arguments[:2]), *arguments[2:], 1)))
    times = interleaved(REPETITIONS[quick], *jobs) * 1e3
    name = f"{case}, {size:,}"
    yield figure(STUDY, name, "sweep", "ms", times[0] / (rounds * centre.shape[0]), at_most=BARS.get((case, size)))
    if size <= MOST:
        yield figure(STUDY, name, "all pairs", "ms", times[1])


def kept(size: int, quick: bool) -> Figure:
    """Microseconds to find that a list still holds."""
    centre, radius, body, still = scenes("icosahedra", size)
    none, room = np.zeros(0, np.int64), 20 * size
    hulls = Hulls(body, none, none, none, np.zeros((3, 0)), centre[0].copy(), none, np.zeros((3, 0)), radius[0].copy(),
                  np.zeros(size), none, none, none, none)
    pairs, spare = pairs_of(room), pairs_of(room)
    search, rounds = search_for(size, room), WORK[quick] // 500
    if refresh(hulls, still, pairs, spare, search, 0.01, 4, False) != RENEWED:
        raise AssertionError("no list was made")
    if refreshes(hulls, still, pairs, spare, search, rounds) != rounds:
        raise AssertionError("the list was not kept")
    times = interleaved(REPETITIONS[quick], partial(computed, partial(refreshes, hulls, still, pairs, spare, search, rounds)))
    return figure(STUDY, f"icosahedra, {size:,}", "list kept", "us", times[0] * 1e6 / rounds, at_most=KEPT_BAR)


def measure(quick: bool) -> Iterator[Figure]:
    for case in ("icosahedra", "icosahedra, floor", "sizes 1:1,000"):
        best = {}
        for size in SIZES:
            for found in searches(case, size, quick):
                best.setdefault(found.quantity, {})[size] = found.median
                yield found
        growth = np.log10(best["sweep"][10_000] / best["sweep"][1_000])
        yield figure(STUDY, f"{case}, 1,000 to 10,000", "exponent of growth", "1", growth, at_most=GROWTH)
    yield kept(10_000, quick)


@click.command()
@click.option("--quick", is_flag=True, help="Fewer and shorter repetitions.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, results: Path) -> None:
    """Measure the broad phase."""
    where = report.machine() + (", quick" if quick else "")
    click.echo(f"{where}\n{report.HEADER}")
    figures = []
    for found in measure(quick):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "broad_phase.csv")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
