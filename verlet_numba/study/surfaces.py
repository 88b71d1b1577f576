"""Bodies and colliders as coloured triangles, for pictures."""

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from verlet_numba.study.camera import Floats, rotation_about
from verlet_numba.study.reader import Trajectory

# Okabe and Ito's colours, which the colour-blind tell apart; the grey ones are left to colliders.
PALETTE = np.array([[0, 114, 178], [230, 159, 0], [0, 158, 115], [213, 94, 0], [204, 121, 167], [86, 180, 233],
                    [240, 228, 66]]) / 255
COLLIDER = (0.62, 0.63, 0.66)
TILES = np.array([[0.80, 0.80, 0.79], [0.87, 0.87, 0.86]])
WALL, FLOOR, WIRE = (0.83, 0.86, 0.90), (0.87, 0.87, 0.86), (0.42, 0.45, 0.50)


class Surface(NamedTuple):
    """Triangles (M, 3, 3) m and their colours (M, 3), 0 to 1. What is `solid` is shaded and casts shadows, and what is
    flat, of one `normal`, takes them."""

    triangles: Floats
    colours: Floats
    solid: bool = True
    normal: Floats | None = None


def surface(triangles: Floats, colour: ArrayLike, solid: bool = True, normal: Floats | None = None) -> Surface:
    """Triangles (..., 3, 3) in one colour, or one each."""
    triangles = triangles.reshape(-1, 3, 3)
    return Surface(triangles, np.broadcast_to(np.asarray(colour, float), (len(triangles), 3)), solid, normal)


@cache
def ball(levels: int) -> Floats:
    """Triangles (20 4^levels, 3, 3) of a unit sphere: an icosahedron's, split in four `levels` times."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([[0, a, b * golden] for a in (-1, 1) for b in (-1, 1)], float)
    corners = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    found = [(i, j, k) for i, j, k in combinations(range(12), 3) if near[i, j] and near[j, k] and near[i, k]]
    faces: Floats = corners[np.array(found)] / np.linalg.norm(corners[0])
    for _ in range(levels):
        middle = faces + np.roll(faces, -1, axis=1)
        middle /= np.linalg.norm(middle, axis=2, keepdims=True)
        a, b, c = np.moveaxis(faces, 1, 0)
        ab, bc, ca = np.moveaxis(middle, 1, 0)
        parts = (a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)
        faces = np.concatenate([np.stack(part, 1) for part in parts])
    return faces


def grid(origin: ArrayLike, u: ArrayLike, v: ArrayLike, cells: int) -> Floats:
    """Two triangles for each of cells x cells cells of a parallelogram: (cells, cells, 2, 3, 3)."""
    s = np.arange(cells + 1)[:, None] / cells
    points = np.asarray(origin) + s[:, None] * np.asarray(u) + s[None] * np.asarray(v)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2)


def across(direction: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (..., 3) at right angles to the unit vectors `direction` and to each other."""
    helper = np.where(np.abs(direction[..., 2:]) < 0.8, [0.0, 0, 1], [1.0, 0, 0])
    u = np.cross(helper, direction)
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    return u, np.cross(direction, u)


def tubes(starts: Floats, ends: Floats, radius: float, sides: int = 10) -> Floats:
    """Open cylinders around segments (S, 3) to (S, 3): triangles (S, 2 sides, 3, 3)."""
    along = ends - starts
    length = np.linalg.norm(along, axis=1, keepdims=True)
    u, v = across(along / np.where(length > 0, length, 1))
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = radius * (np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * v[:, None])
    a, b = starts[:, None] + ring, ends[:, None] + ring
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 1)


def dots(centres: Floats, radius: float, levels: int = 1) -> Floats:
    """Small spheres: triangles (P, 20 4^levels, 3, 3)."""
    return centres[:, None, None] + radius * ball(levels)


def body_surfaces(trajectory: Trajectory, positions: Floats, scale: float) -> list[Surface]:
    """Bodies at positions (N, 3): triangles, polylines as tubes, loose particles as dots, one colour a body.

    `scale` is the size of the scene, m: nothing is drawn thinner than a small part of it.
    """
    owner = owners(trajectory)
    line_radius, dot_radius = radii(trajectory, scale)
    colours = PALETTE[np.arange(len(trajectory.bodies)) % len(PALETTE)]
    found = [surface(positions[trajectory.triangles], colours[owner[trajectory.triangles[:, 0]]])]
    for line in trajectory.lines:
        body, points = int(owner[line[0]]), positions[line]
        found.append(surface(tubes(points[:-1], points[1:], line_radius[body]), colours[body]))
        found.append(surface(dots(points, line_radius[body]), colours[body]))
    for number, entry in enumerate(trajectory.bodies):
        if entry.kind == "particles":
            points = positions[entry.first_particle:entry.first_particle + entry.particles]
            levels = 2 if entry.particles <= 100 else 1 if entry.particles <= 2000 else 0
            found.append(surface(dots(points, dot_radius[number], levels), colours[number]))
    return found


def owners(trajectory: Trajectory) -> Any:
    """(N,) the number of the body that each particle is of."""
    return np.repeat(np.arange(len(trajectory.bodies)), [body.particles for body in trajectory.bodies])


def radii(trajectory: Trajectory, scale: float) -> tuple[Floats, Floats]:
    """(B,) m, how thick each body's lines and its dots are drawn: as in the scene, but no thinner than a small part of `scale`."""
    entries = {entry.get("name"): entry for entry in trajectory.scene.get("bodies", ()) if isinstance(entry, dict)}
    told = [entries.get(body.name.split(".")[0], {}) for body in trajectory.bodies]     # copies are NAME.0, NAME.1 ...
    own = np.array([float(entry.get("radius") or 0.5 * (entry.get("thickness") or 0.0)) for entry in told])
    ropes = np.array([body.kind == "rope" for body in trajectory.bodies], bool)
    return np.maximum(np.where(ropes, own, 0.0), 0.003 * scale), np.maximum(own, 0.009 * scale)


class Placed(NamedTuple):
    """Where a collider is at some moment."""

    origin: Floats      # (3,)
    rotation: Floats    # (3, 3)

    def of(self, points: Floats) -> Floats:
        return self.origin + points @ self.rotation.T


def placed(collider: dict[str, Any], time: float) -> Placed:
    """Pose of a collider at `time` s: its place carried along by `path`, turned by `spin` about it."""
    path = np.array(collider.get("path") or [[0.0, 0.0, 0.0, 0.0]], float)
    start = collider.get("point" if collider["kind"] == "plane" else "position")
    origin = np.array(path[0, 1:] if start is None else start, float)
    moved = [np.interp(time, path[:, 0], column) - column[0] for column in path[:, 1:].T]
    spin = collider.get("spin")
    rotation = rotation_about(spin["axis"], spin["rate"] * time) if spin else np.eye(3)
    return Placed(origin + moved, rotation)


def solid(collider: dict[str, Any], folders: Sequence[Path]) -> Floats:
    """Triangles (M, 3, 3) of a box, sphere, cylinder or mesh collider about its own origin; none for other kinds.

    A mesh's file is in the first of the folders that has it.
    """
    match collider["kind"]:
        case "box":
            half = 0.5 * np.array(collider["size"], float)
            sides = [(axis, sign) for axis in range(3) for sign in (-1, 1)]
            frames = np.eye(3)
            return outward(np.concatenate([
                grid(half * (sign * frames[axis] - frames[axis - 1] - frames[axis - 2]), 2 * half * frames[axis - 1],
                     2 * half * frames[axis - 2], 4).reshape(-1, 3, 3) for axis, sign in sides]))
        case "sphere":
            return outward(float(collider["radius"]) * ball(4))
        case "cylinder":
            axis = np.array(collider.get("axis", (0, 0, 1)), float)
            end = (0.5 * collider["length"] * axis / np.linalg.norm(axis))[None]
            tube = tubes(-end, end, collider["radius"], 72).reshape(-1, 3, 3)
            rim = tube[:72]     # corners: start, end, next end
            lids = [np.stack([rim[:, corner], np.roll(rim[:, corner], -1, axis=0), np.broadcast_to(lid, (72, 3))], 1)
                    for corner, lid in ((0, -end), (1, end))]
            return outward(np.concatenate([tube, *lids]))
        case "mesh":
            return _mesh(collider, folders)
    return np.zeros((0, 3, 3))


def outward(triangles: Floats) -> Floats:
    """Triangles (M, 3, 3) of a convex solid about the origin, counter-clockwise seen from outside."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    inside_out = (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) < 0
    return np.where(inside_out[:, None, None], triangles[:, ::-1], triangles)


def _mesh(collider: dict[str, Any], folders: Sequence[Path]) -> Floats:
    """A mesh collider's triangles; none if its file is gone."""
    import trimesh

    files = [folder / collider["file"] for folder in folders]
    try:
        mesh = trimesh.load_mesh(next((file for file in files if file.is_file()), files[0]), process=False)
    except (OSError, ValueError):
        return np.zeros((0, 3, 3))
    turn = collider.get("rotation")
    rotation = rotation_about(turn["axis"], np.radians(turn["degrees"])) if turn else np.eye(3)
    return np.asarray(collider.get("scale", 1.0) * mesh.triangles @ rotation.T, float)


def ground(collider: dict[str, Any], time: float, eye: Floats, centre: Floats, scale: float,
           background: Floats) -> list[Surface]:
    """A plane as tiles around `centre` that fade into the background, unless it is seen from behind."""
    place = placed(collider, time)
    normal = place.rotation @ np.array(collider.get("normal", (0, 0, 1)), float)
    normal /= np.linalg.norm(normal)
    if (eye - place.origin) @ normal <= 0:
        return []
    middle = centre - ((centre - place.origin) @ normal) * normal
    u, v = across(normal)
    tile = _round_number(0.3 * scale)
    cells = 2 * int(np.ceil(2.2 * scale / tile))
    corner = middle - middle @ u % tile * u - middle @ v % tile * v - 0.5 * cells * tile * (u + v)
    triangles = grid(corner, cells * tile * u, cells * tile * v, cells)
    parity = int(np.rint(corner @ u / tile) + np.rint(corner @ v / tile))
    colours = TILES[(np.arange(cells)[:, None] + np.arange(cells) + parity) % 2][:, :, None]
    distance = np.linalg.norm(triangles.mean(axis=3) - middle, axis=3, keepdims=True)
    fade = np.clip((distance / scale - 0.9) / 1.2, 0, 1)
    colours = colours + fade * (background - colours)
    return [Surface(triangles.reshape(-1, 3, 3), colours.reshape(-1, 3), False, normal)]


def _round_number(size: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is at most `size`."""
    power = 10.0 ** np.floor(np.log10(size))
    return float(max(step for step in (1, 2, 5) if step * power <= size * (1 + 1e-9)) * power)


def room(collider: dict[str, Any], time: float, eye: Floats, scale: float) -> list[Surface]:
    """A room's edges, and those of its walls that the camera sees from inside."""
    place, half = placed(collider, time), 0.5 * np.array(collider["size"], float)
    frame, found = np.eye(3), []
    for axis in range(3):
        for sign in (-1, 1):
            across_u, across_v = frame[axis - 1] * half, frame[axis - 2] * half
            corner = sign * frame[axis] * half
            if (eye - place.of(corner)) @ place.rotation @ frame[axis] * sign < 0:
                wall = place.of(grid(corner - across_u - across_v, 2 * across_u, 2 * across_v, 24))
                inward = -sign * place.rotation[:, axis]
                found.append(surface(wall, FLOOR if axis == 2 else WALL, solid=False, normal=inward))
            for other in (-1, 1):
                middle = corner + other * across_u
                ends = place.of(np.stack([middle - across_v, middle + across_v]))
                found.append(surface(tubes(ends[:1], ends[1:], 0.0015 * scale, 4), WIRE, solid=False))
    return found

