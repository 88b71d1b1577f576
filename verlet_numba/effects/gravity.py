"""Gravity: a constant acceleration. It is the first of the effects that accelerate, so it also starts their sum at zero."""

from verlet_numba._jit import kernel


@kernel
def fall(acceleration, gravity):
    """Set every particle's acceleration to gravity, or to zero for the effects that follow."""
    if acceleration is None:
        return
    if gravity is None:
        acceleration[:] = 0
        return
    for axis in range(3):
        total, g = acceleration[axis], gravity.acceleration[axis]
        for k in range(total.size):
            total[k] = g[k]
