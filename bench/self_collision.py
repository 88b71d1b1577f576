"""Time of self-collision detection in a folded cloth, and how it grows: `python bench/self_collision.py [--quick]`.

A detection is the update of the sphere tree and its traversal, at a fixed thickness and margin in parts of the lattice's
spacing. Measured with and without the bounds on edges that pass over flat parts. The shapes are those of one sheet at
every resolution: hung, with a few gentle waves, and folded onto itself. Writes self_collision.csv; exit code 1 if a bar
is missed.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import click
import numpy as np
import report
from numpy.typing import NDArray
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.buffers.trees import Layered
from verlet_numba.kernels.sphere_tree import list_pairs, update_layered
from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.numbering import number
from verlet_numba.scene.sphere_trees import candidates_of, layered_of, stack_of

STUDY, RESULTS = "detection", Path(__file__).parent / "results"
SIDES = (40, 80, 160)
THICKNESS, MARGIN = 0.4, 0.1        # of the spacing
EXPONENT = 1.0                      # of the number of particles
Floats = NDArray[np.float64]


def hung(u: Floats) -> Floats:
    """Slope in rad along a sheet that hangs in waves, u in 0..1."""
    return 0.5 * np.pi + 0.8 * np.sin(6 * np.pi * u)


def folded(u: Floats) -> Floats:
    """Slope in rad along a sheet that is laid in four layers, 0.03 of its length from one to the next."""
    turn = 0.015 * np.pi                                # length of a half circle
    return np.pi * sum(np.clip((u - middle) / turn + 0.5, 0, 1) for middle in (0.25, 0.5, 0.75)) % (2 * np.pi)


def placed(side: int, slope: Callable[[Floats], Floats]) -> Floats:
    """(side^2, 3) places of a sheet of edge 1 with this slope along i, waving by a tenth of it along j."""
    u = np.linspace(0, 1, 20 * (side - 1) + 1)
    angle = slope(u)
    x, z = (np.concatenate([[0], np.cumsum(0.5 * (f[1:] + f[:-1]))])[::20] * (u[1] - u[0]) for f in (np.cos(angle), np.sin(angle)))
    i, j = np.divmod(np.arange(side * side), side)
    v = j / (side - 1)
    return np.stack([x[i] + 0.02 * np.sin(4 * np.pi * v), v, z[i]], axis=1)


def detection(side: int, slope: Callable[[Floats], Floats], bounded: bool) -> Callable[[], float]:
    """A job that detects once."""
    spacing = 1 / (side - 1)
    shape = shapes.cloth([1, 1], [side, side], mass=1, thickness=THICKNESS * spacing)
    body = Body("sheet", shape, placed(side, slope)[None], np.zeros((1, side**2, 3)), np.zeros(side**2, bool), (0.0, 0.0), 0.0)
    numbering = number([body])
    layered = layered_of([body], numbering, numbering.size, np.float64, np.zeros((0, 2), np.int64))
    assert layered is not None
    if not bounded:
        layered = without_bounds(layered)
    position = np.zeros((3, numbering.size))
    position[:, numbering.bodies[0][0]] = body.positions[0].T
    inverse_mass, stack, candidates = np.ones(numbering.size), stack_of(layered), candidates_of(100 * side**2)

    def detect() -> None:
        update_layered(position, layered)
        list_pairs(layered, inverse_mass, MARGIN * spacing, True, stack, candidates)

    return lambda: computed(detect)


def without_bounds(layered: Layered) -> Layered:
    """The same tree, all of whose parts are searched."""
    return layered._replace(row=np.full_like(layered.row, -1), node=layered.node[:0])


def measure(quick: bool) -> Iterator[Figure]:
    for slope in (hung, folded):
        for bounded in (True, False):
            how = "bounds on edges" if bounded else "spheres alone"
            times = interleaved(11 if quick else 51, *(detection(side, slope, bounded) for side in SIDES))
            for side, samples in zip(SIDES, times, strict=True):
                yield figure(STUDY, f"{slope.__name__} {side} x {side}", how, "us", samples * 1e6)
            # The least time of each is what others on the machine disturb least.
            exponent = np.polyfit(np.log([side**2 for side in SIDES]), np.log(times.min(axis=1)), 1)[0]
            bar = EXPONENT if bounded else None
            yield figure(STUDY, f"{slope.__name__}, exponent of the growth", how, "1", [exponent], at_most=bar)


@click.command()
@click.option("--quick", is_flag=True, help="Fewer repetitions.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, results: Path) -> None:
    """Measure the detection of self-collision."""
    where, figures = report.machine() + (", quick" if quick else ""), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in measure(quick):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "self_collision.csv")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
