"""What a user waits for before anything moves: processes from start to end, with cold and warm machine code.

The program runs from a copy of its sources: an edit of them meanwhile would make what is warm cold again.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cases import FALL, ROPE, cloth, scene_of
from report import Figure, figure
from timing import timed

import verlet_numba

STUDY = "start-up"
BARS = {"--help": 0.3, "check": 0.7, "warm": 2.5, "cold": 60.0, "combination": 6.0}       # s
REPETITIONS = {True: 3, False: 5}

DIE = {"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 1, "position": [0, 0, 1]}
FLOOR = ({"kind": "plane"},)
WIND, DRAG, FRICTION = {"velocity": [1, 0, 0], "density": 1.2}, {"linear": 0.1, "quadratic": 0.1}, {"static": 0.5, "dynamic": 0.4}
PENDULUM = scene_of({"kind": "particles", "name": "pendulum", "positions": [[0, 0, 0], [1, 0, 0]], "masses": [1, 1],
                     "pinned": [0], "sticks": [[0, 1]]}, duration=0.5)
COMPILED = [        # between them, every effect
    scene_of(cloth(8), effects={**FALL, "wind": WIND, "drag": DRAG}, duration=0.1),
    scene_of(DIE, effects={**FALL, "friction": FRICTION, "restitution": 0.3, "damping": 0.1}, colliders=FLOOR, duration=0.1)]
COMBINATIONS = {    # none was seen before
    "rope with drag and damping": scene_of(ROPE, effects={**FALL, "drag": DRAG, "damping": 0.1}, duration=0.1),
    "cloth and die, wind and friction": scene_of(cloth(8, position=[0, 0, 2]), DIE, colliders=FLOOR, duration=0.1,
                                                 effects={**FALL, "wind": WIND, "friction": FRICTION}),
    "all but motion": scene_of(cloth(8, position=[0, 0, 2]), DIE, colliders=FLOOR, duration=0.1, effects={
        **FALL, "wind": WIND, "drag": DRAG, "damping": 0.1, "friction": FRICTION, "restitution": 0.3})}


def measure(quick: bool) -> Iterator[Figure]:
    repetitions = REPETITIONS[quick]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(Path(verlet_numba.__file__).parent, folder / "verlet_numba")
        pendulum = written(PENDULUM, folder)
        cold = waited(folder, "run", pendulum, "--overwrite")
        yield figure(STUDY, "run, pendulum", "cold cache", "s", cold, at_most=BARS["cold"])
        for case, quantity, bar, command in (
                ("run, pendulum", "warm cache", BARS["warm"], ("run", pendulum, "--overwrite")),
                ("check, pendulum", "wall", BARS["check"], ("check", pendulum)), ("--help", "wall", BARS["--help"], ("--help",))):
            waited(folder, *command)
            yield figure(STUDY, case, quantity, "s", [waited(folder, *command) for _ in range(repetitions)], at_most=bar)
        for scene in COMPILED:
            waited(folder, "run", written(scene, folder), "--overwrite")
        for case, scene in COMBINATIONS.items():
            new = waited(folder, "run", written(scene, folder), "--overwrite")
            yield figure(STUDY, case, "new combination", "s", new, at_most=BARS["combination"])


def waited(folder: Path, *command: str) -> float:
    """Wall seconds of a command of verlet-numba from its copy in `folder`, with the cache of machine code there."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}

    def work() -> None:
        program = [sys.executable, "-m", "verlet_numba", *command]
        done = subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"verlet-numba {' '.join(command)} ended with exit code {done.returncode}: {done.stderr}")

    return timed(work)


def written(scene: dict[str, Any], folder: Path) -> str:
    """The name of a new scene file."""
    path = folder / f"scene_{len(list(folder.glob('*.yaml')))}.yaml"
    path.write_text(json.dumps(scene))
    return path.name
