"""Relaxation of rigid bodies in the order of the constraint graph (paper, 6.2), at vector speed.

Bodies that are relaxed by the same list make a bucket. They are packed side by side, particle p of body k in lane k of
row p, relaxed as one run for each entry of the list, and put back. Bodies share no particle, so the result of every
body is bit for bit that of relaxing it alone, stick by stick. Rest lengths are laid out likewise; for bodies that are
alike once for all of them.

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
    body, bucket, order, start = graph.body, graph.bucket, graph.sorted, graph.start
    start[:] = 0
    for g in range(bucket.size):
        start[bucket[g] + moved[g] + 1] += 1
    for d in range(1, start.size):
        start[d] += start[d - 1]
    for g in range(bucket.size - 1, -1, -1):
        d = bucket[g] + moved[g] + 1
        start[d] -= 1
        order[0, start[d]], order[1, start[d]] = body[0, g], body[1, g]


@kernel
def relax_graph(position, graph, tolerance, approximate):
    """Relax every rigid body once by its list. Returns the number of constraints relaxed: all, or those off tolerance."""
    if graph is None:
        return 0
    _, _, order, start, stride, particles, lanes, sticks, listed, entry, ends, weight, rest, packed, lengths = graph
    relaxed, laid_out = 0, (-1, 0)
    for d in range(particles.size):
        kind = slice(sticks[0, d], sticks[1, d])
        joins, shares, entries = ends[:, kind], weight[:, kind], entry[listed[0, d]:listed[1, d]]
        for begin in range(start[d], start[d + 1], lanes[d]):
            place, own = order[:, begin:min(begin + lanes[d], start[d + 1])]
            width = -(-place.size // VECTOR) * VECTOR
            pack(position, place, stride[d], particles[d], width, packed)
            wanted = (common(own), width)
            if wanted != laid_out or wanted[0] < 0:
                lay_out(rest, own, shares.shape[1], width, lengths)
                laid_out = wanted
            if tolerance is None:
                relaxed += place.size * relax_list(packed, lengths, width, entries, joins, shares, approximate)
            else:
                relaxed += relax_tolerant_list(packed, lengths, width, entries, joins, shares, tolerance, approximate)
            unpack(position, place, stride[d], particles[d], width, packed)
    return relaxed


@kernel
def common(own):
    """The number that all of own (N,) are, -1 if they differ."""
    for k in range(own.size):
        if own[k] != own[0]:
            return -1
    return own[0]


@kernel
def lay_out(rest, own, sticks, width, lengths):
    """Rest lengths of bodies, whose first stand at own (N,), into lanes; lanes without a body take the first body's."""
    for c in range(sticks):
        row = lengths[c * width:(c + 1) * width]
        for k in range(own.size):
            row[k] = rest[own[k] + c]
        row[own.size:] = row[0]


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
def relax_list(packed, lengths, width, sticks, ends, weight, approximate):
    """Relax the lanes by a list of sticks, one run an entry. Returns the number of constraints relaxed in each lane."""
    x, y, z = packed[0], packed[1], packed[2]
    zero, tiny = packed.dtype.type(0), np.finfo(packed.dtype).tiny
    relaxed = 0
    for c in sticks:
        gi, gj, rest = weight[0, c], weight[1, c], lengths[c * width:(c + 1) * width]
        if gi + gj == zero:
            continue
        relaxed += 1
        i, j = ends[0, c] * width, ends[1, c] * width
        xi, yi, zi, xj, yj, zj = x[i:i + width], y[i:i + width], z[i:i + width], x[j:j + width], y[j:j + width], z[j:j + width]
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            f = returned(dx * dx + dy * dy + dz * dz + tiny, rest[k], approximate)
            fi, fj = f * gi, f * gj
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return relaxed


@kernel
def relax_tolerant_list(packed, lengths, width, sticks, ends, weight, tolerance, approximate):
    """The same, leaving alone what is within the relative tolerance (paper, 7). Returns the number relaxed in all lanes.

    Counting comes first: where no lane is off, and in later passes that is often, nothing else is to do.
    """
    x, y, z = packed[0], packed[1], packed[2]
    zero, slack, tiny = packed.dtype.type(0), packed.dtype.type(tolerance), np.finfo(packed.dtype).tiny
    relaxed = 0
    for c in sticks:
        gi, gj, rest = weight[0, c], weight[1, c], lengths[c * width:(c + 1) * width]
        if gi + gj == zero:
            continue
        i, j = ends[0, c] * width, ends[1, c] * width
        xi, yi, zi, xj, yj, zj = x[i:i + width], y[i:i + width], z[i:i + width], x[j:j + width], y[j:j + width], z[j:j + width]
        off = 0
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            off += deviates(dx * dx + dy * dy + dz * dz + tiny, rest[k], slack)
        if off == 0:
            continue
        relaxed += off
        for k in range(width):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            squared = dx * dx + dy * dy + dz * dz + tiny
            f = returned(squared, rest[k], approximate) if deviates(squared, rest[k], slack) else zero
            fi, fj = f * gi, f * gj
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return relaxed
