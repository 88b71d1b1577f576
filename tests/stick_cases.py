"""Distance constraints in every form, for tests of what relaxes them."""

import numpy as np
from reference_constraints import Stick

from verlet_numba.buffers.constraints import Runs, Softness, Sticks

H = 0.01


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
