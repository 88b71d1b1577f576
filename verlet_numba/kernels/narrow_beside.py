"""The narrow phase on several threads: pairs in chunks, each with scratch of its own.

A pair's contact depends on nothing but its two hulls and what the pair learnt, and chunks are put together in the order of
the pairs: so the contacts are, bit for bit, those of one thread, for any number of threads.
"""

from verlet_numba._jit import kernel, prange, threaded
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.narrow import collide_some

CHUNKS = 16             # more than threads, so that none waits long for the last


@kernel
def collide_beside(hulls, pairs, meetings, beside, margin, quiet):
    """As `collide` with coherence. beside: scratch of CHUNKS chunks; quiet (H,): two hulls that both are do not meet.

    There must be room for as many meetings as there are pairs.
    """
    listed, found = pairs.listed[0], beside.found
    if listed > meetings.gap.size:
        meetings.listed[0] = NO_ROOM
        return False
    collide_chunks(
        hulls.corner, hulls.centre, hulls.reach, hulls.rounding, hulls.start, hulls.size, hulls.graph, hulls.neighbours,
        hulls.neighbour, beside.seen, beside.vertex, beside.label, beside.weight, beside.corner, beside.across, beside.plane,
        beside.visible, beside.horizon, beside.stack, pairs.first, pairs.second, pairs.axis, pairs.face, meetings.pair,
        meetings.corner, meetings.weight, meetings.normal, meetings.gap, margin, quiet, listed, found)
    together = 0
    for chunk in range(CHUNKS):
        begin = listed * chunk // CHUNKS
        for t in range(begin, found[chunk]):
            bring(meetings.pair, meetings.corner, meetings.weight, meetings.normal, meetings.gap, t, together)
            together += 1
    meetings.listed[0] = together
    return True


@threaded
def collide_chunks(points, centre, reach, rounding, start, size, graph, neighbours, neighbour, seen, vertex, label, weight, corner,
                   across, plane, visible, horizon, stack, first, second, axis, face, pair, columns, shares, normal, gap, margin,
                   quiet, listed, found):
    """The contacts of every chunk of pairs, from the meeting on that has its first pair's number to found[chunk]."""
    for chunk in prange(CHUNKS):
        begin, end = listed * chunk // CHUNKS, listed * (chunk + 1) // CHUNKS
        found[chunk] = collide_some(
            points, centre, reach, rounding, start, size, graph, neighbours, neighbour, seen[chunk], vertex[chunk], label[chunk],
            weight[chunk], corner[chunk], across[chunk], plane[chunk], visible[chunk], horizon[chunk], stack[chunk], first, second,
            axis, face, pair, columns, shares, normal, gap, margin, 1, quiet, begin, end, begin)


@kernel
def bring(pair, corner, weight, normal, gap, t, to):
    """Move meeting t to a lower number."""
    pair[to], gap[to] = pair[t], gap[t]
    for row in range(6):
        corner[row, to], weight[row, to] = corner[row, t], weight[row, t]
    for row in range(3):
        normal[row, to] = normal[row, t]
