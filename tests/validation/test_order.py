"""The order of convergence over six halvings of the step: second where nothing is projected, first where sticks are."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

G = 9.81
HALVINGS = 2 ** np.arange(7)


def slopes(errors):
    """Order from each step to its half."""
    return np.log2(np.array(errors[:-1]) / errors[1:])


def final(simulate, scene, overrides, substeps):
    """Positions (N, 3) at the end of the run for each number of substeps."""
    runs = [simulate(Path(f"validation/{scene}.yaml"), {**overrides, "solver.substeps": int(n)}) for n in substeps]
    return [run.position[-1] for run in runs]


def integrated(rates, start, time):
    return solve_ivp(rates, (0, time), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize(("scene", "linear", "quadratic"), [("linear_drag", 0.4, 0.0), ("quadratic_drag", 0.0, 0.05)])
def test_drag_is_of_second_order(simulate, scene, linear, quadratic):
    def rates(t, state):
        v = state[2:]
        return [*v, *([0, -G] - (linear + quadratic * np.hypot(*v)) * v)]
    x, z = integrated(rates, [0, 0, 10, 10], 1.0)[:2]
    errors = [np.linalg.norm(p[0] - [x, 0, z]) for p in final(simulate, scene, {}, HALVINGS)]
    np.testing.assert_allclose(slopes(errors), 2, atol=0.15)


def test_pendulum_is_of_first_order_with_the_current_direction(simulate):
    """Angle from the bottom: theta'' = -g/L sin(theta), from rest at 90 degrees."""
    theta = integrated(lambda t, s: [s[1], -G * np.sin(s[0])], [np.pi / 2, 0], 1.0)[0]
    places = final(simulate, "pendulum", {"time.duration": 1.0}, 4 * HALVINGS)
    errors = [np.linalg.norm(p[1] - [np.sin(theta), 0, -np.cos(theta)]) for p in places]
    np.testing.assert_allclose(slopes(errors), 1, atol=0.15)


def test_dumbbell_is_of_first_order_with_the_current_direction(simulate):
    """The angle it has turned by after 0.5 s should be 5 rad."""
    places = final(simulate, "spinning_dumbbell", {"time.duration": 0.5}, 16 * HALVINGS)
    expected = 0.5 * np.array([np.cos(5), np.sin(5), 0])
    errors = [np.linalg.norm(p[1] - expected) for p in places]
    np.testing.assert_allclose(slopes(errors), 1, atol=0.15)


def test_tumbling_box_loses_angular_momentum_in_proportion_to_the_step(simulate):
    truth, errors = [0.26, 0.1, 0.25], []
    for substeps in 8 * HALVINGS:
        run = simulate(Path("validation/tumbling_box.yaml"), {"solver.substeps": int(substeps), "time.duration": 0.5})
        errors.append(np.linalg.norm(run.measures["angular_momentum"][-1] - truth))
    np.testing.assert_allclose(slopes(errors), 1, atol=0.15)
