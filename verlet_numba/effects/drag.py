"""Drag: air that resists, in proportion to the velocity relative to it and to its square."""

from verlet_numba._jit import kernel
from verlet_numba.physics.resistance import drag as resisted


@kernel
def resist(particles, h, drag):
    """Add drag to what accelerates the particles so far."""
    if drag is None:
        return
    resist_in(particles.position, particles.previous, particles.acceleration, h, drag.linear, drag.quadratic, drag.air)


@kernel
def resist_in(position, previous, acceleration, h, linear, quadratic, air):
    for k in range(linear.size):
        wx, wy, wz = air_at(k, air)
        ax, ay, az = resisted(
            float(acceleration[0, k]), float(acceleration[1, k]), float(acceleration[2, k]),
            float(position[0, k]) - previous[0, k], float(position[1, k]) - previous[1, k], float(position[2, k]) - previous[2, k],
            wx, wy, wz, float(linear[k]), float(quadratic[k]), h)
        acceleration[0, k], acceleration[1, k], acceleration[2, k] = ax, ay, az


@kernel
def air_at(k, air):
    """The air's velocity at particle k."""
    if air is None:
        return 0.0, 0.0, 0.0
    return float(air[0, k]), float(air[1, k]), float(air[2, k])
