"""Distance constraint |x_j - x_i| = rest: which part of the separation to take back.

With f the returned part and the weights g of the two ends (w_i and w_j over their sum), the correction is
x_i += g_i f (x_j - x_i), x_j -= g_j f (x_j - x_i): the ends meet rest length exactly and the centre of mass stays
(Jakobsen 2001; paper, 3.2). Arguments decide the precision: no literal widens it.
"""

import math

from verlet_numba._jit import formula


@formula
def stretch(squared, rest):
    """1 - rest / d, for the squared length d^2 > 0 [m^2] and the rest length [m]."""
    length = math.sqrt(squared)
    return (length - rest) / length


@formula
def excess(squared, rest):
    """d (d - rest) [m^2], the same times d^2: without a division."""
    return squared - rest * math.sqrt(squared)


@formula
def stretch_approximate(squared, rest):
    """The same without a square root, first order in d / rest - 1 (Jakobsen 2001).

    One Newton step from rest towards the root of d^2 gives d ~ (d^2 + rest^2) / (2 rest), so that
    1 - rest / d ~ (d^2 - rest^2) / (d^2 + rest^2). Good near rest length only: a stick of 3 rest comes out at 0.6 rest.
    """
    return (squared - rest * rest) / (squared + rest * rest)


@formula
def deviates(squared, rest, tolerance):
    """Whether the length is off by more than the relative tolerance (paper, 7: 1 %)."""
    slack = tolerance * rest
    low, high = rest - slack, rest + slack
    return (squared < low * low) | (squared > high * high)
