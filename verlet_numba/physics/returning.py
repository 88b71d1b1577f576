"""An error that returns to 0 as a critically damped spring does: e'' = -c^2 e - 2 c e'.

From rest it is (1 + c t) exp(-c t) of what it was. In a step h, implicitly, with x = c h, `free` the error without the spring and
`before` that of a step ago,

    e = free - x^2 e - 2 x (e - before)

so that a force which the spring bears bends it as far whatever the step. The right side is spread over several passes (XPBD:
Macklin, Mueller, Chentanez 2016, eq. 18): of a present error e, of which `given` was taken away so far in this step,
(x^2 e + 2 x (e - before) - given) / (1 + x)^2 is left to take away.
"""

from verlet_numba._jit import formula


@formula
def owed(error, before, given, spring, damper, memory):
    """What is left to take away. spring, damper, memory: x^2, 2 x and 1, over (1 + x)^2."""
    return spring * error + damper * (error - before) - memory * given
