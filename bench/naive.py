"""What one would write first: loops over particles and sticks, positions (n, 3), Numba's default flags."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from verlet_numba.scene.build import Model


@njit
def relax(position, sticks, rest, inverse_mass, passes):
    """`passes` over all sticks (C, 2), one after another (Jakobsen 2001)."""
    for _ in range(passes):
        for c in range(len(rest)):
            i, j = sticks[c, 0], sticks[c, 1]
            dx = position[j, 0] - position[i, 0]
            dy = position[j, 1] - position[i, 1]
            dz = position[j, 2] - position[i, 2]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            f = (length - rest[c]) / (length * (inverse_mass[i] + inverse_mass[j]))
            fi, fj = f * inverse_mass[i], f * inverse_mass[j]
            position[i, 0] += fi * dx
            position[i, 1] += fi * dy
            position[i, 2] += fi * dz
            position[j, 0] -= fj * dx
            position[j, 1] -= fj * dy
            position[j, 2] -= fj * dz


@njit
def advance(position, previous, sticks, rest, inverse_mass, gravity, h, substeps):
    """Verlet integration under gravity (3,) [m/s^2] and one pass over the sticks, `substeps` times."""
    for _ in range(substeps):
        for i in range(len(position)):
            if inverse_mass[i] > 0:
                for axis in range(3):
                    now = position[i, axis]
                    position[i, axis] = 2 * now - previous[i, axis] + gravity[axis] * h * h
                    previous[i, axis] = now
        relax(position, sticks, rest, inverse_mass, 1)


def body_major(model: Model) -> tuple[NDArray[Any], ...]:
    """Positions (n, 3), sticks (C, 2), rest lengths (C,) and inverse masses (n,), body after body and copy after copy."""
    real = model.world.particles.position.dtype
    positions, sticks, rest, masses, first = [], [], [], [], 0
    for body in model.bodies:
        for copy in body.positions:
            positions.append(copy)
            sticks.append(body.shape.sticks + first)
            rest.append(body.shape.lengths)
            masses.append(np.where(body.pinned, np.inf, body.shape.masses))
            first += len(copy)
    return (np.concatenate(positions).astype(real), np.concatenate(sticks), np.concatenate(rest).astype(real),
            (1 / np.concatenate(masses)).astype(real))
