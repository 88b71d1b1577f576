"""What holds for every scene: conservation, invariance, and that numbering, absent effects and chunks change nothing."""

from dataclasses import replace

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.world import MOMENTUM
from verlet_numba.kernels.relax import relax_runs, relax_sticks
from verlet_numba.kernels.relax_angles import relax_angles
from verlet_numba.run.engine import start
from verlet_numba.scene.build import build

SEEDS = st.integers(0, 10_000)
few = settings(deadline=None, max_examples=12)
FRAMES = 6

CLOTH = {"kind": "cloth", "name": "sheet", "size": [0.6, 0.4], "resolution": [4, 5], "mass": 0.3, "position": [3, 0, 0]}
DICE = {"kind": "icosahedron", "name": "dice", "radius": 0.2, "mass": 1, "count": 6, "angular_velocity": [1, 2, 6],
        "scatter": {"inside": [[-9, -9, -9], [-5, -5, -5]], "speed": [0, 3]}}
CRATE = {"kind": "box", "name": "crate", "size": [0.2, 0.3, 0.4], "mass": 2, "position": [6, 0, 0], "angular_velocity": [5, 1, 0]}
FLIGHT = worlds.with_changes(worlds.FREE, bodies=[*worlds.FREE["bodies"], CLOTH, DICE, CRATE])
CALM = worlds.with_changes(FLIGHT, effects={"gravity": [0, 0, 0]})


def shaken(scene, seed):
    """The scene, and its bodies with random velocities of every particle on top of their own."""
    validated, bodies = worlds.placed(scene)
    rng = np.random.default_rng(seed)
    return validated, [replace(body, velocities=body.velocities + rng.normal(size=body.velocities.shape)) for body in bodies]


def trajectory(scene, bodies):
    return worlds.advanced(start(build(scene, bodies)), FRAMES)


@given(seed=SEEDS)
@few
def test_relaxation_keeps_the_momentum(seed):
    model = start(build(*shaken(CALM, seed)))
    measures = worlds.advanced(model, FRAMES)[2]
    momentum = measures[:, MOMENTUM:MOMENTUM + 3]
    scale = np.sum(model.world.observed.mass) * measures[:, -1].max()
    np.testing.assert_allclose(momentum - momentum[0], 0, atol=1e-12 * scale)
    assert np.abs(momentum[0]).max() > 1e-3 * scale


@given(seed=SEEDS)
@few
def test_a_correction_has_no_torque(seed):
    """Sum of m x × dx over one constraint, or independent ones, taken at the positions that it acts on."""
    model = start(build(*shaken(CALM, seed)))
    world, rng = model.world, np.random.default_rng(seed)
    x, w = world.particles.position, world.particles.inverse_mass
    x += rng.normal(size=x.shape) * 0.1 * (w > 0)
    mass = np.divide(1, w, out=np.zeros_like(w), where=w > 0)

    def relaxed(relax, *arguments):
        before = x.copy()
        relax(x, *arguments)
        torque = (mass * np.cross(before.T, (x - before).T).T).sum(1)
        force = (mass * (x - before)).sum(1)
        scale = (mass * np.linalg.norm(before, axis=0) * np.linalg.norm(x - before, axis=0)).sum()
        assert scale > 0
        np.testing.assert_allclose(np.r_[torque, force], 0, atol=1e-13 * scale + 1e-15)

    for r in range(0, len(world.runs.lanes), 7):
        first, lanes, data = world.runs.first[:, r:r + 1].copy(), world.runs.lanes[r:r + 1], world.runs.data[r:r + 1]
        one = world.runs._replace(first=first, lanes=lanes, data=data)
        relaxed(relax_runs, one, None, None, None)
    for c in range(0, len(world.sticks.rest), 5):
        one = type(world.sticks)(*(np.ascontiguousarray(array[..., c:c + 1]) for array in world.sticks))
        relaxed(relax_sticks, one, None, None, None)
    relaxed(relax_angles, w, world.angles, None)


@given(seed=SEEDS, shift=st.tuples(*[st.floats(-20, 20)] * 3))
@few
def test_a_scene_may_stand_anywhere(seed, shift):
    scene, bodies = shaken(FLIGHT, seed)
    here = trajectory(scene, bodies)[0]
    there = trajectory(scene, [replace(body, positions=body.positions + shift) for body in bodies])[0]
    np.testing.assert_allclose(there - shift, here, atol=1e-10)


@given(seed=SEEDS)
@few
def test_a_scene_may_be_turned_with_its_gravity(seed):
    scene, bodies = shaken(FLIGHT, seed)
    turn = Rotation.random(rng=seed).as_matrix()
    here = trajectory(scene, bodies)[0]
    effects = scene.effects.model_copy(update={"gravity": tuple(turn @ scene.effects.gravity)})
    turned = [replace(body, positions=body.positions @ turn.T, velocities=body.velocities @ turn.T) for body in bodies]
    there = trajectory(scene.model_copy(update={"effects": effects}), turned)[0]
    np.testing.assert_allclose(there, here @ turn.T, atol=1e-10)
    assert np.abs(here[-1] - here[0]).max() > 0.05


@given(seed=SEEDS)
@few
def test_the_order_of_the_bodies_does_not_matter(seed):
    """Nor does the numbering that follows from it: every body has the same bits."""
    scene, bodies = shaken(FLIGHT, seed)
    order = np.random.default_rng(seed).permutation(len(bodies))

    def by_body(bodies):
        positions, ends = trajectory(scene, bodies)[0], np.cumsum([body.positions[..., 0].size for body in bodies])
        return np.split(positions, ends[:-1], axis=1)

    here, there = by_body(bodies), by_body([bodies[b] for b in order])
    for place, b in enumerate(order):
        np.testing.assert_array_equal(there[place], here[b])


@given(sizes=st.lists(st.integers(1, 6), min_size=1, max_size=5))
@few
def test_chunks_of_any_size_give_the_same_bits(sizes):
    whole = worlds.advanced(worlds.started(worlds.EVERYTHING), sum(sizes))
    split = worlds.advanced(worlds.started(worlds.EVERYTHING), *sizes)
    for one, other in zip(whole, split, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.fixture(scope="module")
def without():
    """Bodies that meet colliders under gravity and may rest, which changes how they meet, and nothing else: scene, positions."""
    bodies, colliders = ([{**entry, "friction": 0, "restitution": 0} for entry in bare(worlds.EVERYTHING[key])]
                         for key in ("bodies", "colliders"))
    absent = dict.fromkeys(("drag", "damping", "wind", "friction", "restitution"))
    scene = worlds.with_changes(worlds.EVERYTHING, effects=absent, bodies=bodies, colliders=colliders, output={"fields": []})
    return scene, worlds.advanced(worlds.started(scene), 10)[0]


def bare(entries):
    return [{key: value for key, value in entry.items() if key not in ("path", "pinned", "spin")} for entry in entries
            if entry["kind"] != "mesh"]


def test_effects_set_to_nothing_change_nothing(without):
    """A far body that has friction, bounces, is carried and meets what moves calls for the effects, and nobody feels it.

    Nor a far mesh. Not a bit changes but of rigid bodies, which friction of 0 moves by a twist of 0.
    """
    scene, expected = without
    far = {"kind": "rope", "name": "far", "start": [0, 0, 99], "end": [1, 0, 99], "segments": 2, "mass": 1, "friction": 1,
           "restitution": 1, "pinned": [0], "path": [[0, 0, 0, 0], [1, 0, 1, 0]]}
    moving = {"kind": "sphere", "radius": 1, "position": [99, 0, 0], "spin": {"axis": [0, 0, 1], "rate": 1},
              "friction": 1, "restitution": 0}
    mesh = worlds.EVERYTHING["colliders"][-1] | {"friction": 0, "restitution": 0}
    nothing = {"drag": {"linear": 1e-30, "quadratic": 0}, "damping": 1e-30, "wind": {"velocity": [9, 9, 9], "density": 1e-30}}
    crowded = worlds.with_changes(scene, effects=nothing, bodies=[*scene["bodies"], far],
                                  colliders=[*scene["colliders"], moving, mesh], output={"fields": ["velocity"]})
    model = worlds.started(crowded)
    absent = [name for name, effect in model.world.effects._asdict().items() if effect is None]
    assert absent == ["features", "exact", "rapid", "bending"]
    found = worlds.advanced(model, 10)[0][:, :-3]
    rigid = np.concatenate([np.full(body.positions[..., 0].size, body.shape.rigid) for body in model.bodies[:-1]])
    np.testing.assert_array_equal(found[:, ~rigid], expected[:, ~rigid])
    np.testing.assert_allclose(found[:, rigid], expected[:, rigid], atol=1e-13)


def test_materials_of_nothing_are_absent(without):
    effects = worlds.built(without[0]).world.effects
    assert (effects.friction, effects.restitution) == (None, None)


def test_resistance_of_nothing_is_absent():
    """Its loops would cost as much as if it were something."""
    nothing = {"drag": {"linear": 0, "quadratic": 0}, "damping": 0, "wind": {"velocity": [9, 9, 9], "density": 0}}
    effects = worlds.built(worlds.with_changes(FLIGHT, effects=nothing)).world.effects
    assert (effects.drag, effects.damping, effects.wind) == (None, None, None)


def test_gravity_of_nothing_is_no_gravity():
    scenes = (worlds.with_changes(FLIGHT, effects={"gravity": gravity, "contact": "none"})
              for gravity in ([0, 0, 0], None))
    zero, none = (worlds.advanced(worlds.started(scene), FRAMES)[0] for scene in scenes)
    np.testing.assert_array_equal(zero, none)
    assert np.abs(zero[-1] - zero[0]).max() > 0.05
