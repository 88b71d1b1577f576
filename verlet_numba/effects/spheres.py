"""Contact between deformable bodies, and of one with itself: spheres about particles are moved apart (paper, P22).

Two spheres that overlap are moved along the line of their centres until they touch (eq. 11), each by its share of the
inverse masses, so that momentum is kept and a pin stays. This is done before every relaxation pass; the push is added up
over the passes of a substep, so that a pass may take back what an earlier one gave too much, never pull.

Overlap that stood already when the substep began must not become speed: pushing it out moves the previous positions
along, so that it is a shift in space. Only what the substep itself has added acts on velocities, and on friction.
"""

import math

import numpy as np

from verlet_numba._jit import formula, kernel
from verlet_numba.effects.friction import coefficients
from verlet_numba.physics.friction import held


@formula
def heading(i, j):
    """A unit vector that depends on the two numbers alone: the way apart for centres in one point."""
    h = (i * 73856093 + j * 19349663 + 83492791) & 0x7FFFFFFF
    h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & 0x7FFFFFFF
    h = ((h ^ (h >> 12)) * 0x297A2D39) & 0x7FFFFFFF
    height, turn = ((h & 0x7FFF) + 0.5) / 16384.0 - 1.0, 2.0 * math.pi * (h >> 15) / 65536.0
    beside = math.sqrt(1.0 - height * height)
    return beside * math.cos(turn), beside * math.sin(turn), height


@kernel
def begin_spheres(previous, spheres):
    """A substep begins: nothing is pushed yet, and the overlaps of the candidates are noted."""
    if spheres is None:
        return
    first, second, radius = spheres.candidates.first, spheres.candidates.second, spheres.radius
    push, standing = spheres.push, spheres.standing
    x, y, z = previous[0], previous[1], previous[2]
    for c in range(spheres.candidates.listed[0]):
        i, j = first[c], second[c]
        dx, dy, dz = np.float64(x[j]) - x[i], np.float64(y[j]) - y[i], np.float64(z[j]) - z[i]
        push[c], standing[c] = 0.0, max(0.0, np.float64(radius[i]) + radius[j] - math.sqrt(dx * dx + dy * dy + dz * dz))


@kernel
def part_spheres(position, previous, inverse_mass, spheres):
    """Move candidates that overlap apart to touch; take back what an earlier pass of this substep gave too much."""
    if spheres is None:
        return
    first, second, radius = spheres.candidates.first, spheres.candidates.second, spheres.radius
    push, standing = spheres.push, spheres.standing
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    for c in range(spheres.candidates.listed[0]):
        i, j, given = first[c], second[c], push[c]
        dx, dy, dz = np.float64(x[j]) - x[i], np.float64(y[j]) - y[i], np.float64(z[j]) - z[i]
        squared, reach = dx * dx + dy * dy + dz * dz, np.float64(radius[i]) + radius[j]
        if given == 0.0 and squared >= reach * reach:
            continue
        distance = math.sqrt(squared)
        total = max(0.0, given + reach - distance)
        if distance > 0.0:
            nx, ny, nz = dx / distance, dy / distance, dz / distance
        else:
            nx, ny, nz = heading(i, j)
        here, there = np.float64(inverse_mass[i]), np.float64(inverse_mass[j])
        here, there = here / (here + there), there / (here + there)
        push[c], move = total, total - given
        x[i], y[i], z[i] = x[i] - here * move * nx, y[i] - here * move * ny, z[i] - here * move * nz
        x[j], y[j], z[j] = x[j] + there * move * nx, y[j] + there * move * ny, z[j] + there * move * nz
        move = min(total, standing[c]) - min(given, standing[c])
        u[i], v[i], w[i] = u[i] - here * move * nx, v[i] - here * move * ny, w[i] - here * move * nz
        u[j], v[j], w[j] = u[j] + there * move * nx, v[j] + there * move * ny, w[j] + there * move * nz


@kernel
def rub_spheres(position, previous, inverse_mass, spheres, friction):
    """Take back sliding of one sphere on the other, up to Coulomb's share of what the substep pushed, after the passes.

    Both spheres answer to one impulse, so relative displacements stand for forces: along the surface since the start of
    the substep, and along the line of centres.
    """
    if spheres is None:
        return
    if friction is None:
        return
    first, second, push, standing = spheres.candidates.first, spheres.candidates.second, spheres.push, spheres.standing
    own = friction.particle
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    for c in range(spheres.candidates.listed[0]):
        pressed = push[c] - standing[c]
        if not pressed > 0.0:
            continue
        i, j = first[c], second[c]
        dx, dy, dz = np.float64(x[j]) - x[i], np.float64(y[j]) - y[i], np.float64(z[j]) - z[i]
        squared = dx * dx + dy * dy + dz * dz
        if squared == 0.0:
            continue
        sx, sy, sz = x[j] - u[j] - (x[i] - u[i]), y[j] - v[j] - (y[i] - v[i]), z[j] - w[j] - (z[i] - w[i])
        along = (sx * dx + sy * dy + sz * dz) / squared
        sx, sy, sz = sx - along * dx, sy - along * dy, sz - along * dz
        slide = math.sqrt(sx * sx + sy * sy + sz * sz)
        if slide > 0.0:
            static, dynamic = coefficients(own, own, i, j)
            here, there = np.float64(inverse_mass[i]), np.float64(inverse_mass[j])
            share = held(slide, pressed, static, dynamic) / (here + there)
            here, there = here * share, there * share
            x[i], y[i], z[i] = x[i] + here * sx, y[i] + here * sy, z[i] + here * sz
            x[j], y[j], z[j] = x[j] - there * sx, y[j] - there * sy, z[j] - there * sz


@kernel
def deepest(position, spheres):
    """The deepest overlap of any two candidates [m], 0 if none."""
    if spheres is None:
        return 0.0
    first, second, radius = spheres.candidates.first, spheres.candidates.second, spheres.radius
    x, y, z, found = position[0], position[1], position[2], 0.0
    for c in range(spheres.candidates.listed[0]):
        i, j = first[c], second[c]
        dx, dy, dz = np.float64(x[j]) - x[i], np.float64(y[j]) - y[i], np.float64(z[j]) - z[i]
        found = max(found, np.float64(radius[i]) + radius[j] - math.sqrt(dx * dx + dy * dy + dz * dz))
    return found


@kernel
def touching_spheres(spheres):
    """How many pairs were pushed in this substep."""
    if spheres is None:
        return 0
    push, pushed = spheres.push, 0
    for c in range(spheres.candidates.listed[0]):
        pushed += push[c] > 0.0
    return pushed
