"""The convex hulls of a scene as one set of buffers: those of rigid bodies, copy by copy, and those of colliders."""

from typing import NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import BOX, CYLINDER, SPHERE
from verlet_numba.buffers.hulls import Hulls
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import Solid
from verlet_numba.scene.hulls import Part, all_of, hulls_of, part, surface_of
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.resting import rests_on_a_face
from verlet_numba.scene.rigid import rigid_bodies
from verlet_numba.scene.shapes import box

LANES = 4               # corners a hull are padded to a multiple of it
CYLINDER_SIDES = 64     # of the prism that a cylinder is for hulls: inside it by at most 0.12 % of its radius


class Family(NamedTuple):
    """Hulls that are alike: the M convex parts of a body in each of its K copies, or the one of a collider."""

    body: Integers          # (K,) rigid body, -1: a collider's
    solid: int              # collider, -1: none
    particle: Integers      # (K, P) inner indices, -1: a collider's
    points: Floats          # (K, P, 3) m, world
    local: Floats           # (P, 3) m, in the frame of the body or collider
    parts: tuple[Part, ...]
    rounding: float


def hulls_of_scene(bodies: list[Body], numbering: Numbering, solids: list[Solid]) -> Hulls | None:
    """All hulls: bodies first, in the order of their numbers, then colliders. None without rigid bodies."""
    families = body_families(bodies, numbering)
    if not families:
        return None
    families += [family for s, solid in enumerate(solids) for family in collider_family(s, solid)]
    return side_by_side([hulls_of_family(family) for family in families])


def rests_on_faces(hulls: Hulls) -> bool:
    """Whether two hulls may meet face to face: flat ones of two bodies, or of a body and a collider."""
    return len(np.unique(hulls.body[hulls.flat == 1])) > 1


def body_families(bodies: list[Body], numbering: Numbering) -> list[Family]:
    """The hulls of every rigid body."""
    families, first = [], 0
    for body, index in rigid_bodies(bodies, numbering):
        shape, numbers = body.shape, first + np.arange(len(index))
        families.append(Family(numbers, -1, index, body.positions, shape.positions, hulls_of(shape), shape.radius))
        first += len(index)
    return families


def collider_family(s: int, solid: Solid) -> list[Family]:
    """The hulls of a collider: every triangle of a mesh, none of a plane, which vertices meet."""
    x, y, z, _ = solid.extent
    rounding = 0.0
    if solid.kind == BOX:
        shape = box((2 * x, 2 * y, 2 * z), mass=1.0)
        local, hull = shape.positions, all_of(8, shape.triangles)
    elif solid.kind == SPHERE:
        local, hull, rounding = np.zeros((1, 3)), all_of(1, np.zeros((0, 3), np.int64)), x
    elif solid.kind == CYLINDER:
        turn = 2 * np.pi * np.arange(CYLINDER_SIDES) / CYLINDER_SIDES
        rim = np.stack([x * np.cos(turn), x * np.sin(turn), np.full(CYLINDER_SIDES, y)], axis=1)
        local = np.concatenate([rim, rim * [1, 1, -1]])
        hull = part(local, np.arange(len(local)))
    elif solid.surface is not None:
        return [mesh_family(s, solid, *solid.surface)]
    else:
        return []
    points = solid.origin + local @ solid.rotation.T
    return [Family(np.array([-1]), s, np.full((1, len(local)), -1), points[None], local, (hull,), rounding)]


def mesh_family(s: int, solid: Solid, vertices: Floats, triangles: Integers) -> Family:
    """The triangles of a mesh collider, each a hull of three corners."""
    alone = np.zeros(4, np.int64), np.zeros(0, np.int64)
    parts = tuple(Part(triangle, triangle[None], *alone) for triangle in triangles)
    points = solid.origin + vertices @ solid.rotation.T
    return Family(np.array([-1]), s, np.full((1, len(vertices)), -1), points[None], vertices, parts, 0.0)


def hulls_and_particles(bodies: list[Body], numbering: Numbering, particles: Integers, radius: Floats) -> Hulls:
    """Hulls of rigid bodies, and behind them one of a single corner for each of these particles; radius (n,) m."""
    lone, nowhere = (all_of(1, np.zeros((0, 3), np.int64)),), np.zeros((1, 3))
    pinpoints = Family(np.full(len(particles), -1), -1, particles[:, None], np.zeros((len(particles), 1, 3)), nowhere, lone, 0.0)
    families = [hulls_of_family(family) for family in (*body_families(bodies, numbering), pinpoints)]
    families[-1].rounding[:] = families[-1].reach[:] = radius[particles]
    return side_by_side(families)


def hulls_of_family(family: Family) -> Hulls:
    """Buffers of these hulls alone: copy by copy its parts, the corners of each padded by repeats of its first.

    All copies of a part climb along the same neighbours.
    """
    body, solid, particle, points, local, parts, rounding = family
    copies = len(body)
    padded = [np.pad(hull.corners, (0, -len(hull.corners) % LANES), constant_values=hull.corners[0]) for hull in parts]
    column = np.concatenate(padded)
    start = np.concatenate([[0], np.cumsum(np.tile([len(corners) for corners in padded], copies))])
    centre = np.stack([points[:, hull.corners].mean(axis=1) for hull in parts], axis=1)             # (K, M, 3)
    reach = [np.linalg.norm(points[:, hull.corners] - centre[:, [m]], axis=2).max(axis=1) for m, hull in enumerate(parts)]
    flat = [(solid >= 0 and len(hull.corners) == 3) or rests_on_a_face(*surface_of(local, hull)) for hull in parts]
    climbed = [hull for hull in parts if len(hull.neighbour)]
    row = np.cumsum([0, *(len(hull.corners) if len(hull.neighbour) else 0 for hull in parts)])[:-1]
    graph = np.where([len(hull.neighbour) > 0 for hull in parts], row, -1)
    degree = [np.diff(hull.start) for hull in climbed]
    return Hulls(
        body=np.repeat(body, len(parts)),
        start=start,
        size=np.tile([len(hull.corners) for hull in parts], copies),
        particle=particle[:, column].ravel(),
        corner=points[:, column].reshape(-1, 3).T,
        centre=centre.reshape(-1, 3).T,
        solid=np.full(copies * len(parts), solid),
        local=np.tile(local[column], (copies, 1)).T,
        reach=rounding + np.stack(reach, axis=1).ravel(),
        rounding=np.full(copies * len(parts), rounding),
        flat=np.tile(flat, copies).astype(np.int64),
        graph=np.tile(graph, copies),
        neighbours=np.cumsum(np.concatenate([[0], *degree])),
        neighbour=np.concatenate([np.zeros(0, np.int64), *(hull.neighbour for hull in climbed)]))


def side_by_side(several: list[Hulls]) -> Hulls:
    """All these hulls, one after another."""
    fields = {name: np.concatenate([getattr(hulls, name) for hulls in several], axis=-1) for name in Hulls._fields}
    columns, rows, links = (np.cumsum([0, *(getattr(hulls, name).shape[-1] - less for hulls in several)])
                            for name, less in (("corner", 0), ("neighbours", 1), ("neighbour", 0)))
    for name, offsets in (("start", columns), ("neighbours", links)):
        fields[name] = np.concatenate([[0], *(getattr(hulls, name)[1:] + offset
                                              for hulls, offset in zip(several, offsets[:-1], strict=True))])
    fields["graph"] = np.concatenate([np.where(hulls.graph < 0, -1, hulls.graph + row)
                                      for hulls, row in zip(several, rows[:-1], strict=True)])
    return Hulls(**{name: gate(values, values.dtype) for name, values in fields.items()})
