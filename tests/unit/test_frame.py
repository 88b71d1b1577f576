"""Whole frames against the naive twin: every effect, every kind of body, constraint and collider together."""

import numpy as np
import pytest
import worlds
from reference import Twin

from verlet_numba.buffers import world as b
from verlet_numba.scene import colliders, meeting

MEASURES = {"kinetic_energy": [b.KINETIC], "potential_energy": [b.POTENTIAL], "total_energy": [b.TOTAL],
            "momentum": range(b.MOMENTUM, b.MOMENTUM + 3), "angular_momentum": range(b.ANGULAR, b.ANGULAR + 3),
            "centre_of_mass": range(b.CENTRE, b.CENTRE + 3), "constraint_error_max": [b.ERROR_MAX],
            "constraint_error_rms": [b.ERROR_RMS], "penetration_max": [b.PENETRATION], "speed_max": [b.SPEED_MAX],
            "contacts": [b.CONTACTS], "relaxations": [b.RELAXATIONS]}


@pytest.fixture(scope="module")
def twin():
    """12 frames with every effect, in which bodies meet colliders and not each other."""
    return Twin(*worlds.placed(worlds.APART)).frames(12)


def test_every_frame_is_that_of_the_twin(twin):
    positions, velocities, measures = worlds.advanced(worlds.started(worlds.APART), 12)
    np.testing.assert_allclose(positions[:12], twin[0][:12], atol=1e-10)
    np.testing.assert_allclose(positions, twin[0], atol=1e-7)       # what tumbles and bounces magnifies rounding
    np.testing.assert_allclose(velocities, twin[1], atol=1e-5)
    for name, columns in MEASURES.items():
        np.testing.assert_allclose(measures[:, columns], twin[2][name].reshape(12, -1), rtol=1e-5, atol=1e-5, err_msg=name)


def test_frames_of_whole_chains_are_those_of_the_twin():
    chained = Twin(*worlds.placed(worlds.CHAINS)).frames(20)
    positions, _, measures = worlds.advanced(worlds.started(worlds.CHAINS), 20)
    np.testing.assert_allclose(positions, chained[0], atol=1e-8)
    for name, columns in {**MEASURES, "fallbacks": [b.FALLBACKS]}.items():
        np.testing.assert_allclose(measures[:, columns], chained[2][name].reshape(20, -1), rtol=1e-6, atol=1e-6, err_msg=name)
    assert np.ptp(positions, axis=0).max() > 0.3


def test_the_scene_of_the_twin_calls_for_everything(twin):
    """Else the test above could not fail."""
    effects = worlds.built(worlds.APART).world.effects._asdict()
    assert [name for name, effect in effects.items() if effect is None] == ["features", "exact", "rapid", "bending"]
    assert twin[2]["contacts"].sum() >= 25
    assert twin[2]["penetration_max"].max() > 1e-4


def test_bodies_of_the_scene_of_everything_meet():
    """Rigid ones colliders and each other, deformable ones rigid ones."""
    model = worlds.started(worlds.EVERYTHING)
    worlds.advanced(model, 8)
    until = model.world.effects.touches.until
    assert 0 < until[0] < until[1] < until[2]
    bodies = model.world.effects.hulls.body
    pairs = model.world.effects.meet.pairs
    met = model.world.effects.meet.meetings
    kinds = {tuple(sorted(np.sign(bodies[[pairs.first[p], pairs.second[p]]] + 0.5))) for p in met.pair[:met.listed[0]]}
    assert kinds == {(-1, 1), (1, 1)}


def test_growing_the_room_for_contacts_changes_no_bit(monkeypatch):
    """The frame loop stops in the middle of a substep when contacts outgrow their buffers, and is called again."""
    roomy = worlds.advanced(worlds.started(worlds.EVERYTHING), 12)
    for module in (colliders, meeting):
        monkeypatch.setattr(module, "FIRST_ROOM", 1)
    model = worlds.started(worlds.EVERYTHING)
    for one, other in zip(roomy, worlds.advanced(model, 12), strict=True):
        np.testing.assert_array_equal(one, other)
    assert model.world.effects.contact.particle.size > 2
    assert model.world.effects.mixed.meetings.pair.size > 2


@pytest.mark.validate
def test_single_precision_follows_for_a_while(twin):
    model = worlds.started(worlds.with_changes(worlds.APART, solver={"precision": "float32"}))
    positions, _, _ = worlds.advanced(model, 8)
    np.testing.assert_allclose(positions, twin[0][:8], atol=3e-5)
