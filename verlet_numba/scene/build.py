"""A scene's bodies become the world that the frame loop advances. Nothing here needs Numba."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.constraints import Collided, Graph, Particles, Start
from verlet_numba.buffers.world import COLUMNS, SUBSTEP, Effects, Frames, Observed, Snapshot, Solver, World
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
        """Particles of the file, of one instance."""
        return len(self.world.observed.scene_order)

    def given(self) -> tuple[Array, Array]:
        """Positions [m] and velocities [m/s] (3, n) of the scene at time 0; pinned particles move as their path begins."""
        position, velocity = (np.zeros(self.world.particles.position.shape) for _ in range(2))
        for body, index in zip(self.bodies, self.numbering.bodies, strict=True):
            held = np.zeros(3)
            if body.path is not None and len(body.path) > 1 and body.path[0, 0] == 0.0:
                held = (body.path[1, 1:] - body.path[0, 1:]) / (body.path[1, 0] - body.path[0, 0])
            position[:, index] = np.moveaxis(body.positions, 2, 0)
            velocity[:, index] = np.moveaxis(np.where(body.pinned[:, None], held, body.velocities), 2, 0)
        return position, velocity


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
    effects = effects._replace(gravity=forces.beside_others(effects))
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
    """Empty particles and snapshot; an acceleration only if something accelerates, gravity's where nothing else does."""
    rows = [gate(np.zeros((3, size)), real) for _ in range(5)]
    acceleration = None if effects.gravity is None else effects.gravity.acceleration
    if forces.others_accelerate(effects):
        acceleration = rows[2]
    particles = Particles(rows[0], rows[1], gate(inverse_mass, real), acceleration)
    return particles, Snapshot(rows[3], rows[4], gate(np.zeros(4), np.int64), gate(np.zeros(1), np.int64))


def observed_of(scene: Scene, bodies: list[Body], numbering: Numbering) -> Observed:
    """What observables need, in the order of the file."""
    order = numbering.scene_order
    mass = np.concatenate([np.zeros(0), *(np.tile(body.shape.masses, body.copies) for body in bodies)])
    pairs = [index[:, body.shape.sticks.reshape(-1, 2)].reshape(-1, 2)
             for body, index in zip(bodies, numbering.bodies, strict=True)]
    rest = [np.tile(body.shape.lengths, body.copies) for body in bodies]
    gravity = None if scene.effects.gravity is None else gate(np.array(scene.effects.gravity, float)[:, None], np.float64)
    return Observed(1, gate(order, np.int64), gate(mass, np.float64), gravity,
                    gate(np.concatenate([np.zeros((0, 2), np.int64), *pairs]).T, np.int64),
                    gate(np.concatenate([np.zeros(0), *rest]), np.float64), None)


def attachments(scene: Scene, bodies: list[Body], numbering: Numbering) -> Integers:
    """(A, 2) inner indices of the particles that stay together."""
    named = {body.name: index for body, index in zip(bodies, numbering.bodies, strict=True)}
    rows = [(named[a].ravel()[i], named[b].ravel()[j]) for a, i, b, j in scene.attachments]
    return np.array(rows, np.int64).reshape(-1, 2)


def frames(model: Model, count: int) -> Frames:
    """Room for a chunk of frames."""
    instances = model.world.observed.instances
    output, shape = model.scene.output, (count, instances * model.particles, 3)
    velocity: Array | None = np.empty(shape, output.precision) if "velocity" in output.fields else None
    return Frames(np.empty(shape, output.precision), velocity, np.empty((count, instances * COLUMNS)),
                  np.empty((count, instances), np.int64))
