"""Trees over pieces of surface: cells of cloth, segments, triangles of hulls. Pairs of pieces that come near each other.

As with the trees of particles (kernels/sphere_tree.py) bounds are updated from the leaves up, and parts of a cloth are passed
over whose edges prove that no two of their features can be near. Here every node down to a single cell has such bounds. Any
two points of a cloth's surface are joined by a path across its triangles, each of which is spanned by one edge along i and
one along j of its cell: so what physics/flatness.py says of particles holds for all points of the surface, with the closest
features that share no corner in place of the closest particles. Nodes are boxes, not spheres: a sphere about the face of a
crate holds all of the cloth that lies on it.

The descent goes by the number of leaves, not by the size of boxes: pairs are listed in an order that does not depend on
where anything is, so that results do not depend on when a list was made.
"""

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.sphere_tree import SLACK, visit_halves
from verlet_numba.physics.flatness import unfolded


@kernel
def update_pieces(place, radius, slack, pieces):
    """Boxes and slack of all nodes. place (A, 3) m; radius and slack (A,) m, by which a box reaches beyond its corners."""
    corner, piece, skip, box, most = pieces.corner, pieces.piece, pieces.skip, pieces.box, pieces.slack
    for k in pieces.leaf:
        e = piece[k]
        a, b, c, d = corner[e, 0], corner[e, 1], corner[e, 2], corner[e, 3]
        most[k] = max(slack[a], slack[b], slack[c], slack[d])
        beyond = most[k] + max(radius[a], radius[b], radius[c], radius[d])
        for i in range(3):
            p, q, r, s = place[a, i], place[b, i], place[c, i], place[d, i]
            box[k, i], box[k, 3 + i] = min(p, q, r, s) - beyond, max(p, q, r, s) + beyond
    for k in pieces.inner:
        a, b = k + 1, skip[k + 1]
        most[k] = max(most[a], most[b])
        for i in range(3):
            box[k, i], box[k, 3 + i] = min(box[a, i], box[b, i]), max(box[a, 3 + i], box[b, 3 + i])


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
def list_pieces(pieces, among, itself, stack, pairs):
    """List pairs of pieces that are near each other. False: no room.

    among: 1: of bodies in the first `soft` trees with each other, of each with itself if `itself` is not None; 0: of those with
    all others.
    """
    listed, soft = 0, pieces.soft
    for t in range(soft):
        low, high = (own(t, itself), soft) if among else (soft, pieces.root.size - 1)
        for u in range(low, high):
            listed = descend_pieces(t, u, pieces, stack, pairs, listed)
            if listed == NO_ROOM:
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
def descend_pieces(t, u, pieces, stack, pairs, listed):
    """List the pairs of pieces of two trees, or of one with itself; the new number of pairs, or NO_ROOM."""
    skip, piece, box, slack, rectangle = pieces.skip, pieces.piece, pieces.box, pieces.slack, pieces.rectangle
    bound, lattice, first, second = pieces.bound, pieces.lattice, stack.first, stack.second
    one, two = pairs.first, pairs.second
    a, b, closest, reach = lattice[t, 0], lattice[t, 1], lattice[t, 2], lattice[t, 3]
    flat = t == u and closest > 0.0
    first[0], second[0], height = pieces.root[t], pieces.root[u], 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if k == l:
            if (piece[k] >= 0 and not flat) or (flat and unfolded(
                    bound[k, 0], bound[k, 1], bound[k, 2], bound[k, 3], bound[k, 4], bound[k, 5], bound[k, 6], bound[k, 7],
                    bound[k, 8], bound[k, 9], bound[k, 10], bound[k, 11], a, b, (reach + 2.0 * slack[k]) * SLACK / closest)):
                continue
            if piece[k] >= 0:               # a cell that folds on itself
                if listed == one.size:
                    return NO_ROOM
                one[listed], two[listed] = piece[k], piece[k]
                listed += 1
                continue
            height = visit_halves(first, second, height, k + 1, skip[k + 1])
            continue
        if apart(box, k, l):
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
                return NO_ROOM
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
def apart(box, k, l):
    """Whether the boxes of two nodes have nothing in common, or are not numbers."""
    return not (box[k, 0] <= box[l, 3] and box[l, 0] <= box[k, 3] and box[k, 1] <= box[l, 4] and box[l, 1] <= box[k, 4]
                and box[k, 2] <= box[l, 5] and box[l, 2] <= box[k, 5])


@inlined
def side_by_side(rectangle, k, l):
    """Whether the rectangles of two nodes touch, at a side or at a corner."""
    return (rectangle[k, 0] <= rectangle[l, 1] + 1 and rectangle[l, 0] <= rectangle[k, 1] + 1
            and rectangle[k, 2] <= rectangle[l, 3] + 1 and rectangle[l, 2] <= rectangle[k, 3] + 1)
