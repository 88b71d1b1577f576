"""Dihedral angle: two triangles that share an edge from a to b, with wings c to its left and d to its right.

With e = b - a, p = c - a, q = d - a and L = |e|, the normals are N1 = e x p and N2 = q x e. The angle between them, 0 where the
hinge is flat and growing as both wings rise, has the cosine N1.N2 and the sine L N2.p, both times |N1| |N2|. Its gradients
(Bridson, Marino, Fedkiw 2003, section 4) with h1 = N1 / |N1|^2, h2 = N2 / |N2|^2, s = p.e / L and t = q.e / L are

    c: L h1    d: L h2    a: (s - L) h1 + (t - L) h2    b: -s h1 - t h2

They have no sum and no moment: displacements along them, over the masses, keep momentum and angular momentum.
"""

import math

from verlet_numba._jit import formula

TINY = 1e-200       # m^4, and the same squared: what is smaller has no direction


@formula
def normals(ex, ey, ez, px, py, pz, qx, qy, qz):
    """N1 and N2 [m^2]."""
    return ey * pz - ez * py, ez * px - ex * pz, ex * py - ey * px, qy * ez - qz * ey, qz * ex - qx * ez, qx * ey - qy * ex


@formula
def off_rest(ex, ey, ez, px, py, pz, qx, qy, qz, cosine, sine):
    """The angle less that at rest [rad], in (-pi, pi). cosine, sine: those at rest."""
    ax, ay, az, bx, by, bz = normals(ex, ey, ez, px, py, pz, qx, qy, qz)
    c, s = ax * bx + ay * by + az * bz, math.sqrt(ex * ex + ey * ey + ez * ez) * (bx * px + by * py + bz * pz)
    return angle(c * cosine + s * sine, s * cosine - c * sine)


@formula
def gradients(ex, ey, ez, px, py, pz, qx, qy, qz):
    """Those of the angle by the places of a, b, c and d [rad/m]; a triangle without area has none."""
    ax, ay, az, bx, by, bz = normals(ex, ey, ez, px, py, pz, qx, qy, qz)
    length = math.sqrt(ex * ex + ey * ey + ez * ez) + TINY
    one, other = 1.0 / (ax * ax + ay * ay + az * az + TINY), 1.0 / (bx * bx + by * by + bz * bz + TINY)
    ax, ay, az, bx, by, bz = ax * one, ay * one, az * one, bx * other, by * other, bz * other
    s, t = (px * ex + py * ey + pz * ez) / length, (qx * ex + qy * ey + qz * ez) / length
    u, v = s - length, t - length
    return (u * ax + v * bx, u * ay + v * by, u * az + v * bz, -s * ax - t * bx, -s * ay - t * by, -s * az - t * bz,
            length * ax, length * ay, length * az, length * bx, length * by, length * bz)


@formula
def angle(c, s):
    """The angle [rad] of the vector (c, s) to 1e-7, 0 of none, without a branch, so that it may stand in a vector loop.

    It is four times the arc tangent of tan(angle / 4) = 2 r s / (v (2 r + v)), with r = |(c, s)| and v^2 = 2 r (r + c); the
    polynomial is Abramowitz & Stegun (1964), 4.4.49.
    """
    r = math.sqrt(c * c + s * s)
    v = math.sqrt(max((r + r) * (r + c), TINY))
    t = (r + r) * s / (v * (r + r + v))
    w = t * t
    series = (((0.0028662257 * w - 0.0161657367) * w + 0.0429096138) * w - 0.0752896400) * w + 0.1065626393
    series = (((series * w - 0.1420889944) * w + 0.1999355085) * w - 0.3333314528) * w + 1.0
    return 4.0 * t * series
