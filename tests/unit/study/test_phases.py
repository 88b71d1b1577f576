"""A stopwatch tells where the time goes and changes nothing else."""

import numpy as np
import pytest
import worlds

from verlet_numba.kernels.stopwatch import GRAVITY, PHASES, REST, begin, drop, lap
from verlet_numba.run.engine import start
from verlet_numba.study import phases

FRAMES = 40


@pytest.fixture(scope="module")
def watched():
    model = worlds.started(worlds.FREE)
    model.world = model.world._replace(stopwatch=phases.stopwatch(1, 3))
    return model, worlds.advanced(model, FRAMES)


def test_a_stopwatch_changes_no_bit(watched):
    for one, other in zip(watched[1], worlds.advanced(worlds.started(worlds.FREE), FRAMES), strict=True):
        np.testing.assert_array_equal(one, other)


def test_one_substep_of_three_is_timed_once_in_every_phase(watched):
    model, _ = watched
    watch, substeps = model.world.stopwatch, int(model.world.clock[2])
    assert watch.sampled[0] == -(-substeps // 3)
    passes = model.world.solver.passes
    laps = dict(zip(PHASES, watch.laps, strict=True))
    assert {laps[name] for name in ("rest", "gravity", "wind", "drag", "integration", "finding contacts")} == {watch.sampled[0]}
    assert laps["relaxation"] == laps["answering contacts"] == passes * watch.sampled[0]
    assert 0 < laps["frames"] <= 2 * watch.sampled[0]       # kept in a frame's last substep, finished after the next
    assert (watch.spent[[REST, GRAVITY]] > 0).all()


def test_a_substep_that_breaks_off_is_not_timed():
    """It is full, Python grows its buffers, and it goes on: that would be told as a phase, as often as substeps are skipped."""
    watch = phases.stopwatch(1, 2)
    for number in range(4):
        begin(watch, number)
        drop(watch)
        lap(watch, GRAVITY)
    assert (watch.sampled[0], watch.laps.sum(), watch.spent.sum()) == (0, 0, 0)


def test_phases_of_a_run_are_those_of_its_parts():
    found, whole = phases.phase_seconds(start(worlds.built(worlds.FREE)), 100, 1.0)
    assert whole > 0
    assert {"gravity", "relaxation", "integration"} <= set(found) <= set(PHASES) - {"rest", "wind", "drag", "damping", "paths"}
    assert all(seconds > 0 for seconds in found.values())


@pytest.mark.parametrize(("substeps", "a_frame"), [(9000, 150), (10, 8), (100_000, 6), (7, 1)])
def test_every_substep_of_a_frame_has_its_turn(substeps, a_frame):
    every = phases.spacing(substeps, a_frame, 200)
    assert {number % a_frame for number in range(0, every * a_frame, every)} == set(range(a_frame))
    assert every <= max(1, substeps // 200) + a_frame
