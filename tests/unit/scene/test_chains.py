"""Chains: every stick is in one or is left for the others, and neighbours along a chain are lanes one shift apart."""

import numpy as np
import pytest
from reference_constraints import chains

from verlet_numba.scene import shapes
from verlet_numba.scene.chains import families, paths, slots_along, unchained

SHAPES = {
    "rope of 1": shapes.rope([0, 0, 0], [1, 0, 0], 1, mass=1), "rope of 6": shapes.rope([0, 0, 0], [1, 0, 0], 6, mass=1),
    "2 x 2": shapes.cloth([1, 1], [2, 2], mass=1), "2 x 5": shapes.cloth([1, 1], [2, 5], diagonals="one", mass=1),
    "5 x 4": shapes.cloth([1, 1], [5, 4], mass=1), "7 x 2": shapes.cloth([1, 1], [7, 2], mass=1),
    "box": shapes.box([1, 1, 1], mass=1),
    "odd": shapes.particles(np.eye(14, 3), np.ones(14), sticks=[
        [5, 2], [2, 9], [9, 0],                 # a chain
        [1, 3], [3, 4], [4, 1],                 # a ring
        [6, 7], [6, 8], [6, 10],                # a star
        [11, 12]])}                             # one stick


def lanes_of(family):
    return [(m, int(c)) for m, c in enumerate(family.items) if c >= 0]


@pytest.mark.parametrize("name", SHAPES)
def test_families_hold_the_chains_of_the_twin(name):
    shape = SHAPES[name]
    slot, count = slots_along(shape)
    assert sorted({*slot}) == sorted(slot)
    assert 0 <= slot.min() <= slot.max() < count
    found = []
    for family in families(shape):
        stick = dict(lanes_of(family))
        for m, c in stick.items():
            assert sorted(slot[shape.sticks[c]]) == [family.first + m, family.first + family.shift + m]
        assert family.first + family.shift + len(family.items) <= count
        for m in sorted(stick):
            if m - family.shift not in stick or not {*shape.sticks[stick[m]]} & {*shape.sticks[stick[m - family.shift]]}:
                chain = [stick[m]]
                while (m := m + family.shift) in stick:
                    chain.append(stick[m])
                found.append(chain)
        assert len(family.items) % family.rows == 0
    expected, left = chains(shape)
    assert sorted(found) == sorted(expected)
    np.testing.assert_array_equal(unchained(shape).sticks, shape.sticks[left])
    np.testing.assert_array_equal(unchained(shape).lengths, shape.lengths[left])


def test_paths_are_whole_parts_of_a_body():
    assert [path.tolist() for path in paths(SHAPES["odd"])] == [[0, 9, 2, 5]]
