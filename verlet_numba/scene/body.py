"""What a scene's bodies become before they are numbered: rest geometry, and where its copies start."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Shape:
    """Rest geometry and constraints of one copy of a body, particles in the order of the trajectory file.

    `layout` tells how the particles are arranged, so that constraints can be grouped into vector lanes:
    ("line",) particle k is joined to k + 1; ("grid", nx, ny) particle (i, j) is number i ny + j; ("points",) no structure.
    """

    kind: str                       # rope | cloth | box | icosahedron | mesh | particles
    layout: tuple[str | int, ...]
    positions: Floats               # (P, 3) m, about the body's own origin, before rotation
    masses: Floats                  # (P,) kg
    sticks: Integers                # (C, 2) particle numbers
    lengths: Floats                 # (C,) m, rest lengths
    rigid: bool                     # box, icosahedron, mesh
    radius: float = 0.0             # m, contact radius of every particle
    compliance: float = 0.0         # m/N of every stick
    angles: Integers = field(default_factory=lambda: np.zeros((0, 3), np.int64))     # (A, 3): the angle at the middle one
    angle_values: Floats = field(default_factory=lambda: np.zeros(0))                # (A,) rad
    triangles: Integers = field(default_factory=lambda: np.zeros((0, 3), np.int64))  # (F, 3)
    lines: tuple[Integers, ...] = ()                                                 # polylines, for files and pictures
    parts: tuple[Integers, ...] = ()                    # particles at the corners of each convex part; none: it is convex
    segments: bool = False              # whether its sticks collide as capsules where contact is exact
    notes: tuple[str, ...] = ()                         # what is to be said of the file it comes from


@dataclass(frozen=True, eq=False)
class Body:
    """One entry of a scene's `bodies`: a shape and where its K copies start."""

    name: str
    shape: Shape
    positions: Floats               # (K, P, 3) m, world
    velocities: Floats              # (K, P, 3) m/s, world
    pinned: NDArray[np.bool_]       # (P,) held where it is, or carried along `path`
    friction: tuple[float, float]   # static, dynamic
    restitution: float
    path: Floats | None = None      # (M, 4) t, x, y, z: s, m; pinned particles are carried by path(t) - path(first)

    @property
    def copies(self) -> int:
        return len(self.positions)
