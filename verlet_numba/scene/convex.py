"""The convex hulls of a scene as one set of buffers: those of rigid bodies, copy by copy, and those of colliders."""

from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers import BOX, CYLINDER, SPHERE, Hulls, gate
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import Solid
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rigid import rigid_bodies

LANES = 4               # corners a hull are padded to a multiple of it
CYLINDER_SIDES = 64     # of the prism that a cylinder is for hulls: inside it by at most 0.12 % of its radius


class Piece(NamedTuple):
    """A hull before it has its columns."""

    body: int               # rigid body, -1: a collider's
    solid: int              # collider, -1: none
    particle: Integers      # (C,) inner indices, -1: a collider's
    corner: Floats          # (3, C) m
    local: Floats           # (3, C) m
    rounding: float


def hulls_of_scene(bodies: list[Body], numbering: Numbering, solids: list[Solid]) -> Hulls | None:
    """All hulls: bodies first, in the order of their numbers, then colliders. None without rigid bodies."""
    pieces = [*bodies_pieces(bodies, numbering)]
    if not pieces:
        return None
    pieces += [piece for s, solid in enumerate(solids) for piece in collider_pieces(s, solid)]
    return laid_out(pieces)


def bodies_pieces(bodies: list[Body], numbering: Numbering) -> Any:
    """The hulls of every copy of every rigid body."""
    first = 0
    for body, index in rigid_bodies(bodies, numbering):
        for copy, particles in enumerate(index):
            positions = body.positions[copy].T
            yield Piece(first + copy, -1, particles, positions, np.zeros_like(positions), body.shape.radius)
        first += len(index)


def collider_pieces(s: int, solid: Solid) -> list[Piece]:
    """The hulls of a collider: every triangle of a mesh, none of a plane, which vertices meet."""
    x, y, z, _ = solid.extent
    rounding = 0.0
    if solid.kind == BOX:
        hulls = [np.array([[a, b, c] for a in (-x, x) for b in (-y, y) for c in (-z, z)])]
    elif solid.kind == SPHERE:
        hulls, rounding = [np.zeros((1, 3))], x
    elif solid.kind == CYLINDER:
        turn = 2 * np.pi * np.arange(CYLINDER_SIDES) / CYLINDER_SIDES
        rim = np.stack([x * np.cos(turn), x * np.sin(turn), np.full(CYLINDER_SIDES, y)], axis=1)
        hulls = [np.concatenate([rim, rim * [1, 1, -1]])]
    elif solid.surface is not None:
        vertices, triangles = solid.surface
        hulls = [*vertices[triangles]]
    else:
        hulls = []
    return [Piece(-1, s, np.full(len(local), -1), solid.origin[:, None] + solid.rotation @ local.T, local.T, rounding)
            for local in hulls]


def laid_out(pieces: list[Piece]) -> Hulls:
    """Columns for all corners, hull by hull, each padded by repeats of its first."""
    sizes = np.array([len(piece.particle) for piece in pieces])
    start = np.concatenate([[0], np.cumsum(-(-sizes // LANES) * LANES)])
    total = start[-1]
    particle, corner, local = np.full(total, -1), np.zeros((3, total)), np.zeros((3, total))
    for piece, begin, end in zip(pieces, start[:-1], start[1:], strict=True):
        column = np.arange(end - begin)
        column[len(piece.particle):] = 0
        particle[begin:end], corner[:, begin:end] = piece.particle[column], piece.corner[:, column]
        local[:, begin:end] = piece.local[:, column]
    centre = np.stack([piece.corner.mean(axis=1) for piece in pieces], axis=1)
    rounding = np.array([piece.rounding for piece in pieces])
    reach = rounding + [np.linalg.norm(piece.corner - mean[:, None], axis=0).max()
                        for piece, mean in zip(pieces, centre.T, strict=True)]
    numbers = [np.array([getattr(piece, name) for piece in pieces]) for name in ("body", "solid")]
    return Hulls(gate(numbers[0], np.int64), gate(start, np.int64), gate(sizes, np.int64), gate(particle, np.int64),
                 gate(corner, np.float64), gate(centre, np.float64), gate(numbers[1], np.int64), gate(local, np.float64),
                 gate(reach, np.float64), gate(rounding, np.float64), gate(np.full(len(pieces), -1), np.int64),
                 gate(np.zeros(1), np.int64), gate(np.zeros(0), np.int64))


def hulls_and_particles(bodies: list[Body], numbering: Numbering, particles: Integers, radius: Floats) -> Hulls:
    """Hulls of rigid bodies, and behind them one of a single corner for each of these particles; radius (n,) m."""
    pieces = [*bodies_pieces(bodies, numbering)]
    nowhere = np.zeros((3, 1))
    pieces += [Piece(-1, -1, np.array([k]), nowhere, nowhere, float(radius[k])) for k in particles]
    return laid_out(pieces)
