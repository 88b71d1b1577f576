"""Random placement: inside, apart, repeatable, and honest about what does not fit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.scene.scatter import NoRoomError, random_rotations, random_velocities, scatter


def everywhere(points):
    return np.ones(len(points), np.bool_)


def least_distance(points):
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    return apart[~np.eye(len(points), dtype=bool)].min(initial=np.inf)


@given(seed=st.integers(0, 1000), count=st.integers(1, 150), scale=st.sampled_from([1e-6, 1, 1e6]))
@settings(deadline=None, max_examples=30)
def test_spheres_stay_inside_and_apart(seed, count, scale):
    inside = np.array([[-1, 2, 0], [1, 5, 4]]) * scale
    points = scatter(count, 0.15 * scale, inside, everywhere, np.random.default_rng(seed))
    assert points.shape == (count, 3)
    assert (points >= inside[0] + 0.15 * scale * (1 - 1e-12)).all()
    assert (points <= inside[1] - 0.15 * scale * (1 - 1e-12)).all()
    assert least_distance(points) >= 0.3 * scale * (1 - 1e-12)
    np.testing.assert_array_equal(
        points, scatter(count, 0.15 * scale, inside, everywhere, np.random.default_rng(seed)))


def test_full_box_falls_back_to_a_lattice():
    """512 spheres of diameter 1 in a box of side 8.1: 0.5 of its volume, out of reach for random placement."""
    points = scatter(512, 0.5, [[0, 0, 0], [8.1, 8.1, 8.1]], everywhere, np.random.default_rng(0))
    assert len(points) == 512
    assert least_distance(points) >= 1 - 1e-12
    assert points.min() >= 0.5
    assert points.max() <= 7.6


def test_exact_fit():
    points = scatter(3, 0.05, [[0, 0, 0], [0.3, 0.1, 0.1]], everywhere, np.random.default_rng(0))
    np.testing.assert_allclose(np.sort(points[:, 0]), [0.05, 0.15, 0.25], atol=1e-9)


def test_says_how_many_fit():
    with pytest.raises(NoRoomError) as error:
        scatter(28, 0.5, [[0, 0, 0], [3, 3, 3]], everywhere, np.random.default_rng(0))
    assert error.value.fitted == 27
    with pytest.raises(NoRoomError) as error:
        scatter(1, 0.5, [[0, 0, 0], [3, 3, 0.9]], everywhere, np.random.default_rng(0))
    assert error.value.fitted == 0


def test_keeps_off_what_is_not_free():
    points = scatter(200, 0.1, [[0, 0, 0], [4, 4, 4]], lambda p: p[:, 0] > 2, np.random.default_rng(3))
    assert points[:, 0].min() > 2


def test_points_need_no_room():
    assert len(scatter(50, 0.0, [[0, 0, 0], [1, 1, 1]], everywhere, np.random.default_rng(0))) == 50


def test_places_are_uniform():
    points = scatter(4000, 0.001, [[0, 0, 0], [1, 1, 1]], everywhere, np.random.default_rng(5))
    octants = np.bincount((points > 0.5) @ [1, 2, 4], minlength=8)
    assert np.sum((octants - 500)**2 / 500) < 24.3          # chi squared, 7 degrees of freedom, 0.1 %


def test_rotations_are_proper_and_uniform():
    turns = random_rotations(20_000, np.random.default_rng(1))
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turns.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(turns), 1, atol=1e-14)
    # Of uniform rotations each entry has mean 0 and mean square 1/3, and the trace mean 0.
    np.testing.assert_allclose(turns.mean(axis=0), 0, atol=0.02)
    np.testing.assert_allclose((turns**2).mean(axis=0), 1 / 3, atol=0.01)


def test_speeds_are_uniform_in_their_interval():
    velocities = random_velocities(20_000, (1, 3), np.random.default_rng(2))
    speeds = np.linalg.norm(velocities, axis=1)
    assert 1 <= speeds.min() < 1.01
    assert 2.99 < speeds.max() <= 3
    np.testing.assert_allclose(speeds.mean(), 2, atol=0.02)
    np.testing.assert_allclose(velocities.mean(axis=0), 0, atol=0.04)
