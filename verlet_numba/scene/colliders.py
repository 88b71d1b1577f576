"""Colliders of a scene as buffers: solids in their poses, what moves them, and the contacts of particles with them."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.contact import BOX, CYLINDER, MESH, PLANE, SPHERE, Contacts, Solids
from verlet_numba.buffers.forces import Carried, Moving, Paths
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.clearance import Surface
from verlet_numba.scene.numbering import Numbering, spread
from verlet_numba.scene.occupied import surface_of
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_colliders import BaseCollider

ROOM_WALLS = [(axis, side) for axis in range(3) for side in (-1.0, 1.0)]
MARGIN = 0.05           # of the shortest stick: how near a particle is listed, since relaxation may still bring it in
BATCH = 128             # particles that are looked at together
FIRST_ROOM = 64         # contacts; buffers grow as needed
REMEMBERED = 3          # colliders that a particle remembers: a corner of a room has three
NEVER = -3              # Contacts.met before any substep


class Solid(NamedTuple):
    """One surface of a collider, convex unless it is a mesh."""

    kind: int
    extent: tuple[float, float, float, float]
    origin: Floats
    rotation: Floats        # (3, 3), columns are its axes
    reach: float
    collider: BaseCollider
    surface: Surface | None = None      # of a mesh, about its origin


def turned_to(axis: Any) -> Floats:
    """A rotation whose third column is the unit vector along `axis`."""
    w = np.array(axis, float) / np.linalg.norm(axis)
    u = np.cross(w, np.eye(3)[np.argmin(np.abs(w))])
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(w, u), w], axis=1)


def solids(collider: Any, folder: Path) -> list[Solid]:
    """The surfaces of a collider: a room has six, every other kind one. Files of meshes are sought from `folder`."""
    identity, far = np.eye(3), np.inf
    start = np.array(collider.point if collider.kind == "plane" else collider.position, float)
    match collider.kind:
        case "plane":
            x, y, z = np.array(collider.normal, float) / np.linalg.norm(collider.normal)
            return [Solid(PLANE, (x, y, z, 0.0), start, identity, far, collider)]
        case "room":
            walls = [(-side * np.eye(3)[axis], -0.5 * collider.size[axis]) for axis, side in ROOM_WALLS]
            return [Solid(PLANE, (*normal, offset), start, identity, far, collider) for normal, offset in walls]
        case "box":
            half = 0.5 * np.array(collider.size)
            return [Solid(BOX, (*half, 0.0), start, identity, float(np.linalg.norm(half)), collider)]
        case "sphere":
            return [Solid(SPHERE, (collider.radius, 0.0, 0.0, 0.0), start, identity, collider.radius, collider)]
        case "cylinder":
            half = 0.5 * collider.length
            extent, reach = (collider.radius, half, 0.0, 0.0), float(np.hypot(collider.radius, half))
            return [Solid(CYLINDER, extent, start, turned_to(collider.axis), reach, collider)]
        case "mesh":
            surface = surface_of(collider, folder)
            reach = float(np.linalg.norm(surface[0], axis=1).max())
            return [Solid(MESH, (0.0, 0.0, 0.0, 0.0), start, identity, reach, collider, surface)]
    raise AssertionError(f"collider kind {collider.kind}")


def paths(points: list[Floats]) -> Paths:
    """Paths from their knots, (M, 4) t, x, y, z each."""
    first = np.cumsum([0, *map(len, points)])
    knots = np.concatenate([np.zeros((0, 4)), *points])
    return Paths(gate(first, np.int64), gate(knots[:, 0], np.float64), gate(knots[:, 1:].T, np.float64))


def solids_of(scene: Scene, folder: Path) -> tuple[list[Solid], Solids]:
    """All surfaces of a scene at time 0."""
    found = [solid for collider in scene.colliders for solid in solids(collider, folder)]
    origin = np.array([solid.origin for solid in found]).reshape(-1, 3).T
    rotation = np.array([solid.rotation for solid in found]).reshape(-1, 3, 3).transpose(1, 2, 0)
    extent = np.array([solid.extent for solid in found]).reshape(-1, 4).T
    return found, Solids(gate([solid.kind for solid in found], np.int64), gate(extent, np.float64),
                         gate(origin, np.float64), gate(rotation, np.float64),
                         gate(origin.copy(), np.float64), gate(rotation.copy(), np.float64),
                         gate([solid.reach for solid in found], np.float64))


def moving(found: list[Solid]) -> Moving | None:
    """What moves the surfaces whose collider has a path or a spin."""
    indices = [k for k, solid in enumerate(found) if solid.collider.path or solid.collider.spin]
    if not indices:
        return None
    spins, points = [], []
    for k in indices:
        spin, path, origin = found[k].collider.spin, found[k].collider.path, found[k].origin
        spins.append(spin.rate * np.array(spin.axis) / np.linalg.norm(spin.axis) if spin else np.zeros(3))
        knots = np.array(path, float) if path else np.array([[0.0, 0.0, 0.0, 0.0]])
        knots[:, 1:] += origin - knots[0, 1:]
        points.append(knots)
    rotation = np.stack([found[k].rotation for k in indices], axis=2)
    return Moving(gate(indices, np.int64), gate(rotation, np.float64), gate(np.array(spins).T, np.float64), paths(points))


def carried(bodies: list[Body], numbering: Numbering) -> Carried | None:
    """Pinned particles of bodies with a path."""
    particles, starts, points = [], [], []
    for body, index in zip(bodies, numbering.bodies, strict=True):
        if body.path is not None:
            particles.append(index[:, body.pinned].ravel())
            starts.append(body.positions[:, body.pinned].reshape(-1, 3))
            points.append(body.path)
    if not points:
        return None
    path = np.repeat(np.arange(len(points)), [len(each) for each in particles])
    return Carried(gate(np.concatenate(particles), np.int64), gate(path, np.int64), gate(np.concatenate(starts).T, np.float64),
                   gate(np.zeros((3, len(points))), np.float64), paths(points))


def contacts(placed: Solids, bodies: list[Body], numbering: Numbering, size: int, belongs: Integers, whole: bool,
             real: Any) -> Contacts | None:
    """Contact of particles with colliders; belongs (n,): rigid body or -1; whole: those answer for their particles."""
    if placed.kind.size == 0:
        return None
    radius = spread(numbering, [body.shape.radius for body in bodies], size)
    answers = belongs if whole else np.full(size, -1)
    remembered = REMEMBERED * size if whole else 0
    return Contacts(placed, gate(radius, real), gate(answers, np.int64), gate(belongs >= 0, np.int64),
                    gate(np.zeros(BATCH), np.int64), gate(radius + margin(bodies), np.float64), gate(np.zeros(1), np.int64),
                    *room(FIRST_ROOM), gate(np.full(remembered, -1), np.int64), gate(np.zeros(remembered), np.float64),
                    gate(np.zeros((3, remembered)), np.float64), gate(np.zeros(remembered), np.float64),
                    gate(np.full(remembered, NEVER), np.int64))


def margin(bodies: list[Body]) -> float:
    """How near a particle must come to a collider to be listed, m."""
    lengths = np.concatenate([np.zeros(0), *(body.shape.lengths for body in bodies)])
    return MARGIN * float(min(lengths[lengths > 0], default=0.0))


def room(capacity: int) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Empty contact buffers: particle, solid, normal, bound, anchor, push, memory."""
    return (gate(np.zeros(capacity), np.int64), gate(np.zeros(capacity), np.int64), gate(np.zeros((3, capacity)), np.float64),
            gate(np.zeros(capacity), np.float64), gate(np.zeros((3, capacity)), np.float64), gate(np.zeros(capacity), np.float64),
            gate(np.zeros(capacity), np.int64))
