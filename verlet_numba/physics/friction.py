"""Coulomb friction between positions: a normal displacement `push` lets friction take back up to mu push along the surface.

Both are displacements of the same particle in the same substep, so their ratio is that of the forces.
"""

import math

from verlet_numba._jit import formula


@formula
def held(slide, push, static, dynamic):
    """Which part of the sliding displacement `slide` [m] friction takes back: all within the static cone, else dynamic push."""
    if slide <= static * push:
        return 1.0
    return dynamic * push / slide


@formula
def sliding(f, g, xx, xy, yy, r, length):
    """The impulse of size r that opposes the slide which it leaves; (f, g): the one that would leave none, of this length.

    With the responses K, its inverse A = (xx, xy, yy) and f0 = (f, g), the impulse p leaves the slide K (p - f0). That is
    -a p where (1 + a A) p = f0, and a > 0 follows from |p| = r: 1/|p| is all but linear in a (More & Sorensen 1983).
    p = P / D with P = f0 + a c, c the adjugate of A times f0, and D = det(1 + a A): one division and one root a step of Newton's
        a <- a - L^2 (D - L / r) / (D' L^2 - D P . c), L = |P|, from a = 0.
    """
    if r == 0.0:
        return 0.0, 0.0
    trace, determinant, one = xx + yy, xx * yy - xy * xy, 1.0 / r
    cx, cy = yy * f - xy * g, xx * g - xy * f
    a, p, q, size = 0.0, f, g, length
    for _ in range(3):
        d, slope, squared = 1.0 + a * (trace + a * determinant), trace + 2.0 * a * determinant, size * size
        a -= squared * (d - size * one) / (slope * squared - d * (p * cx + q * cy))
        p, q = f + a * cx, g + a * cy
        size = math.sqrt(p * p + q * q)
    share = r / size
    return share * p, share * q
