"""Bodies that answer as a whole: what one substep's touches give keeps momentum, pushes, and holds within the cone."""

import numpy as np
import pytest
import worlds
from scipy.spatial.transform import Rotation

from verlet_numba.effects.aim import RECOVERY, SHARE, aim_colliders, aim_hulls, left_for_later, respond, still_given
from verlet_numba.effects.meet import find_meetings, gather
from verlet_numba.effects.recall import begin_pass, keep_hulls, recall_colliders, recall_hulls
from verlet_numba.effects.response import displace, kick_back, link, rebound, shove
from verlet_numba.effects.touch import HULLS, begin_touches, touch_colliders, touch_hulls, weigh

H = 1 / 240
DIE = {"kind": "icosahedron", "name": "die", "radius": 0.2, "mass": 1, "position": [0, 0, 0]}
CRATE = {"kind": "box", "name": "crate", "size": [0.3, 0.4, 0.3], "mass": 2, "position": [0.3, 0.05, 0.02],
         "rotation": {"axis": [1, 3, 2], "degrees": 25}}
SMOOTH, ROUGH = 0.0, 0.5


class Case:
    """Bodies that have just run into each other; the phases of the response, as in a frame."""

    def __init__(self, bodies, friction=ROUGH):
        self.model = worlds.started({"time": {"duration": 1}, "solver": {"substeps": 4}, "bodies": bodies,
                                     "effects": {"friction": friction} if friction else {}})
        world = self.model.world
        self.x, self.previous, self.w, _ = world.particles
        self.effects, self.indices = world.effects, [index for body in self.model.numbering.bodies for index in body]
        self.rigid, self.touches, self.meet = world.effects.rigid, world.effects.touches, world.effects.meet

    def shift(self, b, by):
        """Body b is now displaced from where it was a substep ago."""
        self.x[:, self.indices[b]] += np.array(by, float)[:, None]

    def found(self, number=5):
        """Touches are found, weighed and aimed."""
        e = self.effects
        gather(self.x, e.hulls, e.meet)
        assert find_meetings(e.hulls, e.meet, e.rest)
        begin_touches(e.rigid, e.touches)
        touch_colliders(e.contact, e.friction, e.restitution, e.rigid, e.touches)
        touch_hulls(e.meet, e.hulls, e.friction, e.restitution, e.rigid, e.touches, HULLS)
        weigh(self.x, self.previous, self.w, e.rigid)
        link(e.rigid, e.touches)
        recall_colliders(e.contact, e.rigid, e.touches, number)
        recall_hulls(e.meet, e.rigid, e.touches, HULLS, number)
        aim_colliders(self.x, e.contact, e.rigid, e.touches, number, H)
        aim_hulls(e.meet, e.hulls, e.contact, e.rigid, e.touches, HULLS, number, H)
        respond(e.friction, e.rigid, e.touches)
        self.count = self.touches.until[-1]
        assert self.count > 0
        return self

    def solved(self):
        """The particles are displaced by what the touches give."""
        begin_pass(0, self.effects.friction, self.rigid, self.touches)
        shove(self.effects.friction, self.rigid, self.touches)
        displace(self.x, self.w, self.rigid)
        return self

    def kicked(self):
        rebound(self.effects.friction, self.rigid, self.touches)
        kick_back(self.x, self.previous, self.w, self.rigid)
        return self

    line = property(lambda self: self.touches.line[:self.count])
    answer = property(lambda self: self.touches.answer[:self.count])
    given = property(lambda self: self.touches.given[:self.count])

    def momentum(self, twists, b):
        """Linear and angular momentum about the origin that a twist is, with the inertia that the simulator weighed."""
        row, twist = self.rigid.mass[b], twists[b]
        inertia = np.linalg.inv(np.array([[row[4], row[7], row[8]], [row[7], row[5], row[9]], [row[8], row[9], row[6]]]))
        linear, before = twist[:3] / row[0], row[1:4] - self.rigid.moved[b, :3]       # where the impulses took hold
        return linear, inertia @ twist[3:] + np.cross(before, linear)


def collided(friction=ROUGH, masses=(1, 2), seed=0):
    """A die and a crate that have run into each other, any way round."""
    rng = np.random.default_rng(seed)
    die = {**DIE, "mass": masses[0], "velocity": [3, 0.5, 0.3], "angular_velocity": list(rng.normal(size=3) * 5),
           "rotation": {"axis": list(rng.normal(size=3)), "degrees": 40 * seed}}
    crate = {**CRATE, "mass": masses[1], "velocity": [-3, 0, 0.4], "angular_velocity": list(rng.normal(size=3) * 5)}
    case = Case([die, crate], friction)
    case.shift(0, [0.013, 0.002, 0.001])
    case.shift(1, [-0.013, 0, 0.002])
    return case.found()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("friction", [SMOOTH, ROUGH], ids=["smooth", "rough"])
def test_two_bodies_keep_momentum_and_angular_momentum(friction, seed):
    case = collided(friction, seed=seed)
    before, kick = case.x.copy(), case.rigid.kick
    case.solved()
    step = case.x - before
    mass = np.divide(1, case.w, out=np.zeros_like(case.w), where=case.w > 0)
    scale = (mass * np.linalg.norm(step, axis=0)).sum()
    assert scale > 1e-3
    np.testing.assert_allclose((mass * step).sum(1), 0, atol=1e-12 * scale)
    case.kicked()
    for twists in (case.rigid.moved, kick):
        (p, l), (q, k) = (case.momentum(twists, b) for b in range(2))
        np.testing.assert_allclose(p + q, 0, atol=1e-12 * np.abs(p).max())
        np.testing.assert_allclose(l + k, 0, atol=1e-12 * np.abs(np.r_[l, k]).max())


def test_the_heavier_moves_less():
    case = collided(masses=(1, 10))
    before = case.x.copy()
    case.solved()
    light, heavy = ((case.x - before)[:, index].mean(axis=1) for index in case.indices)
    np.testing.assert_allclose(light, -10 * heavy, rtol=1e-9)
    assert np.linalg.norm(light) > 1e-3


def test_touches_push_and_never_pull():
    """Every gap is opened or nothing is pushed there: 0 <= push, gap left >= 0, one of them 0."""
    for seed in range(6):
        case = collided(SMOOTH, seed=seed).solved()
        left = [line[:3] @ relative(case, t) - case.answer[t, 0] for t, line in enumerate(case.line)]
        assert (case.given[:, 0] >= 0).all()
        assert case.given[:, 0].max() > 0
        scale = case.given[:, 0].max() / case.answer[:, 1].min()
        assert min(left) > -1e-4 * scale
        assert all(push == 0 or abs(gap) < 1e-4 * scale for push, gap in zip(case.given[:, 0], left, strict=True))


def relative(case, t, twists=None):
    """Displacement of the first against the second entity at the arms of touch t."""
    a, b, line = case.touches.first[t], case.touches.second[t], case.line[t]
    moved = case.rigid.moved if twists is None else twists
    return (moved[a, :3] + np.cross(moved[a, 3:], line[3:6])) - (moved[b, :3] + np.cross(moved[b, 3:], line[6:9]))


@pytest.mark.parametrize("friction", [0.05, 0.5, 5.0])
def test_grip_lies_within_the_cone_of_friction(friction):
    """On its edge where it slides still, within where it holds; and it never speeds a slide up."""
    slid = stuck = 0
    for seed in range(6):
        case = collided(friction, seed=seed)
        slides = case.line[:, 9:12].copy()
        case.solved()
        for t in range(case.count):
            push, grip, n = case.given[t, 0], np.linalg.norm(case.given[t, 1:3]), case.line[t, :3]
            assert grip <= friction * push * (1 + 1e-12) + 1e-18
            if push > 0:
                slide = slides[t] + relative(case, t)
                slide -= (slide @ n) * n
                sliding = np.linalg.norm(slide) > 1e-2 * np.linalg.norm(slides[t])
                slid, stuck = slid + sliding, stuck + (not sliding)
                if sliding:
                    assert grip == pytest.approx(friction * push, rel=0.05)
    assert slid if friction < 0.1 else stuck


def test_a_touch_through_both_centres_is_an_impact_of_points():
    """Two crates face to face, speeds as given: both leave with the momentum of both, and nothing turns."""
    boxes = [{**CRATE, "name": name, "rotation": {"axis": [1, 0, 0], "degrees": 0}, "position": [x, 0, 0], "mass": m,
              "velocity": [v, 0, 0]} for name, x, m, v in (("a", 0, 1, 2), ("b", 0.3, 3, -1))]
    case = Case(boxes, SMOOTH)
    case.shift(0, [2 * H, 0, 0])
    case.shift(1, [-H, 0, 0])
    case.previous[:] = case.x
    case.previous[0, case.indices[0]] -= 2 * H
    case.previous[0, case.indices[1]] += H
    case.found().solved()
    assert case.count == 4
    steps = [(case.x - case.previous)[:, index] for index in case.indices]
    common = (1 * 2 - 3 * 1) / 4 * H
    for step in steps:
        np.testing.assert_allclose(step, np.array([[common], [0], [0]]) * np.ones_like(step), atol=1e-6 * H)


def test_an_overlap_at_the_start_is_given_back_slowly_and_leaves_no_speed():
    boxes = [{**CRATE, "name": name, "rotation": {"axis": [1, 0, 0], "degrees": 0}, "position": [x, 0, 0]}
             for name, x in (("a", 0), ("b", 0.2))]
    case = Case(boxes, SMOOTH).found(number=0)
    reach = case.rigid.reach[0]
    apart = []
    for number in range(3):
        case.solved().kicked()
        apart.append(np.diff([case.x[0, index].mean() for index in case.indices])[0])
        assert np.abs(case.x - case.previous).max() < 1e-12     # where it is, it is at rest
        keep_hulls(case.meet, case.rigid, case.touches, HULLS)
        case.previous[:] = case.x
        case.found(number + 1)
    np.testing.assert_allclose(apart, 0.2 + RECOVERY * reach * H * np.arange(3), rtol=1e-4)


@pytest.mark.parametrize(("overlap", "met", "left"), [
    (0.3, 9, 0.2), (0.05, 9, 0.0), (0.3, 10, 0.3), (0.3, 8, np.inf), (0.0, -2, np.inf)],
    ids=["shrinks", "is gone", "aimed once more", "met anew", "met first"])
def test_what_an_overlap_may_still_be(overlap, met, left):
    assert still_given(overlap, met, 10, 0.1) == pytest.approx(left)


def test_all_of_an_overlap_stands_at_first_however_often_it_is_aimed_at():
    """A crate that leans into another overlaps it by more at some contacts than at others; the deepest is what the pair keeps."""
    low, high = {"degrees": 0, "axis": [0, 0, 1]}, {"degrees": 0.5, "axis": [2, 1, 0]}
    case = Case([{**CRATE, "name": "low", "position": [0, 0, 0], "rotation": low},
                 {**CRATE, "name": "high", "position": [0.02, 0.01, 0.28], "rotation": high}], SMOOTH).found(number=3)
    for _ in range(3):
        np.testing.assert_allclose(case.answer[:, 0], 0, atol=1e-15)
        aim_hulls(case.meet, case.effects.hulls, None, case.rigid, case.touches, HULLS, 3, H)
    depth = case.model.world.effects.hulls.corner[2, :8].max() - case.x[2, case.indices[1]].min()
    assert case.count > 1
    assert case.meet.pairs.overlap[0] == pytest.approx(depth, rel=0.05)
    assert (case.line[:, 2] > 0.9).all() or (case.line[:, 2] < -0.9).all()


@pytest.mark.parametrize(("standing", "overlap", "push", "left"), [
    (0.5, 0.0, 0.0, 0.0), (0.5, 0.4, 0.0, 0.4), (-0.5, 0.0, 0.0, 0.0), (0.5, 0.0, 1.0, 0.5 * (1 - SHARE)), (0.5, 0.45, 1.0, 0.45),
    (-0.5, 0.0, 1.0, -0.5 * (1 - SHARE)),
    (9.0, 0.0, 1.0, 0.6), (-9.0, 0.0, 1.0, -0.6), (9.0, 0.7, 1.0, 0.7)],
    ids=["met anew", "overlapped then", "closes", "pushes on", "is slower still", "is open", "is deep", "is wide", "is both"])
def test_what_is_left_of_a_gaps_error(standing, overlap, push, left):
    assert left_for_later(standing, overlap, push, 0.6) == pytest.approx(left)


def test_a_substep_begins_with_what_every_contact_gave_in_the_last():
    """Push and grip, whatever way the two directions across lie; and if the contacts are others, with their sum."""
    boxes = [{**CRATE, "name": name, "rotation": {"axis": [1, 0, 0], "degrees": 0}, "position": [x, 0.01 * x, 0]}
             for name, x in (("a", 0), ("b", 0.3))]
    case = Case(boxes)
    case.shift(0, [0.001, 0.0003, 0.0001])
    case.found(number=0).solved()
    given, line = case.given.copy(), case.line.copy()
    assert case.count == 4
    assert given[:, 0].max() > 0
    assert np.abs(given[:, 1:3]).max() > 0
    keep_hulls(case.meet, case.rigid, case.touches, HULLS)
    case.found(number=1)
    begin_pass(0, case.effects.friction, case.rigid, case.touches)
    np.testing.assert_allclose(case.given[:, 0], given[:, 0], rtol=1e-12)
    for t, row in enumerate(case.line):
        grip = given[t, 1] * line[t, 12:15] + given[t, 2] * line[t, 15:18]
        across = grip - (grip @ row[:3]) * row[:3]
        again = case.given[t, 1] * row[12:15] + case.given[t, 2] * row[15:18]
        np.testing.assert_allclose(again, across, atol=1e-12 * np.abs(given).max())
    p = case.meet.meetings.pair[case.touches.source[0]]
    case.meet.pairs.points[p] = 3
    three = case.meet.pairs.given[p, :12].reshape(3, 4).sum(axis=0)
    recall_hulls(case.meet, case.rigid, case.touches, HULLS, 1)
    np.testing.assert_allclose(case.touches.recalled[:4], np.broadcast_to(three / 4, (4, 4)), rtol=1e-12)
    recall_hulls(case.meet, case.rigid, case.touches, HULLS, 3)
    assert np.abs(case.touches.recalled[:4]).max() == 0


def test_a_body_turns_exactly():
    """By a large twist its shape is kept to rounding, and pins stay where they are."""
    case = collided()
    before, centre = case.x.copy(), case.rigid.mass[0, 1:4].copy()
    turn, shift = np.array([0.7, -1.1, 0.4]), np.array([0.1, 0.2, 0.3])
    case.rigid.twist[0] = [*shift, *turn]
    displace(case.x, case.w, case.rigid)
    expected = centre + shift + (before[:, case.indices[0]].T - centre) @ Rotation.from_rotvec(turn).as_matrix().T
    np.testing.assert_allclose(case.x[:, case.indices[0]].T, expected, atol=1e-15)
    np.testing.assert_array_equal(case.x[:, case.indices[1]], before[:, case.indices[1]])
    np.testing.assert_allclose(case.rigid.moved[0], [*shift, *turn])


def test_a_body_that_is_pinned_altogether_does_not_move():
    case = Case([{**DIE, "position": [0.02, 0, 0]}, {**CRATE, "fixed": True}])
    before = case.x.copy()
    case.shift(0, [0.05, 0, 0])
    case.found().solved()
    np.testing.assert_array_equal(case.x[:, case.indices[1]], before[:, case.indices[1]])
    assert np.abs(case.x[:, case.indices[0]] - before[:, case.indices[0]]).max() > 0


def test_nothing_to_answer_is_nothing():
    for phase in (lambda: aim_colliders(None, None, None, None, 0, H), lambda: aim_hulls(None, None, None, None, None, HULLS, 0, H),
                  lambda: respond(None, None, None), lambda: link(None, None), lambda: shove(None, None, None),
                  lambda: displace(None, None, None), lambda: rebound(None, None, None), lambda: kick_back(None, None, None, None)):
        assert phase() is None
