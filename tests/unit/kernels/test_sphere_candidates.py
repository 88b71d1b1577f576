"""Candidates that outlive substeps: none that touches is missed."""

import numpy as np
import pytest
from sphere_tree_cases import case, expected, listed, sheet

from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.sphere_candidates import find_spheres, outdated, travelled
from verlet_numba.scene import shapes
from verlet_numba.scene.sphere_trees import spheres_of


def twin_outdated(position, at, soft, margin):
    moved = (position - at)[:, soft > 0].T.astype(float)
    return 2 * np.linalg.norm(moved - moved.mean(axis=0), axis=1).max() > margin


def test_lists_outlive_common_motion_and_no_other():
    rng = np.random.default_rng(0)
    for _ in range(300):
        soft = (rng.uniform(size=40) < 0.7).astype(float)
        soft[0] = 1
        at = rng.normal(size=(3, 40))
        position = at + (rng.normal(size=(3, 1)) + rng.normal(size=(3, 40)) * 0.01) * soft + (1 - soft) * rng.normal()
        margin = 10.0 ** rng.uniform(-2, -1)
        assert bool(outdated(position, at, soft, margin)) is bool(twin_outdated(position, at, soft, margin))
        assert travelled(position, at) == pytest.approx(np.linalg.norm(position - at, axis=0).max())


def test_no_contact_is_missed_while_a_list_lives():
    """Two cloths and a rope drift, waver and fall: every substep, all that touch are among the candidates."""
    rng = np.random.default_rng(3)
    cloth, rope = sheet(8, 8, 0.05), shapes.rope([0, 0, 0], [1, 0, 0.1], 15, mass=1, thickness=0.05)
    this = case([(cloth, cloth.positions + np.array([[[0, 0, 0]], [[0.1, 0.05, 0.06]]])), (rope, rope.positions[None])])
    spheres = spheres_of(this.layered, 0.03, 20_000)
    renewals = 0
    speed = np.zeros_like(this.position)
    for step in range(300):
        speed += rng.normal(size=speed.shape) * 2e-4 * (spheres.soft > 0)
        this.position[:] += speed + np.array([[0.1], [0], [-0.01 * step]])
        before = spheres.at.copy()
        assert find_spheres(this.position, this.inverse_mass, this.layered, True, this.stack, spheres)
        renewals += (spheres.at != before).any()
        assert expected(this, 0.0) <= set(listed(spheres.candidates))
    assert 3 < renewals < 150


def test_a_list_that_had_no_room_is_made_again():
    shape = shapes.particles(np.random.default_rng(1).uniform(size=(60, 3)), [1], radius=0.05)
    this = case([(shape, shape.positions[None])])
    small = spheres_of(this.layered, 0.1, 4)
    assert not find_spheres(this.position, this.inverse_mass, this.layered, True, this.stack, small)
    assert small.candidates.listed[0] == NO_ROOM
    large = spheres_of(this.layered, 0.1, 4000)._replace(at=small.at)
    large.candidates.listed[0] = small.candidates.listed[0]
    assert find_spheres(this.position, this.inverse_mass, this.layered, True, this.stack, large)
    assert set(listed(large.candidates)) == expected(this, 0.1)
