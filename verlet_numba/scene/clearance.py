"""Signed distances of points from what stands in a scene: positive in free space, in metres.

Plain numpy, used where bodies are placed and examined; the kernels that simulate contact have formulas of their own.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from verlet_numba.scene.body import Floats, Integers
from verlet_numba.scene.schema_colliders import Collider

Surface = tuple[Floats, Integers]       # vertices (P, 3) m about the collider's origin, triangles (F, 3)
CHUNK = 2_000_000                       # point-triangle pairs looked at together


def clearance(collider: Collider, points: Floats, surface: Surface | None = None) -> Floats:
    """Distances (N,) of `points` (N, 3) from a collider where it stands at the start; a mesh needs its `surface`."""
    local = points - origin(collider)
    match collider.kind:
        case "plane":
            normal = np.asarray(collider.normal) / np.linalg.norm(collider.normal)
            return np.asarray(local @ normal)
        case "room":
            return -box_distance(local, collider.size)
        case "box":
            return box_distance(local, collider.size)
        case "sphere":
            return np.asarray(np.linalg.norm(local, axis=1) - collider.radius)
        case "cylinder":
            axis = np.asarray(collider.axis) / np.linalg.norm(collider.axis)
            along = local @ axis
            beside = np.linalg.norm(local - along[:, None] * axis, axis=1)
            # In the half plane of axis and point a cylinder is a box of width 2 r.
            return box_distance(np.stack([beside, along], axis=1), (2 * collider.radius, collider.length))
    if surface is None:
        raise ValueError("the distance from a mesh needs its surface")
    return surface_distance(*surface, local)


def origin(collider: Collider) -> Floats:
    """Where a collider's own origin is at the start."""
    return np.asarray(collider.point if collider.kind == "plane" else collider.position, float)


def box_distance(points: Floats, size: ArrayLike) -> Floats:
    """Distance (N,) of points (N, D) from a box of the given size (D,) about the origin, negative inside."""
    beyond = np.abs(points) - np.asarray(size) / 2
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0))


def planes(positions: Floats, triangles: Integers) -> tuple[Floats, Floats]:
    """Outward unit normals n (F, 3) and offsets d (F,) of the planes n . x = d of triangles."""
    p, q, r = (positions[triangles[:, corner]] for corner in range(3))
    normals = np.cross(q - p, r - p)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.einsum("fi,fi->f", normals, p)


def hull_clearance(positions: Floats, triangles: Integers, points: Floats) -> Floats:
    """Signed distance (N,) from a convex polyhedron inside, and in front of a face; elsewhere outside a lower bound."""
    normals, offsets = planes(positions, triangles)
    return np.asarray((points @ normals.T - offsets).max(axis=1))


def surface_distance(vertices: Floats, triangles: Integers, points: Floats) -> Floats:
    """Distance (N,) from a triangulated surface, negative where a closed one winds around the point (Jacobson et al. 2013)."""
    distance, closed = np.empty(len(points)), is_closed(triangles)
    chunk = max(1, CHUNK // len(triangles))
    for start in range(0, len(points), chunk):
        corners = vertices[triangles][None] - points[start:start + chunk, None, None]         # (n, F, 3, 3)
        a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
        inside = np.abs(_solid_angle(a, b, c).sum(axis=1)) > 2 * np.pi
        nearest = np.sqrt(_squared_distance(a, b, c).min(axis=1))
        distance[start:start + chunk] = np.where(inside & closed, -nearest, nearest)
    return distance


def is_closed(triangles: Integers) -> bool:
    """Whether every side of consistently wound triangles (F, 3) is that of another one too, run along the other way."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    return len(np.setdiff1d(sides[:, 0] * (triangles.max() + 1) + sides[:, 1],
                            sides[:, 1] * (triangles.max() + 1) + sides[:, 0])) == 0


def _solid_angle(a: Floats, b: Floats, c: Floats) -> Floats:
    """Solid angle of triangles abc seen from the origin (Van Oosterom & Strackee 1983)."""
    la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
    above = _dot(a, np.cross(b, c))
    below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    return np.asarray(2 * np.arctan2(above, below))


def _squared_distance(a: Floats, b: Floats, c: Floats) -> Floats:
    """Squared distance of triangles abc from the origin: to the plane if the foot lies within, else to a side."""
    normal = np.cross(b - a, c - a)
    within = np.ones(normal.shape[:-1], np.bool_)
    nearest = np.full(normal.shape[:-1], np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        side = q - p
        within &= _dot(np.cross(side, -p), normal) >= 0
        t = np.clip(-_dot(p, side) / np.maximum(_dot(side, side), np.finfo(float).tiny), 0, 1)
        foot = p + t[..., None] * side
        nearest = np.minimum(nearest, _dot(foot, foot))
    size = _dot(normal, normal)
    height = np.divide(_dot(a, normal)**2, size, out=np.full_like(size, np.inf), where=size > 0)
    return np.where(within & (size > 0), height, nearest)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("...i,...i->...", a, b))


def clear_of_spheres(points: Floats, radius: float, centres: Floats, radii: Floats) -> NDArray[np.bool_]:
    """Which spheres of `radius` about `points` (N, 3) overlap none of the spheres (M, 3), (M,)."""
    clear = np.ones(len(points), np.bool_)
    chunk = max(1, CHUNK // max(1, len(centres)))
    for start in range(0, len(points), chunk):
        apart = points[start:start + chunk, None] - centres
        clear[start:start + chunk] = (_dot(apart, apart) >= (radii + radius)**2).all(axis=1)
    return clear
