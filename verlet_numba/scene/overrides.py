"""`--set PATH=VALUE`: values laid over a document before it is validated.

PATH is dotted: keys of mappings, indices of lists, names of bodies and colliders. VALUE is YAML. Mappings that are not
there are made; one that stands for something when it is left out, as `effects` does for gravity, starts as that. The
document itself stays as it is: what lies along the path is copied.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from .messages import did_you_mean
from .problems import Path, Problem, SceneError, dotted
from .schema import Scene
from .schema_common import Part, entry_name
from .source import MappingMarks, Marks, Override, Source, compose, pack, unpack

SHOWN = 10          # names, at most, where one is not known


def override(source: Source, sets: Sequence[str]) -> tuple[Source, list[Problem]]:
    """The source with every `PATH=VALUE` laid over it, later ones over earlier ones, and what is wrong with them."""
    problems: list[Problem] = []
    for argument in sets:
        try:
            source, found = _apply(source, argument)
        except SceneError as error:
            found = error.problems
        problems += found
    return source, problems


@dataclass(frozen=True, eq=False)
class Given:
    """A value for `target`, a dotted path: as plain data with its marks, and where the target stands in what the user wrote."""

    target: str
    file: str               # what problems call the place: a file, or an option of the command line
    position: int           # packed, of the target
    data: Any
    marks: Marks


def lay_over(source: Source, given: Given) -> Source:
    """The source with one value laid over it. Raises SceneError if there is no such place."""
    words = given.target.split(".")
    steps, position = [], given.position
    for word in words:
        steps.append(_Step(word, position, given.file))
        position += len(word) + 1       # columns are the low bits
    data, laid = _lay(source.data, steps, (), _Laid((), given.data, given.marks))
    own = MappingMarks(given.position, {str(laid.path[-1]): laid.position}, {str(laid.path[-1]): laid.marks})
    placed = Override(laid.path, Source(given.file, "", laid.data, own))
    return replace(source, data=data, overrides=(*source.overrides, placed))


def _apply(source: Source, argument: str) -> tuple[Source, list[Problem]]:
    target, equals, text = argument.partition("=")
    name = f"--set {argument if argument.isprintable() else ascii(argument)}"
    if not equals or not text.strip() or "" in target.split("."):
        raise SceneError([Problem(name, 1, 1, "", "write PATH=VALUE, such as solver.substeps=4")])
    value, problems = compose(text, name, column=len(target) + 1)
    laid = lay_over(source, Given(target, name, pack(0, 0), value.data, value.marks))
    path = laid.overrides[-1].path
    full = (*path, *target.split(".")[len(path) :])
    return laid, [problem._replace(path=".".join(filter(None, (dotted(full), problem.path)))) for problem in problems]


@dataclass(frozen=True)
class _Step:
    """One word of PATH, at a packed position of what the user wrote."""

    word: str
    position: int
    file: str

    def failure(self, done: Path, message: str) -> SceneError:
        return SceneError([Problem(self.file, *unpack(self.position), ".".join(map(str, (*done, self.word))), message)])


@dataclass(frozen=True)
class _Laid:
    """What an override adds: `data` at `path`, its last key at a packed position of what the user wrote."""

    path: Path
    data: Any
    marks: Marks
    position: int = 0


def _lay(node: Any, steps: Sequence[_Step], done: Path, given: _Laid) -> tuple[Any, _Laid]:
    """A copy of `node`, which stands at `done`, with the given value `steps` further on; and what is new in it."""
    if not steps:
        return given.data, replace(given, path=done)
    step, rest = steps[0], steps[1:]
    key: str | int = step.word
    if node is None:
        inner, laid = _lay(None, rest, (), given)
        made = {**left_out(done), step.word: inner}
        return made, _Laid(done, made, MappingMarks(step.position, {step.word: step.position}, {step.word: laid.marks}))
    if isinstance(node, list):
        key = _index(node, step, done)
        inner, laid = _lay(node[key], rest, (*done, key), given)
        copy: Any = [*node[:key], inner, *node[key + 1 :]]
    elif isinstance(node, dict):
        inner, laid = _lay(node.get(step.word), rest, (*done, step.word), given)
        copy = {**node, step.word: inner}
    else:
        raise step.failure(done, "there is no such key: what stands above it is a single value")
    return copy, replace(laid, position=step.position) if len(laid.path) == len(done) + 1 else laid


def left_out(path: Path) -> dict[str, Any]:
    """What a mapping at this path stands for where a scene leaves it out, beside the defaults of its own keys."""
    default = Scene.model_fields[path[0]].default if len(path) == 1 and path[0] in Scene.model_fields else None
    return default.model_dump(mode="json", exclude_unset=True) if isinstance(default, Part) else {}


def _index(entries: list[Any], step: _Step, done: Path) -> int:
    """The index of a list's entry, given by number or, for bodies and colliders, by name."""
    if step.word.isascii() and step.word.isdigit():
        if len(step.word) > 9 or int(step.word) >= len(entries):
            raise step.failure(done, f"there is no entry {step.word[:20]}: the list has {len(entries)}, from 0")
        return int(step.word)
    names = [entry_name(entry, index) for index, entry in enumerate(entries)]
    if done in (("bodies",), ("colliders",)) and step.word in names:
        return names.index(step.word)
    known = [name for name in names if name is not None] if done in (("bodies",), ("colliders",)) else []
    there = f"; there are {', '.join(known[:SHOWN])}{' ...' if len(known) > SHOWN else ''}" if known else "; the list is empty"
    numbers = f"; its entries are 0 to {len(entries) - 1}" if entries and not known else there
    raise step.failure(done, "there is no such entry" + (did_you_mean(step.word, known) or numbers))
