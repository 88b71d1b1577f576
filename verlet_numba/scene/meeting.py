"""What meets what in a scene, and the buffers for it."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.contact import (
    BODY,
    FEATURE,
    PRINTED,
    Contacts,
    Features,
    Friction,
    Meshes,
    Rest,
    Restitution,
    Rigid,
    Touches,
)
from verlet_numba.buffers.exact import Exact
from verlet_numba.buffers.forces import Moving
from verlet_numba.buffers.hulls import Hulls, Meet, Mixed
from verlet_numba.buffers.trees import Spheres, Trees, Wrapped
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.capacity import manifold_of, meetings_of, narrow_of, pairs_of, search_of
from verlet_numba.scene.colliders import FIRST_ROOM, Solid, contacts, moving, solids_of
from verlet_numba.scene.convex import hulls_and_particles, hulls_of_scene, rests_on_faces
from verlet_numba.scene.exact import exact_of, rapid_of
from verlet_numba.scene.hulls import hulls_of
from verlet_numba.scene.materials import friction_of, restitution_of
from verlet_numba.scene.mesh_collider import meshes_of, ridges_of
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rest import rest_of
from verlet_numba.scene.rigid import belongs_to, rigid_bodies, rigid_of, touches_of
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.sphere_trees import candidates_of, layered_of, spheres_of, stack_of, wrapped

POINTS = {"feature": FEATURE, "body": BODY, "printed": PRINTED}
MEETING_MARGIN = 0.02       # of the smallest hull's reach: how near two hulls are a contact
LASTING = 4                 # substeps that a list of pairs of hulls shall last: longer ones hold more pairs; 0: the list is for one
LISTING_MARGIN = 0.5        # of the deformable bodies' spacing: how near particles are listed as candidates


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
    rest: Rest | None = None
    exact: Exact | None = None
    rapid: Exact | None = None


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
    thick, continuous = scene.solver.deformable_contact == "exact", scene.effects.continuous_collision
    precise = (thick or continuous) and any(not body.shape.rigid for body in bodies)
    if contact is None and not meets and spheres is None and not precise:
        return Contact()
    rigid = touches = features = None
    if as_whole and (contact is not None or meets):
        most = FIRST_ROOM * sum(each is not None for each in (contact, meet, mixed))       # all that may touch at once
        rigid = rigid_of(bodies, numbering, size, most)
        touches = touches_of(most, len(rigid.size))
    if scene.solver.response == "feature" and meets:
        features = Features(POINTS[scene.solver.projection_point], body_masses(bodies, numbering, inverse_mass, hulls),
                            body_masses(bodies, numbering, inverse_mass, points))
    friction = friction_of(scene, found, bodies, numbering, size, hulls, points, spheres is not None or precise, real)
    exact = exact_of(bodies, numbering, found, contact, together, inverse_mass, belongs, friction, scene.effects.self_collision,
                     continuous, thick, spacing_of(bodies)) if precise else None
    rapid = rapid_of(bodies, numbering, found, contact, inverse_mass, belongs) if continuous else None
    rest = rest_of(scene, bodies, numbering, inverse_mass, hulls, real) if exact is None and rapid is None else None
    return Contact(moving(found) if contact is not None else None, contact, meshes_of(found, size), hulls, meet, trees, spheres,
                   points, mixed, rigid, touches, features,
                   friction,
                   restitution_of(scene, found, bodies, numbering, size, hulls, points, FIRST_ROOM, real),
                   rest, exact, rapid)


def hulls_meeting(scene: Scene, bodies: list[Body], numbering: Numbering, found: list[Solid], belongs: Integers,
                  inverse_mass: Floats) -> tuple[Hulls | None, Meet | None]:
    """Hulls of rigid bodies and colliders, and how they meet; None if there are no two of which one moves."""
    hulls = hulls_of_scene(bodies, numbering, found)
    if hulls is None or len(hulls.body) < 2:
        return None, None
    if scene.effects.rest is not None:          # a single contact jumps about even on a small face: nothing would be still
        hulls.flat[:] = hulls.size > 1
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
    touch, mix = several and thick and scene.solver.deformable_contact == "spheres", bool(soft) and bool(whole_ones)
    if not touch and not mix:
        return None, None, None, None
    size = len(inverse_mass)
    layered = layered_of(bodies, numbering, size, real, together)
    assert layered is not None
    wrapped = wrapped_hulls(bodies, numbering) if mix else None
    trees = Trees(layered, wrapped, stack_of(layered, wrapped), 1 if scene.effects.self_collision else None)
    spheres = spheres_of(layered, LISTING_MARGIN * spacing_of(bodies)) if touch else None
    if not mix:
        return trees, spheres, None, None
    particles = np.concatenate([index.ravel() for _, index in soft])
    points = hulls_and_particles(bodies, numbering, particles, np.asarray(layered.radius, float))
    near = MEETING_MARGIN * float(points.reach[points.body >= 0].min())
    count = len(points.body) - len(particles)
    hull = np.full(size, -1)
    hull[particles] = count + np.arange(len(particles))
    mixed = Mixed(candidates_of(FIRST_ROOM), gate(np.zeros((3, size)), real), gate(hull, np.int64),
                  gate(np.zeros(count + 1), np.int64),
                  pairs_of(FIRST_ROOM), pairs_of(FIRST_ROOM), gate(np.zeros(1), np.int64), meetings_of(FIRST_ROOM),
                  narrow_of(points),
                  LISTING_MARGIN * spacing_of(bodies), near, 1)
    return trees, spheres, points, mixed


def spacing_of(bodies: list[Body]) -> float:
    """The shortest stick or the smallest diameter of deformable bodies that have any, m."""
    soft = [body.shape for body in bodies if not body.shape.rigid]
    lengths = [shape.lengths[shape.lengths > 0] for shape in soft]
    sizes = [2 * shape.radius for shape in soft if shape.radius > 0]
    return float(min(np.concatenate([*lengths, sizes]), default=1.0))


def wrapped_hulls(bodies: list[Body], numbering: Numbering) -> Wrapped | None:
    """Wrapped trees over the convex parts of rigid bodies; a leaf is a hull, numbered as in `Hulls`."""
    return wrapped([(body.shape.positions, [part.corners for part in hulls_of(body.shape)], index)
                    for body, index in rigid_bodies(bodies, numbering)])


def body_masses(bodies: list[Body], numbering: Numbering, inverse_mass: Floats, hulls: Hulls | None) -> Array:
    """(H,) the mass of each hull's body, a particle's own, or infinite; kg."""
    if hulls is None:
        return gate(np.zeros(0), np.float64)
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
    as_whole = scene.solver.response == "body"
    manifold = manifold_of(int(hulls.size.max()), FIRST_ROOM) if as_whole and rests_on_faces(hulls) else None
    return Meet(gate(still, np.int64), pairs_of(FIRST_ROOM), pairs_of(FIRST_ROOM), gate(np.zeros(1), np.int64),
                search_of(len(hulls.body), FIRST_ROOM),
                narrow_of(hulls), None, manifold, meetings_of(FIRST_ROOM), MEETING_MARGIN * float(reach.min()) if as_whole else 0.0,
                min(scene.solver.substeps, LASTING) if scene.solver.substeps > 1 else 0, 1,
                1 if scene.solver.broad_phase == "all_pairs" else None,
                ridges_of(found, hulls))
