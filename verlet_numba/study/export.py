"""A trajectory in other formats: PC2 (all frames in one file), OBJ and PLY (a numbered file a frame); USD in `usd`.

Metres, z up, particles in the order of the trajectory in every format, so that point n is particle n.
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from verlet_numba.study import reader
from verlet_numba.study.reader import Array, Trajectory
from verlet_numba.study.render import RenderError, choose
from verlet_numba.study.surfaces import PALETTE, owners

SEQUENCES = (".obj", ".ply")
USD = (".usdc", ".usda", ".usd")
SUFFIXES = (*USD, ".pc2", *SEQUENCES)


class ExportError(Exception):
    """A file that cannot be made; one line says why and what to do."""


class Part(NamedTuple):
    """A body: its particles first ... end - 1, and what joins them, by numbers of the trajectory."""

    name: str
    first: int
    end: int
    triangles: Array        # (F, 3)
    lines: list[Array]
    points: Array           # (P,) on no line and no triangle


def export(path: str | Path, output: str | Path, frames: Sequence[int | slice] | None = None,
           overwrite: bool = False) -> list[Path]:
    """Write the frames asked for, all by default, in the format that `output` ends in, and return the files.

    NAME.obj stands for NAME_0000.obj, NAME_0001.obj ... (the frames' numbers), NAME.ply likewise. Raises ExportError for
    another suffix, frames that do not exist or that PC2 cannot hold, a missing package and files that exist;
    TrajectoryError for an unreadable file, OSError for what cannot be written.
    """
    output = Path(output)
    suffix = output.suffix.lower()
    if suffix not in SUFFIXES:
        raise ExportError(f"{output}: cannot write {suffix or 'a file without suffix'}; use {', '.join(SUFFIXES)}")
    with reader.open(path) as trajectory:
        try:
            chosen = choose(trajectory, frames, len(trajectory))
        except RenderError as error:
            raise ExportError(str(error)) from error
        files = numbered(output, chosen) if suffix in SEQUENCES else [output]
        there = [file for file in files if file.exists()]
        if there and not overwrite:
            raise ExportError(f"{there[0]} exists already; give another with -o, or --overwrite")
        try:
            if suffix in USD:
                from verlet_numba.study.usd import write_usd
                write_usd(trajectory, chosen, output)
            elif suffix == ".pc2":
                write_pc2(trajectory, chosen, output)
            else:
                write = {".obj": write_obj, ".ply": write_ply}[suffix]
                for frame, file in zip(chosen, files, strict=True):
                    write(trajectory, trajectory.positions(frame), frame, file)
        except ImportError as error:
            raise ExportError(f"{output}: needs {error.name or error}: pip install 'verlet-numba[usd]'") from error
        except (LookupError, TypeError) as error:
            raise ExportError(f"{path}: cannot be exported, its scene or its numbers are damaged ({error!r})") from error
    return files


def numbered(output: Path, frames: list[int]) -> list[Path]:
    """NAME_0000.SUFFIX ... with as many digits as the largest number has, four at least."""
    digits = max(4, len(str(max(frames))))
    return [output.with_name(f"{output.stem}_{frame:0{digits}d}{output.suffix}") for frame in frames]


def parts(trajectory: Trajectory) -> Iterator[Part]:
    """Bodies in the order of the scene."""
    owner = owners(trajectory)
    of_triangle = owner[trajectory.triangles[:, 0]]
    of_line = [int(owner[line[0]]) for line in trajectory.lines]
    for number, body in enumerate(trajectory.bodies):
        yield Part(body.name, body.first_particle, body.first_particle + body.particles,
                   trajectory.triangles[of_triangle == number],
                   [line for line, of in zip(trajectory.lines, of_line, strict=True) if of == number],
                   trajectory.vertices[owner[trajectory.vertices] == number])


def frame_rate(trajectory: Trajectory) -> float:
    """Frames a second: the scene's, or what the times tell."""
    told = trajectory.scene.get("time", {}).get("frame_rate")
    time = trajectory.time
    return float(told or (round((len(time) - 1) / (time[-1] - time[0]), 6) if len(time) > 1 and time[-1] > time[0] else 1.0))


def write_obj(trajectory: Trajectory, positions: Array, frame: int, file: Path) -> None:
    """Wavefront OBJ: an object a body; faces, polylines, points. It knows no units and no axes: a comment tells them."""
    lines = [f"# {trajectory.path.name}, frame {frame}, {trajectory.time[frame]:.9g} s; metres, z up"]
    for part in parts(trajectory):
        lines.append(f"o {part.name.replace(' ', '_')}")
        lines += ["v {:.9g} {:.9g} {:.9g}".format(*point) for point in positions[part.first:part.end].tolist()]
        lines += ["f {} {} {}".format(*corners) for corners in (part.triangles + 1).tolist()]      # counted from 1
        lines += ["l " + " ".join(map(str, (line + 1).tolist())) for line in part.lines]
        lines += [f"p {point}" for point in (part.points + 1).tolist()]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def write_ply(trajectory: Trajectory, positions: Array, frame: int, file: Path) -> None:
    """Binary PLY: vertices with their body's number and colour, triangles, and lines as edges."""
    owner = owners(trajectory)
    kind = positions.dtype.newbyteorder("<")
    vertex = np.zeros(len(positions), [("position", kind, 3), ("colour", "u1", 3), ("body", "<i4")])
    vertex["position"], vertex["body"] = positions, owner
    vertex["colour"] = np.rint(255 * PALETTE[owner % len(PALETTE)])
    face = np.zeros(len(trajectory.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    face["count"], face["corners"] = 3, trajectory.triangles
    edges = np.concatenate([np.zeros((0, 2), "<i4"), *(np.stack([line[:-1], line[1:]], 1) for line in trajectory.lines)])
    real = {4: "float", 8: "double"}[kind.itemsize]
    head = ["ply", "format binary_little_endian 1.0",
            f"comment {trajectory.path.name}, frame {frame}, {trajectory.time[frame]:.9g} s; metres, z up",
            f"element vertex {len(vertex)}", *(f"property {real} {axis}" for axis in "xyz"),
            *(f"property uchar {colour}" for colour in ("red", "green", "blue")), "property int body",
            f"element face {len(face)}", "property list uchar int vertex_indices"]
    if len(edges):
        head += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"]
    text = "\n".join([*head, "end_header"]) + "\n"
    file.write_bytes(text.encode("ascii", "replace") + vertex.tobytes() + face.tobytes() + edges.astype("<i4").tobytes())


def write_pc2(trajectory: Trajectory, frames: list[int], file: Path) -> None:
    """PC2 point cache: a header of 32 bytes, then (samples, points, 3) float32, all little-endian.

    "POINTCACHE2\\0", int32 version 1, int32 points, float32 first frame, float32 frames a sample, int32 samples.
    """
    steps = np.unique(np.diff(frames))
    if len(steps) > 1 or (len(steps) and steps[0] < 1):
        raise ExportError(f"{file}: PC2 holds frames at equal distances alone; choose FIRST:END:STEP")
    stride = int(steps[0]) if len(steps) else 1
    with file.open("wb") as out:
        out.write(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, trajectory.particles, frames[0], stride, len(frames)))
        for frame in frames:
            out.write(trajectory.positions(frame).astype("<f4").tobytes())
