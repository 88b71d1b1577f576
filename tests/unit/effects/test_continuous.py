"""Impacts of rigid bodies along the step: stopped before what they would pass, momentum kept, passers-by let pass."""

import numpy as np
import pytest
import worlds

from verlet_numba.effects.continuous import arrest
from verlet_numba.kernels.integrate import integrate
from verlet_numba.scene.exact import roomier_exact

CUBE = {"kind": "box", "name": "cube", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [2, 0.01, 0.02], "velocity": [-50, 0, 0]}
WALL = {"kind": "box", "name": "wall", "size": [0.02, 2, 2], "mass": 3, "position": [0, 0, 0]}
DIE = {"kind": "icosahedron", "name": "die", "radius": 0.05, "mass": 1, "position": [2, 0.01, 0.02], "velocity": [-100, 0, 0]}
BALL = {"kind": "sphere", "radius": 0.05, "position": [0, 0, 0]}


def flight(bodies, colliders=(), steps=5):
    """Steps of 1/60 s of free flight with nothing but impacts: positions (T, 3, n), momenta (T, 3), impacts (T,), the model."""
    model = worlds.started({"time": {"duration": 1, "frame_rate": 60}, "solver": {"substeps": 1}, "bodies": bodies,
                            "effects": {"continuous_collision": True}, "colliders": list(colliders)})
    effects, (position, previous, inverse_mass, _) = model.world.effects, model.world.particles
    rapid, moving, found = effects.rapid, inverse_mass > 0, []
    for _ in range(steps):
        integrate(position, previous, None, 1 / 60)
        rapid.gaps.listed[0] = 0
        while not arrest(position, previous, inverse_mass, effects.contact, rapid):
            rapid = roomier_exact(rapid)
        momentum = ((position - previous)[:, moving] / inverse_mass[moving]).sum(axis=1) * 60
        found.append((position.copy(), momentum, int(rapid.gaps.listed[0])))
    return *map(np.array, zip(*found, strict=True)), model


@pytest.mark.parametrize("turn", [0, 30])
@pytest.mark.parametrize("wall", ["body", "collider"])
def test_a_cube_does_not_pass_a_thin_wall(wall, turn):
    cube = {**CUBE, "angular_velocity": [turn, turn / 2, turn / 3]}
    post = {"kind": "box", "size": WALL["size"], "position": [0, 0, 0]}
    position, momentum, impacts, model = (flight([cube, {**WALL, "fixed": True}]) if wall == "body" else flight([cube], [post]))
    mine = position[:, :, model.numbering.bodies[0][0]]
    assert impacts.max() > 0
    assert mine[:, 0].min() > 0
    assert abs(momentum[-1, 0]) < 15        # kg m/s: what is left of 50 closes the rest of the way


def test_momentum_is_kept_where_both_are_free():
    position, momentum, impacts, model = flight([CUBE, WALL])
    assert impacts.max() > 0
    cube, wall = (position[:, :, index[0]] for index in model.numbering.bodies)
    across = wall[:, :, 4:].mean(axis=2) - wall[:, :, :4].mean(axis=2)          # the wall turns
    height = np.einsum("ti,tik->tk", across, cube - wall.mean(axis=2, keepdims=True)) / 0.02
    assert (height > 0.0099).all()
    np.testing.assert_allclose(momentum, np.tile([-50.0, 0, 0], (len(momentum), 1)), atol=1e-9)


def test_what_passes_by_passes():
    _, momentum, impacts, _ = flight([{**DIE, "position": [2, 0.12, 0.02]}], [BALL], steps=3)
    assert (impacts == 0).all()
    np.testing.assert_allclose(momentum[:, 0], -100, rtol=1e-12)


def test_a_die_does_not_pass_a_ball():
    position, _, impacts, _ = flight([DIE], [BALL])
    assert impacts.max() > 0
    assert position.mean(axis=2)[-1, 0] > 0.05


def test_slow_bodies_are_not_followed():
    _, _, impacts, model = flight([{**CUBE, "velocity": [-0.2, 0, 0], "position": [0.2, 0, 0]}, WALL], steps=2)
    assert (impacts == 0).all()
    assert model.world.effects.rapid.among.made[0] == -1
