"""Deformable bodies meet each other, themselves and hulls: candidates by sphere trees (paper, 5.2), contacts by leaf spheres.

A particle of a deformable body is a hull of one corner for the narrow phase: it meets a rigid body at the face, edge or
corner that GJK finds, where the paper tests whether the leaf's centre is inside and takes the closest point (P23).
"""

from verlet_numba._jit import kernel
from verlet_numba.kernels.candidates import carry, replace
from verlet_numba.kernels.copying import copy_points
from verlet_numba.kernels.narrow import collide
from verlet_numba.kernels.sphere_candidates import find_spheres, travelled
from verlet_numba.kernels.sphere_tree import expire, list_against, update_layered


@kernel
def find_soft(position, inverse_mass, trees, spheres):
    """List the pairs of deformable particles that may touch. False: no room (grow and call again)."""
    if spheres is None:
        return True
    return find_spheres(position, inverse_mass, trees.layered, trees.itself, trees.stack, spheres)


@kernel
def find_mixed(position, hulls, trees, mixed):
    """List the contacts of deformable particles with hulls. False: no room (grow and call again)."""
    if mixed is None:
        return True
    candidates = mixed.candidates
    if candidates.listed[0] < 0 or 2.0 * travelled(position, mixed.at) > mixed.margin:
        candidates.listed[0] = -1
        expire(trees.wrapped)
        update_layered(position, trees.layered)
        if not list_against(trees.layered, position, trees.wrapped, mixed.margin + mixed.near, trees.stack, candidates):
            return False
        sort_pairs(candidates, mixed.hull, mixed.begin, mixed.spare)
        carry(hulls.centre, mixed.pairs, mixed.spare, mixed.pairs.listed[0], candidates.listed[0])
        replace(mixed.pairs, mixed.spare, candidates.listed[0])
        copy_points(position, mixed.at)
    if mixed.met[0] < 0:
        if not collide(hulls, mixed.pairs, mixed.meetings, mixed.narrow, mixed.near, mixed.coherent):
            return False
        mixed.met[0] = mixed.meetings.listed[0]
    return True


@kernel
def sort_pairs(candidates, hull, begin, pairs):
    """Candidates (particle, hull) as pairs (rigid hull, the particle's hull), ascending: two counting sorts in one.

    Hulls of particles are numbered after all others. Particles are gone through in the order of their hulls' numbers within
    each rigid hull, by inserting: a hull has few particles near it that are out of order.
    """
    first, second, listed = candidates.first, candidates.second, candidates.listed[0]
    begin[:] = 0
    for c in range(listed):
        begin[second[c] + 1] += 1
    for h in range(1, begin.size):
        begin[h] += begin[h - 1]
    for c in range(listed):
        h = second[c]
        pairs.first[begin[h]], pairs.second[begin[h]] = h, hull[first[c]]
        begin[h] += 1
    low = 0
    for h in range(begin.size - 1):
        sort_range(pairs.second, low, begin[h])
        low = begin[h]


@kernel
def sort_range(values, low, high):
    """Sort values[low:high] in place (heap sort: no memory, n log n at worst)."""
    size = high - low
    for root in range(size // 2 - 1, -1, -1):
        sift(values, low, root, size)
    for end in range(size - 1, 0, -1):
        values[low], values[low + end] = values[low + end], values[low]
        sift(values, low, 0, end)


@kernel
def sift(values, low, root, size):
    """Let the value at `root` sink until no child is greater."""
    while 2 * root + 1 < size:
        child = 2 * root + 1
        if child + 1 < size and values[low + child + 1] > values[low + child]:
            child += 1
        if values[low + root] >= values[low + child]:
            return
        values[low + root], values[low + child] = values[low + child], values[low + root]
        root = child
