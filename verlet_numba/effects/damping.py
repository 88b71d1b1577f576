"""Damping: every velocity decays as exp(-rate t), whatever the step."""

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.physics.resistance import damped


@kernel
def damp(position, previous, acceleration, h, damping):
    """Add damping to what accelerates the particles so far."""
    if damping is None:
        return
    for axis in range(3):
        for k in range(damping.rate.size):
            step = np.float64(position[axis, k]) - previous[axis, k]
            acceleration[axis, k] = damped(np.float64(acceleration[axis, k]), step, np.float64(damping.rate[k]), h)
