"""Relaxation of angles against the naive twin."""

import numpy as np
import pytest
from reference_constraints import relax_angle

from verlet_numba.buffers.constraints import Angles
from verlet_numba.kernels.relax_angles import relax_angles


@pytest.mark.parametrize(("real", "tolerance"), [(np.float64, 1e-11), (np.float32, 1e-4)])
def test_angles_are_the_twins(real, tolerance):
    rng = np.random.default_rng(2)
    x = rng.normal(size=(3, 12)).astype(real)
    w = np.where(rng.random(12) < 0.2, 0, rng.uniform(0.2, 2, 12)).astype(real)
    corners = np.array([rng.choice(12, 3, replace=False) for _ in range(9)])
    rest = rng.uniform(0.3, 2.8, 9)
    twin = x.T.astype(float)
    for _ in range(2):
        assert relax_angles(x, w, Angles(np.ascontiguousarray(corners.T), rest), None) == 9
        for c in range(9):
            relax_angle(twin, w.astype(float), corners[c], rest[c])
    np.testing.assert_allclose(x.T, twin, atol=tolerance)


def test_no_angles_are_nothing():
    assert relax_angles(np.ones((3, 1)), np.ones(1), None, None) == 0


def test_an_angle_within_the_tolerance_is_left_alone():
    x = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])       # a right angle at particle 1
    angles = Angles(np.array([[0], [1], [2]]), np.array([np.pi / 2 * 1.02]))
    before = x.copy()
    assert relax_angles(x, np.ones(3), angles, 0.05) == 0
    np.testing.assert_array_equal(x, before)
    assert relax_angles(x, np.ones(3), angles, 0.01) == 1
    assert relax_angles(x, np.zeros(3), angles, 0.01) == 0
