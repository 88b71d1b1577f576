"""Every scene of the repository is good, without a word of warning that is not known, and runs; tests/hard has the hard ones."""

from pathlib import Path

import numpy as np
import pytest

from verlet_numba.scene.prepare import prepare

SCENES = Path(__file__).parents[2] / "scenes"
FILES = sorted(path.relative_to(SCENES) for path in SCENES.rglob("*.yaml") if path.parent.name not in ("hard", "sweeps"))
LONG = {"bowl", "bouncing_icosahedron", "bungee", "cloth_on_spinning_ball", "covered_crates", "curtain", "icosahedra_room",
        "rope_net", "sliding_boxes", "springboard"}     # effects that nothing else needs compiled: minutes
KNOWN = ("not simulated yet",)      # bodies pass through each other: the scenes say so themselves


@pytest.mark.parametrize("scene", FILES, ids=str)
def test_scene_is_good(scene):
    warnings = [str(warning) for warning in prepare(SCENES / scene).warnings]
    assert [text for text in warnings if not any(known in text for known in KNOWN)] == []


@pytest.mark.parametrize("scene", [pytest.param(path, marks=[pytest.mark.validate] * (path.stem in LONG)) for path in FILES],
                         ids=str)
def test_scene_runs(simulate, scene):
    """Three frames after the start, all numbers finite, sticks near their lengths, nothing deep in a collider."""
    run = simulate(scene, {"time.duration": 0.05, "time.frame_rate": 60})
    assert len(run.time) == 4
    assert np.isfinite(run.position).all()
    assert np.isfinite(run.velocity).all()
    assert all(np.isfinite(values).all() for values in run.measures.values())
    assert run.measures["constraint_error_max"].max() < 0.05
    assert run.measures["penetration_max"].max() < 0.01


def test_there_are_scenes():
    assert {path.parts[0] for path in FILES} >= {"paper", "validation", "gallery"}
