"""A trajectory as one page that plays by itself: no server, no request, no library; drawn by WebGL2 in `page/`.

The page holds a header (JSON: names, colours, sizes, colliders) and one compressed block of arrays (`pack`), both as text
that no script can be hidden in. Its content policy lets nothing in or out: no request, and no script but its own, which it
knows by its hash.
"""

import base64
import hashlib
import html
import json
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.study import pack
from verlet_numba.study.measures import UNITS, measurable, measure
from verlet_numba.study.reader import Array, Trajectory
from verlet_numba.study.reader import open as open_trajectory
from verlet_numba.study.render import RenderError, View, choose
from verlet_numba.study.surfaces import COLLIDER, PALETTE, across, owners, placed, radii

SCRIPTS = ("decode", "matrix", "camera", "graphics", "motion", "stage", "chart", "player")      # joined in this order
SHADERS = ("mesh", "tube", "ball", "plane")         # each a .vert and a .frag
CHARTED = ("total_energy", "kinetic_energy", "potential_energy", "constraint_error_max")
FACETED = ("box", "icosahedron", "mesh")            # kinds drawn with flat faces
BUDGET = 24e6               # bytes of 16-bit positions in a page: 100 frames of a cloth of 200 x 200
BLOCK = 1 << 20             # coordinates read at once
CALM = 99.0                 # percentile of strain at which the colours end


class Page(NamedTuple):
    """What became of a trajectory."""

    frames: int         # in the page
    of: int             # in the file, or asked for
    every: int          # 1: all of them
    error: float        # m, of a coordinate at most
    size: int           # bytes


def view(path: str | Path, output: str | Path, frames: Sequence[int | slice] | None = None, budget: float = BUDGET) -> Page:
    """Write a page that plays a trajectory, or the frames asked for, to `output` (.html), and tell what is in it.

    Frames whose positions, 2 bytes a number, are more than `budget` bytes are thinned: every second is kept, or every third ...
    Raises RenderError for another suffix, a frame that does not exist or nothing to show, TrajectoryError for an
    unreadable file, OSError for an output that cannot be written.
    """
    output = Path(output)
    if output.suffix.lower() not in (".html", ".htm"):
        raise RenderError(f"{output}: cannot write {output.suffix or 'a file without suffix'}; use .html")
    with open_trajectory(path) as trajectory:
        if trajectory.particles == 0:
            raise RenderError(f"{path}: has no particles, so there is nothing to show")
        asked = choose(trajectory, frames, len(trajectory))
        every = max(1, -(-len(asked) * trajectory.particles * 6 // max(1, int(budget))))
        shown = asked[::every]
        try:
            header, arrays = contents(trajectory, shown)
        except (LookupError, TypeError, ValueError, ArithmeticError) as error:
            raise RenderError(f"{path}: cannot be shown, its scene or its numbers are damaged ({error!r})") from error
    header |= {"frames": len(shown), "every": every, "of": len(asked)}
    text = page(header, arrays)
    output.write_text(text, encoding="utf-8", newline="\n")
    return Page(len(shown), len(asked), every, header["error"], len(text.encode()))


def contents(trajectory: Trajectory, shown: list[int]) -> tuple[dict[str, Any], dict[str, Array]]:
    """Header and arrays of a page."""
    camera = View(trajectory, 560, 420)
    words = quantised(trajectory, shown)
    line_radius, dot_radius = radii(trajectory, camera.scale)
    listed = measurable(trajectory, CHARTED)
    header = {
        "title": str(trajectory.scene.get("name") or trajectory.path.stem), "file": trajectory.path.name,
        "low": words.low.tolist(), "step": words.step.tolist(), "error": words.error,
        "bodies": bodies(trajectory, line_radius, dot_radius),
        "colliders": colliders(camera), "measures": {name: UNITS[name] for name in listed},
        "strain": strain_scale(trajectory, shown), "strain_error": strain_error(trajectory, words.error),
        "camera": {"eye": camera.camera.eye.tolist(), "centre": camera.centre.tolist(), "scale": camera.scale}}
    arrays: dict[str, Array] = {
        "time": trajectory.time[shown].astype(np.float32),
        "position": pack.planes(pack.differences(words.words)),
        "triangles": trajectory.triangles.astype(np.uint32), "segments": segments(trajectory.lines),
        "dots": dots(trajectory), "pairs": trajectory.pairs.astype(np.uint32), "lengths": trajectory.lengths.astype(np.float32)}
    arrays |= {name: values[shown].astype(np.float32) for name, values in measure(trajectory, listed).items()}
    for number, (collider, triangles) in enumerate(zip(camera.colliders, camera.solids, strict=True)):
        points, corners = np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)
        arrays[f"points {number}"] = points.astype(np.float32)
        arrays[f"corners {number}"] = corners.reshape(-1, 3).astype(np.uint32)
        arrays[f"poses {number}"] = poses(collider, trajectory.time[shown])
    return header, arrays


def blocks(trajectory: Trajectory, shown: list[int]) -> Iterator[tuple[int, Array]]:
    """Positions (k, N, 3) of these frames piece by piece, with the place of the first."""
    most = max(1, BLOCK // (3 * trajectory.particles))
    for first in range(0, len(shown), most):
        yield first, trajectory.positions(shown[first:first + most])


def quantised(trajectory: Trajectory, shown: list[int]) -> pack.Quantised:
    """Positions of these frames as 16-bit words. ValueError if one is not finite."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, positions in blocks(trajectory, shown):
        low, high = np.minimum(low, positions.min(axis=(0, 1))), np.maximum(high, positions.max(axis=(0, 1)))
    if not (np.isfinite(low) & np.isfinite(high)).all():
        raise ValueError("a position is no finite number")
    words = np.empty((len(shown), trajectory.particles, 3), np.uint16)
    for first, positions in blocks(trajectory, shown):
        words[first:first + len(positions)] = pack.quantise(positions, low, high)
    return pack.Quantised(words, low, (high - low) / pack.LEVELS)


def strain_scale(trajectory: Trajectory, shown: list[int]) -> float:
    """The strain at which the colours end: few sticks in few frames have more."""
    if not len(trajectory.pairs):
        return 0.0
    i, j = trajectory.pairs.T
    rest = np.where(trajectory.lengths > 0, trajectory.lengths, np.inf)
    found = []
    for frame in shown[::max(1, len(shown) // 40)]:
        x = trajectory.positions(frame).astype(float)
        found.append(np.abs(np.linalg.norm(x[i] - x[j], axis=1) / rest - 1)[np.isfinite(rest)])
    strains = np.concatenate(found)
    return max(float(np.percentile(strains, CALM)), 1e-6) if strains.size else 0.0


def strain_error(trajectory: Trajectory, error: float) -> float:
    """What rounding both ends of a stick of middling length can make of its strain: either end moves by sqrt(3) errors at most."""
    lengths = trajectory.lengths[trajectory.lengths > 0]
    return float(2 * np.sqrt(3) * error / np.median(lengths)) if len(lengths) else 0.0


def bodies(trajectory: Trajectory, line_radius: Array, dot_radius: Array) -> list[dict[str, Any]]:
    """Of every body what the page draws it by."""
    return [{"name": body.name, "particles": body.particles, "colour": PALETTE[k % len(PALETTE)].tolist(),
             "faceted": body.kind in FACETED, "line": float(line_radius[k]),
             "dot": float((dot_radius if body.kind == "particles" else line_radius)[k])}
            for k, body in enumerate(trajectory.bodies)]


def segments(lines: list[Array]) -> Array:
    """(S, 2) the segments of polylines."""
    found = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
    return np.concatenate([np.zeros((0, 2), np.uint32), *found]).astype(np.uint32)


def dots(trajectory: Trajectory) -> Array:
    """(D,) particles drawn as balls: those of point masses, and where lines bend. Balls of one body are of one size."""
    loose = np.array([body.kind == "particles" for body in trajectory.bodies], bool)[owners(trajectory)]
    bends = np.concatenate([np.zeros(0, np.int64), *trajectory.lines])
    return np.union1d(np.flatnonzero(loose), bends).astype(np.uint32)


def colliders(camera: View) -> list[dict[str, Any]]:
    """Of every collider its colour and its flat sides, in its own axes; sides are unbounded where their half sizes are null."""
    return [{"kind": collider["kind"], "colour": COLLIDER, "sides": sides(collider)} for collider in camera.colliders]


def sides(collider: dict[str, Any]) -> list[dict[str, Any]]:
    """The plane of a plane, the six walls of a room seen from inside (u x v points there); none of solids."""
    if collider["kind"] == "plane":
        normal = np.array(collider.get("normal", (0, 0, 1)), float)
        u, v = across(normal / np.linalg.norm(normal))
        return [{"origin": [0, 0, 0], "u": u.tolist(), "v": v.tolist(), "half": None}]
    if collider["kind"] != "room":
        return []
    half, found = 0.5 * np.array(collider["size"], float), []
    for axis in range(3):
        for sign in (-1, 1):
            first, second = (axis + 1) % 3, (axis + 2) % 3
            u, v = np.eye(3)[first], -sign * np.eye(3)[second]
            found.append({"origin": (sign * half * np.eye(3)[axis]).tolist(), "u": u.tolist(), "v": v.tolist(),
                          "half": [half[first], half[second]]})
    return found


def poses(collider: dict[str, Any], time: Array) -> Array:
    """(F, 12) rotation (row by row) and origin of a collider, or (1, 12) of one that stands still."""
    moves = collider.get("path") or collider.get("spin")
    found = [placed(collider, float(moment)) for moment in (time if moves else time[:1])]
    return np.array([[*place.rotation.ravel(), *place.origin] for place in found], np.float32)


def page(header: dict[str, Any], arrays: dict[str, Array]) -> str:
    """The whole page as text."""
    folder = files("verlet_numba.study").joinpath("page")

    def read(name: str) -> str:
        return folder.joinpath(name).read_text(encoding="utf-8")

    listed, data = pack.block(arrays)
    light = read("light.glsl")
    shaders = {f"{name}.{stage}": read(f"{name}.{stage}").replace("#include light", light)
               for name in SHADERS for stage in ("vert", "frag")}
    script = "\n".join(['(() => {\n"use strict";', f"const SHADERS = {json.dumps(shaders)};",
                        *(read(f"{name}.js") for name in SCRIPTS), "})();"])
    told = json.dumps(header | {"arrays": listed}, allow_nan=False).replace("<", "\\u003c")     # no </script> inside
    return fill(read("page.html"), {
        "title": html.escape(header["title"]), "style": read("style.css"), "script": script,
        "hash": base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        "header": told, "data": base64.b64encode(data).decode()})


def fill(template: str, parts: dict[str, str]) -> str:
    """A template with its {{marks}} replaced, each once: what is put in is not looked through."""
    pieces = template.split("{{")
    return pieces[0] + "".join(parts[name] + rest for name, _, rest in (piece.partition("}}") for piece in pieces[1:]))
