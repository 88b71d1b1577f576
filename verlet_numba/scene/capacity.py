"""Empty buffers with room for contacts, and the same buffers with more: contacts outgrow their room, the run goes on."""

import numpy as np

from verlet_numba.buffers import POINTS, Array, Effects, Hulls, Manifold, Meetings, Narrow, Pairs, Search, gate
from verlet_numba.scene.colliders import room
from verlet_numba.scene.exact import roomier_exact
from verlet_numba.scene.rigid import touches_of, with_room
from verlet_numba.scene.sphere_trees import candidates_of

POLYTOPE = 128              # vertices of a hulls' difference that the search for a hit face may use
GRIDS, CELLS = 48, 64       # of the search for pairs: grids, and the fewest cells of one
POINTS_A_PAIR = 64          # of a manifold in the making
MOST_PAIRS, PAIRS_A_HULL = 1 << 16, 16      # pairs that are listed at most, and as many more a hull


class CrowdedError(Exception):
    """So many hulls are near each other that their pairs are too many to list."""


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


def manifold_of(corners: int, room: int) -> Manifold:
    """Scratch of manifolds of hulls of at most so many corners, with room for so many meetings."""
    return Manifold(whole(room), whole(6, room), real(6, room), real(room), whole(corners), real(4, corners), whole(2, 16),
                    real(2, 2, 16), real(2, 16, 16), real(3, POINTS_A_PAIR), whole(6, POINTS_A_PAIR), real(6, POINTS_A_PAIR),
                    whole(POINTS_A_PAIR), real(POINTS_A_PAIR))


def roomier(effects: Effects) -> Effects:
    """The same effects with room for twice the contacts; what pairs of hulls have learnt stays with them.

    Raises CrowdedError where that would take more pairs than are listed at most.
    """
    contact, meet, spheres, mixed, rigid, restitution = (effects.contact, effects.meet, effects.spheres, effects.mixed,
                                                         effects.rigid, effects.restitution)
    touching = 0
    if contact is not None:
        touching += 2 * contact.particle.size
        particle, solid, normal, bound, anchor, push = room(touching)
        contact = contact._replace(particle=particle, solid=solid, normal=normal, bound=bound, anchor=anchor, push=push)
        if restitution is not None:
            restitution = restitution._replace(rebound=real(touching))
    if meet is not None:
        capacity, hulls = 2 * meet.meetings.pair.size, meet.still.size
        if capacity > 2 * (MOST_PAIRS + PAIRS_A_HULL * hulls):
            raise CrowdedError(f"more than {capacity // 2:,} pairs of {hulls:,} bodies and colliders touch: they stand in each "
                               "other; give them more room")
        touching += capacity
        manifold = None if meet.manifold is None else manifold_of(meet.manifold.near.size, capacity)
        meet = meet._replace(pairs=copied(meet.pairs, capacity), spare=pairs_of(capacity), meetings=meetings_of(capacity),
                             search=meet.search._replace(code=whole(capacity)), manifold=manifold)
    if spheres is not None:
        capacity = 2 * spheres.push.size
        spheres = spheres._replace(candidates=candidates_of(capacity), push=real(capacity), standing=real(capacity))
    if mixed is not None:
        capacity = 2 * mixed.meetings.pair.size
        touching += capacity
        mixed = mixed._replace(candidates=candidates_of(capacity), pairs=copied(mixed.pairs, capacity),
                               spare=pairs_of(capacity), meetings=meetings_of(capacity))
    touches = effects.touches
    if rigid is not None:
        entities = rigid.bodies + touching + 1
        rigid = with_room(rigid, entities)
        touches = touches_of(touching, rigid.size.size)
    return effects._replace(exact=roomier_exact(effects.exact), rapid=roomier_exact(effects.rapid), contact=contact, meet=meet,
                            spheres=spheres, mixed=mixed, rigid=rigid, touches=touches, restitution=restitution)


def copied(pairs: Pairs, capacity: int) -> Pairs:
    """Pairs with room for more."""
    larger = pairs_of(capacity)
    larger.listed[:] = pairs.listed
    for old, new in zip(pairs[1:], larger[1:], strict=True):
        new[tuple(map(slice, old.shape))] = old
    return larger
