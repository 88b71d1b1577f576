"""Contacts of pairs: against the whole difference of the hulls, with and without what was learnt before."""

import numba
import numpy as np
import pytest
from hull_pairs import box, difference_depth, hulls_of, meet, meetings_for, pairs_of, rotated, witnesses
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.narrow import collide, gather_hulls
from verlet_numba.kernels.narrow_beside import CHUNKS, collide_beside
from verlet_numba.scene.capacity import beside_of
from verlet_numba.scene.capacity import narrow_of as scratch

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


def test_where_meetings_have_no_room_pairs_learn_nothing(crowd):
    _, hulls, pairs = crowd
    small = meetings_for(PAIRS - 1)
    assert not collide(hulls, pairs, small, scratch(hulls), MARGIN, True)
    assert small.listed[0] == NO_ROOM
    assert not pairs.axis.any()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("count", [0, 5, PAIRS])
def test_threads_find_the_very_contacts_of_one(crowd, threads, count):
    """Fewer pairs than chunks, and more; twice, since what a pair learnt is where the next substep begins."""
    (_, hulls, pairs), pairs_beside = crowd, pairs_of(range(PAIRS), range(PAIRS, 2 * PAIRS))
    before = numba.get_num_threads()
    numba.set_num_threads(threads)
    quiet = np.arange(2 * PAIRS) % 5 == 0
    quiet[PAIRS:] = quiet[:PAIRS]
    pairs.listed[0] = pairs_beside.listed[0] = count
    for _ in range(2):
        alone, beside = meetings_for(PAIRS), meetings_for(PAIRS)
        assert collide(hulls, pairs, alone, scratch(hulls), MARGIN, 1, quiet.astype(np.int64))
        assert collide_beside(hulls, pairs_beside, beside, beside_of(scratch(hulls), CHUNKS), MARGIN, quiet.astype(np.int64))
        found = alone.listed[0]
        assert found >= 0.2 * count
        for one, other in zip(alone, beside, strict=True):
            np.testing.assert_array_equal(one[..., :found] if one.ndim else one, other[..., :found] if other.ndim else other)
        np.testing.assert_array_equal(pairs.axis, pairs_beside.axis)
        np.testing.assert_array_equal(pairs.face, pairs_beside.face)
    numba.set_num_threads(before)


def test_threads_want_room_for_a_meeting_of_every_pair(crowd):
    _, hulls, pairs = crowd
    small = meetings_for(PAIRS - 1)
    assert not collide_beside(hulls, pairs, small, beside_of(scratch(hulls), CHUNKS), MARGIN, np.zeros(2 * PAIRS, np.int64))
    assert small.listed[0] == NO_ROOM


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


def test_a_moving_crowd_agrees_with_one_met_afresh(crowd):
    """Learnt contacts of bodies that move are those found cold, or other faces that were the nearest and still are no deeper
    than the motion since can have made them.
    """
    _, hulls, pairs = crowd
    rng, narrow, same, kept = np.random.default_rng(2), scratch(hulls), 0, 0
    speed = 2e-3
    for _ in range(20):
        for h in range(2 * PAIRS):
            columns = slice(hulls.start[h], hulls.start[h + 1])
            hulls.corner[:, columns] += speed * rng.normal(size=(3, 1))
        gather_hulls(np.zeros((3, 1)), hulls)
        cold, warm = meetings_for(PAIRS), meetings_for(PAIRS)
        before = pairs.face.copy()
        assert collide(hulls, pairs, cold, narrow, MARGIN, None)
        np.testing.assert_array_equal(pairs.face, before)
        assert collide(hulls, pairs, warm, narrow, MARGIN, True)
        hold(hulls, warm)
        n = cold.listed[0]
        np.testing.assert_array_equal(warm.pair, cold.pair)
        apart = cold.gap[:n] > 1e-9
        np.testing.assert_allclose(warm.gap[:n][apart], cold.gap[:n][apart], atol=1e-11)
        assert (warm.gap[:n] <= cold.gap[:n] + 1e-9).all()
        assert (warm.gap[:n] >= cold.gap[:n] - 20 * 8 * speed).all()
        same += np.isclose(warm.gap[:n], cold.gap[:n], rtol=0, atol=1e-9).sum()
        kept += n
    assert same > 0.95 * kept


def test_what_is_beyond_the_margin_is_left_out_and_its_face_kept(crowd):
    _, hulls, pairs = crowd
    narrow, near, far = scratch(hulls), meetings_for(PAIRS), meetings_for(PAIRS)
    collide(hulls, pairs, far, narrow, 1.0, True)
    known = pairs.face.copy()
    collide(hulls, pairs, near, narrow, 0.1, True)
    n = far.listed[0]
    inside = far.gap[:n] <= 0.1
    assert 0 < inside.sum() < n
    np.testing.assert_array_equal(near.pair[:near.listed[0]], far.pair[:n][inside])
    np.testing.assert_array_equal(pairs.face, known)
    np.testing.assert_allclose(near.gap[:near.listed[0]], far.gap[:n][inside], atol=1e-12)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_spheres_and_rounded_hulls(scale):
    point = np.zeros((1, 3))
    normal, gap, p, q, _ = meet(scale * (point + np.array([3.0, 4.0, 0.0])), scale * point, scale * np.array([1.0, 2.0]))
    np.testing.assert_allclose(normal, [0.6, 0.8, 0.0], atol=1e-15)
    assert gap == pytest.approx(2 * scale, rel=1e-14)
    np.testing.assert_allclose((p - q) @ normal, 5 * scale, rtol=1e-14)
    normal, gap, _, _, _ = meet(scale * (point + 0.3), scale * (point + 0.3), scale * np.array([1.0, 2.0]))
    np.testing.assert_array_equal(normal, [0, 0, 1])        # spheres about one centre: a fixed direction
    assert gap == pytest.approx(-3 * scale, rel=1e-14)
    bare = scale * (box(1, 1, 1) + np.array([0.0, 0.0, 1.2])), scale * box(2, 2, 1)
    normal, gap, _, _, carriers = meet(*bare, scale * np.array([0.25, 0.1]))
    np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-12)       # the bare ones are apart
    assert gap == pytest.approx(-0.15 * scale, rel=1e-9)
    assert sum(carriers) <= 4
    assert meet(*bare, scale * np.array([0.05, 0.05]), margin=0.05 * scale) is None
    sunk = scale * (point + np.array([0.1, 0.2, 0.4])), scale * box(2, 2, 1)
    normal, gap, _, _, carriers = meet(*sunk, scale * np.array([0.5, 0.0]))
    np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-12)
    assert gap == pytest.approx(-0.6 * scale, rel=1e-12)            # a sphere whose centre is 0.1 below the surface
    assert carriers[0] == 1


def test_every_contact_is_a_vertex_and_a_face_or_two_edges():
    """Boxes on boxes, aligned and turned on the spot: faces that meet in one plane are brought to one of the two cases (P13)."""
    rng = np.random.default_rng(4)
    for k in range(200):
        first, second = box(*rng.integers(1, 4, 3)), box(*rng.integers(1, 4, 3))
        first = rotated(first, [0, 0, 1], 0.0 if k % 2 else rng.uniform(0, 1))
        height = (np.ptp(first[:, 2]) + np.ptp(second[:, 2])) / 2 + rng.choice([-1e-3, 0.0, 1e-3])
        place = np.array([*rng.uniform(-0.4, 0.4, 2), height])
        normal, gap, p, q, carriers = meet(first + place, second)
        np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-9)
        np.testing.assert_allclose(p - q, gap * normal, atol=1e-12)
        assert sorted(carriers) in ([1, 1], [1, 2], [1, 3], [2, 2])
        for point, hull in ((p, first + place), (q, second)):
            assert (point >= hull.min(axis=0) - 1e-12).all()
            assert (point <= hull.max(axis=0) + 1e-12).all()


@given(st.integers(0, 2 ** 32 - 1), st.floats(-6, 6))
@settings(max_examples=40, deadline=None)
def test_contacts_are_the_same_wherever_one_looks_from(seed, exponent):
    rng = np.random.default_rng(seed)
    scale = 10.0 ** exponent
    first, second = rng.normal(size=(rng.integers(4, 15), 3)), rng.normal(size=(rng.integers(4, 15), 3)) + rng.normal(size=3)
    _, gap, _, _, _ = meet(first, second)
    turn, shift = Rotation.random(random_state=seed % 1000), rng.normal(size=3)
    for unit, *other in [(1, second, first), (1, first + shift, second + shift), (1, turn.apply(first), turn.apply(second)),
                         (scale, scale * first, scale * second)]:
        assert meet(*other)[1] == pytest.approx(unit * gap, rel=1e-9, abs=1e-12 * unit)
