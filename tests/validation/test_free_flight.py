"""Flight without constraints or contacts: free fall, drag, momentum, against closed forms and DOP853."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

G = 9.81
THROW = np.array([10.0, 10.0])          # m/s, along x and z


def drag_equation(linear, quadratic):
    """x' = v, v' = -g - (linear + quadratic |v|) v in the xz plane."""
    def rates(t, state):
        v = state[2:]
        return np.concatenate([v, [0, -G] - (linear + quadratic * np.linalg.norm(v)) * v])
    return rates


def thrown(linear, quadratic, time):
    """Where a stone thrown from the origin is after `time` [s], to 13 digits."""
    start = np.concatenate([np.zeros(2), THROW])
    solution = solve_ivp(drag_equation(linear, quadratic), (0, time), start, method="DOP853", rtol=1e-13, atol=1e-13)
    return solution.y[:2, -1]


@pytest.mark.parametrize(("substeps", "tolerance"), [(1, 1e-12), (4, 1e-12), (64, 1e-9)])
def test_free_fall_is_exact_at_every_step(simulate, substeps, tolerance):
    """Exact up to rounding, which grows with the square of the number of steps: sums of sums of it."""
    run = simulate(Path("validation/free_fall.yaml"), {"solver.substeps": substeps})
    np.testing.assert_allclose(run.position[:, 0, 2], -G * run.time**2 / 2, rtol=0, atol=tolerance)
    np.testing.assert_allclose(run.velocity[:, 0, 2], -G * run.time, rtol=0, atol=10 * tolerance)
    assert run.position[-1, 0, 2] == pytest.approx(-4.905, rel=0, abs=tolerance)


def test_throw_is_exact_in_every_direction(simulate):
    velocity, gravity = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -9.81])
    run = simulate(Path("validation/free_fall.yaml"),
                   {"bodies.stone.velocity": velocity.tolist(), "effects.gravity": gravity.tolist()})
    expected = velocity * run.time[:, None] + gravity * run.time[:, None]**2 / 2
    np.testing.assert_allclose(run.position[:, 0], expected, rtol=0, atol=1e-12)


def test_linear_drag(simulate):
    k, t = 0.4, 1.0
    lost = -np.expm1(-k * t) / k
    closed = np.array([THROW[0] * lost, (THROW[1] + G / k) * lost - G * t / k])
    np.testing.assert_allclose(closed, thrown(k, 0, t), rtol=0, atol=1e-11)
    run = simulate(Path("validation/linear_drag.yaml"))
    np.testing.assert_allclose(run.position[-1, 0], [closed[0], 0, closed[1]], rtol=0, atol=1e-4)


def test_quadratic_drag(simulate):
    x, z = thrown(0, 0.05, 1.0)
    run = simulate(Path("validation/quadratic_drag.yaml"))
    np.testing.assert_allclose(run.position[-1, 0], [x, 0, z], rtol=0, atol=1e-4)


def test_terminal_speed(simulate):
    """At rest against the air, dv/dt = 0: v = sqrt(g/k). The approach, exp(-2 g t / v), is over after 20 s."""
    run = simulate(Path("validation/quadratic_drag.yaml"), {"bodies.stone.velocity": [0, 0, 0], "time.duration": 20})
    np.testing.assert_allclose(run.velocity[-1, 0], [0, 0, -np.sqrt(G / 0.05)], rtol=0, atol=1e-9)


def test_tumbling_box_keeps_its_momentum(simulate):
    run = simulate(Path("validation/tumbling_box.yaml"))
    momentum, velocity = run.measures["momentum"], np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(momentum, np.broadcast_to(2 * velocity, momentum.shape), rtol=0, atol=7.5e-12)
    np.testing.assert_allclose(run.measures["centre_of_mass"], velocity * run.time[:, None], rtol=0, atol=1e-12)


def test_tumbling_box_has_the_inertia_of_its_particles(simulate):
    """8 particles at (±a, ±b, ±c)/2 have the moments M (b^2 + c^2)/4 and so on; L = I w for w = (4, 1, 2) rad/s."""
    run = simulate(Path("validation/tumbling_box.yaml"), {"solver.substeps": 64, "time.duration": 0})
    moments = 2 / 4 * np.array([0.3**2 + 0.2**2, 0.4**2 + 0.2**2, 0.4**2 + 0.3**2])
    np.testing.assert_allclose(run.measures["angular_momentum"][0], moments * [4, 1, 2], rtol=1e-5)
