"""What positions tell of a run: energies, momenta, errors of lengths, depth in colliders, handedness, crossings."""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.study.reader import Array, Body, Trajectory, TrajectoryError

RIGID = ("box", "icosahedron", "mesh")
FLAT = 1e-9             # of the cube of a body's size: what has less volume has no handedness


class Block(NamedTuple):
    """Consecutive frames of the particles that are measured."""

    time: Array         # (k,) s
    position: Array     # (k, n, 3) m
    velocity: Array     # (k, n, 3) m/s


class Part:
    """What of a trajectory is measured, a stretch of its bodies, and what its scene says of them."""

    def __init__(self, trajectory: Trajectory, rows: list[Body]) -> None:
        self.trajectory, self.rows = trajectory, rows
        first = rows[0].first_particle if rows else 0
        end = rows[-1].first_particle + rows[-1].particles if rows else 0
        if not 0 <= first <= end <= trajectory.particles:
            raise TrajectoryError(f"{trajectory.path}: damaged: bodies with more particles than there are")
        self.particles = slice(first, end)
        self.entries = {entry.get("name"): entry for entry in trajectory.scene.get("bodies", ()) if isinstance(entry, dict)}

    def entry(self, row: Body) -> dict[str, Any]:
        """What the scene says of a body; copies are NAME.0, NAME.1 ..."""
        return self.entries.get(row.name.split(".")[0], {})

    @cached_property
    def masses(self) -> Array:
        """(n,) kg: given one by one, or the body's shared equally."""
        found = [np.zeros(0)]
        for row in self.rows:
            given = self.entry(row).get("masses")
            found.append(np.asarray(given, float) if given else np.full(row.particles, row.mass / row.particles))
        return np.concatenate(found)

    @cached_property
    def radii(self) -> Array:
        """(n,) m: contact radius of every particle."""
        found = [float(entry.get("radius") or 0.5 * (entry.get("thickness") or 0.0)) if row.kind not in RIGID else 0.0
                 for row, entry in ((row, self.entry(row)) for row in self.rows)]
        return np.repeat(found, [row.particles for row in self.rows])

    @cached_property
    def gravity(self) -> Array:
        """(3,) m/s²."""
        return np.asarray(self.trajectory.scene.get("effects", {}).get("gravity") or (0.0, 0.0, 0.0), float)

    @cached_property
    def sticks(self) -> tuple[Array, Array]:
        """Distance constraints of positive length: (C, 2) particles, counted from the first one here, and (C,) m."""
        pairs, length = self.trajectory.pairs.astype(np.int64), self.trajectory.lengths
        inside = ((pairs >= self.particles.start) & (pairs < self.particles.stop)).all(axis=1) & (length > 0)
        return pairs[inside] - self.particles.start, length[inside]

    @cached_property
    def triangles(self) -> Array:
        """(F, 3) particles, counted from the first one here."""
        corners = self.trajectory.triangles
        inside = ((corners >= self.particles.start) & (corners < self.particles.stop)).all(axis=1)
        return corners[inside] - self.particles.start

    @cached_property
    def colliders(self) -> list[tuple[dict[str, Any], Any]]:
        """As told by the scene, and as a model that stands at the origin."""
        from pydantic import TypeAdapter

        from verlet_numba.scene.schema_colliders import Collider

        adapter: TypeAdapter[Any] = TypeAdapter(Collider)
        found = []
        for told in self.trajectory.scene.get("colliders", ()):
            model = adapter.validate_python(told)
            where = "point" if model.kind == "plane" else "position"
            found.append((told, model.model_copy(update={where: (0.0, 0.0, 0.0)})))
        return found

    @cached_property
    def tetrahedra(self) -> tuple[Array, Array]:
        """(B, 4) particles of each rigid body that has a volume, and the sign (B,) of that of the four at the start."""
        start = self.trajectory.positions(0)[self.particles].astype(float) if self.trajectory.frames else np.zeros((0, 3))
        solid = [row for row in self.rows if row.kind in RIGID and row.particles >= 4]
        found: dict[int, list[int]] = {}
        for row in solid:
            found.setdefault(row.particles, []).append(row.first_particle - self.particles.start)
        rows, signs = [np.zeros((0, 4), np.int64)], [np.zeros(0)]
        for count, firsts in found.items() if len(start) else ():
            index = np.array(firsts)[:, None] + np.arange(count)
            corners = spread_out(start[index])
            volume = six_volumes(np.take_along_axis(start[index], corners[..., None], axis=1))
            size = np.ptp(start[index], axis=1).max(axis=1)
            good = np.abs(volume) > FLAT * size**3
            rows.append(np.take_along_axis(index, corners, axis=1)[good])
            signs.append(np.sign(volume[good]))
        return np.concatenate(rows), np.concatenate(signs)


def part_of(trajectory: Trajectory, body: str | None) -> Part | None:
    """A body with all its copies, one copy NAME.K, or without a name the whole scene; None if no body is called so."""
    rows = [row for row in trajectory.bodies if body is None or body in (row.name, row.name.split(".")[0])]
    return None if body is not None and not rows else Part(trajectory, rows)


def spread_out(points: Array) -> Array:
    """(B, 4) of the points (B, P, 3): far from the middle, from each other, from their line and from their plane."""
    body = np.arange(len(points))
    first = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).argmax(axis=1)
    rest = points - points[body, first][:, None]
    second = np.linalg.norm(rest, axis=2).argmax(axis=1)
    across = np.cross(rest, rest[body, second][:, None])
    third = np.linalg.norm(across, axis=2).argmax(axis=1)
    fourth = np.abs((rest * across[body, third][:, None]).sum(axis=2)).argmax(axis=1)
    return np.stack([first, second, third, fourth], axis=1)


def six_volumes(corners: Array) -> Array:
    """Six times the signed volume of tetrahedra (..., 4, 3)."""
    u, v, w = np.moveaxis(corners[..., 1:, :] - corners[..., :1, :], -2, 0)
    return np.asarray((u * np.cross(v, w)).sum(axis=-1))


def kinetic_energy(part: Part, block: Block) -> Array:
    """Sum of m v²/2."""
    return np.asarray(0.5 * np.einsum("kni,kni,n->k", block.velocity, block.velocity, part.masses))


def potential_energy(part: Part, block: Block) -> Array:
    """-Sum of m g . x: zero at the origin."""
    return np.asarray(-np.einsum("kni,n,i->k", block.position, part.masses, part.gravity))


def total_energy(part: Part, block: Block) -> Array:
    return kinetic_energy(part, block) + potential_energy(part, block)


def momentum(part: Part, block: Block) -> Array:
    """Sum of m v."""
    return np.asarray(np.einsum("kni,n->ki", block.velocity, part.masses))


def angular_momentum(part: Part, block: Block) -> Array:
    """Sum of m x x v, about the origin."""
    return np.asarray(np.einsum("kni,n->ki", np.cross(block.position, block.velocity), part.masses))


def centre_of_mass(part: Part, block: Block) -> Array:
    """Sum of m x over that of m; the origin where nothing has a mass."""
    return np.asarray(np.einsum("kni,n->ki", block.position, part.masses) / (part.masses.sum() or 1.0))


def constraint_errors(part: Part, block: Block) -> Array:
    """(k, C) |d / rest - 1|, one 0 where there are no sticks."""
    pairs, length = part.sticks
    if not len(pairs):
        return np.zeros((len(block.time), 1))
    between = block.position[:, pairs[:, 1]] - block.position[:, pairs[:, 0]]
    return np.asarray(np.abs(np.linalg.norm(between, axis=2) / length - 1.0))


def constraint_error_max(part: Part, block: Block) -> Array:
    return np.asarray(constraint_errors(part, block).max(axis=1))


def constraint_error_rms(part: Part, block: Block) -> Array:
    return np.asarray(np.sqrt((constraint_errors(part, block)**2).mean(axis=1)))


def speed_max(part: Part, block: Block) -> Array:
    return np.asarray(np.linalg.norm(block.velocity, axis=2).max(axis=1, initial=0.0))


def penetration_max(part: Part, block: Block) -> Array:
    """Of particles, with their radius, in colliders. What hulls do to each other only a run records."""
    from verlet_numba.scene.clearance import clearance

    deepest = np.zeros(len(block.time))
    if part.trajectory.scene.get("effects", {}).get("contact") == "none" or not block.position.shape[1]:
        return deepest
    for told, model in part.colliders:
        for frame, local in local_frames(told, block):
            distance = clearance(model, local.reshape(-1, 3)).reshape(local.shape[:-1])
            deepest[frame] = np.maximum(deepest[frame], (part.radii - distance).max(axis=-1))
    return deepest


def local_frames(told: dict[str, Any], block: Block) -> list[tuple[Any, Array]]:
    """Frames of a block, together or one by one, and their points as seen from a collider that may move."""
    from verlet_numba.study.surfaces import placed

    if not told.get("path") and not told.get("spin"):
        return [(slice(None), seen_from(placed(told, 0.0), block.position))]
    return [(k, seen_from(placed(told, float(t)), block.position[k])) for k, t in enumerate(block.time)]


def seen_from(place: Any, points: Array) -> Array:
    return np.asarray((points - place.origin) @ place.rotation)


def outside(part: Part, block: Block) -> Array:
    """Largest distance of a particle outside a room; 0 without rooms."""
    farthest = np.zeros(len(block.time))
    for told in part.trajectory.scene.get("colliders", ()):
        if told.get("kind") == "room" and block.position.shape[1]:
            for frame, local in local_frames(told, block):
                beyond = np.maximum(np.abs(local) - 0.5 * np.asarray(told["size"], float), 0.0)
                farthest[frame] = np.maximum(farthest[frame], np.linalg.norm(beyond, axis=-1).max(axis=-1))
    return farthest


def orientation_flips(part: Part, block: Block) -> Array:
    """Rigid bodies that are the mirror image of what they were at the start, by the volume of four of their particles."""
    corners, sign = part.tetrahedra
    return np.asarray((six_volumes(block.position[:, corners]) * sign < 0).sum(axis=1))


def self_intersections(part: Part, block: Block) -> Array:
    """Pairs of triangles that cross; touching and sharing corners is no crossing."""
    return np.array([crossing_pairs(position, part.triangles) for position in block.position], float)


def crossing_pairs(position: Array, triangles: Array) -> int:
    """How many pairs of triangles (F, 3) cross: an edge of the one passes through the other."""
    from verlet_numba.scene.crossing import crossings

    ends, through = crossings(position, triangles)
    count = len(position)
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    keys, wanted = sides[:, 0] * count + sides[:, 1], np.sort(ends, axis=1) @ np.array([count, 1])
    order = np.argsort(keys)
    low, high = (np.searchsorted(keys, wanted, side, sorter=order) for side in ("left", "right"))
    pairs = [np.stack([order[low[has] + k] // 3, through[has]], axis=1)
             for k in range(int((high - low).max(initial=0))) for has in [high - low > k]]
    found = np.sort(np.concatenate([np.zeros((0, 2), np.int64), *pairs]), axis=1)
    return len(np.unique(found, axis=0))


COMPUTED: dict[str, Callable[[Part, Block], Array]] = {
    function.__name__: function for function in (
        kinetic_energy, potential_energy, total_energy, momentum, angular_momentum, centre_of_mass, constraint_error_max,
        constraint_error_rms, penetration_max, speed_max, outside, orientation_flips, self_intersections)}
