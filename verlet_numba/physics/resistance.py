"""Forces against the velocity, solved so that Verlet's step keeps second order and never overshoots.

Verlet knows d = x(t) - x(t-h). With acceleration a, the velocity at t is v = d/h + a h/2 (central difference of the
step being taken). A resistance -k (v - air) makes a = a0 - k (d/h + a h/2 - air), linear in a:
a = (a0 - k (d/h - air)) / (1 + k h/2).
"""

import math

from verlet_numba._jit import formula


@formula
def resisted(acceleration, displacement, air, k, h):
    """Acceleration [m/s^2] with the resistance k [1/s] against air [m/s]; displacement of the last step [m], step h [s]."""
    return (acceleration - k * (displacement / h - air)) / (1.0 + 0.5 * k * h)


@formula
def drag(ax, ay, az, dx, dy, dz, wx, wy, wz, linear, quadratic, h):
    """Acceleration with drag -(linear + quadratic |v - w|) (v - w); linear [1/s], quadratic [1/m], w the air [m/s].

    The speed in the quadratic part is first taken from the half step before, then once more from the central
    difference that follows from it: second order in h.
    """
    sx, sy, sz = dx / h - wx, dy / h - wy, dz / h - wz
    bx, by, bz = ax, ay, az
    for _ in range(2):
        k = linear + quadratic * math.sqrt(sx * sx + sy * sy + sz * sz)
        bx, by, bz = resisted(ax, dx, wx, k, h), resisted(ay, dy, wy, k, h), resisted(az, dz, wz, k, h)
        sx, sy, sz = dx / h + 0.5 * h * bx - wx, dy / h + 0.5 * h * by - wy, dz / h + 0.5 * h * bz - wz
    return bx, by, bz


@formula
def damped(acceleration, displacement, rate, h):
    """Acceleration that makes the step exact for v' = a - rate v with constant a: v decays as exp(-rate t).

    Exact displacements obey d(+) = exp(-rate h) d(-) + a h^2 g, g = (1 - exp(-rate h)) / (rate h).
    """
    lost = -math.expm1(-rate * h)
    gain = lost / (rate * h) if rate > 0.0 else 1.0
    return acceleration * gain - displacement * lost / (h * h)
