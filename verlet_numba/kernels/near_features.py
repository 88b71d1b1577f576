"""Pairs of features: vertices with triangles, edges with edges. Which may touch soon, and where they are closest.

Features that share a corner never meet. Those of one body that are near each other at rest may come nearer, to NEARER of
their distance there: else a cloth thicker than its cells would press on itself wherever it is.
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.exact import NEARER
from verlet_numba.kernels.impact_time import NEVER, apart_at, time_of_impact
from verlet_numba.physics.closest import of_segments, on_triangle


@kernel
def list_features(place, points, pieces, listing):
    """List the pairs of features, of the pairs of pieces listed, that are within reach and slack. False: no room.

    place (A, 3) m: where the points are. Two that nothing moves are left out, as are lone points with edges of triangles.
    """
    vertices, vertex, edges, edge, triangles, triangle = (pieces.vertices, pieces.vertex, pieces.edges, pieces.edge,
                                                          pieces.triangles, pieces.triangle)
    box, node, slack, one, two = pieces.box, pieces.node, listing.slack, listing.pairs.first, listing.pairs.second
    rest, same, moves, radius, body = points.rest, points.same, points.moves, points.radius, points.body
    point, kind, reach, left = listing.point, listing.edges, listing.reach, listing.left
    listed = 0
    for n in range(listing.pairs.listed[0]):
        for turn in range(2):
            e, f = (two[n], one[n]) if turn else (one[n], two[n])
            if turn and e == f:
                continue
            k, faces = node[f], triangles[f + 1] - triangles[f]
            for v in range(vertices[e], vertices[e + 1] if faces else vertices[e]):
                a = vertex[v]
                if outside(place, a, a, radius[a] + slack[a], box, k):
                    continue
                for t in range(triangles[f], triangles[f + 1]):
                    b, c, d = triangle[0, t], triangle[1, t], triangle[2, t]
                    far = radius[a] + radius[d] + slack[a] + max(slack[b], slack[c], slack[d])
                    if not triangle_beyond(place, a, b, c, d, far):
                        listed = list_one(place, rest, same, moves, radius, body, point, kind, reach, left,
                                          a, b, c, d, 0, far, listed)
            if turn:
                continue
            single = triangles[e + 1] > triangles[e]
            for s in range(edges[e], edges[e + 1]):
                a, b = edge[0, s], edge[1, s]
                own = max(slack[a], slack[b])
                if (a == b and faces) or outside(place, a, b, radius[a] + own, box, k):
                    continue
                for t in range(s + 1 if e == f else edges[f], edges[f + 1]):
                    c, d = edge[0, t], edge[1, t]
                    far = radius[a] + radius[d] + own + max(slack[c], slack[d])
                    if not (c == d and single) and not edges_beyond(place, a, b, c, d, far):
                        listed = list_one(place, rest, same, moves, radius, body, point, kind, reach, left,
                                          a, b, c, d, 1, far, listed)
        if listed == NO_ROOM:
            return False
    listing.made[0] = listed
    return True


@inlined
def outside(place, a, b, reach, box, k):
    """Whether the line from a to b lies beyond a side of a node's box, by more than its own reach."""
    return (min(place[a, 0], place[b, 0]) - reach > box[k, 3] or max(place[a, 0], place[b, 0]) + reach < box[k, 0]
            or min(place[a, 1], place[b, 1]) - reach > box[k, 4] or max(place[a, 1], place[b, 1]) + reach < box[k, 1]
            or min(place[a, 2], place[b, 2]) - reach > box[k, 5] or max(place[a, 2], place[b, 2]) + reach < box[k, 2])


@inlined
def triangle_beyond(place, a, b, c, d, far):
    """Whether vertex a and triangle b, c, d are at least so far apart along x, y or z."""
    return (place[a, 0] - max(place[b, 0], place[c, 0], place[d, 0]) >= far
            or min(place[b, 0], place[c, 0], place[d, 0]) - place[a, 0] >= far
            or place[a, 1] - max(place[b, 1], place[c, 1], place[d, 1]) >= far
            or min(place[b, 1], place[c, 1], place[d, 1]) - place[a, 1] >= far
            or place[a, 2] - max(place[b, 2], place[c, 2], place[d, 2]) >= far
            or min(place[b, 2], place[c, 2], place[d, 2]) - place[a, 2] >= far)


@inlined
def edges_beyond(place, a, b, c, d, far):
    """Whether edges a, b and c, d are at least so far apart along x, y or z."""
    return (min(place[a, 0], place[b, 0]) - max(place[c, 0], place[d, 0]) >= far
            or min(place[c, 0], place[d, 0]) - max(place[a, 0], place[b, 0]) >= far
            or min(place[a, 1], place[b, 1]) - max(place[c, 1], place[d, 1]) >= far
            or min(place[c, 1], place[d, 1]) - max(place[a, 1], place[b, 1]) >= far
            or min(place[a, 2], place[b, 2]) - max(place[c, 2], place[d, 2]) >= far
            or min(place[c, 2], place[d, 2]) - max(place[a, 2], place[b, 2]) >= far)


@kernel
def list_one(place, rest, same, moves, radius, body, point, kind, reach, left, a, b, c, d, edges, far, listed):
    """List one pair if it is nearer than `far`; the new number of pairs, or NO_ROOM: there is none, or was none."""
    if listed == NO_ROOM or not moves[a] | moves[b] | moves[c] | moves[d] or shared(same[a], same[b], same[c], same[d], edges):
        return listed
    distance, whole = distance_of(place, a, b, c, d, edges), radius[a] + radius[d]
    nearest = whole
    if distance < far and body[a] >= 0 and body[a] == body[d]:
        nearest = min(whole, NEARER * distance_of(rest, a, b, c, d, edges))
    if not distance < far - whole + nearest:
        return listed
    if listed == left.size:
        return NO_ROOM
    point[listed, 0], point[listed, 1], point[listed, 2], point[listed, 3] = a, b, c, d
    kind[listed], reach[listed], left[listed] = edges, nearest, distance - nearest
    return listed + 1


@formula
def shared(i, j, k, l, edges):
    """Whether two features share a corner."""
    return i in (k, l) or j == (i if edges == 0 else k) or (edges == 1 and j == l)


@inlined
def of_pair(values, a, b, c, d, edges):
    """The largest value of the first feature's points and that of the second's, together."""
    one, two, three, four = values[a], values[b], values[c], values[d]
    other = max(three, four)
    return max(one, two) + other if edges else one + max(two, other)


@kernel
def distance_of(place, a, b, c, d, edges):
    """Distance of a vertex a and a triangle b, c, d, or of two edges a, b and c, d [m]."""
    if edges:
        return math.sqrt(of_segments(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                                     place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])[2])
    return math.sqrt(on_triangle(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                                 place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])[3])


@kernel
def find_gaps(points, listing, gaps, continuous):
    """Add the pairs that may touch in this substep to the gaps. False: no room.

    A pair is looked at again as soon as the ways of its points may have used up what was left between them. continuous: where
    points go far their closest points are those at the time of impact, and what passes by is only kept from turning back.
    """
    start, path, step, left, point, edges, reach = (points.start, listing.path, listing.step, listing.left, listing.point,
                                                    listing.edges, listing.reach)
    now, weight, normal, listed = points.now, gaps.weight, gaps.normal, gaps.listed[0]
    for n in range(listing.made[0]):
        a, b, c, d, two = point[n, 0], point[n, 1], point[n, 2], point[n, 3], edges[n]
        way, onward = of_pair(path, a, b, c, d, two), of_pair(step, a, b, c, d, two)
        if left[n] >= way + onward:
            continue
        p, q, r, s, x, y, z, distance = apart_at(0.0, start, now, a, b, c, d, two)
        left[n] = distance - reach[n] + way
        if not distance - reach[n] < onward or distance == 0.0:
            continue
        if listed == gaps.gap.size:
            return False
        gaps.gap[listed], gaps.reach[listed], gaps.edges[listed], gaps.push[listed] = distance, reach[n], two, 0.0
        t = impact_of(continuous, start, now, a, b, c, d, two, distance, reach[n], onward)
        if t == NEVER:
            gaps.reach[listed] = -math.inf
        elif t > 0.0:
            p, q, r, s, x, y, z, distance = apart_at(t, start, now, a, b, c, d, two)
        point_of = gaps.point
        point_of[listed, 0], point_of[listed, 1], point_of[listed, 2], point_of[listed, 3] = a, b, c, d
        weight[listed, 0], weight[listed, 1], weight[listed, 2], weight[listed, 3] = p, q, r, s
        normal[listed, 0], normal[listed, 1], normal[listed, 2] = x / distance, y / distance, z / distance
        listed += 1
    gaps.listed[0] = listed
    return True


@kernel
def impact_of(continuous, start, now, a, b, c, d, edges, distance, reach, onward):
    """The time of impact of two features that go farther than their reach; 0: where they are at the start will do."""
    if continuous is None:
        return 0.0
    if onward <= reach or distance <= reach:
        return 0.0
    return time_of_impact(start, now, a, b, c, d, edges, reach)
