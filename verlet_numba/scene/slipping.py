"""What may pass through what: bodies too fast for a substep, and cloth and ropes whose particles stand too far apart.

Contacts are sought once a substep, where everything is then. Two hulls that overlap leave each other by the shortest way,
two spheres along the line of their centres: once one centre has passed the other, that way leads out on the wrong side.
So a substep may bring two no farther than half their thicknesses together. A particle that enters a collider leaves it
by the side through which it came: that may take the whole thickness of both.
"""

from collections.abc import Iterator

import numpy as np

from verlet_numba.scene.body import Body, Floats, Shape
from verlet_numba.scene.clearance import planes
from verlet_numba.scene.falling import box_about, landing_speeds
from verlet_numba.scene.problems import Path as Key
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_colliders import Collider
from verlet_numba.scene.shapes import stick_lengths

Warnings = Iterator[tuple[Key, str]]

MOST_BODIES = 1000          # entries of a scene; more are not compared with each other
MOST_FACES = 200            # of a body, across which its width is measured
TOLERANCE = 1e-9            # relative: what rounding makes of a thickness that is just enough


def slipping(scene: Scene, bodies: list[Body]) -> Warnings:
    """All warnings of this page."""
    exact = scene.solver.deformable_contact == "exact"
    if not scene.effects.continuous_collision:
        yield from too_fast_for_colliders(scene, bodies)
        if len(bodies) <= MOST_BODIES:
            yield from too_fast_for_bodies(scene, bodies)
    if not exact:
        yield from segments(bodies)
        yield from too_coarse(scene, bodies)
        if len(bodies) <= MOST_BODIES:
            yield from holes(scene, bodies)


def segments(bodies: list[Body]) -> Warnings:
    """Sticks that shall collide, where only particles do."""
    for index, body in enumerate(bodies):
        if body.shape.segments and body.shape.kind == "particles":
            yield ("bodies", index), "its segments meet nothing, only its particles do: set solver.deformable_contact to exact"


def too_fast_for_colliders(scene: Scene, bodies: list[Body]) -> Warnings:
    """Bodies that a substep may take past a collider, the first one or that in which they come down on it."""
    thin = [(collider, *_thickness(collider)) for collider in scene.colliders if collider.kind in _THICKNESS]
    if not thin:
        return
    speeds = np.array([top_speed(body) for body in bodies])
    landing = landing_speeds(scene, bodies, speeds, np.stack([box_about(collider) for collider, *_ in thin]))
    for index, body in enumerate(bodies):
        if exact_and_soft(scene, body):
            continue
        own = width(body.shape)
        for number, (collider, thickness, own_speed) in enumerate(thin):
            limit = (thickness + own) / 2 if body.shape.rigid else thickness + own
            reach = (max(speeds[index], landing[index, number]) + own_speed) / substeps_a_second(scene)
            if reach > limit:
                falls = bool((speeds[index] + own_speed) / substeps_a_second(scene) <= limit)
                yield ("bodies", index), _too_fast(scene, reach, limit, f"collider {collider.name}", falls)
                break


def too_fast_for_bodies(scene: Scene, bodies: list[Body]) -> Warnings:
    """Bodies that a substep may take past another one, the first one or that in which they come down on it.

    Of two the faster is warned of, or that which falls; on another that falls as well nothing falls.
    """
    if sum(body.copies for body in bodies) < 2:
        return
    speed, thickness = (np.array([of(body) for body in bodies]) for of in (top_speed, lambda body: width(body.shape)))
    reach, limit = (speed[:, None] + speed) / substeps_a_second(scene), (thickness[:, None] + thickness) / 2
    soft = np.array([not body.shape.rigid for body in bodies])
    held = np.array([exact_and_soft(scene, body) for body in bodies])
    meet = ~(held[:, None] | held) & (limit > 0)
    meet &= (speed[:, None] >= speed) & (~np.eye(len(bodies), dtype=bool) | (_copies(bodies) > 1))
    meet &= ~(soft & (thickness == 0))[:, None] | ~soft         # points meet rigid bodies alone
    stays = np.array([body.pinned.any() or bool(scene.colliders) for body in bodies])
    boxes = np.stack([np.stack([body.positions.min(axis=(0, 1)), body.positions.max(axis=(0, 1))]) for body in bodies])
    landing = np.where(stays, landing_speeds(scene, bodies, speed, boxes), 0.0) / substeps_a_second(scene)
    touch = ~(held[:, None] | held) & (limit > 0) & (~(soft & (thickness == 0))[:, None] | ~soft)
    first, later = (np.where(some, far / np.where(limit > 0, limit, 1), 0.0) for some, far in ((meet, reach), (touch, landing)))
    for index, other in enumerate(np.maximum(first, later).argmax(axis=1)):
        falls = bool(later[index, other] > first[index, other])
        if max(first[index, other], later[index, other]) > 1:
            name = "another copy" if other == index else f"body {bodies[other].name}"
            yield ("bodies", index), _too_fast(scene, (landing if falls else reach)[index, other], limit[index, other], name, falls)


def exact_and_soft(scene: Scene, body: Body) -> bool:
    """Whether exact contact lets a body pass through nothing, however fast it is."""
    return scene.solver.deformable_contact == "exact" and not body.shape.rigid


def _too_fast(scene: Scene, reach: float, limit: float, other: str, falls: bool) -> str:
    needed = int(np.ceil(scene.solver.substeps * reach / limit))
    way = f"{reach:.3g} m a substep"
    moves = f"falls by up to {way} on {other}" if falls else f"moves up to {way}, seen from {other}"
    return f"{moves}, and is held back from {limit:.3g} m at most: it may pass through; use {needed} substeps"


def too_coarse(scene: Scene, bodies: list[Body]) -> Warnings:
    """Colliders and rigid bodies that fit between neighbouring particles of cloth and ropes, which meet them alone."""
    small = [(f"collider {collider.name}", _WIDTH[collider.kind](collider)) for collider in scene.colliders
             if collider.kind in _WIDTH]
    small += [(f"body {body.name}", float(sorted(np.ptp(body.shape.positions, axis=0))[1])) for body in bodies if body.shape.rigid]
    for index, body in enumerate(bodies if small else []):
        shape = body.shape
        if shape.rigid or body.pinned.all():
            continue
        longest = float(stick_lengths(body.positions[0], shape.sticks).max(initial=0.0))
        name, least = min(small, key=lambda entry: entry[1])
        if least + 2 * shape.radius < longest:
            yield ("bodies", index), (f"its particles are up to {longest:.3g} m apart, and {name} is {least:.3g} m wide: it may "
                                      "slip between them, since cloth and ropes meet others with their particles only")


def holes(scene: Scene, bodies: list[Body]) -> Warnings:
    """Cloth and ropes that slip between each other's or their own spheres.

    Two surfaces pass through each other vertex by face or edge by edge. A vertex that passes a cell of a cloth with the
    diagonal D is no farther than D/2 from a corner; two edges of lengths a and b that cross at their middles, at right
    angles, have ends sqrt(a^2 + b^2)/2 apart, other edges less. Spheres that reach over that distance hold.
    """
    soft = [index for index, body in enumerate(bodies) if not body.shape.rigid]
    if not soft:
        return
    side, diagonal = np.array([mesh_of(bodies[index].shape) for index in soft]).T
    thickness = np.array([2 * bodies[index].shape.radius for index in soft])
    still = np.array([bodies[index].pinned.all() for index in soft])
    needed = np.maximum(np.hypot(side[:, None], side), np.maximum(diagonal[:, None], diagonal))
    together = thickness[:, None] + thickness
    lines = (diagonal == 0) & (side == 0)                       # points: only a cloth can hold them
    meet = (together > 0) & ~(still[:, None] & still) & ~((lines[:, None] | lines) & (diagonal[:, None] + diagonal == 0))
    meet &= np.tri(len(soft), k=0 if scene.effects.self_collision else -1, dtype=bool) | np.diag(
        np.array([bodies[index].copies > 1 for index in soft]))
    short = np.where(meet & (together < needed * (1 - TOLERANCE)), needed - together, 0.0)
    for row, column in enumerate(short.argmax(axis=1)):
        if short[row, column] > 0:
            name = "itself" if column == row else f"body {bodies[soft[column]].name}"
            wanted = (f"a thickness of {needed[row, row] / 2:.3g} m is enough" if column == row else
                      f"thicknesses of {needed[row, column]:.3g} m together are enough, they are {together[row, column]:.3g} m")
            yield ("bodies", soft[row]), (f"may slip through {name}: the spheres about its particles, which are up to "
                                          f"{max(side[row], diagonal[row]):.3g} m apart, leave holes; {wanted}")


def mesh_of(shape: Shape) -> tuple[float, float]:
    """The longest edge between neighbours of a deformable body, and of a cloth the diagonal of a cell, m."""
    if shape.layout[0] != "grid":
        return float(shape.lengths.max(initial=0.0)), 0.0
    ny = int(shape.layout[2])
    sides = shape.positions[[ny, 1]] - shape.positions[0]
    return float(np.linalg.norm(sides, axis=1).max()), float(np.linalg.norm(sides))


def top_speed(body: Body) -> float:
    """Of any particle at the start, m/s."""
    return float(np.linalg.norm(body.velocities, axis=2).max(initial=0.0))


def width(shape: Shape) -> float:
    """How thick a body is where it is thinnest, m: of deformable ones the thickness, of rigid ones across their faces."""
    if not shape.rigid:
        return 2 * shape.radius
    faces = shape.triangles[::len(shape.triangles) // MOST_FACES + 1]
    heights = shape.positions @ planes(shape.positions, faces)[0].T
    return float(np.ptp(heights, axis=0).min())


def substeps_a_second(scene: Scene) -> float:
    return scene.time.frame_rate * scene.solver.substeps


def _copies(bodies: list[Body]) -> Floats:
    return np.array([body.copies for body in bodies], float)


_THICKNESS = {
    "box": lambda collider: min(collider.size),
    "sphere": lambda collider: 2 * collider.radius,
    "cylinder": lambda collider: min(2 * collider.radius, collider.length),
}

_WIDTH = {
    "box": lambda collider: sorted(collider.size)[1],       # a wall is wide, a post is not
    "sphere": lambda collider: 2 * collider.radius,
    "cylinder": lambda collider: 2 * collider.radius,
}


def _thickness(collider: Collider) -> tuple[float, float]:
    """The least thickness of a finite collider (m), and the greatest speed along its path (m/s)."""
    knots = np.array(collider.path or [(0, 0, 0, 0)], float)
    steps = np.diff(knots, axis=0)
    speeds = np.linalg.norm(steps[:, 1:], axis=1) / steps[:, 0]
    return _THICKNESS[collider.kind](collider), float(speeds.max(initial=0))
