"""A scene's bodies become the world that the frame loop advances. Nothing here needs Numba."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from verlet_numba.buffers import (
    COLUMNS,
    SUBSTEP,
    Array,
    Collided,
    Effects,
    Frames,
    Graph,
    Observed,
    Particles,
    Snapshot,
    Solver,
    Start,
    World,
    gate,
)
from verlet_numba.scene import forces
from verlet_numba.scene.bending import bending_of
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import carried
from verlet_numba.scene.constraint_graph import graph_of
from verlet_numba.scene.constraints import constraints
from verlet_numba.scene.lines import lines_of, loose
from verlet_numba.scene.meeting import contact_of
from verlet_numba.scene.numbering import Numbering, number, padded, spread
from verlet_numba.scene.orientation import orientation_of
from verlet_numba.scene.schema import Scene


@dataclass
class Model:
    """A scene ready to run: its bodies, their numbering and the buffers."""

    scene: Scene
    bodies: list[Body]
    numbering: Numbering
    world: World

    @property
    def particles(self) -> int:
        """Particles of the file."""
        return len(self.world.observed.scene_order)


def build(scene: Scene, bodies: list[Body], folder: Path = Path()) -> Model:
    """Number the particles and lay out everything that the scene calls for. The particles have no place yet.

    Files of mesh colliders are sought from `folder`.
    """
    real = np.dtype(scene.solver.precision)
    chained = scene.solver.order == "lines"
    numbering = number(bodies, lines=chained)
    size = padded(numbering.size, real.itemsize)
    step = 1.0 / (scene.time.frame_rate * scene.solver.substeps)
    masses = [np.broadcast_to(body.shape.masses, index.shape) for body, index in zip(bodies, numbering.bodies, strict=True)]
    moves = [np.broadcast_to(~body.pinned, index.shape) for body, index in zip(bodies, numbering.bodies, strict=True)]
    inverse_mass = spread(numbering, [move / mass for move, mass in zip(moves, masses, strict=True)], size)

    together = attachments(scene, bodies, numbering)
    effects = effects_of(scene, folder, bodies, numbering, together, inverse_mass, step, real)
    ordered = scene.solver.order == "constraint_graph"
    passes = scene.solver.iterations
    singly = loose(bodies, numbering) if chained else (bodies, numbering)
    joined = constraints(*singly, together, inverse_mass, step, passes, real, rigid=not ordered)
    lines = lines_of(bodies, numbering, inverse_mass, step, real) if chained else (None, None)
    graph = graph_of(bodies, numbering, inverse_mass, scene.solver.repeats, real) if ordered else None
    collided = collided_of(graph, size, real)
    started = start_of(numbering, effects, size, real) if scene.solver.gradient == "step_start" else None
    solver = Solver(step, scene.solver.substeps, passes,
                    scene.solver.tolerance or None, 1 if scene.solver.square_root == "approximate" else None)
    particles, snapshot = state(size, inverse_mass, effects, real)
    observed = observed_of(scene, bodies, numbering)
    clock = gate(np.zeros(4), np.int64)
    clock[SUBSTEP] = scene.solver.substeps - 1        # frame 0 is the start itself: one substep completes it
    world = World(particles, *joined[:-1], started, joined.angles, *lines, graph, collided, effects, solver, observed, snapshot,
                  clock, None)
    return Model(scene, bodies, numbering, world)


def collided_of(graph: Graph | None, size: int, real: Any) -> Collided | None:
    """What collisions do to the bodies of a constraint graph."""
    if graph is None:
        return None
    return Collided(gate(np.zeros((3, size)), real), gate(np.full(len(graph.bucket), -1), np.int64))


def start_of(numbering: Numbering, effects: Effects, size: int, real: Any) -> Start:
    """What the directions at the start of a substep need."""
    touches = any(effect is not None for effect in (effects.contact, effects.meet, effects.spheres, effects.mixed))
    blocks = [(group.first + block * group.slots * group.block, group.slots, group.block)
              for group in numbering.groups for block in range(group.blocks)]
    first, slots, lanes = (gate(column, np.int64) for column in np.array(blocks, np.int64).reshape(-1, 3).T)
    return Start(gate(np.zeros((3, size)), real) if touches else None, gate(np.zeros(size), real), gate(np.zeros(1), np.int64),
                 first, slots, lanes, gate(np.zeros(lanes.max(initial=1)), real))


def effects_of(scene: Scene, folder: Path, bodies: list[Body], numbering: Numbering, together: Integers, inverse_mass: Floats,
               step: float, real: Any) -> Effects:
    """What the scene calls for, None for everything else."""
    contact = contact_of(scene, folder, bodies, numbering, together, inverse_mass, real)
    return Effects(forces.gravity(scene.effects, inverse_mass, real),
                   forces.wind(scene.effects, bodies, numbering, inverse_mass, real),
                   forces.drag(scene.effects, inverse_mass, real),
                   forces.damping(scene.effects, inverse_mass, step),
                   carried(bodies, numbering), *contact,
                   orientation_of(bodies, numbering) if scene.solver.orientation_guard else None,
                   bending_of(scene, bodies, numbering, inverse_mass))


def state(size: int, inverse_mass: Floats, effects: Effects, real: Any) -> tuple[Particles, Snapshot]:
    """Empty particles and snapshot; an acceleration only if something accelerates."""
    accelerates = any(effect is not None for effect in (effects.gravity, effects.wind, effects.drag, effects.damping))
    rows = [gate(np.zeros((3, size)), real) for _ in range(5)]
    particles = Particles(rows[0], rows[1], gate(inverse_mass, real), rows[2] if accelerates else None)
    return particles, Snapshot(rows[3], rows[4], gate(np.zeros(5), np.int64))


def observed_of(scene: Scene, bodies: list[Body], numbering: Numbering) -> Observed:
    """What observables need, in the order of the file."""
    order = numbering.scene_order
    mass = np.concatenate([np.zeros(0), *(np.tile(body.shape.masses, body.copies) for body in bodies)])
    pairs = [index[:, body.shape.sticks.reshape(-1, 2)].reshape(-1, 2)
             for body, index in zip(bodies, numbering.bodies, strict=True)]
    rest = [np.tile(body.shape.lengths, body.copies) for body in bodies]
    gravity = None
    if scene.effects.gravity is not None:
        gravity = gate(np.repeat(np.array(scene.effects.gravity, float)[:, None], len(order), 1), np.float64)
    return Observed(gate(order, np.int64), gate(mass, np.float64), gravity,
                    gate(np.concatenate([np.zeros((0, 2), np.int64), *pairs]).T, np.int64),
                    gate(np.concatenate([np.zeros(0), *rest]), np.float64))


def attachments(scene: Scene, bodies: list[Body], numbering: Numbering) -> Integers:
    """(A, 2) inner indices of the particles that stay together."""
    named = {body.name: index for body, index in zip(bodies, numbering.bodies, strict=True)}
    rows = [(named[a].ravel()[i], named[b].ravel()[j]) for a, i, b, j in scene.attachments]
    return np.array(rows, np.int64).reshape(-1, 2)


def frames(model: Model, count: int) -> Frames:
    """Room for a chunk of frames."""
    output, shape = model.scene.output, (count, model.particles, 3)
    velocity: Array | None = np.empty(shape, output.precision) if "velocity" in output.fields else None
    return Frames(np.empty(shape, output.precision), velocity, np.empty((count, COLUMNS)))
