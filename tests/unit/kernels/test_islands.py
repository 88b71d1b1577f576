"""Islands are the connected components of entities by touches; the world joins nothing."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from verlet_numba.kernels.islands import sort_islands

ENTITIES = 40
WORLD = ENTITIES - 1


def sorted_islands(first, second):
    """The islands as lists of touches, in the order in which the kernel gives them."""
    room = len(first) + 3
    parent, label, order, island = np.full(ENTITIES, -1), np.full(ENTITIES, 77), np.full(room, -9), np.full(room + 1, -9)
    touched = np.union1d(first, second)
    parent[touched] = touched
    parent[WORLD] = -1
    mass = np.ones((ENTITIES, 10))
    mass[WORLD] = 0
    many = sort_islands(np.r_[first, 7, 7, 7], np.r_[second, 8, 8, 8], len(first), mass, parent, label, order, island)
    return [list(order[island[i]:island[i + 1]]) for i in range(many)]


def components(first, second):
    """The same by graph search, islands in the order of their first touch."""
    joined = second != WORLD
    edges = coo_array((np.ones(joined.sum()), (first[joined], second[joined])), shape=(ENTITIES, ENTITIES))
    label = connected_components(edges, directed=False)[1]
    found = {}
    for t, entity in enumerate(first):
        found.setdefault(label[entity], []).append(t)
    return list(found.values())


@pytest.mark.parametrize("seed", range(20))
def test_islands_are_connected_components(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 60))
    first, second = rng.integers(0, WORLD, (2, count))
    second = np.where(rng.random(count) < 0.4, WORLD, second)
    second = np.where(first == second, WORLD, second)
    assert sorted_islands(first, second) == components(first, second)


def test_all_on_the_floor_are_islands_of_their_own():
    first = np.array([3, 1, 3, 2])
    assert sorted_islands(first, np.full(4, WORLD)) == [[0, 2], [1], [3]]


def test_a_chain_given_from_its_ends_is_one_island():
    first, second = np.array([0, 5, 1, 4, 2, 9]), np.array([1, 4, 2, 3, 3, WORLD])
    assert sorted_islands(first, second) == [[0, 1, 2, 3, 4], [5]]


def test_no_touch_no_island():
    none = np.zeros(0, np.int64)
    assert sorted_islands(none, none) == []
