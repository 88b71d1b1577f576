"""Poses of colliders: rotation about an axis, and into and out of a solid's own frame."""

import math

from verlet_numba._jit import formula


@formula
def turn(x, y, z, sx, sy, sz, time):
    """The vector (x, y, z) turned by the angular velocity (sx, sy, sz) [rad/s] for `time` [s] (Rodrigues)."""
    rate = math.sqrt(sx * sx + sy * sy + sz * sz)
    if rate == 0.0:
        return x, y, z
    ux, uy, uz = sx / rate, sy / rate, sz / rate
    c, s = math.cos(rate * time), math.sin(rate * time)
    along = (ux * x + uy * y + uz * z) * (1.0 - c)
    return (x * c + (uy * z - uz * y) * s + ux * along,
            y * c + (uz * x - ux * z) * s + uy * along,
            z * c + (ux * y - uy * x) * s + uz * along)


@formula
def inward(x, y, z, origin, rotation, k):
    """Coordinates in the frame of solid k."""
    x, y, z = x - origin[0, k], y - origin[1, k], z - origin[2, k]
    return (rotation[0, 0, k] * x + rotation[1, 0, k] * y + rotation[2, 0, k] * z,
            rotation[0, 1, k] * x + rotation[1, 1, k] * y + rotation[2, 1, k] * z,
            rotation[0, 2, k] * x + rotation[1, 2, k] * y + rotation[2, 2, k] * z)


@formula
def outward(x, y, z, rotation, k):
    """A direction in the frame of solid k, in world axes."""
    return (rotation[0, 0, k] * x + rotation[0, 1, k] * y + rotation[0, 2, k] * z,
            rotation[1, 0, k] * x + rotation[1, 1, k] * y + rotation[1, 2, k] * z,
            rotation[2, 0, k] * x + rotation[2, 1, k] * y + rotation[2, 2, k] * z)
