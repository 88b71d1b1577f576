"""Every structure-of-arrays buffer that kernels work on, and the one gate that makes them.

Particles of the inner numbering: bodies of equal topology form a group of K copies, numbered copy-minor in blocks of
B copies, so that particle p of copy k has the index first + (k // B) P B + p B + k % B. The same particle of
neighbouring copies lies side by side: bodies are vector lanes. Blocks are padded with ghosts, particles of inverse
mass 0 that no constraint moves.

The comment behind a field gives its shape, kind and unit; a test holds it true for built scenes. n particles of the
inner numbering, N particles of the file; real: the precision of the run; a field that may be None belongs to what a
scene may not call for.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

PLANE, BOX, SPHERE, CYLINDER = 0, 1, 2, 3               # Solids.kind
FRAME, SUBSTEP, NUMBER, STAGE = 0, 1, 2, 3              # World.clock
WHOLE, INTEGRATED = 0, 1                                # its stage: where a substep begins, or is taken up again
KINETIC, POTENTIAL, TOTAL, MOMENTUM, ANGULAR, CENTRE = 0, 1, 2, 3, 6, 9         # Frames.measures
ERROR_MAX, ERROR_RMS, PENETRATION, CONTACTS, RELAXATIONS, FALLBACKS, RESTING, SPEED_MAX = 12, 13, 14, 15, 16, 17, 18, 19
COLUMNS = 20


class Particles(NamedTuple):
    """What a particle is (paper, 3.1): where it is, where it was a substep ago, what accelerates it."""

    position: Array             # (3, n) real m
    previous: Array             # (3, n) real m; one substep ago
    inverse_mass: Array         # (n,) real 1/kg; 0: pinned, fixed or a ghost
    acceleration: Array | None  # (3, n) real m/s^2; None where no effect accelerates


class Runs(NamedTuple):
    """Runs of independent distance constraints: number m of run r joins particles first[0, r] + m and first[1, r] + m."""

    first: Array                # (2, R) int 1
    lanes: Array                # (R,) int 1
    data: Array                 # (R,) int 1; where the run's constraints stand in the arrays below
    rest: Array                 # (C,) real m
    weight: Array               # (2, C) real 1; w_i / (w_i + w_j + compliance / h^2); both 0 masks a lane out
    active: int                 # int 1; constraints that are not masked out


class Sticks(NamedTuple):
    """Distance constraints of bodies without copies or structure, one after another; attachments have rest length 0."""

    ends: Array                 # (2, C) int 1
    rest: Array                 # (C,) real m
    weight: Array               # (2, C) real 1; as in Runs


class Angles(NamedTuple):
    """Angles kept: between the sticks from the middle particle to the two others."""

    corners: Array              # (3, A) int 1; end, middle, end
    rest: Array                 # (A,) double rad


class Softness(NamedTuple):
    """Compliant sticks relaxed in several passes: the correction so far is kept over the passes of a substep."""

    share: Array                # (C,) real 1; (compliance / h^2) / (w_i + w_j + compliance / h^2)
    given: Array                # (C,) real m; stretch that the spring's tension already accounts for


class Gravity(NamedTuple):
    acceleration: Array         # (3, n) real m/s^2; 0 for what is pinned


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
    rate: Array                 # (n,) real 1/s


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


class Solids(NamedTuple):
    """Colliders. A room is six planes. Poses are those at the start and at the end of the current substep."""

    kind: Array                 # (K,) int 1; PLANE, BOX, SPHERE or CYLINDER
    extent: Array               # (4, K) double m; plane: normal, offset; box: half edges; else radius, half length
    origin: Array               # (3, K) double m; at the end of the substep
    rotation: Array             # (3, 3, K) double 1; columns are the axes, at the end of the substep
    origin_before: Array        # (3, K) double m
    rotation_before: Array      # (3, 3, K) double 1
    reach: Array                # (K,) double m; radius of a sphere about the origin that holds it, infinite for planes


class Contacts(NamedTuple):
    """Particles that touch a collider in this substep, each a plane that it must stay above."""

    solids: Solids
    radius: Array               # (n,) real m; contact radius
    body: Array                 # (n,) int 1; rigid body that answers as a whole, -1: the particle answers alone
    margin: float               # double m; how near a particle must come to be listed
    listed: Array               # (1,) int 1; how many contacts there are
    particle: Array             # (L,) int 1
    solid: Array                # (L,) int 1
    normal: Array               # (3, L) double 1
    bound: Array                # (L,) double m; normal . position must not be below it
    anchor: Array               # (3, L) double m; the particle's place at the start, carried along by the collider
    push: Array                 # (L,) double m; displacement along the normal given so far
    after: Array                # (L,) int 1; next contact of the same rigid body, -1: none


class Rigid(NamedTuple):
    """Rigid bodies without pins, which answer to contacts as a whole."""

    first: Array                # (G,) int 1; inner index of the first particle
    stride: Array               # (G,) int 1; from one particle to the next
    size: Array                 # (G,) int 1; particles
    head: Array                 # (G,) int 1; first contact of the substep, -1: untouched
    order: Array                # (G,) int 1; bodies that are touched
    touched: Array              # (1,) int 1; how many are
    inverse_mass: Array         # (G,) double 1/kg
    centre: Array               # (3, G) double m
    inverse_inertia: Array      # (6, G) double 1/(kg m^2); xx, yy, zz, xy, xz, yz
    wanted: Array               # (L,) double m; how far a contact has to rise
    given: Array                # (L,) double m; pushes of a rebound
    grip: Array                 # (3, L) double kg m; impulse of friction


class Hulls(NamedTuple):
    """Convex hulls that meet: of rigid bodies (their convex parts) and of colliders. Corners stand hull by hull.

    A hull with a rounding is what lies within that distance of its corners' convex hull: one corner is a sphere.
    """

    body: Array                 # (H,) int 1; rigid body the hull belongs to (Rigid), -1: a collider's, which nothing moves
    start: Array                # (H + 1,) int 1; columns of hull h: start[h] to start[h + 1], a whole number of vectors
    size: Array                 # (H,) int 1; corners; columns after them repeat the first
    particle: Array             # (Q,) int 1; inner index of the corner's particle, -1: a collider's
    corner: Array               # (3, Q) double m; where the corners are
    centre: Array               # (3, H) double m; mean of the corners
    reach: Array                # (H,) double m; radius of the sphere about the centre that holds the hull, rounding included
    rounding: Array             # (H,) double m
    graph: Array                # (H,) int 1; first row of the hull's corners in `neighbours`, -1: corners are scanned
    neighbours: Array           # (E + 1,) int 1; neighbours of the corner of row e: neighbour[neighbours[e]:neighbours[e + 1]]
    neighbour: Array            # (U,) int 1; corner number within the hull


class Pairs(NamedTuple):
    """Pairs of hulls near each other, first < second, in ascending order; what each of them learnt stays with it."""

    listed: Array               # (1,) int 1; how many pairs there are
    first: Array                # (M,) int 1
    second: Array               # (M,) int 1
    axis: Array                 # (3, M) double 1; separating axis of the last substep, which starts the next; 0: none
    face: Array                 # (6, M) int 1; hit face of the last substep: corner numbers of the first hull, of the second; -1: none


class Meetings(NamedTuple):
    """Contacts between hulls: points that are weighted corners of either."""

    listed: Array               # (1,) int 1; how many there are
    pair: Array                 # (T,) int 1; which of Pairs
    corner: Array               # (6, T) int 1; columns of Hulls.corner: three of the first hull, three of the second
    weight: Array               # (6, T) double 1; of each three the sum is 1
    normal: Array               # (3, T) double 1; from the second hull to the first
    gap: Array                  # (T,) double m; normal . (first point - second point) - roundings; negative: penetration


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
    partner: Array              # (X,) int 1; in ascending order


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


class Spheres(NamedTuple):
    """Contacts between particles of deformable bodies; the lists have room for as many pairs as the candidates."""

    candidates: Candidates
    at: Array                   # (3, n) real m; where the particles were when the candidates were listed
    soft: Array                 # (n,) real 1; 1: particle of a deformable body, 0: any other
    margin: float               # double m; how near two spheres must come to be listed
    radius: Array               # (n,) real m; contact radius
    push: Array                 # (P,) double m; how far the pair was moved apart in this substep
    standing: Array             # (P,) double m; overlap at the start of the substep


class Friction(NamedTuple):
    particle: Array             # (2, n) real 1; static and dynamic
    solid: Array                # (2, K) double 1


class Restitution(NamedTuple):
    particle: Array             # (n,) real 1
    solid: Array                # (K,) double 1
    rebound: Array              # (L,) double m; displacement along the normal after the impact, 0 where there is none


class Effects(NamedTuple):
    """What the scene calls for; what it does not is None and no part of the compiled frame."""

    gravity: Gravity | None
    wind: Wind | None
    drag: Drag | None
    damping: Damping | None
    carried: Carried | None
    moving: Moving | None
    contact: Contacts | None
    rigid: Rigid | None
    friction: Friction | None
    restitution: Restitution | None


class Solver(NamedTuple):
    step: float                 # double s
    substeps: int               # int 1; a frame
    passes: int                 # int 1; over all constraints a substep
    tolerance: float | None     # double 1; relative; None: every constraint is relaxed
    approximate: int | None     # int 1; None: exact square roots


class Observed(NamedTuple):
    """What the observables of a frame need to know."""

    scene_order: Array          # (N,) int 1; inner index of each particle of the file
    mass: Array                 # (N,) double kg
    gravity: Array | None       # (3, N) double m/s^2; for the potential energy, pinned particles included
    pairs: Array                # (2, D) int 1; inner indices of the file's distance constraints
    rest: Array                 # (D,) double m


class Snapshot(NamedTuple):
    """The state at a frame's time, kept while the next substep completes the frame's central difference."""

    position: Array             # (3, n) real m
    before: Array               # (3, n) real m; one substep earlier
    counts: Array               # (3,) int 1; relaxations since the last frame; contacts and relaxations of the kept frame


class World(NamedTuple):
    """Everything that a simulation is."""

    particles: Particles
    runs: Runs | None
    runs_softness: Softness | None
    sticks: Sticks | None
    sticks_softness: Softness | None
    angles: Angles | None
    effects: Effects
    solver: Solver
    observed: Observed
    snapshot: Snapshot
    clock: Array                # (4,) int 1; FRAME of the chunk, SUBSTEP of the frame, NUMBER of substeps of all, STAGE


class Frames(NamedTuple):
    """A chunk of frames, particles in the order of the file."""

    position: Array             # (F, N, 3) file m
    velocity: Array | None      # (F, N, 3) file m/s
    measures: Array             # (F, M) double SI; columns as numbered above


def gate(values: Any, dtype: Any) -> Array:
    """The one way into a kernel: C-contiguous, of exactly this type, so that no signature is compiled twice."""
    return np.require(np.asarray(values), dtype=dtype, requirements=["C", "A", "W", "O"])
