"""Which runs a sweep has: every point laid over the scene, validated, named and grouped, before anything runs.

A run's id is a hash of its scene as resolved, all defaults filled in, and of the mesh files that it names. So points that come
to the same scene are one run, and a sweep that is started again knows what it has. What made a result (`program`) is not part
of the id: it stands in the result.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ValidationError

from verlet_numba._version import __version__
from verlet_numba.batch.document import Document
from verlet_numba.batch.sample import Choice, points
from verlet_numba.scene.load import Loaded, in_order, resolved, validate
from verlet_numba.scene.overrides import Given, lay_over
from verlet_numba.scene.problems import MAX_PROBLEMS, Problem, SceneError
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.source import Source, start_of
from verlet_numba.study.sweep_folder import FORMAT

ID = 16             # hexadecimal digits of an id
ENOUGH = 20         # points with mistakes, after which no more are looked at


class Run(NamedTuple):
    """One run: the values of the parameters, and the group of those that may be simulated together with it."""

    id: str
    values: tuple[Any, ...]
    group: str


@dataclass(frozen=True, eq=False)
class Plan:
    """A sweep, ready to be run."""

    document: Document
    runs: list[Run]
    points: int             # before equal ones fell together

    @property
    def parameters(self) -> list[str]:
        return list(self.document.sweep.parameters)

    def overrides(self, run: Run) -> tuple[str, ...]:
        """What makes the scene this run's, as `--set` takes it."""
        return tuple(f"{path}={json.dumps(value, ensure_ascii=False)}"
                     for path, value in zip(self.parameters, run.values, strict=True))

    def as_dict(self) -> dict[str, Any]:
        """What is kept in the sweep's folder."""
        sweep = self.document.sweep
        return {"format": FORMAT, "program": __version__, "scene": self.document.scene.name, "scene_text": self.document.scene.text,
                "sets": list(self.document.sets), "method": sweep.way, "samples": sweep.samples, "seed": sweep.seed,
                "parameters": self.parameters, "measures": list(sweep.measures), "points": self.points,
                "runs": [{"id": run.id, "group": run.group, "values": list(run.values)} for run in self.runs]}


def plan(document: Document) -> Plan:
    """Every run of a sweep in order. Raises SceneError with what is wrong with any of them, where the sweep says it."""
    whole = {path for path in document.sweep.parameters if takes_whole_numbers(document, path)}
    digests = Digests()
    runs: dict[str, Run] = {}
    problems: list[Problem] = []
    wrong = total = 0
    for point in points(document.sweep, whole):
        total += 1
        try:
            loaded = scene_at(document, point)
        except SceneError as error:
            problems += error.problems
            wrong += 1
            if wrong == ENOUGH:
                break
        else:
            data = resolved(loaded.scene)
            name = digests.name(data, loaded)
            runs.setdefault(name, Run(name, tuple(choice.value for choice in point), group_of(data)))
    if problems:
        raise SceneError(in_order(problems[:MAX_PROBLEMS], document.source))
    return Plan(document, list(runs.values()), total)


def given(document: Document, path: str, choice: Choice) -> Given:
    """A choice as a value to lay over the scene, placed where the sweep states it."""
    file, position, _ = document.source.marked(("parameters", path))
    marks = document.source.marked(choice.place)[2]
    return Given(path, file, position, choice.value, marks if choice.place[2:] else start_of(marks))


def laid(document: Document, point: Sequence[Choice]) -> Source:
    source = document.scene
    for path, choice in zip(document.sweep.parameters, point, strict=True):
        source = lay_over(source, given(document, path, choice))
    return source


def scene_at(document: Document, point: Sequence[Choice]) -> Loaded:
    """The scene of a point. Raises SceneError."""
    loaded = validate(laid(document, point))
    problems = list(unreadable(loaded))
    if problems:
        raise SceneError(problems)
    return loaded


def takes_whole_numbers(document: Document, path: str) -> bool:
    """Whether a range with whole ends is over a key that takes nothing else, such as substeps: asked of the schema by a half."""
    parameter = document.sweep.parameters[path]
    if parameter.min is None or not (parameter.min.is_integer() and float(parameter.max or 0.5).is_integer()):
        return False
    half = parameter.min + 0.5
    try:
        Scene.model_validate(lay_over(document.scene, given(document, path, Choice(half, ("parameters", path)))).data)
    except ValidationError as error:
        return any(line["type"] in ("int_type", "int_from_float") and line["input"] == half for line in error.errors())
    except SceneError:
        return False
    return False


def mesh_files(loaded: Loaded) -> Iterator[tuple[tuple[str | int, ...], Path]]:
    """Path in the scene and path on the disk of every file that it names."""
    for key in ("bodies", "colliders"):
        for index, entry in enumerate(getattr(loaded.scene, key)):
            if file := getattr(entry, "file", None):
                yield (key, index, "file"), loaded.folder / file


def unreadable(loaded: Loaded) -> Iterator[Problem]:
    for path, file in mesh_files(loaded):
        if not file.is_file():
            yield loaded.source.problem(path, f"there is no file {file}")


class Digests:
    """Names of runs; each mesh file is read once."""

    def __init__(self) -> None:
        self.files: dict[Path, str] = {}

    def name(self, data: Mapping[str, Any], loaded: Loaded) -> str:
        digest = hashlib.sha256(json.dumps(data, sort_keys=True, allow_nan=False, separators=(",", ":")).encode())
        for _, file in mesh_files(loaded):
            if file not in self.files:
                self.files[file] = hashlib.sha256(file.read_bytes()).hexdigest()
            digest.update(self.files[file].encode())
        return digest.hexdigest()[:ID]


def group_of(data: Mapping[str, Any]) -> str:
    """Runs of one group have equal topology, time, output and solver settings, and differ in decimal numbers and the seed alone.

    Whole numbers (counts, resolutions, particle numbers) and words are topology, and so is whether a quantity is zero: drag of
    zero is not compiled. Components of vectors are values alone.
    """
    shape = {key: value if key in ("time", "solver", "output") else _shape(value) for key, value in data.items()
             if key not in ("seed", "name", "expect", "reference")}
    return hashlib.sha256(json.dumps(shape, sort_keys=True).encode()).hexdigest()[:ID]


def _shape(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: value != 0.0 if isinstance(value, float) else _shape(value) for key, value in node.items()}
    if isinstance(node, list):
        return [None if isinstance(value, float) else _shape(value) for value in node]
    return node

