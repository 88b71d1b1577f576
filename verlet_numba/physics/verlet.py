"""Verlet's step (paper, eq. 1): x(t+h) = 2 x(t) - x(t-h) + a h^2."""

from verlet_numba._jit import formula


@formula
def verlet(position, previous, push):
    """The next position [m]; push = a h^2 [m]. Written as a displacement, which rounds less than 2 x - x'."""
    return position + ((position - previous) + push)
