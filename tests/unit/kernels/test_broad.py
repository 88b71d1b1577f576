"""Broad phase: both searches against every pair of spheres, one after another."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.broad import GRIDS, all_pairs, by_grids, lattice, sweep
from verlet_numba.scene.capacity import search_of as search_for

SEEDS = 1000
SCALES = (1e-6, 1.0, 1e6)
TRANSLATIONS = (0.0, 1.0, -3e3, 1e9, 1e14)


def twin(centre, radius, body, still):
    """Pairs of spheres that touch, in double loops."""
    found = []
    for i in range(radius.size):
        for j in range(i + 1, radius.size):
            with np.errstate(invalid="ignore"):
                d = centre[:, i] - centre[:, j]
                touching = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= (radius[i] + radius[j]) ** 2
            finite = np.isfinite(radius[[i, j]]).all() and np.isfinite(centre[:, [i, j]]).all()
            if touching and finite and not (body[i] == body[j] >= 0) and not (still[i] and still[j]):
                found.append((i, j))
    return found


def pairs(search, centre, radius, body=None, still=None, room=None):
    """What a search finds, as a list; None: no room."""
    size = radius.size
    body = np.arange(size) if body is None else body
    still = np.zeros(size, bool) if still is None else still
    room = size * size if room is None else room
    first, second = np.full((2, room), -7)
    scratch = () if search is all_pairs else (search_for(size, room),)
    listed = search(centre, radius, body, still, first, second, *scratch)
    return None if listed == NO_ROOM else list(zip(first[:listed].tolist(), second[:listed].tolist(), strict=True))


def spheres(seed):
    """Up to 24 spheres in a box, of one size or of many, some alike, some lost, anywhere and of any scale."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(0, 25))
    radius = rng.uniform(0.2, 0.4, size) * 10 ** (rng.choice([0, 0, 1, 3]) * rng.uniform(-1, 1, size))
    centre = rng.uniform(-1, 1, (3, size)) * rng.choice([0.5, 2, 10]) * rng.choice([0, 1, 1, 1], (3, 1))
    scale = rng.choice(SCALES)
    centre, radius = scale * (centre + rng.choice(TRANSLATIONS, (3, 1))), scale * radius
    alike, lost = rng.random(size) < 0.1, rng.random(size) < 0.05
    centre[:, alike] = centre[:, :1]
    centre[rng.integers(0, 3), lost] = rng.choice([np.nan, np.inf, -np.inf, 1e30])
    radius[rng.random(size) < 0.03] = rng.choice([0, np.inf, np.nan])
    return centre, radius, rng.integers(-2, size, size), rng.random(size) < 0.3


def test_both_searches_are_the_twin():
    found = 0
    for seed in range(SEEDS):
        case = spheres(seed)
        expected = twin(*case)
        assert pairs(all_pairs, *case) == expected, seed
        assert pairs(by_grids, *case) == expected, seed
        found += len(expected)
    assert found > 10 * SEEDS


@pytest.mark.parametrize("size", [127, 128, 129, 1500])
@pytest.mark.parametrize("spread", [0.0, 1.0, 3.0])
def test_many_spheres(size, spread):
    """Large and mixed enough for several grids whose rows go round."""
    rng = np.random.default_rng(size)
    centre, radius = rng.uniform(0, size ** (1 / 3), (3, size)), 0.4 * 10 ** (-spread * rng.random(size))
    expected = pairs(all_pairs, centre, radius)
    assert pairs(sweep, centre, radius) == expected
    assert pairs(by_grids, centre, radius) == expected
    assert len(expected) > size / 100


@given(st.lists(st.tuples(*[st.integers(-40, 40)] * 3, st.integers(0, 6)), max_size=30), st.integers(-1000, 1000),
       st.integers(-19, 19), st.randoms())
@settings(max_examples=200, deadline=None)
def test_translation_scale_and_order_change_nothing(spheres, shift, power, random):
    """Whole numbers times a power of two: nothing is rounded, so even what only just touches must be found alike."""
    values = np.array(spheres, float).reshape(-1, 4).T
    centre, radius = values[:3].copy(), values[3].copy()
    expected = pairs(by_grids, centre, radius)
    assert expected == twin(centre, radius, np.arange(radius.size), np.zeros(radius.size, bool))
    assert pairs(by_grids, (centre + shift) * 2.0**power, radius * 2.0**power) == expected
    turn = list(range(radius.size))
    random.shuffle(turn)
    turned = [tuple(sorted((turn[i], turn[j]))) for i, j in pairs(by_grids, centre[:, turn].copy(), radius[turn])]
    assert sorted(turned) == expected


@pytest.mark.parametrize("search", [all_pairs, by_grids, sweep])
def test_none_one_and_two(search):
    assert pairs(search, np.zeros((3, 0)), np.zeros(0)) == []
    assert pairs(search, np.zeros((3, 1)), np.ones(1)) == []
    assert pairs(search, np.zeros((3, 2)), np.zeros(2)) == [(0, 1)]
    assert pairs(search, np.array([[0.0, 2.0], [0, 0], [0, 0]]), np.ones(2)) == [(0, 1)]
    assert pairs(search, np.array([[0.0, np.nextafter(2, 3)], [0, 0], [0, 0]]), np.ones(2)) == []


@pytest.mark.parametrize("search", [all_pairs, by_grids, sweep])
def test_who_may_not_meet(search):
    """Hulls of one body, and those that never move; colliders' hulls have no body."""
    body, still = np.array([3, 3, -1, -1, 4, 4]), np.array([False, False, True, False, True, True])
    found = pairs(search, np.zeros((3, 6)), np.ones(6), body, still)
    assert found == [(0, 2), (0, 3), (0, 4), (0, 5), (1, 2), (1, 3), (1, 4), (1, 5), (2, 3), (3, 4), (3, 5)]


@pytest.mark.parametrize("search", [all_pairs, by_grids, sweep])
def test_room_is_used_up_to_the_last_and_no_further(search):
    centre, radius = np.zeros((3, 200)), np.ones(200)
    every = 200 * 199 // 2
    assert len(pairs(search, centre, radius, room=every)) == every
    assert pairs(search, centre, radius, room=every - 1) is None
    assert pairs(search, centre, radius, room=0) is None


def test_everything_at_one_point_is_given_up_at_once():
    """10^5 spheres have 5 10^9 pairs: looking at them all would take minutes."""
    for radius in (np.ones(100_000), np.zeros(100_000), 10.0 ** -np.linspace(0, 12, 100_000)):
        assert pairs(sweep, np.ones((3, radius.size)), radius, room=100_000) is None


@pytest.mark.parametrize("radius", [0.0, 1e-20, 1e-9])
def test_points_far_apart_for_their_size_share_no_cell(radius):
    """Cells as small as the spheres, without limit: the search must not come down to all pairs."""
    rng = np.random.default_rng(0)
    centre, size = rng.integers(0, 8, (3, 3000)) / 8 + 0.0, 3000
    search = search_for(size, 100_000)
    first, second = np.zeros((2, 100_000), np.int64)
    listed = by_grids(centre, np.full(size, radius), np.arange(size), np.zeros(size, bool), first, second, search)
    assert list(zip(first[:listed], second[:listed], strict=True)) == pairs(all_pairs, centre, np.full(size, radius), room=100_000)
    filled = np.diff(search.cell[:search.grid[1, 0] + 1])
    assert filled.max() < 100


def test_one_lost_sphere_does_not_crowd_the_others():
    rng = np.random.default_rng(1)
    centre, radius = rng.uniform(0, 15, (3, 3000)), np.full(3000, 0.4)
    centre[:, 17] = 1e30
    search = search_for(3000, 100_000)
    first, second = np.zeros((2, 100_000), np.int64)
    by_grids(centre, radius, np.arange(3000), np.zeros(3000, bool), first, second, search)
    assert np.diff(search.cell[:search.grid[1, 0] + 1]).max() < 40


BOXES = [(1e9, 1e9, 1e9), (16, 16, 16), (64, 64, 1), (1, 64, 64), (64, 1, 64), (256, 4, 4), (4, 256, 4), (4, 4, 256), (1, 1, 1)]


@pytest.mark.parametrize("power", range(6, 31))
@pytest.mark.parametrize("shape", BOXES)
def test_no_two_neighbours_of_a_cell_are_the_same_cell(shape, power):
    """Else a pair would be listed twice."""
    cells, steps = 2**power, np.array([-1, 0, 1])
    ends = np.array([np.zeros(3), np.array(shape)]).T.copy()
    _, up, over = lattice(ends, np.arange(2), 0.5, cells)
    assert np.unique((steps[:, None, None] + steps[:, None] * up + steps * over) % cells).size == 27


@pytest.mark.parametrize("shape", BOXES[1:])
def test_cells_of_a_block_or_slab_have_numbers_of_their_own(shape):
    ends = np.array([np.zeros(3), np.array(shape) - 0.5]).T.copy()
    for cells, most in ((2**15, 1), (2**14, 2), (2**12, 4)):
        _, up, over = lattice(ends, np.arange(2), 0.5, cells)
        i, j, k = np.indices(shape)
        assert np.unique((i + j * up + k * over) % cells, return_counts=True)[1].max() <= most


def test_more_sizes_than_grids():
    radius = 4.0 ** -np.arange(GRIDS + 10)
    assert pairs(by_grids, np.zeros((3, radius.size)), radius) == pairs(all_pairs, np.zeros((3, radius.size)), radius)
