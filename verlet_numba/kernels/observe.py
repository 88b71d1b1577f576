"""What a frame shows: positions and velocities in the order of the file, and the observables."""

import math

import numpy as np

from verlet_numba._jit import entry, inlined, kernel
from verlet_numba.buffers.world import (
    COLUMNS,
    CONTACTS,
    ERROR_MAX,
    ERROR_RMS,
    FALLBACKS,
    FALLEN,
    FALLEN_KEPT,
    KINETIC,
    RELAXATIONS,
    RELAXED,
    RELAXED_KEPT,
    SPEED_MAX,
)
from verlet_numba.kernels.observe_beside import energies_beside, errors_beside, tell

FAR = 1e30


@kernel
def keep(position, previous, snapshot, contacts):
    """At a frame's time: keep the state that the next substep completes. contacts: of every instance."""
    for axis in range(3):
        place, before = snapshot.position[axis], snapshot.before[axis]
        now, earlier = position[axis], previous[axis]
        for k in range(now.size):
            place[k], before[k] = now[k], earlier[k]
    counts = snapshot.counts
    snapshot.touching[:] = contacts
    counts[RELAXED_KEPT], counts[RELAXED] = counts[RELAXED], 0
    counts[FALLEN_KEPT], counts[FALLEN] = counts[FALLEN], 0


@kernel
def record(output, values, order, instances):
    """Copy positions to a frame of the file, instance by instance and particle by particle in its order."""
    x, y, z, row = values[0], values[1], values[2], 0
    for i in range(instances):
        for p in range(order.size):
            k = order[p] + i
            output[row, 0], output[row, 1], output[row, 2] = x[k], y[k], z[k]
            row += 1


@entry
def record_velocity(output, f, position, before, order, instances, h):
    """Central differences about the frame's time: second order in the step. Only where the file asks for velocities."""
    if output is None:
        return
    scale, row = 0.5 / h, 0
    for i in range(instances):
        for p in range(order.size):
            k = order[p] + i
            for axis in range(3):
                output[f, row, axis] = (np.float64(position[axis, k]) - before[axis, k]) * scale
            row += 1


@entry
def observe(measures, sound, position, snapshot, observed, h):
    """Energies, momenta and constraint errors of the kept frame, in double precision, one instance after the other.

    sound (I,): 0 where an instance is not finite, or lost in space. Returns whether any is sound.
    """
    measures[:] = 0.0
    add_up(measures, position, snapshot, observed, observed.sums, h)
    counts, nowhere_lost, some = snapshot.counts, in_space(snapshot.position), False
    for i in range(observed.instances):
        row = measures[i * COLUMNS:(i + 1) * COLUMNS]
        row[CONTACTS], row[RELAXATIONS], row[FALLBACKS] = snapshot.touching[i], counts[RELAXED_KEPT], counts[FALLEN_KEPT]
        sound[i] = (np.isfinite(row[KINETIC]) and np.isfinite(row[ERROR_RMS]) and row[SPEED_MAX] < FAR
                    and (nowhere_lost or stays(snapshot.position, i, observed.instances)))
        some = some or sound[i] > 0
    return some


@kernel
def add_up(measures, position, snapshot, observed, sums, h):
    """Energies, momenta and constraint errors."""
    if sums is not None:
        energies_beside(measures, position, snapshot, observed, h)
        errors_beside(measures, snapshot.position, observed)
        return
    energies(measures, position, snapshot, observed, h)
    constraint_errors(measures, snapshot.position, observed.pairs, observed.rest)


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
def stays(position, i, instances):
    """The same of one instance."""
    for axis in range(3):
        for k in range(i, position.shape[1], instances):
            if not (abs(position[axis, k]) < FAR):
                return False
    return True


@kernel
def energies(row, position, snapshot, observed, h):
    """Sums over the particles of the file; velocities by central difference (Hairer, Lubich, Wanner 2003, eq. 1.4).

    Displacements are summed first and made velocities at the end; observe_beside.py has the same arithmetic.
    """
    (x, y, z), (u, v, w), (a, b, c) = rows(snapshot.position), rows(position), rows(snapshot.before)
    order, mass = observed.scene_order, observed.mass
    total = fastest = squares = px = py = pz = lx = ly = lz = cx = cy = cz = 0.0
    for p in range(order.size):
        k, m = order[p], mass[p]
        rx, ry, rz = np.float64(x[k]), np.float64(y[k]), np.float64(z[k])
        dx, dy, dz = np.float64(u[k]) - a[k], np.float64(v[k]) - b[k], np.float64(w[k]) - c[k]
        square = dx * dx + dy * dy + dz * dz
        qx, qy, qz = m * dx, m * dy, m * dz
        total, fastest, squares = total + m, max(fastest, square), squares + m * square
        px, py, pz = px + qx, py + qy, pz + qz
        lx, ly, lz = lx + (ry * qz - rz * qy), ly + (rz * qx - rx * qz), lz + (rx * qy - ry * qx)
        cx, cy, cz = cx + m * rx, cy + m * ry, cz + m * rz
    tell(row, h, total, fastest, squares, px, py, pz, lx, ly, lz, cx, cy, cz, observed.gravity, 0)


@inlined
def rows(points):
    """The three rows of points (3, n)."""
    return points[0], points[1], points[2]


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
