"""Relaxation of distance constraints against the naive twin, one constraint after another."""

import numpy as np
import pytest
from reference_constraints import relax_stick
from stick_cases import Case, H

from verlet_numba.buffers.constraints import Sticks
from verlet_numba.kernels.relax import forget, relax_runs, relax_sticks

PASSES = 3
TOLERANCE = {np.float64: 1e-12, np.float32: 2e-4}
WAYS = [(None, None, False), (0.1, None, False), (None, 1, False), (0.1, 1, False), (None, None, True), (0.1, 1, True)]


def relaxed(relax, case, constraints, tolerance, approximate):
    """Positions after some passes, and how many constraints were relaxed."""
    x = case.x.copy()
    forget(case.softness)
    return x, sum(relax(x, constraints, case.softness, tolerance, approximate) for _ in range(PASSES))


@pytest.mark.parametrize(("tolerance", "approximate", "soft"), WAYS)
@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_runs_are_the_twins_and_sticks_are_runs(real, tolerance, approximate, soft):
    case = Case(real, soft)
    x, count = relaxed(relax_runs, case, case.runs, tolerance, approximate)
    twin = case.x.T.astype(float)
    expected = sum(relax_stick(twin, case.w, stick, H, tolerance or 0.0, approximate is not None)
                   for _ in range(PASSES) for stick in case.twins)
    np.testing.assert_allclose(x.T, twin, atol=TOLERANCE[real])
    assert count == expected
    assert x.dtype == real
    assert not np.allclose(x, case.x)
    singly, singly_count = relaxed(relax_sticks, case, case.sticks, tolerance, approximate)
    np.testing.assert_array_equal(singly, x)
    assert singly_count == count


def test_forgotten_tension_starts_anew():
    case = Case(np.float64, soft=True)
    once = relaxed(relax_runs, case, case.runs, None, None)[0]
    assert case.softness.given.any()
    np.testing.assert_array_equal(relaxed(relax_runs, case, case.runs, None, None)[0], once)


def test_particles_in_one_place_stay_finite():
    """Attachments have rest length 0, and a stick's ends may meet."""
    for rest in (0.0, 1.0):
        sticks = Sticks(np.array([[0], [1]]), np.array([rest]), np.array([[0.5], [0.5]]))
        x = np.ones((3, 2))
        relax_sticks(x, sticks, None, None, None)
        np.testing.assert_array_equal(x, 1)
    x = np.array([[0.0, 1], [0, 0], [0, 0]])
    relax_sticks(x, Sticks(np.array([[0], [1]]), np.zeros(1), np.array([[0.25], [0.75]])), None, None, None)
    np.testing.assert_allclose(x[0], 0.25)


def test_nothing_to_relax_is_nothing():
    x = np.ones((3, 2))
    assert relax_runs(x, None, None, None, None) == 0
    assert relax_sticks(x, None, None, None, None) == 0
