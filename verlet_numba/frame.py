"""The frame loop: Verlet integration and relaxation (Jakobsen 2001; Ponce Atencio et al. 2005).

An effect that the scene does not call for is None. Each phase gets that None as an argument of its own and returns at
once; the compiler drops the branch, so the effect is no part of the machine code.
"""

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers import FRAME, INTEGRATED, NUMBER, PENETRATION, STAGE, SUBSTEP, WHOLE
from verlet_numba.effects.contact import find_contacts, penetration, separate, touching
from verlet_numba.effects.damping import damp
from verlet_numba.effects.drag import resist
from verlet_numba.effects.friction import rub
from verlet_numba.effects.gravity import fall
from verlet_numba.effects.motion import carry, move
from verlet_numba.effects.response import gather, rebound, rub_bodies, shove
from verlet_numba.effects.restitution import bounce, foresee
from verlet_numba.effects.wind import blow
from verlet_numba.kernels.integrate import integrate
from verlet_numba.kernels.observe import keep, observe, record, record_velocity
from verlet_numba.kernels.relax import forget, relax_runs, relax_sticks
from verlet_numba.kernels.relax_angles import relax_angles

OK, DIVERGED, FULL = 0, 1, 2


@inlined
def accelerate(particles, effects, h):
    """What accelerates the particles: gravity, wind, drag, damping, each only if the scene calls for it."""
    fall(particles.acceleration, effects.gravity)
    blow(particles.position, particles.previous, particles.acceleration, h, effects.wind)
    resist(particles.position, particles.previous, particles.acceleration, h, effects.drag)
    damp(particles.position, particles.previous, particles.acceleration, h, effects.damping)


@inlined
def relax(world):
    """One pass over all constraints (P6-P10). Returns the number relaxed."""
    particles, solver = world.particles, world.solver
    relaxed = relax_runs(particles.position, world.runs, world.runs_softness, solver.tolerance, solver.approximate)
    relaxed += relax_sticks(particles.position, world.sticks, world.sticks_softness, solver.tolerance, solver.approximate)
    relaxed += relax_angles(particles.position, particles.inverse_mass, world.angles)
    return relaxed


@inlined
def substep(world):
    """One substep, from time number h to (number + 1) h. FULL: the contacts outgrew their buffers; grow and call again."""
    particles, effects, solver, clock = world.particles, world.effects, world.solver, world.clock
    position, previous, contact, h = particles.position, particles.previous, effects.contact, solver.step
    if clock[STAGE] == WHOLE:
        end = (clock[NUMBER] + 1) * h
        accelerate(particles, effects, h)
        integrate(position, previous, particles.acceleration, h)        # Verlet (P5)
        carry(position, end, effects.carried)
        move(contact, end, effects.moving)
        clock[STAGE] = INTEGRATED
    if not find_contacts(position, previous, particles.inverse_mass, contact):
        return FULL
    gather(position, particles.inverse_mass, contact, effects.rigid)
    foresee(position, particles.acceleration, contact, effects.restitution, h)
    forget(world.runs_softness)
    forget(world.sticks_softness)
    for _ in range(solver.passes):
        separate(position, contact)                    # before every pass (P18): last or once only holds less
        shove(position, particles.inverse_mass, contact, effects.rigid)
        world.snapshot.counts[0] += relax(world)
    bounce(position, previous, contact, effects.restitution)
    rebound(position, previous, particles.inverse_mass, contact, effects.restitution, effects.rigid)
    rub(position, contact, effects.friction)
    rub_bodies(position, particles.inverse_mass, contact, effects.friction, effects.rigid)
    clock[NUMBER] += 1
    clock[STAGE] = WHOLE
    return OK


@inlined
def finish(world, frames, f):
    """Frame f, now that the substep after it is done: positions, central differences, observables."""
    particles, snapshot, observed, h = world.particles, world.snapshot, world.observed, world.solver.step
    row = frames.measures[f]
    sound = observe(row, particles.position, snapshot, observed, h)
    row[PENETRATION] = penetration(snapshot.position, particles.inverse_mass, world.effects.contact)
    record(frames.position[f], snapshot.position, observed.scene_order)
    record_velocity(frames.velocity, f, particles.position, snapshot.before, observed.scene_order, h)
    return sound


@kernel
def advance(world, frames):
    """A chunk of frames. A frame is kept at its time and finished one substep later, so that its velocity is central.

    Returns OK, DIVERGED (the frame of the clock is not a number) or FULL. After FULL, and with larger buffers, the
    next call goes on from the same state, bit for bit.
    """
    clock, solver = world.clock, world.solver
    while clock[FRAME] < len(frames.measures):
        while clock[SUBSTEP] < solver.substeps:
            if clock[SUBSTEP] == solver.substeps - 1 and clock[STAGE] == WHOLE:
                keep(world.particles, world.snapshot, touching(world.effects.contact))
            if substep(world) == FULL:
                return FULL
            clock[SUBSTEP] += 1
        if not finish(world, frames, clock[FRAME]):
            return DIVERGED
        clock[SUBSTEP] = 0
        clock[FRAME] += 1
    return OK
