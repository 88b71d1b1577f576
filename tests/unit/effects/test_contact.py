"""Contacts with colliders: exactly those of the naive twin, with their planes; pushes, friction and rebounds likewise."""

from types import SimpleNamespace

import numpy as np
import pytest
import reference
import worlds

from verlet_numba.buffers import Friction, Restitution
from verlet_numba.effects.contact import find_contacts, penetration, separate, touching
from verlet_numba.effects.friction import rub
from verlet_numba.effects.restitution import bounce, foresee
from verlet_numba.run import engine
from verlet_numba.scene import colliders

H, N = 1 / 240, 300
MATERIALS = {"friction": {"static": 0.6, "dynamic": 0.4}, "restitution": 0.3}
SCENE = {
    "time": {"duration": 1}, "solver": {"substeps": 4}, "effects": {"gravity": [0, 0, -9.81], **MATERIALS},
    "bodies": [{"kind": "particles", "positions": [[0, 0, 0]] * N, "masses": [1] * N, "sticks": [[0, 1, 0.4]], "radius": 0.02,
                "pinned": [3, 7]}],
    "colliders": [{"kind": "plane", "normal": [0.1, 0, 1], "point": [0, 0, -0.4]}, *worlds.EVERYTHING["colliders"]]}


class Case:
    """Particles all over the colliders with steps of up to 0.05 m, their contacts, and those that the twin finds."""

    def __init__(self, precision="float64"):
        scene, bodies = worlds.placed(worlds.with_changes(SCENE, solver={"precision": precision}))
        model = colliders_of = worlds.build(scene, bodies)
        rng = np.random.default_rng(4)
        self.particles, effects = model.world.particles, model.world.effects
        self.contact, self.friction, self.restitution = effects.contact, effects.friction, effects.restitution
        order = model.numbering.bodies[0][0]
        self.particles.previous[:, order] = rng.uniform([-1.1, -1.1, -0.3], [1.1, 1.1, 0.7], (N, 3)).T
        step = np.where(np.arange(N) % 3, rng.normal(size=(N, 3)).T, 0) * 0.02
        self.particles.position[:] = self.particles.previous
        self.particles.position[:, order] += step
        self.particles.acceleration[:, order] = [[0], [0], [-9.81]]
        self.x, self.previous = (a[:, order].T.astype(float) for a in (self.particles.position, self.particles.previous))
        self.number = {inner: p for p, inner in enumerate(order)}
        self.twin = reference.Twin(scene, bodies)
        found = (reference.find_contact(k, self.x[k], self.previous[k], 0.02, solid, self.twin.margin, 0.0, 0.0)
                 for solid in self.twin.solids for k in range(N) if k not in (3, 7))
        self.twin.contacts, self.twin.x, self.twin.previous = [c for c in found if c], self.x.copy(), self.previous.copy()
        del colliders_of

    def found(self):
        """Contacts grown as the engine grows them."""
        while not find_contacts(self.particles, self.contact):
            world = SimpleNamespace(effects=SimpleNamespace(contact=self.contact, restitution=self.restitution,
                                                            _replace=lambda **changes: SimpleNamespace(**changes)),
                                    _replace=lambda effects: effects)
            grown = engine.grown(world)
            self.contact, self.restitution = grown.contact, grown.restitution
        return self

    def positions(self):
        return self.particles.position[:, list(self.number)].T


@pytest.fixture(scope="module", params=["float64", "float32"])
def precision(request):
    return request.param


@pytest.fixture
def case(precision):
    return Case(precision).found()


def tolerance(case):
    return 1e-12 if case.particles.position.dtype == np.float64 else 3e-6


def test_contacts_are_those_of_all_pairs(case):
    count = case.contact.listed[0]
    listed = [(case.number[k], s) for k, s in zip(case.contact.particle[:count], case.contact.solid[:count], strict=True)]
    solids = {id(solid): s for s, solid in enumerate(case.twin.solids)}
    assert listed == [(c.k, solids[id(c.solid)]) for c in case.twin.contacts]
    assert count > 128
    assert not case.contact.push[:count].any()


def test_planes_are_those_of_the_twin(case):
    for name in ("normal", "anchor", "bound"):
        found = getattr(case.contact, name)[..., :case.contact.listed[0]].T
        expected = np.array([getattr(c, name) for c in case.twin.contacts])
        np.testing.assert_allclose(found, expected, atol=100 * tolerance(case), err_msg=name)


def test_penetration_is_the_deepest_of_all(case):
    deepest = max(0.02 - solid.distance(solid.pose(0)[1].T @ (x - solid.pose(0)[0]))[0]
                  for solid in case.twin.solids for p, x in enumerate(case.x) if p not in (3, 7))
    assert penetration(case.particles.position, case.particles.inverse_mass, case.contact) == pytest.approx(deepest, abs=tolerance(case))
    assert deepest > 0.02


def test_separation_rebound_and_friction_are_the_twins(case):
    twin = case.twin
    foresee(case.particles, case.contact, case.restitution, H)
    twin.foresee(np.tile([0, 0, -9.81], (N, 1)))
    rng = np.random.default_rng(9)
    for _ in range(2):
        separate(case.particles.position, case.contact)
        twin.separate()
        shift = rng.normal(size=(N, 3)) * 0.002         # as relaxation would between the passes
        case.particles.position[:, list(case.number)] += shift.T.astype(case.particles.position.dtype)
        twin.x += shift
    np.testing.assert_allclose(case.positions(), twin.x, atol=20 * tolerance(case))
    bounce(case.particles, case.contact, case.restitution)
    twin.bounce()
    np.testing.assert_allclose(case.particles.previous[:, list(case.number)].T, twin.previous, atol=40 * tolerance(case))
    assert touching(case.contact) == sum(c.push > 0 for c in twin.contacts) > 50
    rub(case.particles.position, case.contact, case.friction)
    twin.rub()
    np.testing.assert_allclose(case.positions(), twin.x, atol=40 * tolerance(case))


def test_contacts_found_in_grown_buffers_are_bit_identical(precision, monkeypatch):
    grown = Case(precision).found()
    assert grown.contact.particle.size > colliders.FIRST_ROOM
    monkeypatch.setattr(colliders, "FIRST_ROOM", 4096)
    roomy = Case(precision).found()
    assert roomy.contact.particle.size == 4096
    count = roomy.contact.listed[0]
    for name in ("particle", "solid", "normal", "bound", "anchor"):
        np.testing.assert_array_equal(getattr(grown.contact, name)[..., :count], getattr(roomy.contact, name)[..., :count])


def test_a_push_is_taken_back_but_never_pulls():
    case = Case().found()
    particle, contact = case.contact.particle[0], case.contact
    contact.listed[0] = 1
    normal = contact.normal[:, 0]
    case.particles.position[:, particle] += normal * (contact.bound[0] - normal @ case.particles.position[:, particle] - 0.1)
    deep = case.particles.position[:, particle].copy()
    separate(case.particles.position, contact)
    assert contact.push[0] == pytest.approx(0.1)
    case.particles.position[:, particle] += 0.04 * normal
    separate(case.particles.position, contact)
    assert contact.push[0] == pytest.approx(0.06)
    case.particles.position[:, particle] += 5.0 * normal
    separate(case.particles.position, contact)
    assert contact.push[0] == 0
    np.testing.assert_allclose(case.particles.position[:, particle], deep + 5.04 * normal, atol=1e-12)


def test_materials_of_nothing_do_nothing():
    case = Case().found()
    separate(case.particles.position, case.contact)
    before, previous = case.particles.position.copy(), case.particles.previous.copy()
    nothing = Friction(np.zeros_like(case.friction.particle), case.friction.solid)
    rub(case.particles.position, case.contact, nothing)
    restitution = Restitution(np.zeros_like(case.restitution.particle), np.zeros_like(case.restitution.solid), case.restitution.rebound)
    foresee(case.particles, case.contact, restitution, H)
    bounce(case.particles, case.contact, restitution)
    np.testing.assert_array_equal(case.particles.position, before)
    np.testing.assert_array_equal(case.particles.previous, previous)


def test_no_contact_is_nothing():
    assert find_contacts(None, None)
    assert touching(None) == 0
    assert penetration(None, None, None) == 0
