"""Drag: air that resists, in proportion to the velocity relative to it and to its square."""

import numpy as np

from verlet_numba._jit import entry, kernel
from verlet_numba.physics.resistance import drag as resisted


@entry
def resist(position, previous, acceleration, h, drag):
    """Add drag to what accelerates the particles so far. Rows are sliced first, so that the loop vectorises."""
    if drag is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    a, b, c, linear, quadratic, air = acceleration[0], acceleration[1], acceleration[2], drag.linear, drag.quadratic, drag.air
    double = np.float64
    for k in range(linear.size):
        wx, wy, wz = air_at(k, air)
        ax, ay, az = resisted(double(a[k]), double(b[k]), double(c[k]),
                              double(x[k]) - u[k], double(y[k]) - v[k], double(z[k]) - w[k],
                              wx, wy, wz, double(linear[k]), double(quadratic[k]), h)
        a[k], b[k], c[k] = ax, ay, az


@kernel
def air_at(k, air):
    """The air's velocity at particle k."""
    if air is None:
        return 0.0, 0.0, 0.0
    return np.float64(air[0, k]), np.float64(air[1, k]), np.float64(air[2, k])
