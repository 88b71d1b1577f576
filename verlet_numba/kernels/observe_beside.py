"""Observables of several instances side by side: vector lanes, each in the arithmetic and the order of one alone.

Sums stand in one scratch array, those of a kind INSTANCES numbers after those of the last: a distance that the compiler
knows, so that it need not ask for every row of lanes whether sums overlap.
"""

import math

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.buffers.world import (
    ANGULAR,
    CENTRE,
    COLUMNS,
    ERROR_MAX,
    ERROR_RMS,
    INSTANCES,
    KINETIC,
    MOMENTUM,
    POTENTIAL,
    SPEED_MAX,
    TOTAL,
)


@kernel
def energies_beside(measures, position, snapshot, observed, h):
    """As `energies`, of all instances."""
    s, n, b = observed.sums, observed.instances, INSTANCES
    moments(s, position, snapshot.position, snapshot.before, observed.scene_order, observed.mass, n)
    for i in range(n):
        tell(measures[i * COLUMNS:(i + 1) * COLUMNS], h, s[i], s[b + i], s[2 * b + i], s[3 * b + i], s[4 * b + i], s[5 * b + i],
             s[6 * b + i], s[7 * b + i], s[8 * b + i], s[9 * b + i], s[10 * b + i], s[11 * b + i], observed.gravity, i)


@kernel
def tell(row, h, total, fastest, squares, px, py, pz, lx, ly, lz, cx, cy, cz, gravity, i):
    """Energies and momenta of instance i from sums over its particles: displacements are those of two steps."""
    scale, whole = 0.5 / h, total if total > 0.0 else 1.0
    row[KINETIC], row[POTENTIAL] = 0.5 * scale * scale * squares, potential(gravity, i, cx, cy, cz)
    row[TOTAL], row[SPEED_MAX] = row[KINETIC] + row[POTENTIAL], scale * math.sqrt(fastest)
    row[MOMENTUM], row[MOMENTUM + 1], row[MOMENTUM + 2] = scale * px, scale * py, scale * pz
    row[ANGULAR], row[ANGULAR + 1], row[ANGULAR + 2] = scale * lx, scale * ly, scale * lz
    row[CENTRE], row[CENTRE + 1], row[CENTRE + 2] = cx / whole, cy / whole, cz / whole


@kernel
def potential(gravity, i, cx, cy, cz):
    """The sum of -m g . x [J] of instance i, zero at the origin, from the sum of m x [kg m]."""
    if gravity is None:
        return 0.0
    return -(gravity[0, i] * cx + gravity[1, i] * cy + gravity[2, i] * cz)


@kernel
def moments(sums, position, middle, before, order, mass, n):
    """Sums over the particles of n instances, in the order in which `tell` takes them."""
    x, y, z, u, v, w = middle[0], middle[1], middle[2], position[0], position[1], position[2]
    a, b, c = before[0], before[1], before[2]
    sums[:] = 0.0
    for p in range(order.size):
        k, d = order[p], p * n
        xs, ys, zs, us, vs, ws = x[k:k + n], y[k:k + n], z[k:k + n], u[k:k + n], v[k:k + n], w[k:k + n]
        xb, yb, zb, masses = a[k:k + n], b[k:k + n], c[k:k + n], mass[d:d + n]
        for i in range(n):
            m, rx, ry, rz = masses[i], np.float64(xs[i]), np.float64(ys[i]), np.float64(zs[i])
            dx, dy, dz = np.float64(us[i]) - xb[i], np.float64(vs[i]) - yb[i], np.float64(ws[i]) - zb[i]
            square = dx * dx + dy * dy + dz * dz
            qx, qy, qz = m * dx, m * dy, m * dz
            sums[i] += m
            sums[INSTANCES + i] = max(sums[INSTANCES + i], square)
            sums[2 * INSTANCES + i] += m * square
            sums[3 * INSTANCES + i] += qx
            sums[4 * INSTANCES + i] += qy
            sums[5 * INSTANCES + i] += qz
            sums[6 * INSTANCES + i] += ry * qz - rz * qy
            sums[7 * INSTANCES + i] += rz * qx - rx * qz
            sums[8 * INSTANCES + i] += rx * qy - ry * qx
            sums[9 * INSTANCES + i] += m * rx
            sums[10 * INSTANCES + i] += m * ry
            sums[11 * INSTANCES + i] += m * rz


@kernel
def errors_beside(measures, position, observed):
    """As `constraint_errors`, of all instances."""
    sums, pairs, rest, n = observed.sums, observed.pairs, observed.rest, observed.instances
    x, y, z = position[0], position[1], position[2]
    sums[:] = 0.0
    for c in range(pairs.shape[1]):
        first, second, d = pairs[0, c], pairs[1, c], c * n
        xi, yi, zi = x[first:first + n], y[first:first + n], z[first:first + n]
        xj, yj, zj, lengths = x[second:second + n], y[second:second + n], z[second:second + n], rest[d:d + n]
        for i in range(n):
            dx, dy, dz = np.float64(xj[i]) - xi[i], np.float64(yj[i]) - yi[i], np.float64(zj[i]) - zi[i]
            error = abs(math.sqrt(dx * dx + dy * dy + dz * dz) / lengths[i] - 1.0)
            counts = lengths[i] > 0.0
            error = error if counts else 0.0
            sums[i] = max(sums[i], error)
            sums[INSTANCES + i] += error * error
            sums[2 * INSTANCES + i] += 1.0 if counts else 0.0
    for i in range(n):
        counted = sums[2 * INSTANCES + i]
        measures[i * COLUMNS + ERROR_MAX] = sums[i]
        measures[i * COLUMNS + ERROR_RMS] = math.sqrt(sums[INSTANCES + i] / counted) if counted > 0 else 0.0
