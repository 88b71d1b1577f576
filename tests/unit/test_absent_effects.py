"""An effect that a scene does not call for has no buffers and is no part of the compiled frame."""

import re

import pytest
import worlds
from numba import typeof

from verlet_numba.frame import advance
from verlet_numba.run.engine import run_chunk
from verlet_numba.scene.build import frames

FORMULAS = {"wind": "pressure", "drag": "drag", "damping": "damped", "carried": "along", "moving": "along", "contact": "surface",
            "rigid": "inverse_symmetric", "friction": "held", "restitution": "impact"}
"""A function that is compiled with each effect alone; `along` with either motion."""

CALM = dict.fromkeys(("drag", "damping", "wind", "friction", "restitution"))
STILL = [{key: value for key, value in collider.items() if key not in ("path", "spin", "friction", "restitution")}
         for collider in worlds.EVERYTHING["colliders"]]
BARE = [{key: value for key, value in body.items() if key not in ("path", "pinned", "friction", "restitution")}
        for body in worlds.EVERYTHING["bodies"]]
SCENES = {
    "everything": (worlds.EVERYTHING, {"gravity", *FORMULAS}),
    "colliders at rest": (worlds.with_changes(worlds.EVERYTHING, effects=CALM, bodies=BARE, colliders=STILL, output={"fields": []}),
                          {"gravity", "contact", "rigid"}),
    "free flight": (worlds.FREE, {"gravity"}),
    "no effects": (worlds.with_changes(worlds.FREE, effects={"gravity": None}), set())}


def functions(model):
    """Functions of the package in the frame loop of a model, inlined ones too: each leaves its environment behind."""
    chunk = frames(model, 0)
    run_chunk(model, chunk)
    overload = advance.overloads[typeof(model.world), typeof(chunk), typeof(1)]
    text = str(overload.library._get_module_for_linking())      # the public inspect_llvm is empty for cached code
    found = set()
    for mangled in re.findall(r"NumbaEnv[\w$.]*?12verlet_numba([\w$.]*)", text):
        while (length := re.match(r"\d+", mangled)):
            end = length.end() + int(length.group())
            name, mangled = mangled[length.end():end], mangled[end:]
        found.add(name)
    return found


@pytest.mark.parametrize("name", SCENES)
def test_world_holds_only_what_is_called_for(name):
    scene, wanted = SCENES[name]
    effects = worlds.built(scene).world.effects
    assert {field for field in effects._fields if getattr(effects, field) is not None} == wanted
    assert set(effects._fields) == {"gravity", *FORMULAS}


@pytest.mark.parametrize("name", SCENES)
def test_frame_loop_holds_only_what_is_called_for(name):
    scene, wanted = SCENES[name]
    found = functions(worlds.built(scene))
    assert {"relax_runs", "relax_angles", "observe"} <= found
    assert found & set(FORMULAS.values()) == {FORMULAS[effect] for effect in wanted & set(FORMULAS)}


def test_nothing_accelerates_without_an_effect_that_does():
    assert worlds.built(SCENES["no effects"][0]).world.particles.acceleration is None
