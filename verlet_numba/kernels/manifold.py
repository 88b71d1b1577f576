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

NEAR = 0.01         # of a hull's reach: how near corners are to the support plane, and how near to each other to be one
PARALLEL = 1e-4     # of the smaller reach: how far edges side by side may be apart; a polygon as thin is an edge
FLAT = 1e-3         # of the smaller reach: a point as near to the line through its neighbours spans nothing
SLACK = 1e-9        # of the smaller reach: how far a corner may be outside of an edge that it touches
ROUNDING = 1e-15    # of coordinates: what they are off by, and more
SIDES = 16          # corners of a support polygon, at most
SPOTS = 64          # points found before some are left out, at most
POINTS = 8          # of a pair, at most


@kernel
def widen(hulls, pairs, meetings, scratch):
    """Replace the single contact of every pair that meets in an edge or a face by several, at most POINTS.

    Contacts come in the order of the pairs, those of a pair side by side, in the order of their angle about the normal.
    Returns whether there was room for all. If not, the contacts are those that the narrow phase left.
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
            return False
        for k in range(kept):
            move(point_corner, point_weight, ring[k], pool_corner, pool_weight, pooled + k)
            pool_gap[pooled + k] = place[2, ring[k]]
        if shallow:
            move(corner, weight, t, pool_corner, pool_weight, pooled + kept)
            pool_gap[pooled + kept] = gap[t]
        points[t] = total
        pooled += total
    spread(meetings, points, pool_corner, pool_weight, pool_gap, pooled, extra)
    return True


@kernel
def mark(hulls, pairs, meetings, points):
    """Set points[t] to 1 where both hulls have several corners near their support planes, else to 0. Whether any have.

    The contact's own points lie on the support planes: one scan of either hull tells.
    """
    x, y, z = hulls.corner[0], hulls.corner[1], hulls.corner[2]
    start, size, reach = hulls.start, hulls.size, hulls.reach
    pair, first, second = meetings.pair, pairs.first, pairs.second
    nx, ny, nz = meetings.normal[0], meetings.normal[1], meetings.normal[2]
    corner, weight = meetings.corner, meetings.weight
    some = False
    for t in range(meetings.listed[0]):
        a, b = first[pair[t]], second[pair[t]]
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
    ox, oy, oz = origin
    close = NEAR * reach
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
            spot[2, found] = height
            spot[3, found] = math.inf
            found += 1
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
            sides = trim(spot, sides, SIDES, SLACK * reach, -1, ring)
    for k in range(sides):
        column[k] = near[ring[k]]
        polygon[0, k], polygon[1, k] = spot[0, ring[k]], spot[1, ring[k]]
    return sides


@inlined
def apart(spot, i, j):
    """Squared distance of two corners, seen along the normal."""
    dx, dy = spot[0, i] - spot[0, j], spot[1, i] - spot[1, j]
    return dx * dx + dy * dy


@kernel
def far_apart(spot, found, close, kept):
    """Choose corners that are not close to each other (squared distance), at most SIDES; `kept` gets their numbers.

    The farthest from those kept comes next, or rather the lowest corner close to it (Gonzalez 1985): the first is the
    lowest of all, and what is left out is close to a corner that is kept, or the polygon has SIDES others.
    """
    pick = 0
    for k in range(found):
        if spot[2, k] < spot[2, pick]:
            pick = k
    number = 0
    while number < SIDES and spot[3, pick] > close:
        chosen = pick
        for k in range(found):
            if spot[2, k] < spot[2, chosen] and spot[3, k] > close and apart(spot, k, pick) <= close:
                chosen = k
        kept[number] = chosen
        number += 1
        pick = 0
        for k in range(found):
            spot[3, k] = min(spot[3, k], apart(spot, k, chosen))
            if spot[3, k] > spot[3, pick]:
                pick = k
    return number


@kernel
def thin(spot, kept, number, i, j, width):
    """Whether all corners kept lie within a width of the line from corner i to corner j."""
    dx, dy = spot[0, j] - spot[0, i], spot[1, j] - spot[1, i]
    bound = width * math.sqrt(dx * dx + dy * dy)
    for m in range(number):
        k = kept[m]
        if abs(dx * (spot[1, k] - spot[1, i]) - dy * (spot[0, k] - spot[0, i])) > bound:
            return False
    return True


@kernel
def arrange(spot, number, ring, angle):
    """Order the numbers in a ring by the angle of their points about the points' mean.

    Instead of the angle serves what grows with it: 1 - x / (|x| + |y|) above the x axis, its negative below.
    """
    mx = my = 0.0
    for k in range(number):
        mx += spot[0, ring[k]] / number
        my += spot[1, ring[k]] / number
    for k in range(number):
        point = ring[k]
        dx, dy = spot[0, point] - mx, spot[1, point] - my
        around = abs(dx) + abs(dy)
        key = math.copysign(1.0 - dx / around, dy) if around > 0.0 else 0.0
        m = k
        while m > 0 and angle[m - 1] > key:
            angle[m], ring[m] = angle[m - 1], ring[m - 1]
            m -= 1
        angle[m], ring[m] = key, point


@kernel
def trim(spot, number, most, least, keep, ring):
    """Take points out of a ring, the one nearest to the line through its neighbours first. Returns how many are left.

    Points go as long as there are more than `most`, or one is not farther from that line than `least`, on the inner side
    of it, or where the ring turns inwards. The point `keep` stays, and so do the two ends of a ring that is as thin.
    """
    while number > 2:
        worst, smallest = -1, math.inf
        for k in range(number):
            i, j, l = ring[k - 1] if k else ring[number - 1], ring[k], ring[k + 1] if k + 1 < number else ring[0]
            ax, ay, bx, by = spot[0, j] - spot[0, i], spot[1, j] - spot[1, i], spot[0, l] - spot[0, j], spot[1, l] - spot[1, j]
            height = (ax * by - ay * bx) / math.sqrt((ax + bx) * (ax + bx) + (ay + by) * (ay + by))
            end = abs(height) <= least and ax * bx + ay * by < 0.0
            if height < smallest and j != keep and not end:
                worst, smallest = k, height
        if worst < 0 or (number <= most and smallest > least):
            break
        number -= 1
        for k in range(worst, number):
            ring[k] = ring[k + 1]
    return number


@kernel
def side_by_side(polygon, column, width, shortest, place, corner, weight):
    """Ends of the part over which two edges are within a width of each other, seen along the normal.

    With s the coordinate along both edges, a(s) and b(s) their coordinates across, a - b is linear in s and within
    the width between two values of s. Returns 2, or 0 where that part is shorter than `shortest`: edges that cross.
    """
    ax, ay, bx, by = polygon[0, 0], polygon[0, 1], polygon[1, 0], polygon[1, 1]
    ux, uy, vx, vy = ax[1] - ax[0], ay[1] - ay[0], bx[1] - bx[0], by[1] - by[0]
    lu, lv = math.sqrt(ux * ux + uy * uy), math.sqrt(vx * vx + vy * vy)
    turn = 1.0 if ux * vx + uy * vy >= 0.0 else -1.0
    dx, dy = ux / lu + turn * vx / lv, uy / lu + turn * vy / lv
    length = math.sqrt(dx * dx + dy * dy)
    dx, dy = dx / length, dy / length
    a0, a1, b0, b1 = dx * ax[0] + dy * ay[0], dx * ax[1] + dy * ay[1], dx * bx[0] + dy * by[0], dx * bx[1] + dy * by[1]
    slope_a, slope_b = (dx * uy - dy * ux) / (a1 - a0), (dx * vy - dy * vx) / (b1 - b0)
    slope = slope_a - slope_b
    offset = (dx * ay[0] - dy * ax[0] - slope_a * a0) - (dx * by[0] - dy * bx[0] - slope_b * b0)
    low, high = max(min(a0, a1), min(b0, b1)), min(max(a0, a1), max(b0, b1))
    if slope != 0.0:
        s0, s1 = (-width - offset) / slope, (width - offset) / slope
        low, high = max(low, min(s0, s1)), min(high, max(s0, s1))
    elif abs(offset) > width:
        return 0
    if not high - low > shortest:
        return 0
    for k in range(2):
        s = high if k else low
        edge_point(column, 0, 0, 1, (s - a0) / (a1 - a0), 0, k, corner, weight)
        edge_point(column, 1, 0, 1, (s - b0) / (b1 - b0), 3, k, corner, weight)
        t = weight[1, k]
        place[0, k], place[1, k] = ax[0] + t * ux, ay[0] + t * uy
    return 2


@inlined
def edge_point(column, side, i, j, t, row, k, corner, weight):
    """Make the point at the share t from corner i to corner j of one polygon half of point k."""
    share = min(max(t, 0.0), 1.0)
    corner[row, k], corner[row + 1, k], corner[row + 2, k] = column[side, i], column[side, j], column[side, i]
    weight[row, k], weight[row + 1, k], weight[row + 2, k] = 1.0 - share, share, 0.0


@kernel
def overlap(polygon, column, sides_a, sides_b, slack, distance, place, corner, weight):
    """Corners of what two convex polygons share, of which one may be an edge. Returns how many."""
    distances(polygon[0], sides_a, polygon[1], sides_b, distance[0])
    distances(polygon[1], sides_b, polygon[0], sides_a, distance[1])
    found = corners_within(polygon, column, 0, sides_a, sides_b, slack, distance[0], place, corner, weight, 0)
    found = corners_within(polygon, column, 1, sides_b, sides_a, slack, distance[1], place, corner, weight, found)
    return crossings(polygon, column, sides_a, sides_b, slack, distance, place, corner, weight, found)


@kernel
def distances(points, number, polygon, sides, distance):
    """Distance of every point from the line through every side of a polygon, positive on the inner side."""
    for j in range(sides if sides > 2 else 1):
        m = j + 1 if j + 1 < sides else 0
        dx, dy = polygon[0, m] - polygon[0, j], polygon[1, m] - polygon[1, j]
        length = math.sqrt(dx * dx + dy * dy)
        dx, dy = dx / length, dy / length
        for i in range(number):
            distance[i, j] = dx * (points[1, i] - polygon[1, j]) - dy * (points[0, i] - polygon[0, j])


@inlined
def is_new(place, found, px, py, slack):
    """Whether a point is none of those found, and there is room for it."""
    new = found < SPOTS
    for k in range(found):
        new &= abs(place[0, k] - px) > 2.0 * slack or abs(place[1, k] - py) > 2.0 * slack
    return new


@kernel
def corners_within(polygon, column, side, number, sides, slack, distance, place, corner, weight, found):
    """Corners of one polygon within the other: a corner, and three around it. Returns how many points there are now."""
    if sides < 3:
        return found
    own, other = 3 * side, 3 - 3 * side
    qx, qy = polygon[1 - side, 0], polygon[1 - side, 1]
    for i in range(number):
        nearest = math.inf
        for j in range(sides):
            nearest = min(nearest, distance[i, j])
        px, py = polygon[side, 0, i], polygon[side, 1, i]
        if nearest < -slack or not is_new(place, found, px, py, slack):
            continue
        best = -math.inf
        for j in range(1, sides - 1):
            w0, w1, w2 = barycentric(px - qx[0], py - qy[0], qx[j] - qx[0], qy[j] - qy[0], qx[j + 1] - qx[0], qy[j + 1] - qy[0])
            if min(w0, w1, w2) > best:
                best = min(w0, w1, w2)
                w0, w1, w2 = max(w0, 0.0), max(w1, 0.0), max(w2, 0.0)
                total = w0 + w1 + w2
                corner[other, found], weight[other, found] = column[1 - side, 0], w0 / total
                corner[other + 1, found], weight[other + 1, found] = column[1 - side, j], w1 / total
                corner[other + 2, found], weight[other + 2, found] = column[1 - side, j + 1], w2 / total
        for k in range(3):
            corner[own + k, found], weight[own + k, found] = column[side, i], 0.0 if k else 1.0
        place[0, found], place[1, found] = px, py
        found += 1
    return found


@formula
def barycentric(px, py, ux, uy, vx, vy):
    """Weights of the corners 0, u and v of a triangle at p."""
    area = ux * vy - uy * vx
    w1, w2 = (px * vy - py * vx) / area, (ux * py - uy * px) / area
    return 1.0 - w1 - w2, w1, w2


@kernel
def crossings(polygon, column, sides_a, sides_b, slack, distance, place, corner, weight, found):
    """Points where a side of one polygon crosses a side of the other. Returns how many points there are now.

    Sides that end on the other's line count as crossing it, so that no corner is lost to rounding; of nearly parallel
    sides the shares of the two are those of one point, or there is none.
    """
    for i in range(sides_a if sides_a > 2 else 1):
        m = i + 1 if i + 1 < sides_a else 0
        for j in range(sides_b if sides_b > 2 else 1):
            l = j + 1 if j + 1 < sides_b else 0
            a0, a1, b0, b1 = distance[0, i, j], distance[0, m, j], distance[1, j, i], distance[1, l, i]
            if max(min(a0, a1), min(b0, b1)) > slack or min(max(a0, a1), max(b0, b1)) < -slack or a0 == a1 or b0 == b1:
                continue
            t, s = min(max(a0 / (a0 - a1), 0.0), 1.0), min(max(b0 / (b0 - b1), 0.0), 1.0)
            px = polygon[0, 0, i] + t * (polygon[0, 0, m] - polygon[0, 0, i])
            py = polygon[0, 1, i] + t * (polygon[0, 1, m] - polygon[0, 1, i])
            qx = polygon[1, 0, j] + s * (polygon[1, 0, l] - polygon[1, 0, j])
            qy = polygon[1, 1, j] + s * (polygon[1, 1, l] - polygon[1, 1, j])
            if max(abs(px - qx), abs(py - qy)) <= 2.0 * slack and is_new(place, found, px, py, slack):
                edge_point(column, 0, i, m, t, 0, found, corner, weight)
                edge_point(column, 1, j, l, s, 3, found, corner, weight)
                place[0, found], place[1, found] = px, py
                found += 1
    return found


@kernel
def spread(meetings, points, pool_corner, pool_weight, pool_gap, pooled, extra):
    """Put the contacts found in place of those that they replace, from the last on: none moves down."""
    pair, corner, weight, gap = meetings.pair, meetings.corner, meetings.weight, meetings.gap
    nx, ny, nz = meetings.normal[0], meetings.normal[1], meetings.normal[2]
    end = meetings.listed[0] + extra
    for t in range(meetings.listed[0] - 1, -1, -1):
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
    meetings.listed[0] += extra
