"""Trajectory files of made-up motion: two cubes, three dots and a square of cloth in a room with a ball that moves."""

import json

import numpy as np

from verlet_numba.run.layout import BodyTable, Contents, Quantity
from verlet_numba.run.trajectory import TrajectoryFile

FRAMES, RATE = 23, 60
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
MASSES = [1.0, 2.0, 4.0]
SCENE = {
    "effects": {"gravity": [0.5, 0, -9.81], "contact": "auto"},
    "bodies": [{"kind": "box", "name": "crate"}, {"kind": "particles", "name": "dots", "masses": MASSES, "radius": 0.1},
               {"kind": "cloth", "name": "sheet", "thickness": 0.06}],
    "colliders": [{"kind": "room", "size": [4, 4, 4], "position": [0.5, 0, 0], "name": "room"},
                  {"kind": "sphere", "radius": 0.7, "position": [0, 0, 0], "name": "ball", "path": [[0, 0, 0, 0], [1, 2, 0, 0]]}]}
TABLE = BodyTable(["crate.0", "crate.1", "dots", "sheet"], ["box", "box", "particles", "cloth"], [0, 8, 16, 19], [8, 8, 3, 4],
                  [0, 0, 0, 0], [0, 0, 0, 2], [4.0, 4.0, 7.0, 1.0])
MASS = np.array([0.5] * 16 + MASSES + [0.25] * 4)
RADIUS = np.array([0.0] * 16 + [0.1] * 3 + [0.03] * 4)
PAIRS = np.array([[0, 1], [8, 15], [16, 17], [17, 18], [19, 20]])
LENGTHS = np.array([1.0, 1.7, 0.5, 0.0, 1.0])
TRIANGLES = np.array([[19, 20, 21], [19, 21, 22]])


def write(path, position, velocity=None, scene=SCENE, observables=None, table=TABLE, pairs=PAIRS, lengths=LENGTHS,
          triangles=TRIANGLES, rate=RATE):
    """A trajectory file of these positions (T, N, 3) at `path`; observables: name -> (T,) or (T, 3)."""
    observables = observables or {}
    quantities = {name: Quantity("1", 1 if np.ndim(values) == 1 else 3, "f8") for name, values in observables.items()}
    contents = Contents(position.shape[1], np.asarray(pairs), np.asarray(lengths), [], triangles, table, quantities,
                        {"scene_text": "", "scene": json.dumps(scene)},
                        ("position",) if velocity is None else ("position", "velocity"), "f8")
    number = np.arange(len(position))
    fields = {"position": position} | ({} if velocity is None else {"velocity": velocity})
    with TrajectoryFile(path, contents, len(position), True) as file:
        file.append(number / rate, number, fields, observables)
        file.finish("complete", "2024-01-01", {})
    return path


BOX_FACES = np.array([[0, 1, 3], [0, 3, 2], [5, 4, 6], [5, 6, 7], [0, 4, 5], [0, 5, 1], [3, 7, 6], [3, 6, 2], [0, 2, 6], [0, 6, 4],
                      [3, 1, 5], [3, 5, 7]])
VARIETY = {
    "name": "variety", "time": {"frame_rate": RATE, "duration": 0.5},
    "bodies": [{"kind": "cloth", "name": "sheet", "thickness": 0.02}, {"kind": "rope", "name": "line", "thickness": 0.08},
               {"kind": "box", "name": "crate"}, {"kind": "particles", "name": "dots", "radius": 0.1}],
    "colliders": [{"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]},
                  {"kind": "box", "size": [0.4, 0.4, 0.4], "position": [1, 1, 0.2], "spin": {"axis": [0, 0, 1], "rate": 2.0}},
                  {"kind": "cylinder", "radius": 0.1, "axis": [0, 1, 0], "length": 0.6, "position": [0, -1.5, 0.1], "name": "log"}]}


def variety(path, frames=31, dtype="f4"):
    """One of everything in motion: a waving sheet of 4x3, a rope of 6 particles, two boxes that fly and turn, three dots."""
    i, j = (axis.ravel() for axis in np.mgrid[:4, :3])
    sheet = np.stack([0.3 * i - 1.5, 0.3 * j, 0 * i + 1.0], 1)
    corner = np.arange(12).reshape(4, 3)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    cells = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    rope = np.linspace([0, -1, 1.2], [1, -1, 1.2], 6)
    time = np.arange(frames) / RATE
    phase = 6 * time[:, None]
    waving = np.repeat(sheet[None], frames, axis=0)
    waving[:, :, 2] += 0.2 * np.sin(phase + 3 * sheet[:, 0])
    swinging = np.repeat(rope[None], frames, axis=0)
    swinging[:, :, 2] -= 0.3 * np.sin(np.pi * rope[:, 0]) * np.cos(phase)
    turn = np.moveaxis(np.array([[np.cos(3 * time), -np.sin(3 * time), 0 * time], [np.sin(3 * time), np.cos(3 * time), 0 * time],
                                 [0 * time, 0 * time, 0 * time + 1]]), 2, 0)
    flight = np.stack([0 * time, 0.5 * time, 0.8 + 2 * time - 4.9 * time**2], 1)
    boxes = [flight[:, None] + [x, 0, 0] + 0.3 * (CUBE - 0.5) @ turn.transpose(0, 2, 1) for x in (0.0, 0.7)]
    dots = np.array([[1.2, 0, 0.3], [1.2, 0, 0.8], [1.6, 0.2, 0.4]]) + np.stack([0.1 * np.sin(phase), 0 * phase, 0 * phase], 2)
    position = np.concatenate([waving, swinging, *boxes, dots], axis=1)
    table = BodyTable(["sheet", "line", "crate.0", "crate.1", "dots"], ["cloth", "rope", "box", "box", "particles"],
                      [0, 12, 18, 26, 34], [12, 6, 8, 8, 3], [0, 12, 12, 24, 36], [12, 0, 12, 12, 0], [1.0, 2.0, 3.0, 3.0, 1.5])
    triangles = np.concatenate([cells, BOX_FACES + 18, BOX_FACES + 26])
    chain = np.arange(12, 17)[:, None] + [0, 1]
    pairs = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[[0, 1]].T, chain])
    lengths = np.linalg.norm(position[0, pairs[:, 0]] - position[0, pairs[:, 1]], axis=1)
    energy = 10 + np.cos(6 * time)
    contents = Contents(37, pairs, lengths, [np.arange(12, 18), np.array([34, 35])], triangles, table,
                        {"total_energy": Quantity("J", 1, "f8"), "constraint_error_max": Quantity("1", 1, "f8")},
                        {"scene_text": "", "scene": json.dumps(VARIETY)}, ("position", "velocity"), dtype)
    velocity = np.gradient(position, time, axis=0) if frames > 1 else np.zeros_like(position)
    with TrajectoryFile(path, contents, frames, True) as file:
        file.append(time, np.arange(frames), {"position": position, "velocity": velocity},
                    {"total_energy": energy, "constraint_error_max": 0.01 * np.sin(time) ** 2})
        file.finish("complete", "2024-01-01", {})
    return path
