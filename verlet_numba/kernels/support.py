"""Support mapping: the corner of a hull that lies farthest in a direction.

A small hull's corners are scanned. On the graph of a large one the search climbs from corner to neighbour: on a convex
polytope a corner that no neighbour surpasses is the highest. Neighbours as high as the corner itself (coplanar,
repeated) hide what lies beyond them, so such a plateau is flooded before the search gives up.
"""

import numpy as np

from verlet_numba._jit import formula, kernel, scan


@scan
def scanned(points, start, size, dx, dy, dz):
    """Column of the corner farthest in the direction d, the first of equals, of the columns from `start` on."""
    start = np.uint64(start)        # no index is negative: the compiler need not ask
    best, highest = start, -np.inf
    for k in range(start, start + np.uint64(size)):
        height = dx * points[0, k] + dy * points[1, k] + dz * points[2, k]
        best = k if height > highest else best
        highest = height if height > highest else highest
    return np.int64(best)


@formula
def height_at(points, k, dx, dy, dz):
    """d . corner k."""
    return dx * points[0, k] + dy * points[1, k] + dz * points[2, k]


@kernel
def climbed(points, start, row, neighbours, neighbour, seen, warm, dx, dy, dz):
    """The same by climbing from column `warm`, the hull's corners having their neighbours from `row` on."""
    best = warm - start
    highest = height_at(points, warm, dx, dy, dz)
    while True:
        top, level = best, False
        for e in range(neighbours[row + best], neighbours[row + best + 1]):
            k = neighbour[e]
            height = height_at(points, start + k, dx, dy, dz)
            level |= height == highest and k != best
            if height > highest:
                top, highest = k, height
        if top == best and level:
            top = beyond(points, start, row, neighbours, neighbour, seen, best, dx, dy, dz)
            highest = height_at(points, start + top, dx, dy, dz)
        if top == best:
            return start + best
        best = top


@kernel
def beyond(points, start, row, neighbours, neighbour, seen, corner, dx, dy, dz):
    """A corner above the plateau of `corner`, or itself. The plateau's corners stand in a list within `seen`."""
    half = (seen.size - 1) // 2
    mark, queue = seen[:half], seen[half:2 * half]
    seen[-1] += 1
    stamp, level = seen[-1], height_at(points, start + corner, dx, dy, dz)
    mark[corner], queue[0] = stamp, corner
    done, listed = 0, 1
    while done < listed:
        c = queue[done]
        done += 1
        for e in range(neighbours[row + c], neighbours[row + c + 1]):
            k = neighbour[e]
            height = height_at(points, start + k, dx, dy, dz)
            if height > level:
                return k
            if height == level and mark[k] != stamp:
                mark[k], queue[listed] = stamp, k
                listed += 1
    return corner


@formula
def support(points, start, size, row, neighbours, neighbour, seen, warm, dx, dy, dz):
    """Column of the hull's corner farthest in the direction d; `warm` is a column to climb from, unless it lies inside."""
    if row >= 0:
        corner = row + warm - start
        if neighbours[corner] < neighbours[corner + 1]:
            return climbed(points, start, row, neighbours, neighbour, seen, warm, dx, dy, dz)
    return scanned(points, start, size, dx, dy, dz)
