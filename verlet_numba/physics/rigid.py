"""Mass and inertia of a set of particles, and how it answers to an impulse as a whole. No orientation is needed.

An impulse j n at the arm r from the centre of mass displaces the body by the translation j n / M and the rotation
j I^-1 (r x n): its point at r moves along n by j (1/M + (r x n) . I^-1 (r x n)).
"""

import math

from verlet_numba._jit import formula


@formula
def cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@formula
def inverse_symmetric(xx, yy, zz, xy, xz, yz):
    """Inverse of the symmetric matrix [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], in the same order of entries.

    A matrix without inverse (particles on one line) gives zeros: the body answers as if it could not turn.
    """
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    determinant = xx * a + xy * b + xz * c
    if not determinant > 1e-12 * xx * yy * zz:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    s = 1.0 / determinant
    return a * s, (xx * zz - xz * xz) * s, (xx * yy - xy * xy) * s, b * s, c * s, (xy * xz - xx * yz) * s


@formula
def times_symmetric(xx, yy, zz, xy, xz, yz, x, y, z):
    """Symmetric matrix times vector."""
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@formula
def about_axis(xx, yy, zz, xy, xz, yz, ax, ay, az):
    """Inverse inertia of a body that can only turn about the unit vector a: a a^T / (a . I a); a = 0: not at all."""
    ix, iy, iz = times_symmetric(xx, yy, zz, xy, xz, yz, ax, ay, az)
    about = ax * ix + ay * iy + az * iz
    s = 1.0 / about if about > 0.0 else 0.0
    return ax * ax * s, ay * ay * s, az * az * s, ax * ay * s, ax * az * s, ay * az * s


@formula
def response(r, u, v, answers):
    """Displacement along the unit vector u at the arm r of a unit impulse along v there.

    answers: 1/mass and the inverse inertia xx, yy, zz, xy, xz, yz.
    """
    px, py, pz = cross(r[0], r[1], r[2], u[0], u[1], u[2])
    qx, qy, qz = cross(r[0], r[1], r[2], v[0], v[1], v[2])
    ox, oy, oz = times_symmetric(answers[1], answers[2], answers[3], answers[4], answers[5], answers[6], qx, qy, qz)
    return answers[0] * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) + px * ox + py * oy + pz * oz


@formula
def across(x, y, z):
    """Two unit vectors across the unit vector (x, y, z) and each other (Duff et al. 2017)."""
    s = math.copysign(1.0, z)
    a = -1.0 / (s + z)
    b = x * y * a
    return (1.0 + s * x * x * a, s * b, -s * x), (b, s + y * y * a, -y)
