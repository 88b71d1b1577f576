"""Rigid bodies from files: a closed surface whose vertices become particles, held by a tetrahedralisation."""

from pathlib import Path

import numpy as np

from verlet_numba.scene import rigidity
from verlet_numba.scene.body import Floats, Integers, Shape
from verlet_numba.scene.clearance import hull_clearance
from verlet_numba.scene.crossing import crossed
from verlet_numba.scene.half_edge import HalfEdges, SurfaceError, half_edges
from verlet_numba.scene.hulls import hull_faces, is_convex, split, volume
from verlet_numba.scene.shapes import ShapeError, edges, share_mass, stick_lengths

FORMATS = (".obj", ".off", ".ply", ".stl")
MERGE = 1e-7            # vertices closer than this part of the size are one
FLAT = 1e-9             # a triangle whose height is below this part of its longest side has no area
LARGEST = 1e9           # coordinate of a vertex, in the file's unit


def mesh(file: Path, *, scale: float = 1.0, mass: float | None = None, density: float | None = None) -> Shape:
    """A rigid body from a triangle mesh, its vertices about the file's origin times `scale`; `density` in kg/m^3.

    The first particles are the vertices in the order of the file, equal ones merged. A surface that is not convex is
    split into convex parts, whose new corners are particles after those. Sticks are the edges of the triangles and of a
    tetrahedralisation (P3 of the paper), and where those leave the body floppy, braces.
    Raises ShapeError, naming the triangle, for a surface that is not closed, consistently wound and free of crossings.
    """
    positions, listed = load(file)                  # in the file's unit, in which all that follows is found
    notes = []
    kept = check_closed(positions, listed)
    triangles = outwards(positions, listed[kept])
    if len(repeated := np.setdiff1d(np.arange(len(listed)), kept)):
        notes.append(f"triangle {repeated[0]} (counted from 0) is in the file twice: it counts once" + _others(repeated))
    enclosed = volume(positions, triangles)
    parts: tuple[Integers, ...] = ()
    if not is_convex(positions, triangles):
        _refuse_first(kept[crossed(positions, triangles)], positions, listed, "is crossed by another")
        positions, parts = split(positions, triangles)
        filled = sum(volume(positions[numbers], hull_faces(positions[numbers])) for numbers in parts)
        notes.append(f"is not convex: it meets others as {len(parts)} convex parts, together of {filled / enclosed:.3g} "
                     "times its volume")
    tetrahedra = tetrahedral_sticks(positions, triangles, parts)
    sticks = rigidity.brace(positions, tetrahedra)
    if len(sticks) > len(tetrahedra):
        notes.append("the rank of the rigidity matrix falls short: the body is braced by "
                     f"{len(sticks) - len(tetrahedra)} sticks through its inside")
    if len(positions) <= rigidity.DENSE_LIMIT and not rigidity.is_rigid(positions, sticks):
        raise ShapeError("cannot be held rigid by sticks: it is too flat", "file")
    positions = positions * scale
    return Shape("mesh", ("points",), positions, share_mass(len(positions), mass, density, enclosed * scale**3),
                 sticks, stick_lengths(positions, sticks), rigid=True, triangles=triangles, parts=parts,
                 notes=tuple(notes))


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


def surface(file: Path) -> tuple[Floats, Integers]:
    """Vertices (P, 3) and triangles (F, 3) of a surface from a file, each triangle once; outwards if it is closed.

    Raises ShapeError, naming the triangle, for one that is not consistently wound or has triangles without area.
    """
    positions, listed = load(file)
    kept, built = check_surface(positions, listed)
    return positions, outwards(positions, listed[kept]) if (built.twin >= 0).all() else listed[kept]


def check_closed(positions: Floats, triangles: Integers) -> Integers:
    """The numbers of the triangles, in ascending order, the first of those that are repeated.

    Raises ShapeError unless all have areas and together are closed, consistently wound surfaces.
    """
    kept, built = check_surface(positions, triangles)
    _refuse_first(kept[built.face[built.twin < 0]], positions, triangles, "has an open side: the surface must be closed")
    _refuse_first(kept[built.pinched()], positions, triangles, "has a corner where the surface meets itself in a point")
    return kept


def check_surface(positions: Floats, triangles: Integers) -> tuple[Integers, HalfEdges]:
    """The numbers of the triangles, in ascending order, the first of those that are repeated, and their half-edges.

    Raises ShapeError unless all have areas and together are consistently wound surfaces.
    """
    p, q, r = (positions[triangles[:, corner]] for corner in range(3))
    longest = np.max([np.linalg.norm(side, axis=1) for side in (q - p, r - q, p - r)], axis=0)
    height = np.linalg.norm(np.cross(q - p, r - p), axis=1)             # times the longest side
    _refuse_first(np.flatnonzero(height <= FLAT * longest**2), positions, triangles, "has no area: remove it")
    smallest_first = triangles[np.arange(len(triangles))[:, None], (triangles.argmin(axis=1)[:, None] + range(3)) % 3]
    kept = np.sort(np.unique(smallest_first, axis=0, return_index=True)[1])
    once = triangles[kept]
    _, same, count = np.unique(np.sort(once, axis=1), axis=0, return_inverse=True, return_counts=True)
    _refuse_first(kept[count[same.ravel()] > 1], positions, triangles, "is in the file twice, wound both ways: remove one")
    try:
        built = half_edges(once)
    except SurfaceError as error:
        raise _refusal(int(kept[error.face]), positions, triangles, str(error)) from error
    return kept, built


def _refuse_first(wrong: Integers, positions: Floats, triangles: Integers, what: str) -> None:
    if len(wrong):
        raise _refusal(int(wrong[0]), positions, triangles, what)


def _refusal(face: int, positions: Floats, triangles: Integers, what: str) -> ShapeError:
    x, y, z = positions[triangles[face]].mean(axis=0)
    return ShapeError(f"triangle {face} (counted from 0, centre {x:.6g} {y:.6g} {z:.6g}) {what}", "file")


def _others(rows: Integers) -> str:
    return f" (and {len(rows) - 1} more)" if len(rows) > 1 else ""


def outwards(positions: Floats, triangles: Integers) -> Integers:
    """The triangles, all turned around if the surface encloses a negative volume."""
    enclosed = volume(positions, triangles)
    if abs(enclosed) < FLAT * np.ptp(positions, axis=0).max() ** 3:
        raise ShapeError("the surface encloses no volume", "file")
    return triangles if enclosed > 0 else np.ascontiguousarray(triangles[:, ::-1])


def tetrahedral_sticks(positions: Floats, triangles: Integers, parts: tuple[Integers, ...] = ()) -> Integers:
    """Edges (C, 2) of the surface and of a Delaunay tetrahedralisation of the particles, without flat tetrahedra.

    Where the body consists of convex parts, only of tetrahedra whose centre lies in one: they need not fit the surface,
    as sticks they hold the particles all the same, and each vertex of the file stays where it is.
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
    if parts:
        centres = unit[solid].mean(axis=1)
        within = [hull_clearance(unit[numbers], hull_faces(unit[numbers]), centres) <= 0 for numbers in parts]
        solid = solid[np.any(within, axis=0)]
    pairs = [solid[:, [i, j]] for i in range(4) for j in range(i + 1, 4)]
    return np.unique(np.sort(np.concatenate([*pairs, edges(triangles)]), axis=1), axis=0)
