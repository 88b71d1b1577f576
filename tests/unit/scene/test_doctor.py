"""Warnings: each appears for its fault, at its place, and not without it."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh

from verlet_numba.scene.doctor import examine
from verlet_numba.scene.load import loads
from verlet_numba.scene.overlap import overlap_depth
from verlet_numba.scene.place import place

HEAD = "version: 1\ntime: {duration: 1}\n"


def warnings(text, folder=None):
    loaded = loads(HEAD + text, "scene.yaml")
    folder = folder or loaded.folder
    found = examine(loaded.scene, place(loaded.scene, folder, loaded.source), folder, loaded.source)
    return [(problem.path, problem.message) for problem in found]


def paths(text, about, folder=None):
    return [path for path, message in warnings(text, folder) if about in message]


GOOD = """
bodies: [{kind: box, name: crate, size: [0.4, 0.4, 0.4], mass: 1, position: [0, 0, 0.2]}]
colliders: [{kind: plane, name: floor}, {kind: room, name: hall, size: [4, 4, 4], position: [0, 0, 2]}]
"""


def test_a_sound_scene_has_no_warnings():
    assert warnings(GOOD) == []
    assert warnings("") == []


def test_start_inside_a_collider_counts_the_radius():
    assert paths(GOOD.replace("0.2]}]", "0.1]}]"), "start inside collider floor") == ["bodies.0"]
    rope = "bodies: [{kind: rope, mass: 1, start: [0, 0, %s], end: [1, 0, %s], segments: 4, thickness: 0.1}]\n"
    assert paths(rope % (0.05, 0.05) + "colliders: [{kind: plane}]", "start inside") == []
    assert paths(rope % (0.04, 0.04) + "colliders: [{kind: plane}]", "start inside") == ["bodies.0"]
    assert paths(rope % (0.04, 0.04) + "colliders: [{kind: plane}]\neffects: {contact: none}", "start inside") == []
    fixed = (rope % (0.04, 0.04)).replace("}]", ", fixed: true}]")
    assert paths(fixed + "colliders: [{kind: plane}]", "start inside") == []


def test_start_inside_a_mesh_collider(tmp_path):
    trimesh.creation.box().export(tmp_path / "block.stl")
    text = GOOD.replace("{kind: plane, name: floor}",
                        "{kind: mesh, name: block, file: block.stl, position: [%s, 0, 0]}")
    assert paths(text % 0, "start inside collider block", tmp_path) == ["bodies.0"]
    assert paths(text % 1, "start inside collider block", tmp_path) == []


PAIR = """
bodies:
  - {kind: box, name: a, size: [1, 1, 1], mass: 1}
  - {kind: %s, name: b, mass: 1, position: [%s, 0, 0], rotation: {axis: [0, 0, 1], degrees: 45}, %s}
"""


@pytest.mark.parametrize(("kind", "shape", "touching"), [
    ("box", "size: [1, 1, 1]", 0.5 + 0.5**0.5),
    ("cloth", "size: [1, 1], resolution: [3, 3], thickness: 0.1", 0.5 + 0.05 + 0.5**0.5),
])
def test_bodies_that_overlap(kind, shape, touching):
    assert paths(PAIR % (kind, touching - 0.01, shape), "overlaps body a") == ["bodies.1"]
    assert paths(PAIR % (kind, touching + 0.001, shape), "overlaps body a") == []


def test_depth_of_overlap_is_the_least_way_out():
    loaded = loads(HEAD + PAIR % ("box", 1.1, "size: [1, 1, 1]"), "scene.yaml")
    a, b = place(loaded.scene, loaded.folder, loaded.source)
    assert overlap_depth(a, b) == pytest.approx(0.5 + 0.5**0.5 - 1.1)


def test_edges_part_boxes_that_no_face_parts():
    text = """
bodies:
  - {kind: box, name: a, size: [2, 1, 1], mass: 1, rotation: {axis: [1, 0, 0], degrees: 45}}
  - {kind: box, name: b, size: [1, 2, 1], mass: 1, rotation: {axis: [0, 1, 0], degrees: 45}, position: [0, 0, %s]}
"""
    assert paths(text % 1.42, "overlaps") == []
    assert paths(text % 1.41, "overlaps") == ["bodies.1"]


def test_ropes_that_overlap_unless_attached():
    text = """
bodies:
  - {kind: rope, name: a, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 10, thickness: 0.02}
  - {kind: rope, name: b, mass: 1, start: [1, 0, 0], end: [1, 0, 1], segments: 10, thickness: 0.02}
"""
    assert paths(text, "overlaps body a") == ["bodies.1"]
    assert paths(text + "attachments: [[a, 10, b, 0]]", "overlaps") == []


@pytest.mark.parametrize(("response", "pair", "then"), [
    ("body", PAIR % ("box", 1.1, "size: [1, 1, 1]"), "they part slowly, by 2.5 times the radius"),
    ("feature", PAIR % ("box", 1.1, "size: [1, 1, 1]"), "the first steps throw them apart"),
    ("body", PAIR % ("cloth", 1.1, "size: [1, 1], resolution: [3, 3]"), "they part slowly"),
])
def test_what_becomes_of_an_overlap(response, pair, then):
    assert paths(f"solver: {{response: {response}}}{pair}", then) == ["bodies.1"]


def test_deformable_bodies_that_overlap_part_at_once():
    text = """
bodies:
  - {kind: rope, name: a, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 10, thickness: 0.2}
  - {kind: rope, name: b, mass: 1, start: [0.5, 0, 0.1], end: [0.5, 0, 1], segments: 10, thickness: 0.2}
"""
    assert paths(text, "the first step pushes them apart") == ["bodies.1"]


def test_too_fast_for_a_thin_collider():
    """A hull leaves by the shortest way. An icosahedron of radius 0.1 m is 0.15893 m wide across its faces: half of that and
    of a wall of 0.1 m is 0.12947 m, at 480 substeps a second 62.14 m/s. A point leaves by the way it came: 48 m/s."""
    text = """
bodies: [{kind: icosahedron, radius: 0.1, mass: 1, position: [0, 0, 2], velocity: [%s, 0, 0]}]
colliders: [{kind: box, size: [0.1, 5, 5], position: [3, 0, 0]}]
"""
    assert paths(text % 62.1, "may pass through") == []
    assert paths(text % 62.2, "from collider box_0, and is held back from 0.129 m at most") == ["bodies.0"]
    assert paths(text % 62.2, "use 9 substeps") == ["bodies.0"]
    point = text.replace("icosahedron, radius: 0.1, mass: 1", "particles, positions: [[0, 0, 0]], masses: [1]")
    assert paths(point % 47, "may pass through") == []
    assert paths(point % 49, "use 9 substeps") == ["bodies.0"]


def test_too_fast_for_another_body():
    """Boxes of 0.2 and 0.1 m pass each other from 0.15 m a substep on, 72 m/s between them; the faster one is to blame."""
    text = """
bodies:
  - {kind: box, name: a, size: [1, 0.2, 1], mass: 1, position: [0, 0, 0], velocity: [0, %s, 0]}
  - {kind: box, name: b, size: [1, 1, 0.1], mass: 1, position: [0, 9, 0], velocity: [0, %s, 0], fixed: %s}
"""
    assert paths(text % (40, -31.9, "false"), "may pass through") == []
    assert paths(text % (40, -32.1, "false"), "seen from body b, and is held back from 0.15 m") == ["bodies.0"]
    assert paths(text % (30, -42.1, "false"), "seen from body a") == ["bodies.1"]
    assert paths(text % (72.1, 0, "true"), "use 9 substeps") == ["bodies.0"]
    assert paths(text % (72.1, 0, "true") + "effects: {contact: none}", "") == []


def test_too_fast_when_it_has_fallen():
    """From 4.905 m to the top of a plate of 0.1 m a point comes with 9.81 m/s: at 60 substeps a second 0.1635 m, from 0.1 m on."""
    text = """
solver: {substeps: 1}
effects: {gravity: [0, 0, %s]}
bodies: [{kind: particles, name: stone, positions: [[%s, 0, 4.955]], masses: [1], pinned: %s}]
colliders: [{kind: %s, position: [0, 0, 0]}]
"""
    plate = "box, size: [1, 1, 0.1]"
    told = "falls by up to 0.164 m a substep on collider box_0, and is held back from 0.1 m"
    assert paths(text % (-9.81, 0, [], plate), told) == ["bodies.0"]
    assert paths(text % (-9.81, 0, [], plate), "use 2 substeps") == ["bodies.0"]
    for calm in ((9.81, 0, [], plate), (-9.81, 0.6, [], plate), (-9.81, 0, [0], plate), (-3, 0, [], plate),
                 (-9.81, 0, [], "cylinder, radius: 0.1, axis: [1, 0, 0], length: 2")):
        assert paths(text % calm, "may pass through") == []
    assert paths(text % (-9.81, 0.9, [], "cylinder, radius: 0.05, axis: [1, 0, 0], length: 2"), told[:20]) == ["bodies.0"]


def test_too_fast_when_it_has_fallen_on_another_body():
    """A sheet of 1 cm that hangs is passed by one that falls on it from 4.905 m; a sheet that falls too is not caught up with."""
    text = """
solver: {substeps: 8}
bodies:
  - {kind: cloth, name: low, size: [1, 1], resolution: [101, 101], mass: 1, thickness: 0.01, pinned: %s}
  - {kind: cloth, name: high, size: [1, 1], resolution: [101, 101], mass: 1, thickness: 0.01, position: [0, 0, 4.905]}
"""
    assert paths(text % "corners", "falls by up to 0.0204 m a substep on body low, and is held back from 0.01 m") == ["bodies.1"]
    assert paths(text % "[]", "may pass through") == []


def test_copies_too_fast_for_each_other():
    text = ("bodies: [{kind: box, size: [0.1, 0.1, 0.1], mass: 1, count: %s, "
            "scatter: {inside: [[0, 0, 0], [9, 9, 9]], speed: [%s, %s]}}]")
    assert paths(text % (2, 24.1, 24.1), "seen from another copy") == ["bodies.0"]
    assert paths(text % (2, 23.9, 23.9), "seen from another copy") == []
    assert paths(text % (1, 24.1, 24.1), "seen from another copy") == []


def test_points_pass_each_other_at_any_speed():
    """They never meet, and so cannot be too fast; a rigid body they do meet."""
    points = "bodies: [{kind: particles, positions: [[0, 0, 0], [1, 0, 0]], masses: [1, 1], velocity: [99, 0, 0]}, %s]"
    assert paths(points % "{kind: rope, mass: 1, start: [0, 0, 1], end: [1, 0, 1], segments: 2}", "may pass") == []
    assert paths(points % "{kind: box, size: [0.2, 1, 1], mass: 1, position: [9, 0, 0]}", "seen from body box_1") == ["bodies.0"]


ROPES = """
effects: {self_collision: %s}
bodies:
  - {kind: rope, name: a, mass: 1, start: [0, 0, 0], end: [0, 0, 3], segments: 10, thickness: %s}
  - {kind: rope, name: b, mass: 1, start: [1, 0, 0], end: [1, 0, 4], segments: 10, thickness: %s}
"""


def test_ropes_that_slip_between_each_others_beads():
    """Segments of 0.3 and 0.4 m that cross at their middles have ends 0.25 m apart: so much have both radii to be."""
    assert paths(ROPES % ("false", 0.3, 0.2), "may slip") == []
    assert paths(ROPES % ("false", 0.3, 0.199), "thicknesses of 0.5 m together are enough, they are 0.499 m") == ["bodies.1"]
    assert paths(ROPES % ("false", 0.3, 0.199), "through body a") == ["bodies.1"]


def test_a_rope_that_slips_through_itself():
    """Segments of one length l that cross have ends l / sqrt(2) apart."""
    alone = ROPES[:ROPES.index("  - {kind: rope, name: b")]
    assert paths(alone % ("true", 0.2122), "may slip") == []
    assert paths(alone % ("true", 0.212), "through itself") == ["bodies.0"]
    assert paths(alone % ("true", 0.212), "a thickness of 0.212 m is enough") == ["bodies.0"]
    assert paths(alone % ("false", 0.212), "may slip") == []


def test_a_thin_rope_slips_through_the_cells_of_a_cloth():
    """Half the diagonal of a cell of 0.3 x 0.4 m is 0.25 m. A cloth holds another one like it from 0.2828 m of thickness on."""
    text = """
bodies:
  - {kind: cloth, name: sheet, size: [3, 4], resolution: [11, 11], mass: 1, thickness: 0.4, position: [5, 0, 1]}
  - {kind: rope, name: line, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 100, thickness: %s}
"""
    sheets = text[:text.index("  - {kind: rope")].replace("0.4, position", "%s, position")
    assert paths(text % 0.11, "may slip") == []
    assert paths(text % 0.099, "through body sheet") == ["bodies.1"]
    assert paths("effects: {self_collision: true}" + sheets % 0.283, "may slip") == []
    assert paths("effects: {self_collision: true}" + sheets % 0.282, "through itself") == ["bodies.0"]


def test_what_cannot_meet_itself():
    rope = "bodies: [{kind: rope, mass: 1, start: [0, 0, 0], end: [1, 0, 0], segments: 4, thickness: %s}]\n"
    asked = "effects: {self_collision: true}\n"
    assert paths(rope % 0 + asked, "has no thickness, so `self_collision` does nothing") == ["bodies.0"]
    assert paths(rope % 0.3 + asked, "") == []
    assert paths(rope % 0, "") == []
    box = "bodies: [{kind: box, size: [1, 1, 1], mass: 1}]\n"
    assert paths(box + asked, "does nothing: there is no cloth") == ["effects.self_collision"]


def test_restitution_that_has_no_effect():
    text = """
solver: {response: %s}
effects: {restitution: %s}
bodies: [{kind: %s, mass: 1, position: [0, 0, 3]}]
colliders: [{kind: plane}, {kind: room, size: [9, 9, 9]}%s]
"""
    box, cloth = "box, size: [1, 1, 1]", "cloth, size: [1, 1], resolution: [9, 9]"
    post = ", {kind: box, size: [1, 1, 1], position: [3, 3, 3]}"
    assert paths(text % ("feature", 0.5, box, ""), "rebounds") == []
    assert paths(text % ("feature", 0.5, box, post), "box_0 rebounds from planes and rooms alone") == ["effects.restitution"]
    assert paths(text % ("body", 0.5, box, post), "rebounds") == []
    assert paths(text % ("feature", 0, box, post), "rebounds") == []
    assert paths(text % ("feature", 0.5, cloth, post), "rebounds") == []
    other = ", restitution: 1}, {kind: box, size: [1, 1, 1], mass: 1, position: [2, 2, 2]}]\ncoll"
    two = (text % ("feature", 0, box, "")).replace("}]\ncoll", other)
    assert paths(two, "rebounds from planes and rooms alone") == ["bodies.0.restitution"]


def test_sticks_that_are_repeated_stretched_pointlike_or_uneven():
    text = """
bodies:
  - kind: particles
    positions: [[0, 0, 0], [1, 0, 0], [1, 0, 0], [3, 0, 0]]
    masses: [1, 1, 1, 101]
    pinned: %s
    sticks: [[0, 1], [1, 0], [1, 2], [0, 3, 2], [0, 3, 3]]
"""
    assert paths(text % [], "same particles as stick 0 (and 1 more sticks)") == ["bodies.0.sticks.1"]
    assert paths(text % [], "start at the same point") == ["bodies.0.sticks.2"]
    assert paths(text % [], "starts 3 m long, but its length is 2 m") == ["bodies.0.sticks.3"]
    assert paths(text % [], "masses of 101:1") == ["bodies.0.sticks.3"]
    assert paths(text % [3], "masses of") == []


def test_attachments_apart_held_or_uneven():
    text = """
bodies:
  - {kind: box, name: a, size: [1, 1, 1], mass: %s, fixed: %s}
  - {kind: box, name: b, size: [1, 1, 1], mass: 1, position: [1, 0, 0], pinned: %s}
attachments: [[a, 4, b, %s]]
"""
    assert paths(text % (1, "false", [], 0), "") == []
    assert paths(text % (1, "false", [], 1), "start 1 m apart") == ["attachments.0"]
    assert paths(text % (1, "true", [0], 0), "both particles are pinned") == ["attachments.0"]
    assert paths(text % (101, "false", [], 0), "masses of 101:1") == ["attachments.0"]
    assert paths(text % (101, "true", [], 0), "masses of") == []


def test_float32_far_from_the_origin():
    text = "bodies: [{kind: box, size: [1, 1, 1], mass: 1, position: [%s, 0, 0]}]\noutput: {precision: %s}\n"
    assert paths(text % (1e7, "float32"), "too coarse") == ["output.precision"]
    assert paths(text % (1e7, "float64"), "too coarse") == []
    assert paths(text % (100, "float32"), "too coarse") == []
    assert paths(text % (1e7, "float64") + "solver: {precision: float32}", "too coarse") == ["solver.precision"]


def test_gravity_below_the_spacing_of_float32():
    text = ("bodies: [{kind: box, size: [1, 1, 1], mass: 1, position: [0, 0, 1.6]}]\n"
            "solver: {substeps: %s, precision: %s}\n")
    assert paths(text % (200, "float32"), "gravity moves") == ["solver.precision"]
    assert paths(text % (100, "float32"), "gravity moves") == []
    assert paths(text % (200, "float64"), "gravity moves") == []


def test_positions_in_the_file():
    loaded = loads(HEAD + GOOD.replace("0.2]}]", "0.1]}]"), "scene.yaml")
    bodies = place(loaded.scene, loaded.folder, loaded.source)
    problem = examine(loaded.scene, bodies, loaded.folder, loaded.source)[0]
    assert str(problem) == ("scene.yaml:4:10: bodies.0: 4 of its 8 particles start inside collider floor, "
                            "up to 0.1 m deep")


def test_examining_loads_no_heavy_library():
    """Meshes and simulation need them; `check` of any other scene must answer at once."""
    code = f"""
import sys
from verlet_numba.scene.doctor import examine
from verlet_numba.scene.load import loads
from verlet_numba.scene.place import place
loaded = loads({HEAD + GOOD + "seed: 1"!r}, "scene.yaml")
examine(loaded.scene, place(loaded.scene, loaded.folder, loaded.source), loaded.folder, loaded.source)
print(sorted({{"numba", "scipy", "trimesh", "matplotlib"}} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_mesh_that_needs_no_bracing(tmp_path):
    trimesh.creation.icosphere(1).export(tmp_path / "ball.obj")
    assert warnings("bodies: [{kind: mesh, file: ball.obj, mass: 1}]", tmp_path) == []


def test_bracing_is_told(tmp_path, monkeypatch):
    from verlet_numba.scene import mesh

    full = mesh.tetrahedral_sticks
    monkeypatch.setattr(mesh, "tetrahedral_sticks", lambda *of: np.array([s for s in full(*of) if s[0] > 0]))
    trimesh.creation.icosphere(1).export(tmp_path / "ball.obj")
    assert paths("bodies: [{kind: mesh, file: ball.obj, mass: 1}]", "braced by 3 sticks", tmp_path) == ["bodies.0.file"]


SLIPPING = "\ncolliders: [{kind: sphere, name: ball, radius: %s}]"


def test_what_slips_between_the_particles_of_a_cloth():
    """A cell of 0.5 m has a diagonal of 0.7071 m. Rigid bodies are not coarse: they meet others with their whole hull."""
    cloth = "bodies: [{kind: cloth, size: [1, 1], resolution: [3, 3], thickness: 0.1, mass: 1, position: [0, 0, 2]}%s]"
    assert paths(cloth % "" + SLIPPING % 0.30, "collider ball is 0.6 m wide: it may slip between") == ["bodies.0"]
    assert paths(cloth % "" + SLIPPING % 0.31, "may slip between") == []
    assert paths(cloth % ", {kind: box, name: bar, size: [0.6, 9, 0.1], mass: 1}", "body bar is 0.6 m wide") == ["bodies.0"]
    assert paths(cloth % ", {kind: box, name: bar, size: [0.61, 9, 0.1], mass: 1}", "may slip between") == []
    assert paths("bodies: [{kind: box, size: [1, 1, 1], mass: 1, position: [0, 0, 2]}]" + SLIPPING % 0.3, "may slip") == []


def test_lines_of_cloth_in_few_substeps():
    cloth = "bodies: [{kind: cloth, size: [1, 1], resolution: [3, 3], mass: 1}]\nsolver: {order: %s, substeps: %d}"
    assert paths(cloth % ("lines", 5), "at least 360 substeps a second, here they have 300") == ["solver.order"]
    assert paths(cloth % ("lines", 6), "substeps a second") == []
    assert paths(cloth % ("sequential", 5), "substeps a second") == []
    rope = "bodies: [{kind: rope, start: [0, 0, 0], end: [1, 0, 0], segments: 3, mass: 1}]\nsolver: {order: lines, substeps: 1}"
    assert paths(rope, "substeps a second") == []


def test_masses_of_a_chain_that_is_solved_as_a_whole_may_be_as_they_like():
    heavy = ("bodies: [{kind: particles, positions: [[0, 0, 0], [1, 0, 0], [2, 0, 0]%s], masses: [1, 1, 500%s], "
             "sticks: [[0, 1], [1, 2]%s]}]\nsolver: {order: %s}")
    assert paths(heavy % ("", "", "", "sequential"), "joins masses of 500:1") == ["bodies.0.sticks.1"]
    assert paths(heavy % ("", "", "", "lines"), "joins masses") == []
    assert paths(heavy % (", [1, 1, 0]", ", 1", ", [1, 3]", "lines"), "joins masses of 500:1") == ["bodies.0.sticks.1"]
