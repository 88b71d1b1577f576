"""Where the time of a substep goes: at the end of each phase of a sampled substep the clock is read.

Nobody who does not ask for it pays for it: without a stopwatch the calls are no part of the machine code. With one, only
one of so many substeps is timed.
"""

from verlet_numba._jit import clock_gettime, entry, kernel

PHASES = ("rest", "gravity", "wind", "drag", "damping", "integration", "paths", "finding contacts", "weighing contacts",
          "answering contacts", "relaxation", "rebound and friction", "frames")
(REST, GRAVITY, WIND, DRAG, DAMPING, INTEGRATION, PATHS, FINDING, WEIGHING, ANSWERING, RELAXATION, REBOUND,
 FRAMES) = range(len(PHASES))


@kernel
def reading(clock, spec):
    """A clock [ns]; spec (2,): its seconds and nanoseconds (POSIX clock_gettime)."""
    clock_gettime(clock, spec.ctypes)
    return spec[0] * 1_000_000_000 + spec[1]


@kernel
def begin(stopwatch, number):
    """A substep begins: time it if it is one of those to be sampled."""
    if stopwatch is None:
        return
    stopwatch.running[0] = number % stopwatch.every == 0
    if stopwatch.running[0]:
        stopwatch.last[0] = reading(stopwatch.clock, stopwatch.spec)
        stopwatch.sampled[0] += 1


@kernel
def lap(stopwatch, phase):
    """A phase ends: what has passed since the last one is its time."""
    if stopwatch is None:
        return
    if stopwatch.running[0]:
        now = reading(stopwatch.clock, stopwatch.spec)
        stopwatch.spent[phase] += now - stopwatch.last[0]
        stopwatch.laps[phase] += 1
        stopwatch.last[0] = now


@kernel
def drop(stopwatch):
    """A substep breaks off, and what follows is not its work: it is not timed."""
    if stopwatch is None:
        return
    stopwatch.sampled[0] -= stopwatch.running[0]
    stopwatch.running[0] = 0


@entry
def idle_laps(stopwatch, count):
    """So many laps in which nothing happens: what they show is the clock's own time."""
    begin(stopwatch, 0)
    for _ in range(count):
        lap(stopwatch, 0)
