"""Distance constraints corrected along their direction at the start of the substep (SHAKE: Ryckaert, Ciccotti, Berendsen 1977).

With the projection along the present direction a spinning body loses energy in proportion to the step; along that at its
start, which Verlet keeps as the previous position, forces are those of the time at which the step is centred, and motion is of
second order. The correction along r, with p the present separation, f = (p.p - rest^2) / (2 p.r), ends on rest length but for
f^2 r.r, and needs no square root (physics/distance.py).

It fails where p has turned far from r, and after collisions. So it is decided once in a substep and for each body, before the
first pass: one that contacts have moved, or of which a stick changes by more than CHANGE of its length, takes present directions.
A stick that a later pass finds across its direction is left to the others.
"""

import math

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.buffers.world import FALLEN
from verlet_numba.kernels.copying import copy_points
from verlet_numba.kernels.relax import relax_runs, relax_sticks, slack_of
from verlet_numba.physics.distance import deviates

CHANGE = 0.4        # of its length, by which a stick may change in a substep: it turns by 23 degrees


@kernel
def note_start(position, start):
    """Where the particles are before contacts move them."""
    if start is None:
        return
    note(position, start.before)


@kernel
def note(position, before):
    if before is None:
        return
    copy_points(position, before)


@kernel
def guard(position, previous, runs, sticks, start, counts):
    """Mark the particles of bodies whose sticks take their present direction in this substep, and count these bodies."""
    if start is None:
        return
    marks = start.marks
    marks[:] = 0
    marked = mark_moved(position, start.before, marks)
    marked += mark_changed_runs(position, previous, runs, marks)
    marked += mark_changed_sticks(position, previous, sticks, marks)
    start.marked[0] = marked
    if marked:
        counts[FALLEN] += mark_bodies(start.first, start.slots, start.lanes, start.worst, marks)


@kernel
def mark_moved(position, before, marks):
    """Particles that contacts have moved."""
    if before is None:
        return 0
    x, y, z, u, v, w = position[0], position[1], position[2], before[0], before[1], before[2]
    zero, one, marked = marks.dtype.type(0), marks.dtype.type(1), 0
    for k in range(marks.size):
        moved = (x[k] != u[k]) | (y[k] != v[k]) | (z[k] != w[k])
        marks[k] = one if moved else zero
        marked += moved
    return marked


@kernel
def mark_changed_runs(position, previous, runs, marks):
    """First particles of sticks that have changed much, run by run."""
    if runs is None:
        return 0
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    real = position.dtype.type
    zero, one, most, marked = real(0), real(1), real(CHANGE * CHANGE), 0
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        ui, vi, wi, uj, vj, wj = u[i:i + n], v[i:i + n], w[i:i + n], u[j:j + n], v[j:j + n], w[j:j + n]
        rest, gi, gj, mark = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n], marks[i:i + n]
        for k in range(n):
            dx, dy, dz = xj[k] - xi[k] - (uj[k] - ui[k]), yj[k] - yi[k] - (vj[k] - vi[k]), zj[k] - zi[k] - (wj[k] - wi[k])
            changed = (dx * dx + dy * dy + dz * dz > most * rest[k] * rest[k]) & (gi[k] + gj[k] > zero)
            mark[k] = one if changed else mark[k]
            marked += changed
    return marked


@kernel
def mark_changed_sticks(position, previous, sticks, marks):
    """The same, stick by stick; attachments, of rest length 0, have no direction."""
    if sticks is None:
        return 0
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    most, zero, marked = position.dtype.type(CHANGE * CHANGE), position.dtype.type(0), 0
    for c in range(sticks.rest.size):
        i, j, rest = sticks.ends[0, c], sticks.ends[1, c], sticks.rest[c]
        if rest > zero and sticks.weight[0, c] + sticks.weight[1, c] > zero:
            dx, dy, dz = x[j] - x[i] - (u[j] - u[i]), y[j] - y[i] - (v[j] - v[i]), z[j] - z[i] - (w[j] - w[i])
            if dx * dx + dy * dy + dz * dz > most * rest * rest:
                marks[i] = 1
                marked += 1
    return marked


@kernel
def mark_bodies(first, slots, lanes, worst, marks):
    """What is marked on a particle is marked on all of its body. Returns how many bodies are."""
    bodies = 0
    for b in range(first.size):
        f, n = first[b], lanes[b]
        for lane in range(n):
            worst[lane] = 0
        for s in range(slots[b]):
            mark = marks[f + s * n:f + (s + 1) * n]
            for lane in range(n):
                worst[lane] = max(worst[lane], mark[lane])
        for s in range(slots[b]):
            mark = marks[f + s * n:f + (s + 1) * n]
            for lane in range(n):
                mark[lane] = worst[lane]
        for lane in range(n):
            bodies += worst[lane] > 0
    return bodies


@kernel
def relax_runs_along(position, previous, runs, softness, tolerance, approximate, start):
    """Relax every run once, along present directions or those at the start of the substep. Returns the constraints relaxed."""
    if start is None:
        return relax_runs(position, runs, softness, tolerance, approximate)
    return relax_started_runs(position, previous, runs, softness, tolerance, approximate, start.marks, start.marked[0])


@kernel
def relax_sticks_along(position, previous, sticks, softness, tolerance, approximate, start):
    """The same for single sticks."""
    if start is None:
        return relax_sticks(position, sticks, softness, tolerance, approximate)
    return relax_started_sticks(position, previous, sticks, softness, tolerance, approximate, start.marks)


@kernel
def relax_started_runs(position, previous, runs, softness, tolerance, approximate, marks, marked):
    """Relax every run once. marked: how many marks there are."""
    if runs is None:
        return 0
    if softness is not None:
        return relax_started_soft_runs(position, previous, runs, softness, tolerance, approximate, marks)
    if marked == 0 and slack_of(tolerance) == 0:
        return relax_unmarked_runs(position, previous, runs)
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    zero, slack, relaxed = real(0), real(slack_of(tolerance)), 0
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        ui, vi, wi, uj, vj, wj = u[i:i + n], v[i:i + n], w[i:i + n], u[j:j + n], v[j:j + n], w[j:j + n]
        rest, gi, gj, mark = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n], marks[i:i + n]
        for k in range(n):
            px, py, pz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            rx, ry, rz = uj[k] - ui[k], vj[k] - vi[k], wj[k] - wi[k]
            squared, along = px * px + py * py + pz * pz + tiny, px * rx + py * ry + pz * rz
            present = mark[k] > zero
            off = ((slack == zero) | deviates(squared, rest[k], slack)) & (gi[k] + gj[k] > zero)
            relaxed += off
            f = part(squared, along, rest[k], present, approximate) if off & (present | (along > zero)) else zero
            rx, ry, rz = px if present else rx, py if present else ry, pz if present else rz
            fi, fj = f * gi[k], f * gj[k]
            xi[k] += fi * rx
            yi[k] += fi * ry
            zi[k] += fi * rz
            xj[k] -= fj * rx
            yj[k] -= fj * ry
            zj[k] -= fj * rz
    return relaxed


@kernel
def relax_unmarked_runs(position, previous, runs):
    """The same in the same arithmetic where no body is marked and every constraint is relaxed."""
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    zero, tiny = position.dtype.type(0), np.finfo(position.dtype).tiny
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        ui, vi, wi, uj, vj, wj = u[i:i + n], v[i:i + n], w[i:i + n], u[j:j + n], v[j:j + n], w[j:j + n]
        rest, gi, gj = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n]
        for k in range(n):
            px, py, pz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            rx, ry, rz = uj[k] - ui[k], vj[k] - vi[k], wj[k] - wi[k]
            squared, along = px * px + py * py + pz * pz + tiny, px * rx + py * ry + pz * rz
            f = (squared - rest[k] * rest[k]) / (along + along) if along > zero else zero
            fi, fj = f * gi[k], f * gj[k]
            xi[k] += fi * rx
            yi[k] += fi * ry
            zi[k] += fi * rz
            xj[k] -= fj * rx
            yj[k] -= fj * ry
            zj[k] -= fj * rz
    return runs.active


@kernel
def relax_started_soft_runs(position, previous, runs, softness, tolerance, approximate, marks):
    """The same for compliant sticks over several passes (see relax_soft_runs)."""
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    zero, slack, relaxed = real(0), real(slack_of(tolerance)), 0
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        ui, vi, wi, uj, vj, wj = u[i:i + n], v[i:i + n], w[i:i + n], u[j:j + n], v[j:j + n], w[j:j + n]
        rest, gi, gj, mark = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n], marks[i:i + n]
        share, given = softness.share[d:d + n], softness.given[d:d + n]
        for k in range(n):
            px, py, pz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            rx, ry, rz = uj[k] - ui[k], vj[k] - vi[k], wj[k] - wi[k]
            squared, along = px * px + py * py + pz * pz + tiny, px * rx + py * ry + pz * rz
            present = mark[k] > zero
            aligned = present | (along > zero)
            f = part(squared, along, rest[k], present, approximate) if aligned else zero
            rx, ry, rz = px if present else rx, py if present else ry, pz if present else rz
            length = np.sqrt(rx * rx + ry * ry + rz * rz + tiny)
            missing = f * length - given[k]
            off = (abs(missing) >= slack * rest[k]) & (gi[k] + gj[k] > zero)
            relaxed += off
            missing = missing if off & aligned else zero
            given[k] += share[k] * missing
            f = missing / length
            fi, fj = f * gi[k], f * gj[k]
            xi[k] += fi * rx
            yi[k] += fi * ry
            zi[k] += fi * rz
            xj[k] -= fj * rx
            yj[k] -= fj * ry
            zj[k] -= fj * rz
    return relaxed


@kernel
def relax_started_sticks(position, previous, sticks, softness, tolerance, approximate, marks):
    """Relax single sticks in order, in the same arithmetic as runs. Attachments take their present direction."""
    if sticks is None:
        return 0
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    zero, slack, relaxed = real(0), real(slack_of(tolerance)), 0
    for c in range(sticks.rest.size):
        i, j, gi, gj, rest = sticks.ends[0, c], sticks.ends[1, c], sticks.weight[0, c], sticks.weight[1, c], sticks.rest[c]
        px, py, pz, rx, ry, rz = x[j] - x[i], y[j] - y[i], z[j] - z[i], u[j] - u[i], v[j] - v[i], w[j] - w[i]
        squared, along = px * px + py * py + pz * pz + tiny, px * rx + py * ry + pz * rz
        present = marks[i] > zero or rest == zero
        aligned = present or along > zero
        f = part(squared, along, rest, present, approximate) if aligned else zero
        if present:
            rx, ry, rz = px, py, pz
        off, f = eased(f, squared, np.sqrt(rx * rx + ry * ry + rz * rz + tiny), rest, slack, aligned, zero, softness, c)
        if off and gi + gj > zero:
            relaxed += 1
            fi, fj = f * gi, f * gj
            x[i] += fi * rx
            y[i] += fi * ry
            z[i] += fi * rz
            x[j] -= fj * rx
            y[j] -= fj * ry
            z[j] -= fj * rz
    return relaxed


@kernel
def part(squared, along, rest, present, approximate):
    """The part of the direction to take back: along the present one, or along that at the start. One division either way."""
    if approximate is not None:
        return approximate_part(squared, along, rest, present)
    length = math.sqrt(squared)
    over, by = length - rest if present else squared - rest * rest, length if present else along + along
    return over / by


@kernel
def approximate_part(squared, along, rest, present):
    """The same without a square root."""
    return (squared - rest * rest) / (squared + rest * rest if present else along + along)


@kernel
def eased(f, squared, length, rest, slack, aligned, zero, softness, c):
    """Whether stick c is off tolerance (always, where that is 0), and its part less what a spring's tension accounts for."""
    if softness is None:
        return slack == 0 or deviates(squared, rest, slack), f
    missing = f * length - softness.given[c]
    off = abs(missing) >= slack * rest
    missing = missing if off and aligned else zero
    softness.given[c] += softness.share[c] * missing
    return off, missing / length
