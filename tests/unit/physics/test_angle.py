"""The angle constraint: it meets its angle, and is moved by no momentum of its own."""

import numpy as np
import pytest

from verlet_numba.physics.angle import any_normal, bend, unit


def angle_of(x):
    u, v = x[0] - x[1], x[2] - x[1]
    return np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v)


def moved(x, rest, w):
    """Displacements (3, 3) of the three particles x (3, 3)."""
    return np.array(bend(*(x[0] - x[1]), *(x[2] - x[1]), rest, 0.0, *w)).reshape(3, 3)


def triples(count=200):
    rng = np.random.default_rng(1)
    for _ in range(count):
        yield rng.normal(size=(3, 3)), rng.uniform(0.1, 3, 3), rng


def test_angle_is_met_to_first_order():
    for x, w, _ in triples():
        angle = angle_of(x)
        if 0.3 < angle < 2.8:
            for change in (1e-4, -1e-4):
                assert angle_of(x + moved(x, angle + change, w)) - angle == pytest.approx(change, rel=0.02)


def test_passes_converge_to_the_angle():
    for x, w, rng in triples(50):
        rest = rng.uniform(0.2, 2.9)
        for _ in range(60):
            x = x + moved(x, rest, w)
        assert angle_of(x) == pytest.approx(rest, abs=1e-9)


def test_momentum_and_angular_momentum_are_kept():
    for x, w, rng in triples():
        change = moved(x, rng.uniform(0, np.pi), w) / w[:, None]
        scale = np.abs(change).max() * (1 + np.abs(x).max())
        np.testing.assert_allclose(change.sum(0), 0, atol=1e-13 * scale)
        np.testing.assert_allclose(np.cross(x, change).sum(0), 0, atol=1e-12 * scale)


def test_correction_is_shared_by_inverse_mass():
    """Of all that meet the angle, the displacement that is least in the metric of the masses: M dx is along the gradient."""
    for x, w, _ in triples(20):
        rest, step = angle_of(x) + 0.1, 1e-6
        gradient = np.zeros(9)
        for c in range(9):
            shift = np.zeros(9)
            shift[c] = step
            gradient[c] = (angle_of(x + shift.reshape(3, 3)) - angle_of(x - shift.reshape(3, 3))) / (2 * step)
        change = (moved(x, rest, w) / w[:, None]).ravel()
        np.testing.assert_allclose(change * (gradient @ gradient), gradient * (change @ gradient),
                                   atol=1e-6 * np.linalg.norm(change) * (gradient @ gradient))


def test_immovable_ends_stay():
    x = np.array([[1.0, 0, 0], [0, 0, 0], [0.2, 1, 0]])
    np.testing.assert_array_equal(moved(x, 1.0, (1, 0, 0))[1:], 0)
    np.testing.assert_array_equal(moved(x, 1.0, (0, 0, 1))[:2], 0)
    np.testing.assert_array_equal(moved(x, 1.0, (0, 0, 0)), 0)


@pytest.mark.parametrize("end", [0, 2])
def test_arm_without_length_is_left_alone(end):
    x = np.array([[1.0, 0, 0], [0, 0, 0], [0, 1, 0]])
    x[end] = 0
    np.testing.assert_array_equal(moved(x, 1.0, (1, 1, 1)), 0)


@pytest.mark.parametrize("direction", np.vstack([np.eye(3), [[1, 1, 0], [1, 1, 1], [-1, 2, 3]]]))
@pytest.mark.parametrize("side", [1, -1], ids=["folded", "straight"])
def test_straight_and_folded_arms_find_a_plane_to_bend_in(direction, side):
    x = np.array([direction, np.zeros(3), side * 2 * direction], float)
    w = (1.0, 2.0, 0.5)
    start = angle_of(x)
    rest = start + 0.01 * side
    change = moved(x, rest, w)
    assert np.isfinite(change).all()
    assert angle_of(x + change) == pytest.approx(rest, abs=1e-4)
    np.testing.assert_allclose(moved(x, start, w), 0, atol=1e-15)


def test_unit_and_normal():
    rng = np.random.default_rng(0)
    for v in [*rng.normal(size=(50, 3)), *np.eye(3)]:
        *u, length = unit(*v)
        assert length == pytest.approx(np.linalg.norm(v))
        np.testing.assert_allclose(u, v / length)
        normal = np.array(any_normal(*u))
        assert np.linalg.norm(normal) == pytest.approx(1)
        assert normal @ u == pytest.approx(0, abs=1e-15)
    assert unit(0.0, 0.0, 0.0) == (0, 0, 0, 0)
