"""From a scene to bodies where the simulation starts."""

import numpy as np
import pytest
import trimesh

from verlet_numba.scene import shapes
from verlet_numba.scene.clearance import clearance
from verlet_numba.scene.load import loads
from verlet_numba.scene.overlap import overlap_depth
from verlet_numba.scene.place import place
from verlet_numba.scene.problems import SceneError

HEAD = "version: 1\ntime: {duration: 1}\n"


def placed(text, folder=None):
    loaded = loads(HEAD + text, "scene.yaml")
    return place(loaded.scene, folder or loaded.folder, loaded.source)


def one(entry, rest=""):
    return placed(f"bodies:\n  - {entry}\n{rest}")[0]


def test_box_turns_about_its_centre_and_moves():
    body = one("{kind: box, mass: 8, size: [1, 2, 3], position: [1, 0, 0], rotation: {axis: [0, 0, 2], degrees: 90}, "
               "velocity: [0, 0, 1], angular_velocity: [0, 0, 2]}")
    corner = 4 + 2 + 1
    np.testing.assert_allclose(body.positions[0, corner], [1 - 1, 0.5, 1.5], atol=1e-15)
    np.testing.assert_allclose(body.velocities[0, corner], [-2 * 0.5, 2 * -1, 1], atol=1e-15)
    assert (body.copies, body.friction, body.restitution, body.path) == (1, (0, 0), 0, None)


def test_mesh_turns_about_the_origin_of_its_file_and_spins_about_its_centre(tmp_path):
    trimesh.creation.box((2, 2, 2)).apply_translation((5, 0, 0)).export(tmp_path / "far.obj")
    body = placed("bodies: [{kind: mesh, file: far.obj, mass: 1, position: [0, 0, 1], "
                  "rotation: {axis: [0, 0, 1], degrees: 90}, angular_velocity: [0, 1, 0]}]", tmp_path)[0]
    np.testing.assert_allclose(body.positions[0].mean(axis=0), [0, 5, 1], atol=1e-12)
    np.testing.assert_allclose(body.velocities[0].mean(axis=0), 0, atol=1e-12)


def test_rope_stays_in_world_coordinates_and_turns_about_its_centre_of_mass():
    body = one("{kind: rope, mass: 1, start: [1, 0, 0], end: [3, 0, 0], segments: 2, position: [0, 0, 5], "
               "rotation: {axis: [0, 0, 1], degrees: 90}}")
    np.testing.assert_allclose(body.positions[0], [[2, -1, 5], [2, 0, 5], [2, 1, 5]], atol=1e-15)


def test_rope_hangs_along_the_gravity_of_the_scene():
    text = "bodies: [{kind: rope, mass: 1, start: [0, 0, 0], end: [1, 0, 0], length: 2, segments: 10}]\n"
    assert placed(text)[0].positions[0, 5, 2] < -0.5
    assert placed(text + "effects: {}")[0].positions[0, 5, 2] < -0.5
    assert placed(text + "effects: {gravity: [0, 3, 0]}")[0].positions[0, 5, 1] > 0.5


def test_particles_spin_about_the_centre_of_mass_on_top_of_their_own_velocities():
    body = one("{kind: particles, positions: [[0, 0, 0], [4, 0, 0]], masses: [3, 1], "
               "velocities: [[1, 0, 0], [0, 0, 0]], velocity: [0, 0, 7], angular_velocity: [0, 0, 1]}")
    np.testing.assert_allclose(body.velocities[0], [[1, -1, 7], [0, 3, 7]])


@pytest.mark.parametrize(("entry", "held"), [
    ("{kind: cloth, mass: 1, size: [1, 1], resolution: [3, 4], pinned: corners}", [0, 3, 8, 11]),
    ("{kind: cloth, mass: 1, size: [1, 1], resolution: [3, 4], pinned: border}", [0, 1, 2, 3, 4, 7, 8, 9, 10, 11]),
    ("{kind: cloth, mass: 1, size: [1, 1], resolution: [2, 2], pinned: border}", [0, 1, 2, 3]),
    ("{kind: rope, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 5, pinned: ends}", [0, 5]),
    ("{kind: rope, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 5, pinned: [2]}", [2]),
    ("{kind: box, mass: 1, size: [1, 1, 1], fixed: true}", list(range(8))),
    ("{kind: icosahedron, mass: 1, radius: 1, pinned: []}", []),
])
def test_pins(entry, held):
    body = one(entry.replace("}", ", velocity: [1, 2, 3]}"))
    assert np.flatnonzero(body.pinned).tolist() == held
    np.testing.assert_array_equal(body.velocities[0, held], np.zeros((len(held), 3)))
    assert (body.velocities[0, ~body.pinned] == [1, 2, 3]).all()


def test_materials_are_those_of_the_body_else_of_the_effects():
    text = ("effects: {friction: {static: 0.5, dynamic: 0.4}, restitution: 0.3}\nbodies:\n"
            "  - {kind: box, mass: 1, size: [1, 1, 1]}\n"
            "  - {kind: box, mass: 1, size: [1, 1, 1], friction: {static: 0.2, dynamic: 0.1}, restitution: 0}\n")
    first, second = placed(text)
    assert (first.friction, first.restitution) == ((0.5, 0.4), 0.3)
    assert (second.friction, second.restitution) == ((0.2, 0.1), 0.0)


def test_path_is_an_array():
    body = one("{kind: box, mass: 1, size: [1, 1, 1], fixed: true, path: [[0, 0, 0, 0], [1, 0, 0, 2]]}")
    np.testing.assert_array_equal(body.path, [[0, 0, 0, 0], [1, 0, 0, 2]])


SCATTERED = """seed: {seed}
colliders:
  - {{kind: room, size: [4, 4, 4], position: [0, 0, 2]}}
  - {{kind: sphere, radius: 1, position: [0, 0, 2]}}
bodies:
  - {{kind: icosahedron, name: dice, radius: 0.2, mass: 1, count: 60,
     scatter: {{inside: [[-3, -3, 0], [3, 3, 4]], speed: [1, 2]}}}}
  - {{kind: box, name: crates, size: [0.2, 0.3, 0.2], mass: 1, count: 20,
     scatter: {{inside: [[-2, -2, 0], [2, 2, 4]]}}}}
  - {{kind: box, name: slab, size: [3.9, 3.9, 0.1], mass: 1, position: [0, 0, 0.1], fixed: true}}
  - {{kind: cloth, name: sheet, size: [3, 3], resolution: [12, 12], mass: 1, position: [0, 0, 3.5]}}
"""


def test_scattered_copies_are_clear_of_everything():
    loaded = loads(HEAD + SCATTERED.format(seed=3), "scene.yaml")
    bodies = place(loaded.scene, loaded.folder, loaded.source)
    dice, crates, slab, sheet = bodies
    assert (dice.copies, crates.copies) == (60, 20)
    for body in (dice, crates):
        for collider in loaded.scene.colliders:
            assert clearance(collider, body.positions.reshape(-1, 3)).min() >= 0
    singles = [type(body)(body.name, body.shape, body.positions[k:k + 1], body.velocities[k:k + 1], body.pinned,
                          body.friction, body.restitution) for body in (dice, crates) for k in range(body.copies)]
    for number, single in enumerate(singles):
        assert overlap_depth(single, slab) == 0
        assert overlap_depth(single, sheet) == 0
        assert all(overlap_depth(single, other) == 0 for other in singles[:number])


def test_scattered_copies_keep_their_shape_turn_and_move():
    dice = placed(SCATTERED.format(seed=3))[0]
    for positions in dice.positions:
        np.testing.assert_allclose(shapes.stick_lengths(positions, dice.shape.sticks), dice.shape.lengths, rtol=1e-12)
        edges = positions[dice.shape.sticks[[0, 10, 20], 1]] - positions[dice.shape.sticks[[0, 10, 20], 0]]
        rest = dice.shape.positions
        assert not np.allclose(edges, rest[dice.shape.sticks[[0, 10, 20], 1]] - rest[dice.shape.sticks[[0, 10, 20], 0]])
    speeds = np.linalg.norm(dice.velocities, axis=2)
    assert ((speeds >= 1) & (speeds <= 2)).all()
    np.testing.assert_allclose(np.ptp(dice.velocities, axis=1), 0)


def test_the_seed_alone_decides():
    first, again, other = (placed(SCATTERED.format(seed=seed))[0] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.positions, again.positions)
    np.testing.assert_array_equal(first.velocities, again.velocities)
    assert not np.array_equal(first.positions, other.positions)


def test_scatter_that_does_not_fit_is_an_error_with_its_place():
    with pytest.raises(SceneError) as error:
        one("{kind: box, mass: 1, size: [1, 1, 1], count: 50,\n"
            "     scatter: {inside: [[0, 0, 0], [4, 4, 4]]}}")
    problem, = error.value.problems
    assert (problem.line, problem.path) == (5, "bodies.0.scatter")
    assert "only 8 of 50 fit" in problem.message


def test_faults_of_meshes_are_told_together_with_their_places(tmp_path):
    trimesh.creation.box().export(tmp_path / "box.obj")
    with pytest.raises(SceneError) as error:
        placed("bodies:\n  - {kind: mesh, name: a, mass: 1, file: gone.obj}\n"
               "  - {kind: mesh, name: b, mass: 1, file: box.obj, pinned: [0, 8]}\n"
               "colliders: [{kind: mesh, file: gone.stl}]\nattachments: [[b, 0, b, 9]]\n", tmp_path)
    assert [(problem.line, problem.path) for problem in error.value.problems] == [
        (4, "bodies.0.file"), (5, "bodies.1.pinned.1"), (7, "attachments.0.3"), (6, "colliders.0.file")]


def test_scattered_bodies_stay_out_of_mesh_colliders(tmp_path):
    trimesh.creation.box((2, 4, 4)).export(tmp_path / "wall.stl")
    body = placed("colliders: [{kind: mesh, file: wall.stl, scale: 0.5, position: [0.5, 0, 0]}]\n"
                  "bodies: [{kind: icosahedron, radius: 0.2, mass: 1, count: 12, "
                  "scatter: {inside: [[0, -1, -1], [2, 1, 1]]}}]", tmp_path)[0]
    assert body.positions[..., 0].min() >= 1


def test_scene_without_bodies():
    assert placed("") == []
