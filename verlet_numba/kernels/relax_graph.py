"""Relaxation of rigid bodies in the order of the constraint graph (paper, 6.2), at vector speed.

Bodies that are relaxed by the same list make a bucket. They are packed side by side, particle p of body k in lane k of
row p, relaxed as one run for each entry of the list, and put back. Bodies share no particle, so the result of every
body is bit for bit that of relaxing it alone, stick by stick.

Lanes are filled up to whole vectors with what is not a number: it is never off tolerance.
"""

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.kernels.relax import returned
from verlet_numba.physics.distance import deviates

VECTOR = 8


@kernel
def sort_bodies(graph, moved):
    """Put every rigid body into its bucket. moved: (G,) particle that a collision moved most, -1: the body did not collide.

    A counting sort: counts become ends, and bodies are put in from behind, so that those of a bucket stay in order.
    """
    if graph is None:
        return
    first, bucket, place, start = graph.first, graph.bucket, graph.place, graph.start
    start[:] = 0
    for g in range(first.size):
        start[bucket[g] + moved[g] + 1] += 1
    for d in range(1, start.size):
        start[d] += start[d - 1]
    for g in range(first.size - 1, -1, -1):
        d = bucket[g] + moved[g] + 1
        start[d] -= 1
        place[start[d]] = first[g]


@kernel
def relax_graph(position, graph, tolerance, approximate):
    """Relax every rigid body once by its list. Returns the number of constraints relaxed: all, or those off tolerance."""
    if graph is None:
        return 0
    _, _, place, start, stride, particles, lanes, listed, entry, ends, rest, weight, packed = graph
    relaxed = 0
    for d in range(particles.size):
        sticks = entry[listed[d]:listed[d + 1]]
        for begin in range(start[d], start[d + 1], lanes[d]):
            bodies = place[begin:min(begin + lanes[d], start[d + 1])]
            width = -(-bodies.size // VECTOR) * VECTOR
            pack(position, bodies, stride[d], particles[d], width, packed)
            if tolerance is None:
                relaxed += bodies.size * relax_list(packed, width, sticks, ends, rest, weight, approximate)
            else:
                relaxed += relax_tolerant_list(packed, width, sticks, ends, rest, weight, tolerance, approximate)
            unpack(position, bodies, stride[d], particles[d], width, packed)
    return relaxed


@kernel
def pack(position, place, stride, particles, width, packed):
    """Particles of the bodies that begin at place (N,) into lanes; lanes without a body are not a number."""
    for axis in range(3):
        for p in range(particles):
            column, row = position[axis, p * stride:], packed[axis, p * width:(p + 1) * width]
            for k in range(place.size):
                row[k] = column[np.uint64(place[k])]
            row[place.size:] = np.nan


@kernel
def unpack(position, place, stride, particles, width, packed):
    """And back."""
    for axis in range(3):
        for p in range(particles):
            column, row = position[axis, p * stride:], packed[axis, p * width:(p + 1) * width]
            for k in range(place.size):
                column[np.uint64(place[k])] = row[k]


@kernel
def relax_list(packed, width, sticks, ends, rest, weight, approximate):
    """Relax the lanes by a list of sticks, one run an entry. Returns the number of constraints relaxed in each lane."""
    x, y, z = packed[0], packed[1], packed[2]
    zero, tiny = packed.dtype.type(0), np.finfo(packed.dtype).tiny
    relaxed = 0
    for c in sticks:
        length, gi, gj = rest[c], weight[0, c], weight[1, c]
        if gi + gj == zero:
            continue
        relaxed += 1
        i, j = ends[0, c] * width, ends[1, c] * width
        xi, yi, zi, xj, yj, zj = x[i:i + width], y[i:i + width], z[i:i + width], x[j:j + width], y[j:j + width], z[j:j + width]
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            f = returned(dx * dx + dy * dy + dz * dz + tiny, length, approximate)
            fi, fj = f * gi, f * gj
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return relaxed


@kernel
def relax_tolerant_list(packed, width, sticks, ends, rest, weight, tolerance, approximate):
    """The same, leaving alone what is within the relative tolerance (paper, 7). Returns the number relaxed in all lanes.

    Counting comes first: where no lane is off, and in later passes that is often, nothing else is to do.
    """
    x, y, z = packed[0], packed[1], packed[2]
    zero, slack, tiny = packed.dtype.type(0), packed.dtype.type(tolerance), np.finfo(packed.dtype).tiny
    relaxed = 0
    for c in sticks:
        length, gi, gj = rest[c], weight[0, c], weight[1, c]
        if gi + gj == zero:
            continue
        i, j = ends[0, c] * width, ends[1, c] * width
        xi, yi, zi, xj, yj, zj = x[i:i + width], y[i:i + width], z[i:i + width], x[j:j + width], y[j:j + width], z[j:j + width]
        off = 0
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            off += deviates(dx * dx + dy * dy + dz * dz + tiny, length, slack)
        if off == 0:
            continue
        relaxed += off
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            squared = dx * dx + dy * dy + dz * dz + tiny
            f = returned(squared, length, approximate) if deviates(squared, length, slack) else zero
            fi, fj = f * gi, f * gj
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return relaxed
