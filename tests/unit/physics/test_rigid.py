"""How a set of particles answers to an impulse as a whole."""

import numpy as np
import pytest

from verlet_numba.physics.rigid import about_axis, across, cross, inverse_symmetric, response, times_symmetric


def entries(matrix):
    """xx, yy, zz, xy, xz, yz."""
    return matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def unit(vector):
    return vector / np.linalg.norm(vector)


def inertias(count=30):
    rng = np.random.default_rng(0)
    for _ in range(count):
        r, m = rng.normal(size=(5, 3)), rng.uniform(0.1, 2, 5)
        r -= m @ r / m.sum()
        yield m.sum(), sum(mass * (a @ a * np.eye(3) - np.outer(a, a)) for mass, a in zip(m, r, strict=True)), rng


def test_inverse_and_product_of_symmetric_matrices():
    for _, inertia, rng in inertias():
        np.testing.assert_allclose(inverse_symmetric(*entries(inertia)), entries(np.linalg.inv(inertia)), rtol=1e-9, atol=1e-12)
        v = rng.normal(size=3)
        np.testing.assert_allclose(times_symmetric(*entries(inertia), *v), inertia @ v, rtol=1e-12)


def test_particles_on_a_line_or_in_a_point_answer_as_if_they_could_not_turn():
    assert inverse_symmetric(*entries(np.diag([0.0, 2.0, 2.0]))) == (0,) * 6
    assert inverse_symmetric(*[0.0] * 6) == (0,) * 6


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_inverse_knows_no_scale(size):
    """Inertias go with the square of the size; that of a disc 1:1000 is no line's."""
    for _, inertia, _ in inertias(5):
        found = inverse_symmetric(*entries(inertia * size**2))
        np.testing.assert_allclose(found, entries(np.linalg.inv(inertia)) / size**2, rtol=1e-9)
    disc = np.diag([1.0 + 1e-6, 1.0 + 1e-6, 2.0]) * size**2
    np.testing.assert_allclose(inverse_symmetric(*entries(disc)), entries(np.linalg.inv(disc)), rtol=1e-12)


def test_response_is_the_displacement_along_one_direction_of_a_unit_impulse_along_another():
    for mass, inertia, rng in inertias():
        r, u, v = rng.normal(size=(3, 3))
        u, v, inverse = unit(u), unit(v), np.linalg.inv(inertia)
        answers = (1 / mass, *entries(inverse))
        moved = v / mass + np.cross(inverse @ np.cross(r, v), r)
        assert response(tuple(r), tuple(u), tuple(v), answers) == pytest.approx(moved @ u, rel=1e-9, abs=1e-12)
        assert response(tuple(r), tuple(v), tuple(u), answers) == pytest.approx(moved @ u, rel=1e-9, abs=1e-12)    # reciprocity
        assert response(tuple(r), tuple(u), tuple(u), answers) >= 1 / mass


def test_a_body_on_an_axis_turns_about_it_alone():
    for _, inertia, rng in inertias():
        a, torque = unit(rng.normal(size=3)), rng.normal(size=3)
        found = times_symmetric(*about_axis(*entries(inertia), *a), *torque)
        np.testing.assert_allclose(found, a * (a @ torque) / (a @ inertia @ a), rtol=1e-10)
        assert about_axis(*entries(inertia), 0.0, 0.0, 0.0) == (0,) * 6


def test_directions_across_are_an_upright_frame():
    rng = np.random.default_rng(2)
    directions = [*rng.normal(size=(200, 3)), *np.eye(3), *-np.eye(3), [1e-9, -1e-9, -1.0]]
    for n in map(unit, directions):
        u, v = across(*n)
        np.testing.assert_allclose(np.array([u, v, n]) @ np.array([u, v, n]).T, np.eye(3), atol=1e-15 * 4)
        np.testing.assert_allclose(np.cross(u, v), n, atol=1e-15 * 4)


def test_cross():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 3))
    np.testing.assert_allclose(cross(*a, *b), np.cross(a, b), rtol=1e-14)
