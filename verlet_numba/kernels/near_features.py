"""Pairs of features: vertices with triangles, edges with edges. Which may touch soon, and where they are closest.

Features that share a corner never meet. Those of one body that are near each other at rest may come nearer, to NEARER of
their distance there: else a cloth thicker than its cells would press on itself wherever it is.
"""

import math

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers import NEARER
from verlet_numba.physics.closest import of_segments, on_triangle


@kernel
def list_features(place, points, pieces, listing):
    """List the pairs of features, of the pairs of pieces listed, that are within reach and slack. False: no room.

    place (A, 3) m: where the points are. Two that nothing moves are left out, as are lone points with edges of triangles.
    """
    vertices, vertex, edges, edge, triangles, triangle = (pieces.vertices, pieces.vertex, pieces.edges, pieces.edge,
                                                          pieces.triangles, pieces.triangle)
    listed = 0
    for n in range(listing.pairs.listed[0]):
        e, f = listing.pairs.first[n], listing.pairs.second[n]
        for v in range(vertices[e], vertices[e + 1]):
            for t in range(triangles[f], triangles[f + 1]):
                listed = list_one(place, points, listing, vertex[v], triangle[0, t], triangle[1, t], triangle[2, t], 0, listed)
        for v in range(vertices[f], vertices[f + 1]):
            for t in range(triangles[e], triangles[e + 1]):
                listed = list_one(place, points, listing, vertex[v], triangle[0, t], triangle[1, t], triangle[2, t], 0, listed)
        faces = triangles[e + 1] - triangles[e], triangles[f + 1] - triangles[f]
        for s in range(edges[e], edges[e + 1]):
            a, b = edge[0, s], edge[1, s]
            for t in range(edges[f], edges[f + 1]):
                c, d = edge[0, t], edge[1, t]
                if (a == b and faces[1] > 0) or (c == d and faces[0] > 0):
                    continue
                listed = list_one(place, points, listing, a, b, c, d, 1, listed)
        if listed < 0:
            return False
    listing.made[0] = listed
    return True


@kernel
def list_one(place, points, listing, a, b, c, d, edges, listed):
    """List one pair if it is near; the new number of pairs, -1: there is no room, or was none."""
    slack, same, moves = listing.slack, points.same, points.moves
    if listed < 0 or not (moves[a] | moves[b] | moves[c] | moves[d]):
        return listed
    i, j, k, l = same[a], same[b], same[c], same[d]
    if i == k or i == l or (edges == 0 and i == j) or (edges == 1 and (j == k or j == l)):
        return listed
    reach = points.radius[a] + points.radius[d]
    far = reach + of_pair(slack, a, b, c, d, edges)
    if aside(place, a, b, c, d, edges, 0, far) or aside(place, a, b, c, d, edges, 1, far) or aside(
            place, a, b, c, d, edges, 2, far):
        return listed
    distance = distance_of(place, a, b, c, d, edges)
    if distance >= far:
        return listed
    if points.body[a] >= 0 and points.body[a] == points.body[d]:
        reach = min(reach, NEARER * distance_of(points.rest, a, b, c, d, edges))
        if distance >= reach + of_pair(slack, a, b, c, d, edges):
            return listed
    if listed == listing.left.size:
        return -1
    point = listing.point
    point[listed, 0], point[listed, 1], point[listed, 2], point[listed, 3] = a, b, c, d
    listing.edges[listed], listing.reach[listed], listing.left[listed] = edges, reach, distance - reach
    return listed + 1


@inlined
def of_pair(values, a, b, c, d, edges):
    """The largest value of the first feature's points and that of the second's, together."""
    one, two, three, four = values[a], values[b], values[c], values[d]
    other = max(three, four)
    return max(one, two) + other if edges else one + max(two, other)


@inlined
def aside(place, a, b, c, d, edges, axis, far):
    """Whether two features are at least so far apart along an axis."""
    one, two, three, four = place[a, axis], place[b, axis], place[c, axis], place[d, axis]
    low, high, least, most = one, one, min(three, four), max(three, four)
    if edges:
        low, high = min(one, two), max(one, two)
    else:
        least, most = min(least, two), max(most, two)
    return least - high >= far or low - most >= far


@kernel
def distance_of(place, a, b, c, d, edges):
    """Distance of a vertex a and a triangle b, c, d, or of two edges a, b and c, d [m]."""
    if edges:
        return math.sqrt(of_segments(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                                     place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])[2])
    return math.sqrt(on_triangle(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                                 place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])[3])


@kernel
def weights_of(place, a, b, c, d, edges):
    """Weights of the four points at the closest points, those of the second feature below 0."""
    if edges:
        s, t, _ = of_segments(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                              place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])
        return 1.0 - s, s, t - 1.0, -t
    u, v, w, _ = on_triangle(place[a, 0], place[a, 1], place[a, 2], place[b, 0], place[b, 1], place[b, 2],
                             place[c, 0], place[c, 1], place[c, 2], place[d, 0], place[d, 1], place[d, 2])
    return 1.0, -u, -v, -w


@kernel
def find_gaps(points, listing, gaps):
    """Add the pairs that may touch in this substep to the gaps. False: no room.

    A pair is looked at again as soon as the ways of its points may have used up what was left between them.
    """
    start, path, step, left, point, edges, reach = (points.start, listing.path, listing.step, listing.left, listing.point,
                                                    listing.edges, listing.reach)
    listed = gaps.listed[0]
    for n in range(listing.made[0]):
        a, b, c, d, two = point[n, 0], point[n, 1], point[n, 2], point[n, 3], edges[n]
        way, onward = of_pair(path, a, b, c, d, two), of_pair(step, a, b, c, d, two)
        if left[n] >= way + onward:
            continue
        p, q, r, s = weights_of(start, a, b, c, d, two)
        x = p * start[a, 0] + q * start[b, 0] + r * start[c, 0] + s * start[d, 0]
        y = p * start[a, 1] + q * start[b, 1] + r * start[c, 1] + s * start[d, 1]
        z = p * start[a, 2] + q * start[b, 2] + r * start[c, 2] + s * start[d, 2]
        distance = math.sqrt(x * x + y * y + z * z)
        left[n] = distance - reach[n] + way
        if distance - reach[n] >= onward or distance == 0.0:
            continue
        if listed == gaps.gap.size:
            return False
        gaps.point[listed, 0], gaps.point[listed, 1], gaps.point[listed, 2], gaps.point[listed, 3] = a, b, c, d
        gaps.weight[listed, 0], gaps.weight[listed, 1], gaps.weight[listed, 2], gaps.weight[listed, 3] = p, q, r, s
        gaps.normal[listed, 0], gaps.normal[listed, 1], gaps.normal[listed, 2] = x / distance, y / distance, z / distance
        gaps.gap[listed], gaps.reach[listed], gaps.edges[listed], gaps.push[listed] = distance, reach[n], two, 0.0
        listed += 1
    gaps.listed[0] = listed
    return True
