"""A rope at rest: the catenary, continuous and as the chain of sticks that it is here."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

LENGTH, SPAN, SEGMENTS = 1.5, 1.0, 50


def chain():
    """Particles (51, 3) of a chain of sticks under equal weights at its joints.

    The horizontal pull H is the same in every stick, and the vertical pulls of neighbours differ by one weight, so
    stick k climbs with slope c (k - (n - 1)/2), c = weight / H. The sticks' horizontal extents add up to the span.
    """
    offset = np.arange(SEGMENTS) - (SEGMENTS - 1) / 2
    stick = LENGTH / SEGMENTS
    c = brentq(lambda c: stick * (1 / np.hypot(1, c * offset)).sum() - SPAN, 1e-6, 10, xtol=1e-15)
    steps = stick * np.stack([np.ones(SEGMENTS), np.zeros(SEGMENTS), c * offset], 1) / np.hypot(1, c * offset)[:, None]
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]) - [SPAN / 2, 0, 0]


def test_catenary(simulate):
    a = brentq(lambda a: 2 * a * np.sinh(SPAN / (2 * a)) - LENGTH, 0.1, 1, xtol=1e-15)
    sag = a * (np.cosh(SPAN / (2 * a)) - 1)
    assert (a, sag) == pytest.approx((0.30823647, 0.50263326), abs=1e-8)
    assert -chain()[SEGMENTS // 2, 2] == pytest.approx(sag, rel=1e-3)

    run = simulate(Path("validation/catenary.yaml"))
    rope = run.position[-1]
    assert run.measures["speed_max"][-1] < 0.01
    assert -rope[SEGMENTS // 2, 2] == pytest.approx(sag, rel=0.01)
    np.testing.assert_allclose(rope, chain(), rtol=0, atol=0.01 * sag)
    np.testing.assert_allclose(rope, rope[::-1] * [-1, 1, 1], rtol=0, atol=1e-3)


def test_catenary_converges_to_the_chain_of_sticks(simulate):
    """What is left at 40 substeps is stretch: with four times as many it falls to a quarter or less."""
    runs = [simulate(Path("validation/catenary.yaml"), {"solver.substeps": substeps}) for substeps in (40, 160)]
    coarse, fine = (np.abs(run.position[-1] - chain()).max() for run in runs)
    assert fine < coarse / 4
    assert fine < 5e-4
