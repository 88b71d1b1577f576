"""Free rotation: what projection along the current direction of a stick costs, and inertia from particles alone."""

from pathlib import Path

import numpy as np
import pytest


def spun_down(w0, h, t):
    """Spin [rad/s] after t [s] of projection along the current direction.

    In a step of h each mass flies h v along the tangent, to the distance r sqrt(1 + (w h)^2), and is brought back to r:
    it turns by atan(w h). The displacement that it carries on, the chord of that angle, is shorter along the next
    tangent: to leading order dw/dt = -h w^3, so w = w0 / sqrt(1 + 2 w0^2 h t).
    """
    return w0 / np.sqrt(1 + 2 * w0**2 * h * t)


@pytest.mark.parametrize(("substeps", "time", "expected"), [(1, 1, 4.80384), (1, 10, 1.70664), (10, 1, 8.66025)])
def test_dumbbell_spins_down(simulate, substeps, time, expected):
    run = simulate(Path("validation/spinning_dumbbell.yaml"), {"solver.substeps": substeps, "time.duration": time})
    law = spun_down(10, 1 / (60 * substeps), time)
    assert law == pytest.approx(expected, abs=5e-6)
    np.testing.assert_allclose(run.measures["angular_momentum"][-1], [0, 0, 0.5 * law], rtol=0.01, atol=1e-12)
    assert np.abs(run.measures["momentum"]).max() < 1e-12


def test_tumbling_box_spins_down_no_faster_than_a_dumbbell(simulate):
    """Sticks along the axis of spin do not shorten it, so a body keeps at least what the law leaves a dumbbell."""
    run = simulate(Path("validation/tumbling_box.yaml"))
    left = np.linalg.norm(run.measures["angular_momentum"], axis=1)
    law = spun_down(np.sqrt(21), 1 / (60 * 16), 1.0)
    assert law / np.sqrt(21) * 0.999 < left[-1] / left[0] < 1 - 0.5 * (1 - law / np.sqrt(21))
    assert (np.diff(left) < 1e-12).all()


def test_icosahedron_turns_like_a_spherical_shell(simulate):
    """L = 2/3 M R^2 w whatever the axis: (1, 2, 2) kg m^2/s for w = (2, 4, 4) rad/s, M = 3 kg, R = 0.5 m."""
    run = simulate(Path("validation/icosahedron_inertia.yaml"), {"solver.substeps": 1024})
    np.testing.assert_allclose(run.measures["angular_momentum"][0], [1, 2, 2], rtol=1e-6)
    np.testing.assert_allclose(run.measures["angular_momentum"][-1], [1, 2, 2], rtol=1e-3)
