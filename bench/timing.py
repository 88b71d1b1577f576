"""Times of things that are compared: interleaved, so that what else the machine does befalls all of them alike."""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray


def timed(work: Callable[[], object]) -> float:
    """Wall seconds that `work` takes."""
    clock = time.perf_counter()
    work()
    return time.perf_counter() - clock


def computed(work: Callable[[], object]) -> float:
    """Seconds of processor time that `work` takes in this thread: a machine busy with other things only disturbs it."""
    clock = time.thread_time()
    work()
    return time.thread_time() - clock


def interleaved(repetitions: int, *jobs: Callable[[], float]) -> NDArray[np.float64]:
    """What each job returns, (jobs, repetitions); every repetition begins with another job. One round before is not counted."""
    found = np.empty((len(jobs), repetitions))
    for repetition in range(-1, repetitions):
        for turn in range(len(jobs)):
            job = (turn + repetition) % len(jobs)
            found[job, max(repetition, 0)] = jobs[job]()
    return found
