"""Rotations and frames of solids."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from verlet_numba.physics.pose import inward, outward, turn


def test_turn_is_the_rotation_by_angular_velocity_times_time():
    rng = np.random.default_rng(0)
    for _ in range(50):
        v, spin, time = rng.normal(size=3), rng.normal(size=3), rng.uniform(-5, 5)
        np.testing.assert_allclose(turn(*v, *spin, time), Rotation.from_rotvec(spin * time).apply(v), atol=1e-13)


def test_no_spin_turns_nothing():
    assert turn(1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 5.0) == (1, 2, 3)
    assert turn(1.0, 0.0, 0.0, 0.0, 0.0, np.pi, 0.5) == pytest.approx((0, 1, 0))


def test_inward_and_outward_are_the_frame_of_the_pose():
    rng = np.random.default_rng(1)
    for rotation in Rotation.random(5, rng=1).as_matrix():
        origin, p = rng.normal(size=(2, 3))
        pose = (*origin, *rotation.ravel())
        local = inward(*p, pose)
        np.testing.assert_allclose(local, rotation.T @ (p - origin), atol=1e-14)
        np.testing.assert_allclose(np.array(outward(*local, pose)) + origin, p, atol=1e-14)
