"""The list of near pairs over many substeps: never without a pair that is close, and what pairs learnt stays with them."""

import numpy as np
import pytest

from verlet_numba.buffers.hulls import POINTS, Hulls
from verlet_numba.kernels.candidates import FULL, KEPT, RENEWED, SLACK, refresh
from verlet_numba.scene.capacity import pairs_of
from verlet_numba.scene.capacity import search_of as search_for

SUBSTEPS = 300


def room_for(size):
    """Pairs with room for so many."""
    return pairs_of(size)


class Crowd:
    """Hulls, and the list of those that are near each other."""

    def __init__(self, centre, reach, *, body=None, still=None, room=2000, margin=0.05, horizon=8, all_pairs=False):
        size, none = len(reach), np.zeros(0, np.int64)
        body = np.arange(size) if body is None else np.array(body)
        self.hulls = Hulls(body, none, none, none, np.zeros((3, 0)), np.array(centre, float), none, np.zeros((3, 0)),
                           np.array(reach, float), np.zeros(size), none, none, none, none)
        self.still = np.zeros(size, bool) if still is None else np.array(still)
        self.pairs, self.spare, self.search = room_for(room), room_for(room), search_for(size, room)
        self.margin, self.horizon, self.all_pairs = margin, horizon, all_pairs

    def refresh(self):
        return refresh(self.hulls, self.still, self.pairs, self.spare, self.search, self.margin, self.horizon, self.all_pairs)

    @property
    def listed(self):
        n = self.pairs.listed[0]
        return list(zip(self.pairs.first[:n].tolist(), self.pairs.second[:n].tolist(), strict=True))

    @property
    def close(self):
        """Pairs whose spheres are nearer than the margin, by their definition."""
        centre, reach, body = self.hulls.centre, self.hulls.reach, self.hulls.body
        i, j = np.triu_indices(reach.size, 1)
        with np.errstate(over="ignore", invalid="ignore"):
            gap = np.sqrt(((centre[:, i] - centre[:, j]) ** 2).sum(0)) - reach[i] - reach[j]
        may = ~((body[i] == body[j]) & (body[i] >= 0)) & ~(self.still[i] & self.still[j]) & (gap < self.margin)
        return set(zip(i[may].tolist(), j[may].tolist(), strict=True))


def crowd(seed, size, scale=1.0, **more):
    """Hulls of several sizes in a box, a tenth of them still, some with two hulls a body; and their velocities a substep."""
    rng = np.random.default_rng(seed)
    still = rng.random(size) < 0.1
    body = np.where(still, -1, np.arange(size) // 2)
    found = Crowd(rng.uniform(0, 0.6 * size ** (1 / 3), (3, size)) * scale, rng.uniform(0.05, 0.2, size) * scale, body=body,
                  still=still, margin=0.02 * scale, **more)
    return found, np.where(still, 0, rng.normal(0, 0.01 * scale, (3, size)))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("size", [40, 160])
@pytest.mark.parametrize("all_pairs", [False, True])
def test_what_is_close_is_listed_in_every_substep(scale, size, all_pairs):
    """Speeds change at random, hulls grow and shrink a little, and some are thrown far off at once."""
    found, velocity = crowd(size, size, scale, all_pairs=all_pairs)
    rng, results = np.random.default_rng(7), []
    for substep in range(SUBSTEPS):
        velocity += np.where(found.still, 0, rng.normal(0, 0.001 * scale, velocity.shape))
        found.hulls.centre[:] += velocity
        found.hulls.reach[:] *= np.where(found.still, 1, rng.uniform(0.995, 1.005, size))
        if substep % 50 == 49:
            found.hulls.centre[:, int(np.flatnonzero(~found.still)[substep % 7])] += 0.5 * scale
        results.append(found.refresh())
        assert found.close <= set(found.listed), substep
    assert results[0] == RENEWED
    assert FULL not in results
    assert SUBSTEPS / 30 < results.count(RENEWED) < SUBSTEPS / 3
    assert found.search.made[0] == results.count(RENEWED)


def test_both_searches_list_the_same():
    for seed in range(20):
        lists = []
        for all_pairs in (False, True):
            found, velocity = crowd(seed, 150, all_pairs=all_pairs)
            found.refresh()
            found.hulls.centre[:] += 5 * velocity
            found.refresh()
            lists.append(found.listed)
        assert lists[0] == lists[1]
        assert lists[0]


def impulses(pairs, m):
    """What pair m pushed and gripped at each of its contacts."""
    return pairs.given[m, :4 * pairs.points[m]].copy()


def test_pairs_that_stay_keep_what_they_learnt():
    found, velocity = crowd(3, 150)
    found.refresh()
    rng = np.random.default_rng(0)
    stayed = appeared = 0
    for _ in range(30):
        n = found.pairs.listed[0]
        found.pairs.axis[:, :n], found.pairs.face[:, :n] = rng.normal(size=(3, n)), rng.integers(0, 9, (6, n))
        found.pairs.points[:n], found.pairs.given[:n] = rng.integers(0, POINTS + 1, n), rng.normal(size=(n, 4 * POINTS))
        learnt = {pair: (found.pairs.axis[:, m].copy(), found.pairs.face[:, m].copy(), impulses(found.pairs, m))
                  for m, pair in enumerate(found.listed)}
        found.hulls.centre[:] += 3 * velocity
        found.refresh()
        assert found.listed == sorted(set(found.listed))
        for m, (i, j) in enumerate(found.listed):
            difference = found.hulls.centre[:, i] - found.hulls.centre[:, j]
            axis, face, given = learnt.get((i, j), (difference, np.full(6, -1), np.zeros(0)))
            np.testing.assert_array_equal(found.pairs.axis[:, m], axis)
            np.testing.assert_array_equal(found.pairs.face[:, m], face)
            np.testing.assert_array_equal(impulses(found.pairs, m), given)
            stayed, appeared = stayed + ((i, j) in learnt), appeared + ((i, j) not in learnt)
    assert min(stayed, appeared) > 30


def test_full_loses_nothing_and_more_room_is_all_it_needs():
    found = crowd(5, 60, room=1)[0]
    while found.refresh() == FULL:
        assert found.pairs.listed[0] == 0
        grow(found)
    n, expected = found.pairs.listed[0], found.listed
    assert n > 3
    found.pairs.face[:, :n] = 4
    found.hulls.centre[:] *= 0.2
    kept = [value.copy() for value in (*found.pairs, *found.search[:3])]
    results = []
    while (result := found.refresh()) == FULL:
        for value, before in zip((*found.pairs, *found.search[:3]), kept, strict=True):
            np.testing.assert_array_equal(value[tuple(map(slice, before.shape))], before)
        results.append(result)
        grow(found)
        kept = [value.copy() for value in (*found.pairs, *found.search[:3])]
    assert results
    assert result == RENEWED
    assert found.close <= set(found.listed)
    stayed = [m for m, pair in enumerate(found.listed) if pair in expected]
    assert stayed
    assert (found.pairs.face[:, stayed] == 4).all()
    assert found.refresh() == KEPT


def grow(found):
    """Twice the room, as a caller would give it."""
    size = 2 * found.pairs.first.size
    wider = room_for(size)
    for old, new in zip(found.pairs, wider, strict=True):
        new[tuple(map(slice, old.shape))] = old
    found.pairs, found.spare = wider, room_for(size)
    found.search = found.search._replace(code=np.zeros(size, np.int64))


def test_room_of_a_hull_is_its_slack():
    """At rest a part of its reach; in motion, what it will move within the horizon; nothing for what is still."""
    found = Crowd([[0, 10, 20.0], [0, 0, 0], [0, 0, 0]], [1, 2, 3], still=[False, False, True], horizon=10)
    assert found.refresh() == RENEWED
    for hull, reach in ((0, 1), (1, 2)):
        found.hulls.centre[1, hull] = 0.99 * SLACK * reach
        assert found.refresh() == KEPT
        found.hulls.centre[1, hull] = 1.01 * SLACK * reach
        assert found.refresh() == RENEWED
        found.hulls.centre[1, hull] = 0
        found.refresh()
        found.search.made[0] = 0
        assert found.refresh() == RENEWED
    found.hulls.centre[1, 2] = 1e-9
    assert found.refresh() == RENEWED
    found.hulls.centre[0, 0] += 0.5
    assert found.refresh() == RENEWED
    lasted = 0
    found.hulls.centre[0, 0] += 0.5
    while found.refresh() == KEPT:
        found.hulls.centre[0, 0] += 0.5
        lasted += 1
    assert found.horizon <= lasted <= 1.5 * found.horizon


def test_growing_hulls_use_their_slack_too():
    found = Crowd([[0, 2.5], [0, 0], [0, 0]], [1, 1.0], margin=0.1)
    assert found.refresh() == RENEWED
    assert found.listed == []
    found.hulls.reach[:] = 1 + 0.9 * SLACK
    assert found.refresh() == KEPT
    found.hulls.reach[:] = 1.24
    assert found.refresh() == RENEWED
    assert found.listed == [(0, 1)]


@pytest.mark.parametrize("lost", [np.nan, np.inf, -np.inf, 1e300])
def test_a_lost_hull_costs_the_others_nothing(lost):
    found, _ = crowd(1, 150)
    found.refresh()
    found.hulls.centre[:, 5] = lost
    found.refresh()
    listed = found.listed
    assert listed
    assert not any(5 in pair for pair in listed)
    for _ in range(5):
        assert found.refresh() == KEPT
    found.hulls.centre[0, :] += np.where(found.still, 0, 0.05)
    assert found.refresh() == RENEWED
    assert {pair for pair in found.close if 5 not in pair} <= set(found.listed)


@pytest.mark.parametrize("size", [0, 1])
def test_none_and_one(size):
    found = Crowd(np.zeros((3, size)), np.ones(size))
    assert found.refresh() == RENEWED
    assert found.refresh() == KEPT
    assert found.listed == []


@pytest.mark.parametrize("all_pairs", [False, True])
def test_everything_at_one_point_is_full_at_once(all_pairs):
    found = Crowd(np.zeros((3, 100_000)), np.ones(100_000), room=50_000, all_pairs=all_pairs)
    assert found.refresh() == FULL
    assert found.search.made[0] == 0
