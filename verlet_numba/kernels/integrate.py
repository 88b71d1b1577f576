"""Verlet's step for all particles (paper, eq. 1)."""

from verlet_numba._jit import kernel
from verlet_numba.physics.verlet import verlet


@kernel
def integrate(position, previous, acceleration, h):
    """Move every particle by its last displacement and a h^2. Pinned particles and ghosts are at rest and stay."""
    if acceleration is None:
        drift(position, previous)
        return
    square = position.dtype.type(h * h)
    for axis in range(3):
        now, before, a = position[axis], previous[axis], acceleration[axis]
        for k in range(now.size):
            here = now[k]
            now[k] = verlet(here, before[k], a[k] * square)
            before[k] = here


@kernel
def drift(position, previous):
    """The same where nothing accelerates."""
    zero = position.dtype.type(0)
    for axis in range(3):
        now, before = position[axis], previous[axis]
        for k in range(now.size):
            here = now[k]
            now[k] = verlet(here, before[k], zero)
            before[k] = here
