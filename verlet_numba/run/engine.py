"""The frame loop as Python sees it: start a model, advance it by a chunk of frames, take its state back."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from verlet_numba._jit import use_threads
from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.world import COLUMNS, FRAME, NUMBER, PENETRATION, SUBSTEP, Frames, Snapshot, World
from verlet_numba.effects.damping import damp
from verlet_numba.effects.drag import resist
from verlet_numba.effects.gravity import fall
from verlet_numba.effects.wind import blow
from verlet_numba.frame import FULL, OK, PAUSED, advance
from verlet_numba.kernels.narrow_beside import CHUNKS
from verlet_numba.kernels.observe import observe, record_velocity
from verlet_numba.scene.build import Model, frames
from verlet_numba.scene.capacity import beside_of, roomier

BUDGET = 64                 # substeps between two looks at signals, at first
PAUSE_SECONDS = 0.1         # the budget doubles while it is done sooner
MANY = 1000                 # hulls: fewer are soon done by one thread


def start(model: Model) -> Model:
    """Positions at time 0, and the previous positions x0 - v0 h + a0 h^2/2: exact for constant acceleration.

    x0 - v0 h alone would put an error of -g h t/2 into free fall.
    """
    particles, h = model.world.particles, model.world.solver.step
    forget_near(model.world)
    position, velocity = model.given()
    velocity *= particles.inverse_mass > 0
    particles.position[:] = position
    particles.previous[:] = position - velocity * h
    if particles.acceleration is not None:
        accelerate(model.world)
        particles.previous[:] = position - velocity * h + 0.5 * h**2 * particles.acceleration
    return model


def spread_over(model: Model, threads: int) -> Model:
    """Have several threads find the contacts of many hulls; the result is the same, bit for bit."""
    meet = model.world.effects.meet
    if threads > 1 and meet is not None and meet.still.size >= MANY:
        use_threads(threads)
        meet = meet._replace(beside=beside_of(meet.narrow, CHUNKS))
        model.world = model.world._replace(effects=model.world.effects._replace(meet=meet))
    return model


def forget_near(world: World) -> None:
    """What was near in another run is not known to be now: exact contact counts ways, it does not compare places."""
    if (exact := world.effects.exact) is not None:
        exact.gaps.listed[:] = 0
        for listing in (exact.among, exact.against):
            if listing is not None:
                listing.made[:] = -1


def restate(model: Model, chunk: Frames) -> None:
    """Frame 0 is the scene's own start: its velocities are the given ones, not a difference that constraints have changed."""
    world, h, measures = model.world, model.world.solver.step, chunk.measures[0]
    (position, velocity), observed = model.given(), world.observed
    deepest = measures[PENETRATION::COLUMNS].copy()
    snapshot = Snapshot(position, position - h * velocity, *(np.zeros_like(counts) for counts in world.snapshot[2:]))
    observe(measures, chunk.sound[0], position + h * velocity, snapshot, observed, h)
    measures[PENETRATION::COLUMNS] = deepest
    record_velocity(chunk.velocity, 0, position + h * velocity, snapshot.before, observed.scene_order, observed.instances, h)


def accelerate(world: World) -> None:
    """What accelerates the particles where they are, as the frame loop finds it."""
    position, previous, _, acceleration = world.particles
    effects, h = world.effects, world.solver.step
    fall(acceleration, effects.gravity)
    blow(position, previous, acceleration, h, effects.wind)
    resist(position, previous, acceleration, h, effects.drag)
    damp(position, previous, acceleration, h, effects.damping)


def grown(world: World) -> World:
    """The same world with twice the room where a list was too short; what was listed so far in this substep is found again."""
    return world._replace(effects=roomier(world.effects))


def run_chunk(model: Model, chunk: Frames, stop: Callable[[], object] = bool) -> int:
    """The next len(chunk.measures) frames; `stop` is asked every so often whether to leave off.

    Returns OK, or DIVERGED with the clock's FRAME at the first that is not sound, or PAUSED with it at the first that is
    not done.
    """
    first = model.world.clock[NUMBER] == 0 and len(chunk.measures) > 0
    model.world.clock[FRAME] = 0
    budget = BUDGET
    while True:
        clock = time.perf_counter()
        status = advance(model.world, chunk, budget)
        if status == FULL:
            model.world = grown(model.world)
        elif status != PAUSED or stop():
            break
        elif time.perf_counter() - clock < PAUSE_SECONDS:
            budget *= 2
    if first and (status == OK or model.world.clock[FRAME] > 0):
        restate(model, chunk)
    return int(status)


def warm(model: Model) -> None:
    """Make or load the machine code of everything that a run of the model calls, by one frame that is then undone."""
    before = State.of(model)
    run_chunk(model, frames(model, 1))
    before.restore(model)


def run_substep(model: Model) -> None:
    """One substep alone, bit for bit as within a chunk: a chunk of one frame of one substep."""
    solver, clock = model.world.solver, model.world.clock
    clock[SUBSTEP] = 0
    model.world = model.world._replace(solver=solver._replace(substeps=1))
    run_chunk(model, frames(model, 1))
    model.world = model.world._replace(solver=solver)


@dataclass(frozen=True)
class State:
    """What changes from substep to substep, copied; restoring it repeats what followed bit for bit."""

    arrays: tuple[Array, ...]

    @staticmethod
    def moving(world: World) -> tuple[Array, ...]:
        """The arrays of a world that a substep leaves changed for the next."""
        particles, effects = world.particles, world.effects
        contact, meet, touches, rest = effects.contact, effects.meet, effects.touches, effects.rest
        arrays = [particles.position, particles.previous, world.clock, world.snapshot.counts]
        if contact is not None:
            solids = contact.solids
            arrays += [solids.origin, solids.rotation, solids.origin_before, solids.rotation_before, contact.listed,
                       contact.particle, contact.push, contact.kept, contact.grip, contact.keeper, contact.overlap, contact.met]
        if meet is not None:
            search, meetings = meet.search, meet.meetings
            arrays += [*meet.pairs, search.made, search.anchor, search.extent, search.last, search.turn,
                       *meetings]
        if effects.meshes is not None:
            arrays += [effects.meshes.side]
        if touches is not None:
            arrays += [touches.until, touches.given]
        if effects.spheres is not None:
            spheres = effects.spheres
            arrays += [*spheres.candidates, spheres.at, spheres.push, spheres.standing]
        if effects.mixed is not None:
            mixed = effects.mixed
            arrays += [*mixed.candidates, mixed.at, *mixed.pairs, *mixed.meetings]
        if effects.exact is not None:
            exact = effects.exact
            arrays += [*exact.gaps, exact.tally, *(part for listing in (exact.among, exact.against) if listing is not None
                                                   for part in listing[2:])]
        if rest is not None:
            arrays += [rest.awake, rest.free, rest.anchor, rest.quiet, rest.resting, rest.slow, rest.since, rest.island, rest.depth]
        return tuple(arrays)

    @classmethod
    def of(cls, model: Model) -> "State":
        return cls(tuple(array.copy() for array in cls.moving(model.world)))

    def restore(self, model: Model) -> None:
        """Buffers of contacts may have grown since: then what was saved is the first part of them."""
        for array, saved in zip(self.moving(model.world), self.arrays, strict=True):
            array[tuple(map(slice, saved.shape))] = saved


def sound(world: World) -> bool:
    """Whether all positions are finite."""
    return bool(np.isfinite(world.particles.position).all())
