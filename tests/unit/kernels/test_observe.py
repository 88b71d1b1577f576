"""Observables of a frame against sums over its particles."""

import numpy as np
import pytest

from verlet_numba.buffers import world as b
from verlet_numba.kernels.observe import keep, observe, record, record_velocity

H = 0.02


@pytest.fixture(params=[np.float64, np.float32])
def kept(request):
    """Positions after the frame, the kept frame, and what is observed: 10 of 15 particles in another order."""
    rng, real = np.random.default_rng(0), request.param
    after, place, before = rng.normal(size=(3, 3, 15)).astype(real)
    order = rng.permutation(15)[:10]
    pairs, rest = order[[[0, 2, 3], [1, 7, 4]]], np.array([1.0, 0.5, 0.0])
    observed = b.Observed(1, order, rng.uniform(0.5, 2, 10), rng.normal(size=(3, 1)), pairs, rest, None)
    return after, b.Snapshot(place, before, np.array([5, 11, 2, 6]), np.array([3])), observed


def test_sums_over_the_particles_of_the_file(kept):
    after, snapshot, observed = kept
    row, sound = np.full(b.COLUMNS, np.nan), np.zeros(1, np.int64)
    assert observe(row, sound, after, snapshot, observed, H)
    order, m = observed.scene_order, observed.mass[:, None]
    x = snapshot.position.T.astype(float)[order]
    v = (after.T.astype(float) - snapshot.before.T)[order] / (2 * H)
    kinetic, potential = (m * v * v).sum() / 2, -(m * x * observed.gravity.T).sum()
    expected = {b.KINETIC: kinetic, b.POTENTIAL: potential, b.TOTAL: kinetic + potential,
                b.SPEED_MAX: np.linalg.norm(v, axis=1).max(), b.CONTACTS: 3, b.RELAXATIONS: 11,
                b.FALLBACKS: 6}
    np.testing.assert_allclose(row[list(expected)], list(expected.values()), rtol=1e-12)
    for column, vector in ((b.MOMENTUM, (m * v).sum(0)), (b.ANGULAR, (m * np.cross(x, v)).sum(0)),
                           (b.CENTRE, (m * x).sum(0) / m.sum())):
        np.testing.assert_allclose(row[column:column + 3], vector, rtol=1e-10, atol=1e-12)
    errors = [np.linalg.norm(snapshot.position[:, i].astype(float) - snapshot.position[:, j]) / rest - 1
              for i, j, rest in zip(*observed.pairs, observed.rest, strict=True) if rest > 0]
    assert row[b.ERROR_MAX] == pytest.approx(np.abs(errors).max())
    assert row[b.ERROR_RMS] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert np.isfinite(row).all()


def test_what_is_not_a_number_or_lost_in_space_is_noticed(kept):
    after, snapshot, observed = kept
    row, sound, order = np.zeros(b.COLUMNS), np.zeros(1, np.int64), observed.scene_order
    for value in (np.nan, np.inf, -2e30):
        for array in (after, snapshot.position, snapshot.before):
            saved = array[1, order[4]]
            array[1, order[4]] = value
            assert not observe(row, sound, after, snapshot, observed, H)
            array[1, order[4]] = saved
    assert observe(row, sound, after, snapshot, observed, H)


def test_frames_are_in_the_order_of_the_file(kept):
    after, snapshot, observed = kept
    output = np.zeros((2, 10, 3), np.float32)
    record(output[0], snapshot.position, observed.scene_order, 1)
    np.testing.assert_array_equal(output[0], snapshot.position.T[observed.scene_order].astype(np.float32))
    record_velocity(output, 1, after, snapshot.before, observed.scene_order, 1, H)
    expected = (after.T.astype(float) - snapshot.before.T)[observed.scene_order] / (2 * H)
    np.testing.assert_allclose(output[1], expected, rtol=1e-6)
    record_velocity(None, 1, after, snapshot.before, observed.scene_order, 1, H)


def test_keep_copies_the_state_and_moves_the_counts_on(kept):
    after, snapshot, _ = kept
    previous = after + 1
    keep(after, previous, snapshot, 7)
    np.testing.assert_array_equal(snapshot.position, after)
    np.testing.assert_array_equal(snapshot.before, previous)
    np.testing.assert_array_equal(snapshot.counts, [0, 5, 0, 2])
    np.testing.assert_array_equal(snapshot.touching, [7])
