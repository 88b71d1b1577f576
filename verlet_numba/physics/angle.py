"""Angle constraint: the angle at x_j between the arms to x_i and x_k.

With unit arms u (length a) and v (length b), e the unit normal of u in their plane towards v, and
f = sin(theta) u - cos(theta) e the unit normal of v towards u, moving x_i along e by s lessens theta by s / a and
moving x_k along f by s lessens it by s / b. The gradients -e/a and -f/b, and at x_j minus their sum, are those of a
function that no rigid motion changes: the displacements have no sum and no moment about the present positions.
"""

import math

from verlet_numba._jit import formula


@formula
def unit(x, y, z):
    """Unit vector and length; the zero vector gives (0, 0, 0), 0."""
    length = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 / length if length > 0.0 else 0.0
    return x * scale, y * scale, z * scale, length


@formula
def any_normal(x, y, z):
    """Some unit vector normal to the unit vector (x, y, z): its cross product with the axis it is farthest from."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        nx, ny, nz, _ = unit(0.0, z, -y)
    elif abs(y) <= abs(z):
        nx, ny, nz, _ = unit(-z, 0.0, x)
    else:
        nx, ny, nz, _ = unit(y, -x, 0.0)
    return nx, ny, nz


@formula
def between(ux, uy, uz, vx, vy, vz):
    """The angle between two arms [rad], as `bend` has it."""
    ux, uy, uz, _ = unit(ux, uy, uz)
    vx, vy, vz, _ = unit(vx, vy, vz)
    cosine = ux * vx + uy * vy + uz * vz
    _, _, _, sine = unit(vx - cosine * ux, vy - cosine * uy, vz - cosine * uz)
    return math.atan2(sine, cosine)


@formula
def bend(ux, uy, uz, vx, vy, vz, rest, slack, w_i, w_j, w_k):
    """Displacements of x_i and x_k [m] that bring the angle to `rest` [rad] to first order, and what x_j moves.

    (ux, uy, uz), (vx, vy, vz): arms [m] from x_j; w: inverse masses [1/kg]. Returns nine numbers: of i, j, k.
    An arm of length zero, three immovable particles, or an angle within the relative tolerance `slack` are left alone.
    """
    ux, uy, uz, a = unit(ux, uy, uz)
    vx, vy, vz, b = unit(vx, vy, vz)
    if a == 0.0 or b == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    cosine = ux * vx + uy * vy + uz * vz
    ex, ey, ez, sine = unit(vx - cosine * ux, vy - cosine * uy, vz - cosine * uz)
    if sine < 1e-12:
        ex, ey, ez = any_normal(ux, uy, uz)
    fx, fy, fz = sine * ux - cosine * ex, sine * uy - cosine * ey, sine * uz - cosine * ez
    ix, iy, iz = -ex / a, -ey / a, -ez / a
    kx, ky, kz = -fx / b, -fy / b, -fz / b
    jx, jy, jz = -(ix + kx), -(iy + ky), -(iz + kz)
    total = w_i / (a * a) + w_k / (b * b) + w_j * (jx * jx + jy * jy + jz * jz)
    if total == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    error = math.atan2(sine, cosine) - rest
    if abs(error) < slack * rest:
        error = 0.0
    s = -error / total
    i, j, k = s * w_i, s * w_j, s * w_k
    return i * ix, i * iy, i * iz, j * jx, j * jy, j * jz, k * kx, k * ky, k * kz
