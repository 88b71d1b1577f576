"""Which entities touch, and mass, centre, inertia and twist of each from its particles alone."""

import numpy as np
import pytest
import worlds

from verlet_numba.effects.touch import HULLS, begin_touches, touch_colliders, touch_hulls, weigh

DIE = {"kind": "icosahedron", "name": "die", "radius": 0.2, "mass": 3, "position": [0, 0, 0.3]}
CRATE = {"kind": "box", "name": "crate", "size": [0.2, 0.3, 0.5], "mass": 2, "position": [1, 0, 0.3]}


def scene(bodies):
    return {"time": {"duration": 1}, "effects": {"gravity": [0, 0, -9.81], "friction": 0.5}, "bodies": bodies,
            "colliders": [{"kind": "plane"}]}


class Case:
    """Bodies with random positions and steps of their particles, and what the simulator weighs."""

    def __init__(self, bodies, seed=0, line=()):
        self.model = worlds.started(scene(bodies))
        world, rng = self.model.world, np.random.default_rng(seed)
        self.indices = [index for body in self.model.numbering.bodies for index in body]
        x, previous, self.inverse_mass, _ = world.particles
        x += 0.01 * rng.normal(size=x.shape)
        for place, p in enumerate(line):                # pins on a line
            x[:, self.indices[0][p]] = [0.1 * place, 0.2 * place, 0.3 - place]
        previous[:] = x - 0.01 * rng.normal(size=x.shape)
        self.x, self.previous, self.rigid = x, previous, world.effects.rigid
        self.rigid.order[:len(self.indices)] = np.arange(len(self.indices))
        self.rigid.touched[0] = len(self.indices)
        self.rigid.parent[:len(self.indices)] = np.arange(len(self.indices))
        weigh(x, previous, self.inverse_mass, self.rigid)

    def body(self, b):
        """Positions, steps (P, 3), masses (P,), infinite for pins, of body b."""
        index = self.indices[b]
        w = self.inverse_mass[index]
        mass = np.divide(1, w, out=np.full(len(w), np.inf), where=w > 0)
        return self.x[:, index].T, (self.x - self.previous)[:, index].T, mass


def matrix(xx, yy, zz, xy, xz, yz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia(r, mass):
    return sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(mass, r, strict=True))


def check(case, b, mass, centre, inverse, shift, turn):
    row = case.rigid.mass[b]
    np.testing.assert_allclose(row[:4], [mass, *centre], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(matrix(*row[4:]), inverse, rtol=1e-9, atol=1e-10 * np.abs(inverse).max())
    np.testing.assert_allclose(case.rigid.step[b], [*shift, *turn], rtol=1e-9, atol=1e-12)
    for given in (case.rigid.twist, case.rigid.moved, case.rigid.kick):
        assert not given[b].any()


@pytest.mark.parametrize("seed", range(3))
def test_free_bodies(seed):
    case = Case([DIE, CRATE, {**DIE, "name": "twins", "count": 3, "scatter": {"inside": [[2, 2, 2], [5, 5, 5]]}}], seed)
    assert len(case.indices) == 5
    for b in range(5):
        x, step, mass = case.body(b)
        centre, shift = x.mean(axis=0), step.mean(axis=0)
        r = x - centre
        inverse = np.linalg.inv(inertia(r, mass))
        check(case, b, 1 / mass.sum(), centre, inverse, shift, inverse @ (mass[:, None] * np.cross(r, step)).sum(0))


@pytest.mark.parametrize(("pins", "line"), [([4], []), ([0, 7], []), ([2, 5, 6], []), ([1, 3, 6], [1, 3, 6])],
                         ids=["pivot", "axis", "held", "three on an axis"])
def test_pins_leave_what_freedom_remains(pins, line):
    case = Case([{**CRATE, "pinned": pins}], line=line)
    x, step, mass = case.body(0)
    held = np.isinf(mass)
    assert list(np.flatnonzero(held)) == pins
    centre, shift = x[held].mean(axis=0), step[held].mean(axis=0)
    r, moved, m = (x - centre)[~held], (step - shift)[~held], mass[~held]
    about = inertia(r, m)
    if len(pins) == 1:
        inverse = np.linalg.inv(about)
    elif len(pins) == 2 or line:
        axis = x[pins[1]] - x[pins[0]]
        axis /= np.linalg.norm(axis)
        inverse = np.outer(axis, axis) / (axis @ about @ axis)
    else:
        inverse = np.zeros((3, 3))
    check(case, 0, 0, centre, inverse, shift, inverse @ (m[:, None] * np.cross(r, moved)).sum(0))


def test_a_twist_of_the_step_is_found_again():
    """A body displaced by a small twist has that twist, up to its square."""
    case = Case([DIE])
    shift, turn = np.array([1e-3, 2e-3, -1e-3]), 1e-6 * np.array([3, -1, 2])
    x = case.x[:, case.indices[0]].T
    case.previous[:, case.indices[0]] = (x - shift - np.cross(turn, x - x.mean(axis=0))).T
    weigh(case.x, case.previous, case.inverse_mass, case.rigid)
    np.testing.assert_allclose(case.rigid.step[0], [*shift, *turn], rtol=1e-7)


def test_touches_are_contacts_and_meetings_with_the_world_as_second():
    """Two crates on each other and the floor, one on a box: every touch names its entities, nothing else is touched."""
    low, high = {**CRATE, "position": [0, 0, 0.25]}, {**CRATE, "name": "lid", "position": [0, 0, 0.75]}
    away, perched = {**CRATE, "name": "far", "position": [5, 0, 2]}, {**CRATE, "name": "hen", "position": [2, 0, 0.45]}
    data = scene([low, high, away, perched])
    data["colliders"].append({"kind": "box", "size": [0.4, 0.4, 0.2], "position": [2, 0, 0.1], "friction": 0.2})
    model = worlds.started(data)
    worlds.advanced(model, 2)
    effects = model.world.effects
    touches, rigid = effects.touches, effects.rigid
    world, until = rigid.size.size - 1, touches.until
    assert set(zip(touches.first[:until[0]], touches.second[:until[0]], strict=True)) == {(0, world)}
    assert until[0] == 4
    between = sorted(set(zip(touches.first[until[0]:until[1]], touches.second[until[0]:until[1]], strict=True)))
    assert between == [(0, 1), (3, world)]
    assert sorted(rigid.order[:rigid.touched[0]]) == [0, 1, 3]
    on_box = (touches.first[:until[1]] == 3)
    np.testing.assert_allclose(touches.answer[:until[1]][on_box, 2:4], np.sqrt(0.5 * 0.2))
    np.testing.assert_allclose(touches.answer[:until[1]][~on_box, 2:4], 0.5)
    begin_touches(rigid, touches)
    assert rigid.touched[0] == 0
    assert not touches.until.any()
    assert (rigid.parent == -1).all()
    assert (rigid.entity == -1).all()


def test_no_rigid_body_no_touch():
    begin_touches(None, None)
    touch_colliders(None, None, None, None, None)
    touch_hulls(None, None, None, None, None, None, HULLS)
    weigh(None, None, None, None)
