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

PLANE, BOX, SPHERE, CYLINDER, MESH = 0, 1, 2, 3, 4      # Solids.kind
FRAME, SUBSTEP, NUMBER, STAGE = 0, 1, 2, 3              # World.clock
WHOLE, INTEGRATED, ARRESTED = 0, 1, 2                   # its stage: where a substep begins, or is taken up again
KINETIC, POTENTIAL, TOTAL, MOMENTUM, ANGULAR, CENTRE = 0, 1, 2, 3, 6, 9         # Frames.measures
ERROR_MAX, ERROR_RMS, PENETRATION, CONTACTS, RELAXATIONS, FALLBACKS, RESTING, SPEED_MAX = 12, 13, 14, 15, 16, 17, 18, 19
COLUMNS = 20
RELAXED, RELAXED_KEPT, FALLEN, FALLEN_KEPT = 0, 1, 2, 3                 # Snapshot.counts
FEATURE, BODY, PRINTED = 0, 1, 2                        # Features.point
LOOSE, HUNG, RESTLESS, FIXED = 0, 1, 2, 3               # Rest.kind
POINTS = 8                                              # contacts of a pair of hulls, at most
INSTANCES = 64                                             # instances of a scene in one world, at most
SUMS = 12 * INSTANCES                                      # numbers of Observed.sums where there are several
NO_ROOM = -2                                            # .listed of a list that had too little room
NEARER = 0.5        # of their distance at rest: how near features of one deformable body may come (kernels/near_features.py)


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


class Lines(NamedTuple):
    """Families of parallel chains of distance constraints, each chain solved as a whole (kernels/relax_lines.py).

    Number k of family r joins particles first[r] + k and first[r] + shift[r] + k and goes on from number k - shift[r].
    """

    first: Array                # (R,) int 1
    shift: Array                # (R,) int 1
    lanes: Array                # (R,) int 1
    data: Array                 # (R,) int 1; where the family's constraints stand in the arrays below
    rows: Array                 # (R,) int 1; the family is solved turned, a matrix of so many rows; 0: it is solved as it stands
    active: Array               # (R,) int 1; constraints that are not masked out
    settled: Array              # (R,) double 1; relative error of a stick that is left to the next pass
    rest: Array                 # (C,) real m
    diagonal: Array             # (C,) real 1/kg; w_i + w_j + compliance / h^2, a trace more; 0 masks a lane out
    coupling: Array             # (C,) real 1/kg; w_i where the chain goes on, 0 at its first stick
    vector: Array               # (3, V) real m; scratch of one family: from particle to particle
    pivot: Array                # (V,) real SI; the diagonal of its systems, then the inverse of what elimination leaves
    bond: Array                 # (V,) real SI; what is next to the diagonal
    pull: Array                 # (V,) real SI; the right side, then the multipliers
    moved: Array                # (3, W) real m; how far the particles are moved
    turned: Array               # (3, T) real SI; pivot, bond and pull turned
    marks: Array                # (V,) int 1; of each constraint's chain: 0 settled, 1 to be solved, 2 to be relaxed stick by stick
    singly: Array               # (1,) int 1; chains that were relaxed stick by stick, so far


class Angles(NamedTuple):
    """Angles kept: between the sticks from the middle particle to the two others."""

    corners: Array              # (3, A) int 1; end, middle, end
    rest: Array                 # (A,) double rad


class Softness(NamedTuple):
    """Compliant sticks relaxed in several passes: the correction so far is kept over the passes of a substep."""

    share: Array                # (C,) real 1; (compliance / h^2) / (w_i + w_j + compliance / h^2)
    given: Array                # (C,) real m; stretch that the spring's tension already accounts for


class Graph(NamedTuple):
    """Rigid bodies relaxed outwards from the particle that a collision moved most (paper, 6.2).

    A kind of bodies shares topology and weights, not rest lengths. It has a bucket for the template's own order and one
    for every particle. Buckets whose lists of sticks are images of one list under symmetries of the kind make a family:
    their bodies are relaxed side by side, each as its bucket turns it.
    """

    body: Array                 # (2, G) int 1; inner index of the first particle, column of `rest` of the first stick
    bucket: Array               # (G,) int 1; first bucket of the body's kind, for bodies untouched; that of particle p is p + 1 on
    family: Array               # (D,) int 1; of each bucket
    turn: Array                 # (2, D) int 1; first of the bucket's entries in `places` and in `images`
    sorted: Array               # (4, G) int 1; `body` and the `turn` of its bucket, family by family
    start: Array                # (F + 1,) int 1; bodies of family f are columns start[f] to start[f + 1] of `sorted`
    stride: Array               # (F,) int 1; from one particle of a body to the next
    particles: Array            # (F,) int 1; of each body
    lanes: Array                # (F,) int 1; at most so many bodies are packed side by side
    sticks: Array               # (2, F) int 1; first of the kind's columns in `ends` and `weight`, and one past the last
    listed: Array               # (2, F) int 1; the family's list is entry[listed[0, f]:listed[1, f]]
    entry: Array                # (E,) int 1; lists of sticks of a body
    places: Array               # (W,) int 1; of the images of a body's particles, from its first particle on
    images: Array               # (T,) int 1; of a body's sticks
    ends: Array                 # (2, S) int 1; particles of a body that each stick joins
    weight: Array               # (2, S) real 1; w_i / (w_i + w_j); both 0: a stick between pins
    rest: Array                 # (V,) real m; of one body's sticks after the other's, once for bodies that are alike
    packed: Array               # (3, Q) real m; room for the particles of bodies side by side
    lengths: Array              # (U,) real m; and for their rest lengths


class Collided(NamedTuple):
    """What a collision did to the rigid bodies of a Graph."""

    before: Array               # (3, n) real m; positions before the separation
    moved: Array                # (G,) int 1; particle of the body that the separation moved farthest, -1: none


class Start(NamedTuple):
    """Sticks corrected along their direction at the start of the substep, but for bodies that were hit or change much in it."""

    before: Array | None        # (3, n) real m; positions before contacts; None: nothing touches
    marks: Array                # (n,) real 1; 1: a particle of a body whose sticks take their present direction
    marked: Array               # (1,) int 1; 0: there is none
    first: Array                # (D,) int 1; first particle of bodies side by side
    slots: Array                # (D,) int 1; particles of each
    lanes: Array                # (D,) int 1; bodies
    worst: Array                # (X,) real 1; scratch: the mark of each of them


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


class Solids(NamedTuple):
    """Colliders. A room is six planes. Poses are those at the start and at the end of the current substep."""

    kind: Array                 # (K,) int 1; PLANE, BOX, SPHERE, CYLINDER or MESH
    extent: Array               # (4, K) double m; plane: normal, offset; box: half edges; mesh: 0; else radius, half length
    origin: Array               # (3, K) double m; at the end of the substep
    rotation: Array             # (3, 3, K) double 1; columns are the axes, at the end of the substep
    origin_before: Array        # (3, K) double m
    rotation_before: Array      # (3, 3, K) double 1
    reach: Array                # (K,) double m; radius of a sphere about the origin that holds it, infinite for planes


class Meshes(NamedTuple):
    """Triangles of mesh colliders in their own frames, for particles: a tree of boxes each, nodes in preorder.

    Children of a node are k + 1 and skip[k + 1]. Features of a triangle are its face, its sides from corner 0, 1 and 2 on,
    and its corners. Their normals are the pseudonormals of Baerentzen & Aanaes (2005), the sum of the adjacent faces'
    normals, at corners weighted by angles. A mesh without a border is closed and has an inside; another is a sheet.
    """

    first: Array                # (K + 1,) int 1; nodes of collider k: first[k] to first[k + 1], none of other kinds
    closed: Array               # (K,) int 1; 1: the mesh has no border
    skip: Array                 # (M,) int 1; the node after the subtree; k + 1 of a leaf
    triangle: Array             # (M,) int 1; of a leaf, -1: an inner node
    box: Array                  # (M, 6) double m; least x, y, z, largest x, y, z
    corner: Array               # (F, 9) double m; x, y, z of each
    normal: Array               # (F, 21) double 1; of every feature
    border: Array               # (F, 7) int 1; 1: the feature lies on the border
    side: Array                 # (K, n) int 1; of a sheet that the particle was near last: 1 front, -1 behind; 0: it was not near


class Contacts(NamedTuple):
    """Particles that touch a collider in this substep, each a plane that it must stay above."""

    solids: Solids
    radius: Array               # (n,) real m; contact radius
    body: Array                 # (n,) int 1; rigid body that answers as a whole, -1: the particle answers alone
    planes_only: Array          # (n,) int 1; 1: the particle's body meets all other colliders as a hull
    near: Array                 # (B,) int 1; scratch: which of a batch of particles are near
    within: Array               # (n,) double m; how near a particle must come to be listed: its radius and a margin
    listed: Array               # (1,) int 1; how many contacts there are
    particle: Array             # (L,) int 1
    solid: Array                # (L,) int 1
    normal: Array               # (3, L) double 1
    bound: Array                # (L,) double m; normal . position must not be below it
    anchor: Array               # (3, L) double m; the particle's place at the start, carried along by the collider
    push: Array                 # (L,) double m; displacement along the normal given so far
    memory: Array               # (L,) int 1; which of the arrays below is the contact's
    keeper: Array               # (J,) int 1; collider that a rigid body's particle remembers: particle k has k, n + k, 2 n + k ...
    kept: Array                 # (J,) double kg m; impulse that it gave in the last substep, along the normal
    grip: Array                 # (3, J) double kg m; and across it
    overlap: Array              # (J,) double m; of both when they met, not yet given back
    met: Array                  # (J,) int 1; substep in which they met last


class Rigid(NamedTuple):
    """What answers to contacts as a whole: rigid bodies, behind them particles that meet hulls in this substep, last the world.

    A twist is a translation [m] and a rotation [rad] about the centre.
    """

    bodies: int                 # int 1; rigid bodies G; body b is entity b
    first: Array                # (E,) int 1; inner index of the first particle
    stride: Array               # (E,) int 1; from one particle to the next
    size: Array                 # (E,) int 1; particles
    reach: Array                # (E,) double m; from the centre to the farthest particle, 0 for single particles
    entity: Array               # (n,) int 1; of a particle that is touched on its own, -1: none
    touched: Array              # (1,) int 1; how many entities are touched in this substep
    order: Array                # (E,) int 1; which
    parent: Array               # (E,) int 1; of the forest of islands, -1: untouched
    mass: Array                 # (E, 10) double SI; 1/mass, centre, inverse inertia (xx, yy, zz, xy, xz, yz)
    step: Array                 # (E, 6) double SI; twist since the start of the substep, before contacts
    twist: Array                # (E, 6) double SI; given by the contacts in this pass
    moved: Array                # (E, 6) double SI; given in all passes of the substep
    kick: Array                 # (E, 6) double SI; given to the velocity alone


class Touches(NamedTuple):
    """Contacts between entities, gathered from Contacts and Meetings; an island is what hangs together by them."""

    until: Array                # (3,) int 1; where the touches of colliders, hulls, and particles with hulls end
    islands: Array              # (1,) int 1; how many islands
    first: Array                # (T,) int 1; entity
    second: Array               # (T,) int 1; entity, the last one is the world
    source: Array               # (T,) int 1; contact with a collider, or meeting
    order: Array                # (T,) int 1; touches island by island
    island: Array               # (T + 1,) int 1; where each island begins in `order`
    label: Array                # (E,) int 1; number of the island by its root
    line: Array                 # (T, 18) double SI; normal to the first, arms of both, slide so far, two directions across
    answer: Array               # (T, 9) double SI; wish, 1/response, static and dynamic friction, separation to leave with,
                                # inverse of the responses across (uu, uv, vv), restitution
    given: Array                # (T, 4) double kg m; push, grip in the two directions across, kick along the normal
    recalled: Array             # (T, 4) double kg m; what the last substep ended with: push, grip as a vector on the first entity


class Rest(NamedTuple):
    """Which rigid bodies rest (effects/rest.py). Bodies are numbered as in Hulls.body; an island is named by one of its bodies."""

    drift: float                # double m; a body none of whose particles gets farther from where it was is slow
    wait: int                   # int 1; substeps for which all of an island must have been slow
    awake: Array                # (1,) int 1; bodies of all kinds that move
    kind: Array                 # (G,) int 1; LOOSE, HUNG by pins, RESTLESS: moved by a path or attached, FIXED
    first: Array                # (G,) int 1; inner index of the first particle
    stride: Array               # (G,) int 1; from one particle to the next
    size: Array                 # (G,) int 1; particles
    reach: Array                # (G,) double m; of a sphere about the first particle that holds the body wherever it touches
    body: Array                 # (n,) int 1; rigid body of each particle, -1: none
    free: Array                 # (n,) real 1/kg; inverse mass, 0 of what rests
    anchor: Array               # (3, n) real m; where its body began to be slow; of what rests: a substep before it was put to rest
    quiet: Array                # (H,) int 1; 1: a hull that rests, or of what nothing moves
    depth: Array                # (G,) double m; of an island at rest: how deep its hulls penetrate
    resting: Array              # (G,) int 1; 1: at rest
    slow: Array                 # (G,) int 1; substeps for which the body has been slow
    since: Array                # (G,) int 1; substep after which it was put to rest
    island: Array               # (G,) int 1; with which it rests
    parent: Array               # (G,) int 1; of the forest of islands
    backed: Array               # (G,) int 1; 1: pushed by what nothing moves
    least: Array                # (G,) int 1; of an island: substeps for which all of it has been slow
    roused: Array               # (G,) int 1; 1: an island to wake


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
    solid: Array                # (H,) int 1; collider whose hull it is, -1: none
    local: Array                # (3, Q) double m; corners in the frame of their body or collider
    reach: Array                # (H,) double m; radius of the sphere about the centre that holds the hull, rounding included
    rounding: Array             # (H,) double m
    flat: Array                 # (H,) int 1; 1: it shall rest on its faces, and meets another such hull in several contacts
    graph: Array                # (H,) int 1; first row of the hull's corners in `neighbours`, -1: corners are scanned
    neighbours: Array           # (E + 1,) int 1; neighbours of the corner of row e: neighbour[neighbours[e]:neighbours[e + 1]]
    neighbour: Array            # (U,) int 1; corner number within the hull


class Pairs(NamedTuple):
    """Pairs of hulls near each other, first < second, in ascending order; what each of them learnt stays with it."""

    listed: Array               # (1,) int 1; how many pairs there are
    first: Array                # (M,) int 1
    second: Array               # (M,) int 1
    axis: Array                 # (3, M) double 1; separating axis of the last substep, which starts the next; 0: none
    face: Array                 # (6, M) int 1; hit face of the last substep: corner numbers, three of either hull; -1: none
    push: Array                 # (M,) double kg m; impulse of the last substep between them, along the normal
    points: Array               # (M,) int 1; how many contacts that was at
    given: Array                # (M, 32) double kg m; at each: push, and grip as a vector on the first entity of the touch
    overlap: Array              # (M,) double m; what they overlapped when they met, as far as it is not yet given back
    met: Array                  # (M,) int 1; substep in which they met last


class Search(NamedTuple):
    """What the list of pairs was made for, and the scratch of the search that makes it (kernels/broad.py)."""

    made: Array                 # (1,) int 1; how often a list has been made; 0: never
    anchor: Array               # (3, H) double m; centres when the list was made
    extent: Array               # (H,) double m; reach when the list was made and slack: how far from there a hull may get
    last: Array                 # (2, 3, H) double m; centres at the last two calls
    turn: Array                 # (1,) int 1; which of these two is the older
    radius: Array               # (H,) double m; of the spheres that are searched
    order: Array                # (H,) int 1; hulls, those of a grid side by side
    key: Array                  # (H,) int 1; cell of each, in that order
    inverse: Array              # (G,) double 1/m; cells a metre, of each grid
    grid: Array                 # (4, G) int 1; its first entry in `cell`, its cells, their number from one to the next in y and z
    cell: Array                 # (C,) int 1; where each cell's spheres begin
    sphere: Array               # (S, 4) double m; centre and radius, cell by cell
    tag: Array                  # (S,) int 1; the cell's number and the hull's, as one
    code: Array                 # (M,) int 1; the hulls' numbers of a pair, as one


class Meetings(NamedTuple):
    """Contacts between hulls: points that are weighted corners of either."""

    listed: Array               # (1,) int 1; how many there are
    pair: Array                 # (T,) int 1; which of Pairs
    corner: Array               # (6, T) int 1; columns of Hulls.corner: three of the first hull, three of the second
    weight: Array               # (6, T) double 1; of each three the sum is 1
    normal: Array               # (3, T) double 1; from the second hull to the first
    gap: Array                  # (T,) double m; normal . (first point - second point) - roundings; negative: penetration
    push: Array                 # (T,) double m; how far the features have been moved apart in this substep (paper's response)
    give: Array                 # (2, T) double 1/kg; how they give way: sum of w c^2 over their particles


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


class Spheres(NamedTuple):
    """Contacts between particles of deformable bodies; the lists have room for as many pairs as the candidates."""

    candidates: Candidates
    at: Array                   # (3, n) real m; where the particles were when the candidates were listed
    soft: Array                 # (n,) real 1; 1: particle of a deformable body, 0: any other
    margin: float               # double m; how near two spheres must come to be listed
    radius: Array               # (n,) real m; contact radius
    push: Array                 # (P,) double m; how far the pair was moved apart in this substep
    standing: Array             # (P,) double m; overlap at the start of the substep


class Narrow(NamedTuple):
    """Scratch of the narrow phase: a simplex of at most four vertices, the first ones, that may grow into a polytope."""

    vertex: Array               # (3, V) double m; of the hulls' difference
    label: Array                # (2, V) int 1; the columns of Hulls.corner that it is the difference of
    weight: Array               # (4,) double 1; of the simplex' vertices, the point nearest the origin
    corner: Array               # (3, F) int 1; vertices of a face of the polytope, counterclockwise from outside
    across: Array               # (3, F) int 1; 4 times the face beyond edge e (corner e to e + 1), plus its edge there
    plane: Array                # (4, F) double 1; outward normal and distance from the origin [m]; infinite: no area
    visible: Array              # (F,) int 1; faces that the new vertex sees
    horizon: Array              # (3F + 3,) int 1; edges around them, as in `across`
    stack: Array                # (3F + 3,) int 1; edges still to cross
    seen: Array                 # (2S + 1,) int 1; of S corners: the flood that came by last, a queue; at the end: floods so far


class Beside(NamedTuple):
    """Scratch of the narrow phase on several threads: that of Narrow for every chunk of pairs."""

    vertex: Array               # (J, 3, V) double m
    label: Array                # (J, 2, V) int 1
    weight: Array               # (J, 4) double 1
    corner: Array               # (J, 3, F) int 1
    across: Array               # (J, 3, F) int 1
    plane: Array                # (J, 4, F) double 1
    visible: Array              # (J, F) int 1
    horizon: Array              # (J, 3F + 3) int 1
    stack: Array                # (J, 3F + 3) int 1
    seen: Array                 # (J, 2S + 1) int 1
    found: Array                # (J,) int 1; where the chunk's meetings end


class Manifold(NamedTuple):
    """Scratch of kernels/manifold.py, which gives pairs of hulls several contacts."""

    points: Array               # (T,) int 1; contacts that each of Meetings becomes, 0: it stays as it is
    corner: Array               # (6, T) int 1; those contacts, one after another; as in Meetings
    weight: Array               # (6, T) double 1
    gap: Array                  # (T,) double m
    near: Array                 # (Q,) int 1; columns of a hull's corners near its support plane; as many as a hull has
    spot: Array                 # (4, Q) double m; their coordinates in the plane, height over it, distance to those kept
    column: Array               # (2, 16) int 1; corners of the two support polygons
    polygon: Array              # (2, 2, 16) double m; and where they are in the plane
    distance: Array             # (2, 16, 16) double m; corners of one polygon from the edges of the other
    place: Array                # (3, 64) double m; points that both polygons share: coordinates in the plane, gap
    point_corner: Array         # (6, 64) int 1; the same as weighted corners
    point_weight: Array         # (6, 64) double 1
    ring: Array                 # (64,) int 1; the order of corners or points around their mean
    angle: Array                # (64,) double 1


class Ridges(NamedTuple):
    """The triangles among the hulls, and what surrounds their features (numbered as in Meshes, 7 of each triangle)."""

    triangle: Array             # (H,) int 1; number of the triangle that the hull is, -1: none
    closed: Array               # (F,) int 1; 1: of a mesh without a border, met from the front alone
    border: Array               # (G,) int 1; 1: the feature lies on the border
    start: Array                # (G + 1,) int 1; hulls of the triangles that share feature g: start[g] to start[g + 1] of `around`
    around: Array               # (A,) int 1


class Meet(NamedTuple):
    """How hulls meet."""

    still: Array                # (H,) int 1; 1: nothing moves the hull
    pairs: Pairs
    spare: Pairs
    search: Search
    narrow: Narrow
    beside: Beside | None       # None: one thread
    manifold: Manifold | None   # None: one contact a pair
    meetings: Meetings
    margin: float               # double m; how near two hulls are a contact
    horizon: int                # int 1; substeps that a list of pairs shall last
    coherent: int | None        # int 1; None: nothing is remembered from the last substep
    all_pairs: int | None       # int 1; None: pairs are found by grids
    ridges: Ridges | None       # None: there is no mesh collider


class Trees(NamedTuple):
    """Sphere trees of a scene, and how they are gone through."""

    layered: Layered
    wrapped: Wrapped | None     # None: no rigid body meets a deformable one
    stack: Stack
    itself: int | None          # int 1; None: no body meets itself


class Mixed(NamedTuple):
    """How particles of deformable bodies meet hulls: each is a hull of one corner, the first of its pairs."""

    candidates: Candidates
    at: Array                   # (3, n) real m; where the particles were when the candidates were listed
    hull: Array                 # (n,) int 1; of each particle, -1: none
    begin: Array                # (H + 1,) int 1; scratch: candidates of each hull
    pairs: Pairs
    spare: Pairs
    meetings: Meetings
    narrow: Narrow
    margin: float               # double m; how near a particle must come to be listed
    near: float                 # double m; how near it must come to be a contact
    coherent: int | None        # int 1; None: nothing is remembered from the last substep


class Features(NamedTuple):
    """The paper's response: features of hulls are moved apart."""

    point: int                  # int 1; FEATURE, BODY or PRINTED: which masses place the point where two features meet
    mass: Array                 # (H,) double kg; of the hull's body
    mass_point: Array           # (J,) double kg; the same of hulls of bodies and of particles


class Friction(NamedTuple):
    particle: Array             # (2, n) real 1; static and dynamic
    solid: Array                # (2, Y) double 1; Y = I K: of every instance
    hull: Array                 # (2, H) double 1
    point: Array                # (2, J) double 1; hulls of bodies and of particles


class Restitution(NamedTuple):
    particle: Array             # (n,) real 1
    solid: Array                # (Y,) double 1; Y = I K: of every instance
    hull: Array                 # (H,) double 1
    point: Array                # (J,) double 1; hulls of bodies and of particles
    rebound: Array              # (L,) double m; displacement along the normal after the impact, 0 where there is none


class Orientation(NamedTuple):
    """Rigid bodies that are not to be turned inside out (effects/orientation.py)."""

    first: Array                # (G,) int 1; inner index of the first particle
    stride: Array               # (G,) int 1; from one particle to the next
    size: Array                 # (G,) int 1; particles
    corner: Array               # (4, G) int 1; inner indices of four particles that span a volume
    sign: Array                 # (G,) double 1; of that volume at rest


class Hinges(NamedTuple):
    """Edges between triangles of cloth, in runs of hinges that share no particle. Corners: an edge's ends, wings left and right."""

    first: Array                # (4, R) int 1
    lanes: Array                # (R,) int 1
    data: Array                 # (R,) int 1
    weight: Array               # (4, C) double 1/kg; inverse masses of the corners; all 0 masks a lane out
    rest: Array                 # (2, C) double 1; cosine and sine of the angle at the start
    before: Array               # (C,) double rad; how far the hinge was off its rest when the substep began
    given: Array                # (C,) double rad; what was taken away of that in this substep


class Joints(NamedTuple):
    """Inner particles of ropes, one after another."""

    corners: Array              # (3, J) int 1; the particle before, the particle, the one after
    weight: Array               # (3, J) double 1/kg
    rest: Array                 # (J,) double rad; the angle at the start
    before: Array               # (J,) double rad; as of Hinges
    given: Array                # (J,) double rad


class Bending(NamedTuple):
    """Resistance to bending (effects/bending.py)."""

    share: Array                # (3,) double 1; of the error, of its change in the substep, of what is given so far
    hinges: Hinges | None
    joints: Joints | None


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


class Effects(NamedTuple):
    """What the scene calls for; what it does not is None and no part of the compiled frame."""

    gravity: Gravity | None
    wind: Wind | None
    drag: Drag | None
    damping: Damping | None
    carried: Carried | None
    moving: Moving | None
    contact: Contacts | None
    meshes: Meshes | None
    hulls: Hulls | None
    meet: Meet | None
    trees: Trees | None
    spheres: Spheres | None
    points: Hulls | None        # of rigid bodies and of the particles that meet them
    mixed: Mixed | None
    rigid: Rigid | None
    touches: Touches | None
    features: Features | None
    friction: Friction | None
    restitution: Restitution | None
    rest: Rest | None
    exact: Exact | None
    rapid: Exact | None         # of rigid bodies that go far in a substep (effects/continuous.py)
    orientation: Orientation | None
    bending: Bending | None


class Solver(NamedTuple):
    step: float                 # double s
    substeps: int               # int 1; a frame
    passes: int                 # int 1; over all constraints a substep
    tolerance: float | None     # double 1; relative; None: every constraint is relaxed
    approximate: int | None     # int 1; None: exact square roots


class Observed(NamedTuple):
    """What the observables of a frame need to know.

    A world may hold I instances of a scene (scene/ensemble.py), one unless it is told: particle k of the scene alone is
    particles I k to I k + I - 1. What differs between instances stands in the same way: I values after one another.
    """

    instances: int              # int 1; I
    scene_order: Array          # (N,) int 1; inner index of each particle of the file, of the first instance
    mass: Array                 # (Q,) double kg; Q = I N
    gravity: Array | None       # (3, I) double m/s^2; for the potential energy, pinned particles included
    pairs: Array                # (2, D) int 1; inner indices of the file's distance constraints, of the first instance
    rest: Array                 # (U,) double m; U = I D
    sums: Array | None          # (X,) double SI; scratch of kernels/observe_beside.py; None: there is one instance


class Snapshot(NamedTuple):
    """The state at a frame's time, kept while the next substep completes the frame's central difference."""

    position: Array             # (3, n) real m
    before: Array               # (3, n) real m; one substep earlier
    counts: Array               # (4,) int 1; of each instance: relaxations since the last frame and of the kept one, fallbacks
    touching: Array             # (I,) int 1; contacts of the kept frame


class Stopwatch(NamedTuple):
    """Where the time goes (kernels/stopwatch.py)."""

    clock: int                  # int 1; which of the system's clocks is read
    every: int                  # int 1; one substep in so many is timed
    running: Array              # (1,) int 1; 1: the present one is
    sampled: Array              # (1,) int 1; how many have been
    last: Array                 # (1,) int 1; the last reading of the clock, in nanoseconds
    spent: Array                # (F,) int 1; nanoseconds of each phase
    laps: Array                 # (F,) int 1; how often each has ended
    spec: Array                 # (2,) int 1; the clock's seconds and nanoseconds


class World(NamedTuple):
    """Everything that a simulation is."""

    particles: Particles
    runs: Runs | None
    runs_softness: Softness | None
    sticks: Sticks | None
    sticks_softness: Softness | None
    start: Start | None         # None: sticks are corrected along their present direction
    angles: Angles | None
    lines: Lines | None
    lines_softness: Softness | None
    graph: Graph | None
    collided: Collided | None
    effects: Effects
    solver: Solver
    observed: Observed
    snapshot: Snapshot
    clock: Array                # (4,) int 1; FRAME of the chunk, SUBSTEP of the frame, NUMBER of substeps of all, STAGE
    stopwatch: Stopwatch | None


class Frames(NamedTuple):
    """A chunk of frames, particles in the order of the file, one instance after the other."""

    position: Array             # (F, Q, 3) file m
    velocity: Array | None      # (F, Q, 3) file m/s
    measures: Array             # (F, W) double SI; columns as numbered above
    sound: Array                # (F, I) int 1; 1: all of the instance is finite and in space


def gate(values: Any, dtype: Any) -> Array:
    """The one way into a kernel: C-contiguous, of exactly this type, so that no signature is compiled twice."""
    return np.require(np.asarray(values), dtype=dtype, requirements=["C", "A", "W", "O"])
