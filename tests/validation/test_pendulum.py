"""A point mass on a stick, swinging and going round, against elliptic integrals."""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk

G, LENGTH = 9.81, 1.0


def swing(simulate, degrees, substeps, duration):
    """A pendulum let go at rest at an angle from the bottom."""
    angle = np.radians(degrees)
    start = [LENGTH * np.sin(angle), 0, -LENGTH * np.cos(angle)]
    return simulate(Path("validation/pendulum.yaml"), {
        "bodies.pendulum.positions.1": start, "solver.substeps": substeps, "time.duration": duration})


def period(run):
    """From the first to the third passage through the bottom, x = 0, on the cubics through all frames."""
    passages = CubicHermiteSpline(run.time, run.position[:, 1, 0], run.velocity[:, 1, 0]).roots(extrapolate=False)
    return passages[2] - passages[0]


@pytest.mark.parametrize(("degrees", "reference", "tolerance", "fine"), [
    (90, 2.3678419, 0.03, 1e-4), (150, 3.5350982, 0.25, 1e-3), (175, 5.7727849, 0.55, 2e-2)])
def test_period(simulate, degrees, reference, tolerance, fine):
    """At 1/240 s within the price of projecting along the current direction; at 1/1024 of that step, next to nothing."""
    closed = 4 * np.sqrt(LENGTH / G) * ellipk(np.sin(np.radians(degrees) / 2)**2)
    assert closed == pytest.approx(reference, abs=1e-7)
    for substeps, bound in ((4, tolerance), (4096, fine)):
        error = period(swing(simulate, degrees, substeps, 8.0)) / closed - 1
        assert -bound < error < 0, "lost energy makes the swing shorter"


def test_energy_is_only_lost(simulate):
    run = swing(simulate, 90, 4, 5.0)
    energy = run.measures["total_energy"]
    assert energy.max() < 1e-12
    assert -5.0 < energy[-1] < -0.1
    assert run.measures["constraint_error_max"].max() < 1e-14


@pytest.mark.parametrize(("substeps", "tolerance"), [(4, 0.03), (256, 5e-4)])
def test_conical_pendulum(simulate, substeps, tolerance):
    """The time of one round: 2 pi sqrt(L cos(theta) / g) at 60 degrees."""
    closed = 2 * np.pi * np.sqrt(LENGTH * np.cos(np.radians(60)) / G)
    assert closed == pytest.approx(1.4185034, abs=1e-7)
    run = simulate(Path("validation/conical_pendulum.yaml"), {"solver.substeps": substeps})
    x, y = run.position[:, 1, 0], run.position[:, 1, 1]
    turned = np.unwrap(np.arctan2(y, x))
    assert np.interp(2 * np.pi, turned, run.time) == pytest.approx(closed, rel=tolerance)
