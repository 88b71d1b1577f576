"""Constraints along their direction at the start of the substep against the naive twin, and which bodies take it."""

import numpy as np
import pytest
import worlds
from reference_constraints import relax_started_stick
from stick_cases import Case, H

from verlet_numba.buffers.world import FALLEN
from verlet_numba.kernels.relax import forget
from verlet_numba.kernels.relax_started import CHANGE, guard, note_start, relax_started_runs, relax_started_sticks

PASSES = 3
TOLERANCE = {np.float64: 1e-11, np.float32: 4e-4}
WAYS = [(None, None, False, False), (None, None, False, True), (0.1, None, False, True), (None, 1, False, True),
        (None, None, True, True), (0.1, 1, True, True)]


@pytest.mark.parametrize(("tolerance", "approximate", "soft", "some"), WAYS)
@pytest.mark.parametrize("real", [np.float64, pytest.param(np.float32, marks=pytest.mark.validate)])
def test_runs_are_the_twins_and_sticks_are_runs(real, tolerance, approximate, soft, some):
    """some: a third of the particles take the present direction of the sticks that they are the first of."""
    case, rng = Case(real, soft), np.random.default_rng(2)
    previous = (case.x + rng.normal(0, 0.05, case.x.shape)).astype(real)
    marks = (rng.random(case.x.shape[1]) < 0.3 * some).astype(real)
    found = []
    for relax, constraints, more in ((relax_started_runs, case.runs, (int(marks.sum()),)),
                                     (relax_started_sticks, case.sticks, ())):
        x = case.x.copy()
        forget(case.softness)
        found.append((x, sum(relax(x, previous, constraints, case.softness, tolerance, approximate, marks, *more)
                             for _ in range(PASSES))))
    twin, start = case.x.T.astype(float), previous.T.astype(float)
    expected = sum(relax_started_stick(twin, start, case.w, stick, H, tolerance or 0.0, approximate is not None, marks[stick.i] > 0,
                                       soft)
                   for _ in range(PASSES) for stick in case.twins)
    np.testing.assert_allclose(found[0][0].T, twin, atol=TOLERANCE[real])
    np.testing.assert_array_equal(found[0][0], found[1][0])
    assert found[0][1] == found[1][1] == expected
    assert found[0][0].dtype == real


def test_where_no_body_is_marked_the_arithmetic_is_the_same():
    case = Case(np.float64, False)
    previous = case.x + np.random.default_rng(2).normal(0, 0.05, case.x.shape)
    marks, plain, masked = np.zeros(case.x.shape[1]), case.x.copy(), case.x.copy()
    assert relax_started_runs(plain, previous, case.runs, None, None, None, marks, 0) == case.runs.active
    assert relax_started_runs(masked, previous, case.runs, None, None, None, marks, 1) == case.runs.active
    np.testing.assert_array_equal(plain, masked)


BODIES = {"time": {"duration": 1}, "effects": {}, "solver": {"gradient": "step_start"}, "colliders": [{"kind": "plane"}],
          "bodies": [{"kind": "icosahedron", "name": "dice", "radius": 0.2, "mass": 1, "count": 11,
                      "scatter": {"inside": [[-5] * 3, [5, 5, 9]]}},
                     {"kind": "rope", "name": "line", "start": [0, 0, 11], "end": [1, 0, 11], "segments": 5, "mass": 1},
                     {"kind": "box", "name": "crate", "size": [1, 1, 1], "mass": 1, "position": [0, 0, 15]}]}


@pytest.mark.parametrize("hit", [[], [0], [3, 11], [12], [5, 10, 11, 12]])
@pytest.mark.parametrize("how", ["turned", "moved"])
def test_bodies_fall_back_as_a_whole(hit, how):
    """Bodies are counted through: dice 0 to 10, the rope, the crate."""
    model = worlds.started(BODIES)
    world, counts = model.world, np.zeros(5, np.int64)
    position, previous = world.particles.position, world.particles.position.copy()
    bodies = [index for body in model.numbering.bodies for index in body]
    for share in (0.9, 1.1):
        position[:] = previous
        note_start(position, world.start)
        rng = np.random.default_rng(0)
        for b in hit:
            i, j = shortest(model.bodies[max(0, b - 10)].shape)
            change = rng.normal(size=3)
            rest = np.linalg.norm(position[:, bodies[b][j]] - position[:, bodies[b][i]])
            position[:, bodies[b][j]] += share * CHANGE * rest * change / np.linalg.norm(change)
        if how == "turned":
            note_start(position, world.start)       # contacts move nothing
        counts[:] = 0
        guard(position, previous, world.runs, world.sticks, world.start, counts)
        expected = hit if how == "moved" or share > 1 else []
        assert [b for b, index in enumerate(bodies) if (world.start.marks[index] == 1).all()] == expected
        assert [b for b, index in enumerate(bodies) if world.start.marks[index].any()] == expected
        assert counts[FALLEN] == len(expected)


def shortest(shape):
    """The two particles of a body's shortest stick."""
    return shape.sticks[np.argmin(shape.lengths)]
