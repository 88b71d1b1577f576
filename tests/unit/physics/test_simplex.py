"""Points of simplices nearest the origin, against non-negative least squares and in degenerate positions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls

from verlet_numba.physics.simplex import segment, tetrahedron, triangle

FORMULAS = {2: segment, 3: triangle, 4: tetrahedron}


def weights_of(points):
    weights = np.array(FORMULAS[len(points)](*points.ravel()))
    assert weights.min() >= 0
    assert weights.sum() == pytest.approx(1, abs=1e-12)
    return weights


def oracle(points):
    """Distance of the origin from the hull of points (n, 3): non-negative least squares with a heavy row for the sum."""
    size = np.abs(points).max()
    scaled, best = points / size, np.inf
    for heavy in (1e2, 1e4, 1e6):
        found, _ = nnls(np.vstack([scaled.T, np.full(len(points), heavy)]), np.array([0.0, 0.0, 0.0, heavy]), maxiter=200)
        best = min(best, np.linalg.norm(found / found.sum() @ scaled))
    return best * size


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_nearest_point_is_the_oracles(n, scale):
    rng = np.random.default_rng(n)
    carried = set()
    for _ in range(300):
        points = scale * (rng.normal(size=(n, 3)) + rng.normal(size=3))
        weights = weights_of(points)
        carried.add(tuple((weights > 0).tolist()))
        found = np.linalg.norm(weights @ points)
        assert found == pytest.approx(oracle(points), rel=1e-9, abs=1e-9 * scale)
    assert len(carried) == 2 ** n - 1           # every vertex, edge, face and the inside took part


@pytest.mark.parametrize("n", [3, 4])
@pytest.mark.parametrize("rank", [0, 1, 2])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_flat_simplices_are_as_good(n, rank, scale):
    """Repeated, collinear and coplanar vertices, exactly so and to rounding."""
    rng = np.random.default_rng(10 * n + rank)
    for k in range(300):
        basis = rng.normal(size=(rank, 3)) if k % 2 else rng.integers(-2, 3, (rank, 3))
        points = scale * (rng.integers(-2, 3, (n, rank)) @ basis + (rng.normal(size=3) if k % 3 else 0.0))
        if not np.any(points):
            continue
        weights = weights_of(points)
        assert np.linalg.norm(weights @ points) == pytest.approx(oracle(points), rel=1e-9, abs=1e-9 * scale)


@given(arrays(float, (4, 3), elements=st.floats(-1, 1, allow_subnormal=False).map(lambda x: round(x, 3))), st.integers(2, 4))
@settings(max_examples=300, deadline=None)
def test_no_vertex_is_nearer_along_the_point_found(points, n):
    """The condition of the nearest point v: no vertex w has v . w < v . v."""
    points = points[:n]
    v = weights_of(points) @ points
    assert (points @ v).min() >= v @ v - 1e-12


def test_a_simplex_far_away_keeps_its_digits():
    """Only differences count: a small triangle far off is met where its neighbourhood says."""
    corners = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]])
    points = corners - [2.5e-4, 2.5e-4, -1e4]
    np.testing.assert_allclose(weights_of(points), [0.5, 0.25, 0.25], atol=1e-8)
