"""An effect that a scene does not call for has no buffers and is no part of the compiled frame."""

import re

import pytest
import worlds
from numba import typeof

from verlet_numba.buffers.world import Effects
from verlet_numba.frame import advance
from verlet_numba.run.engine import run_chunk
from verlet_numba.scene.build import frames

OCCURS = {
    "wind.pressure": {"wind"}, "resistance.drag": {"drag"}, "resistance.damped": {"damping"}, "motion.along": {"carried", "moving"},
    "contact.surface": {"contact"}, "narrow.gather_hulls": {"hulls", "points"}, "candidates.refresh": {"meet"},
    "narrow.collide": {"meet", "mixed"}, "sphere_tree.list_pairs": {"spheres"}, "sphere_tree.list_against": {"mixed"},
    "sphere_tree.update_layered": {"spheres", "mixed"}, "rigid.inverse_symmetric": {"rigid"}, "islands.sort_islands": {"touches"},
    "features.part_of_the_way": {"features"}, "friction.held": {"friction"}, "restitution.impact": {"restitution"},
    "relax_graph.sort_bodies": {"graph", "collided"}, "relax_lines.solve": {"lines"}, "relax_started.part": {"start"},
    "mesh_contact.meet_mesh": {"meshes"},
    "near_features.find_gaps": {"exact"}, "continuous.find_impacts": {"rapid"}, "rest.count_slow": {"rest"},
    "orientation.volume": {"orientation"}, "hinge.gradients": {"bending"}, "stopwatch.reading": {"stopwatch"}}
"""Functions that are compiled if any of these is there."""
LONG = ("exact", "paper", "colliders at rest", "a crate on the floor")
EFFECTS = set(Effects._fields)
CALM = dict.fromkeys(("drag", "damping", "wind", "friction", "restitution", "rest"))
STILL = [{key: value for key, value in collider.items() if key not in ("path", "spin", "friction", "restitution")}
         for collider in worlds.EVERYTHING["colliders"] if collider["kind"] != "mesh"]
BARE = [{key: value for key, value in body.items() if key not in ("path", "pinned", "friction", "restitution")}
        for body in worlds.EVERYTHING["bodies"]]
RIGID = [{key: value for key, value in worlds.CRATE.items() if key != "friction"}]
SOFT = {"trees", "spheres"}
MIX = {*SOFT, "points", "mixed"}
MEET = {"hulls", "meet"}
WHOLE = {"rigid", "touches"}
FOLLOWED = {"exact", "rapid"}
CONSTRAINTS = {"paper": {"graph", "collided"}, "chains": {"lines"}, "step start": {"start"}}
"""Parts of the world, beside effects, that scenes have."""
SCENES = {
    "everything": (worlds.EVERYTHING, EFFECTS - {"features", "bending", *FOLLOWED}),
    "exact": (worlds.PRECISE, {"gravity", "contact", "hulls", "meet", "trees", "points", "mixed", *WHOLE, *FOLLOWED}),
    "paper": (worlds.PAPER, EFFECTS - WHOLE - {"orientation", "bending", *FOLLOWED}),
    "colliders at rest": (worlds.with_changes(worlds.EVERYTHING, effects=CALM, bodies=BARE, colliders=STILL, output={"fields": []}),
                          {"gravity", "contact", "orientation", *MEET, *MIX, *WHOLE}),
    "a crate on the floor": (worlds.FREE | {"bodies": [*worlds.FREE["bodies"][1:], *RIGID], "colliders": [{"kind": "plane"}],
                                           "effects": {"gravity": [0, 0, -9.81]}},
                             {"gravity", "contact", "trees", "points", "mixed", *WHOLE}),
    "free flight": (worlds.FREE, {"gravity", *SOFT}),
    "no effects": (worlds.with_changes(worlds.FREE, effects={"gravity": None}), SOFT),
    "chains": (worlds.CHAINS, {"gravity"}),
    "bending": (worlds.with_changes(worlds.CHAINS, effects={"bending": {"stiffness": 0.5}}, solver={"order": "sequential"}),
                {"gravity", "bending"}),
    "step start": (worlds.with_changes(worlds.FREE, solver={"gradient": "step_start"}, effects={"contact": "none"}), {"gravity"}),
    "no contact": (worlds.with_changes(worlds.FREE, effects={"contact": "none"}), {"gravity"})}


def functions(model):
    """Functions in the frame loop of a model as module.function, inlined ones too: each leaves its environment behind."""
    chunk = frames(model, 0)
    run_chunk(model, chunk)
    overload = advance.overloads[typeof(model.world), typeof(chunk), typeof(1)]
    text = str(overload.library._get_module_for_linking())      # the public inspect_llvm is empty for cached code
    found = set()
    for mangled in re.findall(r"NumbaEnv[\w$.]*?12verlet_numba([\w$.]*)", text):
        names = []
        while (length := re.match(r"\d+", mangled)):
            end = length.end() + int(length.group())
            names.append(mangled[length.end():end])
            mangled = mangled[end:]
        found.add(".".join(names[-2:]))
    return found


@pytest.mark.parametrize("name", SCENES)
def test_world_holds_only_what_is_called_for(name):
    scene, wanted = SCENES[name]
    world = worlds.built(scene).world
    assert {field for field in EFFECTS if getattr(world.effects, field) is not None} == wanted
    there = {part for parts in CONSTRAINTS.values() for part in parts if getattr(world, part) is not None}
    assert there == CONSTRAINTS.get(name, set())
    if world.effects.meet is not None:
        assert (world.effects.meet.manifold is None) == (name == "paper")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.validate] * (name in LONG)) for name in SCENES])
def test_frame_loop_holds_only_what_is_called_for(name):
    scene, wanted = SCENES[name]
    found = functions(worlds.built(scene))
    assert {"relax.relax_runs", "relax_angles.relax_angles", "observe.observe"} <= found
    wanted = wanted | CONSTRAINTS.get(name, set())
    expected = {function for function, any_of in OCCURS.items() if any_of & wanted}
    assert found & set(OCCURS) == expected


def test_every_effect_leaves_a_trace():
    """Else the tests above would not look at it. Trees come with what they are for; gravity has no function."""
    assert {effect for effects in OCCURS.values() for effect in effects} >= EFFECTS - {"gravity", "trees"}


def test_nothing_accelerates_without_an_effect_that_does():
    assert worlds.built(SCENES["no effects"][0]).world.particles.acceleration is None
