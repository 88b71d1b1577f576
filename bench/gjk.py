"""Narrow phase: `python bench/gjk.py [--quick]`, pairs of icosahedra in random poses, about half of them intersecting.

Prints a table of microseconds a query and writes results/gjk.csv. Exit code 1 if a bar is missed. Coal (C++) answers the same
queries in the same run, one Python call each.
"""

from collections.abc import Callable
from pathlib import Path

import click
import coal
import numpy as np
import report
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from timing import computed, interleaved

from verlet_numba.buffers.hulls import Hulls, Pairs
from verlet_numba.kernels.gjk import MET, gjk
from verlet_numba.kernels.narrow import collide
from verlet_numba.scene.capacity import meetings_of
from verlet_numba.scene.capacity import narrow_of as scratch
from verlet_numba.scene.capacity import pairs_of as empty_pairs
from verlet_numba.scene.shapes import icosahedron

Floats = NDArray[np.float64]

RESULTS = Path(__file__).parent / "results"
PAIRS, CORNERS = 100_000, 12
NUDGE = 1e-3            # of the radius: how far bodies move from one query to the next
COALS = 5000            # pairs that coal is asked for


def poses(rng: np.random.Generator) -> Floats:
    """Corners (2 pairs, 12, 3) of bodies of radius 1: first ones, then second ones at distances of 1 to 2.6."""
    turns = Rotation.random(2 * PAIRS, random_state=rng).as_matrix()
    corners = np.einsum("nij,kj->nki", turns, icosahedron(1.0, mass=1.0).positions)
    direction = rng.normal(size=(PAIRS, 3))
    direction *= (rng.uniform(1.0, 2.6, PAIRS) / np.linalg.norm(direction, axis=1))[:, None]
    corners[PAIRS:] += direction[:, None]
    return corners


def hulls_of(corners: Floats) -> Hulls:
    """The bodies as hulls whose corners are scanned."""
    bodies = len(corners)
    none, corner = np.full(bodies, -1), np.ascontiguousarray(corners.reshape(-1, 3).T)
    return Hulls(body=none, start=CORNERS * np.arange(bodies + 1), size=np.full(bodies, CORNERS),
                 particle=np.full(bodies * CORNERS, -1), corner=corner, centre=np.ascontiguousarray(corners.mean(axis=1).T),
                 solid=none, local=np.zeros_like(corner), reach=np.full(bodies, 1.0 + 1e-9), rounding=np.zeros(bodies),
                 flat=np.zeros_like(none), graph=none, neighbours=np.zeros(1, np.int64), neighbour=np.zeros(0, np.int64))


def pairs_of() -> Pairs:
    """Body i and body pairs + i, knowing nothing of each other."""
    pairs = empty_pairs(PAIRS)
    pairs.listed[0], pairs.first[:], pairs.second[:], pairs.face[:] = PAIRS, np.arange(PAIRS), np.arange(PAIRS, 2 * PAIRS), -1
    return pairs


@njit
def distances(points, start, centre, neighbours, neighbour, seen, vertex, label, weight):
    """Distances of all pairs, one after another, from the direction of their centres. Returns how many pairs intersect."""
    met = 0
    for i in range(PAIRS):
        j = PAIRS + i
        status, _, _, _, _ = gjk(points, neighbours, neighbour, seen, start[i], CORNERS, -1, start[j], CORNERS, -1,
                                 centre[0, i] - centre[0, j], centre[1, i] - centre[1, j], centre[2, i] - centre[2, j], np.inf,
                                 vertex, label, weight)
        met += status == MET
    return met


def narrow_jobs() -> tuple[list[Callable[[], float]], float]:
    """Distance cold, distance coherent, hit face cold, hit face cached, each in seconds of one round; the share that intersects."""
    rng = np.random.default_rng(0)
    corners = poses(rng)
    hulls, nudged = hulls_of(corners), hulls_of(corners + NUDGE * rng.normal(size=(2 * PAIRS, 1, 3)))
    narrow, pairs = scratch(hulls), pairs_of()
    meetings = meetings_of(PAIRS)
    arguments = (hulls.corner, hulls.start, hulls.centre, hulls.neighbours, hulls.neighbour, narrow.seen, narrow.vertex,
                 narrow.label, narrow.weight)

    def learnt(margin: float) -> tuple[Floats, NDArray[np.int64]]:
        pairs.axis[:], pairs.face[:] = 0.0, -1
        assert collide(hulls, pairs, meetings, narrow, margin, True)
        return pairs.axis.copy(), pairs.face.copy()

    def again(margin: float, known: tuple[Floats, NDArray[np.int64]]) -> Callable[[], float]:
        def job() -> float:
            pairs.axis[:], pairs.face[:] = known
            return computed(lambda: collide(nudged, pairs, meetings, narrow, margin, True))
        return job

    jobs = [lambda: computed(lambda: distances(*arguments)), again(np.inf, learnt(np.inf)),
            lambda: computed(lambda: collide(hulls, pairs, meetings, narrow, 0.0, None)), again(0.0, learnt(0.0))]
    return jobs, distances(*arguments) / PAIRS


def coal_job(signed: bool) -> Callable[[], float]:
    """Coal's distance, or with depth and nearest points where they intersect; seconds a round."""
    shape = icosahedron(1.0, mass=1.0).positions
    hull = ConvexHull(shape)
    corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners.extend(list(shape))
    for (a, b, c), plane in zip(hull.simplices.tolist(), hull.equations, strict=True):
        out = np.cross(shape[b] - shape[a], shape[c] - shape[a]) @ plane[:3] > 0
        faces.append(coal.Triangle(a, *((b, c) if out else (c, b))))
    body, rng = coal.Convex(corners, faces), np.random.default_rng(0)
    turns = Rotation.random(2 * COALS, random_state=rng).as_matrix()
    direction = rng.normal(size=(COALS, 3))
    direction *= (rng.uniform(1.0, 2.6, COALS) / np.linalg.norm(direction, axis=1))[:, None]
    places = [(coal.Transform3s(turns[i], np.zeros(3)), coal.Transform3s(turns[COALS + i], direction[i])) for i in range(COALS)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = signed

    def job() -> float:
        def ask() -> None:
            for first, second in places:
                result.clear()
                coal.distance(body, first, body, second, request, result)
        return computed(ask)
    return job


@click.command()
@click.option("--quick", is_flag=True, help="Fewer repetitions.")
def main(quick: bool) -> None:
    """Measure the narrow phase."""
    where = report.machine() + (", quick" if quick else "")
    jobs, met = narrow_jobs()
    case = f"icosahedra, {met:.0%} intersect"
    times = 1e6 / PAIRS * interleaved(5 if quick else 21, *jobs)
    coals = 1e6 / COALS * interleaved(5 if quick else 21, coal_job(False), coal_job(True))
    bars = {"distance, cold": 0.6, "distance, coherent": 0.3, "hit face, cold": 1.5, "hit face, cached": 0.3}
    figures = [report.figure("gjk", case, quantity, "us", found, at_most=bar)
               for (quantity, bar), found in zip(bars.items(), times, strict=True)]
    figures += [report.figure("gjk", case, quantity, "us", found)
                for quantity, found in zip(("coal, distance", "coal, signed distance"), coals, strict=True)]
    click.echo("\n".join([where, report.HEADER, *map(report.line, figures)]))
    RESULTS.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, RESULTS / "gjk.csv")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
