"""What meets what in a scene, and the buffers for it."""

from pathlib import Path
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
    Meshes,
    Mixed,
    Moving,
    Narrow,
    Pairs,
    Restitution,
    Rigid,
    Search,
    Spheres,
    Touches,
    Trees,
    Wrapped,
    gate,
)
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import FIRST_ROOM, Solid, contacts, moving, room, solids_of
from verlet_numba.scene.convex import hulls_and_particles, hulls_of_scene
from verlet_numba.scene.hulls import hulls_of
from verlet_numba.scene.materials import friction_of, restitution_of
from verlet_numba.scene.mesh_collider import meshes_of, ridges_of
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rigid import belongs_to, rigid_bodies, rigid_of, touches_of, with_room
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.sphere_trees import candidates_of, layered_of, spheres_of, stack_of, wrapped

POINTS = {"feature": FEATURE, "body": BODY, "printed": PRINTED}
MEETING_MARGIN = 0.02       # of the smallest hull's reach: how near two hulls are a contact
LISTING_MARGIN = 0.5        # of the deformable bodies' spacing: how near particles are listed as candidates
POLYTOPE = 128              # vertices of a hulls' difference that the search for a hit face may use
GRIDS, CELLS = 48, 64       # of the search for pairs: grids, and their fewest cells
POINTS_A_PAIR = 64          # of a manifold in the making


class Contact(NamedTuple):
    moving: Moving | None = None
    contact: Contacts | None = None
    meshes: Meshes | None = None
    hulls: Hulls | None = None
    meet: Meet | None = None
    trees: Trees | None = None
    spheres: Spheres | None = None
    points: Hulls | None = None
    mixed: Mixed | None = None
    rigid: Rigid | None = None
    touches: Touches | None = None
    features: Features | None = None
    friction: Friction | None = None
    restitution: Restitution | None = None


def contact_of(scene: Scene, folder: Path, bodies: list[Body], numbering: Numbering, together: Integers, inverse_mass: Floats,
               real: Any) -> Contact:
    """Contact of bodies with colliders and each other, and the materials that meet; None for what cannot happen.

    together (A, 2): inner indices of attached particles, which never meet; inverse_mass (n,) 1/kg.
    """
    if scene.effects.contact == "none" or not (inverse_mass > 0).any():
        return Contact()
    size, (found, placed) = len(inverse_mass), solids_of(scene, folder)
    belongs = belongs_to(bodies, numbering, size)
    as_whole = scene.solver.response == "body" and bool((belongs >= 0).any())
    contact = contacts(placed, bodies, numbering, size, belongs, as_whole, real)
    hulls, meet = hulls_meeting(scene, bodies, numbering, found, belongs, inverse_mass)
    trees, spheres, points, mixed = soft_meeting(scene, bodies, numbering, together, inverse_mass, real)
    meets = meet is not None or mixed is not None
    if contact is None and not meets and spheres is None:
        return Contact()
    rigid = touches = features = None
    if as_whole and (contact is not None or meets):
        rigid = rigid_of(bodies, numbering, size, FIRST_ROOM)
        touches = touches_of(FIRST_ROOM, len(rigid.size))
    if scene.solver.response == "feature" and meets:
        features = Features(POINTS[scene.solver.projection_point], body_masses(bodies, numbering, inverse_mass, hulls),
                            body_masses(bodies, numbering, inverse_mass, points))
    return Contact(moving(found) if contact is not None else None, contact, meshes_of(found, size), hulls, meet, trees, spheres,
                   points, mixed, rigid, touches, features,
                   friction_of(scene, found, bodies, numbering, size, hulls, points, spheres is not None, real),
                   restitution_of(scene, found, bodies, numbering, size, hulls, FIRST_ROOM, real))


def hulls_meeting(scene: Scene, bodies: list[Body], numbering: Numbering, found: list[Solid], belongs: Integers,
                  inverse_mass: Floats) -> tuple[Hulls | None, Meet | None]:
    """Hulls of rigid bodies and colliders, and how they meet; None if there are no two of which one moves."""
    hulls = hulls_of_scene(bodies, numbering, found)
    if hulls is None or len(hulls.body) < 2:
        return None, None
    still = still_hulls(hulls, belongs, inverse_mass)
    if still.all():
        return None, None
    return hulls, meet_of(scene, found, hulls, still)


def soft_meeting(scene: Scene, bodies: list[Body], numbering: Numbering, together: Integers, inverse_mass: Floats,
                 real: Any) -> tuple[Trees | None, Spheres | None, Hulls | None, Mixed | None]:
    """Sphere trees of a scene and what they are for: deformable bodies against each other, themselves, and hulls."""
    soft = [(body, index) for body, index in zip(bodies, numbering.bodies, strict=True) if not body.shape.rigid]
    whole_ones = rigid_bodies(bodies, numbering)
    several = sum(len(index) for _, index in soft) > 1 or scene.effects.self_collision
    thick = any(body.shape.radius > 0 for body, _ in soft)
    touch, mix = several and thick, bool(soft) and bool(whole_ones)
    if not touch and not mix:
        return None, None, None, None
    size = len(inverse_mass)
    layered = layered_of(bodies, numbering, size, real, together)
    assert layered is not None
    wrapped = wrapped_hulls(bodies, numbering) if mix else None
    trees = Trees(layered, wrapped, stack_of(layered, wrapped), 1 if scene.effects.self_collision else None)
    spheres = spheres_of(layered, LISTING_MARGIN * spacing_of(soft)) if touch else None
    if not mix:
        return trees, spheres, None, None
    particles = np.concatenate([index.ravel() for _, index in soft])
    points = hulls_and_particles(bodies, numbering, particles, np.asarray(layered.radius, float))
    near = MEETING_MARGIN * float(points.reach[points.body >= 0].min())
    count = len(points.body) - len(particles)
    hull = np.full(size, -1)
    hull[particles] = count + np.arange(len(particles))
    mixed = Mixed(candidates_of(FIRST_ROOM), gate(np.zeros((3, size)), real), gate(hull, np.int64), whole(count + 1),
                  pairs_of(FIRST_ROOM), pairs_of(FIRST_ROOM), meetings_of(FIRST_ROOM), narrow_of(points),
                  LISTING_MARGIN * spacing_of(soft), near, 1)
    return trees, spheres, points, mixed


def spacing_of(soft: list[tuple[Body, Integers]]) -> float:
    """The shortest stick or the smallest diameter of deformable bodies that have any, m."""
    lengths = [body.shape.lengths[body.shape.lengths > 0] for body, _ in soft]
    sizes = [2 * body.shape.radius for body, _ in soft if body.shape.radius > 0]
    return float(min(np.concatenate([*lengths, sizes]), default=1.0))


def wrapped_hulls(bodies: list[Body], numbering: Numbering) -> Wrapped | None:
    """Wrapped trees over the convex parts of rigid bodies; a leaf is a hull, numbered as in `Hulls`."""
    return wrapped([(body.shape.positions, [part.corners for part in hulls_of(body.shape)], index)
                    for body, index in rigid_bodies(bodies, numbering)])


def body_masses(bodies: list[Body], numbering: Numbering, inverse_mass: Floats, hulls: Hulls | None) -> Array:
    """(H,) the mass of each hull's body, a particle's own, or infinite; kg."""
    if hulls is None:
        return real_(0)
    masses = [np.full(len(index), body.shape.masses.sum()) for body, index in rigid_bodies(bodies, numbering)]
    mass = np.concatenate([*masses, [np.inf]])[hulls.body]         # the last is what number -1 finds
    lead = hulls.particle[hulls.start[:-1]]
    alone = (hulls.body < 0) & (lead >= 0) & (inverse_mass[lead] > 0)
    mass[alone] = 1.0 / inverse_mass[lead[alone]]
    return gate(mass, np.float64)


def still_hulls(hulls: Hulls, belongs: Integers, inverse_mass: Floats) -> Array:
    """(H,) whether nothing moves a hull: a collider's, or of a body that is pinned altogether."""
    moves = np.zeros(belongs.max() + 2, bool)
    moves[belongs[(inverse_mass > 0) & (belongs >= 0)]] = True
    return ~moves[hulls.body]           # the last is what number -1, a collider, finds


def meet_of(scene: Scene, found: list[Solid], hulls: Hulls, still: Array) -> Meet:
    """How the hulls of a scene meet."""
    reach = hulls.reach[hulls.body >= 0]
    several = scene.solver.response == "body"
    return Meet(gate(still, np.int64), pairs_of(FIRST_ROOM), pairs_of(FIRST_ROOM), search_of(len(hulls.body), FIRST_ROOM),
                narrow_of(hulls), manifold_of(int(hulls.size.max()), FIRST_ROOM) if several else None, meetings_of(FIRST_ROOM),
                MEETING_MARGIN * float(reach.min()) if several else 0.0, scene.solver.substeps, 1,
                1 if scene.solver.broad_phase == "all_pairs" else None, ridges_of(found, hulls))


def whole(*shape: int) -> Array:
    return gate(np.zeros(shape), np.int64)


def real_(*shape: int) -> Array:
    return gate(np.zeros(shape), np.float64)


def pairs_of(room: int) -> Pairs:
    """Room for so many pairs."""
    return Pairs(whole(1), whole(room), whole(room), real_(3, room), whole(6, room), real_(room), real_(room), whole(room))


def meetings_of(room: int) -> Meetings:
    """Room for so many meetings."""
    return Meetings(whole(1), whole(room), whole(6, room), real_(6, room), real_(3, room), real_(room), real_(room))


def search_of(hulls: int, room: int) -> Search:
    """The search for pairs among so many hulls, with room for so many pairs; no list has been made."""
    return Search(whole(1), real_(3, hulls), real_(hulls), real_(2, 3, hulls), whole(1), real_(hulls), whole(hulls), whole(hulls),
                  real_(GRIDS), whole(4, GRIDS), whole(4 * hulls + GRIDS * (CELLS + 4) + 2), real_(2 * hulls, 4),
                  whole(2 * hulls), whole(room))


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
    contact, meet, spheres, mixed, rigid, restitution = (effects.contact, effects.meet, effects.spheres, effects.mixed,
                                                         effects.rigid, effects.restitution)
    touching = 0
    if contact is not None:
        touching += 2 * contact.particle.size
        particle, solid, normal, bound, anchor, push = room(touching)
        contact = contact._replace(particle=particle, solid=solid, normal=normal, bound=bound, anchor=anchor, push=push)
        if restitution is not None:
            restitution = restitution._replace(rebound=real_(touching))
    if meet is not None:
        capacity = 2 * meet.meetings.pair.size
        touching += capacity
        manifold = None if meet.manifold is None else manifold_of(meet.manifold.near.size, capacity)
        meet = meet._replace(pairs=copied(meet.pairs, capacity), spare=pairs_of(capacity), meetings=meetings_of(capacity),
                             search=meet.search._replace(code=whole(capacity)), manifold=manifold)
    if spheres is not None:
        capacity = 2 * spheres.push.size
        spheres = spheres._replace(candidates=candidates_of(capacity), push=real_(capacity), standing=real_(capacity))
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
    return effects._replace(contact=contact, meet=meet, spheres=spheres, mixed=mixed, rigid=rigid, touches=touches,
                            restitution=restitution)


def copied(pairs: Pairs, capacity: int) -> Pairs:
    """Pairs with room for more."""
    larger = pairs_of(capacity)
    larger.listed[:] = pairs.listed
    for old, new in zip(pairs[1:], larger[1:], strict=True):
        new[..., :old.shape[-1]] = old
    return larger
