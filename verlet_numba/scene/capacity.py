"""Empty buffers with room for contacts, and the same buffers with more: contacts outgrow their room, the run goes on.

A kernel that finds a list too short writes NO_ROOM as its number; twice the room is made for that list alone.
"""

from typing import TypeVar

import numpy as np

from verlet_numba.buffers.arrays import NO_ROOM, Array, gate
from verlet_numba.buffers.contact import Contacts
from verlet_numba.buffers.exact import Exact
from verlet_numba.buffers.hulls import POINTS, Beside, Hulls, Manifold, Meet, Meetings, Mixed, Narrow, Pairs, Search
from verlet_numba.buffers.trees import Spheres
from verlet_numba.buffers.world import Effects
from verlet_numba.scene.colliders import room
from verlet_numba.scene.exact import roomier_exact
from verlet_numba.scene.rigid import touches_of, with_room
from verlet_numba.scene.sphere_trees import candidates_of

POLYTOPE = 128              # vertices of a hulls' difference that the search for a hit face may use
GRIDS, CELLS = 48, 64       # of the search for pairs: grids, and the fewest cells of one
POINTS_A_PAIR = 64          # of a manifold in the making
MOST_PAIRS = 1 << 16        # that are listed at most, and as many more for each hull, for each particle of deformable bodies:
PAIRS_A_HULL, PAIRS_A_PARTICLE = 16, 256
Listed = TypeVar("Listed", Pairs, Meetings)


class CrowdedError(Exception):
    """So much is near each other that their pairs are too many to list."""


def whole(*shape: int) -> Array:
    return gate(np.zeros(shape), np.int64)


def real(*shape: int) -> Array:
    return gate(np.zeros(shape), np.float64)


def pairs_of(room: int) -> Pairs:
    """Room for so many pairs."""
    return Pairs(whole(1), whole(room), whole(room), real(3, room), whole(6, room), real(room), whole(room),
                 real(room, 4 * POINTS), real(room), whole(room))


def meetings_of(room: int) -> Meetings:
    """Room for so many meetings."""
    return Meetings(whole(1), whole(room), whole(6, room), real(6, room), real(3, room), real(room), real(room),
                    real(2, room))


def search_of(hulls: int, room: int) -> Search:
    """The search for pairs among so many hulls, with room for so many pairs; no list has been made."""
    return Search(whole(1), real(3, hulls), real(hulls), real(2, 3, hulls), whole(1), real(hulls), whole(hulls), whole(hulls),
                  real(GRIDS), whole(4, GRIDS), whole(4 * hulls + GRIDS * (CELLS + 4) + 2), real(2 * hulls, 4), whole(2 * hulls),
                  whole(room))


def narrow_of(hulls: Hulls) -> Narrow:
    """Scratch of the narrow phase of these hulls."""
    faces, corners = 2 * POLYTOPE - 4, int(hulls.size.max(initial=0))
    return Narrow(real(3, POLYTOPE), whole(2, POLYTOPE), real(4), whole(3, faces), whole(3, faces), real(4, faces),
                  whole(faces), whole(3 * faces + 3), whole(3 * faces + 3), whole(2 * corners + 1))


def beside_of(narrow: Narrow, chunks: int) -> Beside:
    """The same for every chunk of pairs."""
    copies = {name: gate(np.zeros((chunks, *array.shape)), array.dtype) for name, array in narrow._asdict().items()}
    return Beside(**copies, found=whole(chunks))


def manifold_of(corners: int, room: int) -> Manifold:
    """Scratch of manifolds of hulls of at most so many corners, with room for so many meetings."""
    return Manifold(whole(room), whole(6, room), real(6, room), real(room), whole(corners), real(4, corners), whole(2, 16),
                    real(2, 2, 16), real(2, 16, 16), real(3, POINTS_A_PAIR), whole(6, POINTS_A_PAIR), real(6, POINTS_A_PAIR),
                    whole(POINTS_A_PAIR), real(POINTS_A_PAIR))


def roomier(effects: Effects) -> Effects:
    """The same effects with twice the room for each list that had too little; the others, and what pairs learnt, stay.

    Raises CrowdedError where that would take more pairs than are listed at most.
    """
    effects = effects._replace(contact=_roomier_contacts(effects.contact), meet=_roomier_meet(effects.meet),
                               spheres=_roomier_spheres(effects.spheres), mixed=_roomier_mixed(effects.mixed),
                               exact=_roomier_exact(effects.exact), rapid=_roomier_exact(effects.rapid))
    contact, meet, mixed, rigid, restitution = effects.contact, effects.meet, effects.mixed, effects.rigid, effects.restitution
    if contact is not None and restitution is not None and restitution.rebound.size < contact.particle.size:
        effects = effects._replace(restitution=restitution._replace(rebound=real(contact.particle.size)))
    touching = sum(each.size for each in (contact and contact.particle, meet and meet.meetings.pair, mixed and mixed.meetings.pair)
                   if each is not None)
    if rigid is not None and effects.touches is not None and effects.touches.first.size < touching:
        rigid = with_room(rigid, touching + 1)
        effects = effects._replace(rigid=rigid, touches=touches_of(touching, rigid.size.size))
    return effects


def _lacks_room(listed: Array) -> bool:
    return bool(listed[0] == NO_ROOM)


def _twice(room: int, things: int, each: int, what: str) -> int:
    """Twice the room, unless it is enough for MOST_PAIRS, and `each` more a thing."""
    if room > MOST_PAIRS + each * things:
        raise CrowdedError(f"more than {room:,} pairs of {things:,} {what} touch: they stand in each other; give them more room")
    return 2 * room


def _roomier_contacts(contact: Contacts | None) -> Contacts | None:
    if contact is None or not _lacks_room(contact.listed):
        return contact
    contact.listed[0] = 0
    particle, solid, normal, bound, anchor, push, memory = room(2 * contact.particle.size)
    return contact._replace(particle=particle, solid=solid, normal=normal, bound=bound, anchor=anchor, push=push, memory=memory)


def _roomier_meet(meet: Meet | None) -> Meet | None:
    if meet is None:
        return None
    if _lacks_room(meet.spare.listed):
        capacity = _twice(meet.spare.first.size, meet.still.size, PAIRS_A_HULL, "bodies and colliders")
        meet = meet._replace(pairs=copied(meet.pairs, pairs_of(capacity)), spare=pairs_of(capacity),
                             search=meet.search._replace(code=whole(capacity)))
    if _lacks_room(meet.meetings.listed):
        capacity = 2 * meet.meetings.pair.size
        manifold = None if meet.manifold is None else manifold_of(meet.manifold.near.size, capacity)
        meet.meetings.listed[0] = 0
        meet = meet._replace(meetings=copied(meet.meetings, meetings_of(capacity)), manifold=manifold)
    return meet


def _roomier_spheres(spheres: Spheres | None) -> Spheres | None:
    if spheres is None or not _lacks_room(spheres.candidates.listed):
        return spheres
    capacity = _twice(spheres.push.size, spheres.soft.size, PAIRS_A_PARTICLE, "particles")
    return spheres._replace(candidates=candidates_of(capacity), push=real(capacity), standing=real(capacity))


def _roomier_mixed(mixed: Mixed | None) -> Mixed | None:
    if mixed is None:
        return None
    if _lacks_room(mixed.candidates.listed):
        capacity = _twice(mixed.candidates.first.size, mixed.hull.size, PAIRS_A_PARTICLE, "particles")
        mixed = mixed._replace(candidates=candidates_of(capacity), pairs=copied(mixed.pairs, pairs_of(capacity)),
                               spare=pairs_of(capacity))
    if _lacks_room(mixed.meetings.listed):
        mixed = mixed._replace(meetings=meetings_of(2 * mixed.meetings.pair.size))
    return mixed


def _roomier_exact(exact: Exact | None) -> Exact | None:
    if exact is None:
        return None
    points, lists = len(exact.points.free), [each.left for each in (exact.among, exact.against) if each is not None]
    longest = max(map(len, [exact.gaps.gap, *lists]))
    if longest > MOST_PAIRS + PAIRS_A_PARTICLE * points:
        raise CrowdedError(f"more than {longest:,} pairs of features about {points:,} points are near each other: what they belong "
                           "to stands in each other or has burst; use more substeps or more room")
    return roomier_exact(exact)


def copied(smaller: Listed, larger: Listed) -> Listed:
    """The larger list, with what stands in the smaller one."""
    for old, new in zip(smaller, larger, strict=True):
        new[tuple(map(slice, old.shape))] = old
    return larger
