"""The part of a stick's separation to take back."""

import numpy as np
import pytest

from verlet_numba.physics.distance import deviates, stretch, stretch_approximate

RATIOS = np.geomspace(0.1, 10, 41)


@pytest.mark.parametrize("rest", [1e-6, 0.7, 1e6])
def test_exact_projection_meets_the_rest_length(rest):
    for d in RATIOS * rest:
        assert d - stretch(d * d, rest) * d == pytest.approx(rest, rel=1e-13)
    assert stretch(rest * rest, rest) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("rest", [1e-6, 0.7, 1e6])
def test_approximate_projection_is_jakobsens(rest):
    """One projection gives 2 d r^2 / (d^2 + r^2), never more than r."""
    for d in RATIOS * rest:
        given = d - stretch_approximate(d * d, rest) * d
        assert given == pytest.approx(2 * d * rest**2 / (d**2 + rest**2), rel=1e-13)
        assert given <= rest * (1 + 1e-14)
    assert 3 - stretch_approximate(9.0, 1.0) * 3 == pytest.approx(0.6)
    assert 10 - stretch_approximate(100.0, 1.0) * 10 == pytest.approx(20 / 101)


def test_approximation_is_of_second_order_about_the_rest_length():
    errors = [abs(stretch_approximate((1 + s)**2, 1.0) - stretch((1 + s)**2, 1.0)) for s in (0.02, 0.01, 0.005)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.1)


def test_deviation_is_relative_and_on_both_sides():
    for rest in (1e-3, 1.0, 1e3):
        for ratio, off in ((0.9899, True), (0.9901, False), (1.0, False), (1.0099, False), (1.0101, True)):
            assert bool(deviates((ratio * rest)**2, rest, 0.01)) is off
    assert deviates(1e-12, 0.0, 0.01)


@pytest.mark.parametrize("formula", [stretch, stretch_approximate])
def test_single_precision_is_not_widened(formula):
    assert isinstance(formula(np.float32(2), np.float32(1)), (np.float32, float))
    formula(np.float32(2), np.float32(1))
    float32 = next(signature for signature in formula.from_python.nopython_signatures if "float32" in str(signature.args))
    assert str(float32.return_type) == "float32"
