"""What a scene's simulation consists of: every effect and phase, active or absent, and why; sizes in memory and on disk."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.world import COLUMNS, Effects, World
from verlet_numba.scene.body import Shape
from verlet_numba.scene.build import Model
from verlet_numba.scene.chains import unchained
from verlet_numba.scene.numbering import Group
from verlet_numba.scene.prepare import Prepared
from verlet_numba.scene.schema import Scene

INTERPRETER = 190 << 20     # bytes of Python, NumPy, Numba, HDF5 and the compiled kernels
MEETING = 40 << 20          # and of SciPy and more kernels, where bodies meet each other
BUILDING = 1.4              # times the buffers: the bodies, their numbering, and what the file says of them
CHUNK_BYTES = 2 << 20       # of a chunk of frames on its way to the file, at most
FRAME_MEASURES = COLUMNS * 8 + 10 * 8       # bytes of a frame's observables, time and step, and offsets for VTK
FILE_GROUPS = 128 << 10     # bytes of a file's groups, attributes and empty datasets
FILE_CHUNK, FILE_ROWS = 64 << 10, 512       # the file grows by chunks: bytes of a field (or a frame); rows of measures
FILE_INDEX = 1.01           # what finding the chunks takes
HULLED = ("box", "sphere", "cylinder")      # colliders that rigid bodies meet with their whole hull


class Phase(NamedTuple):
    name: str
    active: bool
    why: str


def plan(prepared: Prepared, model: Model) -> dict[str, Any]:
    """The plan as plain data: phases, groups, buffers (bytes), memory and file size (bytes)."""
    sizes = dict(buffers(model.world))
    total = sum(sizes.values())
    scene = prepared.scene
    return {
        "particles": model.particles, "frames": frame_count(scene), "substeps_a_frame": scene.solver.substeps,
        "step_seconds": model.world.solver.step,
        "distance_constraints": len(model.world.observed.rest),
        "phases": [phase._asdict() for phase in phases(prepared, model)],
        "groups": [{"kind": group.shape.kind, "copies": group.copies, "particles_a_copy": len(group.slot),
                    "copies_a_block": group.block, "lanes": lanes(model, group)} for group in model.numbering.groups],
        "buffers": sizes,
        "memory_bytes": INTERPRETER + MEETING * bodies_meet(model.world) + int((1 + BUILDING) * total) + 3 * chunk_bytes(model),
        "file_bytes_at_most": file_bytes(prepared, model, frame_count(scene))}


def bodies_meet(world: World) -> bool:
    """Whether any two bodies may touch."""
    return any(effect is not None for effect in (world.effects.meet, world.effects.spheres, world.effects.mixed,
                                                   world.effects.exact))


def frame_count(scene: Scene) -> int:
    """Frames of the file, the start included."""
    return round(scene.time.duration * scene.time.frame_rate) + 1


def lanes(model: Model, group: Group) -> str:
    """How the sticks of a group are relaxed."""
    if not len(group.shape.sticks):
        return "no sticks"
    if model.world.graph is not None and group.shape.rigid:
        return "outwards from what collided"
    first, last = group.first, group.first + group.size
    runs = model.world.runs
    mine = [] if runs is None else [int(n) for i, n in zip(runs.first[0], runs.lanes, strict=True) if first <= i < last]
    runs_of = f"{len(mine)} runs of up to {max(mine)} lanes" if mine else "stick by stick"
    lines = model.world.lines
    chains = [] if lines is None else [int(n) for i, n in zip(lines.first, lines.shift, strict=True) if first <= i < last]
    if not chains:
        return runs_of
    told = f"{len(chains)} families of chains, up to {max(chains)} side by side"
    return f"{told}; the others {runs_of}" if len(unchained(group.shape).sticks) else told


def phases(prepared: Prepared, model: Model) -> Iterator[Phase]:
    """Every phase of a substep in its order."""
    scene, world = prepared.scene, model.world
    effects, active = scene.effects, world.effects
    faces = any(len(body.shape.triangles) for body in prepared.bodies)
    named, unnamed, nothing = "named in effects", "not named in effects", "named, but it is set to nothing"
    moves = can_move(world)
    yield Phase("gravity", active.gravity is not None, named if effects.gravity else unnamed)
    yield Phase("wind", active.wind is not None,
                unnamed if effects.wind is None else "named, but no body has triangles" if not faces else
                named if active.wind else nothing)
    yield Phase("drag", active.drag is not None, unnamed if effects.drag is None else named if active.drag else nothing)
    yield Phase("damping", active.damping is not None, unnamed if effects.damping is None else named if active.damping else nothing)
    yield Phase("integrate", moves, "particles move" if moves else "nothing can move")
    yield Phase("paths of pinned particles", active.carried is not None,
                "a body has a path" if active.carried else "no body has a path")
    yield Phase("motion of colliders", active.moving is not None,
                "a collider has a path or a spin" if active.moving else "no collider has a path or a spin")
    yield from contacts(prepared, model)
    asked = scene.effects.continuous_collision
    yield Phase("continuous collision", active.rapid is not None or (asked and active.exact is not None),
                "effects.continuous_collision is off" if not asked else
                "effects.continuous_collision" if active.rapid or active.exact else "nothing that may meet something on its way")
    yield Phase("bending", active.bending is not None, unnamed if effects.bending is None else named if active.bending else
                "named, but there is neither cloth nor a rope of two segments" if effects.bending.stiffness else nothing)
    yield Phase("orientation guard", active.orientation is not None,
                "not asked for by solver.orientation_guard" if not scene.solver.orientation_guard else
                "solver.orientation_guard" if active.orientation else "no rigid body that has a volume and no pins")
    yield Phase("rest", active.rest is not None, rest_reason(prepared, active))
    yield from constraints(world)
    yield Phase("velocities", "velocity" in scene.output.fields, "named in output.fields" if scene.output.fields
                else "not named in output.fields")


def contacts(prepared: Prepared, model: Model) -> Iterator[Phase]:
    """Finding contacts and answering to them."""
    world, solver, active = model.world, prepared.scene.solver, model.world.effects
    none = no_contact(prepared, world)
    colliders = bool(prepared.scene.colliders)
    yield Phase("contact with colliders", active.contact is not None,
                none or ("the scene has colliders" if colliders else "the scene has no collider"))
    yield from rigid_contacts(prepared, model, none)
    yield from soft_contacts(prepared, model, none)
    rigid, features, hulls = active.rigid is not None, active.features is not None, active.meet or active.mixed
    met = none or ("no rigid body" if not any(body.shape.rigid for body in prepared.bodies) else "rigid bodies meet nothing")
    kept = f"solver.response is {solver.response}"
    yield Phase("whole-body response", rigid, kept if rigid or solver.response == "feature" else met)
    yield Phase("feature response", features, kept if features or solver.response == "body" else none or "no hulls meet")
    touch = bool(active.contact or hulls or active.spheres)
    yield Phase("restitution", active.restitution is not None,
                material_reason(active.restitution, "restitution") if touch else "nothing touches")
    yield Phase("friction", active.friction is not None,
                material_reason(active.friction, "friction") if touch else "nothing touches")


def rigid_contacts(prepared: Prepared, model: Model, none: str) -> Iterator[Phase]:
    """Convex hulls that meet. none: why nothing meets at all, empty if something may."""
    scene, meet, mixed = prepared.scene, model.world.effects.meet, model.world.effects.mixed
    bodies = sum((len(body.shape.parts) or 1) * body.copies for body in prepared.bodies if body.shape.rigid)
    solid = sum(collider.kind in HULLED for collider in scene.colliders)
    absent = none or ("no rigid body" if not bodies else "all hulls are still" if bodies + solid > 1
                      else "no two hulls: one rigid body, and no box, sphere or cylinder")
    told = f"{bodies} hulls of rigid bodies, {solid} of colliders"
    grids = "all pairs: solver.broad_phase" if scene.solver.broad_phase == "all_pairs" else "grids: solver.broad_phase is sweep"
    yield Phase("pair search", meet is not None, f"{told}; {grids}" if meet else absent)
    yield Phase("narrow phase", bool(meet or mixed), "hulls meet" if meet else "particles meet hulls" if mixed else absent)
    several = meet is not None and meet.manifold is not None
    yield Phase("contact manifolds", several, "solver.response is body: hulls rest on edges and faces" if several
                else "solver.response is feature: one contact a pair" if meet else absent)


def soft_contacts(prepared: Prepared, model: Model, none: str) -> Iterator[Phase]:
    """Deformable bodies that meet. none: as above."""
    scene, active = prepared.scene, model.world.effects
    trees, spheres, mixed = active.trees, active.spheres, active.mixed
    soft = [body for body in prepared.bodies if not body.shape.rigid]
    count, rigid = sum(body.copies for body in soft), sum(body.copies for body in prepared.bodies if body.shape.rigid)
    absent = none or ("" if soft else "no deformable body")
    thin = ("solver.deformable_contact is exact" if scene.solver.deformable_contact == "exact" else
            "" if any(body.shape.radius > 0 for body in soft) else "no deformable body has a thickness")
    particles = sum(body.copies * len(body.pinned) for body in soft)
    asked = scene.effects.self_collision
    single = "" if particles > 1 else "one particle"
    yield Phase("sphere trees", trees is not None, f"over {particles} particles" if trees
                else absent or "deformable bodies meet neither each other nor rigid ones")
    yield Phase("deformable contact", spheres is not None and count > 1, f"{count} bodies, as spheres about particles"
                if spheres and count > 1 else absent or ("one deformable body" if count < 2 else thin))
    yield Phase("self-contact", spheres is not None and asked, "effects.self_collision" if spheres and asked
                else absent or (thin or single if asked else "effects.self_collision is off"))
    pairs, exact = "vertices with triangles, edges with edges", active.exact is not None
    yield Phase("exact contact", exact, pairs if exact and scene.solver.deformable_contact == "exact" else
                f"{pairs}, without thickness: effects.continuous_collision" if exact else absent or
                ("it meets nothing" if scene.solver.deformable_contact == "exact" else "solver.deformable_contact is spheres"))
    yield Phase("deformable against rigid", mixed is not None, f"{particles} particles, {rigid} rigid bodies" if mixed
                else absent or "no rigid body")


def constraints(world: World) -> Iterator[Phase]:
    """Relaxation."""
    solver = world.solver
    ordered = " outside of the constraint graph" if world.graph else " but for chains" if world.lines else ""
    yield Phase("constraint graph", world.graph is not None, "solver.order is constraint_graph" if world.graph
                else "solver.order is another, or there is no rigid body")
    yield Phase("lines", world.lines is not None, "solver.order is lines: whole chains of sticks" if world.lines
                else "solver.order is another, or there is no chain of sticks")
    yield Phase("runs of sticks", world.runs is not None, "ropes, cloth or several bodies of one kind" if world.runs
                else f"no rope, no cloth, no body in several copies{ordered}")
    yield Phase("single sticks", world.sticks is not None, "bodies without copies, or attachments" if world.sticks
                else f"no single body with sticks{ordered}, no attachment")
    soft = any(softness is not None for softness in (world.runs_softness, world.sticks_softness, world.lines_softness))
    yield Phase("compliance over passes", soft, "a body is compliant and there are several passes" if soft
                else "no body is compliant, or one pass a substep, where it is part of the weights")
    yield Phase("directions at the start of the step", world.start is not None,
                f"solver.gradient is {'step_start' if world.start else 'current'}")
    yield Phase("tolerance", solver.tolerance is not None,
                "solver.tolerance is above 0" if solver.tolerance else "solver.tolerance is 0: every stick is relaxed")
    yield Phase("angles", world.angles is not None, "a body keeps angles" if world.angles else "no body keeps angles")


def can_move(world: World) -> bool:
    return bool((world.particles.inverse_mass > 0).any())


def no_contact(prepared: Prepared, world: World) -> str:
    """Why nothing in the scene can touch; empty if something may."""
    if prepared.scene.effects.contact == "none":
        return "effects.contact is none"
    return "" if can_move(world) else "nothing can move"


def rest_reason(prepared: Prepared, active: Effects) -> str:
    if prepared.scene.effects.rest is None:
        return "effects.rest is left out"
    if active.exact is not None or active.rapid is not None:
        return "named, but exact contact and continuous collision would not wake what rests"
    return "effects.rest" if active.rest is not None else "named, but there is no rigid body that may rest on something"


def material_reason(effect: object, name: str) -> str:
    return f"materials that meet have {name}" if effect is not None else f"no materials that meet have {name}"


def buffers(world: World) -> Iterator[tuple[str, int]]:
    """Bytes of every part of the world that has buffers of its own."""
    for name, part in world._asdict().items():
        if name == "effects":
            for effect, value in part._asdict().items():
                if value is not None and size(value):
                    yield f"effects.{effect}", size(value)
        elif isinstance(part, tuple) and name != "solver":
            yield name, size(part)


def size(part: Any) -> int:
    """Bytes of all arrays of a buffer."""
    if isinstance(part, tuple):
        return sum(size(value) for value in part)
    return part.nbytes if isinstance(part, np.ndarray) else 0


def frame_bytes(model: Model) -> int:
    output = model.scene.output
    return model.particles * 3 * (4 if output.precision == "float32" else 8) * (1 + len(output.fields)) + FRAME_MEASURES


def chunk_bytes(model: Model) -> int:
    """Bytes of the largest chunk of frames."""
    return min(max(frame_bytes(model), CHUNK_BYTES), frame_bytes(model) * frame_count(model.scene))


def file_bytes(prepared: Prepared, model: Model, count: int) -> int:
    """Size of the file of so many frames if nothing could be compressed, the last chunk of everything included."""
    scene, fields = prepared.scene, 1 + len(prepared.scene.output.fields)
    field = frame_bytes(model) - FRAME_MEASURES
    unfilled = FRAME_MEASURES * min(count, FILE_ROWS) + min(field * count, max(field, fields * FILE_CHUNK))
    frames = frame_bytes(model) * count + unfilled
    shapes = sum(body.copies * static_bytes(body.shape) for body in model.bodies)
    texts = 3 * len(prepared.loaded.source.text.encode()) + 1024 * (len(scene.bodies) + len(scene.colliders))
    return FILE_GROUPS + int(FILE_INDEX * frames) + shapes + texts


def static_bytes(shape: Shape) -> int:
    """Bytes in the file of one copy: its row of /bodies, constraints, triangles, lines and single points."""
    lines = sum(8 * len(line) + 12 for line in shape.lines)
    return 256 + 16 * len(shape.sticks) + 36 * len(shape.triangles) + lines + 20 * len(shape.positions)
