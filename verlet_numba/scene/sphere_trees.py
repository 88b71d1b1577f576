"""Sphere trees of a scene's bodies (paper, 5.2): layered ones of deformable bodies, wrapped ones of rigid bodies.

Trees are built from the top by halving the leaves along the longest extent of their centres (Quinlan 1994), level by
level for all nodes at once. A subtree of s leaves has 2 s - 1 nodes, so places in preorder follow from sizes alone, and
halves are halves by number: the depth is that of a balanced tree wherever the leaves lie, be they all in one point.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.exact import Pieces
from verlet_numba.buffers.trees import Candidates, Layered, Spheres, Stack, Wrapped
from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.clearance import hull_clearance
from verlet_numba.scene.hulls import hulls_of, surface_of
from verlet_numba.scene.numbering import Numbering

INSIDE = 1 + 1e-12          # times a squared radius: what rounding may leave outside
PATCH = 16                  # particles of a cloth: nodes with more of them, and their children, have bounds on their edges
FIRST_ROOM = 256            # candidates; buffers grow as needed
FEW = 500               # particles whose pairs are all looked at


class Tree(NamedTuple):
    """M nodes in preorder. Of a cloth, also the rectangle of particles (M, 4) below each: first and last i, first and last j."""

    skip: Integers              # (M,) the node after the subtree
    leaf: Integers              # (M,) number of the leaf, -1: an inner node
    level: Integers             # (M,) parents above the node
    rectangle: Integers         # (M, 4) or (0, 4)


def halved(centres: Floats) -> Tree:
    """The tree over leaves with these centres (L, 3), L >= 1."""
    count = len(centres)
    skip, leaf, level = (np.full(2 * count - 1, -1) for _ in range(3))
    order = np.arange(count)                                            # leaves, those of a node side by side
    node, start, size = np.array([0]), np.array([0]), np.array([count])
    while len(node):
        skip[node], level[node] = node + 2 * size - 1, level.max() + 1
        single = size == 1
        leaf[node[single]] = order[start[single]]
        node, start, size = node[~single], start[~single], size[~single]
        if not len(node):
            break
        which, place = stretches(start, size)
        points, first = centres[order[place]], np.cumsum(size) - size
        axis = np.argmax(np.maximum.reduceat(points, first) - np.minimum.reduceat(points, first), axis=1)
        key = points[np.arange(len(points)), axis[which]]
        order[place] = order[place[np.lexsort((key, which))]]
        left = (size + 1) // 2
        node, start = np.concatenate([node + 1, node + 2 * left]), np.concatenate([start, start + left])
        size = np.concatenate([left, size - left])
    return Tree(skip, leaf, level, np.zeros((0, 4), np.int64))


def halved_grid(nx: int, ny: int, dx: float, dy: float) -> Tree:
    """The tree over the particles i ny + j of a cloth with these spacings: rectangles, halved along the longer side."""
    count = nx * ny
    skip, leaf, level = (np.full(2 * count - 1, -1) for _ in range(3))
    rectangle = np.zeros((2 * count - 1, 4), np.int64)
    node, area = np.array([0]), np.array([[0, nx - 1, 0, ny - 1]])
    while len(node):
        rectangle[node], level[node] = area, level.max() + 1
        sides = area[:, 1::2] - area[:, ::2] + 1
        skip[node] = node + 2 * sides.prod(axis=1) - 1
        single = (sides == 1).all(axis=1)
        leaf[node[single]] = area[single, 0] * ny + area[single, 2]
        node, area, sides = node[~single], area[~single], sides[~single]
        axis = np.argmax((sides - 1) * [dx, dy], axis=1)
        row, low = np.arange(len(node)), 2 * axis
        middle = (area[row, low] + area[row, low + 1]) // 2
        left, right = area.copy(), area.copy()
        left[row, low + 1], right[row, low] = middle, middle + 1
        leaves = (left[:, 1::2] - left[:, ::2] + 1).prod(axis=1)
        node, area = np.concatenate([node + 1, node + 2 * leaves]), np.concatenate([left, right])
    return Tree(skip, leaf, level, rectangle)


def stretches(start: Integers, size: Integers) -> tuple[Integers, Integers]:
    """The numbers start[k], start[k] + 1 ... of every k, size[k] of them: which k each belongs to, and the numbers."""
    which = np.repeat(np.arange(len(size)), size)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(size) - size - start, size)


def smallest_spheres(points: Floats, members: Integers, start: Integers, size: Integers) -> tuple[Floats, Floats, Integers]:
    """Smallest enclosing spheres of sets of points: centres (B, 3), radii (B,) and support (B, 4), all four always filled.

    Set b is points[members[start[b]:start[b] + size[b]]], not empty. As in Welzl (1991), a sphere is that of at most four
    of its points: as long as a point lies outside, the farthest one joins the four and the best of those five is found.
    The radius grows with every such step, so it ends.
    """
    support = np.repeat(members[start][:, None], 4, axis=1)
    centre, squared = points[support[:, 0]], np.zeros(len(start))
    active = np.arange(len(start))
    while len(active):
        which, place = stretches(start[active], size[active])
        candidates = members[place]
        distance = np.sum((points[candidates] - centre[active][which])**2, axis=1)
        first = np.cumsum(size[active]) - size[active]
        farthest = np.maximum.reduceat(distance, first)
        outside = farthest > squared[active] * INSIDE
        rows = np.flatnonzero(distance == farthest[which])
        joining = candidates[rows[np.searchsorted(which[rows], np.arange(len(active)))]]
        active, joining = active[outside], joining[outside]
        better, best_centre, best_squared = with_support(points, joining, support[active])
        grown = best_squared > squared[active]
        active = active[grown]
        support[active], centre[active], squared[active] = better[grown], best_centre[grown], best_squared[grown]
    return centre, np.sqrt(squared), support


def with_support(points: Floats, joining: Integers, support: Integers) -> tuple[Integers, Floats, Floats]:
    """The smallest spheres of four points (B, 4) and a fifth (B,) on their surface: new support, centres, squared radii.

    All circumspheres of the fifth with one, two or three of the four are tried; degenerate ones are not numbers.
    """
    origin = points[joining]
    arms = points[support] - origin[:, None]
    best, best_squared = np.full(support.shape, joining[:, None]), np.full(len(joining), np.inf)
    best_centre = origin.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        for count in (1, 2, 3):
            for chosen in combinations(range(4), count):
                centre = circumcentre(*(arms[:, slot] for slot in chosen))
                squared = np.sum(centre**2, axis=1)
                holds = (np.sum((arms - centre[:, None])**2, axis=2) <= squared[:, None] * INSIDE).all(axis=1)
                better = holds & (squared * INSIDE < best_squared)
                best_squared[better], best_centre[better] = squared[better], origin[better] + centre[better]
                best[better] = joining[better, None]
                best[better, :count] = support[better][:, list(chosen)]
                best[better, count] = joining[better]
    return best, best_centre, np.where(np.isfinite(best_squared), best_squared, 0.0)


def circumcentre(u: Floats, v: Floats | None = None, w: Floats | None = None) -> Floats:
    """Centres of the smallest spheres through 0, u, v and w, as far as given, (B, 3) each."""
    def squared(a: Floats) -> Floats:
        return np.asarray(np.sum(a * a, axis=1, keepdims=True))

    if v is None:
        return 0.5 * u
    if w is None:
        normal = np.cross(u, v)
        return np.asarray(np.cross(squared(u) * v - squared(v) * u, normal) / (2 * squared(normal)))
    volume = np.sum(u * np.cross(v, w), axis=1, keepdims=True)
    return np.asarray((squared(u) * np.cross(v, w) + squared(v) * np.cross(w, u) + squared(w) * np.cross(u, v)) / (2 * volume))


def layered_of(bodies: list[Body], numbering: Numbering, size: int, real: Any, attached: Integers) -> Layered | None:
    """Trees of all copies of deformable bodies, in scene order; None without such bodies.

    `attached` (A, 2) are inner indices of particles that are held together; `size` is n.
    """
    soft = [(body, index) for body, index in zip(bodies, numbering.bodies, strict=True) if not body.shape.rigid]
    if not soft:
        return None
    nodes, radius = [0], np.zeros(size)
    skips, particles, levels, lattices, patches = [], [], [], [], []
    for body, index in soft:
        shape, tree = body.shape, tree_of(body.shape)
        cloth = len(tree.rectangle) > 0
        found, lattice = (patches_of(shape, tree), lattice_of(shape)) if cloth else (NO_PATCHES, (1.0, 1.0, 0.0))
        for own in index:
            skips.append(tree.skip + nodes[-1])
            particles.append(np.where(tree.leaf < 0, -1, own[tree.leaf]))
            levels.append(tree.level)
            patches.append(found.moved(nodes[-1]))
            lattices.append((*lattice, float(np.dtype(real).type(shape.radius))))
            radius[own] = shape.radius
            nodes.append(nodes[-1] + len(tree.skip))
    particle, level = np.concatenate(particles), np.concatenate(levels)
    inner = np.flatnonzero(particle < 0)
    node, rectangle, edges, ends = (np.concatenate(column) for column in zip(*patches, strict=True))
    row = np.full(len(particle), -1)
    row[node] = np.arange(len(node))
    apart, partner = exclusions(bodies, numbering, size, attached)
    return Layered(root=gate(nodes, np.int64), skip=gate(np.concatenate(skips), np.int64), particle=gate(particle, np.int64),
                   leaf=gate(np.flatnonzero(particle >= 0), np.int64),
                   inner=gate(inner[np.argsort(-level[inner], kind="stable")], np.int64),
                   sphere=gate(np.zeros((len(particle), 4)), np.float64), row=gate(row, np.int64), node=gate(node, np.int64),
                   rectangle=gate(rectangle, np.int64), bound=gate(np.zeros((len(node), 12)), np.float64),
                   start=gate(np.cumsum([0, *edges.ravel()]), np.int64), ends=gate(ends.T, np.int64),
                   lattice=gate(lattices, np.float64), radius=gate(radius, real),
                   apart=gate(apart, np.int64), partner=gate(partner, np.int64))


class Patches(NamedTuple):
    """The nodes of a cloth's tree that have bounds, in ascending order, and the edges of those whose children have none."""

    node: Integers              # (R,)
    rectangle: Integers         # (R, 4)
    edges: Integers             # (R, 2) how many of them along i, along j
    ends: Integers              # (U, 2) leaves at tail and head

    def moved(self, first: int) -> "Patches":
        """The same of a tree whose nodes begin at `first`."""
        return Patches(self.node + first, self.rectangle, self.edges, self.ends + first)


NO_PATCHES = Patches(*(np.zeros(shape, np.int64) for shape in (0, (0, 4), (0, 2), (0, 2))))


def patches_of(shape: Shape, tree: Tree) -> Patches:
    """Nodes with bounds: those of more than PATCH particles and their children.

    Of the smallest ones the edges that their particles own are listed: those from (i, j) to (i + 1, j), (i, j - 1) and
    (i, j + 1). Where the cloth ends, an edge that does not exist is the nearest one in its line.
    """
    nx, ny = int(shape.layout[1]), int(shape.layout[2])
    large = tree.skip - np.arange(len(tree.skip)) > 2 * PATCH - 1
    parents = np.flatnonzero(large)
    node = np.union1d([0], np.concatenate([parents + 1, tree.skip[parents + 1]]))
    leaf = np.argsort(tree.leaf)[-nx * ny:]                             # of each particle
    edges, ends = np.zeros((len(node), 2), np.int64), [np.zeros((0, 2), np.int64)]
    for row, k in enumerate(node):
        if large[k]:
            continue
        below = tree.leaf[k:tree.skip[k]]
        i, j = np.divmod(below[below >= 0], ny)
        along = np.minimum(i, nx - 2) * ny + j
        across = np.unique(i * ny + np.concatenate([np.maximum(j - 1, 0), np.minimum(j, ny - 2)]).reshape(2, -1))
        edges[row] = len(np.unique(along)), len(across)
        ends += [leaf[np.stack([np.unique(along), np.unique(along) + ny], axis=1)], leaf[np.stack([across, across + 1], axis=1)]]
    return Patches(node, tree.rectangle[node], edges, np.concatenate(ends))


def tree_of(shape: Shape) -> Tree:
    """The tree over the particles of a shape at rest."""
    if shape.layout[0] != "grid":
        return halved(shape.positions)
    _, nx, ny = shape.layout
    return halved_grid(int(nx), int(ny), *spacing(shape))


def spacing(shape: Shape) -> tuple[float, float]:
    """Distance between neighbours of a cloth along i and along j, m."""
    place, (_, nx, ny) = shape.positions, shape.layout
    corners = place[0], place[(int(nx) - 1) * int(ny)], place[int(ny) - 1]
    return (float(np.linalg.norm(corners[1] - corners[0])) / (int(nx) - 1),
            float(np.linalg.norm(corners[2] - corners[0])) / (int(ny) - 1))


def lattice_of(shape: Shape) -> tuple[float, float, float]:
    """Spacings of a cloth and the smallest rest distance of two of its particles that may meet, m.

    Those of the same offset (di, dj) have the same distance. They may not meet if it is below the sum of the radii, or
    if each two of them share a stick.
    """
    (dx, dy), (_, nx, ny) = spacing(shape), shape.layout
    rows, columns = int(nx), int(ny)
    i, j = np.divmod(shape.sticks, columns)
    offset = np.stack([i[:, 1] - i[:, 0], j[:, 1] - j[:, 0]], axis=1)
    offset = np.where((offset[:, :1] < 0) | ((offset[:, :1] == 0) & (offset[:, 1:] < 0)), -offset, offset)
    families, count = np.unique(offset, axis=0, return_counts=True)
    held = {(int(di), int(dj)) for (di, dj), sticks in zip(families, count, strict=True)
            if sticks == (rows - abs(di)) * (columns - abs(dj))}
    far = 2 * shape.radius + 2 * max(dx, dy)
    offsets = [(di, dj) for di in range(min(rows, int(far / dx) + 2))
               for dj in range(-min(columns - 1, int(far / dy) + 1), min(columns, int(far / dy) + 2))
               if (di, dj) > (0, 0) and (di, dj) not in held]
    distances = np.array([np.hypot(di * dx, dj * dy) for di, dj in offsets])
    return dx, dy, float(min([far, *distances[distances >= 2 * shape.radius]]))


def exclusions(bodies: list[Body], numbering: Numbering, size: int, attached: Integers) -> tuple[Integers, Integers]:
    """Which particles never meet, as the rows (size + 1,) and columns of a sparse matrix; columns from `size` on are hulls.

    They share a stick, belong to one body and are nearer at rest than their radii reach (P22), or are so by an attachment.
    """
    pairs = [attached.reshape(-1, 2), *joined(bodies, numbering, size, attached)]
    for body, index in zip(bodies, numbering.bodies, strict=True):
        if not body.shape.rigid:
            never = np.concatenate([body.shape.sticks, near_at_rest(body.shape)])
            pairs.append(index[:, never].reshape(-1, 2))
    found = np.concatenate(pairs)
    here, there = np.concatenate([found, found[:, ::-1]]).T
    width = max(size, int(there.max(initial=0)) + 1)
    both = np.unique((here * width + there)[here < size])
    return np.searchsorted(both, width * np.arange(size + 1)), both % width


def joined(bodies: list[Body], numbering: Numbering, size: int, attached: Integers) -> Iterator[Integers]:
    """Pairs (A, 2) of particles, and of particles and hulls, numbered from n on, that no motion of attached bodies parts.

    Where particle i of one is held at j of another, what is at rest at r from i and at s from j is never farther apart than
    r + s: it overlaps for ever if its radii reach that far. So do a particle and a hull that reaches to j, or beyond it.
    """
    hulls = np.cumsum([size, *(body.copies * len(hulls_of(body.shape)) for body in bodies)])
    for i, j in [*attached, *attached[:, ::-1]]:
        (a, p), (b, q) = (owner(numbering, k) for k in (i, j))
        one, other = bodies[a].shape, bodies[b].shape
        reach = one.radius + other.radius
        if one.rigid or (i > j and not other.rigid):
            continue
        beside, own = np.linalg.norm(one.positions - one.positions[p[1]], axis=1), numbering.bodies[a][p[0]]
        if other.rigid:
            parts = hulls_of(other)
            for m, hull in enumerate(parts):
                outside = hull_clearance(*surface_of(other.positions, hull), other.positions[q[1]][None])[0]
                never = np.flatnonzero((beside + outside < reach) | (beside == 0))
                yield np.stack([own[never], np.full(len(never), hulls[b] + q[0] * len(parts) + m)], axis=1)
        else:
            beyond, its = np.linalg.norm(other.positions - other.positions[q[1]], axis=1), numbering.bodies[b][q[0]]
            near, far = np.flatnonzero(beside < reach), np.flatnonzero(beyond < reach)
            row, column = np.nonzero(beside[near, None] + beyond[far] < reach)
            yield np.stack([own[near[row]], its[far[column]]], axis=1)


def owner(numbering: Numbering, k: int) -> tuple[int, Integers]:
    """The body that particle k belongs to, its copy and its number there."""
    return next((b, np.argwhere(index == k)[0]) for b, index in enumerate(numbering.bodies) if (index == k).any())


def near_at_rest(shape: Shape) -> Integers:
    """Pairs (A, 2) of particles whose spheres overlap at rest."""
    if shape.radius == 0:
        return np.zeros((0, 2), np.int64)
    place = shape.positions
    if len(place) <= FEW:
        pairs = np.stack(np.triu_indices(len(place), 1), axis=1)
    else:
        from scipy.spatial import cKDTree  # imported here: it takes time, and only many particles call for it

        pairs = cKDTree(place).query_pairs(2 * shape.radius, output_type="ndarray")
    distance = np.linalg.norm(place[pairs[:, 1]] - place[pairs[:, 0]], axis=1)
    return np.asarray(pairs[distance < 2 * shape.radius], np.int64)


def wrapped_of(bodies: list[Body], numbering: Numbering) -> Wrapped | None:
    """Trees over the surface triangles of all copies of rigid bodies, in scene order; None without such bodies.

    Leaves are the triangles, numbered copy by copy; the points are the particles.
    """
    return wrapped(list(surfaces(bodies, numbering)))


def surfaces(bodies: list[Body], numbering: Numbering) -> Iterator[tuple[Floats, list[Integers], Integers]]:
    """Of each rigid body: rest positions, particles of each triangle, and inner indices (K, P) of its copies."""
    for body, index in zip(bodies, numbering.bodies, strict=True):
        if body.shape.rigid and len(body.shape.triangles):
            yield body.shape.positions, list(body.shape.triangles), index


def wrapped(things: Sequence[tuple[Floats, Sequence[Integers], Integers]]) -> Wrapped | None:
    """Trees over things that move rigidly: points at rest (P, 3), the points of each leaf, the columns (K, P) of its copies."""
    skips, leaves, supports, nodes = [], [], [], [0]
    start = leaf_start = 0
    for points, parts, columns in things:
        tree = halved(np.array([points[part].mean(axis=0) for part in parts]))
        support = node_support(tree, points, parts)
        for own in columns:
            skips.append(tree.skip + start)
            leaves.append(np.where(tree.leaf < 0, -1, tree.leaf + leaf_start))
            supports.append(own[support])
            start, leaf_start = start + len(tree.skip), leaf_start + len(parts)
            nodes.append(start)
    if not skips:
        return None
    return Wrapped(gate(nodes, np.int64), gate(np.concatenate(skips), np.int64), gate(np.concatenate(leaves), np.int64),
                   gate(np.concatenate(supports), np.int64), gate(np.zeros((start, 4)), np.float64),
                   gate(np.full(start, -1), np.int64), gate(np.zeros(1), np.int64))


def node_support(tree: Tree, points: Floats, parts: Sequence[Integers]) -> Integers:
    """(M, 4) support of the smallest sphere about all points below each node."""
    order = tree.leaf[tree.leaf >= 0]                   # leaves as they stand in preorder: those below a node are neighbours
    rank: Integers = np.cumsum(tree.leaf >= 0) - (tree.leaf >= 0)       # leaves before a node
    members = np.concatenate([parts[leaf] for leaf in order])
    first = np.cumsum([0, *(len(parts[leaf]) for leaf in order)])
    below = (tree.skip - np.arange(len(tree.skip)) + 1) // 2            # leaves of 2 s - 1 nodes
    return smallest_spheres(points, members, first[rank], first[rank + below] - first[rank])[2]


def stack_of(*forests: Layered | Wrapped | Pieces | None) -> Stack:
    """Room for any descent of two trees, or of one against itself: at most two pairs a level are left for later.

    Depths are at most 2 log2 of the number of leaves, so four times the bits of the number of nodes is enough.
    """
    nodes = max((len(forest.skip) for forest in forests if forest is not None), default=1)
    size = 4 * nodes.bit_length() + 4
    return Stack(gate(np.zeros(size), np.int64), gate(np.zeros(size), np.int64))


def candidates_of(capacity: int = FIRST_ROOM) -> Candidates:
    """Room for so many pairs, none looked for yet."""
    return Candidates(gate([-1], np.int64), gate(np.zeros(capacity), np.int64), gate(np.zeros(capacity), np.int64))


def spheres_of(layered: Layered, margin: float, capacity: int = FIRST_ROOM) -> Spheres:
    """Contacts between the particles of these trees, none looked for yet; `margin` in m."""
    soft, real = np.zeros(len(layered.radius)), layered.radius.dtype
    soft[layered.particle[layered.leaf]] = 1
    return Spheres(candidates_of(capacity), gate(np.zeros((3, len(soft))), real), gate(soft, real), margin, layered.radius,
                   gate(np.zeros(capacity), np.float64), gate(np.zeros(capacity), np.float64))
