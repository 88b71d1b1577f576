"""The scenes that are measured, and the way from one to a prepared scene."""

import json
from typing import Any

from verlet_numba.scene.load import loads
from verlet_numba.scene.place import place
from verlet_numba.scene.prepare import Prepared

FALL = {"gravity": [0, 0, -9.81]}
ROPE = {"kind": "rope", "name": "line", "start": [0, 0, 0], "end": [1, 0, 0], "segments": 50, "mass": 0.1, "pinned": [0]}


def scene_of(*bodies: dict[str, Any], solver: dict[str, Any] | None = None, effects: dict[str, Any] | None = None,
             colliders: tuple[dict[str, Any], ...] = (), duration: float = 1.0) -> dict[str, Any]:
    """A scene as a mapping; in JSON it is a scene file. duration [s]; 60 frames/s."""
    return {"version": 1, "time": {"duration": duration, "frame_rate": 60}, "solver": solver or {},
            "effects": FALL if effects is None else effects, "bodies": list(bodies), "colliders": list(colliders)}


def cloth(side: int, copies: int = 1, **more: Any) -> dict[str, Any]:
    """Cloth of side x side particles and all diagonals; copies of it without overlap."""
    body = {"kind": "cloth", "name": "sheet", "size": [1, 1], "resolution": [side, side], "mass": 0.2, "thickness": 0.001, **more}
    return body if copies == 1 else body | scattered(copies, 10.0)


def icosahedra(copies: int) -> dict[str, Any]:
    """Icosahedra of 12 particles and 36 sticks."""
    return {"kind": "icosahedron", "name": "dice", "radius": 0.1, "mass": 1} | scattered(copies, 0.5 * copies ** (1 / 3))


def scattered(copies: int, reach: float) -> dict[str, Any]:
    """So many copies in a cube of edge 2 `reach` [m]."""
    return {"count": copies, "scatter": {"inside": [[-reach] * 3, [reach] * 3]}}


def prepared(scene: dict[str, Any]) -> Prepared:
    """A mapping as `run` would prepare its file, without the scene doctor."""
    loaded = loads(json.dumps(scene), "scene.yaml")
    return Prepared(loaded, place(loaded.scene, loaded.folder, loaded.source), [])
