"""Pydantic's errors as findings in plain words: which value, what is wrong with it, what to do."""

import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from .problems import Path, Problem, shown
from .schema import Scene
from .schema_bodies import BODIES
from .schema_colliders import COLLIDERS
from .schema_common import Finding
from .source import Source

_KINDS: dict[str, Mapping[str, type[BaseModel]]] = {"bodies": BODIES, "colliders": COLLIDERS}
_WANTED = {
    "float_type": "a number", "int_type": "a whole number", "int_from_float": "a whole number",
    "bool_type": "true or false", "string_type": "text", "tuple_type": "a list", "model_type": "a mapping",
    "model_attributes_type": "a mapping", "dict_type": "a mapping"}
_BOUNDS = {
    "greater_than": ("gt", "must be above"), "greater_than_equal": ("ge", "must be at least"),
    "less_than": ("lt", "must be below"), "less_than_equal": ("le", "must be at most")}


def problems(error: ValidationError, source: Source, model: type[BaseModel] = Scene) -> Iterator[Problem]:
    """Every error of a validated scene, or of another document's `model`, placed in the document."""
    for line in error.errors(include_url=False):
        if line["type"] == "extra_forbidden":
            yield source.problem(_path(line["loc"]), _unknown(line["loc"], model), key=True)
        elif not _follows(line):
            for path, message in _findings(line, model):
                yield source.problem(path, message)


OTHER_NAMES = {"center": "position", "centre": "position", "origin": "position", "location": "position", "static": "fixed"}
"""What other programs call some keys."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """` (did you mean 'x'?)`, or nothing if no known word is near."""
    known = list(known)
    near = [OTHER_NAMES[word]] if OTHER_NAMES.get(word) in known else get_close_matches(
        word, known, n=1, cutoff=0.6) if len(word) <= 60 else []
    return f" (did you mean '{near[0]}'?)" if near else ""


def one_of(word: object, known: Iterable[str]) -> str:
    """That `word` is none of the known ones."""
    known = list(known)
    hint = did_you_mean(word, known) if isinstance(word, str) else ""
    if len(known) == 1:
        return f"must be {known[0]}, not {shown(word)}"
    return f"{shown(word)} is not one of {', '.join(known)}{hint}"


def _findings(line: Any, model: type[BaseModel]) -> Iterator[Finding]:
    where, path = line["loc"], _path(line["loc"])
    kind, value, context = line["type"], line["input"], line.get("ctx", {})
    if kind == "findings":
        for inner, message in context["findings"]:
            yield (*path, *inner), message
    elif kind == "missing":
        yield _missing(where, path, model)
    elif kind == "union_tag_invalid":
        yield (*path, "kind"), f"kind {one_of(context['tag'], _quoted(context['expected_tags']))}"
    elif kind == "union_tag_not_found":
        yield path, f"needs a `kind`: one of {', '.join(_KINDS[str(where[0])])}"
    else:
        yield path, _about(kind, value, context, path, line["msg"])


def _unknown(where: Path, root: type[BaseModel]) -> str:
    known = _keys(where[:-1], root)
    return "unknown key" + (did_you_mean(str(where[-1]), known) or f"; known here: {', '.join(known)}")


def _follows(line: Any) -> bool:
    """Whether an error only follows from another: a default of wrong values, a list short of its wrong entries."""
    return line["type"] == "default_factory_not_called" or (line["type"] == "too_short" and bool(line["input"]))


def _about(kind: str, value: Any, context: Mapping[str, Any], path: Path, fallback: str) -> str:
    """What is wrong with one value."""
    if value is None and kind in _WANTED:
        return f"nothing stands here, where {_WANTED[kind]} belongs; write it, or leave the key out"
    if kind in _WANTED:
        return f"must be {_WANTED[kind]}, not {shown(value)}"
    if kind in _BOUNDS:
        key, words = _BOUNDS[kind]
        return f"{words} {context[key]:.15g}, not {shown(value)}{_instead(path, value)}"
    if kind == "literal_error":
        return one_of(value, _quoted(context["expected"]) or [context["expected"]])
    if kind == "finite_number":
        return f"must be a finite number{_instead(path, 0)}"
    if kind == "too_long":
        return f"has {context['actual_length'] or 'too many'} entries; at most {context['max_length']} are possible"
    if kind in ("too_short", "string_too_short"):
        return "must not be empty"
    if kind == "string_too_long":
        return f"is longer than {context['max_length']} characters"
    if kind == "string_pattern_mismatch":
        return f"{shown(value)} cannot be a name: no dots, slashes, = or spaces, and not a mere number"
    return fallback


def _instead(path: Path, value: Any) -> str:
    keys = [step for step in path if isinstance(step, str)]
    if keys and keys[-1] in ("mass", "masses", "density") and value <= 0:
        return "; to hold a body or particle in place use `pinned` or `fixed: true`"
    return ""


def _missing(where: Path, path: Path, root: type[BaseModel]) -> Finding:
    if isinstance(where[-1], int):
        return path[:-1], f"is too short: item {where[-1]} (counted from 0) is missing"
    model = _model(where[:-1], root)
    field = next((f for k, f in model.model_fields.items() if (f.alias or k) == where[-1]), None) if model else None
    about = f" ({field.description})" if field is not None and field.description else ""
    return path, f"is missing{about}"


def _path(where: Path) -> Path:
    """The path in the document: without the names that pydantic puts in for the members of unions."""
    steps = where[:2] + where[3:] if len(where) > 2 and where[0] in _KINDS else where
    return tuple(step for step in steps if not re.fullmatch(r"<\w+>", str(step)))


def _model(where: Path, root: type[BaseModel]) -> type[BaseModel] | None:
    """The model of the mapping at pydantic's location; None if no mapping belongs there."""
    model: type[BaseModel] | None = root
    for depth, step in enumerate(where):
        if depth == 2 and where[0] in _KINDS:
            model = _KINDS[str(where[0])].get(str(step))
        elif model is not None and isinstance(step, str) and step in model.model_fields:
            model = _model_in(model.model_fields[step].annotation) or model
    return model


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((found for part in get_args(annotation) if (found := _model_in(part))), None)


def _keys(where: Path, root: type[BaseModel]) -> list[str]:
    model = _model(where, root)
    return [field.alias or key for key, field in model.model_fields.items()] if model else []


def _quoted(text: str) -> list[str]:
    return re.findall(r"'([^']*)'", text)
