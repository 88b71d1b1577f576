"""Particles, and what keeps distances and angles between them."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array


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
