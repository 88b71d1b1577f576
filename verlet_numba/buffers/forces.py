"""What accelerates particles, and what moves along paths."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array


class Gravity(NamedTuple):
    acceleration: Array | None  # (3, n) real m/s^2; 0 for what is pinned; None: Particles has it, nothing else accelerates


class Wind(NamedTuple):
    """Triangles that the wind meets, in runs of triangles that share no particle."""

    first: Array                # (3, R) int 1
    lanes: Array                # (R,) int 1
    data: Array                 # (R,) int 1
    velocity: Array             # (3, T) real m/s; of the air
    share: Array                # (3, T) real m^3/kg; density/2 times each corner's third of the force, over its mass


class Drag(NamedTuple):
    linear: Array               # (n,) real 1/s
    quadratic: Array            # (n,) real 1/m
    air: Array | None           # (3, n) real m/s; None in still air


class Damping(NamedTuple):
    gain: Array                 # (n,) double 1; (1 - exp(-r h)) / (r h), r the rate
    loss: Array                 # (n,) double 1/s^2; gain r / h


class Paths(NamedTuple):
    """Piecewise linear motion in time, at rest before the first knot and after the last."""

    first: Array                # (M + 1,) int 1; knots of path m are first[m] to first[m + 1]
    time: Array                 # (Q,) double s
    point: Array                # (3, Q) double m


class Carried(NamedTuple):
    """Pinned particles that follow a path."""

    particle: Array             # (C,) int 1
    path: Array                 # (C,) int 1; which path each follows
    start: Array                # (3, C) double m; position at the path's first knot
    shift: Array                # (3, M) double m; of each path now, since its first knot
    paths: Paths


class Moving(NamedTuple):
    """Colliders that follow a path or spin about an axis through their position."""

    collider: Array             # (M,) int 1
    rotation: Array             # (3, 3, M) double 1; at time 0
    spin: Array                 # (3, M) double rad/s
    paths: Paths
