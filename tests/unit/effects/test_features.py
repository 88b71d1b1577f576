"""The paper's response: features are moved apart (P20), to a point that the masses choose (P21)."""

import numpy as np
import pytest
import worlds

from verlet_numba.effects.features import begin_features, part_features, part_of_the_way, rub_features
from verlet_numba.effects.meet import find_meetings, gather
from verlet_numba.effects.most_moved import choose_lists, note_places
from verlet_numba.effects.touch import HULLS

PAPER = {"preset": "paper"}
POINTS = ("feature", "body", "printed")
DIE = {"kind": "icosahedron", "name": "die", "radius": 0.2, "position": [0.02, 0.03, 0.31],
       "rotation": {"axis": [1, 2, 3], "degrees": 35}, "velocity": [1, 2, -3]}
CRATE = {"kind": "box", "name": "crate", "size": [0.4, 0.5, 0.3], "position": [0, 0, 0],
         "rotation": {"axis": [0, 1, 2], "degrees": 10}}


class Case:
    """A die in a crate, their features parted once."""

    def __init__(self, point, masses=(1, 10), rub=False, **crate):
        bodies = [DIE | {"mass": masses[0]}, CRATE | {"mass": masses[1]} | crate]
        self.model = worlds.started({"time": {"duration": 1}, "solver": PAPER | {"projection_point": point, "substeps": 4},
                                     "effects": {"friction": 0.5}, "bodies": bodies})
        world = self.model.world
        self.x, self.previous, self.w, _ = world.particles
        self.indices = [index[0] for index in self.model.numbering.bodies]
        e = self.effects = world.effects
        gather(self.x, e.hulls, e.meet)
        assert find_meetings(e.hulls, e.meet, e.rest)
        assert e.meet.meetings.listed[0] == 1
        self.before = self.x.copy()
        begin_features(self.w, e.meet, e.hulls, e.features)
        part_features(self.x, self.w, e.meet, e.hulls, e.features, HULLS)
        if rub:
            self.before = self.x.copy()
            rub_features(self.x, self.previous, self.w, e.meet, e.hulls, e.features, e.friction, HULLS)

    @property
    def sides(self):
        """Of either feature: particles (3,), weights (3,), their order that of the meeting."""
        meetings, hulls = self.effects.meet.meetings, self.effects.hulls
        particles, weights = hulls.particle[meetings.corner[:, 0]], meetings.weight[:, 0]
        return (particles[:3], weights[:3]), (particles[3:], weights[3:])

    def mass(self):
        return np.divide(1, self.w, out=np.zeros_like(self.w), where=self.w > 0)

    def moved(self):
        """How far the contact points of either feature have moved (3,), m."""
        return [(self.x - self.before)[:, particles] @ weights for particles, weights in self.sides]

    def momentum(self):
        """Sum of mass times displacement, and the sum of its sizes."""
        step = self.mass() * (self.x - self.before)
        return step.sum(axis=1), np.linalg.norm(step, axis=0).sum()


def twin(case, point, masses):
    """Positions after P20 and P21, from the equations."""
    x, n = case.before.T.copy(), case.effects.meet.meetings.normal[:, 0]
    points = [weights @ x[particles] for particles, weights in case.sides]
    effective = [1 / sum(case.w[k] * c**2 for k, c in zip(*side, strict=True)) if case.w[side[0]].any() else np.inf
                 for side in case.sides]
    heavy = {"feature": effective, "body": masses, "printed": masses[::-1]}[point]
    if np.inf in effective:
        heavy = [np.inf if mass == np.inf else 1.0 for mass in effective]
    along = [n * (n @ p) for p in points]                   # where two edges cross they are apart along the normal only
    share = heavy[1] / (heavy[0] + heavy[1]) if heavy[1] < np.inf else 1.0
    share = 0.0 if heavy[0] == np.inf else share
    q = along[0] + share * (along[1] - along[0])
    for (particles, weights), p in zip(case.sides, along, strict=True):
        s = sum(case.w[k] * c**2 for k, c in zip(particles, weights, strict=True))
        for k, c in zip(particles, weights, strict=True):
            if s > 0:
                x[k] += case.w[k] * c / s * (q - p)
    return x.T


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("masses", [(1, 10), (10, 1), (2, 2)])
def test_features_are_parted_as_the_equations_say(point, masses):
    case = Case(point, masses)
    np.testing.assert_allclose(case.x, twin(case, point, masses), atol=1e-15)
    a, b = case.moved()
    n, gap = case.effects.meet.meetings.normal[:, 0], case.effects.meet.meetings.gap[0]
    assert gap < -0.01
    np.testing.assert_allclose((a - b) @ n, -gap, rtol=1e-12)
    np.testing.assert_allclose(case.effects.meet.meetings.push[0], -gap, rtol=1e-12)


@pytest.mark.parametrize("masses", [(1, 10), (10, 1), (1, 1)])
def test_effective_masses_keep_the_momentum(masses):
    case = Case("feature", masses)
    total, size = case.momentum()
    np.testing.assert_allclose(total, 0, atol=1e-12 * size)
    light, heavy = sorted(case.moved(), key=np.linalg.norm, reverse=True)
    if masses != (1, 1):
        assert np.linalg.norm(case.moved()[int(np.argmin(masses))]) == np.linalg.norm(light) > np.linalg.norm(heavy)


def test_the_heavier_body_moves_less_unless_eq_10_is_taken_as_it_is_printed():
    for point, (light, heavy) in ((point, map(np.linalg.norm, Case(point).moved())) for point in POINTS):
        if point == "printed":
            assert heavy == pytest.approx(10 * light), "the wrong way round"
            total, size = Case(point).momentum()
            assert np.linalg.norm(total) > 0.5 * size, "momentum is not kept"
        else:
            assert heavy < light
    assert np.linalg.norm(Case("body").moved()[0]) == pytest.approx(10 * np.linalg.norm(Case("body").moved()[1]))


@pytest.mark.parametrize("point", POINTS)
def test_pins_never_move(point):
    case = Case(point, fixed=True)
    np.testing.assert_array_equal(case.x[:, case.indices[1]], case.before[:, case.indices[1]])
    np.testing.assert_allclose(case.x, twin(case, point, (1, 10)), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(case.moved()[0]), -case.effects.meet.meetings.gap[0], rtol=1e-12)


@pytest.mark.parametrize(("shares", "expected"), [((0, 0.0, 2.0), 0.0), ((0, 2.0, 0.0), 1.0), ((0, 1.0, 3.0), 0.25)])
def test_shares_of_the_way(shares, expected):
    assert part_of_the_way(*shares, 1.0, 1.0) == expected


def test_friction_takes_back_what_its_cone_holds_and_keeps_the_momentum():
    case = Case("feature", rub=True)
    total, size = case.momentum()
    assert size > 0
    np.testing.assert_allclose(total, 0, atol=1e-12 * size)
    a, b = case.moved()
    n, push = case.effects.meet.meetings.normal[:, 0], case.effects.meet.meetings.push[0]
    assert abs((a - b) @ n) < 1e-15
    slide = [weights @ (case.before - case.previous)[:, particles].T for particles, weights in case.sides]
    slide = slide[0] - slide[1]
    slide -= (slide @ n) * n
    np.testing.assert_allclose(b - a, slide * min(1.0, 0.5 * push / np.linalg.norm(slide)), atol=1e-15)


def test_the_particle_that_parting_moved_most_leads_the_relaxation():
    case = Case("feature")
    graph, collided = case.model.world.graph, case.model.world.collided
    note_places(case.before, collided)
    choose_lists(case.x, collided, graph)
    way = np.linalg.norm(case.x - case.before, axis=0)
    for b, first in enumerate(graph.body[0]):
        index = next(index for index in case.indices if index[0] == first)
        assert collided.moved[b] == np.argmax(way[index])
    choose_lists(case.before, collided, graph)
    assert (collided.moved == -1).all()


def test_nothing_to_part_is_nothing():
    begin_features(None, None, None, None)
    part_features(None, None, None, None, None, HULLS)
    rub_features(None, None, None, None, None, None, None, HULLS)
