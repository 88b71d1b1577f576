"""Paths of pinned particles and colliders, and colliders that spin."""

import numpy as np
import pytest
import worlds
from reference_contact import on_path
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.forces import Carried
from verlet_numba.effects.motion import along, carry, move
from verlet_numba.scene.colliders import paths

KNOTS = [np.array([[0.5, 1, 2, 3]]), np.array([[0, 0, 0, 0], [1, 1, 2, 3], [1.5, 1, 0, -1], [4, 2, 2, 2.0]])]
TIMES = [-1, 0, 0.25, 0.5, 1, 1.2, 1.5, 3.999, 4, 9]


@pytest.mark.parametrize("m", range(len(KNOTS)))
@pytest.mark.parametrize("time", TIMES)
def test_paths_are_straight_between_knots_and_rest_before_and_after(m, time):
    assert along(paths(KNOTS), m, float(time)) == pytest.approx(on_path(KNOTS[m], time), abs=1e-14)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_pinned_particles_are_carried_by_the_displacement_since_the_first_knot(real):
    start = np.random.default_rng(0).normal(size=(3, 2))
    carried = Carried(np.array([4, 1]), np.array([0, 1]), start, np.zeros((3, 2)), paths(KNOTS))
    position = np.zeros((3, 6), real)
    carry(position, 1.25, carried)
    expected = np.zeros((3, 6))
    expected[:, [4, 1]] = start + np.stack([on_path(knots, 1.25) - knots[0, 1:] for knots in KNOTS], axis=1)
    np.testing.assert_allclose(position, expected, rtol=2 * np.finfo(real).eps)
    carry(position, 2.0, None)
    np.testing.assert_allclose(position, expected, rtol=2 * np.finfo(real).eps)


def test_colliders_go_along_their_path_and_spin():
    moving = [{"kind": "sphere", "radius": 1, "path": [[0, 5, 0, 0], [2, 5, 4, 0]]},
              {"kind": "box", "size": [1, 1, 1], "position": [1, 1, 1], "path": [[1, 0, 0, 0], [2, 0, 0, 3]],
               "spin": {"axis": [0, 3, 4], "rate": 2}},
              {"kind": "plane"},
              {"kind": "cylinder", "radius": 1, "length": 2, "axis": [1, 0, 1], "spin": {"axis": [0, 0, 2], "rate": -1}}]
    dust = {"kind": "particles", "positions": [[9, 9, 9]], "masses": [1]}
    effects = worlds.started({"time": {"duration": 1}, "bodies": [dust], "colliders": moving}).world.effects
    placed, first = effects.contact.solids, effects.contact.solids.rotation.copy()
    move(effects.contact, 0.7, effects.moving)
    move(effects.contact, 1.6, effects.moving)
    for origin, rotation, time in ((placed.origin, placed.rotation, 1.6), (placed.origin_before, placed.rotation_before, 0.7)):
        np.testing.assert_allclose(origin.T, [[5, 2 * time, 0], [1, 1, 1 + 3 * max(0, time - 1)], [0, 0, 0], [0, 0, 0]], atol=1e-14)
        turn = Rotation.from_rotvec(2 * time * np.array([0, 0.6, 0.8])).as_matrix()
        np.testing.assert_allclose(rotation[:, :, 1], turn, atol=1e-14)
        np.testing.assert_allclose(rotation[:, :, 3], Rotation.from_rotvec([0, 0, -time]).as_matrix() @ first[:, :, 3], atol=1e-14)
        np.testing.assert_array_equal(rotation[:, :, [0, 2]], first[:, :, [0, 2]])
    np.testing.assert_allclose(first[:, 2, 3], np.array([1, 0, 1]) / np.sqrt(2))
