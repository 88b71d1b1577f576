"""Smallest enclosing spheres: of one to four points, and of two spheres. Lengths of any scale, no tolerance in metres.

A smallest enclosing sphere touches at most four of its points, its *support*, and its centre lies in their convex hull
(Welzl 1991). Support is told as bits: 1 for the first point, 2 for the second, 4 for the third, 8 for the fourth.
"""

import math

from verlet_numba._jit import formula

INSIDE = 1.0 + 1e-12        # times the squared radius: what rounding may leave outside of a sphere through degenerate points


@formula
def sphere_of_two(ax, ay, az, bx, by, bz):
    """Smallest sphere of two points: centre and squared radius [m, m^2]."""
    x, y, z = 0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az)
    return ax + x, ay + y, az + z, x * x + y * y + z * z


@formula
def sphere_of_three(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Smallest sphere of three points: centre, squared radius and support.

    With a right or an obtuse angle, and for points on a line, it is the sphere on the longest side. Else it is the
    circumsphere: with A, B, C the squared sides opposite to the corners, its centre has the barycentric weights
    A (B + C - A) and so on, all positive, whose sum is 16 times the squared area, and its squared radius is A B C / sum.
    """
    A = (bx - cx) ** 2 + (by - cy) ** 2 + (bz - cz) ** 2
    B = (cx - ax) ** 2 + (cy - ay) ** 2 + (cz - az) ** 2
    C = (ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2
    if A >= B + C:
        x, y, z, squared = sphere_of_two(bx, by, bz, cx, cy, cz)
        return x, y, z, squared, 6
    if B >= C + A:
        x, y, z, squared = sphere_of_two(ax, ay, az, cx, cy, cz)
        return x, y, z, squared, 5
    if C >= A + B:
        x, y, z, squared = sphere_of_two(ax, ay, az, bx, by, bz)
        return x, y, z, squared, 3
    p, q, r = A * (B + C - A), B * (C + A - B), C * (A + B - C)
    q, r, squared = q / (p + q + r), r / (p + q + r), A * B * C / (p + q + r)
    return (ax + q * (bx - ax) + r * (cx - ax), ay + q * (by - ay) + r * (cy - ay), az + q * (bz - az) + r * (cz - az),
            squared, 7)


@formula
def circumcentre(ux, uy, uz, vx, vy, vz, wx, wy, wz):
    """Centre of the sphere through the corners 0, u, v, w of a tetrahedron.

    The centre o is as far from 0 as from u, v and w: 2 o . u = u . u, likewise v and w. Solved by Cramer's rule:
    2 o = (u.u v x w + v.v w x u + w.w u x v) / (u . v x w).
    """
    px, py, pz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    qx, qy, qz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    rx, ry, rz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    scale = 0.5 / (ux * px + uy * py + uz * pz)
    return scale * (uu * px + vv * qx + ww * rx), scale * (uu * py + vv * qy + ww * ry), scale * (uu * pz + vv * qz + ww * rz)


@formula
def sphere_of_four(ax, ay, az, bx, by, bz, cx, cy, cz, dx, dy, dz):
    """Smallest sphere of four points: centre, squared radius and support. Equal points are allowed.

    It is that of three of them if one of these holds the fourth, the circumsphere otherwise. Points in a plane always
    have such a three, to rounding (INSIDE): the circumsphere is left to what has a volume. All is counted from a, so
    that rounding is that of the points' distances, wherever they are.
    """
    ux, uy, uz, vx, vy, vz, wx, wy, wz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az, dx - ax, dy - ay, dz - az
    x, y, z, squared, support = sphere_of_three(ux, uy, uz, vx, vy, vz, wx, wy, wz)
    if x * x + y * y + z * z <= squared * INSIDE:
        return ax + x, ay + y, az + z, squared, support << 1
    x, y, z, squared, support = sphere_of_three(vx, vy, vz, wx, wy, wz, 0.0, 0.0, 0.0)
    if (ux - x) ** 2 + (uy - y) ** 2 + (uz - z) ** 2 <= squared * INSIDE:
        return ax + x, ay + y, az + z, squared, (support << 2 | support >> 2) & 13
    x, y, z, squared, support = sphere_of_three(wx, wy, wz, 0.0, 0.0, 0.0, ux, uy, uz)
    if (vx - x) ** 2 + (vy - y) ** 2 + (vz - z) ** 2 <= squared * INSIDE:
        return ax + x, ay + y, az + z, squared, (support << 3 | support >> 1) & 11
    x, y, z, squared, support = sphere_of_three(0.0, 0.0, 0.0, ux, uy, uz, vx, vy, vz)
    if (wx - x) ** 2 + (wy - y) ** 2 + (wz - z) ** 2 <= squared * INSIDE:
        return ax + x, ay + y, az + z, squared, support
    x, y, z = circumcentre(ux, uy, uz, vx, vy, vz, wx, wy, wz)
    return ax + x, ay + y, az + z, x * x + y * y + z * z, 15


@formula
def sphere_of_spheres(ax, ay, az, a, bx, by, bz, b):
    """Smallest sphere about two spheres: centre and radius [m].

    One of them, if it holds the other. Else it spans the line through both centres from end to end.
    """
    x, y, z = bx - ax, by - ay, bz - az
    distance = math.sqrt(x * x + y * y + z * z)
    if distance + b <= a:
        return ax, ay, az, a
    if distance + a <= b:
        return bx, by, bz, b
    radius = 0.5 * (distance + a + b)
    share = (radius - a) / distance
    return ax + share * x, ay + share * y, az + share * z, radius
