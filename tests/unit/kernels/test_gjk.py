"""GJK: distances and nearest points, where it begins, where it gives up early, and that it always ends."""

import numpy as np
import pytest
from hull_pairs import box, distance
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from verlet_numba.kernels.gjk import APART, MET, NEAR


def certify(first, second, found, slack=1e-12):
    """The optimality of a distance: v lies in the difference, and no corner of it is nearer along v."""
    status, n, v, labels, weights = found
    size = max(np.abs(first).max(), np.abs(second).max())
    assert weights[:n].min() >= 0
    assert weights[:n].sum() == pytest.approx(1, abs=1e-12)
    point = weights[:n] @ (first[labels[0]] - second[labels[1]])
    if status == MET:
        assert np.linalg.norm(point) <= slack * size
    else:
        assert status == NEAR
        np.testing.assert_allclose(point, v, atol=slack * size)
        length = np.linalg.norm(v)
        assert (first @ v).min() - (second @ v).max() >= length * (length * (1 - 1e-9) - slack * size)
    return np.linalg.norm(v) if status == NEAR else 0.0


def test_boxes_are_as_far_apart_as_their_faces():
    status, _, v, _, _ = distance(box(1, 1, 1) + np.array([0.1, 0.2, 3.0]), box(2, 2, 2))
    assert status == NEAR
    np.testing.assert_allclose(v, [0, 0, 1.5], atol=1e-15)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_distances_are_optimal_whatever_the_axis(scale):
    rng = np.random.default_rng(0)
    ends = []
    for _ in range(200):
        first, second = (scale * rng.normal(size=(rng.integers(1, 40), 3)) for _ in range(2))
        second = second + scale * 3 * rng.normal(size=3)
        cold = distance(first, second)
        warm = distance(first, second, axis=cold[2] + 1e-3 * scale * rng.normal(size=3) if cold[0] == NEAR else rng.normal(size=3))
        lengths = [certify(first, second, found) for found in (cold, warm, distance(first, second, axis=[0, 0, 0]))]
        np.testing.assert_allclose(lengths, lengths[0], rtol=1e-9, atol=1e-13 * scale)
        ends.append(cold[0])
    assert set(ends) == {NEAR, MET}


def test_an_axis_that_separates_by_more_than_the_bound_is_the_end():
    first, second = box(1, 1, 1) + np.array([3.0, 0.0, 0.0]), box(1, 1, 1)
    status, n, v, _, _ = distance(first, second, axis=[0.5, 0.2, 0.0], bound=1.4)
    assert (status, n) == (APART, 0)
    np.testing.assert_array_equal(v, [0.5, 0.2, 0.0])
    assert distance(first, second, axis=[0.0, 1.0, 0.0], bound=1.9)[0] == APART
    assert distance(first, second, axis=[0.5, 0.2, 0.0], bound=2.1)[0] == NEAR


@pytest.mark.parametrize("rank", [0, 1, 2])
@pytest.mark.parametrize("other", [0, 1, 2, 3])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_collinear_coplanar_and_repeated_corners(rank, other, scale):
    """B13: hulls without volume, with small whole coordinates, so that almost every simplex is degenerate."""
    rng = np.random.default_rng(10 * rank + other)
    for k in range(100):
        first, second = (rng.integers(-3, 4, (rng.integers(1, 9), 3)).astype(float) for _ in range(2))
        first[:, rank:], second[:, other:] = 0.0, 0.0
        if k % 2:
            turn = Rotation.random(random_state=k)
            first, second = turn.apply(first), turn.apply(second)
        first = scale * (first + rng.integers(-2, 3, 3))
        certify(first, scale * second, distance(first, scale * second))


poses = st.tuples(st.integers(0, 2 ** 32 - 1), st.floats(-6, 6))


@given(poses)
@settings(max_examples=50, deadline=None)
def test_distance_is_the_same_wherever_one_looks_from(pose):
    seed, exponent = pose
    rng = np.random.default_rng(seed)
    scale = 10.0 ** exponent
    first = scale * rng.normal(size=(rng.integers(4, 20), 3))
    second = scale * (rng.normal(size=(rng.integers(4, 20), 3)) + 3 * rng.normal(size=3))
    length = certify(first, second, distance(first, second))
    turn, shift = Rotation.random(random_state=seed % 1000), scale * rng.normal(size=3)
    for other in [(second, first), (first + shift, second + shift), (turn.apply(first), turn.apply(second))]:
        assert certify(*other, distance(*other)) == pytest.approx(length, rel=1e-9, abs=1e-12 * scale)


def test_climbing_finds_what_scanning_finds():
    rng = np.random.default_rng(3)
    for _ in range(20):
        first, second = rng.normal(size=(200, 3)), rng.normal(size=(150, 3)) + 4 * rng.normal(size=3)
        scanned, climbed = distance(first, second), distance(first, second, graphs=[0, 1])
        assert scanned[0] == climbed[0]
        np.testing.assert_allclose(scanned[2], climbed[2], atol=1e-12)
