"""Gravity, wind, drag and damping on random particles, against the naive twin; set to nothing they are nothing."""

import numpy as np
import pytest
from reference import wind_force, with_damping, with_drag

from verlet_numba.buffers.constraints import Particles
from verlet_numba.buffers.forces import Damping, Drag, Gravity, Wind
from verlet_numba.effects.damping import damp
from verlet_numba.effects.drag import resist
from verlet_numba.effects.gravity import fall
from verlet_numba.effects.wind import blow
from verlet_numba.scene.forces import decay

H, N = 0.01, 23
EXACT = {np.float64: 1e-10, np.float32: 1e-4}


@pytest.fixture(params=[np.float64, np.float32])
def particles(request):
    rng = np.random.default_rng(3)
    position = rng.normal(size=(3, N)).astype(request.param)
    previous = (position - H * rng.normal(size=(3, N))).astype(request.param)
    inverse_mass, acceleration = rng.uniform(0.1, 2, N).astype(request.param), rng.normal(size=(3, N)).astype(request.param)
    return Particles(position, previous, inverse_mass, acceleration)


def rows(particles):
    """Acceleration, position and displacement (N, 3) in double precision."""
    x, before, a = (array.T.astype(float) for array in (particles.position, particles.previous, particles.acceleration))
    return a, x, x - before


def state(particles):
    return particles.position, particles.previous, particles.acceleration


def agree(particles, expected):
    np.testing.assert_allclose(particles.acceleration.T, expected, rtol=1e-6,
                               atol=EXACT[particles.position.dtype.type] * np.abs(expected).max())


def test_gravity_starts_the_sum(particles):
    g = np.random.default_rng(0).normal(size=(3, N)).astype(particles.position.dtype)
    fall(particles.acceleration, Gravity(g))
    np.testing.assert_array_equal(particles.acceleration, g)
    fall(particles.acceleration, None)
    np.testing.assert_array_equal(particles.acceleration, 0)
    fall(None, None)


@pytest.mark.parametrize("air", [True, False], ids=["wind", "still"])
def test_drag(particles, air):
    a, _, d = rows(particles)
    real, rng = particles.position.dtype, np.random.default_rng(1)
    linear, quadratic, wind = (rng.uniform(0, 2, shape).astype(real) for shape in (N, N, (3, N)))
    resist(*state(particles), H, Drag(linear, quadratic, wind if air else None))
    agree(particles, np.array([with_drag(a[p], d[p], wind[:, p] if air else np.zeros(3), linear[p], quadratic[p], H)
                               for p in range(N)]))


def test_damping(particles):
    a, _, d = rows(particles)
    rate = np.where(np.arange(N) % 5, np.linspace(0, 40, N), 0).astype(particles.position.dtype)
    damp(*state(particles), H, Damping(*decay(rate.astype(float), H)))
    agree(particles, np.array([with_damping(a[p], d[p], float(rate[p]), H) for p in range(N)]))


def test_wind_in_runs_of_triangles(particles):
    """Runs of 1, 6 and 4 triangles; the last corner of the last run's first lane is masked."""
    a, x, d = rows(particles)
    real, rng, density = particles.position.dtype, np.random.default_rng(2), 1.3
    first, lanes = np.array([[0, 7, 22], [0, 6, 12], [4, 10, 16]]).T.copy(), np.array([1, 6, 4])
    triangles = np.concatenate([first[:, [r]] + np.arange(lanes[r]) for r in range(3)], axis=1)
    share = density / 6 * particles.inverse_mass[triangles].astype(float)
    share[:, 7] = 0
    velocity = rng.normal(size=(3, 11))
    blow(*state(particles), H, Wind(first, lanes, np.cumsum(lanes) - lanes, velocity.astype(real), share.astype(real)))
    for c, triangle in enumerate(triangles.T):
        if c != 7:
            force = wind_force(x[triangle], d[triangle] / H, velocity[:, c], density, particles.inverse_mass[triangle], H)
            a[triangle] += particles.inverse_mass[triangle, None] * force / 3
    agree(particles, a)


def test_effects_of_nothing_change_no_bit(particles):
    real, before = particles.position.dtype, particles.acceleration.copy()
    nothing = np.zeros(N, real)
    damp(*state(particles), H, Damping(np.ones(N), np.zeros(N)))
    resist(*state(particles), H, Drag(nothing, nothing, np.ones((3, N), real)))
    resist(*state(particles), H, Drag(nothing, nothing, None))
    first, lanes, data = np.array([[0], [5], [10]]), np.array([5]), np.array([0])
    blow(*state(particles), H, Wind(first, lanes, data, np.ones((3, 5), real), np.zeros((3, 5), real)))
    np.testing.assert_array_equal(particles.acceleration, before)
    damp(*state(particles), H, None)
    resist(*state(particles), H, None)
    blow(*state(particles), H, None)
    np.testing.assert_array_equal(particles.acceleration, before)
