"""What stands in a trajectory file before its first frame, from a scene and its bodies."""

import json
import platform
from collections.abc import Iterable
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from itertools import accumulate
from pathlib import Path

import numpy as np

from verlet_numba._version import __version__
from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.world import (
    ANGULAR,
    CENTRE,
    CONTACTS,
    ERROR_MAX,
    ERROR_RMS,
    FALLBACKS,
    KINETIC,
    MOMENTUM,
    PENETRATION,
    POTENTIAL,
    RELAXATIONS,
    RESTING,
    SPEED_MAX,
    TOTAL,
)
from verlet_numba.run.layout import FORMAT, BodyTable, Contents, Quantity
from verlet_numba.scene.body import Body, Integers
from verlet_numba.scene.build import Model
from verlet_numba.scene.load import resolved
from verlet_numba.scene.plan import plan
from verlet_numba.scene.prepare import Prepared

LIBRARIES = ("numba", "numpy", "h5py", "llvmlite")
OBSERVABLES: dict[str, tuple[int, Quantity]] = {
    "kinetic_energy": (KINETIC, Quantity("J", 1, "f8")),
    "potential_energy": (POTENTIAL, Quantity("J", 1, "f8")),
    "total_energy": (TOTAL, Quantity("J", 1, "f8")),
    "momentum": (MOMENTUM, Quantity("kg m s-1", 3, "f8")),
    "angular_momentum": (ANGULAR, Quantity("kg m2 s-1", 3, "f8")),
    "centre_of_mass": (CENTRE, Quantity("m", 3, "f8")),
    "constraint_error_max": (ERROR_MAX, Quantity("1", 1, "f8")),
    "constraint_error_rms": (ERROR_RMS, Quantity("1", 1, "f8")),
    "penetration_max": (PENETRATION, Quantity("m", 1, "f8")),
    "contacts": (CONTACTS, Quantity("1", 1, "i8")),
    "relaxations": (RELAXATIONS, Quantity("1", 1, "i8")),
    "fallbacks": (FALLBACKS, Quantity("1", 1, "i8")),
    "resting": (RESTING, Quantity("1", 1, "i8")),
    "speed_max": (SPEED_MAX, Quantity("m s-1", 1, "f8")),
}


def observables(measures: Array) -> dict[str, Array]:
    """The columns of (F, M) measures under their names."""
    columns = {name: measures[:, first:first + quantity.width] for name, (first, quantity) in OBSERVABLES.items()}
    return {name: column if column.shape[1] == 3 else column[:, 0] for name, column in columns.items()}


def contents(prepared: Prepared, model: Model, command: str) -> Contents:
    """Everything about the file of this scene that is known before the run."""
    bodies, output = prepared.bodies, prepared.scene.output
    firsts = first_particles(bodies)
    copies = [(body, firsts[b] + k * len(body.shape.positions)) for b, body in enumerate(bodies) for k in range(body.copies)]
    return Contents(
        particles=sum(body.copies * len(body.shape.positions) for body in bodies),
        pairs=stacked((first + body.shape.sticks for body, first in copies), 2),
        lengths=np.concatenate([np.zeros(0), *(body.shape.lengths for body, _ in copies)]),
        lines=[first + line for body, first in copies for line in body.shape.lines],
        polygons=stacked((first + body.shape.triangles for body, first in copies), 3),
        bodies=body_table(bodies),
        observables={name: quantity for name, (_, quantity) in OBSERVABLES.items()} if output.observables else {},
        provenance=provenance(prepared, model, command),
        fields=("position", *output.fields),
        dtype={"float32": "f4", "float64": "f8"}[output.precision],
        precision_bits=output.precision_bits)


def first_particles(bodies: list[Body]) -> list[int]:
    """Number in the file of each body's first particle."""
    return [0, *accumulate(body.copies * len(body.shape.positions) for body in bodies)][:-1]


def stacked(parts: Iterable[Integers], width: int) -> Integers:
    return np.concatenate([np.zeros((0, width), np.int64), *parts])


def copy_names(body: Body) -> list[str]:
    """A body's name, and for several copies the name with the number of the copy."""
    return [body.name] if body.copies == 1 else [f"{body.name}.{k}" for k in range(body.copies)]


def body_table(bodies: list[Body]) -> BodyTable:
    """One row a copy, in scene order."""
    each = [body for body in bodies for _ in range(body.copies)]
    particles = np.array([len(body.shape.positions) for body in each], np.int64)
    faces = np.array([len(body.shape.triangles) for body in each], np.int64)
    return BodyTable(name=[name for body in bodies for name in copy_names(body)], kind=[body.shape.kind for body in each],
                     first_particle=np.cumsum(particles) - particles, particles=particles,
                     first_face=np.cumsum(faces) - faces, faces=faces,
                     mass=np.array([body.shape.masses.sum() for body in each]))


def provenance(prepared: Prepared, model: Model, command: str) -> dict[str, str | int | float]:
    """Where a file comes from: enough to make it again."""
    return {"scene_text": prepared.loaded.source.text, "folder": str(prepared.loaded.folder.resolve()),
            "scene": json.dumps(resolved(prepared.scene)), "command": command,
            "seed": prepared.scene.seed, "versions": json.dumps(versions()), "cpu": cpu(),
            "plan": json.dumps(plan(prepared, model)), "start": now()}


@cache
def versions() -> dict[str, str | int]:
    """Versions of the program, of its files, of Python and the libraries."""
    return {"verlet-numba": __version__, "format": FORMAT, "python": platform.python_version(),
            **{name: version(name) for name in LIBRARIES}}


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


@cache
def cpu() -> str:
    """The processor's name, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
