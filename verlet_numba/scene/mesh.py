"""Rigid bodies from files: a closed convex surface whose vertices become particles, held by a tetrahedralisation."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from verlet_numba.scene import rigidity
from verlet_numba.scene.body import Floats, Integers, Shape
from verlet_numba.scene.shapes import ShapeError, edges, share_mass, stick_lengths

FORMATS = (".obj", ".off", ".ply", ".stl")
MERGE = 1e-7            # vertices closer than this part of the size are one
FLAT = 1e-9             # a triangle whose height is below this part of its longest side has no area
LARGEST = 1e9           # coordinate of a vertex, in the file's unit
CONVEX = 1e-5           # how far, in parts of the size, a vertex may lie outside the plane of a triangle


def mesh(file: Path, *, scale: float = 1.0, mass: float | None = None, density: float | None = None) -> Shape:
    """A rigid body from a triangle mesh, its vertices about the file's origin times `scale`; `density` in kg/m^3.

    Particles are the vertices in the order of the file, equal ones merged. Sticks are the edges of the triangles and of
    a Delaunay tetrahedralisation (P3 of the paper: all edges of a 3D triangulation).
    Raises ShapeError, naming the triangle, for a surface that is not closed, consistently wound and convex.
    """
    positions, triangles = load(file)
    positions = positions * scale
    check_closed(positions, triangles)
    triangles = outwards(positions, triangles)
    check_convex(positions, triangles)
    sticks = rigidity.brace(positions, tetrahedral_sticks(positions, triangles))
    if len(positions) <= rigidity.DENSE_LIMIT and not rigidity.is_rigid(positions, sticks):
        raise ShapeError("cannot be held rigid by sticks: it is too flat", "file")
    return Shape("mesh", ("points",), positions,
                 share_mass(len(positions), mass, density, volume(positions, triangles)),
                 sticks, stick_lengths(positions, sticks), rigid=True, triangles=triangles)


def load(file: Path) -> tuple[Floats, Integers]:
    """Vertices (P, 3), equal ones merged and unused ones left out, and triangles (F, 3) of a mesh file.

    Polygons with more corners are split into triangles. Raises ShapeError for a file that cannot be read.
    """
    import trimesh  # imported here: it takes a second, and most scenes have no mesh

    if file.suffix.lower() not in FORMATS:
        raise ShapeError(f"{file.name}: not a mesh format that can be read: use {', '.join(FORMATS)}", "file")
    if not file.is_file():
        raise ShapeError(f"{file}: no such file (paths count from the folder of the scene)", "file")
    try:
        surface = trimesh.load_mesh(file, process=False, skip_materials=True)
        positions, triangles = np.array(surface.vertices, np.float64), np.array(surface.faces, np.int64)
    except Exception as error:      # whatever a broken file does to the parser
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ShapeError(f"{file.name}: not a readable mesh ({reason})", "file") from error
    if len(triangles) == 0:
        raise ShapeError(f"{file.name}: has no triangles", "file")
    unknown = np.flatnonzero(((triangles < 0) | (triangles >= len(positions))).any(axis=1))
    if len(unknown):
        raise ShapeError(f"triangle {unknown[0]} uses a vertex that does not exist", "file")
    if not (np.abs(positions[triangles]) <= LARGEST).all():
        raise ShapeError(f"{file.name}: has coordinates that are not finite or beyond {LARGEST:g}", "file")
    return _merged(positions, triangles)


def _merged(positions: Floats, triangles: Integers) -> tuple[Floats, Integers]:
    used, corners = np.unique(triangles, return_inverse=True)
    positions = positions[used]
    size = np.ptp(positions, axis=0).max()
    grid = np.round((positions - positions.min(axis=0)) / (MERGE * size if size > 0 else 1))
    _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)                       # keep the order of the file
    number = np.argsort(order)
    return positions[first[order]], number[inverse.ravel()][corners].reshape(-1, 3)


def check_closed(positions: Floats, triangles: Integers) -> None:
    """Raises ShapeError unless triangles have areas, differ, and each side meets one other triangle the other way."""
    p, q, r = (positions[triangles[:, corner]] for corner in range(3))
    longest = np.max([np.linalg.norm(side, axis=1) for side in (q - p, r - q, p - r)], axis=0)
    height = np.linalg.norm(np.cross(q - p, r - p), axis=1)             # times the longest side
    _refuse_first(height <= FLAT * longest**2, positions, triangles, "has no area: remove it")
    _, same, count = np.unique(np.sort(triangles, axis=1), axis=0, return_inverse=True, return_counts=True)
    _refuse_first(count[same.ravel()] > 1, positions, triangles, "is in the file twice: remove one")

    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)        # (3 F, 2), directed
    _, edge, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    shared = count[edge.ravel()].reshape(-1, 3)
    _refuse_first((shared == 1).any(axis=1), positions, triangles, "has an open side: the surface must be closed")
    _refuse_first((shared > 2).any(axis=1), positions, triangles, "has a side in common with more than one other")
    _, way, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    _refuse_first((count[way.ravel()] > 1).reshape(-1, 3).any(axis=1), positions, triangles,
                  "is wound against its neighbour: turn it around")


def _refuse_first(wrong: ArrayLike, positions: Floats, triangles: Integers, what: str) -> None:
    if np.any(wrong):
        face = int(np.flatnonzero(wrong)[0])
        x, y, z = positions[triangles[face]].mean(axis=0)
        raise ShapeError(f"triangle {face} (counted from 0, centre {x:.6g} {y:.6g} {z:.6g}) {what}", "file")


def volume(positions: Floats, triangles: Integers) -> float:
    """Volume inside a closed surface, by the divergence theorem: negative if its triangles point inwards."""
    corners = positions[triangles] - positions.mean(axis=0)
    return float(np.sum(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6)


def outwards(positions: Floats, triangles: Integers) -> Integers:
    """The triangles, all turned around if the surface encloses a negative volume."""
    enclosed = volume(positions, triangles)
    if abs(enclosed) < FLAT * np.ptp(positions, axis=0).max() ** 3:
        raise ShapeError("the surface encloses no volume", "file")
    return triangles if enclosed > 0 else np.ascontiguousarray(triangles[:, ::-1])


def check_convex(positions: Floats, triangles: Integers) -> None:
    """Raises ShapeError unless all vertices lie behind the plane of every triangle, up to CONVEX times the size."""
    p, q, r = (positions[triangles[:, corner]] for corner in range(3))
    normal = np.cross(q - p, r - p)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outside = np.empty(len(triangles))
    chunk = max(1, 4_000_000 // len(positions))
    for start in range(0, len(triangles), chunk):
        part = slice(start, start + chunk)
        outside[part] = (normal[part] @ positions.T).max(axis=1) - np.einsum("fi,fi->f", normal[part], p[part])
    _refuse_first(outside > CONVEX * np.ptp(positions, axis=0).max(), positions, triangles,
                  "lies in a dent: a body must be convex (make several convex bodies of it, or a collider)")


def tetrahedral_sticks(positions: Floats, triangles: Integers) -> Integers:
    """Edges (C, 2) of the surface and of a Delaunay tetrahedralisation of its vertices, without flat tetrahedra.

    Where more than four points lie on a sphere, as in a cube, the tetrahedralisation is one of several, and may hold
    tetrahedra without volume, whose edges would cross within a face.
    """
    from scipy.spatial import Delaunay, QhullError

    unit = (positions - positions.mean(axis=0)) / np.ptp(positions, axis=0).max()
    try:
        tetrahedra = Delaunay(unit).simplices.astype(np.int64)
    except QhullError as error:
        raise ShapeError("cannot be split into tetrahedra: it is too flat or too thin", "file") from error
    corners = unit[tetrahedra]
    six_volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    solid = tetrahedra[six_volumes > 1e-9 * six_volumes.sum()]
    pairs = [solid[:, [i, j]] for i in range(4) for j in range(i + 1, 4)]
    return np.unique(np.sort(np.concatenate([*pairs, edges(triangles)]), axis=1), axis=0)
