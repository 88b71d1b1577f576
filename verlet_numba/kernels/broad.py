"""Broad phase: which hulls are so near each other that they may meet, judged by spheres that hold them.

The paper looks at all pairs of objects. Here a hierarchy of grids does (Ericson 2005, 7.2.1): each holds spheres of like
size in cells a little wider than they are, so that a sphere meets those of its grid in the 27 cells around it only, and the
larger ones in the few cells of each coarser grid that it reaches.

Milliseconds a list on one core, icosahedra that fill a tenth of a cube / with a floor as wide as the cube / radii 1:1,000:

| hulls   | all pairs          | sort and sweep along x | grids              |
|      50 |   .003  .003  .003 |   .004  .005  .002     |   .010  .010  .010 |
|   1,000 |   .32   .34   .32  |   .16   .16   .07      |   .12   .17   .26  |
|  10,000 | 24     24    25    |  14    14    2.6       |  1.2   1.7   3.2   |
| 100,000 |                    | 960   940   420        | 17    19    49     |

A sweep along one axis meets whatever overlaps there, n^(5/3) pairs in a cube. Up to 128 hulls all pairs are quickest.
"""

import math

import numpy as np

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM

GRIDS = 48                      # the last takes all that is smaller still
SMALLEST = 64                   # cells of a grid; from here on no two neighbours of a cell are the same cell
FEW = 128                       # spheres
RATIO = 0.25                    # smallest radius over largest in one grid
FAR = 1e100                     # m; what is not nearer and smaller than this has no place
SAFE = 1 + 2.0**-20
MIXER = 0x2545F4914F6CDD1D      # spreads the digits of a number (Vigna 2014)
HULL = 2**32 - 1                # the lower half of a code
FOLDS = 4                       # of a dense grid upon itself, at most
BATCH = 32
ZERO = np.int64(0)              # of no literal type, for which kernels would be compiled once more


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
            end = min(begin + BATCH, radius.size)
            if any_touches(x[i], y[i], z[i], radius[i], x[begin:end], y[begin:end], z[begin:end], radius[begin:end]):
                for j in range(begin, end):
                    if (touch(x[i] - x[j], y[i] - y[j], z[i] - z[j], radius[i] + radius[j]) and radius[j] < FAR
                            and may_meet(body[i], body[j], still[i], still[j])):
                        if listed == first.size:
                            return NO_ROOM
                        first[listed], second[listed] = i, j
                        listed += 1
    return listed


@kernel
def any_touches(x, y, z, radius, xs, ys, zs, radii):
    """Whether any of some spheres touches a sphere."""
    touching = 0
    for j in range(radii.size):
        touching += touch(x - xs[j], y - ys[j], z - zs[j], radius + radii[j])
    return touching > 0


@kernel
def sweep(centre, radius, body, still, first, second, search):
    """Write the pairs of spheres that touch, first < second, ascending, and return their number, or NO_ROOM.

    centre (3, H), radius (H,) [m]; body (H,) and still (H,): pairs of one body >= 0 and pairs of two that never move are
    left out, and so is what has no finite place or size. first and second (M,) are written, search.code is as long.
    Time grows as H log(largest / smallest radius) + M for spheres that overlap a bounded number of others; where they do
    not, it ends with the room for pairs, unless those that overlap may not meet.
    """
    if radius.size <= FEW:
        return all_pairs(centre, radius, body, still, first, second)
    return by_grids(centre, radius, body, still, first, second, search)


@kernel
def by_grids(centre, radius, body, still, first, second, search):
    """The search in a hierarchy of grids, however few the spheres: each grid with itself and with the coarser ones."""
    grids, listed = sort_into_grids(centre, radius, search), ZERO
    for grid in range(grids):
        listed = within(grid, search.grid, search.cell, search.tag, search.sphere, body, still, first, listed)
        for coarser in range(grid):
            listed = across(grid, coarser, search.grid, search.inverse, search.cell, search.tag, search.sphere, body, still, first,
                            listed)
        if listed > first.size:
            return NO_ROOM
    ascend(first, second, search.code, search.cell, listed, radius.size)
    return listed


@kernel
def sort_into_grids(centre, radius, search):
    """Share the spheres among grids, each for radii from the largest that is left down to RATIO of it. Returns how many."""
    order, grid = search.order, 0
    left, base, start = with_a_place(centre, radius, order), ZERO, ZERO
    while left > 0:
        smaller, largest = parted(radius, order, left, RATIO if grid < GRIDS - 1 else 0.0)
        mine, cells = order[smaller:left], SMALLEST
        while cells < 2 * mine.size:
            cells *= 2
        inverse, up, over = lattice(centre, mine, largest, cells)
        start = fill(centre, radius, mine, inverse, cells, up, over, search.key, search.cell[base:base + cells + 4], search.sphere,
                     search.tag, start)
        search.inverse[grid] = inverse
        search.grid[0, grid], search.grid[1, grid], search.grid[2, grid], search.grid[3, grid] = base, cells, up, over
        base += cells + 4
        left = smaller
        grid += 1
    return grid


@kernel
def with_a_place(centre, radius, order):
    """Number the spheres that are somewhere. Returns how many."""
    x, y, z, left = centre[0], centre[1], centre[2], 0
    for h in range(radius.size):
        order[left] = h
        left += placed(x[h], y[h], z[h], radius[h])
    return left


@kernel
def parted(radius, order, left, ratio):
    """Put the largest of the first spheres behind the others. Returns how many others there are, and the largest radius."""
    largest, m, end = 0.0, 0, left
    for k in range(left):
        largest = max(largest, radius[order[k]])
    while m < end:
        if radius[order[m]] < ratio * largest:
            m += 1
        else:
            end -= 1
            order[m], order[end] = order[end], order[m]
    return end, largest


@kernel
def lattice(centre, order, largest, cells):
    """How space is cut into cells for spheres up to a radius: cells a metre, and their strides in y and z.

    Cell (ix, iy, iz) has the number ix + iy up + iz over modulo the cells N, a power of two: space is wrapped around them and
    needs no bounds. Neighbours along x lie side by side, the others at constant distances, and no two of the 27 are one.
    Where the spheres' box has about N cells, they are numbered as in a dense grid: then neighbours are near in memory.
    Else up/N and over/N are the inverse of the plastic number and its square, which small whole numbers approximate badly:
    cells near each other, in a block or a slab of about N, have numbers of their own, wherever the box ends.

    Spheres that touch must stand in neighbouring cells, whatever is rounded: the edge is a little more than twice the
    radius, and far from the origin a power of two, by which numbers divide exactly.
    """
    edge = max(2 * SAFE * largest, 2.0**-300)
    low_x, high_x = bounds(centre[0], order)
    low_y, high_y = bounds(centre[1], order)
    low_z, high_z = bounds(centre[2], order)
    if max(-low_x, high_x, -low_y, high_y, -low_z, high_z) > 2.0**30 * edge:
        edge = math.ldexp(1.0, math.frexp(edge)[1])
    wide, deep, high = (high_x - low_x) / edge + 1, (high_y - low_y) / edge + 1, (high_z - low_z) / edge + 1
    up = max(math.ceil(wide), 3.0)
    over = max(up * math.ceil(deep), 2 * up + 3)
    if 2 * (1 + up + over) < cells and wide * deep * high < FOLDS * cells:
        return 1 / edge, np.int64(up), np.int64(over)
    return 1 / edge, np.int64(0.7548776662466927 * cells) | 1, np.int64(0.5698402909980532 * cells) | 1


@kernel
def bounds(x, order):
    """Smallest and largest coordinate."""
    low = high = x[order[0]]
    for h in order:
        low, high = min(low, x[h]), max(high, x[h])
    return low, high


@formula
def along(x, inverse):
    """Number of the cell along an axis. Where cells are narrower than the spacing of numbers, any number will do."""
    number = np.floor(x * inverse)
    if abs(number) < 2.0**54:
        return np.int64(number)
    fraction, exponent = math.frexp(number)
    digits = np.int64(fraction * 2.0**54)
    return (((digits ^ (digits >> 32)) + exponent) * MIXER) >> 33


@kernel
def fill(centre, radius, order, inverse, cells, up, over, key, cell, sphere, tag, start):
    """Sort a grid's spheres by cell, to stand from `start` on (counting sort). Returns where they end.

    cell[k] becomes the place of the first sphere of cell k. The first two cells stand once more behind the last: so three
    cells in a row are never parted.
    """
    x, y, z = centre[0], centre[1], centre[2]
    cell[:] = 0
    for m in range(order.size):
        h = order[m]
        key[m] = (along(x[h], inverse) + along(y[h], inverse) * up + along(z[h], inverse) * over) & (cells - 1)
        cell[key[m] + 2] += 1
    cell[cells + 2], cell[cells + 3] = cell[2], cell[3]
    cell[0], cell[1] = start, start
    for k in range(2, cells + 4):
        cell[k] += cell[k - 1]
    for m in range(order.size):
        h, k = order[m], key[m]
        put(h, k, x, y, z, radius, cell, sphere, tag)
        if k < 2:
            put(h, k + cells, x, y, z, radius, cell, sphere, tag)
    return cell[cells + 2]


@inlined
def put(h, k, x, y, z, radius, cell, sphere, tag):
    """Put a sphere into a cell."""
    p = cell[k + 1]
    cell[k + 1] += 1
    sphere[p, 0], sphere[p, 1], sphere[p, 2], sphere[p, 3] = x[h], y[h], z[h], radius[h]
    tag[p] = k << 32 | h


@kernel
def within(grid, grids, cell, tag, sphere, body, still, found, listed):
    """Pairs within a grid: each cell with itself and with that half of its 26 neighbours that comes after it."""
    base, cells, up, over = grids[0, grid], grids[1, grid], grids[2, grid], grids[3, grid]
    rows, room = (0, up - 1, over - up - 1, over - 1, over + up - 1), found.size
    for p in range(cell[base], cell[base + cells]):
        x, y, z, r, key = sphere[p, 0], sphere[p, 1], sphere[p, 2], sphere[p, 3], tag[p] >> 32
        for row in range(5):
            low = base + ((key + rows[row]) & (cells - 1))
            begin, end = (cell[low], cell[low + 3]) if row > 0 else (p + 1, cell[low + 2])
            for q in range(begin, end):
                if touch(x - sphere[q, 0], y - sphere[q, 1], z - sphere[q, 2], r + sphere[q, 3]):
                    i, j = tag[p] & HULL, tag[q] & HULL
                    if may_meet(body[i], body[j], still[i], still[j]):
                        if listed >= room:
                            return room + 1
                        found[listed] = min(i, j) << 32 | max(i, j)
                        listed += 1
    return listed


@formula
def spread(x, inverse, radius):
    """The cell along an axis, and where a sphere's neighbours begin and end, counted from there: -1 or 0, 0 or 1.

    It touches spheres of up to half an edge if their centres are within its radius and half an edge.
    """
    number = x * inverse
    place, reach = number - np.floor(number), radius * inverse + 0.5
    return along(x, inverse), -1 if place < reach else 0, 1 if place + reach > 1.0 else 0


@kernel
def across(grid, coarser, grids, inverse, cell, tag, sphere, body, still, found, listed):
    """Pairs of a grid's spheres with the larger ones of a coarser grid."""
    base, cells, up, over = grids[0, coarser], grids[1, coarser], grids[2, coarser], grids[3, coarser]
    scale, room = inverse[coarser], found.size
    for p in range(cell[grids[0, grid]], cell[grids[0, grid] + grids[1, grid]]):
        x, y, z, r = sphere[p, 0], sphere[p, 1], sphere[p, 2], sphere[p, 3]
        ix, left, right = spread(x, scale, r)
        iy, front, back = spread(y, scale, r)
        iz, below, above = spread(z, scale, r)
        key = ix + left + iy * up + iz * over
        for dz in range(below, above + 1):
            for dy in range(front, back + 1):
                low = base + ((key + dy * up + dz * over) & (cells - 1))
                for q in range(cell[low], cell[low + right - left + 1]):
                    if touch(x - sphere[q, 0], y - sphere[q, 1], z - sphere[q, 2], r + sphere[q, 3]):
                        i, j = tag[p] & HULL, tag[q] & HULL
                        if may_meet(body[i], body[j], still[i], still[j]):
                            if listed >= room:
                                return room + 1
                            found[listed] = min(i, j) << 32 | max(i, j)
                            listed += 1
    return listed


@kernel
def ascend(first, second, code, place, listed, hulls):
    """Sort pairs that stand as first << 32 | second in `first`: two counting sorts, by the second and then by the first."""
    place[:hulls + 2] = 0
    for m in range(listed):
        place[(first[m] & HULL) + 2] += 1
    for h in range(2, hulls + 2):
        place[h] += place[h - 1]
    for m in range(listed):
        h = (first[m] & HULL) + 1
        code[place[h]] = first[m]
        place[h] += 1
    place[:hulls + 2] = 0
    for m in range(listed):
        place[(code[m] >> 32) + 2] += 1
    for h in range(2, hulls + 2):
        place[h] += place[h - 1]
    for m in range(listed):
        h = (code[m] >> 32) + 1
        first[place[h]], second[place[h]] = code[m] >> 32, code[m] & HULL
        place[h] += 1
