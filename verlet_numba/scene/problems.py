"""What is wrong with a scene, and where: one `Problem` a finding, all of them in one `SceneError`."""

from collections.abc import Iterable
from typing import NamedTuple

Path = tuple[str | int, ...]
"""Where a value stands in a document: keys of mappings and indices of lists, outermost first."""


MAX_PROBLEMS = 1000
"""As many are told at once; a file with more is no scene."""


class Problem(NamedTuple):
    """One finding. `line` and `column` count from 1; `path` is dotted, as `--set` takes it, empty for all of it."""

    file: str
    line: int
    column: int
    path: str
    message: str

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}:{self.column}"
        return f"{where}: {self.path}: {self.message}" if self.path else f"{where}: {self.message}"


class SceneError(ValueError):
    """A scene that cannot be used; `problems` names every reason, in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems: list[Problem] = list(problems)
        super().__init__("\n".join(map(str, self.problems)))


def dotted(path: Path) -> str:
    """The path as users write it: `bodies.0.mass`."""
    return ".".join(step if isinstance(step, str) and step.isprintable() and len(step) <= 60 else shown(step)
                    for step in path)


def shown(value: object) -> str:
    """A value as it stands in YAML, in short and on one line."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return ascii(value if len(value) <= 40 else value[:37] + "...")
    if isinstance(value, int | float):
        return f"{value:.15g}"
    return "a list" if isinstance(value, list | tuple) else "a mapping"


def one_line(error: Exception) -> str:
    """An error without its traceback, in one line. Those of the program and of the system need no name of their class."""
    words = " ".join(str(error).split())
    plain = isinstance(error, OSError | ValueError) or type(error).__module__.startswith("verlet_numba.")
    return words if plain and words else f"{type(error).__name__}: {words}"
