"""Where two trajectories part."""

from typing import NamedTuple

import numpy as np

from verlet_numba.study.measures import BLOCK_NUMBERS
from verlet_numba.study.reader import Array, Body, Trajectory


class Difference(NamedTuple):
    """The first frame in which two trajectories differ, and the first particle that does; `reason` where no particle shows it."""

    reason: str = ""
    frame: int = 0
    time: float = 0.0           # s
    body: str = ""
    copy: int | None = None
    particle: int = 0           # of that copy of the body
    distance: float = 0.0       # m

    def __str__(self) -> str:
        if self.reason:
            return self.reason
        copy = "" if self.copy is None else f", copy {self.copy}"
        return (f"frame {self.frame}, {self.time:.6g} s: body {self.body}{copy}, particle {self.particle}: "
                f"{self.distance:.6g} m apart")


def compare(a: Trajectory, b: Trajectory, tolerance: float = 0.0) -> Difference | None:
    """The first frame, body and particle where two trajectories differ by more than `tolerance` m; None if they do not.

    They also differ if their bodies, their frames' times or the number of their frames do.
    """
    if reason := different_bodies(a, b):
        return Difference(reason)
    common = min(a.frames, b.frames)
    most = max(1, BLOCK_NUMBERS // max(1, 3 * a.particles))
    for first in range(0, common, most):
        frames = slice(first, min(first + most, common))
        if found := first_difference(a, b, frames, tolerance):
            return found
    if a.frames != b.frames:
        return Difference(f"{a.path} has {a.frames} frames and {b.path} has {b.frames}; the first {common} agree")
    return None


def different_bodies(a: Trajectory, b: Trajectory) -> str:
    """How the bodies of two trajectories differ; empty if they do not."""
    if a.particles != b.particles:
        return f"{a.path} has {a.particles} particles and {b.path} has {b.particles}"
    for one, other in zip(a.bodies, b.bodies, strict=False):
        if one[:4] != other[:4]:
            return f"{a.path} has {shown(one)} where {b.path} has {shown(other)}"
    return "" if len(a.bodies) == len(b.bodies) else f"{a.path} has {len(a.bodies)} bodies and {b.path} has {len(b.bodies)}"


def shown(body: Body) -> str:
    return f"body {body.name} ({body.kind} of {body.particles} particles from {body.first_particle} on)"


def first_difference(a: Trajectory, b: Trajectory, frames: slice, tolerance: float) -> Difference | None:
    """The first difference within some frames."""
    distance = np.linalg.norm(a.positions(frames).astype(float) - b.positions(frames), axis=2)
    apart = ~(distance <= tolerance)
    late = a.time[frames] != b.time[frames]
    wrong = np.flatnonzero(apart.any(axis=1) | late)
    if not len(wrong):
        return None
    row = int(wrong[0])
    frame = frames.start + row
    if late[row]:
        return Difference(f"frame {frame} is at {a.time[frame]:.9g} s in {a.path} and at {b.time[frame]:.9g} s in {b.path}")
    particle = int(np.argmax(apart[row]))
    return Difference("", frame, float(a.time[frame]), *whose(a.bodies, particle), float(distance[row, particle]))


def whose(bodies: list[Body], particle: int) -> tuple[str, int | None, int]:
    """Name of the body, number of the copy if it has several, and number within it, of a particle of the file."""
    firsts: Array = np.array([body.first_particle for body in bodies])
    body = bodies[int(np.searchsorted(firsts, particle, side="right")) - 1]
    name, _, copy = body.name.partition(".")
    return name, int(copy) if copy else None, particle - body.first_particle
