"""Sweeps in processes of their own, and their workers, for tests that kill them."""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

SCENE = """\
version: 1
name: stones
time: {duration: 0.5, frame_rate: 60}
effects: {gravity: [0, 0, -9.81]}
bodies: [{kind: particles, name: stone, positions: [[0, 0, 0]], masses: [1], radius: 0.1, count: 2,
          scatter: {inside: [[0, 0, 0], [1, 1, 1]]}}]
"""

def rows(folder):
    with (folder / "results.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def start(folder, *arguments, output="killed", runs=12):
    """A sweep of runs that take some tenths of a second each, under way in a process of its own."""
    if not (folder / "long.yaml").exists():
        (folder / "long.yaml").write_text(SCENE.replace("duration: 0.5", "duration: 150"), encoding="utf-8")
    return subprocess.Popen([sys.executable, "-m", "verlet_numba", "sweep", "long.yaml", "--vary", "bodies.0.masses.0=1:2",
                             "--samples", str(runs), "-o", output, "--resume", *arguments], cwd=folder, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def workers(parent):
    """Processes that simulate for a sweep."""
    try:
        children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    except OSError:
        return []
    return [int(child) for child in children if b"spawn_main" in command(child)]


def command(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def at_work(pid, name=""):
    """Whether a process has a trajectory open that lies under this name."""
    try:
        links = [os.readlink(link) for link in Path(f"/proc/{pid}/fd").iterdir()]
    except OSError:
        return False
    return any("/runs/" in link and name in link for link in links)


def until(condition, seconds=240.0):
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)
    return found


def kill_workers(sweep, folder, runs, times):
    """SIGKILL to workers in the midst of a run, so many times, spread over the sweep. Returns how many there were."""
    killed = 0
    while killed < times and sweep.poll() is None:
        busy = [pid for pid in workers(sweep.pid) if at_work(pid)]
        if busy and len(list(folder.glob("runs/*/result.json"))) >= killed * runs // (times + 1):
            os.kill(busy[killed % len(busy)], signal.SIGKILL)
            killed += 1
        time.sleep(0.05)
    return killed


def assert_whole(folder, runs):
    found = rows(folder)
    assert len({row["id"] for row in found}) == len(found) == runs
    assert all(row["status"] == "complete" and row["total_energy"] for row in found)
    assert len(list((folder / "runs").iterdir())) == runs
