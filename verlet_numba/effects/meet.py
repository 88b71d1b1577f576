"""Rigid bodies meet each other and colliders: candidate pairs, GJK, contact points (paper, 5.1)."""

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.contact import pose_of
from verlet_numba.effects.features import point_of
from verlet_numba.kernels.candidates import FULL, refresh
from verlet_numba.kernels.internal_edges import straighten
from verlet_numba.kernels.manifold import widen
from verlet_numba.kernels.narrow import collide, gather_hulls
from verlet_numba.kernels.narrow_beside import collide_beside
from verlet_numba.physics.pose import outward


@kernel
def gather(position, hulls, meet):
    """Bring the corners of all hulls to where their particles are; how they met before is no longer true."""
    if hulls is None:
        return
    gather_hulls(position, hulls)
    part(meet)


@kernel
def part(meet):
    """The pairs of hulls have not met yet."""
    if meet is None:
        return
    meet.met[0] = -1


@kernel
def gather_again(again, position, hulls, rigid):
    """The same before a later pass, for what answers as a whole: features follow their particles by themselves."""
    if hulls is None or rigid is None:
        return
    if again:
        gather_hulls(position, hulls)


@kernel
def move_hulls(hulls, contact, moving):
    """Bring the hulls of colliders that move to where those are."""
    if hulls is None or moving is None:
        return
    x, y, z, local, start, solid = hulls.corner[0], hulls.corner[1], hulls.corner[2], hulls.local, hulls.start, hulls.solid
    origin, rotation = contact.solids.origin, contact.solids.rotation
    for h in range(solid.size):
        if solid[h] >= 0:
            pose = pose_of(origin, rotation, solid[h])
            for q in range(start[h], start[h + 1]):
                px, py, pz = outward(local[0, q], local[1, q], local[2, q], pose)
                x[q], y[q], z[q] = px + pose[0], py + pose[1], pz + pose[2]


@kernel
def find_meetings(hulls, meet, rest):
    """List the contacts of hulls. False: more than there is room for (grow and call again).

    Pairs learn by meeting, so they meet once as the hulls stand, however often this is called.
    """
    if meet is None:
        return True
    horizon, margin = meet.horizon, meet.margin
    if refresh(hulls, meet.still, meet.pairs, meet.spare, meet.search, margin, horizon, meet.all_pairs) == FULL:
        return False
    if meet.met[0] < 0:
        if not collide_awake(hulls, meet, meet.beside, rest):
            return False
        straighten(hulls, meet.pairs, meet.meetings, meet.ridges)
        meet.met[0] = meet.meetings.listed[0]
    meet.meetings.listed[0] = meet.met[0]
    return several(hulls, meet.pairs, meet.meetings, meet.manifold)


@kernel
def collide_awake(hulls, meet, beside, rest):
    """The same of the pairs that are listed; those at rest need not meet each other."""
    if beside is not None:
        return collide_on_threads(hulls, meet, beside, rest)
    if rest is None:
        return collide(hulls, meet.pairs, meet.meetings, meet.narrow, meet.margin, meet.coherent)
    return collide(hulls, meet.pairs, meet.meetings, meet.narrow, meet.margin, meet.coherent, rest.quiet)


@kernel
def collide_on_threads(hulls, meet, beside, rest):
    """The same; two that nothing moves are no pair, so `still` says that none is quiet."""
    if rest is None:
        return collide_beside(hulls, meet.pairs, meet.meetings, beside, meet.margin, meet.still)
    return collide_beside(hulls, meet.pairs, meet.meetings, beside, meet.margin, rest.quiet)


@kernel
def several(hulls, pairs, meetings, manifold):
    """Give each pair of hulls as many contacts as it needs, where the scene calls for that."""
    if manifold is None:
        return True
    return widen(hulls, pairs, meetings, manifold)


@kernel
def depth_of_hulls(position, meet, hulls):
    """How deep hulls penetrate each other at the contact points of the last substep [m], with the particles at `position`."""
    if meet is None:
        return 0.0
    x, y, z = position[0], position[1], position[2]
    corner, weight, normal, pair = meet.meetings.corner, meet.meetings.weight, meet.meetings.normal, meet.meetings.pair
    one, other, corners, particle, rounding = meet.pairs.first, meet.pairs.second, hulls.corner, hulls.particle, hulls.rounding
    deepest = 0.0
    for m in range(meet.meetings.listed[0]):
        reach = rounding[one[pair[m]]] + rounding[other[pair[m]]]
        deepest = max(deepest, reach - distance_of(x, y, z, corners, particle, corner, weight, normal, m))
    return deepest


@inlined
def distance_of(x, y, z, corners, particle, corner, weight, normal, m):
    """The distance of the points of meeting m along its normal [m], with the particles at (x, y, z)."""
    px, py, pz = point_of(x, y, z, corners, particle, corner, weight, m, 0)
    qx, qy, qz = point_of(x, y, z, corners, particle, corner, weight, m, 3)
    return normal[0, m] * (px - qx) + normal[1, m] * (py - qy) + normal[2, m] * (pz - qz)


@kernel
def pushing(touches, features, meet, mixed):
    """The number of contacts of hulls, and of rigid bodies with colliders, that have pushed in this substep."""
    return pushing_touches(touches) + pushing_features(features, meet) + pushing_features(features, mixed)


@kernel
def pushing_touches(touches):
    if touches is None:
        return 0
    pushed = 0
    for t in range(touches.until[-1]):
        pushed += touches.given[t, 0] > 0.0
    return pushed


@kernel
def pushing_features(features, meet):
    if features is None or meet is None:
        return 0
    pushed = 0
    for m in range(meet.meetings.listed[0]):
        pushed += meet.meetings.push[m] > 0.0
    return pushed
