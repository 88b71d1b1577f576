"""Where scattered copies may go: clear of a body that is not convex, by its parts."""

import json

import numpy as np
import pytest
import trimesh

from verlet_numba.scene.load import load
from verlet_numba.scene.occupied import Occupied
from verlet_numba.scene.place import place

HEXAGON = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
L = trimesh.Trimesh(
    [(x, y, z) for z in (0, 1) for x, y in HEXAGON],
    [*([0, k + 1, k] for k in range(1, 5)), *([6, k + 6, k + 7] for k in range(1, 5)),
     *([k, (k + 1) % 6, (k + 1) % 6 + 6] for k in range(6)), *([k, (k + 1) % 6 + 6, k + 6] for k in range(6))])
"""Arms over [0, 2] x [0, 1] and [0, 1] x [0, 2]; the notch is between them."""
NOTCH = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 1.0]])
POSITION = np.array([5.0, -3.0, 2.0])


@pytest.fixture
def occupied(tmp_path):
    L.export(tmp_path / "angle.ply")
    scene = {"version": 1, "time": {"duration": 1},
             "bodies": [{"kind": "mesh", "name": "angle", "file": "angle.ply", "mass": 1, "position": POSITION.tolist()},
                        {"kind": "box", "name": "crate", "size": [1, 1, 1], "mass": 1, "position": [9, 9, 9]},
                        {"kind": "icosahedron", "name": "dice", "radius": 0.15, "mass": 1, "count": 8,
                         "scatter": {"inside": (POSITION + NOTCH).tolist()}}]}
    (tmp_path / "scene.yaml").write_text(json.dumps(scene))
    loaded = load(tmp_path / "scene.yaml")
    return loaded, place(loaded.scene, loaded.folder, loaded.source)


def test_free_space_is_outside_of_all_parts(occupied):
    loaded, bodies = occupied
    free = Occupied(loaded.scene, {}, dict(enumerate(bodies[:2]))).free(0.2)
    points = np.random.default_rng(0).uniform([-1, -1, -1], [3, 3, 2], (10_000, 3))
    found = free(points + POSITION)
    # CoACD takes the arms apart in one way or another; a distance from a box counts in front of its faces only.
    one = np.abs(points - [1, 0.5, 0.5]) - [1, 0.5, 0.5]
    other = np.abs(points - [0.5, 1, 0.5]) - [0.5, 1, 0.5]
    depth = np.minimum(one.max(axis=1), other.max(axis=1))
    notch = (points > [1.25, 1.25, 0.2]).all(axis=1) & (points < [2, 2, 0.8]).all(axis=1)
    assert notch.sum() > 20
    assert found[notch].all()
    assert not found[depth < 0.19].any()
    assert found[depth > 0.21].all()
    assert not free(np.array([[9.0, 9.6, 9]])).any()
    assert free(np.array([[9.0, 9.8, 9]])).all()


def test_copies_are_scattered_in_the_notch(occupied):
    _, bodies = occupied
    dice = bodies[2].positions - POSITION
    assert dice.shape == (8, 12, 3)
    assert (dice[..., :2] > 1).all()
