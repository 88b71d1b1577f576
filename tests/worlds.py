"""Small scenes as running worlds, for tests of every part of the simulator."""

import json
from pathlib import Path

import numpy as np

from verlet_numba.run.engine import run_chunk, start
from verlet_numba.scene.body import Body
from verlet_numba.scene.build import build, frames
from verlet_numba.scene.load import loads
from verlet_numba.scene.place import place

APART = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"substeps": 4, "iterations": 2, "orientation_guard": True},
    "effects": {"gravity": [0.5, 0, -9.81], "drag": {"linear": 0.3, "quadratic": 0.2}, "damping": 0.4,
                "wind": {"velocity": [2, 1, 0.5], "density": 1.2}, "friction": {"static": 0.5, "dynamic": 0.3},
                "restitution": 0.1, "self_collision": True, "rest": {"time": 10}},
    "bodies": [
        {"kind": "cloth", "name": "sheet", "size": [0.6, 0.5], "resolution": [4, 3], "mass": 0.2, "thickness": 0.04,
         "position": [0, 0, 0.7], "rotation": {"axis": [1, 2, 0], "degrees": 10}, "velocity": [0.3, 0, -2]},
        {"kind": "rope", "name": "line", "start": [-0.9, -0.9, 1.2], "end": [0.3, -0.9, 1.2], "segments": 5, "mass": 0.5,
         "compliance": 1e-4, "pinned": [0], "path": [[0.02, 0, 0, 0], [0.1, 0.1, 0, 0.05], [0.5, 0.1, 0.4, 0]]},
        {"kind": "icosahedron", "name": "dice", "radius": 0.12, "mass": 1, "count": 3, "velocity": [0, 0, -3],
         "angular_velocity": [1, 5, 2], "restitution": 0.5, "friction": 0.2,
         "scatter": {"inside": [[-0.9, 0.6, 0.1], [0.9, 0.9, 0.9]], "speed": [0, 2]}},
        {"kind": "box", "name": "crate", "size": [0.2, 0.3, 0.2], "mass": 2, "position": [0.6, 0.1, 0.102],
         "rotation": {"axis": [0.1, 0, 1], "degrees": 20}, "velocity": [2, 0, 0]},
        {"kind": "particles", "name": "arm", "radius": 0.01, "velocity": [0, 1, -4], "compliance": 1e-3,
         "positions": [[0.3, -0.9, 1.2], [0.6, -0.9, 1.2], [0.6, -0.6, 1.2], [0.4, -0.5, 1.3]], "masses": [1, 2, 0.5, 1],
         "sticks": [[0, 1], [1, 2], [2, 3, 0.3]], "angles": [[0, 1, 2], [1, 2, 3, 100]]}],
    "attachments": [["line", 5, "arm", 0]],
    "colliders": [
        {"kind": "room", "size": [2, 2, 4], "position": [0, 0, 2]},
        {"kind": "sphere", "radius": 0.3, "position": [0, 0, 0.3], "spin": {"axis": [0, 1, 1], "rate": 4},
         "path": [[0, 0, 0, 0], [0.1, 0, 0, 0.1], [0.3, 0.1, 0, 0]]},
        {"kind": "box", "size": [0.4, 0.3, 0.2], "position": [-0.5, -0.6, 0.1], "friction": 0.9, "restitution": 0.4},
        {"kind": "cylinder", "radius": 0.15, "axis": [1, 1, 0.2], "length": 0.8, "position": [0.5, -0.6, 0.2]},
        {"kind": "mesh", "file": str(Path(__file__).with_name("sheet.obj")), "position": [90, 0, 0]}],
    "output": {"fields": ["velocity"], "precision": "float64"}}
"""Calls for every effect, in every kind of constraint: copies and cloth in runs, single bodies in sticks, angles.

Its bodies meet colliders, rigid ones the room alone, and each other only later. Nothing reaches the mesh, nor rests so long.
"""

EVERYTHING = APART | {"bodies": [
    *APART["bodies"],
    {"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 0.5, "position": [0.65, 0.1, 0.33], "velocity": [1.5, 0, -2]},
    {"kind": "box", "name": "block", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [-0.5, -0.6, 0.302], "velocity": [0, 0, -1],
     "rotation": {"axis": [1, 0, 1], "degrees": 5}},
    {"kind": "rope", "name": "string", "start": [0.5, 0.05, 0.48], "end": [0.8, 0.15, 0.48], "segments": 4, "mass": 0.1,
     "thickness": 0.03, "velocity": [1, 0, -2]}]}
"""The same, and a die falls on the crate, a block on the box, and a string on the die."""

PAPER = EVERYTHING | {"solver": {"preset": "paper", "substeps": 4, "iterations": 3}}
"""The same, answered as the paper does: features are moved apart, bodies relaxed along their constraint graph."""

FREE = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"substeps": 4, "iterations": 2},
    "effects": {"gravity": [0, 0, -9.81]},
    "bodies": [
        {"kind": "rope", "name": "line", "start": [0, 0, 3], "end": [1, 0, 3], "segments": 6, "mass": 0.5},
        {"kind": "particles", "name": "arm", "positions": [[0, 2, 0], [0.3, 2, 0], [0.3, 2.4, 0], [0, 2.4, 0.2]],
         "masses": [1, 2, 0.5, 1], "sticks": [[0, 1], [1, 2], [2, 3]], "angles": [[0, 1, 2]],
         "velocities": [[0, 0, 1], [1, 0, 0], [0, 2, 0], [0, 0, -2]]}],
    "output": {"precision": "float64"}}
"""Gravity alone: runs, sticks and angles in free flight. Scenes made from it share one compiled frame loop."""


PRECISE = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"substeps": 4, "deformable_contact": "exact"},
    "effects": {"gravity": [0, 0, -9.81], "self_collision": True, "continuous_collision": True},
    "bodies": [
        {"kind": "cloth", "name": "sheet", "size": [0.6, 0.5], "resolution": [4, 3], "mass": 0.2, "position": [0, 0, 0.35]},
        {"kind": "rope", "name": "line", "start": [-0.4, 0, 0.5], "end": [0.4, 0.1, 0.5], "segments": 6, "mass": 0.1,
         "thickness": 0.02},
        {"kind": "box", "name": "block", "size": [0.15, 0.15, 0.15], "mass": 0.5, "position": [0, 0, 0.7], "velocity": [0, 0, -2]}],
    "colliders": [{"kind": "plane"}, {"kind": "box", "size": [0.2, 0.2, 0.3], "position": [0, 0, 0.15]}],
    "output": {"precision": "float64"}}
"""A cloth on a post, a rope and a block that fall on it: exact contact, and impacts along the step."""

CHAINS = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"order": "lines", "substeps": 6, "iterations": 2},
    "effects": {"gravity": [0, 1, -9.81], "contact": "none"},
    "bodies": [
        {"kind": "cloth", "name": "sheet", "size": [0.6, 0.5], "resolution": [4, 6], "mass": 0.2, "pinned": [0, 10]},
        {"kind": "rope", "name": "line", "start": [0, 0, 0], "end": [0.5, 0, 1], "segments": 9, "mass": 0.5, "compliance": 1e-4,
         "pinned": [0]},
        {"kind": "rope", "name": "strings", "start": [0, 0, 0], "end": [0, 0.5, 1], "segments": 4, "mass": 0.5, "count": 3,
         "scatter": {"inside": [[-2, -2, 2], [2, 2, 4]], "speed": [0, 3]}},
        {"kind": "particles", "name": "arm", "positions": [[0.5, 0, 1], [0.8, 0, 1], [0.8, 0.4, 1], [0.4, 0.4, 1.2], [1, 1, 1],
                                                           [2, 1, 1], [1, 2, 1]],
         "masses": [1, 2, 50, 1, 1, 1, 1], "sticks": [[0, 1], [1, 2], [2, 3], [4, 5], [5, 6], [6, 4]]}],
    "attachments": [["line", 9, "arm", 0]],
    "output": {"precision": "float64"}}
"""Everything that is solved as whole chains, and what is not: a ring of sticks and an attachment. Nothing touches."""


CRATE = {"kind": "box", "name": "crate", "size": [0.4, 0.4, 0.4], "mass": 2, "position": [5, 0, 0.2]}


def with_changes(scene, **changes):
    """A scene with some of its parts replaced; mappings are merged."""
    return scene | {key: scene[key] | value if isinstance(value, dict) else value for key, value in changes.items()}


def placed(scene):
    """The validated scene of a mapping, and its bodies at the start."""
    loaded = loads(json.dumps({"version": 1, **scene}), "scene.yaml")
    return loaded.scene, place(loaded.scene, loaded.folder, loaded.source)


def built(scene):
    """The model of a scene; its particles have no place yet."""
    return build(*placed(scene))


def started(scene):
    """The model of a scene at its start."""
    return start(built(scene))


def advanced(model, *sizes):
    """The next frames in chunks of these sizes: positions (F, N, 3), velocities or None, measures (F, M)."""
    parts = []
    for size in sizes:
        chunk = frames(model, size)
        status = run_chunk(model, chunk)
        assert status == 0, f"status {status}"
        parts.append(chunk)
    position, measures = np.concatenate([c.position for c in parts]), np.concatenate([c.measures for c in parts])
    velocity = None if parts[0].velocity is None else np.concatenate([c.velocity for c in parts])
    return position, velocity, measures


def copies_of(shape, copies, name="body"):
    """A body of so many copies, all at the same place at rest."""
    positions = np.repeat(shape.positions[None], copies, axis=0)
    return Body(name, shape, positions, np.zeros_like(positions), np.zeros(len(shape.positions), bool), (0.0, 0.0), 0.0)
