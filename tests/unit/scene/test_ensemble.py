"""Scenes as instances of one world: each as it is alone, bit for bit, whatever the others are."""

from dataclasses import replace

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.buffers.world import COLUMNS, INSTANCES
from verlet_numba.run.engine import run_chunk, start
from verlet_numba.scene.build import frames
from verlet_numba.scene.ensemble import in_runs, likeness, most_beside, together

FRAMES = 8
SOFT = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"substeps": 3, "iterations": 2, "precision": "float32"},
    "effects": {"gravity": [0.5, 0, -9.81], "drag": {"linear": 0.3, "quadratic": 0.2}, "damping": 0.4,
                "wind": {"velocity": [2, 1, 0.5], "density": 1.2}, "friction": {"static": 0.5, "dynamic": 0.3}, "restitution": 0.1},
    "bodies": [
        {"kind": "cloth", "name": "sheet", "size": [0.6, 0.5], "resolution": [4, 3], "mass": 0.2, "compliance": 1e-4,
         "thickness": 0, "position": [0, 0, 0.35], "rotation": {"axis": [1, 2, 0], "degrees": 10}, "velocity": [0.3, 0, -2]},
        {"kind": "rope", "name": "line", "start": [-0.9, -0.9, 1.2], "end": [0.3, -0.9, 1.2], "segments": 5, "mass": 0.5,
         "thickness": 0, "compliance": 1e-4, "pinned": [0], "path": [[0.02, 0, 0, 0], [0.1, 0.1, 0, 0.05], [0.5, 0.1, 0.4, 0]]},
        {"kind": "rope", "name": "strings", "start": [0, 0, 0], "end": [0, 0.3, 0.1], "segments": 3, "mass": 0.5, "count": 3,
         "thickness": 0, "scatter": {"inside": [[-2, -2, 0.1], [2, 2, 1]], "speed": [0, 3]}},
        {"kind": "particles", "name": "arm", "velocity": [0, 1, -4], "compliance": 1e-3, "pinned": [1],
         "positions": [[0.3, -0.9, 1.2], [0.6, -0.9, 1.2], [0.6, -0.6, 0.1], [0.4, -0.5, 0.2]], "masses": [1, 2, 0.5, 1],
         "sticks": [[0, 1], [1, 2], [2, 3, 0.3]]}],
    "attachments": [["line", 5, "arm", 0]],
    "colliders": [{"kind": "plane"}, {"kind": "sphere", "radius": 0.3, "spin": {"axis": [0, 1, 1], "rate": 4},
                                      "path": [[0, 0, 0, 0], [0.1, 0, 0, 0.1], [0.3, 0.1, 0, 0]]}],
    "output": {"fields": ["velocity"], "precision": "float64"}}
"""Cloth, ropes and sticks with every effect that several instances may have; they meet colliders in a few frames."""

VALUE = st.floats(0.1, 2)
CHANGES = st.fixed_dictionaries({}, optional={
    "bodies.0.mass": VALUE, "bodies.0.size.0": st.floats(0.3, 1), "bodies.0.friction": VALUE,
    "bodies.0.compliance": st.floats(1e-6, 1e-2),
    "bodies.1.mass": VALUE, "bodies.1.end.0": st.floats(0.31, 1), "bodies.1.restitution": st.floats(0, 1),
    "bodies.2.scatter.speed": st.tuples(st.just(0), st.floats(0, 5)).map(list), "bodies.3.velocity.0": st.floats(-5, 5),
    "bodies.3.masses.2": VALUE,
    "effects.gravity.0": st.floats(-5, 5), "effects.gravity.2": st.floats(-20, 5), "effects.drag.linear": VALUE,
    "effects.drag.quadratic": VALUE, "effects.damping": VALUE, "effects.wind.velocity.1": st.floats(-9, 9),
    "effects.wind.density": VALUE,
    "effects.friction": VALUE, "effects.restitution": st.floats(0.01, 1),
    "seed": st.integers(0, 99)})


def changed(scene, changes):
    """A scene with some values set; keys are paths."""
    for path, value in changes.items():
        scene = set_in(scene, [int(key) if key.isdigit() else key for key in path.split(".")], value)
    return scene


def set_in(part, keys, value):
    if not keys:
        return value
    copy = dict(part) if isinstance(part, dict) else list(part)
    copy[keys[0]] = set_in(copy[keys[0]], keys[1:], value) if keys[1:] else value
    return copy


def side_by_side(scenes, count=FRAMES, torn=()):
    """Frames of each scene as an instance: position, velocity, measures, sound. torn: those whose cloth is far too fast."""
    models = [worlds.built(scene) for scene in scenes]
    for i in torn:
        sheet = models[i].bodies[0]
        models[i].bodies[0] = replace(sheet, velocities=np.full_like(sheet.velocities, 1e30))
    assert len({likeness(model) for model in models} - {None}) == 1
    model, n = start(together(models)), models[0].particles
    chunk = frames(model, count)
    run_chunk(model, chunk)
    return [(chunk.position[:, i * n:(i + 1) * n], chunk.velocity[:, i * n:(i + 1) * n],
             chunk.measures[:, i * COLUMNS:(i + 1) * COLUMNS], chunk.sound[:, i]) for i in range(len(models))]


def alone(scene, count=FRAMES):
    model = worlds.started(scene)
    chunk = frames(model, count)
    run_chunk(model, chunk)
    return chunk.position, chunk.velocity, chunk.measures, chunk.sound[:, 0]


def assert_same_bits(found, expected):
    for one, other in zip(found, expected, strict=True):
        assert np.ascontiguousarray(one).tobytes() == np.ascontiguousarray(other).tobytes()


@given(st.lists(CHANGES, min_size=2, max_size=9))
@settings(max_examples=15, deadline=None)
def test_an_instance_has_the_bits_of_its_scene_alone(changes):
    scenes = [changed(SOFT, each) for each in changes]
    for found, scene in zip(side_by_side(scenes), scenes, strict=True):
        assert_same_bits(found, alone(scene))


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("count", [2, 8, 17, INSTANCES])
def test_so_many_ropes_and_arms_that_fall(count, precision):
    """Numbers of whole vectors and others; gravity alone. Single sticks alone are runs beside others."""
    rope, arm = worlds.FREE["bodies"]
    scenes = [{**worlds.FREE, "solver": {"substeps": 4, "precision": precision}, "effects": {"gravity": [0, 0.1 * k, -9.81]},
               "output": {"fields": ["velocity"]}, "bodies": [
                   {**rope, "end": [1 + 0.01 * k, 0, 3], "pinned": [0], "thickness": 0},
                   {**arm, "angles": [], "masses": [1, 2, 0.5 + 0.1 * k, 1], "sticks": [[0, 1], [1, 2], [2, 3], [3, 0, 0.5]],
                    "pinned": [0, 3]}]} for k in range(count)]
    found = side_by_side(scenes)
    for k in {0, 1, count // 2, count - 1}:
        assert_same_bits(found[k], alone(scenes[k]))
    assert len({measures[-1].tobytes() for _, _, measures, _ in found}) == count


def test_contacts_and_penetrations_are_counted_for_each():
    """Of two scenes one touches nothing."""
    high = changed(SOFT, {"bodies.0.position.2": 40, "bodies.2.scatter.inside": [[-2, -2, 30], [2, 2, 31]],
                          "bodies.3.position": [0, 0, 30], "bodies.1.start.2": 31, "bodies.1.end.2": 31})
    low, far = side_by_side([SOFT, high])
    assert low[2][:, 15].max() == 3
    assert not far[2][:, [14, 15]].any()


def test_an_instance_that_diverges_leaves_the_others_alone():
    scenes = [SOFT, SOFT, changed(SOFT, {"bodies.0.mass": 1.0})]
    found = side_by_side(scenes, torn=[1])
    assert_same_bits(found[0], alone(SOFT))
    assert_same_bits(found[2], alone(scenes[2]))
    assert found[0][3].all()
    assert not found[1][3].all()


@pytest.mark.parametrize("change", [
    {"solver.substeps": 4}, {"bodies.0.pinned": [0]}, {"bodies.0.resolution": [3, 3]}, {"colliders.1.radius": 0.31},
    {"effects.restitution": 0.0}, {"time.duration": 2}, {"output.precision": "float32"}, {"attachments": []},
    {"bodies.1.path.1.0": 0.11}])
def test_scenes_that_differ_in_more_than_values_are_not_alike(change):
    assert likeness(worlds.built(SOFT)) != likeness(worlds.built(changed(SOFT, change))) is not None


def test_what_meets_or_counts_by_itself_is_not_put_side_by_side():
    for scene in (worlds.EVERYTHING, worlds.CHAINS, worlds.FREE, changed(SOFT, {"solver.tolerance": 0.01}),
                  changed(SOFT, {"bodies.0.thickness": 0.01}), changed(SOFT, {"solver.gradient": "step_start"})):
        assert likeness(worlds.built(scene)) is None


def test_single_sticks_follow_the_runs():
    """All that move something, in their order."""
    world = worlds.built(SOFT).world
    runs = in_runs(world).runs
    count = len(world.runs.lanes)
    assert (runs.lanes[count:] == 1).all()
    np.testing.assert_array_equal(runs.first[:, count:], world.sticks.ends)
    np.testing.assert_array_equal(runs.rest[runs.data[count:]], world.sticks.rest)


def test_blocks_have_at_least_one_instance_and_not_too_many():
    model = worlds.built(SOFT)
    assert most_beside(model, 1) == 1
    assert most_beside(model, 1 << 40) == INSTANCES
