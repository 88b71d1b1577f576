"""Scene files as a whole: everything that is wrong is told at once, where it stands."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from verlet_numba.scene.load import Loaded, json_schema, load, loads, resolved
from verlet_numba.scene.problems import SceneError

FULL = """\
version: 1
name: cloth_on_cube
time: {duration: 2.0, frame_rate: 60}
seed: 0
solver:
  preset: default
  substeps: 8
  iterations: 1
  tolerance: 0.0
  order: sequential
  repeats: by_level
  response: body
  projection_point: feature
  deformable_contact: exact
  orientation_guard: true
  gradient: step_start
  square_root: exact
  precision: float64
  broad_phase: sweep
effects:
  gravity: [0, 0, -9.81]
  contact: auto
  drag: {linear: 0.0, quadratic: 0.0}
  damping: 0.0
  wind: {velocity: [1, 0, 0], density: 1.2}
  friction: {static: 0.5, dynamic: 0.4}
  restitution: 0.0
  self_collision: true
  continuous_collision: true
  bending: {stiffness: 0.5}
  rest: {speed: 0.01, time: 0.5}
bodies:
  - {kind: cloth, name: sheet, size: [1, 1], resolution: [40, 40], diagonals: both, mass: 0.2, thickness: 0.01, position: [0, 0, 0.8], pinned: []}
  - {kind: rope, name: line, start: [-1, 0, 1], end: [1, 0, 1], length: 2.2, segments: 50, mass: 0.5, thickness: 0.02, pinned: [0, 50]}
  - {kind: box, name: crate, size: [0.4, 0.4, 0.4], mass: 1.0, position: [0, 0, 0.2], rotation: {axis: [0, 0, 1], degrees: 30}, velocity: [0, 0, 0], angular_velocity: [0, 0, 0], fixed: false}
  - {kind: icosahedron, name: die, radius: 0.2, mass: 1.0, count: 50, scatter: {inside: [[-2, -2, 0.3], [2, 2, 3]], speed: [0, 4]}}
  - {kind: mesh, name: bunny, file: bunny.obj, scale: 1.0, mass: 1.0}
  - kind: particles
    name: pendulum
    positions: [[0, 0, 0], [1, 0, 0]]
    masses: [1, 1]
    velocities: [[0, 0, 0], [0, 0, 0]]
    pinned: [0]
    sticks: [[0, 1]]
    angles: []
    compliance: 0.0
    radius: 0.0
    contact_geometry: nodes
attachments: [[sheet, 0, line, 10]]
colliders:
  - {kind: plane, point: [0, 0, 0], normal: [0, 0, 1]}
  - {kind: room, size: [4, 4, 4], position: [0, 0, 2]}
  - {kind: box, size: [1, 1, 1], position: [0, 0, 0.5]}
  - {kind: sphere, radius: 0.3, position: [0, 0, 0.3], path: [[0, 0, 0, 0], [1, 1, 0, 0]], spin: {axis: [0, 0, 1], rate: 2}}
  - {kind: cylinder, radius: 0.2, axis: [0, 1, 0], position: [0, 0, 0], length: 2}
  - {kind: mesh, file: bowl.stl}
output: {fields: [velocity], observables: true, precision: float32, precision_bits: 24}
expect: [{measure: penetration_max, max: 0.01, tolerance: 0.001, from: 0.5, to: 2, body: crate}]
reference: {measure: total_energy, value: 3.5, source: by hand}
"""  # noqa: E501 - the scene as users read it, long rows included
SMALL = "version: 1\ntime: {duration: 1}\n"


def problems(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(text, "s.yaml")
    return [str(problem) for problem in caught.value.problems]


def test_the_whole_contract_validates(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(FULL)
    loaded = load(path)
    assert isinstance(loaded, Loaded)
    assert loaded.folder == tmp_path
    assert loaded.source.text == FULL
    assert [body.name for body in loaded.scene.bodies] == ["sheet", "line", "crate", "die", "bunny", "pendulum"]
    assert loaded.scene.bodies[0].thickness == 0.01
    assert loaded.scene.expect[0].start == 0.5
    assert loaded.scene.solver.gradient == "step_start"


@pytest.mark.parametrize("text", [FULL, SMALL, SMALL + "solver: {preset: paper}\neffects: {friction: 0.5}\n"])
def test_a_resolved_scene_loads_as_itself(text: str) -> None:
    scene = loads(text, "s.yaml").scene
    plain = resolved(scene)
    assert loads(json.dumps(plain), "resolved").scene == scene
    assert plain["solver"]["substeps"] == scene.solver.substeps
    assert all("from" in expected and "start" not in expected for expected in plain["expect"])


def test_everything_wrong_is_told_in_the_order_of_the_file() -> None:
    assert problems("""\
version: 1
tme: {duration: 1}
solver:
  substps: 4
  order: linse
effects: {damping: .nan}
bodies:
  - {kind: clot, name: sheet}
  - {kind: box, name: sheet, size: [1, 1, 1], mass: -1, mass: 2}
attachments: [[shet, 0, sheet, 1]]
""") == [
        "s.yaml:1:1: time: is missing (duration and frame rate)",
        "s.yaml:2:1: tme: unknown key (did you mean 'time'?)",
        "s.yaml:4:3: solver.substps: unknown key (did you mean 'substeps'?)",
        "s.yaml:5:10: solver.order: 'linse' is not one of sequential, constraint_graph, lines (did you mean 'lines'?)",
        "s.yaml:6:20: effects.damping: .nan is not a finite number",
        "s.yaml:8:12: bodies.0.kind: kind 'clot' is not one of cloth, rope, box, icosahedron, mesh, particles (did you "
        "mean 'cloth'?)",
        "s.yaml:9:23: bodies.1.name: the name 'sheet' is that of bodies.0 already; give each its own",
        "s.yaml:9:53: bodies.1.mass: must be above 0, not -1; to hold a body or particle in place use `pinned` or "
        "`fixed: true`",
        "s.yaml:9:57: bodies.1.mass: this key stands here a second time (first at line 9)",
        "s.yaml:10:16: attachments.0.0: there is no body named 'shet' (did you mean 'sheet'?)"]


@pytest.mark.parametrize("text", ["5", "[1]", "text", "null", "---\n"])
def test_what_is_no_mapping_is_no_scene(text: str) -> None:
    assert len(problems(text)) == 1


def test_no_words_of_the_library_reach_the_user() -> None:
    text = FULL.replace("0.2", "x").replace("[0, 0, 0]", "{}").replace("true", "1").replace("60", "[]")
    found = "\n".join(problems(text)).lower()
    assert len(found.splitlines()) > 10
    for word in ("pydantic", "input", "tuple", "dict", "none", "str", "instance", "http"):
        assert f" {word}" not in found


def test_wrong_values_without_end_are_told_in_part() -> None:
    points = ", ".join(["[0, 0, x]"] * 5000)
    found = problems(SMALL + f"bodies:\n  - {{kind: particles, positions: [{points}], masses: [1]}}")
    assert len(found) == 1000
    assert found[0].endswith("bodies.0.positions.0.2: must be a number, not 'x'")


def test_odd_keys_stay_on_one_line() -> None:
    found = problems(SMALL + '"a\\nb": 1\n? ' + "k" * 5000 + "\n: 2\n")
    assert len(found) == 2
    assert max(len(line) for line in found) < 300
    assert not any("\n" in line for line in found)


def test_the_schema_for_editors_has_descriptions_and_defaults() -> None:
    schema = json_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert schema["additionalProperties"] is False
    assert schema["properties"]["effects"]["default"]["gravity"] == [0, 0, -9.81]
    assert schema["$defs"]["Solver"]["properties"]["substeps"]["default"] == 8
    assert "m/N" in schema["$defs"]["Rope"]["properties"]["compliance"]["description"]
    assert "from" in schema["$defs"]["Expect"]["properties"]


def test_loading_needs_no_heavy_library() -> None:
    code = ("import sys, verlet_numba.scene.load as _\n"
            "heavy = {'numba', 'numpy', 'scipy', 'trimesh', 'matplotlib'}\n"
            "print(sorted(heavy & set(sys.modules)))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_bounds_of_the_json_schema_are_those_of_json_schema():
    output = json_schema()["$defs"]["Output"]["properties"]["precision_bits"]
    assert (output["minimum"], output["maximum"]) == (1, 24)
    text = json.dumps(json_schema())
    assert not any(f'"{key}": ' in text for key in ("ge", "gt", "le", "lt"))
