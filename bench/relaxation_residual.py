"""Which order relaxes a body that was hit with the least work: `python bench/relaxation_residual.py`.

Icosahedra at rest; a contact pushes a vertex, or a point of a face (paper, 6.1), 5 to 50 % of an edge inwards. Then
passes by each order, with a tolerance (paper, 7), pushing once before the first pass or before every pass down to the
same plane. A body is done when all sticks are within the tolerance and the pushed point is out by as much; an order is
done when 95 % of the bodies are. Writes relaxation_residual.csv: the first passes and the last of every order.

What holds, relaxations to the same residual against the sequential order of the template, over all cases:
- by_level and halving (the same list for icosahedra) take 15 to 66 % more, and 1.1 to 1.6 times the constraints visited;
- once takes 4 to 10 % less, in as many passes or one or two fewer. That is no merit of the distance: far first takes 0 to
  18 % less, a random order between 4 % less and 2 % more. There and back, or near levels first, gain nothing;
- over-relaxation by 1.2 in any order takes up to a quarter less of relaxations and passes; by 1.4 it pays only where the
  contact pushes before every pass;
- largest takes a third less after one push, no less after many, and 14 to 25 times the time.

`largest` always relaxes the stick that is farthest off (Gauss-Southwell); it is not a list, and its time is that of a
search over all sticks for each relaxation.
"""

import csv
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
import report
from numba import njit
from numpy.typing import NDArray

from verlet_numba.buffers.constraints import Graph
from verlet_numba.kernels.relax_graph import relax_graph, sort_bodies
from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.constraint_graph import constraint_list, graph_of, levels
from verlet_numba.scene.numbering import number

RESULTS = Path(__file__).parent / "results"
BODIES, REPETITIONS, PASSES, DONE = 2000, 9, 300, 0.95
FIRST = 10          # passes of the table; and the last
SHAPE = shapes.icosahedron(1.0, mass=1.0)
EDGE = float(SHAPE.lengths.min())
STICKS = SHAPE.sticks
Array = NDArray[Any]
Lists = list[list[int]]                         # by particle: numbers of sticks
Step = Callable[[Array, int], tuple[int, int]]  # a pass over positions, by its number: relaxations and visits


def by(repeats: str) -> Lists:
    return [constraint_list(STICKS, v, repeats).tolist() for v in range(12)]


def shuffled() -> Lists:
    rng = np.random.default_rng(7)
    return [rng.permutation(len(STICKS)).tolist() for _ in range(12)]


def nearest(count: int) -> Lists:
    """The nearest levels alone."""
    return [[c for level in levels(STICKS, v)[:count] for c in level] for v in range(12)]


def backwards(lists: Lists) -> Lists:
    return [each[::-1] for each in lists]


def chain(*parts: Lists) -> Lists:
    """For each particle one list after another."""
    return [[c for part in each for c in part] for each in zip(*parts, strict=True)]


SEQUENTIAL, ONCE = [list(range(len(STICKS)))] * 12, by("once")
ORDERS: dict[str, tuple[list[Lists], float]] = {        # lists of the first, second ... pass, then round; over-relaxation
    "sequential": ([SEQUENTIAL], 1.0),
    "shuffled": ([shuffled()], 1.0),
    "by_level": ([by("by_level")], 1.0),
    "halving": ([by("halving")], 1.0),
    "once": ([ONCE], 1.0),
    "far first": ([backwards(ONCE)], 1.0),
    "once, there and back": ([ONCE, backwards(ONCE)], 1.0),
    "sequential, there and back": ([SEQUENTIAL, backwards(SEQUENTIAL)], 1.0),
    "near level 3x, then sequential": ([chain(*[nearest(1)] * 3, SEQUENTIAL), *[SEQUENTIAL] * PASSES], 1.0),
    "two near levels, then sequential": ([nearest(2), *[SEQUENTIAL] * PASSES], 1.0),
    "once, then sequential": ([ONCE, *[SEQUENTIAL] * PASSES], 1.0),
    "sequential, over-relaxed 1.2": ([SEQUENTIAL], 1.2),
    "sequential, over-relaxed 1.4": ([SEQUENTIAL], 1.4),
    "once, over-relaxed 1.2": ([ONCE], 1.2)}


class Case(NamedTuple):
    """Bodies, where they stand and how a contact pushes them: its point's weights, normal and plane."""

    graph: Graph
    x: Array                    # (3, n)
    index: Array                # (G, 12)
    corner: Array               # (G, 3) particles of the point
    share: Array                # (G, 3)
    normal: Array               # (G, 3)
    bound: Array                # (G,)
    moved: Array                # (G,)


def case(feature: str) -> Case:
    """Bodies at rest and contacts: normals inwards within 30 degrees or so of the point's own direction."""
    rng = np.random.default_rng(1)
    positions = np.repeat(SHAPE.positions[None], BODIES, axis=0)
    bodies = [Body("dice", SHAPE, positions, np.zeros_like(positions), np.zeros(12, bool), (0.0, 0.0), 0.0)]
    numbering = number(bodies)
    index, inverse_mass = numbering.bodies[0], np.zeros(numbering.size)
    inverse_mass[index] = 12.0
    x = np.zeros((3, numbering.size))
    x[:, index] = np.moveaxis(positions, 2, 0)
    corner = SHAPE.triangles[rng.integers(0, len(SHAPE.triangles), BODIES)]
    share = np.eye(3)[rng.integers(0, 3, BODIES)] if feature == "vertex" else rng.dirichlet([2.0, 2.0, 2.0], BODIES)
    point = np.einsum("gc,gca->ga", share, SHAPE.positions[corner])
    normal = -point / np.linalg.norm(point, axis=1)[:, None] + 0.3 * rng.normal(size=(BODIES, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    bound = (point * normal).sum(1) + EDGE * rng.uniform(0.05, 0.5, BODIES)
    moved = corner[np.arange(BODIES), share.argmax(1)]
    graph = graph_of(bodies, numbering, inverse_mass, "once", np.float64)
    assert graph is not None
    return Case(graph, x, index, corner, share, normal, bound, moved)


def height(case: Case, x: Array) -> Array:
    """(G,) of the pushed points above their planes."""
    return np.einsum("gc,agc,ga->g", case.share, x[:, np.take_along_axis(case.index, case.corner, 1)], case.normal) - case.bound


def separate(case: Case, x: Array) -> None:
    """Feature separation at equal masses: x_i += c_i / sum c^2 (q - p) (paper, eq. 8-9)."""
    push = np.maximum(0, -height(case, x)) / (case.share**2).sum(1)
    x[:, np.take_along_axis(case.index, case.corner, 1)] += np.einsum("g,gc,ga->agc", push, case.share, case.normal)


def errors(case: Case, x: Array) -> Array:
    """(G, C) relative errors of the sticks."""
    ends = x[:, case.index[:, STICKS]]
    return np.abs(np.linalg.norm(ends[..., 1] - ends[..., 0], axis=0) / SHAPE.lengths - 1)


def with_lists(graph: Graph, lists: Lists, over: float) -> Graph:
    """The same bodies relaxed by other lists, a family for each."""
    every = [SEQUENTIAL[0], *lists]
    ends = np.cumsum([0, *map(len, every)])
    size = len(every)
    one = {name: np.repeat(getattr(graph, name)[..., :1], size, axis=-1)
           for name in ("turn", "stride", "particles", "lanes", "sticks")}
    return graph._replace(entry=np.concatenate(every), listed=np.stack([ends[:-1], ends[1:]]), weight=over * graph.weight,
                          family=np.arange(size), start=np.zeros(size + 1, np.int64), **one)


@njit
def relax_largest(x, index, sticks, rest, tolerance, most):
    """Relax the stick that is farthest off, at most so many times a body; returns relaxations and visits."""
    relaxed = visited = 0
    for g in range(len(index)):
        for _ in range(most):
            worst, found = tolerance, -1
            for c in range(len(rest)):
                i, j = index[g, sticks[c, 0]], index[g, sticks[c, 1]]
                d = np.sqrt((x[0, j] - x[0, i])**2 + (x[1, j] - x[1, i])**2 + (x[2, j] - x[2, i])**2)
                if abs(d / rest[c] - 1) > worst:
                    worst, found = abs(d / rest[c] - 1), c
            visited += len(rest)
            if found < 0:
                break
            relaxed += 1
            i, j = index[g, sticks[found, 0]], index[g, sticks[found, 1]]
            dx, dy, dz = x[0, j] - x[0, i], x[1, j] - x[1, i], x[2, j] - x[2, i]
            d = np.sqrt(dx * dx + dy * dy + dz * dz)
            f = 0.5 * (d - rest[found]) / d
            for axis, part in enumerate((f * dx, f * dy, f * dz)):
                x[axis, i] += part
                x[axis, j] -= part
    return relaxed, visited


class Pass(NamedTuple):
    """After a pass, over all bodies; counts and time are of all passes so far, for one body."""

    number: int
    relaxations: float
    visits: float
    us: float
    rms_error: float
    largest_error: float        # mean of the bodies' largest
    depth: float                # mean of what the point is still in, in edges
    done: float                 # part of the bodies


def timed(step: Step, x: Array, number: int) -> tuple[Array, tuple[int, int], float]:
    """What a pass makes of positions, its relaxations and visits, and the least seconds that it takes."""
    least = np.inf
    for _ in range(REPETITIONS):
        y, clock = x.copy(), time.thread_time()
        counts = step(y, number)
        least = min(least, time.thread_time() - clock)
    return y, counts, least


def follow(case: Case, step: Step, tolerance: float, pushes: str) -> Iterator[Pass]:
    """Pass after pass."""
    x = case.x.copy()
    relaxations = visits = seconds = 0.0
    for k in range(PASSES):
        if k == 0 or pushes == "every pass":
            separate(case, x)
        x, (now, seen), least = timed(step, x, k)
        relaxations, visits, seconds = relaxations + now, visits + seen, seconds + least
        found, below = errors(case, x), np.maximum(0, -height(case, x)) / EDGE
        largest = found.max(1)
        fine = largest <= tolerance * (1 + 1e-9)
        if pushes == "every pass":
            fine &= below <= tolerance
        yield Pass(k + 1, relaxations / BODIES, visits / BODIES, 1e6 * seconds / BODIES, float(np.sqrt((found**2).mean())),
                   float(largest.mean()), float(below.mean()), float(fine.mean()))
        if fine.mean() >= DONE:
            return


def runs(case: Case, tolerance: float) -> Iterator[tuple[str, Step]]:
    """Every order as a step."""
    for order, (cycle, over) in ORDERS.items():
        graphs = [with_lists(case.graph, lists, over) for lists in cycle]
        lengths = [sum(len(lists[v]) for v in case.moved) for lists in cycle]
        for graph in graphs:
            sort_bodies(graph, case.moved)

        def step(x: Array, k: int, graphs: list[Graph] = graphs, lengths: list[int] = lengths) -> tuple[int, int]:
            k %= len(graphs)
            return relax_graph(x, graphs[k], tolerance, None), lengths[k]
        yield order, step
    yield "largest", lambda x, k: relax_largest(x, case.index, STICKS, SHAPE.lengths, tolerance, 36)


HEADER = f"{'order':<36}{'passes':>7}{'relaxations':>13}{'ratio':>7}{'visits':>9}{'us':>8}{'ratio':>7}{'rms error':>11}"


def line(order: str, last: Pass, base: Pass) -> str:
    """An order's last pass under HEADER; ratios are to the sequential order."""
    return (f"{order:<36}{last.number:>7}{last.relaxations:>13.1f}{last.relaxations / base.relaxations:>7.2f}{last.visits:>9.0f}"
            f"{last.us:>8.2f}{last.us / base.us:>7.2f}{last.rms_error:>11.2g}" + ("" if last.done >= DONE else "  not done"))


@click.command()
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(results: Path) -> None:
    """Work to the same residual, by order."""
    rows = []
    for feature in ("vertex", "face"):
        made = case(feature)
        for pushes in ("once", "every pass"):
            for tolerance in (0.01, 0.001):
                click.echo(f"\n{feature} pushed {pushes}, tolerance {tolerance:g}; until {DONE:.0%} are done, for a body\n{HEADER}")
                base = None
                for order, step in runs(made, tolerance):
                    step(made.x.copy(), 0)                          # compiled before it is timed
                    passes = list(follow(made, step, tolerance, pushes))
                    kept = passes[:FIRST] + passes[FIRST:][-1:]
                    rows += [[feature, pushes, tolerance, order, *each] for each in kept]
                    last = passes[-1]
                    base = base or last
                    click.echo(line(order, last, base))
    results.mkdir(parents=True, exist_ok=True)
    with (results / "relaxation_residual.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["feature", "pushes", "tolerance", "order", *Pass._fields, "machine"])
        where = report.machine()
        table.writerows([*row[:4], *(float(f"{value:.4g}") for value in row[4:]), where] for row in rows)


if __name__ == "__main__":
    main()
