"""From a scene file to bodies in their places: everything that can be refused is refused here."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from verlet_numba.scene.body import Body
from verlet_numba.scene.doctor import examine
from verlet_numba.scene.load import Loaded, load
from verlet_numba.scene.place import place
from verlet_numba.scene.problems import Problem
from verlet_numba.scene.schema import Scene


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene that can run, its bodies, and what the scene doctor has to say about it."""

    loaded: Loaded
    bodies: list[Body]
    warnings: list[Problem]

    @property
    def scene(self) -> Scene:
        return self.loaded.scene


def prepare(path: str | Path, sets: Sequence[str] = ()) -> Prepared:
    """Load, validate and place a scene. Raises SceneError with every problem, each at its line and column."""
    loaded = load(path, sets)
    bodies = place(loaded.scene, loaded.folder, loaded.source)
    return Prepared(loaded, bodies, examine(loaded.scene, bodies, loaded.folder, loaded.source))
