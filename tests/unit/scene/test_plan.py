"""The plan's phases: present or absent, each for its own reason, and buffers of everything that is there."""

import pytest

from verlet_numba.scene.build import build
from verlet_numba.scene.load import loads
from verlet_numba.scene.place import place
from verlet_numba.scene.plan import MEETING, plan
from verlet_numba.scene.prepare import Prepared

HEAD = "version: 1\ntime: {duration: 0.1}\n"
BOX = "{kind: box, size: [1, 1, 1], mass: 1%s}"
ROPE = "{kind: rope, mass: 1, start: [0, 0, 3], end: [1, 0, 3], segments: 4%s}"


def planned(bodies, rest=""):
    loaded = loads(f"{HEAD}bodies: [{', '.join(bodies)}]\n{rest}", "scene.yaml")
    prepared = Prepared(loaded, place(loaded.scene, loaded.folder, loaded.source), [])
    return plan(prepared, build(loaded.scene, prepared.bodies))


def phases(bodies, rest=""):
    return {phase["name"]: (phase["active"], phase["why"]) for phase in planned(bodies, rest)["phases"]}


TWO = [BOX % ", position: [0, 0, 2]", BOX % ""]
MIXED = [*TWO, ROPE % "", ROPE % ", position: [0, 1, 0]"]
SELF, PAPER = "effects: {self_collision: true}", "solver: {preset: paper}"
POST = "colliders: [{kind: cylinder, radius: 1, length: 2, position: [5, 5, 5]}]"


@pytest.mark.parametrize(("bodies", "rest", "phase", "why"), [
    (TWO, "", "pair search", "2 hulls of rigid bodies, 0 of colliders; grids: solver.broad_phase is sweep"),
    (TWO[:1], POST, "pair search", "1 hulls of rigid bodies, 1 of colliders; grids: solver.broad_phase is sweep"),
    (TWO, PAPER, "pair search", "2 hulls of rigid bodies, 0 of colliders; all pairs: solver.broad_phase"),
    (TWO, "", "contact manifolds", "solver.response is body: hulls rest on edges and faces"),
    (TWO, "", "whole-body response", "solver.response is body"),
    (TWO, PAPER, "feature response", "solver.response is feature"),
    (TWO, PAPER, "constraint graph", "solver.order is constraint_graph"),
    ([TWO[0], ROPE % ""], "", "narrow phase", "particles meet hulls"),
    (MIXED, "", "sphere trees", "over 10 particles"),
    (MIXED, "", "deformable contact", "2 bodies, as spheres about particles"),
    (MIXED, "", "deformable against rigid", "10 particles, 2 rigid bodies"),
    ([ROPE % ""], SELF, "self-contact", "effects.self_collision"),
    (MIXED, "solver: {deformable_contact: exact}", "exact contact", "vertices with triangles, edges with edges"),
    (MIXED, "effects: {continuous_collision: true}", "exact contact",
     "vertices with triangles, edges with edges, without thickness: effects.continuous_collision"),
    (TWO, "effects: {continuous_collision: true}", "continuous collision", "effects.continuous_collision"),
    (MIXED, "effects: {rest: {}}", "rest", "effects.rest"),
    ([ROPE % ""], "solver: {order: lines}", "lines", "solver.order is lines: whole chains of sticks"),
    ([ROPE % ""], "effects: {bending: {stiffness: 0.5}}", "bending", "named in effects"),
    (TWO, "solver: {gradient: step_start}", "directions at the start of the step", "solver.gradient is step_start"),
])
def test_phases_that_are_there(bodies, rest, phase, why):
    assert phases(bodies, rest)[phase] == (True, why)


@pytest.mark.parametrize(("bodies", "rest", "phase", "why"), [
    ([ROPE % ""], "", "pair search", "no rigid body"),
    (TWO[:1], "colliders: [{kind: plane}]", "pair search", "no two hulls: one rigid body, and no box, sphere or cylinder"),
    ([BOX % ", fixed: true", BOX % ", fixed: true", ROPE % ""], "", "pair search", "all hulls are still"),
    ([BOX % ", fixed: true"], POST, "narrow phase", "nothing can move"),
    (TWO, "effects: {contact: none}", "pair search", "effects.contact is none"),
    (TWO, PAPER, "contact manifolds", "solver.response is feature: one contact a pair"),
    (TWO, PAPER, "whole-body response", "solver.response is feature"),
    (TWO[:1], "", "whole-body response", "rigid bodies meet nothing"),
    (TWO, "", "feature response", "solver.response is body"),
    (TWO, "", "sphere trees", "no deformable body"),
    ([ROPE % ""], "", "deformable contact", "one deformable body"),
    ([ROPE % ", thickness: 0", ROPE % ", thickness: 0"], "", "deformable contact", "no deformable body has a thickness"),
    ([ROPE % ""], "", "exact contact", "solver.deformable_contact is spheres"),
    ([ROPE % ""], "solver: {deformable_contact: exact}", "exact contact", "it meets nothing"),
    (TWO, "", "continuous collision", "effects.continuous_collision is off"),
    (TWO[:1], "effects: {continuous_collision: true}", "continuous collision", "nothing that may meet something on its way"),
    ([ROPE % ""], "", "self-contact", "effects.self_collision is off"),
    ([ROPE % ", thickness: 0"], SELF, "self-contact", "no deformable body has a thickness"),
    ([ROPE % ""], "", "deformable against rigid", "no rigid body"),
    (TWO, "", "deformable against rigid", "no deformable body"),
    (TWO, "", "contact with colliders", "the scene has no collider"),
    (TWO[:1], "effects: {restitution: 1}", "restitution", "nothing touches"),
    (TWO[:1], "effects: {friction: 1}", "friction", "nothing touches"),
    (TWO, "effects: {bending: {stiffness: 1}}", "bending", "named, but there is neither cloth nor a rope of two segments"),
    ([ROPE % ""], "effects: {bending: {stiffness: 0}}", "bending", "named, but it is set to nothing"),
    ([ROPE % ""], "", "bending", "not named in effects"),
    (TWO, "", "constraint graph", "solver.order is another, or there is no rigid body"),
    (TWO, "solver: {order: lines}", "lines", "solver.order is another, or there is no chain of sticks"),
    (TWO, "", "directions at the start of the step", "solver.gradient is current"),
])
def test_phases_that_are_absent(bodies, rest, phase, why):
    assert phases(bodies, rest)[phase] == (False, why)


@pytest.mark.parametrize("rest", [SELF, f"{PAPER}\n{SELF}", "effects: {contact: none}"])
def test_every_buffer_has_a_size(rest):
    found = planned(MIXED, f"{rest}\n{POST}")
    assert all(size > 0 for size in found["buffers"].values())
    assert found["memory_bytes"] > sum(found["buffers"].values())
    assert {group["lanes"] for group in found["groups"] if group["kind"] == "box"} == (
        {"outwards from what collided"} if PAPER in rest else {"stick by stick"})


def test_bodies_that_meet_take_more_memory():
    apart = planned(TWO, "effects: {contact: none}")
    assert planned(TWO)["memory_bytes"] - apart["memory_bytes"] >= MEETING
