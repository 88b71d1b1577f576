"""From a validated scene to bodies: every copy's particles and velocities where the simulation starts."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body, Floats, Shape
from verlet_numba.scene.occupied import Occupied, bounding_radius, centre_of_mass, load_surfaces, rotation_matrix
from verlet_numba.scene.problems import Problem, SceneError
from verlet_numba.scene.scatter import Free, NoRoomError, random_rotations, random_velocities, scatter
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_bodies import Body as Entry
from verlet_numba.scene.schema_bodies import Cloth, ParticlesBody, Rope
from verlet_numba.scene.shapes import ShapeError
from verlet_numba.scene.source import Source


def place(scene: Scene, folder: Path, source: Source) -> list[Body]:
    """The scene's bodies, in its order, at the start. Files of meshes are sought from `folder`.

    Copies with `scatter` go where colliders and all other bodies leave room. Raises SceneError, with every finding.
    """
    problems: list[Problem] = []
    built: dict[int, Shape] = {}
    for index, entry in enumerate(scene.bodies):
        try:
            built[index] = build(entry, folder, scene.effects.gravity)
            problems += _unknown_pins(entry, index, built[index], source)
        except ShapeError as error:
            problems.append(source.problem(("bodies", index, error.key), str(error)))
    problems += _unknown_attached(scene, built, source)
    surfaces, unread = load_surfaces(scene, folder, source)
    problems += unread
    if problems:
        raise SceneError(problems)

    placed = {i: _placed_once(scene, entry, built[i]) for i, entry in enumerate(scene.bodies) if not entry.scatter}
    occupied = Occupied(scene, surfaces, placed)
    for index, entry in enumerate(scene.bodies):
        if entry.scatter:
            try:
                placed[index] = _scattered(scene, entry, index, built[index], occupied.free)
                occupied.add(entry, placed[index])
            except NoRoomError as error:
                problems.append(source.problem(
                    ("bodies", index, "scatter"), f"only {error.fitted} of {entry.count} fit without overlap, each "
                    "with room to turn; make `inside` larger or `count` smaller"))
    if problems:
        raise SceneError(problems)
    return [placed[index] for index in range(len(scene.bodies))]


def build(entry: Entry, folder: Path, gravity: tuple[float, float, float] | None) -> Shape:
    """The shape of a body of the scene. Raises ShapeError for a mesh that will not do."""
    match entry.kind:
        case "rope":
            return shapes.rope(entry.start, entry.end, entry.segments, length=entry.length, mass=entry.mass,
                               density=entry.density, thickness=entry.thickness, compliance=entry.compliance,
                               gravity=gravity)
        case "cloth":
            return shapes.cloth(entry.size, entry.resolution, diagonals=entry.diagonals, mass=entry.mass,
                                density=entry.density, thickness=entry.thickness, compliance=entry.compliance)
        case "box":
            return shapes.box(entry.size, mass=entry.mass, density=entry.density)
        case "icosahedron":
            return shapes.icosahedron(entry.radius, mass=entry.mass, density=entry.density)
        case "particles":
            return shapes.particles(entry.positions, entry.masses, sticks=entry.sticks, angles=entry.angles,
                                    radius=entry.radius, compliance=entry.compliance,
                                    segments=entry.contact_geometry == "segments")
        case "mesh":
            from verlet_numba.scene.mesh import mesh

            return mesh(folder / entry.file, scale=entry.scale, mass=entry.mass, density=entry.density)


def pinned(entry: Entry, shape: Shape) -> NDArray[np.bool_]:
    """Which particles (P,) of a body are held: those under `pinned`, or all if it is `fixed`."""
    held = np.full(len(shape.positions), entry.fixed)
    if not isinstance(entry.pinned, str):
        held[list(entry.pinned)] = True
    elif isinstance(entry, Cloth):
        grid = held.reshape(entry.resolution)
        if entry.pinned == "corners":
            grid[::grid.shape[0] - 1, ::grid.shape[1] - 1] = True
        else:
            grid[[0, -1]] = grid[:, [0, -1]] = True
    else:
        held[[0, -1]] = True
    return held


def _unknown_pins(entry: Entry, index: int, shape: Shape, source: Source) -> list[Problem]:
    """Pins of particles that do not exist; for a mesh only its file tells."""
    count = len(shape.positions)
    return [source.problem(("bodies", index, "pinned", row), f"there is no particle {number}: the body has {count}, "
                           "numbered from 0")
            for row, number in enumerate(entry.pinned_numbers()) if number >= count]


def _unknown_attached(scene: Scene, built: dict[int, Shape], source: Source) -> list[Problem]:
    """Attachments to particles of meshes that do not exist."""
    counts = {scene.bodies[i].name: len(shape.positions) * scene.bodies[i].count for i, shape in built.items()}
    return [source.problem(("attachments", row, end + 1), f"there is no particle {number}: '{name}' has "
                           f"{counts[name]}, numbered from 0")
            for row, (a, i, b, j) in enumerate(scene.attachments) for end, name, number in ((0, a, i), (2, b, j))
            if name in counts and number >= counts[name]]


def _placed_once(scene: Scene, entry: Entry, shape: Shape) -> Body:
    """The one copy of a body, turned about its centre of mass (rope, particles) or its own origin (all others)."""
    centre = centre_of_mass(shape)
    pivot = centre if isinstance(entry, Rope | ParticlesBody) else np.zeros(3)
    turn = rotation_matrix(entry.rotation)
    positions = (shape.positions - pivot) @ turn.T + pivot + entry.position
    about = turn @ (centre - pivot) + pivot + entry.position
    return _body(scene, entry, shape, positions[None], about[None], np.zeros((1, 3)))


def _scattered(scene: Scene, entry: Entry, index: int, shape: Shape, free: Callable[[float], Free]) -> Body:
    """All copies of a body at random, from the scene's seed and the body's number."""
    assert entry.scatter is not None
    rng = np.random.default_rng([scene.seed, index])
    radius = bounding_radius(shape)
    centres = scatter(entry.count, radius, entry.scatter.inside, free(radius), rng)
    turns = random_rotations(entry.count, rng)
    velocities = random_velocities(entry.count, entry.scatter.speed, rng)
    local = shape.positions - centre_of_mass(shape)
    positions = centres[:, None] + np.einsum("kij,pj->kpi", turns, local)
    return _body(scene, entry, shape, positions, centres, velocities)


def _body(scene: Scene, entry: Entry, shape: Shape, positions: Floats, centres: Floats, velocities: Floats) -> Body:
    """Copies at `positions` (K, P, 3) about `centres` (K, 3); `velocities` (K, 3) are added to those of the entry.

    v = v_centre + w x (x - centre); a pinned particle has none.
    """
    held = pinned(entry, shape)
    moving = (velocities + entry.velocity)[:, None] + np.cross(entry.angular_velocity, positions - centres[:, None])
    if isinstance(entry, ParticlesBody) and entry.velocities is not None:
        moving += entry.velocities
    moving[:, held] = 0
    friction = entry.friction or scene.effects.friction
    restitution = entry.restitution if entry.restitution is not None else scene.effects.restitution
    return Body(entry.name, shape, positions, moving, held,
                friction=(friction.static, friction.dynamic) if friction else (0.0, 0.0),
                restitution=restitution or 0.0,
                path=np.array(entry.path, float) if entry.path else None)
