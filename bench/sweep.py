"""A sweep of a thousand short runs, all included: planning, worker processes, simulation, files, measures, table."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from report import Figure, figure
from start_up import PENDULUM, written
from timing import timed

STUDY = "sweep"
RUNS, BAR = 1000, 20.0      # s on two cores


def measure(quick: bool) -> Iterator[Figure]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = written(PENDULUM, folder)
        swept(folder, scene, 10, "warm")
        seconds = [timed(lambda k=k: swept(folder, scene, RUNS, f"sweep_{k}")) for k in range(1 if quick else 3)]
        yield figure(STUDY, f"{RUNS} pendulums", "wall, warm", "s", seconds, at_most=BAR)


def swept(folder: Path, scene: str, runs: int, output: str) -> None:
    command = [sys.executable, "-m", "verlet_numba", "sweep", scene, "--vary", "bodies.pendulum.positions.1.0=0.5:1.5",
               "--samples", str(runs), "-o", output, "-q"]
    subprocess.run(command, cwd=folder, check=True)
