"""Copies between buffers. `target[:] = source` would allocate an array of its own in case the two overlap."""

from verlet_numba._jit import kernel


@kernel
def copy(source, target, size):
    """Copy the first entries."""
    for k in range(size):
        target[k] = source[k]


@kernel
def copy_points(source, target):
    """Copy points (3, n)."""
    for axis in range(3):
        copy(source[axis], target[axis], target.shape[1])
