"""Distances and depths of hulls against independent answers.

A distance is proven by its own quadratic programme: the nearest points lie within the hulls, so it is no less than the least
distance, and the plane between them has every corner on its side, so it is no more. Besides, it is coal's.
A depth is that of the hull of all differences.
"""

import coal
import numpy as np
import pytest
from hull_pairs import hulls_of, meetings_for, pairs_of, witnesses
from scipy.spatial import ConvexHull

from verlet_numba.kernels.narrow import collide
from verlet_numba.scene.capacity import narrow_of as scratch

RELATIVE = 1e-9
BATCH = 1000


def random_pairs(rng, pairs, largest, apart):
    """Corners of 2 x pairs hulls of 4 to `largest` points, flat and long ones among them, at scales from 1e-6 to 1e6."""
    points = []
    for _ in range(pairs):
        scale = 10.0 ** rng.uniform(-6, 6)
        direction = rng.normal(size=3)
        for shift in (0.0, apart * rng.uniform(0, 2) * direction / np.linalg.norm(direction)):
            size = int(np.exp(rng.uniform(np.log(4), np.log(largest + 1))))
            points.append(scale * (rng.normal(size=(size, 3)) * 10.0 ** rng.uniform(-1, 0, 3) + shift))
    return points[::2] + points[1::2]


def collided(points, graphs=()):
    """Meetings of hull i with hull n + i, whatever their gap: all of them, in order."""
    n = len(points) // 2
    hulls, meetings = hulls_of(points, graphs=graphs), meetings_for(n)
    assert collide(hulls, pairs_of(range(n), range(n, 2 * n)), meetings, scratch(hulls), np.inf, None)
    assert meetings.listed[0] == n
    return meetings, *witnesses(hulls, meetings)


def check_distances(seed, pairs):
    """Hold one batch to the optimality of its quadratic programmes. Returns how many were apart."""
    rng = np.random.default_rng(seed)
    points = random_pairs(rng, pairs, 1000, 5.0)
    graphs = [h for h, corners in enumerate(points) if len(corners) > 300][:20]
    meetings, first, second = collided(points, graphs)
    apart = 0
    for i in range(pairs):
        normal, gap, size = meetings.normal[:, i], meetings.gap[i], max(np.ptp(points[i]), np.ptp(points[pairs + i]))
        noise = 1e-13 * (size + np.abs(points[i]).max() + np.abs(points[pairs + i]).max())
        assert meetings.weight[:, i].min() >= 0
        np.testing.assert_allclose(first[:, i] - second[:, i], gap * normal, atol=RELATIVE * abs(gap) + noise)
        if gap > 0:
            apart += 1
            assert (points[i] @ normal).min() - (points[pairs + i] @ normal).max() >= gap * (1 - RELATIVE) - noise
    return apart


def test_distances_are_proven_by_their_quadratic_programmes():
    assert sum(check_distances(seed, BATCH) for seed in range(3)) > BATCH


@pytest.mark.validate
def test_many_distances_are_proven_by_their_quadratic_programmes():
    assert sum(check_distances(seed, BATCH) for seed in range(100, 200)) > 30 * BATCH


def convex(points):
    """A coal convex of these corners."""
    hull = ConvexHull(points)
    number = {vertex: k for k, vertex in enumerate(hull.vertices.tolist())}
    corners, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    corners.extend([points[k] for k in hull.vertices])
    for (a, b, c), plane in zip(hull.simplices.tolist(), hull.equations, strict=True):
        out = np.cross(points[b] - points[a], points[c] - points[a]) @ plane[:3] > 0
        faces.append(coal.Triangle(number[a], number[b if out else c], number[c if out else b]))
    return coal.Convex(corners, faces)


def check_coal(seed, pairs):
    rng = np.random.default_rng(seed)
    points = random_pairs(rng, pairs, 200, 8.0)
    meetings, _, _ = collided(points)
    request, pose = coal.DistanceRequest(), coal.Transform3s()
    request.enable_signed_distance, request.gjk_tolerance, request.gjk_max_iterations = False, 1e-12, 1000
    compared = 0
    for i in range(pairs):
        gap = meetings.gap[i]
        unit = max(np.ptp(points[i]), np.ptp(points[pairs + i]))      # coal's tolerances are lengths
        if gap > 1e-3 * unit:
            first, second = convex(points[i] / unit), convex(points[pairs + i] / unit)
            found = coal.distance(first, pose, second, pose, request, coal.DistanceResult())
            assert gap / unit == pytest.approx(found, rel=RELATIVE)
            compared += 1
    return compared


def test_distances_are_coals():
    assert check_coal(2, 600) > 300


@pytest.mark.validate
def test_many_distances_are_coals():
    assert sum(check_coal(seed, BATCH) for seed in range(300, 400)) > 30 * BATCH


def check_depths(seed, pairs):
    """Depths and, where the nearest face is unique, normals of one batch against the hulls of all differences."""
    rng = np.random.default_rng(seed)
    points = random_pairs(rng, pairs, 30, 1.0)
    meetings, first, second = collided(points)
    met = 0
    for i in range(pairs):
        gap, normal = meetings.gap[i], meetings.normal[:, i]
        differences = (points[i][:, None] - points[pairs + i][None]).reshape(-1, 3)
        unit = np.abs(differences).max()
        planes = ConvexHull(differences / unit).equations
        nearest = planes[np.argmax(planes[:, 3])]
        if nearest[3] > -1e-9:
            assert gap >= -1e-8 * unit
            continue
        met += 1
        assert gap == pytest.approx(nearest[3] * unit, rel=RELATIVE, abs=1e-12 * unit)
        np.testing.assert_allclose(first[:, i] - second[:, i], gap * normal, atol=1e-9 * abs(gap) + 1e-12 * unit)
        others = planes[planes[:, :3] @ nearest[:3] < 1 - 1e-6]
        if others[:, 3].max() < nearest[3] - 1e-6:
            np.testing.assert_allclose(-normal, nearest[:3], atol=1e-6)
    return met


def test_hit_faces_are_those_of_all_differences():
    assert check_depths(4, 800) > 300


@pytest.mark.validate
def test_many_hit_faces_are_those_of_all_differences():
    assert sum(check_depths(seed, BATCH) for seed in range(500, 530)) > 1e4
