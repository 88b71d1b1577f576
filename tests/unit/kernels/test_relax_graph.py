"""Relaxation by the constraint graph against its plain scalar twin, bit for bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.kernels.relax import relax_runs, relax_sticks
from verlet_numba.kernels.relax_graph import relax_graph, sort_bodies
from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.constraint_graph import graph_of, kind_of, lists
from verlet_numba.scene.constraints import constraints
from verlet_numba.scene.numbering import number

PASSES = 3
WAYS = [(tolerance, approximate) for tolerance in (None, 0.01, 0.1) for approximate in (None, 1)]
BOX, SMALL, LARGE = shapes.box([0.3, 0.2, 0.5], mass=2.0), shapes.icosahedron(0.1, mass=1.0), shapes.icosahedron(0.13, mass=3.0)


class World:
    """Bodies (shape, copies, pinned particles) scattered, turned not at all and shaken, in the inner numbering."""

    def __init__(self, entries, real, seed=0, shake=0.1, repeats="by_level"):
        rng = np.random.default_rng(seed)
        self.repeats, self.bodies = repeats, []
        for k, (shape, copies, pins) in enumerate(entries):
            pinned = np.isin(np.arange(len(shape.positions)), pins)
            middle = rng.normal(0, 2, (copies, 1, 3))
            positions = middle + shape.positions + rng.normal(0, shake * shape.lengths.mean(), (copies, *shape.positions.shape))
            self.bodies.append(Body(f"{k}", shape, positions, np.zeros_like(positions), pinned, (0.0, 0.0), 0.0))
        self.numbering = number(self.bodies)
        self.index = [index for part in self.numbering.bodies for index in part]
        self.body = [body for body in self.bodies for _ in range(body.copies)]
        self.w, self.x = np.zeros(self.numbering.size), rng.normal(size=(3, self.numbering.size)).astype(real)
        for body, index in zip(self.bodies, self.numbering.bodies, strict=True):
            self.w[index] = np.where(body.pinned, 0, 1 / body.shape.masses)
            self.x[:, index] = np.moveaxis(body.positions, 2, 0)
        self.graph = graph_of(self.bodies, self.numbering, self.w, repeats, real)
        self.moved = np.array([rng.integers(-1, len(body.shape.positions)) for body in self.body])

    def relaxed(self, tolerance, approximate, passes=PASSES):
        x = self.x.copy()
        sort_bodies(self.graph, self.moved)
        return x, sum(relax_graph(x, self.graph, tolerance, approximate) for _ in range(passes))


def twin(world, tolerance, approximate, passes=PASSES):
    """Body by body and stick by stick, every operation in the precision of the positions."""
    x, done = world.x.copy(), 0
    real = x.dtype.type
    for body, index, moved in zip(world.body, world.index, world.moved, strict=True):
        sticks = body.shape.sticks
        order = lists(body.shape, kind_of(body.shape, index[None], world.w)[1].weight, world.repeats)[moved + 1]
        for c in [*order] * passes:
            i, j = index[sticks[c]]
            total = world.w[i] + world.w[j]
            if total == 0:
                continue
            gi, gj, rest = real(world.w[i] / total), real(world.w[j] / total), real(body.shape.lengths[c])
            d = x[:, j] - x[:, i]
            squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
            if tolerance is not None:
                slack = real(tolerance) * rest
                if (rest - slack) * (rest - slack) <= squared <= (rest + slack) * (rest + slack):
                    continue
            done += 1
            length = np.sqrt(squared)
            f = (squared - rest * rest) / (squared + rest * rest) if approximate else (length - rest) / length
            x[:, i] += f * gi * d
            x[:, j] -= f * gj * d
    return x, done


@pytest.mark.parametrize(("tolerance", "approximate"), WAYS)
@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_is_the_twin_bit_for_bit(real, tolerance, approximate):
    world = World([(SMALL, 40, []), (BOX, 3, [0]), (LARGE, 9, [2, 3, 4]), (LARGE, 30, []), (SMALL, 2, [])], real)
    x, count = world.relaxed(tolerance, approximate)
    expected, done = twin(world, tolerance, approximate)
    assert x.dtype == real
    np.testing.assert_array_equal(x, expected)
    assert count == done > 0


@given(small=st.integers(1, 30), large=st.integers(0, 20), boxes=st.integers(0, 10), pins=st.sets(st.integers(0, 7)),
       seed=st.integers(0, 99), way=st.sampled_from(WAYS), repeats=st.sampled_from(["by_level", "halving", "once"]))
@settings(deadline=None, max_examples=30)
def test_is_the_twin_for_any_bodies(small, large, boxes, pins, seed, way, repeats):
    entries = [(SMALL, small, []), (BOX, boxes, sorted(pins)), (LARGE, large, sorted(pins))]
    world = World([entry for entry in entries if entry[1]], np.float64, seed, repeats=repeats)
    x, count = world.relaxed(*way)
    expected, done = twin(world, *way)
    np.testing.assert_array_equal(x, expected)
    assert count == done


@pytest.mark.parametrize(("tolerance", "approximate"), WAYS)
@pytest.mark.parametrize("real", [np.float64, np.float32])
@pytest.mark.parametrize("copies", [1, 7, 600])
def test_untouched_bodies_are_relaxed_in_plain_order(copies, real, tolerance, approximate):
    world = World([(SMALL, copies, []), (LARGE, copies, [1])], real)
    world.moved[:] = -1
    x, count = world.relaxed(tolerance, approximate)
    plain, done = world.x.copy(), 0
    runs, _, sticks, _, _ = constraints(world.bodies, world.numbering, np.zeros((0, 2), np.int64), world.w, 0.01, 1, real)
    for _ in range(PASSES):
        done += relax_runs(plain, runs, None, tolerance, approximate) + relax_sticks(plain, sticks, None, tolerance, approximate)
    np.testing.assert_array_equal(x, plain)
    assert count == done


def test_a_body_alone_is_the_same_among_many():
    """Whatever lanes and blocks it shares: 900 bodies, more than are packed side by side."""
    world = World([(SMALL, 900, [])], np.float32)
    world.moved[:] = np.arange(900) % 3 - 1
    x, _ = world.relaxed(0.01, None)
    for k in (0, 1, 128, 499, 899):
        alone = World([(SMALL, 1, [])], np.float32)
        alone.x[:, alone.index[0]] = world.x[:, world.index[k]]
        alone.moved[:] = world.moved[k]
        np.testing.assert_array_equal(alone.relaxed(0.01, None)[0][:, alone.index[0]], x[:, world.index[k]])


def test_bodies_of_all_lists_are_side_by_side():
    """Every particle of an icosahedron sees the same, so that bodies fill lanes whichever particle moved most."""
    world = World([(SMALL, 48, []), (LARGE, 24, [])], np.float64)
    world.moved[:] = np.arange(72) % 12
    x, count = world.relaxed(0.01, None)
    np.testing.assert_array_equal(world.graph.start, [0, 0, 72])
    expected, done = twin(world, 0.01, None)
    np.testing.assert_array_equal(x, expected)
    assert count == done


def test_relaxation_keeps_momentum_and_what_is_pinned():
    world = World([(SMALL, 20, []), (LARGE, 5, [3])], np.float64)
    x, _ = world.relaxed(None, None)
    for body, index in zip(world.body, world.index, strict=True):
        if not body.pinned.any():
            np.testing.assert_allclose((x - world.x)[:, index] @ body.shape.masses, 0, atol=1e-15)
        np.testing.assert_array_equal(x[:, index][:, body.pinned], world.x[:, index][:, body.pinned])
        assert np.abs(x - world.x)[:, index].max() > 1e-3
    ghosts = np.setdiff1d(np.arange(world.numbering.size), np.concatenate(world.index))
    np.testing.assert_array_equal(x[:, ghosts], world.x[:, ghosts])


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_place_and_scale_do_not_matter(scale):
    """Shifted and scaled by powers of two next to `scale`, the same constraints are relaxed and the shape is the same."""
    factor = 2.0 ** np.round(np.log2(scale))
    world = World([(SMALL, 10, [])], np.float64)
    x, count = world.relaxed(0.01, None)
    shape = shapes.icosahedron(0.1 * factor, mass=1.0)
    other = World([(shape, 10, [])], np.float64)
    other.x[:] = factor * (world.x + 4.0)
    y, other_count = other.relaxed(0.01, None)
    np.testing.assert_allclose(y / factor - 4.0, x, atol=1e-13)
    assert other_count == count


def test_rest_is_left_alone():
    world = World([(SMALL, 30, [])], np.float64, shake=0.0)
    x, count = world.relaxed(1e-9, None)
    np.testing.assert_array_equal(x, world.x)
    assert count == 0


def test_no_tolerance_counts_every_entry_but_those_between_pins():
    world = World([(SMALL, 5, [0, 1, 2])], np.float64)
    between = (SMALL.sticks < 3).all(1)
    assert between.any()
    world.moved[:] = [-1, 0, 4, 4, 11]
    _, count = world.relaxed(None, None, passes=2)
    found = lists(SMALL, kind_of(SMALL, world.index[0][None], world.w)[1].weight, "by_level")
    assert count == 2 * sum((~between[found[moved + 1]]).sum() for moved in world.moved)


def test_bodies_are_sorted_anew():
    """Every collision phase starts from scratch, and a body that leaves its list is relaxed in plain order again."""
    world = World([(SMALL, 50, [])], np.float64)
    first = world.relaxed(None, None)[0]
    kept = world.moved.copy()
    world.moved[:] = -1
    assert not np.array_equal(world.relaxed(None, None)[0], first)
    world.moved[:] = kept
    np.testing.assert_array_equal(world.relaxed(None, None)[0], first)
    assert sorted(world.graph.sorted[0]) == sorted(world.graph.body[0])


def test_no_graph_is_nothing():
    x = np.ones((3, 2))
    sort_bodies(None, np.zeros(0, np.int64))
    assert relax_graph(x, None, None, None) == 0
