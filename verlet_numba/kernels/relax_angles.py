"""One relaxation pass over all angle constraints (paper, 4)."""

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.kernels.relax import slack_of
from verlet_numba.physics.angle import bend


@kernel
def relax_angles(position, inverse_mass, angles, tolerance):
    """Bring every angle off its tolerance to its rest value, one after another, in double precision. Returns how many moved."""
    if angles is None:
        return 0
    x, y, z = position[0], position[1], position[2]
    slack, relaxed = slack_of(tolerance), 0
    for a in range(angles.rest.size):
        i, j, k = angles.corners[0, a], angles.corners[1, a], angles.corners[2, a]
        jx, jy, jz = np.float64(x[j]), np.float64(y[j]), np.float64(z[j])
        moved = bend(x[i] - jx, y[i] - jy, z[i] - jz, x[k] - jx, y[k] - jy, z[k] - jz, angles.rest[a], slack,
                     np.float64(inverse_mass[i]), np.float64(inverse_mass[j]), np.float64(inverse_mass[k]))
        move_three(x, y, z, i, j, k, moved)
        relaxed += any_of(moved)
    return relaxed


@inlined
def move_three(x, y, z, i, j, k, moved):
    """Move three particles by nine displacements."""
    x[i] += moved[0]
    y[i] += moved[1]
    z[i] += moved[2]
    x[j] += moved[3]
    y[j] += moved[4]
    z[j] += moved[5]
    x[k] += moved[6]
    y[k] += moved[7]
    z[k] += moved[8]


@inlined
def any_of(moved):
    """Whether any of nine displacements is not zero."""
    return (moved[0] != 0.0 or moved[1] != 0.0 or moved[2] != 0.0 or moved[3] != 0.0 or moved[4] != 0.0 or moved[5] != 0.0
            or moved[6] != 0.0 or moved[7] != 0.0 or moved[8] != 0.0)
