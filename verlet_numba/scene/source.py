"""YAML text to plain data, with the line and column of every value.

The text is read by PyYAML's event parser (libyaml). The data are built here, because PyYAML's own construction follows
YAML 1.1 (`1e-3` is text there, `no` a boolean), lets a repeated key overwrite the first, recurses without bound and
drops the positions. Scalars follow the core schema of YAML 1.2.2, section 10.3.2. Aliases share one object and are
counted, never copied, so that a text which would expand without bound is refused at once.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import yaml

from .problems import MAX_PROBLEMS, Path, Problem, SceneError, dotted, shown

MAX_BYTES = 16 * 1024 * 1024
MAX_DEPTH = 32
MAX_NODES = 1_000_000
MAX_KEYS = 1000
MAX_EXPANDED = 250_000
"""Values that aliases may add to those written out."""

_WORDS = {"": None, "~": None, "null": None, "Null": None, "NULL": None,
          "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_DECIMAL = re.compile(r"[-+]?(?:[0-9]+(\.[0-9]*)?|(\.[0-9]+))([eE][-+]?[0-9]+)?\Z")        # groups: what no integer has
_BASED = re.compile(r"0(?:o[0-7]+|x[0-9a-fA-F]+)\Z")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)\Z|\.(?:nan|NaN|NAN)\Z")

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class MappingMarks(NamedTuple):
    """Positions within a mapping; every position is one packed integer, see `pack`."""

    start: int
    keys: dict[str, int]
    values: dict[str, "Marks"]


class SequenceMarks(NamedTuple):
    """Positions within a list."""

    start: int
    items: list["Marks"]


Marks = int | MappingMarks | SequenceMarks
"""Positions of a value and of all within it; a scalar has its own alone."""


@dataclass(frozen=True, eq=False)
class Override:
    """A value laid over the document at `path`. In `source` it stands under the last key of that path."""

    path: Path
    source: "Source"


@dataclass(frozen=True, eq=False)
class Source:
    """A document: its text, its plain data (overrides applied), and where each value stands."""

    name: str
    text: str
    data: Any
    marks: Marks
    overrides: tuple[Override, ...] = ()

    def where(self, path: Path, *, key: bool = False) -> tuple[int, int]:
        """Line and column, from 1, of the value at `path` (with `key`, of its key), else of what encloses it.

        They are those within the source that gave the value, which `problem` names.
        """
        source, inner = self._giver(path)
        return source._own_position(inner, key)

    def problem(self, path: Path, message: str, *, key: bool = False) -> Problem:
        """A finding about the value at `path` (or its key), placed in the file or in the override that gave it."""
        source, inner = self._giver(path)
        return Problem(source.name, *source._own_position(inner, key), dotted(path), message)

    def _giver(self, path: Path) -> tuple["Source", Path]:
        for override in reversed(self.overrides):
            depth = len(override.path)
            if path[:depth] == override.path:
                return override.source, path[depth - 1 :]
        return self, path

    def marked(self, path: Path) -> tuple[str, int, Marks]:
        """Name of the source that gave the value at `path`, packed position of the value's key, and the value's marks."""
        source, inner = self._giver(path)
        return source.name, *source._walk(inner)

    def _own_position(self, path: Path, key: bool) -> tuple[int, int]:
        position, marks = self._walk(path)
        return unpack(position if key else start_of(marks))

    def _walk(self, path: Path) -> tuple[int, Marks]:
        """Position of the key and marks of the value at `path`, else of what encloses it."""
        marks, position = self.marks, start_of(self.marks)
        for step in path:
            if isinstance(marks, MappingMarks) and str(step) in marks.keys:
                position, marks = marks.keys[str(step)], marks.values[str(step)]
            elif isinstance(marks, SequenceMarks) and isinstance(step, int) and 0 <= step < len(marks.items):
                marks = marks.items[step]
                position = start_of(marks)
            else:
                return start_of(marks), start_of(marks)
        return position, marks


def start_of(marks: Marks) -> int:
    """The packed position at which a value starts."""
    return marks if isinstance(marks, int) else marks.start


def pack(line: int, column: int) -> int:
    """A position (from 0) as one integer."""
    return line << 24 | column        # a line has at most MAX_BYTES = 2^24 columns


def unpack(position: int) -> tuple[int, int]:
    """Line and column, from 1, of a packed position."""
    return (position >> 24) + 1, (position & 0xFFFFFF) + 1


def read(path: str | FilePath) -> str:
    """The text of a file, at most 16 MB of UTF-8. Raises `SceneError`."""
    name = str(path)
    try:
        with open(path, "rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:        # ValueError: a name with a null byte
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError([Problem(name, 1, 1, "", f"cannot be read: {reason}")]) from None
    if len(content) > MAX_BYTES:
        raise SceneError([Problem(name, 1, 1, "", _TOO_LARGE)])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, column = _end_of(content[: error.start].decode("utf-8-sig"))
        message = f"byte 0x{content[error.start]:02x} is not UTF-8 text; save the file as UTF-8"
        raise SceneError([Problem(name, line + 1, column + 1, "", message)]) from None


_TOO_LARGE = f"larger than {MAX_BYTES // 1024**2} MB; move meshes into files of their own and name them with `file`"


def parse(text: str, name: str, *, column: int = 0) -> Source:
    """The document in `text`, whose first line starts at `column` (from 0) of what the user sees.

    Raises `SceneError`.
    """
    source, problems = compose(text, name, column=column)
    if problems:
        raise SceneError(problems)
    return source


def compose(text: str, name: str, *, column: int = 0) -> tuple[Source, list[Problem]]:
    """Like `parse`, but hands back what is wrong with single values, so that it can be told with all other findings.

    Raises `SceneError` where no data can be had: bad syntax, no or several documents, a bound exceeded.
    """
    composer = _Composer(name, column)
    try:
        if len(text) > MAX_BYTES or len(text.encode()) > MAX_BYTES:
            raise composer.failure(composer.at(0, 0), _TOO_LARGE)
        data, marks = composer.document(text)
    except UnicodeEncodeError as error:
        position = composer.at(*_end_of(text[: error.start]))
        raise composer.failure(position, "this character is not valid Unicode") from None
    except yaml.reader.ReaderError as error:
        position = composer.at(*_end_of(text.encode()[: error.position].decode("utf-8", "replace")))
        raise composer.failure(position, f"not YAML: {error.reason}") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = min((mark.line, mark.column), _end_of(text)) if mark else (0, 0)        # the end is never a new line
        raise composer.failure(composer.at(*place), _syntax(error)) from None
    return Source(name, text, data, marks), composer.problems


def _end_of(text: str) -> tuple[int, int]:
    """Line and column, from 0, of what follows `text`."""
    return text.count("\n"), len(text) - text.rfind("\n") - 1


def _syntax(error: yaml.MarkedYAMLError) -> str:
    """A syntax error in plain words."""
    message = f"not YAML: {error.problem or error.context or 'cannot be read'}"
    if error.context and error.context_mark:
        message += f" {error.context} that starts at line {error.context_mark.line + 1}"
    if "tab character" in message or "cannot start any token" in message:
        message += "; indent with spaces, not tabs, and put quotes around text that starts with a special character"
    return message


class _Anchored(NamedTuple):
    data: Any
    marks: Marks
    nodes: int        # values within, those of aliases counted again
    height: int       # levels of nesting within


class _Composer:
    """One pass over the events of a document."""

    def __init__(self, name: str, column: int) -> None:
        self.name, self.column = name, column
        self.problems: list[Problem] = []
        self.anchors: dict[str | None, _Anchored | None] = {}        # None: not complete yet
        self.nodes = self.expanded = self.deepest = 0

    def failure(self, position: int, message: str, path: Path = ()) -> SceneError:
        """The error that ends the reading, after what was found before it."""
        self.report(position, message, path)
        return SceneError(self.problems)

    def report(self, position: int, message: str, path: Path) -> None:
        self.problems.append(Problem(self.name, *unpack(position), dotted(path), message))
        if len(self.problems) == MAX_PROBLEMS:
            raise SceneError(self.problems)

    def at(self, line: int, column: int) -> int:
        """The packed position of a line and column (from 0) of the text."""
        return pack(line, column + self.column if line == 0 else column)

    def document(self, text: str) -> tuple[Any, Marks]:
        loader = _Loader(text)
        try:
            loader.get_event()                                # start of the stream
            if loader.check_event(yaml.StreamEndEvent):
                raise self.failure(self.at(0, 0), "empty: nothing but white space and comments stands here")
            loader.get_event()                                # start of the document
            data, marks = self.node(loader, loader.get_event(), (), 1)
            loader.get_event()                                # end of the document
            if not loader.check_event(yaml.StreamEndEvent):
                mark = loader.get_event().start_mark
                raise self.failure(self.at(mark.line, mark.column), "a second document starts here; only one is read")
        finally:
            loader.dispose()
        return data, marks

    def node(self, loader: Any, event: Any, path: Path, depth: int) -> tuple[Any, Marks]:
        """The value that starts with `event`, `depth` levels down."""
        position = self.at(event.start_mark.line, event.start_mark.column)
        self.nodes += 1
        self.deepest = max(self.deepest, depth)
        if self.nodes > MAX_NODES:
            raise self.failure(position, f"more than {MAX_NODES:,} values; move meshes into files of their own", path)
        if depth > MAX_DEPTH:
            raise self.failure(position, f"nested more than {MAX_DEPTH} levels deep", path)
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event.anchor, position, path, depth)
        if event.tag is not None:
            self.report(position, f"tags such as {shown(event.tag)} are not read; remove it", path)
        if event.anchor is None:
            return self.content(loader, event, position, path, depth)
        before, deepest = self.nodes, self.deepest
        self.anchors[event.anchor], self.deepest = None, depth
        data, marks = self.content(loader, event, position, path, depth)
        self.anchors[event.anchor] = _Anchored(data, marks, self.nodes - before + 1, self.deepest - depth)
        self.deepest = max(self.deepest, deepest)
        return data, marks

    def content(self, loader: Any, event: Any, position: int, path: Path, depth: int) -> tuple[Any, Marks]:
        if isinstance(event, yaml.ScalarEvent):
            return self.scalar(event, position, path), position
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(loader, position, path, depth)
        return self.mapping(loader, position, path, depth)

    def alias(self, anchor: str | None, position: int, path: Path, depth: int) -> tuple[Any, Marks]:
        if anchor not in self.anchors:
            raise self.failure(position, f"no anchor of the name {shown(anchor)} stands above this alias", path)
        anchored = self.anchors[anchor]
        if anchored is None:
            raise self.failure(position, f"the alias {shown(anchor)} stands within its own anchor", path)
        self.nodes += anchored.nodes - 1
        self.expanded += anchored.nodes
        self.deepest = max(self.deepest, depth + anchored.height)
        if self.expanded > MAX_EXPANDED:
            raise self.failure(position, f"aliases expand to more than {MAX_EXPANDED:,} values", path)
        if depth + anchored.height > MAX_DEPTH:
            raise self.failure(position, f"nested more than {MAX_DEPTH} levels deep", path)
        return anchored.data, anchored.marks

    def sequence(self, loader: Any, position: int, path: Path, depth: int) -> tuple[Any, Marks]:
        data: list[Any] = []
        items: list[Marks] = []
        while True:
            event = loader.get_event()
            if isinstance(event, yaml.SequenceEndEvent):
                return data, SequenceMarks(position, items)
            value, marks = self.node(loader, event, (*path, len(data)), depth + 1)
            data.append(value)
            items.append(marks)

    def mapping(self, loader: Any, position: int, path: Path, depth: int) -> tuple[Any, Marks]:
        data: dict[str, Any] = {}
        found = MappingMarks(position, {}, {})
        while True:
            event = loader.get_event()
            if isinstance(event, yaml.MappingEndEvent):
                return data, found
            key_position = self.at(event.start_mark.line, event.start_mark.column)
            key = self.key(loader, event, path, depth)
            value, marks = self.node(loader, loader.get_event(), (*path, key), depth + 1)
            if len(data) == MAX_KEYS:
                raise self.failure(key_position, f"more than {MAX_KEYS:,} keys in one mapping", path)
            if key in data:
                first, _ = unpack(found.keys[key])
                self.report(key_position, f"this key stands here a second time (first at line {first})", (*path, key))
            else:
                data[key], found.keys[key], found.values[key] = value, key_position, marks

    def key(self, loader: Any, event: Any, path: Path, depth: int) -> str:
        """The text of a key; one that is no text is reported."""
        value, marks = self.node(loader, event, path, depth + 1)
        if isinstance(value, str):
            return value
        self.report(start_of(marks), f"a key must be text, not {shown(value)}", path)
        return str(getattr(event, "value", "?"))

    def scalar(self, event: Any, position: int, path: Path) -> Any:
        text = event.value
        if not event.implicit[0]:        # quoted, a block, or tagged
            return text
        value = plain(text)
        if isinstance(value, str) and _NOT_FINITE.match(text):
            still = "; to hold a particle in place name it in `pinned`" if "nan" not in text.lower() else ""
            self.report(position, f"{text} is not a finite number{still}", path)
            return float(text.replace(".", ""))
        if isinstance(value, float) and math.isinf(value):
            self.report(position, f"{text[:40]} is too large a number", path)
        return value


def plain(text: str) -> str | int | float | bool | None:
    """What unquoted text means in YAML 1.2. Whole numbers that may exceed 64 bits become floats."""
    if text in _WORDS:
        return _WORDS[text]
    decimal = _DECIMAL.match(text)
    if decimal:
        return int(text) if decimal.lastindex is None and len(text) < 20 else float(text)
    if _BASED.match(text):
        return int(text[2:], 8 if text[1] == "o" else 16) if len(text) < 20 else math.inf
    return text
