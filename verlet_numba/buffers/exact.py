"""Exact contact: pieces of surface, the features near each other, the gaps between them (effects/exact.py)."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.trees import Candidates, Stack

NEARER = 0.5        # of their distance at rest: how near features of one deformable body may come (kernels/near_features.py)


class Pieces(NamedTuple):
    """Pieces of surface that exact contact is between, and a tree over those of each body, nodes in preorder.

    A piece is a cell of a cloth, a segment of a rope, a lone particle or a triangle of a hull; every vertex, edge and triangle
    belongs to one. Corners are points: particles, and behind them the corners of colliders. Trees of deformable bodies come first.
    """

    soft: int                   # int 1; trees of deformable bodies
    root: Array                 # (T + 1,) int 1; nodes of tree t: root[t] to root[t + 1]
    skip: Array                 # (M,) int 1; the node after the subtree; k + 1 of a leaf
    piece: Array                # (M,) int 1; of a leaf, -1: an inner node
    leaf: Array                 # (J,) int 1; all leaves
    inner: Array                # (I,) int 1; all inner nodes, the deepest first
    box: Array                  # (M, 6) double m; least x, y, z, largest x, y, z, with contact radius and slack
    slack: Array                # (M,) double m; the largest of the points below
    rectangle: Array            # (M, 4) int 1; of nodes of cloth: first and last i, first and last j of its cells
    bound: Array                # (M, 12) double m; of its edges along i and along j: least x, y, z each, then largest
    lattice: Array              # (T, 4) double m; spacings, distance and reach of the closest features apart; 0: no cloth
    node: Array                 # (E,) int 1; the leaf that each piece is
    corner: Array               # (E, 4) int 1; of a cell in its order, of others one of them repeated
    vertices: Array             # (E + 1,) int 1; vertices of piece e: vertices[e] to vertices[e + 1] of `vertex`
    vertex: Array               # (V,) int 1
    edges: Array                # (E + 1,) int 1
    edge: Array                 # (2, S) int 1; twice the same point: a lone one
    triangles: Array            # (E + 1,) int 1
    triangle: Array             # (3, F) int 1


class Points(NamedTuple):
    """What exact contact is between, in double precision: the n particles, behind them the corners of colliders."""

    start: Array                # (A, 3) double m; at the start of the substep
    now: Array                  # (A, 3) double m
    shift: Array                # (A, 3) double m; how far overlap that stood already was pushed out, which makes no speed
    soft: Array                 # (D,) int 1; particles of deformable bodies
    free: Array                 # (A,) double 1/kg; inverse mass of a deformable body's particle, 0 of all others
    moves: Array                # (A,) int 1; 1: something moves it but a path
    radius: Array               # (A,) double m; contact radius
    friction: Array | None      # (2, A) double 1; static and dynamic
    same: Array                 # (A,) int 1; the first of the points that it is held together with, itself if with none
    body: Array                 # (A,) int 1; deformable body it belongs to, -1: none
    rest: Array                 # (A, 3) double m; in the body at rest, a rope straight
    whole: Array                # (A,) int 1; rigid body that answers as a whole, -1: none
    solid: Array                # (C,) int 1; collider of each corner
    local: Array                # (3, C) double m; where in its frame


class Listing(NamedTuple):
    """Pairs of features near each other, listed so that none is missed until a point has used up its slack."""

    stack: Stack
    pairs: Candidates           # of pieces
    made: Array                 # (1,) int 1; pairs of features listed; -1: none yet, NO_ROOM: there was no room
    point: Array                # (W, 4) int 1; a vertex and a triangle, or the ends of two edges
    edges: Array                # (W,) int 1; 1: two edges
    reach: Array                # (W,) double m; how near they may come
    left: Array                 # (W,) double m; of the ways of both: when it is looked at again
    slack: Array                # (A,) double m; how far each point may get on its way
    path: Array                 # (A,) double m; its way since
    step: Array                 # (A,) double m; how far it may get in this substep


class Gaps(NamedTuple):
    """Pairs of features that may touch in this substep: their closest points at its start, as weighted corners."""

    listed: Array               # (1,) int 1; how many there are
    point: Array                # (G, 4) int 1; those of the first feature have weights above 0, of the second below
    edges: Array                # (G,) int 1; 1: two edges, the first two points are one of them
    weight: Array               # (G, 4) double 1; of either feature they sum up to 1
    normal: Array               # (G, 3) double 1; from the second to the first
    gap: Array                  # (G,) double m; their distance at the start
    reach: Array                # (G,) double m
    push: Array                 # (G,) double m; how far they were moved apart


class Wholes(NamedTuple):
    """Rigid bodies that exact contact moves as a whole."""

    first: Array                # (B,) int 1; inner index of the first particle
    stride: Array               # (B,) int 1; from one particle to the next
    size: Array                 # (B,) int 1; particles
    mass: Array                 # (B, 10) double SI; as in Rigid
    stamp: Array                # (B,) int 1; 1: weighed in this substep


class Exact(NamedTuple):
    """Exact contact of deformable bodies: vertices with triangles, edges with edges (effects/exact.py)."""

    pieces: Pieces
    points: Points
    itself: int | None          # int 1; None: no body meets itself
    continuous: int | None      # int 1; None: gaps are those at the start of the substep
    among: Listing | None       # of deformable bodies; None: there is one, which does not meet itself
    against: Listing | None     # with rigid bodies and colliders; None: there are none
    gaps: Gaps
    wholes: Wholes | None       # None: there is no rigid body
    scale: Array                # (A,) double 1; scratch: which part of its step a point may take
    drift: Array                # (3,) double m; the step that ways among deformable bodies are relative to
    frame: Array                # (3,) double m; and that points are held back to
    floor: float                # double m; the least step that is allowed for
    least: float                # double m; the least reach of two features of deformable bodies
    tally: Array                # (3,) int 1; lists made, substeps, points held back in all
