"""Broad phase (paper, 4.1): which hulls are so near each other that they may meet, judged by spheres that hold them."""

import math

import numpy as np

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers import Array, Search

GRIDS = 48                      # the last takes all that is smaller still
SMALLEST = 64                   # cells of a grid; from here on no two neighbours of a cell are the same cell
FEW = 128                       # spheres
RATIO = 0.5                     # smallest radius over largest in one grid
FAR = 1e100                     # m; what is not nearer and smaller than this has no place
SAFE = 1 + 2.0**-20
MIXER = 0x2545F4914F6CDD1D      # spreads the digits of a number (Vigna 2014)
BATCH = 32
NO_ROOM = -1


def search_for(hulls: int, room: int) -> Search:
    """The search for pairs among so many hulls, with room for so many pairs; no list has been made."""
    def real(*shape: int) -> Array:
        return np.zeros(shape)

    def whole(size: int) -> Array:
        return np.zeros(size, np.int64)

    return Search(whole(1), real(3, hulls), real(hulls), real(3, hulls), real(hulls), whole(hulls), whole(hulls), whole(hulls),
                  real(4, hulls), whole(4 * hulls + GRIDS * SMALLEST + 2), real(GRIDS), whole(GRIDS + 1), whole(room))


@formula
def touch(dx, dy, dz, radii):
    """Whether two spheres touch, from their centres' difference and the sum of their radii [m]."""
    return dx * dx + dy * dy + dz * dz <= radii * radii


@formula
def may_meet(body, other, still, other_still):
    """Whether two hulls may meet at all: hulls of one body do not, nor do two that never move."""
    return (body < 0 or body != other) and not (still and other_still)


@formula
def placed(x, y, z, radius):
    """Whether a sphere is somewhere: all finite."""
    return abs(x) < FAR and abs(y) < FAR and abs(z) < FAR and radius < FAR


@kernel
def all_pairs(centre, radius, body, still, first, second):
    """Every sphere against every other, as the paper does. Arguments and result are those of `sweep`."""
    x, y, z, listed = centre[0], centre[1], centre[2], 0
    for i in range(radius.size):
        if not placed(x[i], y[i], z[i], radius[i]):
            continue
        for begin in range(i + 1, radius.size, BATCH):
            end, touching = min(begin + BATCH, radius.size), 0
            for j in range(begin, end):
                touching += touch(x[i] - x[j], y[i] - y[j], z[i] - z[j], radius[i] + radius[j]) & (radius[j] < FAR)
            if touching == 0:
                continue
            for j in range(begin, end):
                if (touch(x[i] - x[j], y[i] - y[j], z[i] - z[j], radius[i] + radius[j]) and radius[j] < FAR
                        and may_meet(body[i], body[j], still[i], still[j])):
                    if listed == first.size:
                        return NO_ROOM
                    first[listed], second[listed] = i, j
                    listed += 1
    return listed


@kernel
def sweep(centre, radius, body, still, first, second, search):
    """Write the pairs of spheres that touch, first < second, ascending, and return their number; -1: no room.

    centre (3, H), radius (H,) [m]; body (H,) and still (H,): pairs of one body >= 0 and pairs of two that never move are
    left out, and so is what has no finite place or size. first and second (M,) are written, search.code is as long.
    """
    if radius.size <= FEW:
        return all_pairs(centre, radius, body, still, first, second)
    return by_grids(centre, radius, body, still, first, second, search)


@kernel
def by_grids(centre, radius, body, still, first, second, search):
    """The search in a hierarchy of grids, however few the spheres."""
    grids = grade(centre, radius, search.level, search.order, search.edge, search.base)
    fill(centre, radius, search.level, search.edge, search.base, search.bucket, search.cell, search.order, search.sphere, grids)
    listed = 0
    for grid in range(grids):
        listed = within(grid, search.base, search.cell, search.order, search.sphere, body, still, first, listed)
        for coarser in range(grid):
            listed = across(grid, coarser, search.base, search.edge, search.cell, search.order, search.sphere, body, still,
                            first, listed)
        if listed > first.size:
            return NO_ROOM
    ascend(first, second, search.code, search.cell, listed, radius.size)
    return listed


@kernel
def grade(centre, radius, level, rest, edge, base):
    """Share the spheres among grids, each for radii from the largest that is left down to RATIO of it. Returns how many."""
    x, y, z, left, far = centre[0], centre[1], centre[2], 0, 0.0
    for h in range(radius.size):
        level[h] = -1
        if placed(x[h], y[h], z[h], radius[h]):
            far = max(far, abs(x[h]), abs(y[h]), abs(z[h]))
            rest[left] = h
            left += 1
    grid = 0
    base[0] = 0
    while left > 0:
        largest, smaller = 0.0, 0
        for m in range(left):
            largest = max(largest, radius[rest[m]])
        for m in range(left):
            h = rest[m]
            if radius[h] < RATIO * largest and grid < GRIDS - 1:
                rest[smaller] = h
                smaller += 1
            else:
                level[h] = grid
        cells = SMALLEST
        while cells < 2 * (left - smaller):
            cells *= 2
        edge[grid] = edge_for(largest, far)
        base[grid + 1] = base[grid] + cells
        left = smaller
        grid += 1
    return grid


@formula
def edge_for(largest, far):
    """Edge of the cells of a grid for spheres up to a radius, at most so far from the origin [m].

    Spheres that touch must stand in neighbouring cells, whatever is rounded: the edge is a little more than twice the
    radius, and far from the origin a power of two, which divides exactly.
    """
    edge = max(2 * SAFE * largest, 2.0**-300)
    if far < 2.0**30 * edge:
        return edge
    return math.ldexp(1.0, math.frexp(edge)[1])


@formula
def along(x, inverse):
    """Number of the cell along an axis. Where cells are narrower than the spacing of numbers, any number will do."""
    number = np.floor(x * inverse)
    if abs(number) < 2.0**54:
        return np.int64(number)
    fraction, exponent = math.frexp(number)
    digits = np.int64(fraction * 2.0**54)
    return (((digits ^ (digits >> 32)) + exponent) * MIXER) >> 33


@formula
def stride_y(cells):
    return np.int64(0.7548776662466927 * cells) | 1


@formula
def stride_z(cells):
    return np.int64(0.5698402909980532 * cells) | 1


@formula
def key_of(x, y, z, edge, cells):
    """Cell of a grid that a place falls into: a lattice wraps space around the cells, so that it needs no bounds.

    key = ix + iy A + iz B modulo the number of cells N, a power of two: neighbours along x lie side by side, the
    others at constant distances. A/N and B/N are the inverse of the plastic number and its square, which no small
    whole numbers approximate: cells near each other, in a block or a slab of about N, have keys of their own.
    """
    inverse = 1 / edge
    return (along(x, inverse) + along(y, inverse) * stride_y(cells) + along(z, inverse) * stride_z(cells)) & (cells - 1)


@kernel
def fill(centre, radius, level, edge, base, bucket, cell, order, sphere, grids):
    """Sort the spheres by cell (counting sort): cell[b] becomes the place of the first sphere of cell b, of all grids."""
    x, y, z, total = centre[0], centre[1], centre[2], base[grids]
    sx, sy, sz, sr = sphere[0], sphere[1], sphere[2], sphere[3]
    cell[:total + 2] = 0
    for h in range(radius.size):
        grid = level[h]
        if grid >= 0:
            bucket[h] = base[grid] + key_of(x[h], y[h], z[h], edge[grid], base[grid + 1] - base[grid])
            cell[bucket[h] + 2] += 1
    for b in range(2, total + 2):
        cell[b] += cell[b - 1]
    for h in range(radius.size):
        if level[h] >= 0:
            p = cell[bucket[h] + 1]
            cell[bucket[h] + 1] += 1
            order[p] = h
            sx[p], sy[p], sz[p], sr[p] = x[h], y[h], z[h], radius[h]


@inlined
def meet(p, begin, end, x, y, z, r, order, body, still, found, listed):
    """Add the pairs of sphere p with those from begin to end that it touches; found.size + 1: no room."""
    i = order[p]
    for q in range(begin, end):
        if touch(x[p] - x[q], y[p] - y[q], z[p] - z[q], r[p] + r[q]):
            j = order[q]
            if may_meet(body[i], body[j], still[i], still[j]):
                if listed >= found.size:
                    return found.size + 1
                found[listed] = min(i, j) << 32 | max(i, j)
                listed += 1
    return listed


@inlined
def meet_row(p, low, start, cells, cell, x, y, z, r, order, body, still, found, listed):
    """The same with the spheres of three cells in a row, which may go on at the grid's first cell."""
    listed = meet(p, cell[start + low], cell[start + min(low + 3, cells)], x, y, z, r, order, body, still, found, listed)
    if low + 3 > cells:
        listed = meet(p, cell[start], cell[start + low + 3 - cells], x, y, z, r, order, body, still, found, listed)
    return listed


@kernel
def within(grid, base, cell, order, sphere, body, still, found, listed):
    """Pairs within a grid: each cell with itself and with that half of its 26 neighbours that comes after it."""
    x, y, z, r = sphere[0], sphere[1], sphere[2], sphere[3]
    start, cells = base[grid], base[grid + 1] - base[grid]
    up, over = stride_y(cells), stride_z(cells)
    rows = (up - 1, over - up - 1, over - 1, over + up - 1)
    for key in range(cells):
        for p in range(cell[start + key], cell[start + key + 1]):
            listed = meet(p, p + 1, cell[start + min(key + 2, cells)], x, y, z, r, order, body, still, found, listed)
            if key == cells - 1:
                listed = meet(p, cell[start], cell[start + 1], x, y, z, r, order, body, still, found, listed)
            for row in rows:
                listed = meet_row(p, (key + row) & (cells - 1), start, cells, cell, x, y, z, r, order, body, still, found, listed)
            if listed > found.size:
                return listed
    return listed


@kernel
def across(grid, coarser, base, edge, cell, order, sphere, body, still, found, listed):
    """Pairs of a grid's spheres with the larger ones of a coarser grid."""
    x, y, z, r = sphere[0], sphere[1], sphere[2], sphere[3]
    start, cells = base[coarser], base[coarser + 1] - base[coarser]
    up, over = stride_y(cells), stride_z(cells)
    for p in range(cell[base[grid]], cell[base[grid + 1]]):
        key = key_of(x[p], y[p], z[p], edge[coarser], cells) - 1
        for across_z in (-over, 0, over):
            for across_y in (-up, 0, up):
                listed = meet_row(p, (key + across_y + across_z) & (cells - 1), start, cells, cell, x, y, z, r, order, body, still,
                                  found, listed)
        if listed > found.size:
            return listed
    return listed


@kernel
def ascend(first, second, code, place, listed, hulls):
    """Sort pairs that stand as first << 32 | second in `first`: two counting sorts, by the second and then by the first."""
    place[:hulls + 2] = 0
    for m in range(listed):
        place[(first[m] & 0xFFFFFFFF) + 2] += 1
    for h in range(2, hulls + 2):
        place[h] += place[h - 1]
    for m in range(listed):
        h = (first[m] & 0xFFFFFFFF) + 1
        code[place[h]] = first[m]
        place[h] += 1
    place[:hulls + 2] = 0
    for m in range(listed):
        place[(code[m] >> 32) + 2] += 1
    for h in range(2, hulls + 2):
        place[h] += place[h - 1]
    for m in range(listed):
        h = (code[m] >> 32) + 1
        first[place[h]], second[place[h]] = code[m] >> 32, code[m] & 0xFFFFFFFF
        place[h] += 1
