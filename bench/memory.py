"""Resident memory over a long run: what is written must not stay."""

import multiprocessing
import resource
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from cases import ROPE, prepared, scene_of
from numpy.typing import NDArray
from report import Figure, figure
from writing import chunks_seen

from verlet_numba.run.simulate import simulate

STUDY = "memory"
BAR = 1.05                              # largest over smallest, after the first part
FRAMES = 100_000
FIRST = 0.1
EVERY = 0.002                           # s


def measure(quick: bool) -> Iterator[Figure]:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        done, size = fresh.submit(sampled).result()
    case = f"rope, {FRAMES:,} frames"
    after = size[done >= FIRST * FRAMES]
    yield figure(STUDY, case, "resident", "MB", after / 1e6)
    yield figure(STUDY, case, f"largest / smallest after {FIRST:.0%}", "x", after.max() / after.min(), at_most=BAR)


def sampled() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Frames simulated and bytes resident, sampled all along a run."""
    samples: list[tuple[int, int]] = []
    done, over = 0, threading.Event()

    def more(size: int) -> None:
        nonlocal done
        done += size

    def sample() -> None:
        while not over.wait(EVERY):
            samples.append((done, int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()))

    watch = threading.Thread(target=sample)
    watch.start()
    with tempfile.TemporaryDirectory() as folder, chunks_seen(more):
        simulate(prepared(scene_of(ROPE)), Path(folder) / "rope.vtkhdf", count=FRAMES, quiet=True)
    over.set()
    watch.join()
    rows = np.array(samples)
    return rows[:, 0], rows[:, 1]
