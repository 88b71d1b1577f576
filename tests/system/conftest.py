"""What the tests of the command line share: `verlet` runs it, `mixed` is a scene of every kind of body and its run."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import pytest

MIXED = """\
version: 1
name: mixed
time: {duration: 0.495, frame_rate: 60}     # 29.7 frames: rounded to 30
solver: {substeps: 2}
seed: 3
bodies:
  - {kind: box, name: crate, size: [0.4, 0.2, 0.6], mass: 1.0, position: [0, -3, 0.5]}
  - {kind: cloth, name: sheet, size: [1.2, 0.6], resolution: [4, 3], mass: 0.24, position: [0, 3, 0.8], pinned: corners}
  - {kind: icosahedron, name: dice, radius: 0.1, mass: 1.2, count: 3, scatter: {inside: [[2, -2, 0.3], [5, 2, 2]]}}
  - {kind: rope, name: line, start: [-1, 0, 1], end: [1, 0, 1], segments: 5, mass: 0.6, pinned: ends}
  - {kind: box, name: lid, size: [0.4, 0.2, 0.6], mass: 2.0, position: [2, -3, 0.5]}
  - kind: particles
    name: dots
    positions: [[-3, 0, 1], [-3, 0, 1.5], [-4, 0, 2]]
    masses: [1, 2, 3]
    velocities: [[0, 0, 0], [0, 0, 0], [1, 2, 3]]
    sticks: [[0, 1]]
effects: {gravity: [0, 0, -9.81], contact: none}        # what meets compiles for minutes
output: {fields: [velocity]}
"""


class Mixed(NamedTuple):
    """The scene above and the trajectory that `verlet-numba run` made of it, in a folder of their own."""

    folder: Path
    scene: Path
    trajectory: Path


@pytest.fixture(scope="session")
def verlet() -> Callable[..., subprocess.CompletedProcess[str]]:
    """verlet(*arguments, code=0, program=None, ...): the command line in a process of its own.

    Asserts the exit code and that no traceback is shown. `program`: how to start it, `python -m verlet_numba` if left
    out; the rest goes to `subprocess.run`.
    """
    return run_program


def run_program(*arguments: object, code: int = 0, program: list[str] | None = None,
                **options: Any) -> subprocess.CompletedProcess[str]:
    command = [*(program or [sys.executable, "-m", "verlet_numba"]), *map(str, arguments)]
    done = subprocess.run(command, **{"capture_output": True, "text": True, "timeout": 300, **options})
    assert done.returncode == code, f"{command}\n{done.stdout}\n{done.stderr}"
    assert "--debug" in command or "Traceback" not in done.stdout + done.stderr
    return done


@pytest.fixture(scope="session")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Mixed:
    folder = tmp_path_factory.mktemp("mixed")
    scene = folder / "scene.yaml"
    scene.write_text(MIXED, encoding="utf-8")
    run_program("run", scene, cwd=folder)
    return Mixed(folder, scene, folder / "mixed.vtkhdf")


@pytest.fixture
def write_scene(tmp_path: Path) -> Callable[..., Path]:
    """write_scene(**keys): a scene file of half a second with these keys, written as JSON, which is YAML."""

    def write(**keys: Any) -> Path:
        path = tmp_path / "scene.yaml"
        path.write_text(json.dumps({"version": 1, "time": {"duration": 0.5}, **keys}, indent=1), encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def datasets() -> Callable[[Path], dict[str, np.ndarray]]:
    """datasets(file): everything that stands in a trajectory, path -> values."""
    return read_all


def read_all(path: Path) -> dict[str, np.ndarray]:
    with h5py.File(path) as file:
        return dict(walk(file, ""))


def walk(group: h5py.Group, place: str) -> Iterator[tuple[str, np.ndarray]]:
    """Every dataset under every name: `visititems` shows only the first of several links."""
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            yield place + name, np.asarray(item[()])
        else:
            yield from walk(item, f"{place}{name}/")


@pytest.fixture(scope="session")
def environment() -> Mapping[str, str]:
    """Variables under which the console script is found first."""
    return {**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])}
