"""Closest points: of a segment and a point, of a triangle and a point, of two segments. As weights of their corners.

The closest point of a convex set lies within a face, an edge or a corner. All that may be it are tried and the nearest
is taken, the boundary first and the inner one only where it is nearer: of a sliver or of nearly parallel segments the
inner one is worth little, and the boundary holds a point as near but for rounding. No length is compared with a
constant: any scale will do, and corners may coincide or lie on a line. Distances are right to rounding, and weights to
its square root where the distance hardly depends on them.
"""

import math

from verlet_numba._jit import formula
from verlet_numba.physics.simplex import cross, dot


@formula
def length(x, y, z):
    return math.sqrt(x * x + y * y + z * z)


@formula
def share(along, squared):
    """along / squared kept within 0 and 1; 0 for a segment of length 0."""
    return min(max(along / squared, 0.0), 1.0) if squared > 0.0 else 0.0


@formula
def on_segment(px, py, pz, ax, ay, az, bx, by, bz):
    """Share t of the way from a to b where the segment is closest to p, and the squared distance there."""
    ux, uy, uz, rx, ry, rz = bx - ax, by - ay, bz - az, px - ax, py - ay, pz - az
    t = share(dot(rx, ry, rz, ux, uy, uz), dot(ux, uy, uz, ux, uy, uz))
    dx, dy, dz = rx - t * ux, ry - t * uy, rz - t * uz
    return t, dot(dx, dy, dz, dx, dy, dz)


@formula
def on_triangle(px, py, pz, ax, ay, az, bx, by, bz, cx, cy, cz):
    """Weights of the corners a, b, c at the point of the triangle closest to p, and the squared distance there.

    Within, with n = (b - a) x (c - a) and r = p - a, the weights of b and c are (r x (c - a)) . n / n^2 and
    ((b - a) x r) . n / n^2 (Ericson 2005, Real-Time Collision Detection, 3.4).
    """
    t, least = on_segment(px, py, pz, ax, ay, az, bx, by, bz)
    wa, wb, wc = 1.0 - t, t, 0.0
    t, squared = on_segment(px, py, pz, bx, by, bz, cx, cy, cz)
    if squared < least:
        least, wa, wb, wc = squared, 0.0, 1.0 - t, t
    t, squared = on_segment(px, py, pz, cx, cy, cz, ax, ay, az)
    if squared < least:
        least, wa, wb, wc = squared, t, 0.0, 1.0 - t
    ux, uy, uz, vx, vy, vz, rx, ry, rz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az, px - ax, py - ay, pz - az
    nx, ny, nz = cross(ux, uy, uz, vx, vy, vz)
    area = dot(nx, ny, nz, nx, ny, nz)
    if area > 0.0:
        b = dot(*cross(rx, ry, rz, vx, vy, vz), nx, ny, nz) / area
        c = dot(*cross(ux, uy, uz, rx, ry, rz), nx, ny, nz) / area
        if b > 0.0 and c > 0.0 and b + c < 1.0:
            dx, dy, dz = rx - b * ux - c * vx, ry - b * uy - c * vy, rz - b * uz - c * vz
            squared = dot(dx, dy, dz, dx, dy, dz)
            if squared < least:
                least, wa, wb, wc = squared, 1.0 - b - c, b, c
    return wa, wb, wc, least


@formula
def of_segments(px, py, pz, qx, qy, qz, ax, ay, az, bx, by, bz):
    """Shares s from p to q and t from a to b where the two segments are closest, and the squared distance there.

    Within both, with u = q - p, v = b - a, n = u x v and r = a - p, s = (r x v) . n / n^2, and t is the share of b - a
    closest to that point. Of parallel segments it is an end of one of them.
    """
    t, least = on_segment(px, py, pz, ax, ay, az, bx, by, bz)
    s = 0.0
    other, squared = on_segment(qx, qy, qz, ax, ay, az, bx, by, bz)
    if squared < least:
        least, s, t = squared, 1.0, other
    other, squared = on_segment(ax, ay, az, px, py, pz, qx, qy, qz)
    if squared < least:
        least, s, t = squared, other, 0.0
    other, squared = on_segment(bx, by, bz, px, py, pz, qx, qy, qz)
    if squared < least:
        least, s, t = squared, other, 1.0
    ux, uy, uz, vx, vy, vz, rx, ry, rz = qx - px, qy - py, qz - pz, bx - ax, by - ay, bz - az, ax - px, ay - py, az - pz
    nx, ny, nz = cross(ux, uy, uz, vx, vy, vz)
    area = dot(nx, ny, nz, nx, ny, nz)
    if area > 0.0:
        inner = share(dot(*cross(rx, ry, rz, vx, vy, vz), nx, ny, nz), area)
        other, squared = on_segment(px + inner * ux, py + inner * uy, pz + inner * uz, ax, ay, az, bx, by, bz)
        if squared < least:
            least, s, t = squared, inner, other
    return s, t, least
