"""Mesh colliders: distances as brute force finds them, and one scene in which all kinds of bodies meet meshes.

A shorter one is in validation/test_together.py.
"""

import json

import numpy as np
import pytest
import trimesh
import worlds

from verlet_numba.effects.mesh_contact import distance
from verlet_numba.run.engine import start
from verlet_numba.scene.build import build
from verlet_numba.scene.clearance import surface_distance
from verlet_numba.scene.load import loads
from verlet_numba.scene.mesh_collider import meshes_of
from verlet_numba.scene.place import place
from verlet_numba.scene.problems import SceneError

in_a_frame = pytest.mark.validate           # compiling a frame for this scene takes minutes
BOWL, RADIUS = [6, 0, 2], 1.0
LIFT, CARRY = 0.4, 0.6      # m


def sheet(cells, size, jitter=0.0, seed=0):
    """Vertices and triangles of an irregularly tessellated square in the plane z = 0."""
    rng, line = np.random.default_rng(seed), np.linspace(-size / 2, size / 2, cells + 1)
    place = np.stack([*np.meshgrid(line, line, indexing="ij"), np.zeros((cells + 1, cells + 1))], axis=-1)
    place[1:-1, 1:-1, :2] += rng.uniform(-1, 1, (cells - 1, cells - 1, 2)) * jitter * size / cells
    i = np.arange((cells + 1)**2).reshape(cells + 1, -1)[:-1, :-1].ravel()
    halves = np.stack([i, i + cells + 1, i + cells + 2], 1), np.stack([i, i + cells + 2, i + 1], 1)
    return place.reshape(-1, 3), np.concatenate(halves)


def bowl(levels=3):
    """The lower part of a sphere, wound to face outwards: a sheet."""
    ball = trimesh.creation.icosphere(levels, RADIUS)
    return ball.vertices, ball.faces[ball.vertices[ball.faces][:, :, 2].max(axis=1) < 0.3 * RADIUS]


SCENE = {
    "version": 1, "time": {"duration": 1, "frame_rate": 60}, "solver": {"substeps": 8},
    "effects": {"gravity": [0, 0, -9.81], "friction": 0.6},
    "bodies": [
        {"kind": "box", "name": "crate", "size": [0.3, 0.3, 0.2], "mass": 1, "position": [-1, 0.013, 0.1], "velocity": [2, 0, 0]},
        {"kind": "box", "name": "turned", "size": [0.3, 0.3, 0.2], "mass": 1, "position": [-1, 0.6, 0.1], "velocity": [2, 0, 0],
         "rotation": {"axis": [0, 0, 1], "degrees": 27}},
        {"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 1, "position": [-1, -0.6, 0.0794654472],
         "velocity": [2, 0, 0], "rotation": {"axis": [0, 1, 0], "degrees": -20.9051574}},
        {"kind": "particles", "name": "beads", "radius": 0.03, "positions": [[-1, -1, 0.03], [-1, -1.1, 0.03]], "masses": [1, 1],
         "velocity": [2, 0, 0], "sticks": []},
        {"kind": "particles", "name": "points", "radius": 0, "positions": [[-1, 1, 0], [-1, 1.1, 0]], "masses": [1, 1],
         "velocity": [2, 0, 0], "sticks": []},
        {"kind": "icosahedron", "name": "marbles", "radius": 0.12, "mass": 1, "count": 3,
         "scatter": {"inside": [[5.5, -0.5, 1.6], [6.5, 0.5, 2.3]], "speed": [0, 1]}},
        {"kind": "particles", "name": "grains", "radius": 0, "positions": [[5.5 + 0.2 * k, 0.07 * k, 2.4] for k in range(5)],
         "masses": [1] * 5, "velocity": [0.5, 1, -1], "sticks": []},
        {"kind": "cloth", "name": "scarf", "size": [1, 1], "resolution": [15, 15], "mass": 0.2, "thickness": 0.02,
         "position": [10, 0, 1.03]},
        {"kind": "box", "name": "on_mesh", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [0, 5, 0.75],
         "rotation": {"axis": [1, 2, 0], "degrees": 20}},
        {"kind": "box", "name": "on_box", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [3, 5, 0.75],
         "rotation": {"axis": [1, 2, 0], "degrees": 20}},
        {"kind": "particles", "name": "below", "radius": 0.02, "positions": [[6.1, 5.03, 0.5]], "masses": [1],
         "velocity": [0, 0, 6], "sticks": []},
        {"kind": "particles", "name": "dart", "radius": 0, "positions": [[6.3, 5.03, 0.5]], "masses": [1], "velocity": [0, 0, 40],
         "sticks": []},
        {"kind": "icosahedron", "name": "rising", "radius": 0.1, "mass": 1, "position": [5.7, 5, 0.5], "velocity": [0, 0, 6]},
        {"kind": "box", "name": "rider", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [10, 5, 0.1]},
        {"kind": "particles", "name": "guest", "radius": 0, "positions": [[10.3, 5.2, 0]], "masses": [1], "sticks": []}],
    "colliders": [
        {"kind": "mesh", "file": "floor.obj", "friction": 0},
        {"kind": "mesh", "file": "bowl.obj", "position": BOWL},
        {"kind": "mesh", "file": "ball.obj", "position": [10, 0, 0.5]},
        {"kind": "mesh", "file": "block.obj", "position": [0, 5, 0.3]},
        {"kind": "box", "size": [1, 1, 0.6], "position": [3, 5, 0.3]},
        {"kind": "mesh", "file": "plate.obj", "position": [6, 5, 1]},
        {"kind": "mesh", "file": "plate.obj", "position": [10, 5, 0], "path": [[0, 10, 5, 0], [1, 10 + CARRY, 5, LIFT]]}],
    "output": {"fields": ["velocity"], "precision": "float64"}}


def loaded(folder, scene):
    return loads(json.dumps(scene), str(folder / "scene.yaml"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    for name, (vertices, triangles) in {"floor": sheet(12, 3.2, 0.3), "bowl": bowl(), "plate": sheet(4, 1.2, 0.2, 1)}.items():
        trimesh.Trimesh(vertices, triangles, process=False).export(folder / f"{name}.obj")
    trimesh.creation.icosphere(3, 0.5).export(folder / "ball.obj")
    trimesh.creation.box((1, 1, 0.6)).export(folder / "block.obj")
    return folder


@pytest.fixture(scope="module")
def seen(folder):
    """Positions (T, P, 3) of every body, first copies and others one after another; and the measures."""
    read = loaded(folder, SCENE)
    bodies = place(read.scene, read.folder, read.source)
    position, _, measures = worlds.advanced(start(build(read.scene, bodies, read.folder)), 61)
    cuts = np.cumsum([body.copies * len(body.shape.positions) for body in bodies])[:-1]
    return {body.name: part for body, part in zip(bodies, np.split(position, cuts, axis=1), strict=True)}, measures


@in_a_frame
@pytest.mark.parametrize("body", ["crate", "turned", "die", "beads", "points"])
def test_a_body_slides_straight_over_a_tessellated_floor(seen, body):
    centre = seen[0][body][:40].mean(axis=1)
    straight = centre[0] + np.arange(40)[:, None] / 60 * [2, 0, 0]
    np.testing.assert_allclose(centre, straight, atol=1e-3)
    height = seen[0][body][:40, :, 2]
    np.testing.assert_allclose(height, np.tile(height[:1], (40, 1)), atol=1e-4)


@in_a_frame
def test_marbles_and_grains_stay_in_the_bowl(seen):
    for body in ("marbles", "grains"):
        depth = np.linalg.norm(seen[0][body] - BOWL, axis=2)
        assert depth.max() < RADIUS * 1.001
        assert seen[0][body][-1, :, 2].max() < BOWL[2]


@in_a_frame
def test_cloth_lies_on_a_ball(seen):
    apart = np.linalg.norm(seen[0]["scarf"] - [10, 0, 0.5], axis=2)
    assert apart.min() > 0.5 * 0.985 + 0.01 - 2e-3         # the icosphere's faces lie within the sphere
    assert (apart[-1] < 0.53).sum() > 20


@in_a_frame
def test_a_box_of_triangles_is_a_box(seen):
    np.testing.assert_allclose(seen[0]["on_mesh"] + [3, 0, 0], seen[0]["on_box"], atol=0.02)
    assert seen[0]["on_mesh"][-1, :, 2].min() == pytest.approx(0.6, abs=1e-3)


@in_a_frame
@pytest.mark.parametrize("body", ["below", "dart", "rising"])
def test_a_sheet_is_met_from_below(seen, body):
    assert seen[0][body][:, :, 2].max() < 1 + 1e-6
    assert seen[0][body][:10, :, 2].max() > 0.9


@in_a_frame
@pytest.mark.parametrize("body", ["rider", "guest"])
def test_a_moving_mesh_carries(seen, body):
    moved = seen[0][body][-1].mean(axis=0) - seen[0][body][0].mean(axis=0)
    np.testing.assert_allclose(moved, [CARRY, 0, LIFT], atol=0.02)


@in_a_frame
def test_nothing_penetrates(seen):
    assert seen[1][:, 14].max() < 5e-3


@pytest.mark.parametrize("name", ["ball", "block", "bowl"])
def test_distances_are_those_of_all_triangles(folder, name):
    from verlet_numba.scene.colliders import solids

    read = loaded(folder, {"version": 1, "time": {"duration": 1}, "colliders": [
        {"kind": "mesh", "file": f"{name}.obj", "scale": 2, "rotation": {"axis": [1, 0, 0], "degrees": 30}}]})
    found = solids(read.scene.colliders[0], folder)
    meshes, (vertices, triangles) = meshes_of(found, 1), found[0].surface
    points = np.random.default_rng(3).uniform(-2.2, 2.2, (300, 3))
    expected = surface_distance(vertices, triangles, points)
    result = np.array([distance(meshes, 0, 0.0, 100.0, *point)[:4] for point in points])
    if name == "bowl":
        np.testing.assert_allclose(np.abs(result[:, 0]), expected, atol=1e-12)
        inner = np.abs(result[:, 0]) < 0.2
        border = np.array([distance(meshes, 0, 0.0, 100.0, *point)[4] for point in points])
        inner &= ~border.astype(bool)
        np.testing.assert_array_equal(result[inner, 0] > 0, np.linalg.norm(points[inner], axis=1) > 2 * RADIUS * 0.995)
    else:
        np.testing.assert_allclose(result[:, 0], expected, atol=1e-12)
    ahead = np.array([distance(meshes, 0, 0.0, 100.0, *(point + 1e-6 * step))[0] for point in points for step in np.eye(3)])
    np.testing.assert_allclose((ahead.reshape(-1, 3) - result[:, :1]) / 1e-6, result[:, 1:], atol=2e-3)
    assert distance(meshes, 0, 0.0, 1e-3, 50.0, 0.0, 0.0)[0] == np.inf


@pytest.mark.parametrize(("faces", "words"), [
    ([[0, 1, 2], [0, 1, 3]], "wound against its neighbour"), ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], "more than one other"),
    ([[0, 1, 2], [0, 0, 3]], "has no area")])
def test_what_is_no_surface_is_refused_where_it_is_named(tmp_path, faces, words):
    lines = [f"v {x} {y} {z}" for x, y, z in [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0)]]
    (tmp_path / "wrong.obj").write_text("\n".join([*lines, *("f {} {} {}".format(*(np.array(face) + 1)) for face in faces)]))
    read = loaded(tmp_path, {"version": 1, "time": {"duration": 1}, "colliders": [{"kind": "mesh", "file": "wrong.obj"}]})
    with pytest.raises(SceneError, match=words) as error:
        place(read.scene, read.folder, read.source)
    assert error.value.problems[0].path == "colliders.0.file"
