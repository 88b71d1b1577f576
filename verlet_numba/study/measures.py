"""Measures of a run from its trajectory file alone.

Of the whole scene the recorded observables are taken where the file has them: double precision, and velocities over
substeps. Everything else comes from positions, in `from_positions`: a body alone, a file without observables, and what is
never recorded. `source` tells which. Without recorded velocities those are central differences of frames, which see
neither impacts nor what moves faster than a frame. Only a run can count contacts, relaxations, fallbacks and bodies at rest,
and only a run knows how deep bodies are in each other: positions tell how deep particles are in colliders.

Frames are read in pieces of bounded size, so that memory does not grow with the file.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.scene.schema import COUNTED
from verlet_numba.study.from_positions import COMPUTED, Block, Part, part_of
from verlet_numba.study.reader import Array, Trajectory, TrajectoryError

UNITS = {
    "kinetic_energy": "J", "potential_energy": "J", "total_energy": "J", "momentum": "kg m/s", "angular_momentum": "kg m²/s",
    "centre_of_mass": "m", "constraint_error_max": "", "constraint_error_rms": "", "penetration_max": "m", "contacts": "",
    "relaxations": "", "fallbacks": "", "resting": "", "speed_max": "m/s", "rest_time": "s", "orientation_flips": "",
    "self_intersections": "", "outside": "m"}
"""Every measure and its unit, in the order in which they are told."""

VECTORS = ("momentum", "angular_momentum", "centre_of_mass")
AXES = "xyz"
COSTLY = ("self_intersections",)
USUAL = tuple(name for name in UNITS if name not in COSTLY)
SLOW = 0.01                     # m/s: below this all is at rest
BLOCK_NUMBERS = 1_000_000       # coordinates of a piece of frames
RECORDED, POSITIONS, COLLIDERS = "recorded", "positions", "positions, in colliders alone"


class MeasureError(ValueError):
    """A measure that cannot be taken of a file or a body; one line says why."""


def measure(trajectory: Trajectory, names: Sequence[str] = USUAL, body: str | None = None,
            recorded: bool = True) -> dict[str, Array]:
    """Measures of every committed frame: name -> (T,), of vectors (T, 3); `rest_time` is one value, inf if there is no rest.

    `body`: of a body alone, all its copies, or of the copy NAME.K. `recorded`: False takes nothing but positions.
    Raises MeasureError for what cannot be measured, TrajectoryError for a damaged file.
    """
    sources = {name: source(trajectory, name, body, recorded) for name in names}
    wanted = dict.fromkeys("speed_max" if name == "rest_time" else name for name in names)
    found = {name: trajectory.observables[name] for name in wanted if source(trajectory, name, body, recorded) == RECORDED}
    computed = [name for name in wanted if name not in found]
    if computed:
        found |= from_positions(trajectory, computed, body)
    if "rest_time" in sources:
        found["rest_time"] = np.asarray(rest_time(trajectory.time, found["speed_max"]))
    return {name: found[name] for name in names}


def measurable(trajectory: Trajectory, names: Iterable[str], body: str | None = None, recorded: bool = True) -> list[str]:
    """Those of the names that this file, or a body in it, has."""
    return [name for name in names if not _missing(trajectory, name, body, recorded)]


def source(trajectory: Trajectory, name: str, body: str | None = None, recorded: bool = True) -> str:
    """Where a measure comes from: RECORDED, POSITIONS or COLLIDERS. Raises MeasureError if it cannot be taken."""
    if reason := _missing(trajectory, name, body, recorded):
        raise MeasureError(f"{trajectory.path}: {reason}")
    kept = "speed_max" if name == "rest_time" else name
    if body is None and recorded and kept in trajectory.observables:
        return RECORDED
    return COLLIDERS if name == "penetration_max" else POSITIONS


def _missing(trajectory: Trajectory, name: str, body: str | None, recorded: bool) -> str:
    """Why a measure cannot be taken; empty if it can."""
    if name not in UNITS:
        return f"there is no measure {name!r}; there are {', '.join(UNITS)}"
    if name in COUNTED and body is not None:
        return f"{name} is counted for the whole scene, not for a body"
    if name in COUNTED and not (recorded and name in trajectory.observables):
        return f"{name} is known only where a run records its observables"
    if name == "penetration_max" and not (body is None and recorded and name in trajectory.observables):
        meshes = [told.get("name") for told in trajectory.scene.get("colliders", ()) if told.get("kind") == "mesh"]
        if meshes:
            return f"{name} cannot be computed: the triangles of {meshes[0]} stand in a file of their own"
    return ""


def from_positions(trajectory: Trajectory, names: Iterable[str], body: str | None) -> dict[str, Array]:
    """Measures computed frame by frame from positions."""
    part = part_of(trajectory, body)
    if part is None:
        known = ", ".join(dict.fromkeys(entry.name.split(".")[0] for entry in trajectory.bodies)) or "no bodies"
        raise MeasureError(f"{trajectory.path}: there is no body {body!r}; there are {known}")
    functions: Mapping[str, Callable[[Part, Block], Any]] = {name: COMPUTED[name] for name in names}
    pieces: dict[str, list[Array]] = {name: [np.zeros((0, 3) if name in VECTORS else 0)] for name in functions}
    for block in blocks(trajectory, part.particles):
        for name, function in functions.items():
            pieces[name].append(np.asarray(function(part, block), float))
    return {name: np.concatenate(rows) for name, rows in pieces.items()}


class Span(NamedTuple):
    """Frames first ... end - 1, and the frames low ... high - 1 that their velocities are differences of."""

    first: int
    end: int
    low: int
    high: int


def blocks(trajectory: Trajectory, particles: slice) -> Iterator[Block]:
    """A trajectory in pieces: positions and velocities of these particles in double precision."""
    most = max(1, BLOCK_NUMBERS // max(1, 3 * trajectory.particles))
    for first in range(0, trajectory.frames, most):
        end = min(first + most, trajectory.frames)
        span = Span(first, end, max(0, min(first - 1, trajectory.frames - 3)), min(trajectory.frames, max(end + 1, 3)))
        velocity = trajectory.velocities(slice(first, end))
        if velocity is None:
            position, velocity = differences(trajectory, particles, span)
        else:
            position = trajectory.positions(slice(first, end))[:, particles].astype(float)
            velocity = velocity[:, particles].astype(float)
        yield Block(trajectory.time[first:end], position, velocity)


def differences(trajectory: Trajectory, particles: slice, span: Span) -> tuple[Array, Array]:
    """Positions of a span and their time derivatives, to second order at the ends too; 0 where there is one frame alone."""
    position = trajectory.positions(slice(span.low, span.high))[:, particles].astype(float)
    count, part = span.high - span.low, slice(span.first - span.low, span.end - span.low)
    if count < 2:
        return position[part], np.zeros_like(position[part])
    time = trajectory.time[span.low:span.high]
    if not (np.diff(time) > 0).all():
        raise TrajectoryError(f"{trajectory.path}: damaged: its times do not rise")
    velocity: Array = np.gradient(position, time, axis=0, edge_order=2 if count > 2 else 1)
    return position[part], velocity[part]


def rest_time(time: Array, speed: Array) -> float:
    """First time (s) after which the largest speed stays below SLOW; inf if it does not."""
    moving = np.flatnonzero(~(speed < SLOW))
    if not len(moving):
        return float(time[0]) if len(time) else np.inf
    return float(time[moving[-1] + 1]) if moving[-1] + 1 < len(time) else np.inf


def parted(name: str) -> tuple[str, int | None]:
    """A measure and which component of it a name means: `centre_of_mass.z` number 2, `centre_of_mass` none."""
    whole, dot, axis = name.partition(".")
    return whole, AXES.index(axis) if dot else None


def numbers(values: Array, component: int | None = None) -> Array:
    """A measure as numbers (T,) or (1,): of vectors (T, 3) a component, or their length."""
    if component is not None:
        return values[:, component]
    return np.linalg.norm(values, axis=1) if values.ndim == 2 else np.atleast_1d(values)
