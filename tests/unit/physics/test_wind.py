"""The wind's force on a triangle."""

import numpy as np
import pytest

from verlet_numba.physics.wind import pressure


def test_force_is_the_vector_formula():
    rng = np.random.default_rng(0)
    for _ in range(100):
        ab, ac, u = rng.normal(size=(3, 3))
        cross = np.cross(ab, ac)
        area, n = np.linalg.norm(cross) / 2, cross / np.linalg.norm(cross)
        np.testing.assert_allclose(pressure(*ab, *ac, *u, 0.0, 0.0), area * abs(u @ n) * (u @ n) * n, rtol=1e-12)


def test_unit_square_half_across_the_wind():
    """Area 1/2 m^2, 3 m/s along the normal: F = density/2 * 1/2 * 9 along the wind, whichever way the triangle is wound."""
    for edges in ((1, 0, 0, 0, 1, 0), (0, 1, 0, 1, 0, 0)):
        assert pressure(*edges, 0.0, 0.0, 3.0, 0.0, 0.0) == pytest.approx((0, 0, 4.5))
        assert pressure(*edges, 0.0, 0.0, -3.0, 0.0, 0.0) == pytest.approx((0, 0, -4.5))
        assert pressure(*edges, 5.0, 7.0, 0.0, 0.0, 0.0) == (0, 0, 0)


def test_triangle_without_area_feels_nothing():
    assert pressure(1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0) == (0, 0, 0)
    assert pressure(*[0.0] * 6, 1.0, 2.0, 3.0, 0.0, 0.0) == (0, 0, 0)


def test_single_precision_is_not_widened():
    pressure(*[np.float32(1)] * 11)
    signature = next(s for s in pressure.from_python.nopython_signatures if "float32" in str(s.args))
    assert "float32" in str(signature.return_type)


def test_force_gives_way_by_what_the_step_lets_it():
    """|u.c| = 3 m^3/s: the force is divided by 1 + yielding |u.c| / 2."""
    assert pressure(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 3.0, 0.5, 0.0) == pytest.approx((0, 0, 4.5 / 1.75))
