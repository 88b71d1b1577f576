"""Where a run goes on: what stands in its trajectory file, and which checkpoint fits it."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py

from verlet_numba.run import checkpoint
from verlet_numba.run.checkpoint import Checkpoint
from verlet_numba.run.summary import Summary
from verlet_numba.scene.load import resolved
from verlet_numba.scene.schema import Scene

READABLE = (OSError, KeyError, ValueError, RuntimeError, TypeError, AttributeError)     # what h5py raises on what is none


class ResumeError(ValueError):
    """What cannot be gone on with, and why."""


@dataclass(frozen=True)
class Found:
    """A trajectory that an earlier process has begun."""

    frames: int                 # committed
    planned: int
    status: str
    scene: dict[str, Any]       # as resolved
    timing: dict[str, Any]
    measures: dict[str, float]  # of all frames: relaxations in total, the largest of the other observables; empty without them


def find(path: Path) -> Found:
    """Read what a trajectory file tells of itself. Raises ResumeError if it is none."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            frames = int(file["VTKHDF/Steps"].attrs["NSteps"])
            told = {name: bytes(file[f"provenance/{name}"][()]) for name in ("status", "scene", "timing")}
            taken = {"relaxations": "sum", "contacts": "max", "constraint_error_max": "max", "penetration_max": "max"}
            measures = {name: getattr(file[f"observables/{name}/value"][:frames], how)().item()
                        for name, how in taken.items() if frames and name in file["observables"]}
            if "constraint_error_max" in measures:
                measures["constraint_error_end"] = float(file["observables/constraint_error_max/value"][frames - 1])
            return Found(frames, len(file["VTKHDF/Steps/PointOffsets"]), told["status"].rstrip(b"\0").decode(),
                         json.loads(told["scene"]), json.loads(told["timing"]), measures)
    except READABLE as error:
        raise ResumeError(f"{path} is no trajectory to go on with; give another file with -o, or --overwrite ({error})") from error


def hold_against(path: Path, found: Found, scene: Scene, total: int) -> None:
    """Raise ResumeError where the file is of another scene, or planned for another number of frames."""
    difference = first_difference(found.scene, json.loads(json.dumps(resolved(scene))))
    if difference is not None:
        raise ResumeError(f"{path} is of another scene: {difference}; give another file with -o, or --overwrite")
    if found.planned != total:
        raise ResumeError(f"{path} is planned for {found.planned} frames, not for {total}; "
                          "give the same --frames, another file with -o, or --overwrite")


def first_difference(there: Any, here: Any, path: str = "") -> str | None:
    """The first key, in words, in which two scenes as plain data differ; None if there is none."""
    pairs: Iterable[tuple[Any, Any, Any]] = ()
    if isinstance(there, dict) and isinstance(here, dict):
        pairs = ((key, there.get(key), here.get(key)) for key in there | here)
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        pairs = ((number, a, b) for number, (a, b) in enumerate(zip(there, here, strict=True)))
    elif there != here:
        return f"{path} is {brief(there)} there, {brief(here)} here"
    found = (first_difference(a, b, f"{path}.{key}".lstrip(".")) for key, a, b in pairs)
    return next((words for words in found if words is not None), None)


def brief(value: Any, most: int = 60) -> str:
    """A value as JSON, cut where it becomes long."""
    text = json.dumps(value)
    return text if len(text) <= most else text[:most - 3] + "..."


def ended(path: Path, found: Found, scene: Scene) -> Summary:
    """The summary of a run that has come to its end before, from its file; without observables it has no extremes."""
    last, chunks = max(0, found.frames - 1), found.timing.get("chunks", {})
    return Summary(str(path), found.frames, last * scene.solver.substeps, last / scene.time.frame_rate, found.status,
                   seconds=found.timing.get("phases", {}), resumed_at=found.frames,
                   chunks=list(zip(*(chunks.get(name, []) for name in ("frames", "simulate", "write")), strict=True)),
                   **found.measures)      # type: ignore[arg-type]  # counts are whole numbers in the file


def usable(path: Path, found: Found, origin: dict[str, str]) -> Checkpoint | None:
    """The newest whole checkpoint. Raises ResumeError if it is of another simulation, or of other versions of the program."""
    newest = checkpoint.newest(path, found.frames)
    if newest is None or newest.origin == origin:
        return newest
    place = checkpoint.names(path)[0]
    told = [f"{name} {newest.origin.get(name)} instead of {here}" for name, here in origin.items()
            if name in ("numba", "verlet-numba") and newest.origin.get(name) != here]
    if newest.origin.get("kernels") != origin["kernels"] or told:
        raise ResumeError(f"{place} was made by another version of the program ({', '.join(told) or 'its kernels differ'}); "
                          "go on with that one, or start anew with --overwrite")
    raise ResumeError(f"{place} is of another start: a file that the scene names has changed, or how it is read; "
                      "start anew with --overwrite")
