"""Several contacts a pair of hulls: where an edge or a face rests on another, and not only a corner.

The narrow phase gives a pair one contact: points pA and pB of both hulls and the normal n from B to A. Across n both
hulls have a support plane through their point, A lying above its own and B below its own. Where hulls meet with more
than a point, the parts near these planes are edges or faces, and the contact is their common part, seen along n:

- The *support polygon* of a hull is the convex hull, seen along n, of its corners within NEAR of its support plane, a
  length relative to the hull's reach: one corner, an edge or a face. Tilted, a box goes from four corners to two when
  the far side has risen by that much; its contacts there have long opened by then, unless the hulls overlap by more.
  Corners that lie within the same length of each other, seen along n, count as one, the one that reaches farthest: a
  pancake's upper corners are near the support plane too, and may lie outside its lower ones by a hair.
- Convex polygons share a convex polygon. Its corners are corners of either within the other, and crossings of two
  edges. With d_i the distance of corner i of A from an edge of B (positive within), A's edge from i to i + 1 meets that
  edge's line at the share t = d_i / (d_i - d_i+1) of its length; likewise the other way round. So every point is a
  weighted corner of both: a corner and three of a fan triangle around it (barycentric weights), or two and two.
- Two edges cross in one point, unless they are parallel: then the points are the ends of the part over which they are
  within PARALLEL of each other, seen along n.

All points lie in both hulls: none is deeper than the support planes tell, and each has a gap of its own. Points go that
lie within FLAT of the line through their neighbours (boxes of one size, stacked a little askew, share an octagon that is
all but a square) and, beyond eight, those nearest to it, one after another; the deepest stays. Where a rounded tip of
many corners leaves all points shallower than the contact that was there, that one is kept as well.

Lengths are relative to the hulls, coordinates to the contact: results move and turn with the hulls, at any scale.
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.hulls import POINTS
from verlet_numba.kernels.polygons import apart, arrange, far_apart, overlap, side_by_side, thin, trim

NEAR = 0.01         # of a hull's reach: how near corners are to the support plane, and how near to each other to be one
PARALLEL = 1e-4     # of the smaller reach: how far edges side by side may be apart; a polygon as thin is an edge
FLAT = 1e-3         # of the smaller reach: a point as near to the line through its neighbours spans nothing
SLACK = 1e-9        # of the smaller reach: how far a corner may be outside of an edge that it touches
ROUNDING = 1e-15    # of coordinates: what they are off by, and more


@kernel
def widen(hulls, pairs, meetings, scratch):
    """Replace the single contact of every pair that meets in an edge or a face by several, at most POINTS.

    Contacts come in the order of the pairs, those of a pair side by side, in the order of their angle about the normal.
    Returns whether there was room for all.
    """
    if not mark(hulls, pairs, meetings, scratch.points):
        return True
    x, y, z = hulls.corner[0], hulls.corner[1], hulls.corner[2]
    start, size, reach, rounding = hulls.start, hulls.size, hulls.reach, hulls.rounding
    pair, first, second = meetings.pair, pairs.first, pairs.second
    nx, ny, nz = meetings.normal[0], meetings.normal[1], meetings.normal[2]
    corner, weight, gap = meetings.corner, meetings.weight, meetings.gap
    points, pool_corner, pool_weight, pool_gap = scratch.points, scratch.corner, scratch.weight, scratch.gap
    near, spot, column, polygon, distance = scratch.near, scratch.spot, scratch.column, scratch.polygon, scratch.distance
    place, point_corner, point_weight = scratch.place, scratch.point_corner, scratch.point_weight
    ring, angle = scratch.ring, scratch.angle
    listed = meetings.listed[0]
    pooled = extra = 0
    for t in range(listed):
        if points[t] == 0:
            continue
        points[t] = 0
        a, b, n = first[pair[t]], second[pair[t]], (nx[t], ny[t], nz[t])
        origin = weighted(x, y, z, corner, weight, 0, t)
        slack = SLACK * min(reach[a], reach[b]) + ROUNDING * (abs(origin[0]) + abs(origin[1]) + abs(origin[2]))
        found = common_points(x, y, z, start, size, reach, a, b, origin, n, slack, near, spot, ring, angle, column, polygon,
                              distance, place, point_corner, point_weight)
        if found < 2:
            continue
        measure(x, y, z, origin, n, rounding[a] + rounding[b], found, place, point_corner, point_weight)
        kept, shallow = choose(place, found, gap[t] + 2.0 * slack, FLAT * min(reach[a], reach[b]), slack, ring, angle)
        total = kept + shallow
        extra += total - 1
        if listed + extra > pair.size:
            meetings.listed[0] = NO_ROOM
            return False
        for k in range(kept):
            move(point_corner, point_weight, ring[k], pool_corner, pool_weight, pooled + k)
            pool_gap[pooled + k] = place[2, ring[k]]
        if shallow:
            move(corner, weight, t, pool_corner, pool_weight, pooled + kept)
            pool_gap[pooled + kept] = gap[t]
        points[t] = total
        pooled += total
    spread(meetings, points, pool_corner, pool_weight, pool_gap)
    return True


@kernel
def mark(hulls, pairs, meetings, points):
    """Set points[t] to 1 where both hulls have several corners near their support planes, else to 0. Whether any have.

    Hulls that need not rest on a face keep their single contact unseen. The contact's own points lie on the support planes: one
    scan of either hull tells.
    """
    x, y, z = hulls.corner[0], hulls.corner[1], hulls.corner[2]
    start, size, reach, flat = hulls.start, hulls.size, hulls.reach, hulls.flat
    pair, first, second = meetings.pair, pairs.first, pairs.second
    nx, ny, nz = meetings.normal[0], meetings.normal[1], meetings.normal[2]
    corner, weight = meetings.corner, meetings.weight
    some = False
    for t in range(meetings.listed[0]):
        points[t] = 0
        a, b = first[pair[t]], second[pair[t]]
        if flat[a] == 0 or flat[b] == 0:
            continue
        px, py, pz = weighted(x, y, z, corner, weight, 0, t)
        level = nx[t] * px + ny[t] * py + nz[t] * pz + NEAR * reach[a]
        wide = below(x, y, z, start[a], size[a], nx[t], ny[t], nz[t], level) > 1
        if wide:
            px, py, pz = weighted(x, y, z, corner, weight, 3, t)
            level = NEAR * reach[b] - (nx[t] * px + ny[t] * py + nz[t] * pz)
            wide = below(x, y, z, start[b], size[b], -nx[t], -ny[t], -nz[t], level) > 1
        points[t] = wide
        some |= wide
    return some


@inlined
def below(x, y, z, start, size, nx, ny, nz, level):
    """How many of a hull's corners are not above a level along n."""
    xs, ys, zs = x[start:start + size], y[start:start + size], z[start:start + size]
    found = 0
    for k in range(xs.size):
        found += nx * xs[k] + ny * ys[k] + nz * zs[k] <= level
    return found


@inlined
def weighted(x, y, z, corner, weight, row, t):
    """Point of contact t on the first (row 0) or second (row 3) hull."""
    i, j, k = corner[row, t], corner[row + 1, t], corner[row + 2, t]
    a, b, c = weight[row, t], weight[row + 1, t], weight[row + 2, t]
    return a * x[i] + b * x[j] + c * x[k], a * y[i] + b * y[j] + c * y[k], a * z[i] + b * z[j] + c * z[k]


@inlined
def move(corner_from, weight_from, k, corner_to, weight_to, m):
    """Copy the weighted corners of point k to point m."""
    for i in range(6):
        corner_to[i, m], weight_to[i, m] = corner_from[i, k], weight_from[i, k]


@kernel
def common_points(x, y, z, start, size, reach, a, b, origin, n, slack, near, spot, ring, angle, column, polygon, distance,
                  place, corner, weight):
    """Corners of what the support polygons of hulls a and b share. Returns how many; fewer than two where one is a corner."""
    u, v = across(*n)
    down = -n[0], -n[1], -n[2]
    sides_a = support_polygon(x, y, z, start[a], size[a], reach[a], origin, u, v, n, near, spot, ring, angle,
                              column[0], polygon[0])
    if sides_a == 1:
        return 1
    sides_b = support_polygon(x, y, z, start[b], size[b], reach[b], origin, u, v, down, near, spot, ring, angle,
                              column[1], polygon[1])
    if sides_b == 1:
        return 1
    smaller = min(reach[a], reach[b])
    if sides_a == 2 and sides_b == 2:
        return side_by_side(polygon, column, PARALLEL * smaller, NEAR * smaller, place, corner, weight)
    return overlap(polygon, column, sides_a, sides_b, slack, distance, place, corner, weight)


@kernel
def measure(x, y, z, origin, n, rounding, found, place, corner, weight):
    """The gap n . (pA - pB) - roundings of every point, worked out from a near origin."""
    ox, oy, oz = origin
    for k in range(found):
        gap = -rounding
        for i in range(6):
            c = corner[i, k]
            height = weight[i, k] * (n[0] * (x[c] - ox) + n[1] * (y[c] - oy) + n[2] * (z[c] - oz))
            gap += height if i < 3 else -height
        place[2, k] = gap


@kernel
def choose(place, found, level, flat, slack, ring, angle):
    """Order the points by angle and leave out those that span next to nothing, and what is too many.

    Returns how many stay, and whether all gaps are above a level. Of points that are equally deep, the one to be kept is
    the outermost, seen from the narrow phase's contact.
    """
    lowest, keep, outermost = math.inf, -1, -1.0
    for k in range(found):
        ring[k] = k
        lowest = min(lowest, place[2, k])
    for k in range(found):
        away = place[0, k] * place[0, k] + place[1, k] * place[1, k]
        if place[2, k] <= lowest + slack and away > outermost:
            keep, outermost = k, away
    shallow = place[2, keep] > level
    arrange(place, found, ring, angle)
    return trim(place, found, POINTS - shallow, flat, keep, ring), shallow


@formula
def across(x, y, z):
    """Two unit vectors u and v with u x v = n, for a unit vector n (Duff et al. 2017, Building an orthonormal basis)."""
    sign = math.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    return (1.0 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


@kernel
def support_polygon(x, y, z, start, size, reach, origin, u, v, n, near, spot, ring, angle, column, polygon):
    """Corners of a hull near its support plane against n, as a convex polygon seen along n.

    Returns how many sides it has, 1 for a corner and 2 for an edge; `column` and `polygon` (2, 16) get its corners,
    counter-clockwise in the coordinates along u and v.
    """
    close = NEAR * reach
    found = corners_near(x, y, z, start, size, close, origin, u, v, n, near, spot)
    sides = far_apart(spot, found, close * close, ring)
    if sides > 2:
        far = 0
        for k in range(sides):
            if apart(spot, ring[k], ring[1]) > apart(spot, ring[far], ring[1]):
                far = k
        if thin(spot, ring, sides, ring[1], ring[far], PARALLEL * reach):
            ring[0] = ring[far]
            sides = 2
        else:
            arrange(spot, sides, ring, angle)
            sides = trim(spot, sides, sides, SLACK * reach, found, ring)
    for k in range(sides):
        column[k] = near[ring[k]]
        polygon[0, k], polygon[1, k] = spot[0, ring[k]], spot[1, ring[k]]
    return sides


@kernel
def corners_near(x, y, z, start, size, close, origin, u, v, n, near, spot):
    """Columns, coordinates across n and heights along n of the corners close to a hull's support plane. How many."""
    ox, oy, oz = origin
    lowest = math.inf
    for k in range(start, start + size):
        lowest = min(lowest, n[0] * (x[k] - ox) + n[1] * (y[k] - oy) + n[2] * (z[k] - oz))
    found = 0
    for k in range(start, start + size):
        dx, dy, dz = x[k] - ox, y[k] - oy, z[k] - oz
        height = n[0] * dx + n[1] * dy + n[2] * dz
        if height <= lowest + close:
            near[found] = k
            spot[0, found] = u[0] * dx + u[1] * dy + u[2] * dz
            spot[1, found] = v[0] * dx + v[1] * dy + v[2] * dz
            spot[2, found], spot[3, found] = height, math.inf
            found += 1
    return found


@kernel
def spread(meetings, points, pool_corner, pool_weight, pool_gap):
    """Put the contacts found in place of those that they replace, from the last on: none moves down."""
    pair, corner, weight, gap = meetings.pair, meetings.corner, meetings.weight, meetings.gap
    nx, ny, nz = meetings.normal[0], meetings.normal[1], meetings.normal[2]
    listed = meetings.listed[0]
    end = pooled = 0
    for t in range(listed):
        pooled += points[t]
        end += max(points[t], 1)
    meetings.listed[0] = end
    for t in range(listed - 1, -1, -1):
        p, x, y, z = pair[t], nx[t], ny[t], nz[t]
        for _ in range(max(points[t], 1)):
            end -= 1
            pair[end], nx[end], ny[end], nz[end] = p, x, y, z
            if points[t] == 0:
                move(corner, weight, t, corner, weight, end)
                gap[end] = gap[t]
            else:
                pooled -= 1
                move(pool_corner, pool_weight, pooled, corner, weight, end)
                gap[end] = pool_gap[pooled]
