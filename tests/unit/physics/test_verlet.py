"""Verlet's step."""

import numpy as np
import pytest

from verlet_numba.physics.verlet import verlet


def test_step_is_two_x_minus_the_previous_plus_the_push():
    assert verlet(3.0, 2.5, 0.25) == 3.75


def test_parabola_is_exact():
    h, g, v = 1 / 64, -9.75, 3.5

    def x(t):
        return 2 + v * t + g * t * t / 2

    assert verlet(x(h), x(0), g * h * h) == pytest.approx(x(2 * h), abs=1e-15)


def test_step_is_reversible():
    """Paper: the scheme is time-reversible."""
    rng = np.random.default_rng(0)
    for now, before, push in rng.normal(size=(20, 3)):
        after = verlet(now, before, push)
        assert verlet(now, after, push) == pytest.approx(before, abs=1e-14)
