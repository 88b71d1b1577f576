"""How a set of particles answers to an impulse as a whole."""

import numpy as np
import pytest

from verlet_numba.physics.rigid import cross, inverse_symmetric, lever, times_symmetric


def entries(matrix):
    """xx, yy, zz, xy, xz, yz."""
    return matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def inertias(count=30):
    rng = np.random.default_rng(0)
    for _ in range(count):
        r, m = rng.normal(size=(5, 3)), rng.uniform(0.1, 2, 5)
        r -= m @ r / m.sum()
        yield m.sum(), sum(mass * (a @ a * np.eye(3) - np.outer(a, a)) for mass, a in zip(m, r, strict=True)), rng


def test_inverse_and_product_of_symmetric_matrices():
    for _, inertia, rng in inertias():
        np.testing.assert_allclose(inverse_symmetric(*entries(inertia)), entries(np.linalg.inv(inertia)), rtol=1e-9, atol=1e-12)
        v = rng.normal(size=3)
        np.testing.assert_allclose(times_symmetric(*entries(inertia), *v), inertia @ v, rtol=1e-12)


def test_particles_on_a_line_or_in_a_point_answer_as_if_they_could_not_turn():
    assert inverse_symmetric(*entries(np.diag([0.0, 2.0, 2.0]))) == (0,) * 6
    assert inverse_symmetric(*[0.0] * 6) == (0,) * 6


def test_lever_is_the_answer_to_a_unit_impulse():
    for mass, inertia, rng in inertias():
        r, n = rng.normal(size=(2, 3))
        n /= np.linalg.norm(n)
        inverse = np.linalg.inv(inertia)
        arm = np.cross(r, n)
        found = lever(*r, *n, 1 / mass, tuple(entries(inverse)))
        np.testing.assert_allclose(found[:3], arm, rtol=1e-12)
        np.testing.assert_allclose(found[3:6], inverse @ arm, rtol=1e-9)
        moved = n / mass + np.cross(inverse @ arm, r)
        assert found[6] == pytest.approx(moved @ n)


def test_cross():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 3))
    np.testing.assert_allclose(cross(*a, *b), np.cross(a, b), rtol=1e-14)
