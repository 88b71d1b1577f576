"""Trees over pieces of surface: cells of cloth, segments, triangles of hulls. Pairs of pieces that come near each other.

As with the trees of particles (kernels/sphere_tree.py) spheres are updated from the leaves up, and parts of a cloth are
passed over whose edges prove that no two of their features can be near. Here every node down to a single cell has such
bounds. Any two points of a cloth's surface are joined by a path across its triangles, each of which is spanned by one edge
along i and one along j of its cell: so what physics/flatness.py says of particles holds for all points of the surface, with
the closest features that share no corner in place of the closest particles.

The descent goes by the number of leaves, not by the size of spheres: pairs are listed in an order that does not depend on
where anything is, so that results do not depend on when a list was made.
"""

import math

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.kernels.sphere_tree import ROUNDING, SLACK, overlap
from verlet_numba.physics.enclosing import sphere_of_spheres
from verlet_numba.physics.flatness import unfolded


@kernel
def update_pieces(place, radius, slack, pieces):
    """Spheres, slack and bounds of all nodes. place (A, 3) m; radius and slack (A,) m."""
    corner, piece, skip, sphere, most = pieces.corner, pieces.piece, pieces.skip, pieces.sphere, pieces.slack
    for k in pieces.leaf:
        e = piece[k]
        a, b, c, d = corner[e, 0], corner[e, 1], corner[e, 2], corner[e, 3]
        x = 0.25 * (place[a, 0] + place[b, 0] + place[c, 0] + place[d, 0])
        y = 0.25 * (place[a, 1] + place[b, 1] + place[c, 1] + place[d, 1])
        z = 0.25 * (place[a, 2] + place[b, 2] + place[c, 2] + place[d, 2])
        r = max(beyond(place, radius, slack, a, x, y, z), beyond(place, radius, slack, b, x, y, z),
                beyond(place, radius, slack, c, x, y, z), beyond(place, radius, slack, d, x, y, z))
        r += ROUNDING * (r + abs(x) + abs(y) + abs(z))
        sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = x, y, z, r
        most[k] = max(slack[a], slack[b], slack[c], slack[d])
    for k in pieces.inner:
        a, b = k + 1, skip[k + 1]
        x, y, z, r = sphere_of_spheres(sphere[a, 0], sphere[a, 1], sphere[a, 2], sphere[a, 3],
                                       sphere[b, 0], sphere[b, 1], sphere[b, 2], sphere[b, 3])
        r += ROUNDING * (r + abs(x) + abs(y) + abs(z))
        sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = x, y, z, r
        most[k] = max(most[a], most[b])


@inlined
def beyond(place, radius, slack, p, x, y, z):
    """How far from (x, y, z) point p reaches, its radius and slack included."""
    dx, dy, dz = place[p, 0] - x, place[p, 1] - y, place[p, 2] - z
    return math.sqrt(dx * dx + dy * dy + dz * dz) + radius[p] + slack[p]


@kernel
def update_edges(place, pieces):
    """Bounds on the edges of all nodes of cloth: of a cell's own four, or of two children together."""
    root, skip, piece, bound, corner, lattice = (pieces.root, pieces.skip, pieces.piece, pieces.bound, pieces.corner,
                                                 pieces.lattice)
    for t in range(pieces.soft):
        if lattice[t, 2] == 0.0:
            continue
        for k in range(root[t + 1] - 1, root[t] - 1, -1):
            if piece[k] >= 0:
                e = piece[k]
                a, b, c, d = corner[e, 0], corner[e, 1], corner[e, 2], corner[e, 3]
                for i in range(3):
                    one, other = place[b, i] - place[a, i], place[c, i] - place[d, i]
                    bound[k, i], bound[k, 6 + i] = min(one, other), max(one, other)
                    one, other = place[d, i] - place[a, i], place[c, i] - place[b, i]
                    bound[k, 3 + i], bound[k, 9 + i] = min(one, other), max(one, other)
            else:
                a, b = k + 1, skip[k + 1]
                for i in range(6):
                    bound[k, i] = min(bound[a, i], bound[b, i])
                    bound[k, 6 + i] = max(bound[a, 6 + i], bound[b, 6 + i])


@kernel
def list_among(pieces, itself, stack, pairs):
    """List pairs of pieces of deformable bodies that are near, of each with itself if it is not None. False: no room."""
    root, sphere, soft = pieces.root, pieces.sphere, pieces.soft
    listed = 0
    for t in range(soft):
        for u in range(own(t, itself), soft):
            k, l = root[t], root[u]
            if k == l or overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                                 sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], 0.0):
                listed = descend_pieces(t, u, pieces, stack, pairs, listed)
                if listed < 0:
                    return False
    pairs.listed[0] = listed
    return True


@kernel
def own(t, itself):
    """The first tree that tree t is held against: itself, or the next."""
    if itself is None:
        return t + 1
    return t


@kernel
def list_against_others(pieces, stack, pairs):
    """List pairs of pieces near each other, of deformable bodies with rigid bodies and colliders. False: no room."""
    listed, soft = 0, pieces.soft
    for t in range(soft):
        for u in range(soft, pieces.root.size - 1):
            listed = descend_pieces(t, u, pieces, stack, pairs, listed)
            if listed < 0:
                return False
    pairs.listed[0] = listed
    return True


@kernel
def descend_pieces(t, u, pieces, stack, pairs, listed):
    """List the pairs of pieces of two trees, or of one with itself; the new number of pairs, -1: no room."""
    skip, piece, sphere, slack, rectangle = pieces.skip, pieces.piece, pieces.sphere, pieces.slack, pieces.rectangle
    bound, lattice, first, second = pieces.bound, pieces.lattice, stack.first, stack.second
    one, two = pairs.first, pairs.second
    a, b, closest, reach = lattice[t, 0], lattice[t, 1], lattice[t, 2], lattice[t, 3]
    flat = t == u and closest > 0.0
    first[0], second[0], height = pieces.root[t], pieces.root[u], 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if k == l:
            if piece[k] >= 0 or (flat and unfolded(
                    bound[k, 0], bound[k, 1], bound[k, 2], bound[k, 3], bound[k, 4], bound[k, 5], bound[k, 6], bound[k, 7],
                    bound[k, 8], bound[k, 9], bound[k, 10], bound[k, 11], a, b, (reach + 2.0 * slack[k]) * SLACK / closest)):
                continue
            c, d = k + 1, skip[k + 1]
            first[height], second[height] = c, c
            first[height + 1], second[height + 1] = d, d
            first[height + 2], second[height + 2] = c, d
            height += 3
            continue
        if not overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                       sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], 0.0):
            continue
        if flat and side_by_side(rectangle, k, l) and unfolded(
                min(bound[k, 0], bound[l, 0]), min(bound[k, 1], bound[l, 1]), min(bound[k, 2], bound[l, 2]),
                min(bound[k, 3], bound[l, 3]), min(bound[k, 4], bound[l, 4]), min(bound[k, 5], bound[l, 5]),
                max(bound[k, 6], bound[l, 6]), max(bound[k, 7], bound[l, 7]), max(bound[k, 8], bound[l, 8]),
                max(bound[k, 9], bound[l, 9]), max(bound[k, 10], bound[l, 10]), max(bound[k, 11], bound[l, 11]),
                a, b, (reach + slack[k] + slack[l]) * SLACK / closest):
            continue
        if piece[k] >= 0 and piece[l] >= 0:
            if listed == one.size:
                return -1
            one[listed], two[listed] = piece[k], piece[l]
            listed += 1
        elif piece[l] >= 0 or skip[k] - k >= skip[l] - l:
            first[height], second[height] = skip[k + 1], l
            first[height + 1], second[height + 1] = k + 1, l
            height += 2
        else:
            first[height], second[height] = k, skip[l + 1]
            first[height + 1], second[height + 1] = k, l + 1
            height += 2
    return listed


@inlined
def side_by_side(rectangle, k, l):
    """Whether the rectangles of two nodes touch, at a side or at a corner."""
    return (rectangle[k, 0] <= rectangle[l, 1] + 1 and rectangle[l, 0] <= rectangle[k, 1] + 1
            and rectangle[k, 2] <= rectangle[l, 3] + 1 and rectangle[l, 2] <= rectangle[k, 3] + 1)
