"""What meets what in a scene, and the buffers for it."""

from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers import (
    BODY,
    FEATURE,
    PRINTED,
    Array,
    Contacts,
    Effects,
    Features,
    Friction,
    Hulls,
    Manifold,
    Meet,
    Meetings,
    Moving,
    Narrow,
    Pairs,
    Rest,
    Restitution,
    Rigid,
    Search,
    Touches,
    gate,
)
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import FIRST_ROOM, contacts, moving, room, solids_of
from verlet_numba.scene.convex import hulls_of_scene
from verlet_numba.scene.materials import friction_of, restitution_of
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rest import rest_of
from verlet_numba.scene.rigid import belongs_to, rigid_bodies, rigid_of, touches_of
from verlet_numba.scene.schema import Scene

POINTS = {"feature": FEATURE, "body": BODY, "printed": PRINTED}
MEETING_MARGIN = 0.02       # of the smallest hull's reach: how near two hulls are a contact
POLYTOPE = 128              # vertices of a hulls' difference that the search for a hit face may use
GRIDS, CELLS = 48, 64       # of the search for pairs: grids, and their fewest cells
POINTS_A_PAIR = 64          # of a manifold in the making


class Contact(NamedTuple):
    moving: Moving | None = None
    contact: Contacts | None = None
    hulls: Hulls | None = None
    meet: Meet | None = None
    rigid: Rigid | None = None
    touches: Touches | None = None
    features: Features | None = None
    friction: Friction | None = None
    restitution: Restitution | None = None
    rest: Rest | None = None


def contact_of(scene: Scene, bodies: list[Body], numbering: Numbering, inverse_mass: Floats, real: Any) -> Contact:
    """Contact of bodies with colliders and each other, and the materials that meet; None for what cannot happen."""
    if scene.effects.contact == "none" or not (inverse_mass > 0).any():
        return Contact()
    size = len(inverse_mass)
    found, _ = solids_of(scene)
    belongs = belongs_to(bodies, numbering, size)
    answers = scene.solver.response == "body" and bool((belongs >= 0).any())
    contact = contacts(scene, bodies, numbering, size, belongs, answers, real)
    hulls = hulls_of_scene(bodies, numbering, found)
    meet = None
    if hulls is not None:
        still = still_hulls(hulls, belongs, inverse_mass)
        if len(hulls.body) > 1 and not still.all():
            meet = meet_of(scene, hulls, still)
        else:
            hulls = None
    rigid = touches = features = None
    if answers and (contact is not None or meet is not None):
        rigid = rigid_of(bodies, numbering, size, FIRST_ROOM)
        touches = touches_of(FIRST_ROOM, len(rigid.size))
    if meet is not None and hulls is not None and scene.solver.response == "feature":
        features = features_of(scene, bodies, numbering, hulls)
    if contact is None and meet is None:
        return Contact()
    return Contact(moving(found) if contact is not None else None, contact, hulls, meet, rigid, touches, features,
                   friction_of(scene, found, bodies, numbering, size, hulls, real),
                   restitution_of(scene, found, bodies, numbering, size, hulls, FIRST_ROOM, real),
                   rest_of(scene, bodies, numbering, inverse_mass, hulls, real))


def still_hulls(hulls: Hulls, belongs: Integers, inverse_mass: Floats) -> Array:
    """(H,) whether nothing moves a hull: a collider's, or of a body that is pinned altogether."""
    moves = np.zeros(belongs.max() + 2, bool)
    moves[belongs[(inverse_mass > 0) & (belongs >= 0)]] = True
    return ~moves[hulls.body]           # the last is what number -1, a collider, finds


def meet_of(scene: Scene, hulls: Hulls, still: Array) -> Meet:
    """How the hulls of a scene meet."""
    reach = hulls.reach[hulls.body >= 0]
    several = scene.solver.response == "body"
    return Meet(gate(still, np.int64), pairs_of(FIRST_ROOM), pairs_of(FIRST_ROOM), search_of(len(hulls.body), FIRST_ROOM),
                narrow_of(hulls), manifold_of(int(hulls.size.max()), FIRST_ROOM) if several else None, meetings_of(FIRST_ROOM),
                MEETING_MARGIN * float(reach.min()) if several else 0.0, scene.solver.substeps, 1,
                1 if scene.solver.broad_phase == "all_pairs" else None)


def features_of(scene: Scene, bodies: list[Body], numbering: Numbering, hulls: Hulls) -> Features:
    """The paper's response for these hulls."""
    masses = [np.full(len(index), body.shape.masses.sum()) for body, index in rigid_bodies(bodies, numbering)]
    mass = np.concatenate([*masses, [np.inf]])[hulls.body]         # the last is what number -1, a collider, finds
    return Features(POINTS[scene.solver.projection_point], gate(mass, np.float64), gate(np.zeros(FIRST_ROOM), np.float64))


def whole(*shape: int) -> Array:
    return gate(np.zeros(shape), np.int64)


def real_(*shape: int) -> Array:
    return gate(np.zeros(shape), np.float64)


def pairs_of(room: int) -> Pairs:
    """Room for so many pairs."""
    return Pairs(whole(1), whole(room), whole(room), real_(3, room), whole(6, room), real_(room), real_(room), whole(room))


def meetings_of(room: int) -> Meetings:
    """Room for so many meetings."""
    return Meetings(whole(1), whole(room), whole(6, room), real_(6, room), real_(3, room), real_(room))


def search_of(hulls: int, room: int) -> Search:
    """The search for pairs among so many hulls, with room for so many pairs; no list has been made."""
    return Search(whole(1), real_(3, hulls), real_(hulls), real_(2, 3, hulls), whole(1), real_(hulls), whole(hulls), whole(hulls), real_(GRIDS),
                  whole(4, GRIDS), whole(4 * hulls + GRIDS * (CELLS + 4) + 2), real_(2 * hulls, 4), whole(2 * hulls), whole(room))


def narrow_of(hulls: Hulls) -> Narrow:
    """Scratch of the narrow phase of these hulls."""
    faces, corners = 2 * POLYTOPE - 4, int(hulls.size.max(initial=0))
    return Narrow(real_(3, POLYTOPE), whole(2, POLYTOPE), real_(4), whole(3, faces), whole(3, faces), real_(4, faces),
                  whole(faces), whole(3 * faces), whole(3 * faces), whole(2 * corners + 1))


def manifold_of(corners: int, room: int) -> Manifold:
    """Scratch of manifolds of hulls of at most so many corners, with room for so many meetings."""
    return Manifold(whole(room), whole(6, room), real_(6, room), real_(room), whole(corners), real_(4, corners), whole(2, 16),
                    real_(2, 2, 16), real_(2, 16, 16), real_(3, POINTS_A_PAIR), whole(6, POINTS_A_PAIR), real_(6, POINTS_A_PAIR),
                    whole(POINTS_A_PAIR), real_(POINTS_A_PAIR))


def roomier(effects: Effects) -> Effects:
    """The same effects with room for twice the contacts; what pairs of hulls have learnt stays with them."""
    contact, meet, rigid, features, restitution = (effects.contact, effects.meet, effects.rigid, effects.features,
                                                   effects.restitution)
    capacity, alone = 0, 0
    if contact is not None:
        alone = 2 * contact.particle.size
        names = ("particle", "solid", "normal", "bound", "anchor", "push")
        contact = contact._replace(**dict(zip(names, room(alone), strict=True)))
    if restitution is not None:
        restitution = restitution._replace(rebound=real_(alone))
    if meet is not None:
        capacity = 2 * meet.meetings.pair.size
        pairs, spare = copied(meet.pairs, capacity), pairs_of(capacity)
        search = meet.search._replace(code=whole(capacity))
        manifold = None if meet.manifold is None else manifold_of(meet.manifold.near.size, capacity)
        meet = meet._replace(pairs=pairs, spare=spare, search=search, manifold=manifold, meetings=meetings_of(capacity))
    if features is not None:
        features = features._replace(push=real_(capacity))
    touches = effects.touches
    if rigid is not None:
        touches = touches_of(alone + capacity, rigid.size.size)
    return effects._replace(contact=contact, meet=meet, touches=touches, features=features, restitution=restitution)


def copied(pairs: Pairs, capacity: int) -> Pairs:
    """Pairs with room for more."""
    larger = pairs_of(capacity)
    for old, new in zip(pairs, larger, strict=True):
        new[..., :old.shape[-1]] = old
    return larger
