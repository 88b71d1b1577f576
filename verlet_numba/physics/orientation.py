"""On which side of themselves four points are, and the direction in which a set of points is thinnest."""

import math

from verlet_numba._jit import formula
from verlet_numba.physics.rigid import cross, times_symmetric

ROUNDS = 16         # of power iteration: of a set that was just flat the eigenvalues are far apart


@formula
def volume(ax, ay, az, bx, by, bz, cx, cy, cz):
    """a . (b x c): six times the signed volume of the tetrahedron of the edges a, b, c from one corner [m^3]."""
    px, py, pz = cross(bx, by, bz, cx, cy, cz)
    return ax * px + ay * py + az * pz


@formula
def thinnest(xx, yy, zz, xy, xz, yz):
    """Unit eigenvector of the least eigenvalue of the symmetric, positive matrix of second moments.

    The adjugate has the same eigenvectors, and its largest eigenvalue is the product of the two others: power iteration on it,
    from its longest row on. Moments of points on one line have no adjugate: any direction across is as thin.
    """
    a, b, c, d, e, f = (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy,
                        xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz)
    x, y, z = a, d, e
    if b * b + d * d + f * f > x * x + y * y + z * z:
        x, y, z = d, b, f
    if c * c + e * e + f * f > x * x + y * y + z * z:
        x, y, z = e, f, c
    for _ in range(ROUNDS):
        length = math.sqrt(x * x + y * y + z * z)
        if length == 0.0:
            return 0.0, 0.0, 0.0
        x, y, z = times_symmetric(a, b, c, d, e, f, x / length, y / length, z / length)
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length
