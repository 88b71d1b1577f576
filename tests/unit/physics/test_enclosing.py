"""Smallest spheres: exact where they are known, and never larger or smaller than a search finds."""

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from verlet_numba.physics.enclosing import sphere_of_four, sphere_of_spheres, sphere_of_three, sphere_of_two

TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(8)
SCALES = [1e-6, 1.0, 1e6]
SMALL = arrays(np.int64, (4, 3), elements=st.integers(-2, 2))        # full of equal, collinear and coplanar points
ANY = arrays(np.float64, (4, 3), elements=st.floats(-1, 1).map(lambda x: round(x, 12)))     # volumes shall not underflow


def smallest(points):
    """(centre, radius) by brute force: the smallest of all circumspheres of subsets that holds all points."""
    best = None
    for count in range(1, len(points) + 1):
        for chosen in combinations(points, count):
            edges = np.array(chosen[1:]) - chosen[0] if count > 1 else np.zeros((1, 3))
            weights = np.linalg.lstsq(2 * edges @ edges.T, np.sum(edges**2, axis=1), rcond=1e-12)[0]
            centre = chosen[0] + weights @ edges
            radius = np.linalg.norm(points - centre, axis=1).max()
            if best is None or radius < best[1]:
                best = centre, radius
    return best


def of_four(points):
    x, y, z, squared, support = sphere_of_four(*np.asarray(points, float).ravel())
    return np.array([x, y, z]), np.sqrt(squared), [k for k in range(4) if support >> k & 1]


def check(points):
    """All there is to a smallest sphere: it holds the points, through its support, whose smallest sphere it is."""
    points = np.asarray(points, float)
    centre, radius, support = of_four(points)
    size = np.ptp(points, axis=0).max()
    assert np.linalg.norm(points - centre, axis=1).max() <= radius * (1 + 1e-9) + 1e-15 * size
    assert np.linalg.norm(points[support] - centre, axis=1) == pytest.approx(radius, rel=1e-6, abs=1e-12 * size)
    assert radius == pytest.approx(smallest(points)[1], rel=1e-9, abs=1e-12 * size)
    return centre, radius, support


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_regular_tetrahedron(scale, order):
    centre, radius, support = of_four(scale * TETRAHEDRON[list(order)])
    assert radius == pytest.approx(0.61237244 * scale, rel=1e-8)
    assert radius == pytest.approx(np.sqrt(3 / 8) * scale, rel=1e-12)
    np.testing.assert_allclose(centre, 0, atol=1e-12 * scale)
    assert support == [0, 1, 2, 3]


@settings(deadline=None)
@given(SMALL)
def test_degenerate_points(points):
    check(points)


@settings(deadline=None)
@given(SMALL, st.sampled_from(SCALES))
def test_no_scale_is_special(points, scale):
    centre, radius, support = of_four(points)
    larger, larger_radius, larger_support = of_four(points * scale)
    np.testing.assert_allclose(larger, centre * scale, atol=1e-10 * scale)
    assert larger_radius == pytest.approx(radius * scale, rel=1e-10)
    if scale == 1.0:
        assert support == larger_support


@settings(deadline=None)
@given(ANY)
def test_any_points(points):
    check(points)


def test_random_points_in_every_order():
    rng = np.random.default_rng(1)
    kinds = set()
    for _ in range(200):
        points = rng.normal(size=(4, 3))
        _, radius, support = check(points)
        kinds.add(len(support))
        for order in permutations(range(4)):
            _, same, turned = of_four(points[list(order)])
            assert same == pytest.approx(radius, rel=1e-12)
            assert sorted(order[k] for k in turned) == support
    assert kinds == {2, 3, 4}


def test_nearly_flat_and_nearly_straight_points():
    rng = np.random.default_rng(2)
    for flat in 10.0 ** -np.arange(1, 17):
        for extent in ([1, 1, flat], [1, flat, flat], [1, flat, 0]):
            for _ in range(20):
                check(rng.normal(size=(4, 3)) * extent)


def test_degenerate_points_far_from_the_origin():
    """Rounding of coordinates leaves points of a plane, a line or one place what they are to each other."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        points = turned_into(rng, rng.integers(0, 2, (4, 3)) * [1.0, 1.0, 0.0]) + rng.normal(size=3) * 10.0 ** rng.integers(0, 7)
        centre, radius, _ = of_four(points)
        expected = smallest(points - points[0])[1]
        assert radius == pytest.approx(expected, rel=1e-6)
        assert np.linalg.norm(points - centre, axis=1).max() <= radius + 1e-15 * np.abs(points).max()


def turned_into(rng, points):
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0]


def test_two_and_three_points():
    assert sphere_of_two(0, 0, 0, 2, 0, 0) == (1, 0, 0, 1)
    x, y, z, squared, support = sphere_of_three(0, 0, 0, 1, 0, 0, 0.5, np.sqrt(0.75), 0)
    np.testing.assert_allclose([x, y, z, squared], [0.5, np.sqrt(1 / 12), 0, 1 / 3], atol=1e-15)
    assert support == 7
    assert sphere_of_three(0, 0, 0, 4, 0, 0, 1, 1, 0)[3:] == (4, 3)       # obtuse at the third
    assert sphere_of_three(1, 1, 1, 1, 1, 1, 1, 1, 1)[:4] == (1, 1, 1, 0)


@settings(deadline=None)
@given(arrays(np.float64, (2, 4), elements=st.floats(-1, 1)), st.sampled_from(SCALES))
def test_two_spheres(spheres, scale):
    spheres = spheres * scale
    spheres[:, 3] = abs(spheres[:, 3])
    *centre, radius = sphere_of_spheres(*spheres.ravel())
    distance = np.linalg.norm(spheres[1, :3] - spheres[0, :3])
    assert (np.linalg.norm(spheres[:, :3] - centre, axis=1) + spheres[:, 3] <= radius + 1e-12 * scale).all()
    assert radius == pytest.approx(max(*spheres[:, 3], (distance + spheres[:, 3].sum()) / 2), abs=1e-14 * scale)
