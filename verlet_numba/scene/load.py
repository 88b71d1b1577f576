"""A scene file becomes a validated scene, or a list of everything that is wrong with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from . import messages, relations
from .overrides import override
from .problems import MAX_PROBLEMS, Problem, SceneError
from .schema import Scene
from .source import Source, compose, read


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scene, the document it came from, and the folder that the files it names are relative to."""

    scene: Scene
    source: Source
    folder: Path


def load(path: str | Path, sets: Sequence[str] = ()) -> Loaded:
    """The scene in a file, with `PATH=VALUE` overrides. Raises `SceneError` with every problem."""
    return loads(read(path), str(path), sets)


def loads(text: str, name: str, sets: Sequence[str] = ()) -> Loaded:
    """The scene in `text`; `name` is what problems call it. Raises `SceneError` with every problem."""
    return validate(*compose(text, name), sets)


def validate(source: Source, problems: Sequence[Problem] = (), sets: Sequence[str] = ()) -> Loaded:
    """The scene that a document with overrides says, where `problems` were found already. Raises `SceneError` with all."""
    if source.data is None:
        raise SceneError([source.problem((), "empty: nothing but white space and comments stands here")])
    if not isinstance(source.data, dict):
        raise SceneError([*problems, source.problem((), "a scene is a mapping: `version: 1`, `time: ...` and so on")])
    if {"scene", "parameters"} <= source.data.keys():
        raise SceneError([source.problem(("scene",), "this is a sweep, not a scene; use `verlet-numba sweep`", key=True)])
    source, more = override(source, sets)
    found = [*problems, *more]
    scene = None
    try:
        scene = Scene.model_validate(source.data)
    except ValidationError as error:
        found += islice(messages.problems(error, source), MAX_PROBLEMS)
    found += (source.problem(path, message) for path, message in relations.findings(source.data, scene))
    if found or scene is None:
        raise SceneError(in_order(found, source))
    return Loaded(scene, source, Path(source.name).parent)


def in_order(problems: Sequence[Problem], source: Source) -> list[Problem]:
    """In the order of the file, overrides last; of several about one value the first alone, which caused the others."""
    first: dict[tuple[object, ...], Problem] = {}
    for problem in problems:
        first.setdefault(problem[:4], problem)
    return sorted(first.values(), key=lambda problem: (problem.file != source.name, problem[:3]))


def resolved(scene: Scene) -> dict[str, Any]:
    """The scene as plain data with every default filled in; loads again as the same scene."""
    return scene.model_dump(mode="json", by_alias=True)


def json_schema() -> dict[str, Any]:
    """JSON Schema of scene files: every key, its description, bounds and default."""
    schema: dict[str, Any] = _bounded(Scene.model_json_schema(by_alias=True))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


_BOUNDS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}


def _bounded(node: Any) -> Any:
    """The schema with the bounds that pydantic leaves under its own names, behind a converter, under those of JSON Schema."""
    if isinstance(node, list):
        return [_bounded(item) for item in node]
    if not isinstance(node, dict):
        return node
    renamed = {key: value for key, value in node.items() if key not in _BOUNDS}
    renamed |= {_BOUNDS[key]: value for key, value in node.items() if key in _BOUNDS}
    return {key: _bounded(value) for key, value in renamed.items()}
