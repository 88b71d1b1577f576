"""Relaxation of distance constraints against the naive twin, one constraint after another."""

import numpy as np
import pytest
from reference import Stick, relax_stick

from verlet_numba.buffers import Runs, Softness, Sticks
from verlet_numba.kernels.relax import forget, relax_runs, relax_sticks

H = 0.01
PASSES = 3
TOLERANCE = {np.float64: 1e-12, np.float32: 2e-4}
WAYS = [(None, None, False), (0.1, None, False), (None, 1, False), (0.1, 1, False), (None, None, True), (0.1, 1, True)]


class Case:
    """Seven runs of 1 to 37 lanes over 80 particles, some of them pinned, some lanes masked, as buffers and as sticks."""

    def __init__(self, real, soft):
        rng = np.random.default_rng(5)
        self.x = (rng.normal(size=(3, 80)) + np.arange(80) * 0.2).astype(real)
        self.w = np.where(rng.random(80) < 0.2, 0.0, rng.uniform(0.2, 2, 80))
        first = np.array([[0, 40], [40, 1], [3, 60], [0, 79], [10, 30], [5, 25], [20, 50]]).T
        lanes = np.array([37, 17, 16, 1, 20, 8, 23])
        data = np.cumsum(lanes) - lanes
        self.ends = np.concatenate([first[:, [r]] + np.arange(lanes[r]) for r in range(7)], axis=1)
        count = self.ends.shape[1]
        rest = rng.uniform(0.5, 3, count).astype(real)
        masked = rng.random(count) < 0.15
        compliance = rng.choice([0.0, 3e-5, 1e-3], count) if soft else np.zeros(count)
        alpha, w = compliance / H**2, self.w[self.ends]
        total = np.where(masked | (w.sum(0) == 0), 1, w.sum(0) + alpha)
        weight = np.where(masked, 0, w / total).astype(real)
        share = np.where(masked | (w.sum(0) == 0), 0, alpha) / total
        self.softness = Softness(share.astype(real), np.zeros(count, real)) if soft else None
        self.runs = Runs(first, lanes, data, rest, weight, int((weight.sum(0) > 0).sum()))
        self.sticks = Sticks(self.ends, rest, weight)
        self.twins = [Stick(*self.ends[:, c], float(rest[c]), compliance[c]) for c in np.flatnonzero(~masked)]


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
