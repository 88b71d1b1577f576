"""Sphere trees: update and traversal (paper, 5.2). Every pair nearer than the margin is found, and found once.

Spheres of inner nodes are rounded up, leaves compare exact distances: what is listed is what all pairs would give.

In a flat cloth neighbours are near everywhere. So whole parts are passed over, alone or two together, where bounds on
their edges prove that no two of their particles that may meet are within reach (physics/flatness.py). Two parts may be
taken together if their rectangles touch, at a side or at a corner: then a path without a turn back joins any two of their
particles by edges that one of the parts owns, as a particle owns both its edges along j and that to the next i. The proof
assumes nothing about the cloth's shape, so what is listed does not depend on it.
"""

import math

import numpy as np

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.physics.enclosing import sphere_of_four, sphere_of_spheres
from verlet_numba.physics.flatness import unfolded

ROUNDING = 4e-15            # of the radius and the coordinates: by how much an inner sphere is enlarged
SUPPORT = 1.0 + 1e-9        # times the radius through support points, which rounding moves one against another
SLACK = 1.0 + 1e-9          # times the reach, before a part is passed over


@kernel
def update_layered(position, layered):
    """Spheres of all nodes and bounds on the edges of cloth, from the leaves up, in O(n) (P16)."""
    if layered is None:
        return
    update_spheres(position, layered.radius, layered.skip, layered.particle, layered.leaf, layered.inner, layered.sphere)
    update_bounds(layered.skip, layered.sphere, layered.row, layered.node, layered.start, layered.ends, layered.bound)


@kernel
def update_spheres(position, radius, skip, particle, leaf, inner, sphere):
    """Spheres of leaves, then those about two children each. Nodes of one level do not wait for each other."""
    x, y, z = position[0], position[1], position[2]
    for k in leaf:
        p = particle[k]
        sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = x[p], y[p], z[p], radius[p]
    for k in inner:
        a, b = k + 1, skip[k + 1]
        cx, cy, cz, r = sphere_of_spheres(sphere[a, 0], sphere[a, 1], sphere[a, 2], sphere[a, 3],
                                          sphere[b, 0], sphere[b, 1], sphere[b, 2], sphere[b, 3])
        r += ROUNDING * (r + abs(cx) + abs(cy) + abs(cz))
        sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = cx, cy, cz, r


@kernel
def update_bounds(skip, sphere, row, node, start, ends, bound):
    """Bounds on the edges of all rows, from the last to the first: of listed edges, or of two children together."""
    for r in range(node.size - 1, -1, -1):
        if start[2 * r] < start[2 * r + 2]:
            for way in range(2):
                lx, ly, lz, hx, hy, hz = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
                for e in range(start[2 * r + way], start[2 * r + way + 1]):
                    p, q = ends[0, e], ends[1, e]
                    dx, dy, dz = sphere[q, 0] - sphere[p, 0], sphere[q, 1] - sphere[p, 1], sphere[q, 2] - sphere[p, 2]
                    lx, ly, lz, hx, hy, hz = min(lx, dx), min(ly, dy), min(lz, dz), max(hx, dx), max(hy, dy), max(hz, dz)
                c = 3 * way
                bound[r, c], bound[r, c + 1], bound[r, c + 2] = lx, ly, lz
                bound[r, c + 6], bound[r, c + 7], bound[r, c + 8] = hx, hy, hz
        else:
            a, b = row[node[r] + 1], row[skip[node[r] + 1]]
            for c in range(6):
                bound[r, c] = min(bound[a, c], bound[b, c])
                bound[r, 6 + c] = max(bound[a, 6 + c], bound[b, 6 + c])


@formula
def overlap(ax, ay, az, a, bx, by, bz, b, margin):
    """Whether two spheres are nearer than the margin."""
    x, y, z, reach = ax - bx, ay - by, az - bz, a + b + margin
    return x * x + y * y + z * z < reach * reach


@inlined
def never(apart, partner, p, q):
    """Whether particle p never meets q: a particle, or a rigid leaf numbered after all particles."""
    found = False
    for m in range(apart[p], apart[p + 1]):
        found |= partner[m] == q
    return found


@kernel
def list_pairs(layered, inverse_mass, margin, itself, stack, candidates):
    """List the pairs of particles nearer than the margin, of any two trees and, if `itself`, of each against itself (P17).

    Pairs that never meet and pairs of two that cannot move are left out. False: no room (grow and call again).
    """
    if layered is None:
        return True
    root, skip, particle, sphere = layered.root, layered.skip, layered.particle, layered.sphere
    row, rectangle, bound, lattice = layered.row, layered.rectangle, layered.bound, layered.lattice
    apart, partner, one, two = layered.apart, layered.partner, candidates.first, candidates.second
    first, second = stack.first, stack.second
    listed = 0
    for t in range(root.size - 1):
        for u in range(t if itself else t + 1, root.size - 1):
            k, l = root[t], root[u]
            if not overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                           sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], margin):
                continue
            ratio = (2.0 * lattice[t, 3] + margin) * SLACK / lattice[t, 2]
            listed = descend(k, l, skip, particle, sphere, row, rectangle, bound, lattice[t, 0], lattice[t, 1], ratio,
                             apart, partner, inverse_mass, margin, first, second, one, two, listed)
            if listed == NO_ROOM:
                candidates.listed[0] = NO_ROOM
                return False
    candidates.listed[0] = listed
    return True


@kernel
def descend(top, other, skip, particle, sphere, row, rectangle, bound, a, b, ratio, apart, partner, inverse_mass, margin,
            first, second, one, two, listed):
    """List the pairs of the trees below two nodes, or below one and the same; the new number of pairs, or NO_ROOM.

    a and b are the lattice's spacings, `ratio` as in `unfolded`: rectangles mean nothing between two trees.
    """
    alone = top == other
    first[0], second[0], height = top, other, 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if k == l:
            r = row[k]
            if skip[k] == k + 1 or (r >= 0 and unfolded(
                    bound[r, 0], bound[r, 1], bound[r, 2], bound[r, 3], bound[r, 4], bound[r, 5],
                    bound[r, 6], bound[r, 7], bound[r, 8], bound[r, 9], bound[r, 10], bound[r, 11], a, b, ratio)):
                continue
            height = visit_halves(first, second, height, k + 1, skip[k + 1])
            continue
        if not overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                       sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], margin):
            continue
        p, q, r, s = particle[k], particle[l], row[k], row[l]
        if p >= 0 and q >= 0:
            if never(apart, partner, p, q) or not inverse_mass[p] + inverse_mass[q] > 0.0:
                continue
            if listed == one.size:
                return NO_ROOM
            one[listed], two[listed] = min(p, q), max(p, q)
            listed += 1
            continue
        if (alone and r >= 0 and s >= 0 and rectangle[r, 0] <= rectangle[s, 1] + 1 and rectangle[s, 0] <= rectangle[r, 1] + 1
                and rectangle[r, 2] <= rectangle[s, 3] + 1 and rectangle[s, 2] <= rectangle[r, 3] + 1 and unfolded(
                    min(bound[r, 0], bound[s, 0]), min(bound[r, 1], bound[s, 1]), min(bound[r, 2], bound[s, 2]),
                    min(bound[r, 3], bound[s, 3]), min(bound[r, 4], bound[s, 4]), min(bound[r, 5], bound[s, 5]),
                    max(bound[r, 6], bound[s, 6]), max(bound[r, 7], bound[s, 7]), max(bound[r, 8], bound[s, 8]),
                    max(bound[r, 9], bound[s, 9]), max(bound[r, 10], bound[s, 10]), max(bound[r, 11], bound[s, 11]),
                    a, b, ratio)):
            continue
        if q >= 0 or (p < 0 and sphere[k, 3] >= sphere[l, 3]):
            first[height], second[height] = skip[k + 1], l
            first[height + 1], second[height + 1] = k + 1, l
        else:
            first[height], second[height] = k, skip[l + 1]
            first[height + 1], second[height + 1] = k, l + 1
        height += 2
    return listed


@inlined
def visit_halves(first, second, height, c, d):
    """Put the two halves of a node on the stack, each with itself and both with each other; the new height."""
    first[height], second[height] = c, c
    first[height + 1], second[height + 1] = d, d
    first[height + 2], second[height + 2] = c, d
    return height + 3


@kernel
def expire(wrapped):
    """The points have moved: every sphere is computed anew when it is visited next."""
    if wrapped is None:
        return
    wrapped.now[0] += 1


@inlined
def update_wrapped(points, support, sphere, k):
    """The sphere of node k from its support points, in O(1) (P15)."""
    a, b, c, d = support[k, 0], support[k, 1], support[k, 2], support[k, 3]
    x, y, z, squared, _ = sphere_of_four(
        np.float64(points[0, a]), np.float64(points[1, a]), np.float64(points[2, a]),
        np.float64(points[0, b]), np.float64(points[1, b]), np.float64(points[2, b]),
        np.float64(points[0, c]), np.float64(points[1, c]), np.float64(points[2, c]),
        np.float64(points[0, d]), np.float64(points[1, d]), np.float64(points[2, d]))
    r = math.sqrt(squared) * SUPPORT
    sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = x, y, z, r + ROUNDING * (r + abs(x) + abs(y) + abs(z))


@kernel
def list_against(layered, points, wrapped, margin, stack, candidates):
    """List the particles of deformable bodies with the rigid leaves that they may be near (P17).

    None is missed that is nearer than the margin to what the leaf's points span, unless the two never meet; all are that near
    to the leaf's sphere, and to those above it. `points` are what the wrapped trees are about. False: no room (grow and call
    again).
    """
    if layered is None or wrapped is None:
        return True
    root, skip, particle, sphere = layered.root, layered.skip, layered.particle, layered.sphere
    roots, skips, leaf, support = wrapped.root, wrapped.skip, wrapped.leaf, wrapped.support
    spheres, stamp, now, apart, partner = wrapped.sphere, wrapped.stamp, wrapped.now[0], layered.apart, layered.partner
    one, two, first, second = candidates.first, candidates.second, stack.first, stack.second
    listed = 0
    for t in range(root.size - 1):
        for u in range(roots.size - 1):
            listed = descend_wrapped(root[t], roots[u], skip, particle, sphere, skips, leaf, support, spheres, stamp, now, points,
                                     apart, partner, margin, first, second, one, two, listed)
            if listed == NO_ROOM:
                candidates.listed[0] = NO_ROOM
                return False
    candidates.listed[0] = listed
    return True


@kernel
def descend_wrapped(top, other, skip, particle, sphere, skips, leaf, support, spheres, stamp, now, points, apart, partner,
                    margin, first, second, one, two, listed):
    """List the pairs of a layered and a wrapped tree; the new number of pairs, or NO_ROOM."""
    first[0], second[0], height = top, other, 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if stamp[l] != now:
            stamp[l] = now
            update_wrapped(points, support, spheres, l)
        if overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                   spheres[l, 0], spheres[l, 1], spheres[l, 2], spheres[l, 3], margin):
            if particle[k] >= 0 and leaf[l] >= 0:
                if never(apart, partner, particle[k], apart.size - 1 + leaf[l]):
                    continue
                if listed == one.size:
                    return NO_ROOM
                one[listed], two[listed] = particle[k], leaf[l]
                listed += 1
            elif leaf[l] >= 0 or (particle[k] < 0 and sphere[k, 3] >= spheres[l, 3]):
                first[height], second[height] = k + 1, l
                first[height + 1], second[height + 1] = skip[k + 1], l
                height += 2
            else:
                first[height], second[height] = k, l + 1
                first[height + 1], second[height + 1] = k, skips[l + 1]
                height += 2
    return listed
