"""What a frame shows: positions and velocities in the order of the file, and the observables."""

import math

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers import (
    ANGULAR,
    CENTRE,
    CONTACTS,
    ERROR_MAX,
    ERROR_RMS,
    FALLBACKS,
    FALLEN,
    FALLEN_KEPT,
    KINETIC,
    MOMENTUM,
    POTENTIAL,
    RELAXATIONS,
    RELAXED,
    RELAXED_KEPT,
    SPEED_MAX,
    TOTAL,
    TOUCHING,
)

FAR = 1e30


@kernel
def keep(position, previous, snapshot, contacts):
    """At a frame's time: keep the state that the next substep completes."""
    for axis in range(3):
        place, before = snapshot.position[axis], snapshot.before[axis]
        now, earlier = position[axis], previous[axis]
        for k in range(now.size):
            place[k], before[k] = now[k], earlier[k]
    counts = snapshot.counts
    counts[TOUCHING] = contacts
    counts[RELAXED_KEPT], counts[RELAXED] = counts[RELAXED], 0
    counts[FALLEN_KEPT], counts[FALLEN] = counts[FALLEN], 0


@kernel
def record(output, values, order):
    """Copy positions to a frame of the file, particle by particle in its order."""
    x, y, z = values[0], values[1], values[2]
    for p in range(order.size):
        k = order[p]
        output[p, 0], output[p, 1], output[p, 2] = x[k], y[k], z[k]


@kernel
def record_velocity(output, f, position, before, order, h):
    """Central differences about the frame's time: second order in the step. Only where the file asks for velocities."""
    if output is None:
        return
    scale = 0.5 / h
    for p in range(order.size):
        k = order[p]
        for axis in range(3):
            output[f, p, axis] = (np.float64(position[axis, k]) - before[axis, k]) * scale


@kernel
def observe(row, position, snapshot, observed, h):
    """Energies, momenta and constraint errors of the kept frame, in double precision. False: not finite, or lost in space."""
    row[:] = 0.0
    energies(row, position, snapshot, observed, h)
    constraint_errors(row, snapshot.position, observed.pairs, observed.rest)
    row[CONTACTS], row[RELAXATIONS] = snapshot.counts[TOUCHING], snapshot.counts[RELAXED_KEPT]
    row[FALLBACKS] = snapshot.counts[FALLEN_KEPT]
    return np.isfinite(row[KINETIC]) and np.isfinite(row[ERROR_RMS]) and row[SPEED_MAX] < FAR and in_space(snapshot.position)


@kernel
def in_space(position):
    """Whether every coordinate is a number that a float32 file can hold."""
    for axis in range(3):
        x, lost = position[axis], 0
        for k in range(x.size):
            lost += not (abs(x[k]) < FAR)
        if lost > 0:
            return False
    return True


@kernel
def energies(row, position, snapshot, observed, h):
    """Sums over the particles of the file; velocities by central difference (Hairer, Lubich, Wanner 2003, eq. 1.4)."""
    (x, y, z), (u, v, w), (a, b, c) = rows(snapshot.position), rows(position), rows(snapshot.before)
    order, mass, scale = observed.scene_order, observed.mass, 0.5 / h
    total = fastest = kinetic = px = py = pz = lx = ly = lz = cx = cy = cz = 0.0
    for p in range(order.size):
        k, m = order[p], mass[p]
        rx, ry, rz = np.float64(x[k]), np.float64(y[k]), np.float64(z[k])
        vx, vy, vz = (np.float64(u[k]) - a[k]) * scale, (np.float64(v[k]) - b[k]) * scale, (np.float64(w[k]) - c[k]) * scale
        square = vx * vx + vy * vy + vz * vz
        total, fastest, kinetic = total + m, max(fastest, square), kinetic + 0.5 * m * square
        px, py, pz = px + m * vx, py + m * vy, pz + m * vz
        lx, ly, lz = lx + m * (ry * vz - rz * vy), ly + m * (rz * vx - rx * vz), lz + m * (rx * vy - ry * vx)
        cx, cy, cz = cx + m * rx, cy + m * ry, cz + m * rz
    whole = total if total > 0.0 else 1.0
    row[KINETIC], row[POTENTIAL] = kinetic, potential(snapshot.position, order, mass, observed.gravity)
    row[TOTAL], row[SPEED_MAX] = row[KINETIC] + row[POTENTIAL], math.sqrt(fastest)
    row[MOMENTUM], row[MOMENTUM + 1], row[MOMENTUM + 2] = px, py, pz
    row[ANGULAR], row[ANGULAR + 1], row[ANGULAR + 2] = lx, ly, lz
    row[CENTRE], row[CENTRE + 1], row[CENTRE + 2] = cx / whole, cy / whole, cz / whole


@inlined
def rows(points):
    """The three rows of points (3, n)."""
    return points[0], points[1], points[2]


@kernel
def potential(position, order, mass, gravity):
    """The sum of -m g . x [J], zero at the origin."""
    if gravity is None:
        return 0.0
    energy = 0.0
    for p in range(order.size):
        k = order[p]
        along = gravity[0, p] * position[0, k] + gravity[1, p] * position[1, k] + gravity[2, p] * position[2, k]
        energy -= mass[p] * along
    return energy


@kernel
def constraint_errors(row, position, pairs, rest):
    """Largest and root mean square of |d / rest - 1| over distance constraints of positive rest length."""
    worst, squares, counted = 0.0, 0.0, 0
    x, y, z = position[0], position[1], position[2]
    for c in range(rest.size):
        if rest[c] > 0.0:
            i, j = pairs[0, c], pairs[1, c]
            dx, dy, dz = np.float64(x[j]) - x[i], np.float64(y[j]) - y[i], np.float64(z[j]) - z[i]
            error = abs(math.sqrt(dx * dx + dy * dy + dz * dz) / rest[c] - 1.0)
            worst, counted = max(worst, error), counted + 1
            squares += error * error
    row[ERROR_MAX] = worst
    row[ERROR_RMS] = math.sqrt(squares / counted) if counted > 0 else 0.0
