"""Damping: every velocity decays as exp(-rate t), whatever the step."""

import numpy as np

from verlet_numba._jit import entry
from verlet_numba.physics.resistance import damped


@entry
def damp(position, previous, acceleration, h, damping):
    """Add damping to what accelerates the particles so far. Rows are sliced first, so that the loop vectorises."""
    if damping is None:
        return
    gain, loss = damping.gain, damping.loss
    for axis in range(3):
        now, before, a = position[axis], previous[axis], acceleration[axis]
        for k in range(gain.size):
            a[k] = damped(np.float64(a[k]), np.float64(now[k]) - before[k], gain[k], loss[k])
