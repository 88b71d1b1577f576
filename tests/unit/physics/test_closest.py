"""Closest points, against a twin in exact arithmetic and against a grid of points.

The twin holds itself true: d, the vector between two points of convex sets, is the shortest if no corner of the set of
differences lies farther back along it than d itself.
"""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from verlet_numba.physics.closest import of_segments, on_segment, on_triangle

COORDINATE = st.one_of(st.integers(-2, 2).map(float), st.floats(-1, 1), st.floats(-1e-9, 1e-9))
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE)
FOUR = st.tuples(POINT, POINT, POINT, POINT)
SCALE = st.sampled_from([1e-6, 1.0, 1e6])
O, X, Y, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def exact(points):
    return [np.array([Fraction(x) for x in point]) for point in points]


def shortest(differences, faces):
    """Least squared length of a point in the convex hull of some differences, which lies within one of the faces named."""
    found = []
    for first, *others in faces:
        origin, sides = differences[first], [differences[k] - differences[first] for k in others]
        if len(sides) == 2:
            (a, b, c), (e, f) = (sides[0] @ sides[0], sides[0] @ sides[1], sides[1] @ sides[1]), (-side @ origin for side in sides)
            determinant = a * c - b * b
            shares = [(c * e - b * f) / determinant, (a * f - b * e) / determinant] if determinant else [0, 0]
        else:
            shares = [(-side @ origin) / (side @ side) if side @ side else 0 for side in sides]
        found.append((origin + sum(share * side for share, side in zip(shares, sides, strict=True)), shares))
    most = max if len(differences) > 3 else sum          # a parallelogram, or a triangle
    held = [d for d, shares in found if not shares or (min(shares) >= 0 and most(shares) <= 1)]
    best = min((d for d in held if all(d @ corner >= d @ d for corner in differences)), key=lambda d: d @ d)
    return float(best @ best)


def hold(d, squared, differences, faces, size):
    """The vector between the points found, and its square, are those of the twin."""
    expected = shortest(differences, faces)
    assert squared == pytest.approx(expected, rel=1e-13, abs=1e-15 * size**2)
    assert d @ d == pytest.approx(expected, rel=1e-13, abs=1e-15 * size**2)


EDGES = [(0,), (1,), (2,), (3,), (0, 1), (2, 3), (0, 2), (1, 3)]


@given(FOUR, SCALE)
@settings(max_examples=150, deadline=None)
@example((X, O, O, O), 1.0)
@example((Z, O, X, (1.0, 1e-9, 0.0)), 1.0)
@example((Z, O, X, (2.0, 0.0, 0.0)), 1.0)
@example(((0.2, 0.2, 0.0), O, X, Y), 1.0)
def test_point_and_triangle(points, scale):
    p, *corners = scale * np.array(points)
    wa, wb, wc, squared = on_triangle(*p, *np.ravel(corners))
    assert min(wa, wb, wc) >= 0
    assert wa + wb + wc == pytest.approx(1, rel=1e-15)
    differences = [corner - exact([p])[0] for corner in exact(corners)]
    faces = [(0,), (1,), (2,), (0, 1), (1, 2), (2, 0), (0, 1, 2)]
    hold(np.array([wa, wb, wc]) @ corners - p, squared, differences, faces, 4 * scale)


@given(FOUR, SCALE)
@settings(max_examples=150, deadline=None)
@example((O, X, O, X), 1.0)
@example((O, X, Y, (1.0, 1.0, 1e-9)), 1.0)
@example((O, X, (0.5, 0.0, 1.0), (2.0, 0.0, 1.0)), 1.0)
@example((O, O, X, X), 1.0)
@example((O, X, (0.5, -1.0, 0.0), (0.5, 1.0, 0.0)), 1.0)
def test_segments(points, scale):
    p, q, a, b = scale * np.array(points)
    s, t, squared = of_segments(*p, *q, *a, *b)
    assert 0 <= s <= 1
    assert 0 <= t <= 1
    differences = [first - second for first, second in itertools.product(exact([p, q]), exact([a, b]))]
    hold((p + s * (q - p)) - (a + t * (b - a)), squared, differences, [*EDGES, (0, 2, 1)], 4 * scale)


def test_point_and_segment():
    rng = np.random.default_rng(0)
    for p, a, b in rng.normal(size=(50, 3, 3)):
        t, squared = on_segment(*p, *a, *b)
        hold(a + t * (b - a) - p, squared, [corner - exact([p])[0] for corner in exact([a, b])], [(0,), (1,), (0, 1)], 4)
    assert on_segment(*X, *Y, *Y) == (0, 2)


def test_no_point_of_a_grid_is_closer():
    rng = np.random.default_rng(1)
    grid = np.linspace(0, 1, 60)
    u, v = (side.ravel() for side in np.meshgrid(grid, grid))
    weights = np.stack([1 - u - v, u, v])[:, u + v <= 1]
    for four in rng.normal(size=(50, 4, 3)):
        p, a, b, c = four
        nearest = np.linalg.norm(weights.T @ four[1:] - p, axis=1).min()
        assert nearest - 0.2 < on_triangle(*four.ravel())[3]**0.5 <= nearest
        between = np.linalg.norm((p + np.outer(u, a - p)) - (b + np.outer(v, c - b)), axis=1).min()
        assert between - 0.2 < of_segments(*four.ravel())[2]**0.5 <= between


def test_known_cases():
    assert on_triangle(0.25, 0.25, 3.0, *O, *X, *Y) == pytest.approx((0.5, 0.25, 0.25, 9))
    assert on_triangle(-1.0, -1.0, 0.0, *O, *X, *Y) == (1, 0, 0, 2)
    assert of_segments(-1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 3.0, 0.0) == (0.5, 0.25, 1)
