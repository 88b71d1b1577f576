"""Pieces of surface of a scene's bodies and colliders, and trees over them, for exact contact (kernels/pieces.py)."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import BOX, CYLINDER, SPHERE
from verlet_numba.buffers.exact import NEARER, Pieces
from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.chains import paths
from verlet_numba.scene.colliders import Solid
from verlet_numba.scene.convex import CYLINDER_SIDES
from verlet_numba.scene.hulls import hull_faces
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.shapes import box
from verlet_numba.scene.sphere_trees import Tree, halved, halved_grid, spacing


class Surface(NamedTuple):
    """The pieces of one body, in numbers of its own points. `owner` is the piece that a vertex, edge or triangle belongs to."""

    tree: Tree
    lattice: tuple[float, float, float, float]
    corner: Integers                        # (E, 4)
    vertex: tuple[Integers, Integers]       # owner (V,), vertex (V,)
    edge: tuple[Integers, Integers]         # owner (S,), (S, 2)
    triangle: tuple[Integers, Integers]     # owner (F,), (F, 3)


class Placed(NamedTuple):
    """A surface in each of its K copies: points (K, P) of what is contact between."""

    surface: Surface
    points: Integers


NONE = (0.0, 0.0, 0.0, 0.0)
FLAT = 1e-9             # rad, about: triangles with less between them are one face


def of_triangles(positions: Floats, triangles: Integers) -> Surface:
    """Every triangle is a piece. Edges within a flat face belong to none: what passes them passes the face or its border."""
    own = np.arange(len(triangles))
    tree = halved(positions[triangles].mean(axis=1))
    found = owning(tree, NONE, np.concatenate([triangles, triangles[:, :1]], axis=1), own, triangles)
    owner, edge = found.edge
    sharp = ~within_face(positions, triangles, edge)
    return found._replace(edge=(owner[sharp], edge[sharp]))


def within_face(positions: Floats, triangles: Integers, edge: Integers) -> NDArray[np.bool_]:
    """(S,) whether both triangles of an edge (S, 2), its ends in ascending order, lie in one plane."""
    p, q, r = np.moveaxis(positions[triangles], 1, 0)
    normal = np.cross(q - p, r - p)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    count = len(positions)
    keys, wanted = sides @ [count, 1], edge @ [count, 1]
    order = np.argsort(keys, kind="stable")
    low, high = (np.searchsorted(keys[order], wanted, side) for side in ("left", "right"))
    one, other = normal[order[low] // 3], normal[order[high - 1] // 3]
    return np.asarray((high - low == 2) & (np.linalg.norm(one - other, axis=1) < FLAT))


def of_cloth(shape: Shape, radius: float) -> Surface:
    """Every cell is a piece, of two triangles."""
    (a, b), (_, nx, ny) = spacing(shape), (shape.layout[0], int(shape.layout[1]), int(shape.layout[2]))
    i, j = np.divmod(np.arange((nx - 1) * (ny - 1)), ny - 1)
    first = i * ny + j
    corner = np.stack([first, first + ny, first + ny + 1, first + 1], axis=1)
    row, column = np.divmod(shape.triangles.min(axis=1), ny)
    closest = a * b / float(np.hypot(a, b))
    lattice = (a, b, closest, min(2 * radius, NEARER * closest))
    return owning(halved_grid(nx - 1, ny - 1, a, b), lattice, corner, row * (ny - 1) + column, shape.triangles)


def owning(tree: Tree, lattice: tuple[float, float, float, float], corner: Integers, own: Integers, triangles: Integers) -> Surface:
    """Pieces of triangles: the first that has a vertex or an edge owns it."""
    order = np.argsort(own, kind="stable")
    own, triangles = own[order], triangles[order]
    vertex, at = np.unique(triangles.ravel(), return_index=True)
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    edge, on = np.unique(sides, axis=0, return_index=True)
    return Surface(tree, lattice, corner, (own[at // 3], vertex), (own[on // 3], edge), (own, triangles))


def of_sticks(positions: Floats, sticks: Integers) -> Surface:
    """Every stick is a piece, and every particle without one."""
    alone = np.setdiff1d(np.arange(len(positions)), sticks)
    edge = np.concatenate([sticks, np.stack([alone, alone], axis=1)]).astype(np.int64)
    vertex, at = np.unique(edge.ravel(), return_index=True)
    none = np.zeros(0, np.int64), np.zeros((0, 3), np.int64)
    return Surface(halved(positions[edge].mean(axis=1)), NONE, edge[:, [0, 0, 1, 1]], (at // 2, vertex),
                   (np.arange(len(edge)), edge), none)


def of_body(shape: Shape, radius: float) -> Surface:
    """The pieces of a body."""
    if shape.layout[0] == "grid":
        return of_cloth(shape, radius)
    if len(shape.triangles):
        return of_triangles(shape.positions, shape.triangles)
    return of_sticks(shape.positions, shape.sticks if shape.segments else np.zeros((0, 2), np.int64))


def of_solid(solid: Solid) -> tuple[Floats, Surface] | None:
    """Corners (P, 3) of a collider in its own frame, and its pieces; None of a plane, which vertices meet."""
    if solid.kind == SPHERE:
        return np.zeros((1, 3)), of_sticks(np.zeros((1, 3)), np.zeros((0, 2), np.int64))
    if solid.surface is not None:
        vertices, triangles = solid.surface
    elif solid.kind == BOX:
        shape = box(tuple(2 * np.array(solid.extent[:3])), mass=1.0)
        vertices, triangles = shape.positions, shape.triangles
    elif solid.kind == CYLINDER:
        turn = 2 * np.pi * np.arange(CYLINDER_SIDES) / CYLINDER_SIDES
        x, y = solid.extent[:2]
        rim = np.stack([x * np.cos(turn), x * np.sin(turn), np.full(CYLINDER_SIDES, y)], axis=1)
        vertices = np.concatenate([rim, rim * [1, 1, -1]])
        triangles = hull_faces(vertices)
    else:
        return None
    return vertices, of_triangles(vertices, triangles)


def at_rest(shape: Shape) -> Floats:
    """(P, 3) m: where a body's particles are at rest, its chains of sticks laid out straight, each along a line of its own."""
    if shape.layout[0] == "line":
        return np.concatenate([[0.0], np.cumsum(shape.lengths)])[:, None] * [1.0, 0.0, 0.0]
    if len(shape.triangles) or not shape.segments:
        return shape.positions
    rest, length = shape.positions.copy(), {tuple(sorted(stick)): own for stick, own in zip(shape.sticks.tolist(), shape.lengths,
                                                                                           strict=True)}
    apart = 1.0 + float(shape.lengths.sum()) + float(np.ptp(rest, axis=0).max(initial=0.0))
    for line, path in enumerate(paths(shape), 1):
        along = np.cumsum([0.0, *(length[tuple(sorted(pair))] for pair in np.stack([path[:-1], path[1:]], axis=1).tolist())])
        rest[path] = rest[path[0]] * 0 + along[:, None] * [1.0, 0.0, 0.0] + line * apart * np.array([0.0, 1.0, 0.0])
    return rest


def pieces_of(soft: list[Placed], others: list[Placed]) -> Pieces:
    """The trees of deformable bodies, behind them those of all others."""
    nodes, columns, count = [0], [], 0
    for placed in (*soft, *others):
        surface, tree = placed.surface, placed.surface.tree
        rectangle = tree.rectangle if len(tree.rectangle) else np.zeros((len(tree.skip), 4), np.int64)
        for own in placed.points:
            columns.append((tree.skip + nodes[-1], np.where(tree.leaf < 0, -1, tree.leaf + count), tree.level, rectangle,
                            own[surface.corner], *((who + count, own[what]) for who, what in surface[3:])))
            nodes.append(nodes[-1] + len(tree.skip))
            count += len(surface.corner)
    skip, piece, level, rectangle, corner = (np.concatenate([column[c] for column in columns]) for c in range(5))
    owned = [owned_by(count, np.concatenate([column[c][0] for column in columns]),
                      np.concatenate([column[c][1] for column in columns])) for c in range(5, 8)]
    inner, trees = np.flatnonzero(piece < 0), sum(len(placed.points) for placed in soft)
    lattice = [placed.surface.lattice for placed in (*soft, *others) for _ in placed.points]
    return Pieces(trees, gate(nodes, np.int64), gate(skip, np.int64), gate(piece, np.int64),
                  gate(np.flatnonzero(piece >= 0), np.int64), gate(inner[np.argsort(-level[inner], kind="stable")], np.int64),
                  gate(np.zeros((len(skip), 6)), np.float64), gate(np.zeros(len(skip)), np.float64), gate(rectangle, np.int64),
                  gate(np.zeros((len(skip), 12)), np.float64), gate(lattice, np.float64),
                  gate(np.argsort(piece)[-count:], np.int64), gate(corner, np.int64),
                  *(gate(part, np.int64) for both in owned for part in both))


def owned_by(count: int, owner: Integers, what: Integers) -> tuple[Integers, Integers]:
    """What each of so many pieces owns: where its stretch begins, and all of it piece by piece as columns."""
    order = np.argsort(owner, kind="stable")
    return np.searchsorted(owner[order], np.arange(count + 1)), what[order].T


def body_surfaces(bodies: list[Body], numbering: Numbering, rigid: bool, least: float) -> Iterator[Placed]:
    """The surfaces of all bodies that are rigid, or of those that are not; least: the smallest contact radius, m."""
    for body, index in zip(bodies, numbering.bodies, strict=True):
        if body.shape.rigid == rigid:
            yield Placed(of_body(body.shape, max(body.shape.radius, least)), index)
