"""What meets what in a scene, and the buffers for it."""

from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers import Contacts, Friction, Hulls, Meet, Moving, Restitution, Rigid, Touches
from verlet_numba.scene.body import Body, Floats
from verlet_numba.scene.colliders import FIRST_ROOM, contacts, moving, solids_of
from verlet_numba.scene.materials import friction_of, restitution_of
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rigid import belongs_to, rigid_of, touches_of
from verlet_numba.scene.schema import Scene


class Contact(NamedTuple):
    moving: Moving | None = None
    contact: Contacts | None = None
    hulls: Hulls | None = None
    meet: Meet | None = None
    rigid: Rigid | None = None
    touches: Touches | None = None
    friction: Friction | None = None
    restitution: Restitution | None = None


def contact_of(scene: Scene, bodies: list[Body], numbering: Numbering, inverse_mass: Floats, real: Any) -> Contact:
    """Contact of bodies with colliders and each other, and the materials that meet; None for what cannot happen."""
    if scene.effects.contact == "none" or not (inverse_mass > 0).any():
        return Contact()
    size = len(inverse_mass)
    found, _ = solids_of(scene)
    belongs = belongs_to(bodies, numbering, size)
    contact = contacts(scene, bodies, numbering, size, belongs, real)
    if contact is None:
        return Contact()
    rigid = touches = None
    if (belongs >= 0).any():
        rigid = rigid_of(bodies, numbering, size, FIRST_ROOM)
        touches = touches_of(FIRST_ROOM, len(rigid.size))
    return Contact(moving(found), contact, None, None, rigid, touches,
                   friction_of(scene, found, bodies, numbering, size, None, real),
                   restitution_of(scene, found, bodies, numbering, size, None, FIRST_ROOM, real))
