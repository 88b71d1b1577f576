"""Damping: every velocity decays as exp(-rate t), whatever the step."""

from verlet_numba._jit import kernel
from verlet_numba.physics.resistance import damped


@kernel
def damp(particles, h, damping):
    """Add damping to what accelerates the particles so far."""
    if damping is None:
        return
    position, previous, acceleration = particles.position, particles.previous, particles.acceleration
    for axis in range(3):
        for k in range(damping.rate.size):
            step = float(position[axis, k]) - previous[axis, k]
            acceleration[axis, k] = damped(float(acceleration[axis, k]), step, float(damping.rate[k]), h)
