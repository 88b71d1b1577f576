"""Poses: rotation about an axis, and into and out of a solid's own frame.

A pose is twelve numbers: the origin and, row by row, the rotation whose columns are the solid's axes.
"""

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
def inward(x, y, z, pose):
    """Coordinates of a point [m] in the frame of a pose."""
    x, y, z = x - pose[0], y - pose[1], z - pose[2]
    return (pose[3] * x + pose[6] * y + pose[9] * z,
            pose[4] * x + pose[7] * y + pose[10] * z,
            pose[5] * x + pose[8] * y + pose[11] * z)


@formula
def outward(x, y, z, pose):
    """A direction in the frame of a pose, in world axes."""
    return (pose[3] * x + pose[4] * y + pose[5] * z,
            pose[6] * x + pose[7] * y + pose[8] * z,
            pose[9] * x + pose[10] * y + pose[11] * z)


@formula
def rotation(x, y, z):
    """The matrix, row by row, that turns about the vector (x, y, z) by its length [rad] (Rodrigues)."""
    angle = math.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    x, y, z, c, s = x / angle, y / angle, z / angle, math.cos(angle), math.sin(angle)
    half = math.sin(0.5 * angle)
    t = 2.0 * half * half               # 1 - c without cancellation
    return (c + t * x * x, t * x * y - s * z, t * x * z + s * y,
            t * x * y + s * z, c + t * y * y, t * y * z - s * x,
            t * x * z - s * y, t * y * z + s * x, c + t * z * z)
