"""Time by phase of a model's run, from sampled substeps."""

import time

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.world import Stopwatch
from verlet_numba.kernels.stopwatch import PHASES, idle_laps
from verlet_numba.run.engine import run_chunk, start, warm
from verlet_numba.scene.build import Model, frames

SHORT = 2e-5            # s: a substep that takes less is over before anything else gets the processor
SAMPLES, FEW = 1000, 200    # substeps that are timed, at least, if the run has as many; few where they are short
BATCHES, LAPS = 10, 1000    # to see what reading the clock takes
NOTHING = 1e-3          # of the time: a phase of what the scene has not


def phase_seconds(model: Model, count: int, seconds: float) -> tuple[dict[str, float], float]:
    """Run `count` frames from the start with a stopwatch: seconds of each phase that took any, and of the whole run.

    seconds: what the run takes about. Phases are timed in some substeps and scaled to all of them, by the processor's time
    of this thread, where substeps are short by the time of day, which is read ten times as fast (30 ns). So their sum
    differs from the whole by chance, by the time that Python takes to grow buffers, and where a substep takes less than a
    microsecond by much, since reading the clock takes as long. Empty on systems without these clocks (POSIX).
    """
    if not hasattr(time, "CLOCK_THREAD_CPUTIME_ID"):
        return {}, 0.0
    substeps = (count - 1) * model.world.solver.substeps + 1
    short = seconds < SHORT * substeps
    clock = time.CLOCK_MONOTONIC if short else time.CLOCK_THREAD_CPUTIME_ID
    watch = stopwatch(clock, spacing(substeps, model.world.solver.substeps, FEW if short else SAMPLES))
    model.world = model.world._replace(stopwatch=watch)
    warm(start(model))
    for array in (watch.sampled, watch.spent, watch.laps):
        array[:] = 0
    chunk = frames(model, count)
    begin = time.thread_time()
    run_chunk(start(model), chunk)
    whole = time.thread_time() - begin
    reading = nanoseconds_a_lap(clock)
    whole -= 1e-9 * reading * float(watch.laps.sum())
    scale = 1e-9 * substeps / max(1, int(watch.sampled[0]))
    spent = np.maximum(0.0, watch.spent - reading * watch.laps) * scale
    spent[[PHASES.index(name) for name in absent(model)]] = 0.0
    return {name: float(seconds) for name, seconds in zip(PHASES, spent, strict=True) if seconds > NOTHING * spent.sum()}, whole


def absent(model: Model) -> set[str]:
    """Phases that the model's world has no part for: what a clock tells of them is its own noise."""
    effects = model.world.effects
    meets = any(each is not None for each in (effects.contact, effects.meet, effects.spheres, effects.mixed, effects.exact))
    there = {"rest": effects.rest, "gravity": effects.gravity, "wind": effects.wind, "drag": effects.drag,
             "damping": effects.damping, "paths": effects.carried or effects.moving}
    contacts = {"finding contacts", "weighing contacts", "answering contacts", "rebound and friction"}
    return {name for name, part in there.items() if part is None} | (set() if meets else contacts)


def stopwatch(clock: int, every: int) -> Stopwatch:
    """A stopwatch that times one substep in so many by one of the system's clocks."""
    return Stopwatch(clock, every, *(gate(np.zeros(size), np.int64) for size in (1, 1, 1, len(PHASES), len(PHASES), 2)))


def nanoseconds_a_lap(clock: int) -> float:
    """What reading the clock takes, by the batch that nothing came between."""
    watch, found = stopwatch(clock, 1), []
    for _ in range(BATCHES):
        watch.spent[0] = 0
        idle_laps(watch, LAPS)
        found.append(float(watch.spent[0]) / LAPS)
    return min(found)


def spacing(substeps: int, a_frame: int, samples: int) -> int:
    """One substep in so many: without a common divisor with those of a frame, so that each of a frame's has its turn."""
    every = max(1, substeps // samples)
    while np.gcd(every, a_frame) > 1:
        every += 1
    return every
