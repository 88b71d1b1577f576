"""Gravity: a constant acceleration. It is the first of the effects that accelerate, so it also starts their sum at zero."""

from verlet_numba._jit import entry, kernel


@entry
def fall(acceleration, gravity):
    """Set every particle's acceleration to gravity, or to zero for the effects that follow."""
    if acceleration is None:
        return
    if gravity is None:
        acceleration[:] = 0
        return
    begin_with(acceleration, gravity.acceleration)


@kernel
def begin_with(acceleration, constant):
    """The sum begins anew, unless nothing else is ever added to it."""
    if constant is None:
        return
    for axis in range(3):
        total, g = acceleration[axis], constant[axis]
        for k in range(total.size):
            total[k] = g[k]
