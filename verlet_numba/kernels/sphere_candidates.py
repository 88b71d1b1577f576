"""Candidate lists that outlive substeps: pairs of particles listed with a margin, until motion could use it up.

A pair that is not listed was farther apart than touching plus the margin. Let the particles have moved by u_i since, and
let m be any vector: |u_i - u_j| <= |u_i - m| + |u_j - m|, at most twice the largest |u - m|. As long as that is no more
than the margin, no pair that is not listed touches. m is the mean of all u: a cloth that falls as a whole is listed once.
"""

import math

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.kernels.copying import copy_points
from verlet_numba.kernels.sphere_tree import list_pairs, update_layered


@kernel
def find_spheres(position, inverse_mass, layered, itself, stack, spheres):
    """Have every pair of deformable particles that touches among the candidates; list anew only if motion calls for it.

    `itself`: bodies meet themselves, too. False: more candidates than there is room for (grow and call again).
    """
    if spheres is None:
        return True
    candidates = spheres.candidates
    if candidates.listed[0] >= 0 and not outdated(position, spheres.at, spheres.soft, spheres.margin):
        return True
    candidates.listed[0] = -1
    update_layered(position, layered)
    if not list_pairs(layered, inverse_mass, spheres.margin, itself, stack, candidates):
        return False
    copy_points(position, spheres.at)
    return True


@kernel
def outdated(position, at, soft, margin):
    """Whether twice the largest displacement since the listing, relative to the mean of the soft particles', exceeds the margin."""
    x, y, z, u, v, w = position[0], position[1], position[2], at[0], at[1], at[2]
    sx, sy, sz, total = 0.0, 0.0, 0.0, 0.0
    for k in range(soft.size):
        sx += soft[k] * (x[k] - u[k])
        sy += soft[k] * (y[k] - v[k])
        sz += soft[k] * (z[k] - w[k])
        total += soft[k]
    if total == 0.0:
        return False
    mx, my, mz = sx / total, sy / total, sz / total
    still = 0
    for k in range(soft.size):
        dx, dy, dz = x[k] - u[k] - mx, y[k] - v[k] - my, z[k] - w[k] - mz
        still += soft[k] * (dx * dx + dy * dy + dz * dz) * 4.0 <= margin * margin
    return still < soft.size


@kernel
def travelled(points, at):
    """The largest displacement of any point since `at` [m]: against what does not move along, all of it counts."""
    x, y, z, u, v, w = points[0], points[1], points[2], at[0], at[1], at[2]
    farthest = 0.0
    for k in range(x.size):
        dx, dy, dz = np.float64(x[k] - u[k]), np.float64(y[k] - v[k]), np.float64(z[k] - w[k])
        farthest = max(farthest, dx * dx + dy * dy + dz * dz)
    return math.sqrt(farthest)
