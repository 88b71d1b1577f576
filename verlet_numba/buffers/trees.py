"""Sphere trees of bodies, and what is near each other by them."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array


class Layered(NamedTuple):
    """Sphere trees of deformable bodies, one a body, nodes in preorder: a node's children are k + 1 and skip[k + 1].

    Leaves are particles; a parent encloses the spheres of its children. A node is visited alone, so its numbers stand
    side by side. Nodes of a cloth's tree are rectangles of its lattice; those that are not small have bounds on their edges.
    """

    root: Array                 # (T + 1,) int 1; nodes of tree t: root[t] to root[t + 1]
    skip: Array                 # (M,) int 1; the node after the subtree; k + 1 of a leaf
    particle: Array             # (M,) int 1; of a leaf, -1: an inner node
    leaf: Array                 # (J,) int 1; all leaves
    inner: Array                # (I,) int 1; all inner nodes, the deepest first
    sphere: Array               # (M, 4) double m; centre and radius
    row: Array                  # (M,) int 1; where the node's bounds stand, -1: it has none
    node: Array                 # (R,) int 1; in ascending order
    rectangle: Array            # (R, 4) int 1; first and last i, first and last j
    bound: Array                # (R, 12) double m; of edges along i and along j: least x, y, z each, then largest
    start: Array                # (E + 1,) int 1; of row r, if its children have none: edges along i from start[2 r] on, along j
    ends: Array                 # (2, U) int 1; from start[2 r + 1] on; leaves at tail and head
    lattice: Array              # (T, 4) double m; spacing along i, along j, closest pair at rest that may meet, contact radius
    radius: Array               # (n,) real m; contact radius
    apart: Array                # (n + 1,) int 1; particle p never meets partner[apart[p]:apart[p + 1]]
    partner: Array              # (X,) int 1; in ascending order, hulls numbered from n on


class Wrapped(NamedTuple):
    """Sphere trees of rigid bodies, one a body, nodes in preorder: a sphere is the smallest of all points below it.

    It is that of its at most four support points, which move with the body. A sphere is computed when it is visited.
    """

    root: Array                 # (T + 1,) int 1; nodes of tree t: root[t] to root[t + 1]
    skip: Array                 # (M,) int 1; the node after the subtree; k + 1 of a leaf
    leaf: Array                 # (M,) int 1; number of the leaf, counted through all trees; -1: an inner node
    support: Array              # (M, 4) int 1; columns of the points that the trees are about; fewer than four repeat the first
    sphere: Array               # (M, 4) double m; centre and radius
    stamp: Array                # (M,) int 1; the time at which the sphere was computed
    now: Array                  # (1,) int 1; the present time, counted in substeps


class Stack(NamedTuple):
    """Pairs of nodes still to be visited; long enough for the deepest descent."""

    first: Array                # (S,) int 1
    second: Array               # (S,) int 1


class Candidates(NamedTuple):
    """Pairs that are nearer than a margin: two particles, the smaller number first, or a particle and a rigid leaf."""

    listed: Array               # (1,) int 1; how many there are; -1: not looked for yet
    first: Array                # (P,) int 1
    second: Array               # (P,) int 1


class Trees(NamedTuple):
    """Sphere trees of a scene, and how they are gone through."""

    layered: Layered
    wrapped: Wrapped | None     # None: no rigid body meets a deformable one
    stack: Stack
    itself: int | None          # int 1; None: no body meets itself


class Spheres(NamedTuple):
    """Contacts between particles of deformable bodies; the lists have room for as many pairs as the candidates."""

    candidates: Candidates
    at: Array                   # (3, n) real m; where the particles were when the candidates were listed
    soft: Array                 # (n,) real 1; 1: particle of a deformable body, 0: any other
    margin: float               # double m; how near two spheres must come to be listed
    radius: Array               # (n,) real m; contact radius
    push: Array                 # (P,) double m; how far the pair was moved apart in this substep
    standing: Array             # (P,) double m; overlap at the start of the substep
