"""Rest geometry of each kind of body: particles in the order of the trajectory file, sticks, triangles.

Every particle of a body has the same mass, and particles coincide with the vertices of the geometry
(Ponce Atencio et al. 2005, section 4). A body's total mass is `mass`, or `density` times its volume, area or length.
"""

from collections.abc import Sequence
from functools import cache
from math import pi, prod, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from verlet_numba.scene.body import Floats, Integers, Shape


class ShapeError(ValueError):
    """A body that cannot be built. `key` is the key of the body's YAML entry that is to blame."""

    def __init__(self, message: str, key: str) -> None:
        super().__init__(message)
        self.key = key


def share_mass(particles: int, mass: float | None, density: float | None, measure: float) -> Floats:
    """Masses (P,) in kg: equal shares of `mass`, or of `density` times `measure` (m, m^2 or m^3) if it is given."""
    if density is not None:
        mass = density * measure
    if mass is None:
        raise ValueError("a body needs a mass or a density")
    return np.full(particles, mass / particles)


def stick_lengths(positions: Floats, sticks: Integers) -> Floats:
    """Distances (C,) between the two ends of each stick."""
    return np.asarray(np.linalg.norm(positions[sticks[:, 1]] - positions[sticks[:, 0]], axis=1))


def edges(triangles: Integers) -> Integers:
    """The edges (E, 2) of triangles (F, 3), each once, smaller particle number first, in ascending order."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.asarray(np.unique(np.sort(sides, axis=1), axis=0))


def rope(start: ArrayLike, end: ArrayLike, segments: int, *, length: float | None = None, mass: float | None = None,
         density: float | None = None, thickness: float = 0.0, compliance: float = 0.0,
         gravity: ArrayLike | None = None) -> Shape:
    """`segments` + 1 particles from `start` to `end` in world coordinates (m), joined one to the next.

    A rope longer than the distance hangs as an arc below its chord, see `hanging_arc`. `density` is in kg/m.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    distance = float(np.linalg.norm(end - start))
    if length is None:
        length = distance
    slack = segments > 1 and length > distance * (1 + 1e-12)
    positions = (hanging_arc(start, end, length, segments, gravity) if slack
                 else start + np.linspace(0, 1, segments + 1)[:, None] * (end - start))
    first = np.arange(segments)
    return Shape("rope", ("line",), positions, share_mass(segments + 1, mass, density, length),
                 np.stack([first, first + 1], axis=1), np.full(segments, length / segments), rigid=False,
                 radius=thickness / 2, compliance=compliance, lines=(np.arange(segments + 1),), segments=True)


def hanging_arc(start: Floats, end: Floats, length: float, segments: int, gravity: ArrayLike | None) -> Floats:
    """Particles (segments + 1, 3) evenly spaced on a circular arc from `start` to `end`, every chord length / segments.

    Let each of the n segments turn by 2u against the one before. Segment k then makes the angle (n - 1 - 2k) u with
    the chord, and the n of them together span the distance d, where

        d / length = sin(n u) / (n sin u),

    which falls from 1 at u = 0 (straight) to 0 at u = pi / n (a closed polygon): bisection finds u.
    The arc lies in the plane of chord and gravity, on the side gravity points to.
    """
    chord = end - start
    distance = float(np.linalg.norm(chord))
    low, high = 0.0, pi / segments
    while low < (middle := (low + high) / 2) < high:
        if sin(segments * middle) * length > distance * segments * sin(middle):
            low = middle
        else:
            high = middle
    angles = (segments - 1 - 2 * np.arange(segments)) * high
    along, down = _sagging_frame(chord, distance, gravity)
    steps = length / segments * (np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * down)
    positions: Floats = start + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    positions[-1] = end
    return positions


def _sagging_frame(chord: Floats, distance: float, gravity: ArrayLike | None) -> tuple[Floats, Floats]:
    """Unit vectors along the chord and, at right angles to it, towards which the rope sags.

    That is where gravity points (-z without gravity), or +x if the chord is parallel to gravity.
    """
    pull = np.zeros(3) if gravity is None else np.asarray(gravity, float)
    pull = pull / np.linalg.norm(pull) if pull.any() else np.array([0.0, 0.0, -1.0])
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    sideways = x if abs(pull[0]) < 0.9 else z       # never parallel to gravity
    if distance == 0:                               # a loop hangs from its one fixed point, on edge
        along = sideways - (sideways @ pull) * pull
        return along / np.linalg.norm(along), pull
    along = chord / distance
    down = pull - (pull @ along) * along
    if np.linalg.norm(down) < 1e-9:
        down = sideways - (sideways @ along) * along
    return along, down / np.linalg.norm(down)


def cloth(size: Sequence[float], resolution: Sequence[int], *, diagonals: str = "both", mass: float | None = None,
          density: float | None = None, thickness: float = 0.0, compliance: float = 0.0) -> Shape:
    """A rectangle of nx x ny particles in the xy plane about the origin; particle (i, j) has number i ny + j.

    Sticks come in families: along x, along y, the diagonals (i, j) (i+1, j+1) of the triangles, and, with
    `diagonals="both"`, the others. `size` in m, `density` in kg/m^2.
    """
    nx, ny = resolution
    x, y = (side * (np.arange(n) / (n - 1) - 0.5) for side, n in zip(size, resolution, strict=True))
    positions = np.zeros((nx, ny, 3))
    positions[..., 0], positions[..., 1] = x[:, None], y
    number = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = (corner.ravel() for corner in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    families = [(number[:-1].ravel(), number[1:].ravel()), (number[:, :-1].ravel(), number[:, 1:].ravel()), (a, c)]
    if diagonals == "both":
        families.append((b, d))
    sticks = np.concatenate([np.stack(family, axis=1) for family in families])
    triangles = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3)
    points = positions.reshape(-1, 3)
    return Shape("cloth", ("grid", nx, ny), points, share_mass(nx * ny, mass, density, size[0] * size[1]),
                 sticks, stick_lengths(points, sticks), rigid=False, radius=thickness / 2, compliance=compliance,
                 triangles=triangles)


# The six faces of a box, counter-clockwise seen from outside, each split from its first corner to its third.
# The six diagonals join the corners 0, 3, 5, 6, so the shape keeps the symmetry of a tetrahedron.
_BOX_FACES = ((0, 1, 3, 2), (5, 4, 6, 7), (0, 4, 5, 1), (3, 7, 6, 2), (0, 2, 6, 4), (3, 1, 5, 7))


@cache
def _box_template() -> tuple[Floats, Integers, Integers]:
    """Corners (8, 3) of a box of size 1, triangles (12, 3), sticks (22, 2)."""
    corners = np.array([(ix, iy, iz) for ix in (0, 1) for iy in (0, 1) for iz in (0, 1)]) - 0.5
    triangles = np.array([t for p, q, r, s in _BOX_FACES for t in ((p, q, r), (p, r, s))])
    return corners, triangles, np.concatenate([edges(triangles), [[i, 7 - i] for i in range(4)]])


def box(size: Sequence[float], *, mass: float | None = None, density: float | None = None) -> Shape:
    """Eight particles at the corners, number 4 ix + 2 iy + iz, about the origin (`size` in m).

    18 triangle edges and the 4 main diagonals are sticks. The 12 edges of the box and the diagonals alone would have a
    rigidity matrix of rank 15 where 18 are needed.
    """
    unit, triangles, sticks = _box_template()
    corners = unit * size
    return Shape("box", ("points",), corners, share_mass(8, mass, density, prod(size)),
                 sticks, stick_lengths(corners, sticks), rigid=True, triangles=triangles)


@cache
def _icosahedron_template() -> tuple[Floats, Integers, Integers]:
    """Vertices (12, 3) at distance 1 from the origin, triangles (20, 3), sticks (36, 2).

    The vertices are the even permutations of (0, ±1, ±phi), phi the golden ratio, of length sqrt(1 + phi^2).
    """
    phi = (1 + sqrt(5)) / 2
    corners = np.array([(0, i, j * phi) for i in (-1, 1) for j in (-1, 1)])
    vertices = np.concatenate([np.roll(corners, turn, axis=1) for turn in range(3)])
    triangles = _neighbour_triangles(vertices, side=2.0)
    opposite = [(i, int(np.argmin(vertices @ vertices[i]))) for i in range(12)]
    sticks = np.concatenate([edges(triangles), [pair for pair in opposite if pair[0] < pair[1]]])
    return vertices / sqrt(1 + phi * phi), triangles, sticks


def icosahedron(radius: float, *, mass: float | None = None, density: float | None = None) -> Shape:
    """Twelve particles at distance `radius` (m) from the origin; 30 edges and 6 diagonals are sticks."""
    unit, triangles, sticks = _icosahedron_template()
    positions = unit * radius
    side = radius / sin(2 * pi / 5)
    volume = 5 * (3 + sqrt(5)) / 12 * side**3
    return Shape("icosahedron", ("points",), positions, share_mass(12, mass, density, volume),
                 sticks, stick_lengths(positions, sticks), rigid=True, triangles=triangles)


def _neighbour_triangles(points: Floats, side: float) -> Integers:
    """All triangles of the given side between points about the origin, turned outwards."""
    near = np.abs(np.linalg.norm(points[:, None] - points, axis=2) - side) < 0.01 * side
    count = range(len(points))
    triples = np.array([(i, j, k) for i in count for j in count[i:] if near[i, j]
                        for k in count[j:] if near[i, k] and near[j, k]])
    inwards = np.linalg.det(points[triples]) < 0
    triples[inwards] = triples[inwards][:, [0, 2, 1]]
    return triples


def particles(positions: ArrayLike, masses: ArrayLike, *, sticks: Sequence[Sequence[float]] = (),
              angles: Sequence[Sequence[float]] = (), radius: float = 0.0, compliance: float = 0.0,
              segments: bool = False) -> Shape:
    """Point masses (kg) at world coordinates (m).

    A stick [i, j] keeps the initial distance, [i, j, length] another (m). An angle [i, j, k] keeps the initial angle at
    j, [i, j, k, degrees] another. segments: sticks collide as capsules.
    """
    points = np.asarray(positions, float).reshape(-1, 3)
    weights = np.asarray(masses, float)
    pairs = np.array([stick[:2] for stick in sticks], np.int64).reshape(-1, 2)
    triples = np.array([angle[:3] for angle in angles], np.int64).reshape(-1, 3)
    lengths = stick_lengths(points, pairs)
    for row, stick in enumerate(sticks):
        if len(stick) == 3:
            lengths[row] = stick[2]
    values = _angles_at_middle(points, triples)
    for row, angle in enumerate(angles):
        if len(angle) == 4:
            values[row] = np.deg2rad(angle[3])
    return Shape("particles", ("points",), points, weights, pairs, lengths, rigid=False, radius=radius,
                 compliance=compliance, angles=triples, angle_values=values, lines=tuple(pairs), segments=segments)


def _angles_at_middle(points: Floats, triples: Integers) -> Floats:
    """Angles (A,) in rad at the middle of three particles each, by atan2 so that they are exact near 0 and pi."""
    u = points[triples[:, 0]] - points[triples[:, 1]]
    v = points[triples[:, 2]] - points[triples[:, 1]]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.sum(u * v, axis=1)))
