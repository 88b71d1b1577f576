"""Which bodies are put to rest and which are woken, against plain loops over sets."""

from itertools import pairwise

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.buffers.contact import FIXED, HUNG, LOOSE, RESTLESS
from verlet_numba.effects.rest import at_rest, count_slow, depth_at_rest, hold, idle, settle, wake
from verlet_numba.kernels.candidates import NEVER

CUBES = 8
SCENE = {
    "time": {"duration": 1, "frame_rate": 60},
    "solver": {"substeps": 10},
    "effects": {"gravity": [0, 0, -9.81], "rest": {"speed": 0.6, "time": 0.005}},
    "bodies": [{"kind": "box", "name": f"cube{k}", "size": [0.2, 0.2, 0.2], "mass": 1, "position": [0.5 * k, 0, 0.1]}
               for k in range(CUBES)],
    "colliders": [{"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]},
                  {"kind": "sphere", "radius": 0.1, "position": [0, 1, 5]}]}
DRIFT, WAIT, STEP = 3e-3, 3, 1 / 600


class Scene:
    """A built scene whose contacts and motion are made up."""

    def __init__(self, scene=SCENE):
        model = worlds.started(scene)
        self.particles, self.effects = model.world.particles, model.world.effects
        self.rest, self.contact, self.meet, self.hulls = (self.effects.rest, self.effects.contact, self.effects.meet,
                                                          self.effects.hulls)
        self.particles.previous[:] = self.rest.anchor[:] = self.particles.position
        self.number = 10

    def meets(self, pairs, push):
        """Hulls (body numbers) that meet, and how they pushed in the last substep."""
        self.meet.pairs.listed[0] = self.meet.meetings.listed[0] = len(pairs)
        for m, (a, b) in enumerate(pairs):
            self.meet.pairs.first[m], self.meet.pairs.second[m], self.meet.meetings.pair[m] = a, b, m
            self.meet.pairs.push[m], self.meet.pairs.met[m] = push[m], self.number - 1

    def stands(self, bodies):
        """Bodies that the plane pushes, each at its first particle."""
        self.contact.listed[0] = len(bodies)
        for c, b in enumerate(bodies):
            self.contact.particle[c], self.contact.push[c] = self.rest.first[b], 1.0
            self.contact.met[self.rest.first[b]] = self.number - 1

    def settle(self):
        settle(self.particles.position, self.particles.previous, self.number, self.rest, self.contact, self.hulls, self.meet,
               self.effects.points, self.effects.mixed, self.effects.touches, self.effects.features)
        return set(np.flatnonzero(self.rest.resting))

    def wake(self, moving=None):
        self.number += 5
        woken = wake(self.particles.position, self.particles.acceleration, self.particles.inverse_mass, self.number, STEP,
                     self.rest, self.contact, self.hulls, self.meet, self.effects.points, self.effects.mixed, moving)
        return woken, set(np.flatnonzero(self.rest.resting))

    def rests(self, *islands):
        """Put islands to rest that hang together in chains, the first body of each on the plane."""
        chains = [(a, b) for island in islands for a, b in pairwise(island)]
        self.rest.slow[:] = 0
        self.rest.slow[[b for island in islands for b in island]] = WAIT
        self.meets(chains, np.ones(len(chains)))
        self.stands([island[0] for island in islands])
        self.settle()


def test_speed_and_time_in_substeps():
    rest = Scene().rest
    assert rest.drift == pytest.approx(DRIFT)
    assert rest.wait == WAIT
    assert rest.awake[0] == CUBES


def test_slow_is_what_no_particle_of_moves_far():
    """A motion of one particle is one of its body; from where it went too far it starts anew; what is not a number is not slow."""
    scene = Scene()
    motion = np.zeros_like(scene.particles.position)
    index = [np.flatnonzero(scene.rest.body == b) for b in range(CUBES)]
    motion[2, index[1][3]], motion[0, index[2][0]], motion[1, index[3][5]] = 1.1 * DRIFT, 0.9 * DRIFT, np.nan
    motion[:, index[4][2]] = 0.6 * DRIFT           # sqrt(3) 0.6 > 1
    scene.particles.position[:] += motion
    ripe = [count_slow(scene.particles.position, scene.rest) for _ in range(WAIT)]
    assert list(scene.rest.slow) == [3, 2, 3, 0, 2, 3, 3, 3]
    assert ripe == [0, 0, 5]


bodies = st.integers(0, CUBES - 1)
links = st.lists(st.tuples(bodies, bodies).filter(lambda pair: pair[0] != pair[1]), max_size=12)


@settings(max_examples=200, deadline=None)
@given(links, st.lists(st.sampled_from([0, WAIT - 1, WAIT, 50]), min_size=CUBES, max_size=CUBES), st.sets(bodies),
       st.lists(st.tuples(bodies, st.booleans()), max_size=3), st.lists(st.integers(0, 3), min_size=CUBES, max_size=CUBES))
def test_islands_rest_that_are_slow_and_held_up(pairs, slow, standing, on_sphere, kinds):
    scene, kinds = Scene(), np.array(kinds)
    sphere = len(scene.hulls.body) - 1
    scene.rest.kind[:], scene.rest.slow[:] = kinds, np.where(kinds < RESTLESS, slow, 0)
    scene.rest.quiet[:CUBES] = kinds == FIXED
    scene.meets([*pairs, *((b, sphere) for b, _ in on_sphere)], [*np.ones(len(pairs)), *(float(p) for _, p in on_sphere)])
    scene.stands(sorted(standing))

    island = {b: {b} for b in range(CUBES) if kinds[b] != FIXED}
    held = {b for b in island if b in standing or kinds[b] == HUNG} | {b for b, pushed in on_sphere if pushed}
    for a, b in pairs:
        if a in island and b in island:
            together = island[a] | island[b]
            for c in together:
                island[c] = together
        else:
            held |= {a, b}
    ripe = {b for b in island if kinds[b] < RESTLESS and slow[b] + 1 >= WAIT}
    expected = {b for b in island if island[b] <= ripe and island[b] & held}
    assert scene.settle() == expected
    assert at_rest(scene.rest) == len(expected)
    assert scene.rest.awake[0] == CUBES - len(expected)
    still = np.isin(scene.rest.body, sorted(expected))
    np.testing.assert_array_equal(scene.rest.free, np.where(still, 0.0, scene.particles.inverse_mass))
    quiet = [b in expected or kinds[b] == FIXED for b in range(CUBES)]
    np.testing.assert_array_equal(scene.rest.quiet[:sphere], quiet)
    assert scene.rest.quiet[sphere] == 1


def test_nothing_rests_in_mid_air():
    """However long it is slow, alone or with others, or near a collider that does not push it."""
    scene = Scene()
    scene.meets([(0, 1), (2, len(scene.hulls.body) - 1)], [1.0, 0.0])
    scene.stands([3])
    scene.contact.push[0] = 0.0
    for _ in range(100):
        assert scene.settle() == set()
    assert scene.rest.slow.min() == 100


def test_what_rests_is_held_where_it_is():
    scene = Scene()
    scene.particles.position[:] += 0.3 * DRIFT
    scene.rests([0, 1], [4])
    place, before = scene.particles.position.copy(), scene.particles.previous.copy()
    still = np.isin(scene.rest.body, [0, 1, 4])
    np.testing.assert_array_equal(before[:, still], place[:, still])         # its speed is gone
    assert (before[:, scene.rest.body == 2] != place[:, scene.rest.body == 2]).all()
    scene.particles.position[:] += 1.0
    hold(scene.particles.position, scene.particles.previous, scene.particles.inverse_mass, scene.rest)
    np.testing.assert_array_equal(scene.particles.position, np.where(still, place, place + 1.0))


def test_what_is_awake_wakes_the_whole_island():
    scene = Scene()
    scene.particles.acceleration[2] = np.where(scene.particles.inverse_mass > 0, -9.81, 0)
    scene.particles.previous[0] -= 1e-4
    scene.rests([0, 1, 2], [4, 5], [6])
    scene.meet.meetings.listed[0] = 0
    place, moved = scene.particles.position.copy(), np.isin(scene.rest.body, [0, 1, 2])
    pairs, contact = scene.meet.pairs, scene.contact
    assert scene.wake() == (False, {0, 1, 2, 4, 5, 6})
    scene.meets([(0, 1), (1, 2), (4, 5), (2, 3)], np.ones(4))
    pairs.met[:4] = [9, 9, 9, NEVER]
    scene.meet.meetings.pair[0], scene.meet.meetings.listed[0] = 3, 1      # what rests does not meet: 2 with 3 alone does
    assert scene.wake() == (True, {4, 5, 6})
    np.testing.assert_array_equal(pairs.met[:4], [scene.number - 1, scene.number - 1, 9, NEVER])
    assert contact.met[scene.rest.first[0]] == scene.number - 1
    assert contact.met[scene.rest.first[4]] == 9
    np.testing.assert_array_equal(scene.rest.free == 0, np.isin(scene.rest.body, [4, 5, 6]) | (scene.particles.inverse_mass == 0))
    step = np.zeros_like(place)
    step[2, moved] = -9.81 * STEP**2
    step[0, moved] = 1e-4           # its last motion
    np.testing.assert_allclose(scene.particles.position, place + step, atol=1e-15)
    np.testing.assert_array_equal(scene.particles.previous[:, moved], place[:, moved])
    assert scene.rest.awake[0] == CUBES - 3
    assert list(scene.rest.slow[:3]) == [0, 0, 0]


@pytest.mark.parametrize(("place", "expected"), [([0.5, 0, 0.1], {4}), ([0.5, 0, 0.1 + 3.0], {0, 1, 4}), ([2, 0.3, 0.1], {0, 1})])
def test_colliders_that_move_wake_what_is_near(place, expected):
    scene = Scene(worlds.with_changes(SCENE) | {"colliders": [SCENE["colliders"][0], SCENE["colliders"][1] | {
        "path": [[0, 0, 0, 0], [1, 1, 0, 0]]}]})
    scene.rests([0, 1], [4])
    scene.meet.meetings.listed[0] = 0
    solids, moving = scene.contact.solids, scene.effects.moving
    solids.origin[:, 1] = solids.origin_before[:, 1] = place
    assert scene.wake(moving) == (False, {0, 1, 4})
    solids.origin_before[:, 1] -= 0.01
    woken, resting = scene.wake(moving)
    assert woken == (resting != {0, 1, 4})
    assert resting == expected
    assert not idle(scene.rest, moving)


def test_nothing_is_left_to_do_once_all_rest():
    scene = Scene()
    assert not idle(scene.rest, None)
    scene.rests(list(range(CUBES)))
    assert idle(scene.rest, None)
    assert scene.contact.listed[0] == scene.meet.meetings.listed[0] == scene.effects.touches.until.max() == 0


def test_depth_is_kept_while_an_island_rests():
    scene = Scene()
    meetings, hulls = scene.meet.meetings, scene.hulls
    meetings.corner[:3, 0], meetings.corner[3:, 0], meetings.weight[:, 0] = hulls.start[1], hulls.start[0], [1, 0, 0, 1, 0, 0]
    p, q = (scene.particles.position[:, hulls.particle[hulls.start[b]]] for b in (1, 0))
    meetings.normal[:, 0] = (q - p) / np.linalg.norm(q - p)
    assert depth_at_rest(scene.rest) == 0
    scene.rests([0, 1])
    assert depth_at_rest(scene.rest) == pytest.approx(np.linalg.norm(p - q))


def test_what_deformable_bodies_touch_is_awake():
    """It does not come to rest, nor does its island; and at rest it wakes with its island. All others rest."""
    rope = {"kind": "rope", "name": "line", "start": [0, 0, 2], "end": [1, 0, 2], "segments": 2, "mass": 1}
    scene = Scene(SCENE | {"bodies": [*SCENE["bodies"], rope]})
    mixed, first = scene.effects.mixed, len(scene.effects.points.body) - 3
    mixed.pairs.first[:2], mixed.pairs.second[:2], mixed.meetings.pair[0], mixed.meetings.listed[0] = [4, 2], first, 1, 1
    scene.rests([0, 1], [2, 3], [4, 5])
    assert set(np.flatnonzero(scene.rest.resting)) == {0, 1, 4, 5}
    assert scene.rest.slow[2] == 0
    scene.meet.meetings.listed[0] = mixed.meetings.listed[0] = 0
    assert scene.wake() == (False, {0, 1, 4, 5})
    mixed.meetings.pair[0], mixed.meetings.listed[0] = 0, 1
    assert scene.wake() == (True, {0, 1})


def test_kinds_of_bodies():
    cube, corners = SCENE["bodies"][0], list(range(8))
    more = [cube | {"name": "fixed", "fixed": True}, cube | {"name": "hung", "position": [0, 2, 1], "pinned": [0, 1]},
            cube | {"name": "carried", "position": [0, 4, 1], "pinned": corners, "path": [[0, 0, 0, 0], [1, 1, 0, 0]]},
            cube | {"name": "tied", "position": [0, 6, 1]}]
    rest = Scene(SCENE | {"bodies": [SCENE["bodies"][1], *more], "attachments": [["carried", 5, "tied", 7]]}).rest
    assert list(rest.kind) == [LOOSE, FIXED, HUNG, RESTLESS, RESTLESS]
    assert rest.awake[0] == 4                   # all but the fixed one
    assert list(rest.quiet) == [0, 1, 0, 0, 0, 1]


def test_absent_rest_leaves_no_trace():
    assert worlds.built(worlds.with_changes(SCENE, effects={"rest": None})).world.effects.rest is None
    assert worlds.built(SCENE | {"bodies": [SCENE["bodies"][0] | {"fixed": True}]}).world.effects.rest is None
    assert at_rest(None) == depth_at_rest(None) == 0
    assert not idle(None, None)
    assert not wake(None, None, None, 0, 0.1, *[None] * 7)
    hold(None, None, None, None)
    settle(None, None, 0, *[None] * 8)
