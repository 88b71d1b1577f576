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
