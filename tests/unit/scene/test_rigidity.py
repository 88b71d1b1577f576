"""Rank of the rigidity matrix, and bracing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.scene import rigidity, shapes

BOX = shapes.box([1, 2, 3], mass=1)
EDGES_AND_DIAGONALS = np.array([(i, j) for i in range(8) for j in range(i) if bin(i ^ j).count("1") in (1, 3)])


def all_pairs(count):
    return np.array([(i, j) for i in range(count) for j in range(i)], np.int64).reshape(-1, 2)


def test_edges_and_main_diagonals_of_a_box_fall_three_short():
    assert len(EDGES_AND_DIAGONALS) == 16
    assert rigidity.rank(BOX.positions, EDGES_AND_DIAGONALS) == 15
    assert not rigidity.is_rigid(BOX.positions, EDGES_AND_DIAGONALS)
    braced = rigidity.brace(BOX.positions, EDGES_AND_DIAGONALS)
    assert len(braced) == 16 + 3
    assert rigidity.rank(BOX.positions, braced) == 18


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_box_and_icosahedron_are_rigid_at_every_scale(scale):
    for shape in (shapes.box([scale, scale, scale / 1000], mass=1), shapes.icosahedron(scale, mass=1)):
        assert rigidity.rank(shape.positions, shape.sticks) == 3 * len(shape.positions) - 6
        assert rigidity.is_rigid(shape.positions, shape.sticks)


def test_icosahedron_needs_exactly_its_30_edges():
    shape = shapes.icosahedron(1, mass=1)
    assert rigidity.is_rigid(shape.positions, shape.sticks[:30])
    assert not any(rigidity.is_rigid(shape.positions, np.delete(shape.sticks[:30], edge, axis=0)) for edge in range(30))
    assert len(rigidity.brace(shape.positions, np.zeros((0, 2), np.int64))) == 30


def test_rigid_body_is_left_alone():
    np.testing.assert_array_equal(rigidity.brace(BOX.positions, BOX.sticks), BOX.sticks)
    np.testing.assert_array_equal(rigidity.grow(BOX.positions, all_pairs(8)), all_pairs(8))


@pytest.mark.parametrize(("dimension", "count", "expected"), [
    (0, 1, 0), (0, 3, 0), (1, 2, 1), (1, 5, 4), (2, 3, 3), (2, 6, 9), (3, 4, 6), (3, 9, 21)])
def test_full_rank_is_that_of_all_pairs(dimension, count, expected):
    rng = np.random.default_rng(1)
    points = rng.normal(size=(count, dimension)) @ rng.normal(size=(dimension, 3)) + [1, 2, 3]
    assert rigidity.full_rank(points) == expected
    assert rigidity.rank(points, all_pairs(count)) == expected


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 12), kept=st.floats(0, 1))
def test_bracing_adds_as_many_sticks_as_the_rank_lacks(seed, count, kept):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 3))
    pairs = all_pairs(count)
    sticks = pairs[rng.random(len(pairs)) < kept]
    braced = rigidity.brace(points, sticks)
    assert len(braced) - len(sticks) == 3 * count - 6 - rigidity.rank(points, sticks)
    assert rigidity.is_rigid(points, braced)
    assert rigidity.is_rigid(points, rigidity.grow(points, sticks))


def test_growing_leaves_face_connected_tetrahedra_alone():
    """A strip of tetrahedra (k, k+1, k+2, k+3) shares a face from one to the next."""
    k = np.arange(600)
    helix = np.stack([np.cos(2.3 * k), np.sin(2.3 * k), 0.3 * k], axis=1)
    strip = np.concatenate([np.stack([k[:-step], k[step:]], axis=1) for step in (1, 2, 3)])
    assert len(strip) == 3 * 600 - 6
    assert len(rigidity.brace(helix, strip)) == len(strip)
    assert len(rigidity.brace(helix, strip[:-1])) > len(strip) - 1


def test_what_grows_together_is_rigid_and_takes_no_large_matrix(monkeypatch):
    k = np.arange(300)
    helix = np.stack([np.cos(2.3 * k), np.sin(2.3 * k), 0.3 * k], axis=1)
    strip = np.concatenate([np.stack([k[:-step], k[step:]], axis=1) for step in (1, 2, 3)])
    monkeypatch.setattr(rigidity, "rigidity_matrix", None)
    assert rigidity.is_rigid(helix, strip)
    assert len(rigidity.brace(helix, strip)) == len(strip)
    assert not rigidity.holds_together(helix, strip[:-1])


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_flat_and_small_bodies_are_left_to_the_rank(count):
    line = np.arange(count)[:, None] * [1.0, 0, 0]
    assert rigidity.is_rigid(line, all_pairs(count))
    assert not rigidity.holds_together(line, all_pairs(count))
