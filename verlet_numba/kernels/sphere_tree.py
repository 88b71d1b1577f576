"""Sphere trees: update and traversal (paper, 5.2). Every pair nearer than the margin is found, none is found twice.

Spheres of inner nodes are rounded up, leaves compare exact distances: what is listed is what all pairs would give.

A cloth against itself: neighbours in a flat sheet are always near. Whole parts are passed over if the bounds on their
edges prove that no two of their particles that may meet are within reach (physics/flatness.py). Two parts are passed
over together if their rectangles touch, at a side or at a corner: then a path without a turn back joins any two of their
particles along edges that one of them owns, since a particle owns both its edges along j and the one to the next i. That
proves what it needs, so what is listed does not depend on it.
"""

import math

import numpy as np

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.physics.enclosing import sphere_of_four, sphere_of_spheres
from verlet_numba.physics.flatness import unfolded

ROUNDING = 4e-16            # of the radius and the coordinates: by how much an inner sphere is enlarged
SUPPORT = 1.0 + 1e-9        # times the radius through support points, which rounding moves one against another
import os
SMALL = int(os.environ.get('SMALL', 7))
LEAST = int(os.environ.get('LEAST', 9))
SLACK = 1.0 + 1e-9          # times the reach, before a part is passed over


@kernel
def update_layered(position, layered):
    """Spheres of all nodes and bounds on the edges of cloth, from the leaves up, in O(n) (P16)."""
    if layered is None:
        return
    root, skip, particle, sphere, radius = layered.root, layered.skip, layered.particle, layered.sphere, layered.radius
    ends, bound, lattice = layered.ends, layered.bound, layered.lattice
    x, y, z = position[0], position[1], position[2]
    for t in range(root.size - 1):
        update_spheres(x, y, z, radius, skip, particle, sphere, root[t], root[t + 1])
        if lattice[t, 2] > 0.0:
            update_bounds(skip, sphere, ends, bound, root[t], root[t + 1])


@kernel
def update_spheres(x, y, z, radius, skip, particle, sphere, first, last):
    """Spheres of the nodes first to last: of leaves those of their particles, else those about their two children."""
    for k in range(last - 1, first - 1, -1):
        p = particle[k]
        if p >= 0:
            cx, cy, cz, r = np.float64(x[p]), np.float64(y[p]), np.float64(z[p]), np.float64(radius[p])
        else:
            a, b = k + 1, skip[k + 1]
            cx, cy, cz, r = sphere_of_spheres(sphere[a, 0], sphere[a, 1], sphere[a, 2], sphere[a, 3],
                                              sphere[b, 0], sphere[b, 1], sphere[b, 2], sphere[b, 3])
            r += ROUNDING * (r + abs(cx) + abs(cy) + abs(cz))
        sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3] = cx, cy, cz, r


@kernel
def update_bounds(skip, sphere, ends, bound, first, last):
    """Bounds on the edges below the nodes first to last of a cloth's tree."""
    for k in range(last - 1, first - 1, -1):
        a, b = k + 1, skip[k + 1]
        if skip[k] > a:
            for c in range(12):
                bound[k, c] = min(bound[a, c], bound[b, c])
        else:
            p, q, r, s, t, u = ends[k, 0], ends[k, 1], ends[k, 2], ends[k, 3], ends[k, 4], ends[k, 5]
            for c in range(3):
                along, before, after = sphere[q, c] - sphere[p, c], sphere[s, c] - sphere[r, c], sphere[u, c] - sphere[t, c]
                bound[k, c], bound[k, 3 + c] = along, min(before, after)
                bound[k, 6 + c], bound[k, 9 + c] = -along, min(-before, -after)


@formula
def overlap(ax, ay, az, a, bx, by, bz, b, margin):
    """Whether two spheres are nearer than the margin."""
    x, y, z, reach = ax - bx, ay - by, az - bz, a + b + margin
    return x * x + y * y + z * z < reach * reach


@kernel
def list_pairs(layered, inverse_mass, margin, itself, stack, candidates):
    """List the pairs of particles nearer than the margin, of any two trees and, if `itself`, of each against itself (P17).

    Pairs that never meet and pairs of two that cannot move are left out. False: no room (grow and call again).
    """
    if layered is None:
        return True
    root, skip, particle, sphere = layered.root, layered.skip, layered.particle, layered.sphere
    rectangle, bound, lattice = layered.rectangle, layered.bound, layered.lattice
    apart, partner, one, two = layered.apart, layered.partner, candidates.first, candidates.second
    first, second = stack.first, stack.second
    listed = 0
    for t in range(root.size - 1):
        if itself:
            reach = (2.0 * largest(layered.radius, particle, root[t], root[t + 1]) + margin) * SLACK
            listed = descend_itself(root[t], skip, particle, sphere, rectangle, bound, lattice[t, 0], lattice[t, 1],
                                    lattice[t, 2], reach, apart, partner, inverse_mass, margin, first, second, one, two, listed)
        for u in range(t + 1, root.size - 1):
            if listed >= 0:
                listed = descend(root[t], root[u], skip, particle, sphere, apart, partner, inverse_mass, margin,
                                 first, second, one, two, listed)
        if listed < 0:
            return False
    candidates.listed[0] = listed
    return True


@kernel
def largest(radius, particle, first, last):
    """The largest radius of the leaves in the nodes first to last."""
    found = 0.0
    for k in range(first, last):
        if particle[k] >= 0:
            found = max(found, np.float64(radius[particle[k]]))
    return found


@kernel
def descend_itself(top, skip, particle, sphere, rectangle, bound, a, b, closest, reach, apart, partner, inverse_mass, margin,
                   first, second, one, two, listed):
    """List the pairs within the tree below `top`; the new number of pairs, -1: no room."""
    ratio = reach / closest         # infinite where there is no lattice
    cloth = closest > 0.0
    first[0], second[0], height = top, top, 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if k == l:
            if skip[k] == k + 1:
                continue
            if cloth and skip[k] - k >= LEAST and unfolded(
                    bound[k, 0], bound[k, 1], bound[k, 2], bound[k, 3], bound[k, 4], bound[k, 5],
                    bound[k, 6], bound[k, 7], bound[k, 8], bound[k, 9], bound[k, 10], bound[k, 11], a, b, ratio):
                continue
            c, d = k + 1, skip[k + 1]
            first[height], second[height] = c, c
            first[height + 1], second[height + 1] = d, d
            first[height + 2], second[height + 2] = c, d
            height += 3
            continue
        if not overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                       sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], margin):
            continue
        p, q = particle[k], particle[l]
        if p >= 0 and q >= 0:
            if not inverse_mass[p] + inverse_mass[q] > 0.0:
                continue
            never = 0
            for m in range(apart[p], apart[p + 1]):
                never += partner[m] == q
            if never:
                continue
            if listed == one.size:
                return -1
            one[listed], two[listed] = min(p, q), max(p, q)
            listed += 1
            continue
        if (cloth and skip[k] - k >= LEAST and skip[l] - l >= LEAST
                and rectangle[k, 0] <= rectangle[l, 1] + 1 and rectangle[l, 0] <= rectangle[k, 1] + 1
                and rectangle[k, 2] <= rectangle[l, 3] + 1 and rectangle[l, 2] <= rectangle[k, 3] + 1
                and unfolded(min(bound[k, 0], bound[l, 0]), min(bound[k, 1], bound[l, 1]), min(bound[k, 2], bound[l, 2]),
                             min(bound[k, 3], bound[l, 3]), min(bound[k, 4], bound[l, 4]), min(bound[k, 5], bound[l, 5]),
                             min(bound[k, 6], bound[l, 6]), min(bound[k, 7], bound[l, 7]), min(bound[k, 8], bound[l, 8]),
                             min(bound[k, 9], bound[l, 9]), min(bound[k, 10], bound[l, 10]), min(bound[k, 11], bound[l, 11]),
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


@kernel
def descend(top, other, skip, particle, sphere, apart, partner, inverse_mass, margin, first, second, one, two, listed):
    """List the pairs between the trees below two nodes; the new number of pairs, -1: no room."""
    first[0], second[0], height = top, other, 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if not overlap(sphere[k, 0], sphere[k, 1], sphere[k, 2], sphere[k, 3],
                       sphere[l, 0], sphere[l, 1], sphere[l, 2], sphere[l, 3], margin):
            continue
        p, q = particle[k], particle[l]
        if p >= 0 and q >= 0:
            never = 0
            for m in range(apart[p], apart[p + 1]):
                never += partner[m] == q
            if never or not inverse_mass[p] + inverse_mass[q] > 0.0:
                continue
            if listed == one.size:
                return -1
            one[listed], two[listed] = min(p, q), max(p, q)
            listed += 1
        elif q >= 0 or (p < 0 and sphere[k, 3] >= sphere[l, 3]):
            first[height], second[height] = skip[k + 1], l
            first[height + 1], second[height + 1] = k + 1, l
            height += 2
        else:
            first[height], second[height] = k, skip[l + 1]
            first[height + 1], second[height + 1] = k, l + 1
            height += 2
    return listed


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
    """List the particles of deformable bodies nearer than the margin to the sphere of a rigid leaf (P17).

    `points` are what the wrapped trees are about. False: no room (grow and call again).
    """
    if layered is None or wrapped is None:
        return True
    root, skip, particle, sphere = layered.root, layered.skip, layered.particle, layered.sphere
    roots, skips, leaf, support = wrapped.root, wrapped.skip, wrapped.leaf, wrapped.support
    spheres, stamp, now = wrapped.sphere, wrapped.stamp, wrapped.now[0]
    one, two, first, second = candidates.first, candidates.second, stack.first, stack.second
    listed = 0
    for t in range(root.size - 1):
        for u in range(roots.size - 1):
            listed = descend_wrapped(root[t], roots[u], skip, particle, sphere, skips, leaf, support, spheres, stamp, now, points,
                                     margin, first, second, one, two, listed)
            if listed < 0:
                return False
    candidates.listed[0] = listed
    return True


@kernel
def descend_wrapped(top, other, skip, particle, sphere, skips, leaf, support, spheres, stamp, now, points, margin,
                    first, second, one, two, listed):
    """List the pairs of a layered and a wrapped tree; the new number of pairs, -1: no room."""
    first[0], second[0], height = top, other, 1
    while height > 0:
        height -= 1
        k, l = first[height], second[height]
        if stamp[l] != now:
            stamp[l] = now
            update_wrapped(points, support, spheres, l)
        if near(sphere, k, spheres, l, margin):
            if particle[k] >= 0 and leaf[l] >= 0:
                if listed == one.size:
                    return -1
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
