"""Convex polygons in a plane: their corners in order, what two of them share, points that are left out.

Points stand in columns, coordinates in rows; a ring holds the numbers of points in their order around. What two polygons
share comes as weighted corners of both: three of the first, three of the second, `column` telling which corners of
hulls those are. See kernels/manifold.py, which uses this and gives the derivation.
"""

import math

import numpy as np

from verlet_numba._jit import formula, inlined, kernel

SIDES = 16          # corners of a polygon, at most
SPOTS = 64          # points that two share, at most, before some are left out


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
    sides = sides_a, sides_b
    found = np.int64(0)             # typed as what the function returns: else it is compiled twice
    for side in range(2):
        distances(polygon[side], sides[side], polygon[1 - side], sides[1 - side], distance[side])
        found = corners_within(polygon, column, side, sides[side], sides[1 - side], slack, distance[side],
                               place, corner, weight, found)
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
