"""What tests share: the fixture `simulate`, a scene's run in memory."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from verlet_numba.frame import OK
from verlet_numba.run.contents import observables
from verlet_numba.run.engine import run_chunk, start
from verlet_numba.scene.build import build, frames
from verlet_numba.scene.load import Loaded, loads
from verlet_numba.scene.place import place
from verlet_numba.scene.plan import frame_count

SCENES = Path(__file__).parent.parent / "scenes"
IN_FULL = {"output.precision": "float64", "output.fields": ["velocity"],
           "expect": []}        # tests have bounds of their own, and may shorten a run


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--validate", action="store_true", help="also run what takes minutes (marked `validate`)")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if not config.getoption("--validate"):
        long = pytest.mark.skip(reason="takes minutes: pytest --validate")
        for item in items:
            if "validate" in item.keywords:
                item.add_marker(long)


@dataclass(frozen=True)
class Trajectory:
    """A run: T frames of N particles in the order of the scene, in double precision."""

    time: np.ndarray                    # (T,) s
    position: np.ndarray                # (T, N, 3) m
    velocity: np.ndarray                # (T, N, 3) m/s
    measures: Mapping[str, np.ndarray]  # (T,) or (T, 3), the observables under their names
    masses: np.ndarray                  # (N,) kg


@pytest.fixture(scope="session")
def simulate() -> Callable[..., Trajectory]:
    """simulate(scene, {path: value, ...}): a scene as text, as plain data, or as a Path below scenes/, with overrides.

    Every run has velocities and double precision, so that all share one compiled form. Fails if the run diverges.
    """
    return run


def run(scene: str | Mapping[str, Any] | Path, overrides: Mapping[str, Any] | None = None) -> Trajectory:
    loaded = load(scene, {**IN_FULL, **(overrides or {})})
    model = start(build(loaded.scene, place(loaded.scene, loaded.folder, loaded.source), loaded.folder))
    chunk = frames(model, frame_count(loaded.scene))
    assert run_chunk(model, chunk) == OK, f"{loaded.source.name} diverged"
    assert chunk.velocity is not None
    time = np.arange(len(chunk.position)) / loaded.scene.time.frame_rate
    return Trajectory(time, chunk.position, chunk.velocity, observables(chunk.measures), model.world.observed.mass)


def load(scene: str | Mapping[str, Any] | Path, overrides: Mapping[str, Any]) -> Loaded:
    path = SCENES / scene if isinstance(scene, Path) else Path("scene.yaml")
    if isinstance(scene, Path):
        text = path.read_text(encoding="utf-8")
    else:
        text = scene if isinstance(scene, str) else json.dumps(scene)
    return loads(text, str(path), [f"{key}={json.dumps(value)}" for key, value in overrides.items()])
