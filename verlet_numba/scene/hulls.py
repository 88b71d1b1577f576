"""The convex parts of rigid bodies, which is what they meet others with.

A convex body is one part, the convex hull of its particles. Another one is split by CoACD (Wei, Liu, Ling & Su 2022)
into parts whose corners become particles of it, see `split`: it is never taken for its own hull.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.clearance import Surface
from verlet_numba.scene.half_edge import adjacency
from verlet_numba.scene.shapes import ShapeError, edges

CONVEX = 1e-5           # how far, in parts of the size, a vertex may lie outside the plane of a triangle
CLIMB = 32              # corners above which the support point is found by climbing from neighbour to neighbour
CONCAVITY = 0.05        # how far a part may be from convex, about in parts of half the size
SNAP = 1e-3             # corners of parts closer than this part of the size are one
SHAPES = 256            # whose hulls are remembered


class Part(NamedTuple):
    """A convex hull whose C corners are particles of a body."""

    corners: Integers               # (C,) particle numbers, in ascending order
    triangles: Integers             # (F, 3) particle numbers, counter-clockwise seen from outside
    start: Integers                 # (C + 1,) the neighbours of corner c are neighbour[start[c]:start[c + 1]]
    neighbour: Integers             # (U,) numbers within `corners`; none up to CLIMB corners, which are scanned


@lru_cache(SHAPES)
def hulls_of(shape: Shape) -> tuple[Part, ...]:
    """The convex parts of a rigid body; none of another. The same shape is looked at once."""
    if not shape.rigid:
        return ()
    particles = len(shape.positions)
    if particles <= CLIMB and not shape.parts:
        return (all_of(particles, shape.triangles),)
    return tuple(part(shape.positions, numbers) for numbers in shape.parts or (np.arange(particles),))


def hulls_in_place(body: Body) -> list[Surface]:
    """The convex parts of a body's first copy where it starts."""
    return [surface_of(body.positions[0], hull) for hull in hulls_of(body.shape)]


def surface_of(positions: Floats, hull: Part) -> Surface:
    """Corners (C, 3) of a hull, and its triangles (F, 3) in numbers of corners."""
    return positions[hull.corners], np.searchsorted(hull.corners, hull.triangles)


def all_of(particles: int, triangles: Integers) -> Part:
    """A convex surface of few particles: its own hull, all of whose corners are scanned."""
    return Part(np.arange(particles), triangles, *adjacency(np.zeros((0, 2), np.int64), particles))


def part(positions: Floats, numbers: Integers) -> Part:
    """The convex hull of some particles, given by their numbers.

    Edges within a flat face, where Qhull's triangles split it, are harmless to climbing: it moves on to whatever
    neighbour lies further. Raises ValueError for particles in a plane.
    """
    numbers = np.unique(numbers)
    faces = hull_faces(positions[numbers])
    corners, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3)
    pairs = edges(local) if len(corners) > CLIMB else np.zeros((0, 2), np.int64)
    return Part(numbers[corners], numbers[faces], *adjacency(pairs, len(corners)))


def hull_faces(points: Floats) -> Integers:
    """Triangles (F, 3) of the convex hull of points (N, 3), outwards. Raises ValueError for points in a plane.

    An affine map keeps a hull, so the points are first spread evenly about their mean: flat bodies pose no problem.
    """
    from scipy.spatial import ConvexHull, QhullError

    centred = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred, full_matrices=False)
    if len(spread) < 3 or spread[2] <= 1e-12 * spread[0]:
        raise ValueError("the points lie in a plane")
    try:
        hull = ConvexHull(centred @ axes.T / spread)
    except QhullError as error:
        raise ValueError("the points lie in a plane") from error
    faces = hull.simplices.astype(np.int64)
    p, q, r = np.moveaxis(centred[faces], 1, 0)
    inwards = np.einsum("fi,fi->f", p, np.cross(q, r)) < 0          # the mean lies inside
    faces[inwards] = faces[inwards][:, ::-1]
    return faces


def volume(positions: Floats, triangles: Integers) -> float:
    """Volume inside a closed surface, by the divergence theorem: negative if its triangles point inwards."""
    corners = positions[triangles] - positions.mean(axis=0)
    return float(np.sum(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6)


def is_convex(positions: Floats, triangles: Integers) -> bool:
    """Whether all vertices lie behind the plane of every triangle of a closed surface, up to CONVEX times the size."""
    p, q, r = (positions[triangles[:, corner]] for corner in range(3))
    normal = np.cross(q - p, r - p)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    limit = np.einsum("fi,fi->f", normal, p) + CONVEX * np.ptp(positions, axis=0).max()
    chunk = max(1, 4_000_000 // len(positions))
    return all(((normal[start:start + chunk] @ positions.T).max(axis=1) <= limit[start:start + chunk]).all()
               for start in range(0, len(triangles), chunk))


def decompose(positions: Floats, triangles: Integers) -> list[Floats]:
    """Corners (C, 3) of convex parts that together fill a closed surface, up to CONCAVITY; the same on every run.

    The parts' corners are those of the surface to about 1e-4 of its size, and new ones where the surface is cut.
    Raises ShapeError without the package `coacd`, and for a surface it cannot cut.
    """
    size, centre = np.ptp(positions, axis=0).max(), positions.mean(axis=0)
    return [corners * size + centre for corners in _cut(((positions - centre) / size).tobytes(), triangles.tobytes())]


@lru_cache(SHAPES)
def _cut(vertices: bytes, triangles: bytes) -> tuple[Floats, ...]:
    """Corners of the convex parts of a surface of size 1, cut once for all bodies that have it: it takes seconds."""
    try:
        import coacd
    except ImportError as error:
        raise ShapeError('is not convex, and to split it into convex parts takes a package that is not installed: '
                         'pip install "verlet-numba[mesh]"', "file") from error
    coacd.set_log_level("off")
    surface = coacd.Mesh(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(triangles, np.int64).reshape(-1, 3))
    # A closed surface needs no mending (`preprocess_mode`). The search is a tenth of CoACD's usual one: on tori and
    # dented spheres it finds parts of the same number and volume, six times as fast.
    try:
        parts = coacd.run_coacd(surface, threshold=CONCAVITY, seed=0, preprocess_mode="off", resolution=500,
                                mcts_iterations=20, mcts_nodes=10, mcts_max_depth=2)
    except RuntimeError as error:
        raise ShapeError(f"cannot be split into convex parts ({error})", "file") from error
    if not parts:
        raise ShapeError("cannot be split into convex parts", "file")
    return tuple(np.asarray(corners, np.float64) for corners, _ in parts)


def split(positions: Floats, triangles: Integers) -> tuple[Floats, tuple[Integers, ...]]:
    """Convex parts of a closed surface: particles (P + X, 3), and for each part the numbers of its corners.

    The first P particles are the vertices, as they are. The others are corners of parts where none is near: on cuts.
    """
    from scipy.spatial import cKDTree

    near = SNAP * np.ptp(positions, axis=0).max()
    corners = decompose(positions, triangles)
    points = np.concatenate(corners)
    distance, nearest = cKDTree(positions).query(points)
    number = np.asarray(nearest, np.int64)
    new = np.flatnonzero(distance > near)
    number[new] = len(positions) + _first_near(points[new], near)
    everything = np.concatenate([positions, points[new]])
    parts = []
    for numbers in np.split(number, np.cumsum([len(some) for some in corners])[:-1]):
        try:
            parts.append(part(everything, numbers).corners)
        except ValueError:                          # a sliver that snapping has flattened
            continue
    used = np.unique(np.concatenate([np.arange(len(positions)), *parts]))
    return everything[used], tuple(np.searchsorted(used, numbers) for numbers in parts)


def _first_near(points: Floats, near: float) -> Integers:
    """For each point the first one, itself or earlier, that stands for it: those are all further apart than `near`."""
    from scipy.spatial import cKDTree

    first = np.full(len(points), -1)
    tree = cKDTree(points) if len(points) else None
    for i, point in enumerate(points):
        if tree is not None and first[i] < 0:
            around = np.array(tree.query_ball_point(point, near))
            first[around[first[around] < 0]] = i
    return first
