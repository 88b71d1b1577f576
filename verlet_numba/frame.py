"""The frame loop: Verlet integration and relaxation (Jakobsen 2001; Ponce Atencio et al. 2005).

An effect that the scene does not call for is None. Each phase gets that None as an argument of its own and returns at
once; the compiler drops the branch, so the effect is no part of the machine code. The world is taken apart once, before
the loop.
"""

from verlet_numba._jit import entry
from verlet_numba.buffers.world import ARRESTED, FRAME, INTEGRATED, NUMBER, PENETRATION, RELAXED, RESTING, STAGE, SUBSTEP, WHOLE
from verlet_numba.effects.aim import aim_colliders, aim_hulls, respond
from verlet_numba.effects.bending import unbend
from verlet_numba.effects.contact import penetration, separate, touching
from verlet_numba.effects.continuous import arrest
from verlet_numba.effects.damping import damp
from verlet_numba.effects.drag import resist
from verlet_numba.effects.exact import deepest_gap, find_exact, pushing_gaps
from verlet_numba.effects.features import begin_features, part_features, rub_features
from verlet_numba.effects.friction import rub
from verlet_numba.effects.gravity import fall
from verlet_numba.effects.hold_back import limit_exact
from verlet_numba.effects.impact import strike_bodies, strike_spheres
from verlet_numba.effects.meet import depth_of_hulls, find_meetings, gather, gather_again, move_hulls, pushing
from verlet_numba.effects.mesh_contact import deepest_in_meshes
from verlet_numba.effects.most_moved import choose_lists, note_places
from verlet_numba.effects.motion import carry, move
from verlet_numba.effects.open_gaps import part_exact
from verlet_numba.effects.orientation import keep_orientation
from verlet_numba.effects.recall import begin_pass, keep_colliders, keep_hulls, recall_colliders, recall_hulls
from verlet_numba.effects.response import displace, kick_back, link, rebound, shove
from verlet_numba.effects.rest import at_rest, depth_at_rest, find_at_colliders, hold, idle, settle, wake
from verlet_numba.effects.restitution import bounce, foresee
from verlet_numba.effects.soft import find_mixed, find_soft
from verlet_numba.effects.spheres import begin_spheres, deepest, part_spheres, rub_spheres, touching_spheres
from verlet_numba.effects.touch import HULLS, MIXED, begin_touches, touch_colliders, touch_hulls, weigh
from verlet_numba.effects.wind import blow
from verlet_numba.kernels.integrate import integrate
from verlet_numba.kernels.observe import keep, observe, record, record_velocity
from verlet_numba.kernels.relax import forget
from verlet_numba.kernels.relax_angles import relax_angles
from verlet_numba.kernels.relax_graph import relax_graph
from verlet_numba.kernels.relax_lines import relax_lines
from verlet_numba.kernels.relax_started import guard, note_start, relax_runs_along, relax_sticks_along
from verlet_numba.kernels.stopwatch import (
    ANSWERING,
    DAMPING,
    DRAG,
    FINDING,
    FRAMES,
    GRAVITY,
    INTEGRATION,
    PATHS,
    REBOUND,
    RELAXATION,
    REST,
    WEIGHING,
    WIND,
    begin,
    drop,
    lap,
)

OK, DIVERGED, FULL, PAUSED = 0, 1, 2, 3


@entry
def advance(world, frames, budget):
    """A chunk of frames. A frame is kept at its time and finished one substep later, so that its velocity is central.

    Returns OK, DIVERGED (no instance is sound in the frame of the clock), PAUSED (after `budget` substeps) or FULL (the contacts
    outgrew their buffers). After PAUSED, or FULL with larger buffers, the next call goes on bit for bit.
    """
    particles, runs, runs_softness, sticks, sticks_softness, start, angles, lines, lines_softness, graph, collided = world[:11]
    effects, solver, observed, snapshot, clock, stopwatch = world[11:]
    position, previous, inverse_mass, acceleration = particles
    gravity, wind, drag, damping, carried, moving = effects[:6]
    contact, meshes, hulls, meet, trees, spheres, points, mixed, rigid, touches, features = effects[6:17]
    friction, restitution, rest, exact, rapid, orientation, bending = effects[17:]
    h, substeps, passes, tolerance, approximate = solver
    while clock[FRAME] < len(frames.measures):
        while clock[SUBSTEP] < substeps:
            if clock[STAGE] == WHOLE:
                if budget == 0:
                    return PAUSED
                budget -= 1
                end = (clock[NUMBER] + 1) * h
                begin(stopwatch, clock[NUMBER])
                if clock[SUBSTEP] == substeps - 1:
                    keep(position, previous, snapshot,
                         pushing(touches, features, meet, mixed) + touching_spheres(spheres) + pushing_gaps(exact))
                    touching(contact, snapshot.touching)
                    lap(stopwatch, FRAMES)
                settle(position, previous, clock[NUMBER], rest, contact, hulls, meet, points, mixed, touches, features)
                if idle(rest, moving):                                      # all bodies rest: no work
                    lap(stopwatch, REST)
                    clock[NUMBER] += 1
                    clock[SUBSTEP] += 1
                    continue
                lap(stopwatch, REST)
                fall(acceleration, gravity)
                lap(stopwatch, GRAVITY)
                blow(position, previous, acceleration, h, wind)
                lap(stopwatch, WIND)
                resist(position, previous, acceleration, h, drag)
                lap(stopwatch, DRAG)
                damp(position, previous, acceleration, h, damping)
                lap(stopwatch, DAMPING)
                integrate(position, previous, acceleration, h)              # Verlet (P5)
                lap(stopwatch, INTEGRATION)
                carry(position, end, carried)
                move(contact, end, moving)
                hold(position, previous, inverse_mass, rest)
                lap(stopwatch, PATHS)
                clock[STAGE] = INTEGRATED
            if clock[STAGE] == INTEGRATED:
                if not arrest(position, previous, inverse_mass, contact, rapid):
                    drop(stopwatch)
                    return FULL
                move_hulls(hulls, contact, moving)
                gather(position, hulls, meet)
                gather(position, points, mixed)
                clock[STAGE] = ARRESTED
            while True:                                                     # once, and again where resting bodies wake
                if not (find_at_colliders(position, previous, inverse_mass, contact, meshes, rest)      # (P11 to P17)
                        and find_meetings(hulls, meet, rest)
                        and find_soft(position, inverse_mass, trees, spheres) and find_mixed(position, points, trees, mixed)
                        and find_exact(position, previous, contact, exact)):
                    drop(stopwatch)
                    return FULL
                if not wake(position, acceleration, inverse_mass, clock[NUMBER], h, rest, contact, hulls, meet, points, mixed,
                            moving):
                    break
                gather(position, hulls, meet)
                gather(position, points, mixed)
            lap(stopwatch, FINDING)
            note_start(position, start)
            foresee(position, acceleration, contact, restitution, h)
            begin_touches(rigid, touches)
            touch_colliders(contact, friction, restitution, rigid, touches)
            touch_hulls(meet, hulls, friction, restitution, rigid, touches, HULLS)
            touch_hulls(mixed, points, friction, restitution, rigid, touches, MIXED)
            weigh(position, previous, inverse_mass, rigid)
            link(rigid, touches)
            recall_colliders(contact, rigid, touches, clock[NUMBER])
            recall_hulls(meet, rigid, touches, HULLS, clock[NUMBER])
            recall_hulls(mixed, rigid, touches, MIXED, clock[NUMBER])
            strike_bodies(position, inverse_mass, acceleration, contact, meet, hulls, mixed, points, friction, restitution, rigid,
                          touches, clock[NUMBER], h)
            begin_features(inverse_mass, meet, hulls, features)
            begin_features(inverse_mass, mixed, points, features)
            begin_spheres(previous, spheres)
            strike_spheres(position, previous, inverse_mass, acceleration, spheres, restitution, h)
            forget(runs_softness)
            forget(sticks_softness)
            forget(lines_softness)
            note_places(position, collided)
            lap(stopwatch, WEIGHING)
            for again in range(passes):
                separate(position, contact)                                 # before every pass (P18)
                part_spheres(position, previous, inverse_mass, spheres)         # (P22)
                part_features(position, inverse_mass, meet, hulls, features, HULLS)    # (P19 to P21)
                part_features(position, inverse_mass, mixed, points, features, MIXED)   # (P23)
                gather_again(again, position, hulls, rigid)
                gather_again(again, position, points, rigid)
                aim_colliders(position, contact, rigid, touches, clock[NUMBER], h)
                aim_hulls(meet, hulls, contact, rigid, touches, HULLS, clock[NUMBER], h)
                aim_hulls(mixed, points, contact, rigid, touches, MIXED, clock[NUMBER], h)
                respond(friction, rigid, touches)
                begin_pass(again, friction, rigid, touches)
                shove(friction, rigid, touches)
                displace(position, inverse_mass, rigid)
                lap(stopwatch, ANSWERING)
                if not again:
                    choose_lists(position, collided, graph)                 # of the particles moved most (P9)
                    guard(position, previous, runs, sticks, start, snapshot.counts)
                unbend(again, position, previous, bending)
                snapshot.counts[RELAXED] += relax_graph(position, graph, tolerance, approximate)
                snapshot.counts[RELAXED] += relax_runs_along(position, previous, runs, runs_softness, tolerance,
                                                             approximate, start)                    # P6-P10
                snapshot.counts[RELAXED] += relax_lines(position, inverse_mass, lines, lines_softness, tolerance, approximate)
                snapshot.counts[RELAXED] += relax_sticks_along(position, previous, sticks, sticks_softness, tolerance,
                                                               approximate, start)
                snapshot.counts[RELAXED] += relax_angles(position, inverse_mass, angles, tolerance)
                lap(stopwatch, RELAXATION)
            part_exact(position, previous, inverse_mass, contact, exact)    # contact of cloth and ropes has the last word
            keep_orientation(position, previous, orientation)
            bounce(position, previous, contact, restitution)
            keep_colliders(contact, rigid, touches)
            keep_hulls(meet, rigid, touches, HULLS)
            keep_hulls(mixed, rigid, touches, MIXED)
            rebound(friction, rigid, touches)
            kick_back(position, previous, inverse_mass, rigid)
            rub(position, contact, friction)                                # friction (P24) has the last word
            rub_features(position, previous, inverse_mass, meet, hulls, features, friction, HULLS)
            rub_features(position, previous, inverse_mass, mixed, points, features, friction, MIXED)
            rub_spheres(position, previous, inverse_mass, spheres, friction)
            hold(position, previous, inverse_mass, rest)
            limit_exact(position, exact)
            lap(stopwatch, REBOUND)
            clock[NUMBER] += 1
            clock[SUBSTEP] += 1
            clock[STAGE] = WHOLE
        f = clock[FRAME]
        sound = observe(frames.measures[f], frames.sound[f], position, snapshot, observed, h)
        penetration(frames.measures[f], snapshot.position, inverse_mass, contact, observed.instances)
        frames.measures[f, PENETRATION] = max(
            frames.measures[f, PENETRATION],
            deepest_in_meshes(snapshot.position, inverse_mass, contact, meshes), depth_of_hulls(snapshot.position, meet, hulls),
            deepest(snapshot.position, spheres), depth_of_hulls(snapshot.position, mixed, points), depth_at_rest(rest),
            deepest_gap(exact))
        frames.measures[f, RESTING] = at_rest(rest)
        record(frames.position[f], snapshot.position, observed.scene_order, observed.instances)
        record_velocity(frames.velocity, f, position, snapshot.before, observed.scene_order, observed.instances, h)
        lap(stopwatch, FRAMES)
        if not sound:
            return DIVERGED
        clock[SUBSTEP] = 0
        clock[FRAME] += 1
    return OK
