"""Friction and restitution of what meets: particles, colliders and hulls."""

from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import Friction, Restitution
from verlet_numba.buffers.hulls import Hulls
from verlet_numba.scene.body import Body, Floats
from verlet_numba.scene.colliders import Solid
from verlet_numba.scene.numbering import Numbering, spread
from verlet_numba.scene.schema import Scene


def friction_of(scene: Scene, found: list[Solid], bodies: list[Body], numbering: Numbering, size: int, hulls: Hulls | None,
                points: Hulls | None, soft: bool, real: Any) -> Friction | None:
    """Coefficients of particles (2, n), colliders and hulls; they meet with sqrt(a b).

    None if no two that may meet have any. soft: particles of deformable bodies meet each other.
    """
    default = scene.effects.friction
    pairs = [solid.collider.friction or default for solid in found]
    solid = np.array([[pair.static, pair.dynamic] if pair else [0.0, 0.0] for pair in pairs]).reshape(-1, 2).T
    particle = np.stack([spread(numbering, [body.friction[which] for body in bodies], size) for which in range(2)])
    if not particle.any() or (hulls is None and points is None and not soft and not solid.any()):
        return None
    hull, point = (np.stack([of_hulls(each, particle[which], solid[which]) for which in range(2)]) for each in (hulls, points))
    return Friction(gate(particle, real), gate(solid, np.float64), gate(hull, np.float64), gate(point, np.float64))


def restitution_of(scene: Scene, found: list[Solid], bodies: list[Body], numbering: Numbering, size: int, hulls: Hulls | None,
                   points: Hulls | None, room: int, real: Any) -> Restitution | None:
    """Coefficients of particles, colliders and hulls; None if all are 0: two that meet take the larger."""
    default = scene.effects.restitution or 0.0
    given = [solid.collider.restitution for solid in found]
    solid = np.array([default if value is None else value for value in given])
    particle = spread(numbering, [body.restitution for body in bodies], size)
    if not particle.any() and not solid.any():
        return None
    hull, point = (gate(of_hulls(each, particle, solid), np.float64) for each in (hulls, points))
    return Restitution(gate(particle, real), gate(solid, np.float64), hull, point, gate(np.zeros(room), np.float64))


def of_hulls(hulls: Hulls | None, particle: Floats, solid: Floats) -> Floats:
    """(H,) the value of every hull: its collider's, or its first particle's."""
    if hulls is None:
        return np.zeros(0)
    leads = hulls.particle[hulls.start[:-1]]
    values = np.where(leads >= 0, particle[leads], 0.0)
    collider = hulls.solid >= 0
    values[collider] = solid[hulls.solid[collider]]
    return values
