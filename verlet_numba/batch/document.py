"""A sweep as the user wrote it, a file or options of the command line, becomes a validated sweep or a list of its mistakes.

Options are laid over the document as overrides are over scenes, so that every mistake is told where it stands: in the file at
its line and column, or in the option.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from verlet_numba.batch.schema import Sweep
from verlet_numba.scene import messages
from verlet_numba.scene.load import in_order
from verlet_numba.scene.overrides import override
from verlet_numba.scene.problems import MAX_PROBLEMS, Problem, SceneError
from verlet_numba.scene.source import MappingMarks, Marks, Override, SequenceMarks, Source, compose, pack, plain, read

RANGE = re.compile(r"\s*([-+.\deE]+)\s*:\s*([-+.\deE]+)\s*(?::\s*(\w+)\s*)?\Z")       # MIN:MAX, MIN:MAX:log


@dataclass(frozen=True, eq=False)
class Document:
    """A sweep, where all of it stands, and the document of its scene with the fixed overrides laid over it."""

    sweep: Sweep
    source: Source
    scene: Source
    sets: tuple[str, ...]


def read_document(path: Path, vary: Sequence[str] = (), sets: Sequence[str] = (),
                  options: Mapping[str, Any] | None = None) -> Document:
    """The sweep in a file, or of a scene file; `vary`: PATH=SPEC, `options`: method, samples, seed, measures over the file's own.

    Raises SceneError with every problem.
    """
    text = read(path)
    source, problems = compose(text, str(path))
    if not (isinstance(source.data, dict) and {"scene", "parameters"} & source.data.keys()):
        source = Source(str(path), text, {"version": 1, "scene": path.name}, MappingMarks(0, {}, {}))
        problems = []
    for key, value in (options or {}).items():
        if value not in (None, []):
            source = _option(source, key, value)
    for argument in vary:
        try:
            source = _vary(source, argument)
        except SceneError as error:
            problems += error.problems
    sweep = _validated(source, problems)
    scene, found = _scene(path.parent / sweep.scene, source, path, sets)
    if found:
        raise SceneError(found)
    return Document(sweep, source, scene, tuple(sets))


def _validated(source: Source, problems: list[Problem]) -> Sweep:
    if not source.data.get("parameters"):
        message = "nothing is varied: name keys of the scene, by --vary PATH=SPEC or in a sweep file under `parameters`"
        raise SceneError([*problems, source.problem(("parameters",), message)])
    sweep = None
    try:
        sweep = Sweep.model_validate(source.data)
    except ValidationError as error:
        problems += islice(messages.problems(error, source, Sweep), MAX_PROBLEMS)
    if problems or sweep is None:
        raise SceneError(in_order(problems, source))
    return sweep


def _scene(file: Path, source: Source, path: Path, sets: Sequence[str]) -> tuple[Source, list[Problem]]:
    """The scene's document under the fixed overrides, and what is wrong with either."""
    try:
        text = source.text if file == path else read(file)
    except SceneError as error:
        return source, [source.problem(("scene",), f"{problem.file} {problem.message}") for problem in error.problems]
    scene, problems = compose(text, str(file))
    scene, more = override(scene, sets)
    return scene, [*problems, *more]


def _option(source: Source, key: str, value: Any) -> Source:
    """The sweep with a key set by an option of the command line."""
    name = "--measure" if key == "measures" else f"--{key}"
    given = Source(name, "", {key: value}, MappingMarks(0, {key: 0}, {key: 0}))
    return replace(source, data={**source.data, key: value}, overrides=(*source.overrides, Override((key,), given)))


def _vary(source: Source, argument: str) -> Source:
    """The sweep with one more parameter, PATH=SPEC: values 1,2,3 (YAML), a range 0.1:0.9, or 0.1:10:log."""
    target, equals, text = argument.partition("=")
    name = f"--vary {argument if argument.isprintable() else ascii(argument)}"
    if not equals or not text.strip() or "" in target.split("."):
        raise SceneError([Problem(name, 1, 1, "", "write PATH=SPEC, such as bodies.crate.mass=1,2,3 or =0.1:0.9 or =0.1:10:log")])
    data, marks = _spec(text, name, len(target) + 1)
    own = MappingMarks(0, {target: pack(0, 0)}, {target: marks})
    parameters = source.data.get("parameters")
    laid = {**(parameters if isinstance(parameters, dict) else {}), target: data}
    placed = Override(("parameters", target), Source(name, argument, {target: data}, own))
    return replace(source, data={**source.data, "parameters": laid}, overrides=(*source.overrides, placed))


def _spec(text: str, name: str, column: int) -> tuple[dict[str, Any], Marks]:
    """A SPEC that starts at a column as a sweep file would have it."""
    found = RANGE.match(text)
    if found and all(isinstance(plain(end), int | float) for end in found.groups()[:2]):
        low, high, law = found.groups()
        if law not in (None, "log"):
            raise SceneError([Problem(name, 1, column + found.start(3) + 1, "", f"a range is MIN:MAX or MIN:MAX:log, not :{law}")])
        places = {"min": pack(0, column + found.start(1)), "max": pack(0, column + found.start(2))}
        data = {"min": plain(low), "max": plain(high), "distribution": "log_uniform" if law else "uniform"}
        return data, MappingMarks(pack(0, column), places, dict(places))
    listed, problems = compose(f"[{text}]", name, column=column - 1)
    if problems or not isinstance(listed.data, list):
        raise SceneError(problems)
    marks = listed.marks.items if isinstance(listed.marks, SequenceMarks) else []
    at = pack(0, column)
    return {"values": listed.data}, MappingMarks(at, {"values": at}, {"values": SequenceMarks(at, marks)})
