"""Everything that a simulation is, and the frames that come of it."""

from typing import NamedTuple

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.constraints import Angles, Bending, Collided, Graph, Lines, Particles, Runs, Softness, Start, Sticks
from verlet_numba.buffers.contact import Contacts, Features, Friction, Meshes, Orientation, Rest, Restitution, Rigid, Touches
from verlet_numba.buffers.exact import Exact
from verlet_numba.buffers.forces import Carried, Damping, Drag, Gravity, Moving, Wind
from verlet_numba.buffers.hulls import Hulls, Meet, Mixed
from verlet_numba.buffers.trees import Spheres, Trees

FRAME, SUBSTEP, NUMBER, STAGE = 0, 1, 2, 3              # World.clock
WHOLE, INTEGRATED, ARRESTED = 0, 1, 2                   # its stage: where a substep begins, or is taken up again
KINETIC, POTENTIAL, TOTAL, MOMENTUM, ANGULAR, CENTRE = 0, 1, 2, 3, 6, 9         # Frames.measures
ERROR_MAX, ERROR_RMS, PENETRATION, CONTACTS, RELAXATIONS, FALLBACKS, RESTING, SPEED_MAX = 12, 13, 14, 15, 16, 17, 18, 19
COLUMNS = 20
RELAXED, RELAXED_KEPT, FALLEN, FALLEN_KEPT = 0, 1, 2, 3                 # Snapshot.counts
INSTANCES = 64                                          # instances of a scene in one world, at most
SUMS = 12 * INSTANCES                                   # numbers of Observed.sums where there are several


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
