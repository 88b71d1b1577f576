"""The scene doctor: what is allowed, but unlikely to be meant or unlikely to go well. Warnings, never errors."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.chains import chained
from verlet_numba.scene.clearance import Surface, clearance
from verlet_numba.scene.occupied import load_surfaces
from verlet_numba.scene.overlap import overlaps
from verlet_numba.scene.problems import Path as Key
from verlet_numba.scene.problems import Problem
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_colliders import Collider
from verlet_numba.scene.shapes import stick_lengths
from verlet_numba.scene.slipping import slipping, substeps_a_second
from verlet_numba.scene.source import Source

Warnings = Iterator[tuple[Key, str]]

TOUCH = 1e-6            # of a body's size: overlap up to this is touching
STRETCH = 0.01          # relative length error at the start that is worth a word
MASS_RATIO = 100.0      # of particles joined to each other, above which few passes leave visible stretch
FEW_LINES = 360.0       # substeps a second below which cloth that is solved in lines comes apart (6 at 60 frames a second)
RESOLVED = 1e-3         # of the shortest stick: numbers further apart than this spoil its length


def examine(scene: Scene, bodies: list[Body], folder: Path, source: Source) -> list[Problem]:
    """Warnings about a scene and its placed bodies (`place`), each with its position in the file."""
    surfaces, _ = load_surfaces(scene, folder, source)
    found = [*meshes(bodies), *sticks(scene, bodies), *attachments(scene, bodies), *coarse_lines(scene, bodies)]
    if scene.effects.contact != "none":
        found += [*inside_colliders(scene, bodies, surfaces), *overlaps(scene, bodies), *selves(scene, bodies),
                  *slipping(scene, bodies), *rebounds(scene, bodies)]
    found += [*resolution(scene, bodies), *lost_gravity(scene, bodies)]
    return [source.problem(path, message) for path, message in found]


def meshes(bodies: list[Body]) -> Warnings:
    """Meshes that repeat triangles, are not convex, or whose tetrahedralisation left them floppy."""
    for index, body in enumerate(bodies):
        for note in body.shape.notes:
            yield ("bodies", index, "file"), note


def sticks(scene: Scene, bodies: list[Body]) -> Warnings:
    """Sticks given one by one: repeated, without direction, far from their length, or between unequal masses.

    Of a chain that is solved as a whole, masses may be as they like.
    """
    for index, body in enumerate(bodies):
        shape = body.shape
        if shape.kind != "particles" or not len(shape.sticks):
            continue
        path = ("bodies", index, "sticks")
        earlier = _earlier(shape.sticks)
        for row, others in _first(earlier >= 0):
            yield (*path, row), f"joins the same particles as stick {earlier[row]}{others}"
        distance = stick_lengths(body.positions[0], shape.sticks)
        for row, others in _first(distance == 0):
            yield (*path, row), f"its particles start at the same point, so it has no direction{others}"
        off = np.abs(distance - shape.lengths) > STRETCH * shape.lengths
        for row, others in _first(off & (distance > 0)):
            yield (*path, row), (f"starts {distance[row]:.4g} m long, but its length is {shape.lengths[row]:.4g} m: "
                                 f"the first steps pull it there with a jerk{others}")
        ratio = _mass_ratio(body, shape.sticks)
        if scene.solver.order == "lines":
            ratio[chained(shape)] = 1.0
        for row, others in _first(ratio > MASS_RATIO):
            yield (*path, row), (f"joins masses of {ratio[row]:.3g}:1, which few substeps leave stretched: "
                                 f"use more{others}")


def _first(wrong: NDArray[np.bool_]) -> Iterator[tuple[int, str]]:
    """The first row that is wrong, if any, and words for how many others are."""
    rows = np.flatnonzero(wrong)
    if len(rows):
        yield int(rows[0]), f" (and {len(rows) - 1} more sticks)" if len(rows) > 1 else ""


def _earlier(pairs: Integers) -> Integers:
    """For each pair the row of an earlier one with the same two numbers, -1 if there is none."""
    _, first, inverse = np.unique(np.sort(pairs, axis=1), axis=0, return_index=True, return_inverse=True)
    earlier = first[inverse.ravel()]
    return np.where(earlier == np.arange(len(pairs)), -1, earlier)


def _mass_ratio(body: Body, pairs: Integers) -> Floats:
    """The heavier mass of each pair over the lighter one; 1 where one of them is held."""
    masses = body.shape.masses[pairs]
    held = body.pinned[pairs].any(axis=1)
    return np.where(held, 1.0, masses.max(axis=1) / masses.min(axis=1))


def attachments(scene: Scene, bodies: list[Body]) -> Warnings:
    """Particles that are to stay together but start apart, are both held, or have very unequal masses."""
    named = {body.name: body for body in bodies}
    for row, (a, i, b, j) in enumerate(scene.attachments):
        path = ("attachments", row)
        ends = [(named[name], number) for name, number in ((a, i), (b, j))]
        points = [body.positions.reshape(-1, 3)[number] for body, number in ends]
        masses = [body.shape.masses[number % len(body.pinned)] for body, number in ends]
        held = [bool(body.pinned[number % len(body.pinned)]) for body, number in ends]
        apart = float(np.linalg.norm(points[1] - points[0]))
        if apart > TOUCH * max(_size(body) for body, _ in ends):
            yield path, f"the two particles start {apart:.4g} m apart: the first step pulls them together with a jerk"
        if all(held):
            yield path, "both particles are pinned, so it does nothing"
        elif not any(held) and max(masses) > MASS_RATIO * min(masses):
            yield path, (f"joins masses of {max(masses) / min(masses):.3g}:1, which few passes leave apart: use more "
                         "substeps")


def coarse_lines(scene: Scene, bodies: list[Body]) -> Warnings:
    """Lines of cloth in steps so long that they are no longer nearly straight from one to the next."""
    woven = any(body.shape.kind == "cloth" for body in bodies)
    if scene.solver.order == "lines" and woven and substeps_a_second(scene) < FEW_LINES:
        yield ("solver", "order"), (f"`lines` of cloth take at least {FEW_LINES:g} substeps a second, here they have "
                                    f"{substeps_a_second(scene):g}: use more substeps, or `sequential`")


def inside_colliders(scene: Scene, bodies: list[Body], surfaces: dict[int, Surface]) -> Warnings:
    """Free particles that start inside a collider, their radius counted. Scattered copies are clear of all."""
    for index, body in enumerate(bodies):
        free = body.positions[0][~body.pinned]
        if scene.bodies[index].scatter or not len(free):
            continue
        for collider, surface in _with_surfaces(scene, surfaces):
            depth = body.shape.radius - clearance(collider, free, surface)
            deep = depth > TOUCH * _size(body)
            if deep.any():
                yield ("bodies", index), (f"{deep.sum()} of its {len(body.pinned)} particles start inside collider "
                                          f"{collider.name}, up to {depth.max():.3g} m deep")


def _with_surfaces(scene: Scene, surfaces: dict[int, Surface]) -> Iterator[tuple[Collider, Surface | None]]:
    return ((collider, surfaces.get(index)) for index, collider in enumerate(scene.colliders))


def selves(scene: Scene, bodies: list[Body]) -> Warnings:
    """Bodies that are to meet themselves, and cannot."""
    soft = [index for index, body in enumerate(bodies) if not body.shape.rigid]
    if scene.effects.self_collision and not soft:
        yield ("effects", "self_collision"), "does nothing: there is no cloth, no rope and no body of particles"
    for index in soft if scene.effects.self_collision else []:
        if bodies[index].shape.radius == 0 and len(bodies[index].pinned) > 1:
            key = "radius" if bodies[index].shape.kind == "particles" else "thickness"
            yield ("bodies", index), f"has no {key}, so `self_collision` does nothing for it: its particles are points"


def rebounds(scene: Scene, bodies: list[Body]) -> Warnings:
    """Restitution that has no effect: with the paper's response hulls do not rebound from hulls."""
    if scene.solver.response == "body" or scene.effects.contact == "none":
        return
    several = sum(body.copies for body in bodies) > 1
    solid = any(collider.kind not in ("plane", "room") for collider in scene.colliders)
    for index, body in enumerate(bodies):
        if body.shape.rigid and body.restitution > 0 and (several or solid):
            path = ("effects",) if scene.bodies[index].restitution is None else ("bodies", index)
            yield (*path, "restitution"), (f"with `response: feature` {body.name} rebounds from planes and rooms alone, not from "
                                           "other hulls: use `response: body`")
            return


def resolution(scene: Scene, bodies: list[Body]) -> Warnings:
    """Coordinates so large that float32, in the solver or in the file, cannot tell neighbouring particles apart."""
    positive = [body.shape.lengths[body.shape.lengths > 0] for body in bodies]
    lengths = [float(some.min()) for some in positive if len(some)]
    spacing = _float32_spacing(bodies)
    if not lengths or spacing <= RESOLVED * min(lengths):
        return
    for key, precision in (("solver", scene.solver.precision), ("output", scene.output.precision)):
        if precision == "float32":
            yield (key, "precision"), (f"float32 tells coordinates of this size apart by {spacing:.2g} m, too coarse "
                                       f"for sticks of {min(lengths):.3g} m: use float64 or move the scene towards "
                                       "the origin")


def lost_gravity(scene: Scene, bodies: list[Body]) -> Warnings:
    """Substeps so short that the displacement g h^2 of one is lost when it is added to a float32 coordinate."""
    if scene.solver.precision != "float32" or scene.effects.gravity is None:
        return
    fall = float(np.linalg.norm(scene.effects.gravity)) / substeps_a_second(scene)**2
    spacing = _float32_spacing(bodies)
    if 0 < fall < spacing:
        yield ("solver", "precision"), (f"gravity moves a particle by {fall:.2g} m a substep, less than float32 "
                                        f"resolves here ({spacing:.2g} m): use float64 or fewer substeps")


def _float32_spacing(bodies: list[Body]) -> float:
    """Distance (m) between neighbouring float32 numbers at the largest coordinate of the scene."""
    largest = max((float(np.abs(body.positions).max()) for body in bodies), default=0.0)
    return float(np.spacing(np.float32(largest)))


def _size(body: Body) -> float:
    """Largest extent (m) of one copy."""
    return float(np.ptp(body.positions[0], axis=0).max()) + 2 * body.shape.radius
