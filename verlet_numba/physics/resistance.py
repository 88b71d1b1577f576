"""Forces against the velocity, solved so that Verlet's step keeps second order and never overshoots.

Verlet knows d = x(t) - x(t-h). With acceleration a, the velocity at t is v = d/h + a h/2 (central difference of the
step being taken). A resistance -k (v - air) makes a = a0 - k (d/h + a h/2 - air), linear in a:
a = (a0 - k (d/h - air)) / (1 + k h/2).
"""

import math

from verlet_numba._jit import formula


@formula
def drag(ax, ay, az, dx, dy, dz, wx, wy, wz, linear, quadratic, h):
    """Acceleration with drag -k (v - w), k = linear + quadratic |v - w|; linear [1/s], quadratic [1/m], w the air [m/s].

    The speed in k is first taken from the half step before, u = d/h - w, then once more from the central difference that
    follows from it, u + a h/2: second order in h.
    """
    one, half = 1.0 / h, 0.5 * h
    ux, uy, uz = dx * one - wx, dy * one - wy, dz * one - wz
    sx, sy, sz, bx, by, bz = ux, uy, uz, ax, ay, az
    for _ in range(2):
        k = linear + quadratic * math.sqrt(sx * sx + sy * sy + sz * sz)
        share = 1.0 / (1.0 + k * half)
        bx, by, bz = (ax - k * ux) * share, (ay - k * uy) * share, (az - k * uz) * share
        sx, sy, sz = ux + half * bx, uy + half * by, uz + half * bz
    return bx, by, bz


@formula
def damped(acceleration, displacement, gain, loss):
    """Acceleration that makes the step exact for v' = a - r v with constant a: v decays as exp(-r t).

    Exact displacements obey d(+) = exp(-r h) d(-) + a h^2 gain with gain = (1 - exp(-r h)) / (r h), so what Verlet's step needs
    is a gain - d loss with loss = (1 - exp(-r h)) / h^2 = gain r / h [1/s^2].
    """
    return acceleration * gain - displacement * loss
