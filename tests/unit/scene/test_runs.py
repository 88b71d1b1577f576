"""Runs: every stick and triangle of every copy once, and none of a run sharing a particle with another of it."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import copies_of

from verlet_numba.scene import shapes
from verlet_numba.scene.numbering import number
from verlet_numba.scene.runs import lanes, worth_runs

COPIES = st.one_of(st.integers(1, 20), st.sampled_from([127, 128, 129, 300]))
CLOTH = st.tuples(st.integers(2, 9), st.integers(2, 9), st.sampled_from(["one", "both"]))


def group_of(shape, copies):
    """The group of two bodies of a shape that share the copies, and (K, P) inner indices of all of them."""
    some = copies // 3
    bodies = [copies_of(shape, count) for count in (some, copies - some) if count]
    numbering = number(bodies)
    assert len(numbering.groups) == 1
    return numbering.groups[0], np.concatenate(numbering.bodies)


def check(shape, copies, corners):
    """Lay the items out and look at every lane."""
    group, index = group_of(shape, copies)
    laid = lanes(group, corners)
    places = np.repeat(laid.first, laid.count, axis=1) + np.concatenate([np.arange(count) for count in laid.count])
    assert len(laid.item) == laid.count.sum() == places.shape[1]
    assert places.min() >= group.first
    assert places.max() < group.first + group.size
    active = laid.active
    np.testing.assert_array_equal(places[:, active], index[laid.copy[active][:, None], corners[laid.item[active]]].T)
    met = Counter(zip(laid.copy[active], laid.item[active], strict=True))
    assert len(met) == copies * len(corners)
    assert set(met.values()) == {1}
    run = np.repeat(np.arange(len(laid.count)), laid.count)
    for r in range(len(laid.count)):
        particles = places[:, active & (run == r)].ravel()
        assert len(np.unique(particles)) == len(particles), "two items of a run share a particle"
        first = np.sort(laid.first[:, r])
        assert (np.diff(first) >= laid.count[r]).all(), "the rows of a run overlap, so it is no vector loop"


@given(cloth=CLOTH, copies=COPIES)
@settings(deadline=None, max_examples=40)
def test_cloth(cloth, copies):
    nx, ny, diagonals = cloth
    shape = shapes.cloth([1, 1], [nx, ny], diagonals=diagonals, mass=1)
    check(shape, copies, shape.sticks)
    check(shape, copies, shape.triangles)


@given(segments=st.integers(1, 30), copies=COPIES)
@settings(deadline=None, max_examples=30)
def test_ropes(segments, copies):
    shape = shapes.rope([0, 0, 0], [1, 0, 0], segments, mass=1)
    check(shape, copies, shape.sticks)


@pytest.mark.parametrize("copies", [4, 7, 8, 9, 129, 300])
@pytest.mark.parametrize("shape", [shapes.box([1, 1, 1], mass=1), shapes.icosahedron(1.0, mass=1)], ids=["box", "icosahedron"])
def test_copies_without_structure(shape, copies):
    check(shape, copies, shape.sticks)


def test_only_copies_make_runs_of_bodies_without_structure():
    worth = {count: worth_runs(group_of(shapes.box([1, 1, 1], mass=1), count)[0]) for count in (1, 3, 4, 100)}
    assert worth == {1: False, 3: False, 4: True, 100: True}
    assert worth_runs(group_of(shapes.rope([0, 0, 0], [1, 0, 0], 1, mass=1), 1)[0])


@pytest.mark.parametrize(("nx", "ny"), [(20, 20), (40, 40), (41, 40)])
def test_cloth_is_sixteen_runs(nx, ny):
    """Four directions in four parity blocks, whatever the size: runs grow instead."""
    shape = shapes.cloth([1, 1], [nx, ny], mass=1)
    laid = lanes(group_of(shape, 1)[0], shape.sticks)
    assert len(laid.count) == 16
    assert laid.active.mean() > 0.8
