"""Signed distance from a solid's surface, and the outward unit normal, in the solid's own frame; negative inside.

Every function returns distance [m], nx, ny, nz. Where the nearest point is not unique, one is chosen.
"""

import math

from verlet_numba._jit import formula


@formula
def plane(x, y, z, nx, ny, nz, offset):
    """Half space below the plane n . x = offset, n a unit vector."""
    return nx * x + ny * y + nz * z - offset, nx, ny, nz


@formula
def sphere(x, y, z, radius):
    """Sphere about the origin; from the centre up is out."""
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return -radius, 0.0, 0.0, 1.0
    return length - radius, x / length, y / length, z / length


@formula
def box(x, y, z, hx, hy, hz):
    """Box of half edges hx, hy, hz: outside from the nearest point, inside through the nearest face."""
    qx, qy, qz = abs(x) - hx, abs(y) - hy, abs(z) - hz
    sx, sy, sz = math.copysign(1.0, x), math.copysign(1.0, y), math.copysign(1.0, z)
    if qx <= 0.0 and qy <= 0.0 and qz <= 0.0:
        if qx >= qy and qx >= qz:
            return qx, sx, 0.0, 0.0
        if qy >= qz:
            return qy, 0.0, sy, 0.0
        return qz, 0.0, 0.0, sz
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    length = math.sqrt(ox * ox + oy * oy + oz * oz)
    return length, sx * ox / length, sy * oy / length, sz * oz / length


@formula
def cylinder(x, y, z, radius, half):
    """Cylinder about the z axis with flat caps at +-half: a box in the plane of the axis and the point."""
    r = math.sqrt(x * x + y * y)
    ux, uy = (x / r, y / r) if r > 0.0 else (1.0, 0.0)
    q, qz = r - radius, abs(z) - half
    sz = math.copysign(1.0, z)
    if q <= 0.0 and qz <= 0.0:
        if q >= qz:
            return q, ux, uy, 0.0
        return qz, 0.0, 0.0, sz
    o, oz = max(q, 0.0), max(qz, 0.0)
    length = math.sqrt(o * o + oz * oz)
    return length, ux * o / length, uy * o / length, sz * oz / length
