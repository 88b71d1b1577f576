"""Distance of two convex hulls (Gilbert, Johnson and Keerthi; van den Bergen 2003, section 4.3; paper, 5.1).

The hulls' difference A - B holds the origin where they meet, and its point v nearest the origin is their distance. A simplex
of at most four of its vertices moves towards the origin: v is the simplex' nearest point, and the next vertex is the
difference's farthest in the direction -v. An axis from the last substep is a good first v.
"""

import numpy as np

from verlet_numba._jit import formula, kernel
from verlet_numba.kernels.support import support
from verlet_numba.physics.simplex import cross, dot, segment, tetrahedron, triangle

APART, NEAR, MET = 0, 1, 2
ITERATIONS = 64
RELATIVE = 1e-15        # error of a distance; that of its direction is the root of it
CLOSE = 1e-4            # square of a distance, of the farthest vertex' one, below which v is set upright before it is believed
TOUCHING = 1e-30        # square of a distance, of the farthest vertex' one: rounding


@formula
def nearest(vertex, n):
    """Weights of the n vertices of the simplex for its point nearest the origin."""
    ax, ay, az = vertex[0, 0], vertex[1, 0], vertex[2, 0]
    if n == 1:
        return 1.0, 0.0, 0.0, 0.0
    bx, by, bz = vertex[0, 1], vertex[1, 1], vertex[2, 1]
    if n == 2:
        u, v = segment(ax, ay, az, bx, by, bz)
        return u, v, 0.0, 0.0
    cx, cy, cz = vertex[0, 2], vertex[1, 2], vertex[2, 2]
    if n == 3:
        u, v, w = triangle(ax, ay, az, bx, by, bz, cx, cy, cz)
        return u, v, w, 0.0
    return tetrahedron(ax, ay, az, bx, by, bz, cx, cy, cz, vertex[0, 3], vertex[1, 3], vertex[2, 3])


@formula
def carried(vertex, a, b, c, d):
    """The point with these weights. Where there are fewer vertices than four, the weights of the others are 0."""
    return (a * vertex[0, 0] + b * vertex[0, 1] + c * vertex[0, 2] + d * vertex[0, 3],
            a * vertex[1, 0] + b * vertex[1, 1] + c * vertex[1, 2] + d * vertex[1, 3],
            a * vertex[2, 0] + b * vertex[2, 1] + c * vertex[2, 2] + d * vertex[2, 3])


@formula
def keep(vertex, label, weight, a, b, c, d):
    """Leave only those vertices in the simplex that have a weight. Returns how many. There is no branch to mispredict."""
    weight[0], weight[1], weight[2], weight[3] = a, b, c, d
    kept = 0
    for k in range(4):
        vertex[0, kept], vertex[1, kept], vertex[2, kept] = vertex[0, k], vertex[1, k], vertex[2, k]
        label[0, kept], label[1, kept], weight[kept] = label[0, k], label[1, k], weight[k]
        kept += weight[k] > 0.0
    return kept


@formula
def known(label, n, i, j):
    """Whether the difference of columns i and j is one of the first n vertices."""
    found = False
    for k in range(n):
        found |= (label[0, k] == i) & (label[1, k] == j)
    return found


@formula
def upright(vertex, n, vx, vy, vz):
    """v without what is left of it along the simplex: as a sum of vertices it has their rounding, against which it may be small."""
    if n == 1 or n == 4:
        return vx, vy, vz
    ux, uy, uz = vertex[0, 1] - vertex[0, 0], vertex[1, 1] - vertex[1, 0], vertex[2, 1] - vertex[2, 0]
    if n == 2:
        part = dot(ux, uy, uz, vx, vy, vz) / dot(ux, uy, uz, ux, uy, uz)
        return vx - part * ux, vy - part * uy, vz - part * uz
    nx, ny, nz = cross(ux, uy, uz, vertex[0, 2] - vertex[0, 0], vertex[1, 2] - vertex[1, 0], vertex[2, 2] - vertex[2, 0])
    part = dot(nx, ny, nz, vx, vy, vz) / dot(nx, ny, nz, nx, ny, nz)
    return part * nx, part * ny, part * nz


@kernel
def gjk(points, neighbours, neighbour, seen, start_a, size_a, row_a, start_b, size_b, row_b, vx, vy, vz, bound,
        vertex, label, weight):
    """Distance of the hulls of the columns from start_a on and from start_b on, v being the axis to begin with.

    Returns APART as soon as v separates them by more than `bound` [m], NEAR with their nearest points, or MET; the number of
    vertices in the simplex; v, from the second hull to the first: just a direction where they are APART, [m] where they are
    NEAR. Ends always: on the relative error, on a vertex that is known, where v gets no shorter, after 64 iterations.
    """
    n, squared, farthest, i, j, erect = 0, np.inf, 0.0, start_a, start_b, False
    for _ in range(ITERATIONS):
        i = support(points, start_a, size_a, row_a, neighbours, neighbour, seen, i, -vx, -vy, -vz)
        j = support(points, start_b, size_b, row_b, neighbours, neighbour, seen, j, vx, vy, vz)
        wx, wy, wz = points[0, i] - points[0, j], points[1, i] - points[1, j], points[2, i] - points[2, j]
        along = vx * wx + vy * wy + vz * wz
        if along > 0.0 and along * along > bound * bound * (vx * vx + vy * vy + vz * vz):
            return APART, n, vx, vy, vz
        if n > 0 and (squared - along <= RELATIVE * squared or known(label, n, i, j)):
            if erect or squared > CLOSE * farthest:
                return NEAR, n, vx, vy, vz
            vx, vy, vz = upright(vertex, n, vx, vy, vz)
            erect = True
            continue
        vertex[0, n], vertex[1, n], vertex[2, n], label[0, n], label[1, n] = wx, wy, wz, i, j
        a, b, c, d = nearest(vertex, n + 1)
        if d > 0.0 and c > 0.0 and b > 0.0 and a > 0.0:
            weight[0], weight[1], weight[2], weight[3] = a, b, c, d
            return MET, 4, 0.0, 0.0, 0.0
        ux, uy, uz = carried(vertex, a, b, c, d)
        shorter = ux * ux + uy * uy + uz * uz
        if shorter >= squared:
            return NEAR, n, vx, vy, vz
        n = keep(vertex, label, weight, a, b, c, d)
        vx, vy, vz, squared, erect = ux, uy, uz, shorter, False
        farthest = max(farthest, wx * wx + wy * wy + wz * wz)
        if squared <= TOUCHING * farthest:
            return MET, n, vx, vy, vz
    return NEAR, n, vx, vy, vz
