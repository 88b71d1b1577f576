"""Drag against an integrator of high order, damping against its closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from verlet_numba.physics.resistance import damped, drag
from verlet_numba.scene.forces import decay

START = np.array([3.0, -1.0, 2.0])
AIR = np.array([1.0, 2.0, -0.5])
GRAVITY = np.array([0.0, 0.0, -9.81])


def error_of_one_step(linear, quadratic, h):
    """How far Verlet's next position is off, from exact positions at -h and 0; v(0) = START."""
    def slope(_, state):
        relative = state[3:] - AIR
        return np.r_[state[3:], GRAVITY - (linear + quadratic * np.linalg.norm(relative)) * relative]
    before, after = (solve_ivp(slope, (0, t), np.r_[np.zeros(3), START], "DOP853", rtol=1e-13, atol=1e-15).y[:3, -1]
                     for t in (-h, h))
    a = np.array(drag(*GRAVITY, *-before, *AIR, linear, quadratic, h))
    return np.linalg.norm(-before + a * h * h - after)


@pytest.mark.parametrize(("linear", "quadratic"), [(2.0, 0.0), (0.0, 0.5), (1.0, 0.3)])
def test_drag_is_of_second_order(linear, quadratic):
    """A local error of h^4 in the position, h^3 in the velocity, is a global one of h^2."""
    errors = [error_of_one_step(linear, quadratic, h) for h in (0.04, 0.02, 0.01)]
    assert errors[0] < 1e-3
    assert np.log2(errors[0] / errors[1]) > 3.4
    assert np.log2(errors[1] / errors[2]) > 3.6


def test_terminal_velocity_is_kept_exactly():
    """Where drag balances gravity at a constant velocity, nothing is left of the acceleration."""
    speed, h = 4.0, 0.01
    quadratic = 9.81 / speed**2
    np.testing.assert_allclose(drag(0, 0, -9.81, 0, 0, -speed * h, 0, 0, 0, 0.0, quadratic, h), 0, atol=1e-12)
    np.testing.assert_allclose(drag(0, 0, 0, *(AIR * h), *AIR, 3.0, 2.0, h), 0, atol=1e-12)


@pytest.mark.parametrize("k", [1.0, 100.0, 1e6])
def test_strong_linear_resistance_never_turns_the_velocity_round_by_more_than_it_was(k):
    h, displacement = 0.01, 0.03
    following = displacement + drag(0.0, 0.0, 0.0, displacement, 0.0, 0.0, 0.0, 0.0, 0.0, k, 0.0, h)[0] * h * h
    assert abs(following) <= displacement


def test_no_drag_changes_nothing():
    assert drag(1.5, -2.5, 0.3, 0.01, 0.02, 0.03, 1.0, 2.0, 3.0, 0.0, 0.0, 0.01) == (1.5, -2.5, 0.3)


@pytest.mark.parametrize("rate", [1e-9, 0.3, 5.0, 400.0])
def test_damping_is_exact_at_any_step(rate):
    """x = (v0 - a/r)(1 - exp(-r t))/r + a t/r at three times a step apart."""
    v0, a, h = 3.0, -9.81, 0.05

    def x(t):
        return (v0 - a / rate) * -np.expm1(-rate * t) / rate + a * t / rate if rate > 1e-6 else v0 * t + a * t * t / 2

    for t in (0.0, 0.4):
        displacement = x(t) - x(t - h)
        following = displacement + damped(a, displacement, *decay(np.array(rate), h)) * h * h
        assert following == pytest.approx(x(t + h) - x(t), rel=1e-8 if rate < 1e-6 else 1e-11, abs=1e-14 * abs(displacement))


def test_no_damping_changes_nothing():
    assert damped(1.25, 3.0, *decay(np.array(0.0), 0.01)) == 1.25
