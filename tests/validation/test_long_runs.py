"""Verlet's step alone over a million steps of a harmonic force: no drift, and the way back leads home (paper, 3.1)."""

import numba
import numpy as np
import pytest

from verlet_numba.kernels.integrate import integrate

STEPS = 1_000_000
H, OMEGA = 1.0, 0.05            # w h = 0.05


@numba.njit
def oscillate(position, previous, steps, energies, invariants):
    """`steps` steps under a = -w^2 x: energies [J] of a unit mass, from central differences, and what is conserved."""
    acceleration = np.zeros_like(position)
    for step in range(steps):
        x, before = position[0, 0], previous[0, 0]
        acceleration[0, 0] = -OMEGA**2 * x
        integrate(position, previous, acceleration, H)
        v = (position[0, 0] - before) / (2 * H)
        kinetic, potential = 0.5 * v * v, 0.5 * OMEGA**2 * x * x
        energies[step] = kinetic + potential
        invariants[step] = kinetic / (1 - (OMEGA * H)**2 / 4) + potential


@pytest.fixture(scope="module")
def there():
    """A million steps from rest at x = 1: the start, the end, and what was measured on the way."""
    first = np.array([[1.0], [0.0], [0.0]])
    position = first.copy()
    previous = first * (1 - (OMEGA * H)**2 / 2)         # at rest at time 0
    start = position.copy(), previous.copy()
    energies, invariants = np.empty(STEPS), np.empty(STEPS)
    oscillate(position, previous, STEPS, energies, invariants)
    return start, (position, previous), energies, invariants


def test_energy_stays_in_its_band(there):
    """x_n = cos(n s), sin(s/2) = w h/2, so v_n = -sin(n s) sin(s)/h with sin(s)/h = w sqrt(1 - (w h)^2/4).

    The energy so measured is w^2/2 (1 - sin(n s)^2 (w h)^2/4): a band of ±(w h)^2/8 about its middle.
    """
    energies = there[2]
    middle = OMEGA**2 / 2 * (1 - (OMEGA * H)**2 / 8)
    relative = energies / middle - 1
    band = (OMEGA * H)**2 / 8
    assert band == pytest.approx(3.125e-4)
    assert np.abs(relative).max() <= band * (1 + 1e-3)
    assert np.abs(relative).max() >= band * (1 - 1e-2), "the band is filled"


def test_energy_does_not_drift(there):
    """With the kinetic part divided by 1 - (w h)^2/4 the energy is constant; what is left is rounding."""
    invariants = there[3]
    assert np.abs(invariants / (OMEGA**2 / 2) - 1).max() < 1e-10


def test_the_way_back_leads_home(there):
    """Swapped, position and previous run the same steps backwards: the scheme is symmetric in time."""
    start, end, _, _ = there
    position, previous = end[1].copy(), end[0].copy()
    assert np.abs(position - start[1]).max() > 1e-3, "it is somewhere else"
    oscillate(position, previous, STEPS, np.empty(STEPS), np.empty(STEPS))
    np.testing.assert_allclose(position, start[1], rtol=0, atol=1e-10)
    np.testing.assert_allclose(previous, start[0], rtol=0, atol=1e-10)
