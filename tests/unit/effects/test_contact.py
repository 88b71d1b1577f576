"""Contacts with colliders: exactly those of the naive twin, with their planes; pushes, friction and rebounds likewise."""

import numpy as np
import pytest
import reference
import reference_contact
import worlds

from verlet_numba.buffers.contact import Restitution
from verlet_numba.buffers.world import COLUMNS, PENETRATION
from verlet_numba.effects.contact import find_contacts, penetration, separate, touching
from verlet_numba.effects.friction import rub
from verlet_numba.effects.restitution import bounce, foresee
from verlet_numba.run.engine import grown
from verlet_numba.scene import colliders

H, N = 1 / 240, 300
PINNED = [3, 7]
MATERIALS = {"friction": {"static": 0.6, "dynamic": 0.4}, "restitution": 0.3}
SCENE = {
    "time": {"duration": 1}, "solver": {"substeps": 4}, "effects": {"gravity": [0, 0, -9.81], **MATERIALS},
    "bodies": [{"kind": "particles", "positions": [[0, 0, 0]] * N, "masses": [1] * N, "sticks": [[0, 1, 0.4]], "radius": 0.02,
                "pinned": PINNED}],
    "colliders": [{"kind": "plane", "normal": [0.1, 0, 1], "point": [0, 0, -0.4]}, *worlds.EVERYTHING["colliders"][:-1]]}


class Case:
    """Particles all over the colliders with steps of up to 0.05 m, and the contacts that the twin finds."""

    def __init__(self, precision="float64"):
        scene, bodies = worlds.placed(worlds.with_changes(SCENE, solver={"precision": precision}))
        self.model = worlds.build(scene, bodies)
        self.particles, order = self.model.world.particles, self.model.numbering.bodies[0][0]
        rng = np.random.default_rng(4)
        self.particles.previous[:, order] = rng.uniform([-1.1, -1.1, -0.3], [1.1, 1.1, 0.7], (N, 3)).T
        self.particles.position[:] = self.particles.previous
        self.particles.position[:, order] += np.where(np.arange(N) % 3, rng.normal(size=(N, 3)).T, 0) * 0.02
        self.particles.acceleration[:, order] = [[0], [0], [-9.81]]
        self.order, self.number = order, {inner: p for p, inner in enumerate(order)}
        self.twin = reference.Twin(scene, bodies)
        self.twin.x, self.twin.previous = self.rows("position").astype(float), self.rows("previous").astype(float)
        found = (reference_contact.find_contact(k, self.twin.x[k], self.twin.previous[k], 0.02, solid, self.twin.margin, 0.0, 0.0)
                 for solid in self.twin.solids for k in range(N) if k not in PINNED)
        self.twin.contacts = [contact for contact in found if contact]

    def found(self):
        """The case with its contacts found, in buffers that grow as needed."""
        while not find_contacts(*self.particles[:3], self.contact):
            self.model.world = grown(self.model.world)
        return self

    contact = property(lambda self: self.model.world.effects.contact)
    friction = property(lambda self: self.model.world.effects.friction)
    restitution = property(lambda self: self.model.world.effects.restitution)

    def rows(self, name):
        """(N, 3) in the order of the file."""
        return getattr(self.particles, name)[:, self.order].T


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
                  for solid in case.twin.solids for p, x in enumerate(case.twin.x) if p not in PINNED)
    measures = np.zeros(COLUMNS)
    penetration(measures, case.particles.position, case.particles.inverse_mass, case.contact, 1)
    assert measures[PENETRATION] == pytest.approx(deepest, abs=tolerance(case))
    assert deepest > 0.02


def test_separation_rebound_and_friction_are_the_twins(case):
    twin = case.twin
    foresee(case.particles.position, case.particles.acceleration, case.contact, case.restitution, H)
    twin.foresee(np.tile([0, 0, -9.81], (N, 1)))
    rng = np.random.default_rng(9)
    for _ in range(2):
        separate(case.particles.position, case.contact)
        twin.separate()
        shift = rng.normal(size=(N, 3)) * 0.002         # as relaxation would between the passes
        case.particles.position[:, case.order] += shift.T.astype(case.particles.position.dtype)
        twin.x += shift
    np.testing.assert_allclose(case.rows("position"), twin.x, atol=20 * tolerance(case))
    bounce(case.particles.position, case.particles.previous, case.contact, case.restitution)
    twin.bounce()
    np.testing.assert_allclose(case.rows("previous"), twin.previous, atol=40 * tolerance(case))
    pushed = np.zeros(1, np.int64)
    touching(case.contact, pushed)
    assert pushed[0] == sum(c.push > 0 for c in twin.contacts) > 50
    rub(case.particles.position, case.contact, case.friction)
    twin.rub()
    np.testing.assert_allclose(case.rows("position"), twin.x, atol=40 * tolerance(case))


def test_contacts_found_in_grown_buffers_are_bit_identical(precision, monkeypatch):
    small = Case(precision).found()
    assert small.contact.particle.size > colliders.FIRST_ROOM
    monkeypatch.setattr(colliders, "FIRST_ROOM", 4096)
    roomy = Case(precision).found()
    assert roomy.contact.particle.size == 4096
    count = roomy.contact.listed[0]
    for name in ("particle", "solid", "normal", "bound", "anchor"):
        np.testing.assert_array_equal(getattr(small.contact, name)[..., :count], getattr(roomy.contact, name)[..., :count])


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
    nothing = case.friction._replace(particle=np.zeros_like(case.friction.particle))
    rub(case.particles.position, case.contact, nothing)
    restitution = Restitution(*(np.zeros_like(array) for array in case.restitution))
    foresee(case.particles.position, case.particles.acceleration, case.contact, restitution, H)
    bounce(case.particles.position, case.particles.previous, case.contact, restitution)
    np.testing.assert_array_equal(case.particles.position, before)
    np.testing.assert_array_equal(case.particles.previous, previous)


def test_no_contact_is_nothing():
    assert find_contacts(None, None, None, None)
    touching(None, None)
    penetration(None, None, None, None, 1)
