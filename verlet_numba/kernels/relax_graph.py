"""Relaxation of rigid bodies in the order of the constraint graph (paper, 6.2), at vector speed.

Bodies whose lists are images of one list make a family. They are packed side by side, the image of particle p of body k
in lane k of row p, relaxed as one run for each entry of the list, and put back. Bodies share no particle, and exchanging
the ends of a stick changes signs only, so the result of every body is bit for bit that of relaxing it alone, stick by
stick. Rest lengths are laid out likewise; for bodies that are alike, and turned alike, once for all of them.

Lanes are filled up to whole vectors with what is not a number: it is never off tolerance.
"""

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.kernels.relax import returned
from verlet_numba.physics.distance import deviates

VECTOR = 8


@kernel
def sort_bodies(graph, moved):
    """Put every rigid body into its family. moved: (G,) particle that a collision moved most, -1: the body did not collide.

    A counting sort: counts become ends, and bodies are put in from behind, so that those of a family stay in order.
    """
    if graph is None:
        return
    body, bucket, family, turn, order, start = graph.body, graph.bucket, graph.family, graph.turn, graph.sorted, graph.start
    start[:] = 0
    for g in range(bucket.size):
        start[family[bucket[g] + moved[g] + 1]] += 1
    for f in range(1, start.size):
        start[f] += start[f - 1]
    for g in range(bucket.size - 1, -1, -1):
        d = bucket[g] + moved[g] + 1
        f = family[d]
        start[f] -= 1
        k = start[f]
        order[0, k], order[1, k], order[2, k], order[3, k] = body[0, g], body[1, g], turn[0, d], turn[1, d]


@kernel
def relax_graph(position, graph, tolerance, approximate):
    """Relax every rigid body once by its list. Returns the number of constraints relaxed: all, or those off tolerance."""
    if graph is None:
        return 0
    order, start, particles, lanes, sticks = graph.sorted, graph.start, graph.particles, graph.lanes, graph.sticks
    packed, lengths, relaxed, laid_out = graph.packed, graph.lengths, 0, (-1, -1, 0)
    for f in range(particles.size):
        kind = slice(sticks[0, f], sticks[1, f])
        joins, shares = graph.ends[:, kind], graph.weight[:, kind]
        entries = graph.entry[graph.listed[0, f]:graph.listed[1, f]]
        for begin in range(start[f], start[f + 1], lanes[f]):
            bodies = order[:, begin:min(begin + lanes[f], start[f + 1])]
            count = bodies.shape[1]
            width = -(-count // VECTOR) * VECTOR
            pack(position, bodies, graph.places, particles[f], width, packed)
            wanted = (common(bodies[1]), common(bodies[3]), width)
            if wanted != laid_out or min(wanted) < 0:
                lay_out(graph.rest, bodies, graph.images, shares.shape[1], width, lengths)
                laid_out = wanted
            if tolerance is None:
                relaxed += count * relax_list(packed, lengths, width, entries, joins, shares, approximate)
            else:
                relaxed += relax_tolerant_list(packed, lengths, width, entries, joins, shares, tolerance, approximate)
            unpack(position, bodies, graph.places, particles[f], width, packed)
    return relaxed


@kernel
def common(own):
    """The number that all of own (N,) are, -1 if they differ."""
    for k in range(own.size):
        if own[k] != own[0]:
            return -1
    return own[0]


@kernel
def lay_out(rest, bodies, images, sticks, width, lengths):
    """Rest lengths of bodies, columns of Graph.sorted, into lanes; lanes without a body take the first body's."""
    own, turn, count = bodies[1], bodies[3], bodies.shape[1]
    for c in range(sticks):
        row = lengths[c * width:(c + 1) * width]
        for k in range(count):
            row[k] = rest[np.uint64(own[k] + images[np.uint64(turn[k] + c)])]
        row[count:] = row[0]


@kernel
def pack(position, bodies, places, particles, width, packed):
    """Particles of the bodies, columns of Graph.sorted, into lanes; lanes without a body are not a number."""
    first, turn, count = bodies[0], bodies[2], bodies.shape[1]
    x, y, z, u, v, w = position[0], position[1], position[2], packed[0], packed[1], packed[2]
    for p in range(particles):
        row = slice(p * width, p * width + count)
        a, b, c = u[row], v[row], w[row]
        for k in range(count):
            place = np.uint64(first[k] + places[np.uint64(turn[k] + p)])
            a[k], b[k], c[k] = x[place], y[place], z[place]
        packed[:, p * width + count:(p + 1) * width] = np.nan


@kernel
def unpack(position, bodies, places, particles, width, packed):
    """And back."""
    first, turn, count = bodies[0], bodies[2], bodies.shape[1]
    x, y, z, u, v, w = position[0], position[1], position[2], packed[0], packed[1], packed[2]
    for p in range(particles):
        row = slice(p * width, p * width + count)
        a, b, c = u[row], v[row], w[row]
        for k in range(count):
            place = np.uint64(first[k] + places[np.uint64(turn[k] + p)])
            x[place], y[place], z[place] = a[k], b[k], c[k]


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
