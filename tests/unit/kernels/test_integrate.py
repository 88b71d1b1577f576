"""Verlet's step for all particles."""

import numpy as np
import pytest

from verlet_numba.kernels.integrate import integrate


@pytest.mark.parametrize("real", [np.float64, np.float32])
@pytest.mark.parametrize("accelerated", [True, False])
def test_every_particle_takes_verlets_step(real, accelerated):
    rng = np.random.default_rng(0)
    h, x, previous, a = 0.01, *rng.normal(size=(3, 3, 37)).astype(real)
    start, before = x.copy(), previous.copy()
    integrate(x, previous, a if accelerated else None, h)
    expected = 2 * start.astype(float) - before + (a.astype(float) * h**2 if accelerated else 0)
    np.testing.assert_allclose(x, expected, atol=8 * np.finfo(real).eps * np.abs(expected).max())
    np.testing.assert_array_equal(previous, start)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_what_is_at_rest_stays_to_the_bit(real):
    x = np.array([[0.1], [1e6], [-3e-7]], real)
    here, previous = x.copy(), x.copy()
    for _ in range(10):
        integrate(here, previous, None, 0.01)
    np.testing.assert_array_equal(here, x)


def test_no_acceleration_is_an_acceleration_of_zero():
    rng = np.random.default_rng(1)
    x, previous = rng.normal(size=(2, 3, 21))
    moved, drifted = x.copy(), x.copy()
    integrate(moved, previous.copy(), np.zeros((3, 21)), 0.01)
    integrate(drifted, previous.copy(), None, 0.01)
    np.testing.assert_array_equal(moved, drifted)
