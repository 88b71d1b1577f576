"""Mesh colliders as buffers: trees of boxes and pseudonormals for particles, what surrounds each triangle for hulls.

The seven features of a triangle are its face, its sides from corner 0, 1 and 2 on, and its corners.
"""

from typing import NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import Meshes
from verlet_numba.buffers.hulls import Hulls, Ridges
from verlet_numba.scene.body import Floats, Integers
from verlet_numba.scene.clearance import planes
from verlet_numba.scene.colliders import Solid
from verlet_numba.scene.half_edge import HalfEdges, half_edges
from verlet_numba.scene.sphere_trees import halved


class Features(NamedTuple):
    """What a mesh of F triangles knows of their features."""

    normal: Floats              # (F, 7, 3) pseudonormals
    border: Integers            # (F, 7) 1: on the border
    around: list[Integers]      # (7 F,) numbers of the triangles that share the feature, row by row


def features_of(vertices: Floats, triangles: Integers) -> Features:
    """Pseudonormals (Baerentzen & Aanaes 2005), borders and neighbours of all features."""
    built, normals = half_edges(triangles), planes(vertices, triangles)[0]
    twin = built.twin.reshape(-1, 3)
    beyond = np.where(twin >= 0, twin // 3, np.arange(len(triangles))[:, None])         # across each side, or itself
    corner = np.zeros_like(vertices)
    np.add.at(corner, triangles, corner_angles(vertices, triangles)[:, :, None] * normals[:, None])
    normal = np.concatenate([normals[:, None], normals[:, None] + normals[beyond], corner[triangles]], axis=1)
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    on_border = np.zeros(len(vertices), np.int64)
    on_border[built.vertex[built.twin < 0]] = on_border[built.end[built.twin < 0]] = 1
    border = np.concatenate([np.zeros((len(triangles), 1), np.int64), twin < 0, on_border[triangles]], axis=1)
    return Features(normal / np.where(length > 0, length, 1), border, neighbours(built, beyond))


def corner_angles(vertices: Floats, triangles: Integers) -> Floats:
    """(F, 3) rad."""
    place = vertices[triangles]
    ahead, back = np.roll(place, -1, axis=1) - place, np.roll(place, 1, axis=1) - place
    across = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.asarray(np.arctan2(across, np.einsum("fki,fki->fk", ahead, back)))


def neighbours(built: HalfEdges, beyond: Integers) -> list[Integers]:
    """The triangles that share each feature: the triangle itself, those along a side, all at a corner."""
    triangles = built.faces
    order = np.argsort(triangles.ravel(), kind="stable")
    at = np.split(order // 3, np.cumsum(np.bincount(triangles.ravel()))[:-1])            # triangles at each vertex
    found = []
    for t, (corners, others) in enumerate(zip(triangles, beyond, strict=True)):
        found += [np.array([t]), *(np.unique([t, other]) for other in others), *(at[vertex] for vertex in corners)]
    return found


def meshes_of(found: list[Solid], size: int) -> Meshes | None:
    """Trees, corners and normals of all mesh colliders for particles; None without any. size: particles n."""
    if all(solid.surface is None for solid in found):
        return None
    first, closed, nodes, leaves, boxes, corners, normals, borders = [0], [], [], [], [], [], [], []
    triangles = 0
    for solid in found:
        closed.append(1)
        if solid.surface is not None:
            features, place = features_of(*solid.surface), solid.surface[0][solid.surface[1]]
            tree = halved(place.mean(axis=1))
            closed[-1] = int(not features.border.any())
            nodes.append(tree.skip + first[-1])
            leaves.append(np.where(tree.leaf < 0, -1, tree.leaf + triangles))
            boxes.append(boxes_of(tree.skip, tree.leaf, place))
            corners.append(place.reshape(-1, 9))
            normals.append(features.normal.reshape(-1, 21))
            borders.append(features.border)
            triangles += len(place)
        first.append(sum(map(len, nodes)))
    return Meshes(gate(first, np.int64), gate(closed, np.int64), gate(np.concatenate(nodes), np.int64),
                  gate(np.concatenate(leaves), np.int64), gate(np.concatenate(boxes), np.float64),
                  gate(np.concatenate(corners), np.float64), gate(np.concatenate(normals), np.float64),
                  gate(np.concatenate(borders), np.int64), gate(np.zeros((len(found), size)), np.int64))


def boxes_of(skip: Integers, leaf: Integers, place: Floats) -> Floats:
    """(M, 6) boxes around the triangles (F, 3, 3) below each node: leaves in preorder, those of a node side by side."""
    order = leaf[leaf >= 0]
    before: Integers = np.cumsum(leaf >= 0) - (leaf >= 0)                                           # leaves that come before a node
    bounds = np.stack([before, np.append(before, len(order))[skip]], axis=1).ravel()
    low = np.minimum.reduceat(np.append(place.min(axis=1)[order], [[np.inf] * 3], axis=0), bounds)[::2]
    high = np.maximum.reduceat(np.append(place.max(axis=1)[order], [[-np.inf] * 3], axis=0), bounds)[::2]
    return np.concatenate([low, high], axis=1)


def ridges_of(found: list[Solid], hulls: Hulls) -> Ridges | None:
    """What surrounds the features of all triangles among the hulls; None without any."""
    triangle, border, around = np.full(len(hulls.body), -1), [], list[Integers]()
    closed: list[int] = []
    for s, solid in enumerate(found):
        if solid.surface is not None:
            features, mine = features_of(*solid.surface), np.flatnonzero(hulls.solid == s)
            triangle[mine] = len(closed) + np.arange(len(mine))
            closed += [int(not features.border.any())] * len(mine)
            border.append(features.border.ravel())
            around += [mine[numbers] for numbers in features.around]
    if not around:
        return None
    return Ridges(gate(triangle, np.int64), gate(closed, np.int64), gate(np.concatenate(border), np.int64),
                  gate(np.cumsum([0, *map(len, around)]), np.int64), gate(np.concatenate(around), np.int64))
