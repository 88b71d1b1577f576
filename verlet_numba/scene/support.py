"""What a scene may say but this version does not do yet: refused where it stands, never ignored."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from .load import Loaded
from .problems import Path, Problem


class Missing(NamedTuple):
    """Values of one key, `*` for any entry of a list, that are not built yet."""

    path: str
    refused: Callable[[Any], bool]
    instead: str


def _named(value: Any) -> bool:
    return value is not None


_LEAVE_OUT = "leave the key out"

NOT_BUILT = (
    Missing("effects.bending", _named, _LEAVE_OUT),
)


def unsupported(loaded: Loaded) -> list[Problem]:
    """Every key written in the file or an override that asks for what is not built yet."""
    data = loaded.source.data
    return [loaded.source.problem(path, f"{_shown(path, value)} is not supported yet; {missing.instead}", key=True)
            for missing in NOT_BUILT for path, value in _matches(data, tuple(missing.path.split(".")), ())
            if missing.refused(value)]


def _shown(path: Path, value: Any) -> str:
    return f"{path[-1]}: {value}" if isinstance(value, str) else str(path[-1])


def _matches(node: Any, pattern: tuple[str, ...], done: Path) -> Iterator[tuple[Path, Any]]:
    """Paths and values in the document that a pattern names."""
    if not pattern:
        yield done, node
    elif pattern[0] == "*" and isinstance(node, list):
        for index, entry in enumerate(node):
            yield from _matches(entry, pattern[1:], (*done, index))
    elif isinstance(node, dict) and pattern[0] in node:
        yield from _matches(node[pattern[0]], pattern[1:], (*done, pattern[0]))
