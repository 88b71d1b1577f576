"""Which parts of a cloth cannot touch themselves: bounds on its deformation gradient.

Let a cloth be a lattice, particle (i, j) resting at (i a, j b), and let every edge along i of some part of it, a
vector of the present shape, lie in one box of vectors, and every edge along j in another. Take two particles of the part
that a path of its edges joins, i steps along the first and j along the second without a turn back, at the distance
d = (i a, j b) at rest. Then the vector between them is

    sum of edges = F d,    F = (mean edge along i / a, mean edge along j / b),

and the mean of edges lies in their box, as a box is convex. With the middles G of the boxes and F = G + D, the entries
of D within the half widths H of the boxes,

    |F d|^2 >= d^T (G^T G + G^T D + D^T G) d,

since D^T D is positive. The entries of that matrix are bounded: those on the diagonal by A, C = |g|^2 - 2 |g| . h for
each of the two edges (absolute values by component), that off it by B = |g_i . g_j| + |g_i| . h_j + |g_j| . h_i. So

    |F d|^2 >= k^2 |d|^2    if A - k^2 > 0, C - k^2 > 0 and (A - k^2) (C - k^2) > B^2.

Pairs of particles that are no nearer at rest than `closest` are then no nearer than k `closest`. Nothing is assumed:
stretch, compression and shear are in the edges. (A cone of normals, after Volino and Magnenat-Thalmann 1994, is weaker: it
does not see turns within the surface, so that the outline has to be tested as well, and assumes a bound on compression.)
"""

from verlet_numba._jit import formula


@formula
def unfolded(lu, lv, lw, lx, ly, lz, hu, hv, hw, hx, hy, hz, a, b, ratio):
    """Whether |F d| > ratio |d| for all d. Least entries of both edges [m], then their largest.

    a and b are the lattice's spacings [m]; `ratio` is that of the reach to the rest distance of the closest pair.
    """
    p, q = 0.5 / a, 0.5 / b
    gu, gv, gw, gx, gy, gz = (hu + lu) * p, (hv + lv) * p, (hw + lw) * p, (hx + lx) * q, (hy + ly) * q, (hz + lz) * q
    su, sv, sw, sx, sy, sz = (hu - lu) * p, (hv - lv) * p, (hw - lw) * p, (hx - lx) * q, (hy - ly) * q, (hz - lz) * q
    au, av, aw, ax, ay, az = abs(gu), abs(gv), abs(gw), abs(gx), abs(gy), abs(gz)
    least = ratio * ratio
    A = au * (au - 2.0 * su) + av * (av - 2.0 * sv) + aw * (aw - 2.0 * sw) - least
    C = ax * (ax - 2.0 * sx) + ay * (ay - 2.0 * sy) + az * (az - 2.0 * sz) - least
    B = abs(gu * gx + gv * gy + gw * gz) + au * sx + av * sy + aw * sz + ax * su + ay * sv + az * sw
    return A > 0.0 and C > 0.0 and A * C > B * B
