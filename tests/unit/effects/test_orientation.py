"""Bodies turned inside out come back; nothing else is touched."""

import numpy as np
import pytest
import worlds

from verlet_numba.effects.orientation import keep_orientation, normal_of
from verlet_numba.run.engine import start

BODIES = [
    {"kind": "box", "name": "crates", "size": [0.3, 0.2, 0.4], "mass": 2, "count": 3,
     "scatter": {"inside": [[-2, -2, 1], [2, 2, 3]]}},
    {"kind": "icosahedron", "name": "die", "radius": 0.2, "mass": 1, "position": [5, 0, 0]},
    {"kind": "box", "name": "hung", "size": [0.3, 0.2, 0.4], "mass": 2, "position": [9, 0, 0], "pinned": [0]},
    {"kind": "rope", "name": "line", "start": [0, 5, 0], "end": [1, 5, 0], "segments": 4, "mass": 1}]
GUARDED = worlds.with_changes(worlds.FREE, bodies=BODIES, solver={"orientation_guard": True}, effects={"contact": "none"})


@pytest.fixture
def model():
    return start(worlds.built(GUARDED))


def particles_of(model, body, copy=0):
    return model.numbering.bodies[body][copy]


def volume(points):
    """Sum over all four corners of the triple products: its sign is the body's handedness. points (3, 8)."""
    return float(np.linalg.det((points[:, [4, 2, 1]] - points[:, [0]]).T))


def test_bodies_without_pins_that_have_a_volume_are_watched(model):
    first = {int(k) for k in model.world.effects.orientation.first}
    watched = {int(particles_of(model, 0, copy)[0]) for copy in range(3)} | {int(particles_of(model, 1)[0])}
    assert first == watched
    assert worlds.built(worlds.with_changes(GUARDED, solver={"orientation_guard": False})).world.effects.orientation is None
    assert worlds.built(worlds.with_changes(GUARDED, bodies=BODIES[2:])).world.effects.orientation is None


def test_what_is_the_right_way_round_is_not_touched(model):
    particles = model.world.particles
    before = particles.position.copy(), particles.previous.copy()
    keep_orientation(particles.position, particles.previous, model.world.effects.orientation)
    np.testing.assert_array_equal((particles.position, particles.previous), before)


@pytest.mark.parametrize("depth", [1e-6, 0.03, 0.2])
def test_a_body_that_passed_through_itself_bounces_off_its_plane(model, depth):
    """Its twin: the reflection in the plane across the last of the principal axes (numpy's eigenvectors)."""
    particles, rng = model.world.particles, np.random.default_rng(3)
    k = particles_of(model, 0, 1)
    x, v = particles.position[:, k], rng.normal(size=(3, 8)) * 0.01
    sign = np.sign(volume(x))
    axis = x[:, 4] - x[:, 0] if depth == 0.2 else x[:, 2] - x[:, 0]
    axis = axis / np.linalg.norm(axis)
    centre = x.mean(axis=1, keepdims=True)
    squashed = x - (1 + depth) * axis[:, None] * (axis @ (x - centre))
    particles.position[:, k], particles.previous[:, k] = squashed, squashed - v
    assert np.sign(volume(squashed)) == -sign
    keep_orientation(particles.position, particles.previous, model.world.effects.orientation)
    found = particles.position[:, k]
    _, _, axes = np.linalg.svd((squashed - centre).T)
    normal = axes[2][:, None]
    np.testing.assert_allclose(found, squashed - 2 * normal * (normal.T @ (squashed - centre)), atol=1e-12)
    assert np.sign(volume(found)) == sign
    speed = found - particles.previous[:, k]
    np.testing.assert_allclose(speed.sum(axis=1), v.sum(axis=1), atol=1e-12)                 # momentum
    assert np.sum(speed**2) == pytest.approx(np.sum(v**2), rel=1e-9)                          # kinetic energy
    others = np.setdiff1d(np.arange(particles.position.shape[1]), k)
    np.testing.assert_array_equal(particles.position[:, others], start(worlds.built(GUARDED)).world.particles.position[:, others])


def test_the_thinnest_direction_is_that_of_the_least_moment():
    rng = np.random.default_rng(0)
    for _ in range(200):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        points = turn @ (rng.normal(size=(3, 12)) * np.array([1, rng.uniform(0.3, 1), 10.0**rng.uniform(-9, -1.5)])[:, None])
        normal = np.array(normal_of(*points, 0, 12, 1, 12))
        centred = points - points.mean(axis=1, keepdims=True)
        least = np.linalg.svd(centred.T)[2][2]
        assert abs(normal @ least) == pytest.approx(1, abs=1e-6)
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)


def test_without_a_guard_nothing_is_done(model):
    keep_orientation(model.world.particles.position, model.world.particles.previous, None)
