"""Bodies put to rest and woken: a stack, a throw, a blow, supports that go away, a heap."""

import numpy as np
import pytest
import worlds

from verlet_numba.buffers.world import PENETRATION, RESTING, SPEED_MAX
from verlet_numba.effects.response import FEW_TOUCHES
from verlet_numba.run.engine import State, run_substep

pytestmark = pytest.mark.validate        # what rests compiles for minutes

FLOOR = {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
CRATE = {"kind": "box", "size": [0.4, 0.4, 0.4], "mass": 1}
STACK = [CRATE | {"name": f"crate{k}", "position": [0, 0, 0.2 + 0.4 * k]} for k in range(3)]
FAR = CRATE | {"name": "far", "position": [9, 0, 200]}
"""It falls all the time, so that not all is at rest."""

NEVER = {"speed": 1e-12, "time": 0.5}


def scene(bodies, rest=None, **changes):
    return {"time": {"duration": 1, "frame_rate": 60}, "effects": {"gravity": [0, 0, -9.81], "friction": 0.5, "rest": rest or {}},
            "bodies": bodies, "colliders": [FLOOR], "output": {"precision": "float64", "fields": ["velocity"]}} | changes


def awaken(model):
    """As if something awake met every body at rest."""
    model.world.effects.rest.quiet[:] = 0


def test_a_stack_rests_and_stays_where_it_is():
    model = worlds.started(scene(STACK))
    position, velocity, measures = worlds.advanced(model, 120)
    first = int(np.argmax(measures[:, RESTING] == 3))
    assert 30 <= first <= 60
    assert (measures[first:, RESTING] == 3).all()
    np.testing.assert_array_equal(position[first:], np.broadcast_to(position[first], position[first:].shape))
    assert np.abs(velocity[first + 1:]).max() == 0
    assert np.abs(position[-1] - position[0]).max() < 1e-3


def test_a_woken_stack_goes_on_as_if_it_had_never_rested():
    """From where it was put to rest, in frames of one substep: awake, a stack creeps by what its solver leaves."""
    single = {"time": {"duration": 1, "frame_rate": 480}, "solver": {"substeps": 1}}
    never, rested = (worlds.started(scene([*STACK, FAR], rest, **single)) for rest in (NEVER, {"time": 0.1}))
    expected = worlds.advanced(never, 200)[0][:, :24]
    position, _, measures = worlds.advanced(rested, 100)
    slept = int(np.argmax(measures[:, RESTING] == 3))
    assert 48 <= slept < 60
    np.testing.assert_array_equal(position[:slept + 1, :24], expected[:slept + 1])
    awaken(rested)
    position, _, measures = worlds.advanced(rested, 40)
    assert (measures[:, RESTING] == 0).all()
    # pairs at rest that wake are looked at once where they rest, and may then know the same contact by another face
    np.testing.assert_allclose(position[1:, :24], expected[slept + 1:slept + 40], rtol=0, atol=1e-13)


def test_nothing_rests_in_mid_air():
    """Two crates thrown up, one on the other: at the top they are slower than asked for, longer than asked for."""
    thrown = [crate | {"velocity": [0, 0, 4]} for crate in STACK[:2]]
    model = worlds.started(scene(thrown, {"speed": 1.0, "time": 0.02}))
    position, velocity, measures = worlds.advanced(model, 120)
    height = position.reshape(120, 2, 8, 3)[:, 0, :, 2].min(1)
    slow = (height > 0.1) & (np.abs(velocity).max((1, 2)) < 1.0)
    assert slow.sum() > 6
    assert (measures[height > 0.1, RESTING] == 0).all()
    assert measures[-1, RESTING] == 2


def test_a_blow_wakes_the_island_and_keeps_momentum():
    """A crate slides into one of two that rest side by side: all three move on together at once."""
    rests = [CRATE | {"name": f"crate{k}", "position": [0.41 * k, 0, 0.2]} for k in range(2)]
    hits = CRATE | {"name": "hits", "position": [-2.4, 0, 0.2], "velocity": [2, 0, 0]}
    model = worlds.started(scene([*rests, hits], effects={"gravity": [0, 0, -9.81], "friction": 0.01, "rest": {"time": 0.1}}))
    _, velocity, measures = worlds.advanced(model, 90)
    speed = velocity.reshape(90, 3, 8, 3)[..., 0].mean(2)
    after = int(np.argmax(speed[:, 1] > 0.3))
    assert measures[after - 6, RESTING] == 2
    assert measures[after, RESTING] == 0
    assert speed[after + 2].sum() == pytest.approx(speed[after - 6].sum(), rel=0.1)


def test_state_of_a_moment_repeats_what_followed():
    """Bit for bit, into rest and out of it, from the saved state."""
    model = worlds.started(scene([*STACK, FAR], {"time": 0.1}))
    worlds.advanced(model, 3)
    saved = State.of(model)
    first = worlds.advanced(model, 12)
    saved.restore(model)
    again = worlds.advanced(model, 12)
    assert first[2][-1, RESTING] == 3
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)
    awaken(model)
    saved = State.of(model)
    first = worlds.advanced(model, 2)
    saved.restore(model)
    for _ in range(model.world.solver.substeps):
        run_substep(model)
    np.testing.assert_array_equal(model.world.snapshot.counts[0] > 0, True)
    saved.restore(model)
    np.testing.assert_array_equal(worlds.advanced(model, 2)[0], first[0])


def test_a_platform_that_leaves_wakes_what_stands_on_it():
    platform = {"kind": "box", "size": [2, 2, 0.2], "position": [0, 0, 1], "path": [[0, 0, 0, 0], [1, 0, 0, 0], [1.5, 0, 0, -4]]}
    above = [crate | {"position": [0, 0, crate["position"][2] + 1.1]} for crate in STACK[:2]]
    model = worlds.started(scene(above, {"time": 0.2}, colliders=[FLOOR, platform]))
    position, _, measures = worlds.advanced(model, 150)
    assert measures[58, RESTING] == 2
    assert measures[64, RESTING] == 0
    lowest = position[..., 2].min(1)
    time = (np.arange(61, 80) - 60) / 60
    fallen = lowest[60] - lowest[61:80]
    np.testing.assert_allclose(fallen, 0.5 * 9.81 * time**2, rtol=0.1, atol=5e-3)
    assert lowest[-1] == pytest.approx(0, abs=5e-3)


def heap(count, rest=None, seed=1):
    """E1: icosahedra thrown into a room that they fill by a tenth, and heap up in."""
    half = (count * 2.5362 * 0.2**3 / 0.1) ** (1 / 3) / 2
    dice = {"kind": "icosahedron", "name": "die", "radius": 0.2, "mass": 1, "count": count,
            "scatter": {"inside": [[-half] * 3, [half] * 3], "speed": [0, 4]}}
    room = {"kind": "room", "size": [2 * half] * 3}
    return worlds.started(scene([dice], rest, colliders=[room], seed=seed))


def test_a_heap_stands_still_by_its_contacts_alone():
    """More touches than are solved to the end in a substep; only what does not move at all is put to rest.

    In one throw of six a die still rolls over.
    """
    drifts, touches = [], []
    for seed in range(1, 7):
        model = heap(50, NEVER, seed)
        worlds.advanced(model, 8 * 60)
        position, _, measures = worlds.advanced(model, 2 * 60)
        touches.append(model.world.effects.touches.until[-1])
        assert measures[:, PENETRATION].max() < 1e-4
        drifts.append(np.linalg.norm(position[-1] - position[0], axis=1).reshape(50, 12).max(axis=1))
    assert (np.quantile(drifts, 0.8, axis=1) < 1e-3).all()
    assert (np.max(drifts, axis=1) < 1e-3).sum() >= 5
    assert np.median(touches) > FEW_TOUCHES


@pytest.mark.parametrize(("count", "seed"), [
    (50, 1), *(pytest.param(200, seed, marks=pytest.mark.validate) for seed in range(1, 5))])
def test_a_heap_comes_to_rest(count, seed):
    """All of it within 15 s, and nothing moves any more, not by a bit."""
    model = heap(count, seed=seed)
    before = worlds.advanced(model, 15 * 60)
    after = worlds.advanced(model, 5 * 60)
    assert (after[2][:, RESTING] == count).all()
    np.testing.assert_array_equal(after[0], np.broadcast_to(before[0][-1], after[0].shape))
    assert after[2][:, PENETRATION].max() < 1e-3


@pytest.mark.validate
def test_what_lies_scattered_on_a_floor_comes_to_rest():
    """Nothing moves any more, not by a bit."""
    dice = {"kind": "icosahedron", "name": "die", "radius": 0.2, "mass": 1, "count": 200,
            "scatter": {"inside": [[-6, -6, 0.02], [6, 6, 0.7]], "speed": [0, 1]}}
    model = worlds.started(scene([dice]))
    before = worlds.advanced(model, 15 * 60)
    after = worlds.advanced(model, 5 * 60)
    assert (after[2][:, RESTING] == 200).all()
    assert after[2][:, SPEED_MAX].max() < 0.01
    assert after[2][:, PENETRATION].max() < 1e-3
    assert np.abs(after[0] - before[0][-1]).max() <= 1e-3
