"""The models of a scene: defaults, presets, bounds, checks between keys."""

from typing import Any

import pytest
from pydantic import BaseModel

from verlet_numba.scene import schema_bodies, schema_colliders
from verlet_numba.scene.load import loads
from verlet_numba.scene.problems import SceneError
from verlet_numba.scene.schema import DEFAULT, PAPER, Scene, Solver

HEAD = "version: 1\ntime: {duration: 1}\n"


def scene(text: str) -> Scene:
    return loads(HEAD + text, "s.yaml").scene


def body(text: str) -> Any:
    return scene(f"bodies:\n  - {{{text}}}").bodies[0]


def refused(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(HEAD + text, "s.yaml")
    return [f"{problem.path}: {problem.message}" for problem in caught.value.problems]


def refused_body(text: str) -> list[str]:
    return refused(f"bodies:\n  - {{{text}}}")


def test_left_out_effects_have_gravity_and_empty_ones_none() -> None:
    assert scene("").effects.gravity == (0, 0, -9.81)
    assert scene("effects: {}").effects.gravity is None
    assert scene("effects: {drag: {linear: 1}}").effects.gravity is None
    assert scene("effects: {}").effects.contact == "auto"
    assert scene("effects: {contact: none}").effects.contact == "none"


def test_effects_are_absent_unless_named() -> None:
    effects = scene("effects: {}").effects
    assert [effects.drag, effects.damping, effects.wind, effects.friction, effects.restitution, effects.bending,
            effects.rest] == [None] * 7


def test_presets_fill_what_is_left_out() -> None:
    assert scene("").solver.model_dump() == {"preset": "default", **DEFAULT}
    assert scene("solver: {preset: paper}").solver.model_dump() == {"preset": "paper", **PAPER}
    assert scene("solver: {preset: paper, iterations: 3}").solver.model_dump() == {
        "preset": "paper", **PAPER, "iterations": 3}
    assert set(PAPER) == set(DEFAULT)
    assert Solver.model_validate({"preset": "default", **PAPER})        # every value of the table is a legal one


def test_friction_is_a_pair_or_one_number() -> None:
    assert scene("effects: {friction: 0.5}").effects.friction.model_dump() == {"static": 0.5, "dynamic": 0.5}
    assert refused("effects: {friction: {static: 0.3, dynamic: 0.5}}")[0].startswith("effects.friction.dynamic: ")
    assert refused("effects: {friction: true}")
    assert refused("effects: {friction: -1}")


def test_unnamed_bodies_are_named_by_kind_and_index() -> None:
    named = scene(f"bodies: [{{{BOX}}}, {{kind: icosahedron, radius: 1, mass: 1, name: die}}, {{{BOX}}}]\n"
                  "colliders: [{kind: plane}]")
    assert [entry.name for entry in named.bodies] == ["box_0", "die", "box_2"]
    assert named.colliders[0].name == "plane_0"


@pytest.mark.parametrize(("text", "particles"), [
    ("kind: cloth, size: [1, 1], resolution: [3, 4], mass: 1", 12),
    ("kind: rope, start: [0, 0, 0], end: [1, 0, 0], segments: 5, mass: 1", 6),
    ("kind: box, size: [1, 1, 1], density: 1", 8), ("kind: icosahedron, radius: 1, mass: 1", 12),
    ("kind: mesh, file: a.obj, mass: 1", None), ("kind: particles, positions: [[0, 0, 0]], masses: [1]", 1)])
def test_numbers_of_particles(text: str, particles: int | None) -> None:
    assert body(text).particles == particles


def test_a_rope_is_as_long_as_the_distance_unless_said() -> None:
    rope = "kind: rope, start: [0, 0, 0], end: [3, 4, 0], segments: 5, mass: 1"
    assert body(rope).length == 5
    assert body(rope + ", length: 6").length == 6
    assert refused_body(rope + ", length: 4.99")[0].startswith("bodies.0.length: 4.99 m is shorter")
    point = "kind: rope, start: [0, 0, 0], end: [0, 0, 0], segments: 5, mass: 1"
    assert refused_body(point)[0].startswith("bodies.0.end: ")
    assert body(point + ", length: 1").length == 1


@pytest.mark.parametrize("mass", ["0", "-1", ".inf"])
def test_masses_that_mean_pinned_are_refused_with_that_hint(mass: str) -> None:
    assert "pinned" in refused_body(f"kind: box, size: [1, 1, 1], mass: {mass}")[0]
    assert "pinned" in refused_body(f"kind: particles, positions: [[0, 0, 0]], masses: [{mass}]")[0]


BOX = "kind: box, size: [1, 1, 1], mass: 1"
ROPE = "kind: rope, start: [0, 0, 0], end: [1, 0, 0], segments: 5, mass: 1"
CLOTH = "kind: cloth, size: [1, 1], resolution: [3, 4], mass: 1"
POINTS = "kind: particles, positions: [[0, 0, 0], [1, 0, 0], [2, 0, 0]], masses: [1, 1, 1]"


@pytest.mark.parametrize(("text", "path", "words"), [
    ("kind: box, size: [1, 1, 1]", "bodies.0", "neither mass nor density"),
    (BOX + ", density: 1", "bodies.0.density", "only one"),
    ("kind: box, size: [1, 1], mass: 1", "bodies.0.size", "too short"),
    ("kind: box, size: [1, 1, 1, 1], mass: 1", "bodies.0.size", "at most 3"),
    ("kind: box, size: [1, 0, 1], mass: 1", "bodies.0.size.1", "above 0"),
    ("kind: box, size: 1, mass: 1", "bodies.0.size", "must be a list, not 1"),
    ("kind: box, size: [1, 1, 1], mass: true", "bodies.0.mass", "must be a number, not true"),
    ("kind: box, size: [1, 1, 1], mass: '1'", "bodies.0.mass", "must be a number, not '1'"),
    (BOX + ", fixed: 1", "bodies.0.fixed", "true or false"),
    (BOX + ", pinned: [8]", "bodies.0.pinned.0", "no particle 8"),
    (BOX + ", pinned: [-1]", "bodies.0.pinned.0", "at least 0"),
    (BOX + ", count: 2", "bodies.0.count", "scatter"),
    (BOX + ", count: 2000000", "bodies.0.count", "at most 1000000"),
    (BOX + ", count: 1.5", "bodies.0.count", "whole number"),
    (BOX + ", path: [[0, 0, 0, 0]]", "bodies.0.path", "pinned"),
    (BOX + ", fixed: true, path: [[0, 0, 0, 0], [0, 1, 0, 0]]", "bodies.0.path.1.0", "rise"),
    (BOX + ", name: a.b", "bodies.0.name", "cannot be a name"),
    (BOX + ", name: '12'", "bodies.0.name", "cannot be a name"),
    (BOX + ", rotation: {axis: [0, 0, 0], degrees: 1}", "bodies.0.rotation.axis",
     "direction"),
    (BOX + ", scatter: {inside: [[0, 0, 0], [1, -1, 1]]}", "bodies.0.scatter.inside.1.1", "below"),
    (CLOTH + ", pinned: [12]", "bodies.0.pinned.0", "no particle 12"),
    (CLOTH + ", pinned: ends", "bodies.0.pinned", "corners, border"),
    (CLOTH.replace("[3, 4]", "[1, 4]"), "bodies.0.resolution.0", "at least 2"),
    (CLOTH.replace("[3, 4]", "[10000, 10000]"), "bodies.0", "100,000,000 particles"),
    (ROPE + ", pinned: corners", "bodies.0.pinned", "ends"),
    (ROPE.replace("5", "0"), "bodies.0.segments", "at least 1"),
    (POINTS + ", density: 1", "bodies.0.density", "unknown key"),
    (POINTS + ", velocities: [[0, 0, 0]]", "bodies.0.velocities", "for 3 positions"),
    (POINTS.replace("masses: [1, 1, 1]", "masses: [1, 1]"), "bodies.0.masses", "for 3 positions"),
    (POINTS + ", sticks: [[0, 3]]", "bodies.0.sticks.0.1", "no particle 3"),
    (POINTS + ", sticks: [[0, 1], [2, 2]]", "bodies.0.sticks.1", "same particle"),
    (POINTS + ", sticks: [[0, 1, -1]]", "bodies.0.sticks.0.2", "at least 0"),
    (POINTS + ", sticks: [[0]]", "bodies.0.sticks.0", "[i, j, length]"),
    (POINTS + ", sticks: [5]", "bodies.0.sticks.0", "[i, j, length]"),
    (POINTS + ", angles: [[0, 1, 0]]", "bodies.0.angles.0", "same particle"),
    (POINTS + ", angles: [[0, 1, 2, 190]]", "bodies.0.angles.0.3", "at most 180"),
    ("kind: particles, positions: [], masses: []", "bodies.0.positions", "must not be empty"),
    ("size: [1, 1, 1]", "bodies.0", "needs a `kind`"),
    ("kind: clot", "bodies.0.kind", "did you mean 'cloth'?")])
def test_wrong_bodies(text: str, path: str, words: str) -> None:
    found = refused_body(text)
    assert len(found) == 1
    assert found[0].startswith(f"{path}: ")
    assert words in found[0]


def test_sticks_and_angles_take_a_value_of_their_own() -> None:
    points = body(POINTS + ", sticks: [[0, 1], [1, 2, 0.5]], angles: [[0, 1, 2], [2, 1, 0, 90]]")
    assert points.sticks == ((0, 1), (1, 2, 0.5))
    assert points.angles == ((0, 1, 2), (2, 1, 0, 90))


@pytest.mark.parametrize(("text", "path", "words"), [
    ("seed: -1", "seed", "at least 0"),
    ("name: [a]", "name", "must be text"),
    ("solver: {substeps: 0}", "solver.substeps", "at least 1"),
    ("solver: {substeps: 100001}", "solver.substeps", "at most 100000"),
    ("solver: {tolerance: 1}", "solver.tolerance", "below 1"),
    ("solver:", "solver", "nothing stands here"),
    ("solver: [1]", "solver", "a mapping"),
    ("effects: {wind: {density: 1}}", "effects.wind.velocity", "missing (m/s)"),
    ("effects: {restitution: 1.5}", "effects.restitution", "at most 1"),
    ("effects: {bending: {stiffness: -0.1}}", "effects.bending.stiffness", "at least 0"),
    ("output: {fields: [speed]}", "output.fields.0", "velocity"),
    ("output: {precision_bits: 0}", "output.precision_bits", "at least 1"),
    ("expect: [{measure: speed_max, max: 1, min: 0}]", "expect.0", "exactly one"),
    ("expect: [{measure: speed_max, max: 1, from: 1, to: 0.5}]", "expect.0.to", "before"),
    ("expect: [{measure: speed_max, max: 1, from: 2}]", "expect.0.from", "after the end"),
    ("expect: [{measure: speed_max, max: 1, body: a}]", "expect.0.body", "no body named 'a'"),
    ("expect: [{measure: speed_max, max: 1, start: 2}]", "expect.0.start", "unknown key"),
    ("reference: {measure: speed_max}", "reference.value", "missing"),
    ("colliders: [{kind: plane, normal: [0, 0, 0]}]", "colliders.0.normal", "direction"),
    ("colliders: [{kind: sphere, radius: -1}]", "colliders.0.radius", "above 0"),
    ("colliders: [{kind: cylinder, radius: 1}]", "colliders.0.length", "missing"),
    ("colliders: [{kind: box, size: [1, 1, 1], spin: {axis: [0, 0, 1]}}]", "colliders.0.spin.rate", "missing (rad/s)"),
    ("colliders: [{kind: plane, name: a}, {kind: plane, name: a}]", "colliders.1.name", "already"),
    ("grav: 1", "grav", "unknown key")])
def test_wrong_sections(text: str, path: str, words: str) -> None:
    found = refused(text)
    assert len(found) == 1
    assert found[0].startswith(f"{path}: ")
    assert words in found[0]


BODIES = f"bodies: [{{{CLOTH}, name: a}}, {{{ROPE}}}, {{kind: mesh, file: m.obj, mass: 1, name: m}}]\n"


@pytest.mark.parametrize(("rows", "path", "words"), [
    ("[[a, 12, rope_1, 0]]", "attachments.0.1", "no particle 12"),
    ("[[a, 0, rope_1, 6]]", "attachments.0.3", "no particle 6"),
    ("[[a, 0, rope_2, 5]]", "attachments.0.2", "did you mean 'rope_1'?"),
    ("[[a, 0, a, 0]]", "attachments.0", "itself"),
    ("[[a, 0, rope_1]]", "attachments.0", "too short"),
    ("[[a, -1, rope_1, 0]]", "attachments.0.1", "at least 0"),
    ("[[0, 0, rope_1, 0]]", "attachments.0.0", "must be text")])
def test_wrong_attachments(rows: str, path: str, words: str) -> None:
    found = refused(BODIES + f"attachments: {rows}")
    assert len(found) == 1
    assert found[0].startswith(f"{path}: ")
    assert words in found[0]


def test_attachments_to_a_mesh_wait_for_its_file() -> None:
    assert scene(BODIES + "attachments: [[a, 11, rope_1, 5], [m, 900, a, 0]]").attachments[1] == ("m", 900, "a", 0)


def test_bounds_between_sections() -> None:
    with pytest.raises(SceneError, match="frames"):
        loads("version: 1\ntime: {duration: 1e6, frame_rate: 1000}", "s.yaml")
    with pytest.raises(SceneError, match=r"solver\.substeps: the step"):
        loads("version: 1\ntime: {duration: 1, frame_rate: 1e6}\nsolver: {substeps: 10000}", "s.yaml")
    many = "{kind: box, size: [1, 1, 1], mass: 1, count: 1000000, scatter: {inside: [[0, 0, 0], [1, 1, 1]]}}"
    with pytest.raises(SceneError, match="particles together"):
        loads(HEAD + f"bodies: [{', '.join([many] * 13)}]", "s.yaml")


def test_version_and_time_are_required() -> None:
    with pytest.raises(SceneError) as caught:
        loads("version: 2", "s.yaml")
    assert [problem.path for problem in caught.value.problems] == ["time", "version"]


def models(model: type[BaseModel]) -> set[type[BaseModel]]:
    return {model, *(found for part in model.__subclasses__() for found in models(part))}


def test_every_key_is_described() -> None:
    parts = models(schema_bodies.Part)
    assert {*schema_bodies.BODIES.values(), *schema_colliders.COLLIDERS.values(), Scene} <= parts
    bare = [f"{part.__name__}.{key}" for part in parts for key, field in part.model_fields.items()
            if not field.description and key != "kind"]
    assert bare == []


def test_scenes_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        scene("").seed = 3
