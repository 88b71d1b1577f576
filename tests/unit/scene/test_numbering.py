"""The inner numbering: every particle of the file once, bodies of one topology side by side."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import copies_of

from verlet_numba.scene import shapes
from verlet_numba.scene.numbering import LANES, SMALL_SLOTS, block_size, number, padded, slots

SHAPES = {
    "rope of 1": shapes.rope([0, 0, 0], [1, 0, 0], 1, mass=1), "rope of 6": shapes.rope([0, 0, 0], [1, 0, 0], 6, mass=1),
    "2 x 2": shapes.cloth([1, 1], [2, 2], mass=1), "2 x 5": shapes.cloth([1, 1], [2, 5], diagonals="one", mass=1),
    "5 x 4": shapes.cloth([1, 1], [5, 4], mass=1), "7 x 3": shapes.cloth([1, 1], [7, 3], mass=1),
    "box": shapes.box([1, 1, 1], mass=1), "icosahedron": shapes.icosahedron(1.0, mass=1),
    "dust": shapes.particles([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [1, 1, 1])}
COPIES = st.one_of(st.integers(1, 20), st.sampled_from([127, 128, 129, 300]))
BODIES = st.lists(st.tuples(st.sampled_from(sorted(SHAPES)), COPIES), max_size=5)


def bodies_of(names):
    return [copies_of(SHAPES[name], copies) for name, copies in names]


@given(names=BODIES, lines=st.booleans())
@settings(deadline=None, max_examples=60)
def test_every_particle_has_a_place_of_its_own(names, lines):
    bodies = bodies_of(names)
    numbering = number(bodies, lines=lines)
    order = numbering.scene_order
    assert len(order) == sum(body.positions.shape[0] * body.positions.shape[1] for body in bodies)
    assert len(np.unique(order)) == len(order)
    assert ((order >= 0) & (order < numbering.size)).all()
    first = 0
    for body, index in zip(bodies, numbering.bodies, strict=True):
        assert index.shape == body.positions.shape[:2]
        np.testing.assert_array_equal(order[first:first + index.size], index.ravel())        # the file: copy by copy
        first += index.size


@given(names=BODIES, lines=st.booleans())
@settings(deadline=None, max_examples=60)
def test_copies_are_lanes_side_by_side_within_blocks(names, lines):
    numbering = number(bodies_of(names), lines=lines)
    for group in numbering.groups:
        index = np.concatenate([numbering.bodies[b] for b in group.members])
        assert len(index) == group.copies
        copy = np.arange(group.copies)
        expected = group.first + copy // group.block * group.slots * group.block + copy % group.block
        np.testing.assert_array_equal(index - group.slot * group.block, np.repeat(expected[:, None], index.shape[1], axis=1))
        assert group.first <= index.min()
        assert index.max() < group.first + group.size
    ranges = sorted((group.first, group.first + group.size) for group in numbering.groups)
    assert all(end <= start for (_, end), (start, _) in pairwise(ranges))


@pytest.mark.parametrize("name", SHAPES)
def test_slots_are_distinct(name):
    slot, count = slots(SHAPES[name])
    assert len(np.unique(slot)) == len(SHAPES[name].positions)
    assert slot.min() >= 0
    assert slot.max() < count


@given(slots=st.integers(1, 3000), copies=st.integers(1, 20_000))
@settings(max_examples=200)
def test_blocks_hold_all_copies_and_waste_little(slots, copies):
    block = block_size(slots, copies)
    blocks = -(-copies // block)
    assert blocks * block >= copies
    assert (blocks - 1) * block < copies
    assert block <= LANES or block % LANES == 0
    assert slots * copies > SMALL_SLOTS or blocks == 1
    assert blocks * block <= copies + blocks * LANES


def test_topology_decides_who_shares_a_group():
    bodies = bodies_of([("box", 2), ("icosahedron", 3), ("box", 1), ("5 x 4", 1), ("7 x 3", 1)])
    groups = number(bodies).groups
    assert [group.members for group in groups] == [(0, 2), (1,), (3,), (4,)]
    assert groups[0].copies == 3


@pytest.mark.parametrize("itemsize", [4, 8])
def test_rows_are_whole_cache_lines_and_off_a_page(itemsize):
    for size in (0, 1, 63, 64, 512, 1000, 1024, 4096, 12345):
        length = padded(size, itemsize)
        assert length >= max(size, 1)
        assert length * itemsize % 64 == 0
        assert length * itemsize % 4096 >= 512
        assert length <= size + 1100
