"""Contacts of pairs: against the whole difference of the hulls, with and without what was learnt before."""

import numpy as np
import pytest
from hull_pairs import difference_depth, hulls_of, meetings_for, pairs_of, witnesses

from verlet_numba.kernels.narrow import collide, gather_hulls, scratch

PAIRS, MARGIN = 150, 0.5


@pytest.fixture
def crowd():
    rng = np.random.default_rng(0)
    points = [rng.normal(size=(rng.integers(4, 30), 3)) + rng.normal(size=3) for _ in range(2 * PAIRS)]
    return points, hulls_of(points), pairs_of(range(PAIRS), range(PAIRS, 2 * PAIRS))


def hold(hulls, meetings):
    """Every meeting's gap is that of its points, which lie within their hulls."""
    first, second = witnesses(hulls, meetings)
    n = meetings.listed[0]
    np.testing.assert_allclose(np.linalg.norm(meetings.normal[:, :n], axis=0), 1, atol=1e-12)
    np.testing.assert_allclose(first - second, meetings.normal[:, :n] * meetings.gap[:n], atol=1e-9)
    assert meetings.weight[:, :n].min(initial=0.0) >= 0
    np.testing.assert_allclose(meetings.weight[:, :n].reshape(2, 3, n).sum(axis=1), 1, atol=1e-14)


def test_depths_are_those_of_the_whole_difference(crowd):
    points, hulls, pairs = crowd
    meetings = meetings_for(PAIRS)
    assert collide(hulls, pairs, meetings, scratch(hulls), MARGIN, None)
    hold(hulls, meetings)
    n = meetings.listed[0]
    gaps = dict(zip(meetings.pair[:n].tolist(), meetings.gap[:n], strict=True))
    depths = [difference_depth(points[i], points[PAIRS + i]) for i in range(PAIRS)]
    assert sum(depth >= 0 for depth in depths) > 50
    for i, depth in enumerate(depths):
        if depth >= 0:
            assert gaps[i] == pytest.approx(-depth, abs=1e-9)
        else:
            assert gaps.get(i, 1.0) > 0


def test_what_is_learnt_changes_no_contact(crowd):
    _, hulls, pairs = crowd
    cold = meetings_for(PAIRS)
    collide(hulls, pairs, cold, scratch(hulls), MARGIN, None)
    for _ in range(3):
        warm = meetings_for(PAIRS)
        assert collide(hulls, pairs, warm, scratch(hulls), MARGIN, True)
        assert warm.listed[0] == cold.listed[0]
        np.testing.assert_array_equal(warm.pair, cold.pair)
        np.testing.assert_allclose(warm.gap, cold.gap, atol=1e-12)
        np.testing.assert_allclose(warm.normal, cold.normal, atol=1e-9)
        hold(hulls, warm)


def test_full_meetings_say_so_and_the_call_may_be_repeated(crowd):
    _, hulls, pairs = crowd
    small, large, narrow = meetings_for(7), meetings_for(PAIRS), scratch(hulls)
    assert not collide(hulls, pairs, small, narrow, MARGIN, True)
    assert small.listed[0] == 7
    assert collide(hulls, pairs, large, narrow, MARGIN, True)
    np.testing.assert_array_equal(large.pair[:7], small.pair)
    np.testing.assert_allclose(large.gap[:7], small.gap, atol=1e-12)


@pytest.mark.parametrize("real", [np.float32, np.float64])
def test_corners_follow_the_particles(real):
    rng = np.random.default_rng(1)
    hulls = hulls_of([rng.normal(size=(6, 3)), rng.normal(size=(4, 3))], [0.1, 0.0])
    before = hulls.corner.copy()
    hulls.particle[:8] = [4, 2, 0, 1, 3, 5, 4, 4]
    position = rng.normal(size=(3, 6)).astype(real)
    gather_hulls(position, hulls)
    np.testing.assert_array_equal(hulls.corner[:, :8], position[:, hulls.particle[:8]].astype(float))
    np.testing.assert_array_equal(hulls.corner[:, 8:], before[:, 8:])
    np.testing.assert_allclose(hulls.centre[:, 0], position.mean(axis=1), atol=1e-6)
    farthest = np.linalg.norm(hulls.corner[:, :8] - hulls.centre[:, :1], axis=0).max()
    assert hulls.reach[0] == pytest.approx(farthest + 0.1, rel=1e-14)
