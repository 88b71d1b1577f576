"""Contact with planes: rebound and friction, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

G = 9.81
SLOPE = np.radians(30)
DOWNHILL = np.array([np.cos(SLOPE), 0, -np.sin(SLOPE)])
UPWARD = np.array([np.sin(SLOPE), 0, np.cos(SLOPE)])


def impacts(run, count):
    """Times of the first impacts: the flight seen two frames before each is continued down to z = 0."""
    z, v = run.position[:, 0, 2], run.velocity[:, 0, 2]
    found = []
    for k in np.flatnonzero((v[:-1] < 0) & (v[1:] > 0))[:count] - 1:
        found.append(run.time[k] + (v[k] + np.sqrt(v[k]**2 + 2 * G * z[k])) / G)
    return found


def test_bouncing_ball(simulate):
    """It falls for t0 = sqrt(2/g), then flies for 2 t0 e, 2 t0 e^2 ..., which add up to t0 (1 + e)/(1 - e)."""
    e, t0 = 0.8, np.sqrt(2 / G)
    run = simulate(Path("validation/bouncing_ball.yaml"))
    expected = t0 * (1 + 2 * np.array([0, e, e + e**2]))
    np.testing.assert_allclose(expected, [0.451524, 1.173961, 1.751912], atol=5e-7)
    np.testing.assert_allclose(impacts(run, 3), expected, rtol=0.02)

    z = run.position[:, 0, 2]
    for start, end, top in zip(expected, [*expected[1:], 2.3], [e**2, e**4, e**6], strict=True):
        assert z[(run.time > start) & (run.time < end)].max() == pytest.approx(top, rel=0.02)

    stopped = t0 * (1 + e) / (1 - e)
    assert stopped == pytest.approx(4.063713, abs=1e-6)
    moving = np.flatnonzero(np.abs(run.velocity[:, 0, 2]) > 0.01)
    assert run.time[moving[-1]] == pytest.approx(stopped, rel=0.02)
    assert run.measures["penetration_max"].max() < 1e-9


def test_rebound_does_not_depend_on_where_in_a_step_it_falls(simulate):
    """The height of the first top, for drops that end anywhere within a substep."""
    for height in np.linspace(1.0, 1.04, 7):
        run = simulate(Path("validation/bouncing_ball.yaml"),
                       {"bodies.ball.positions": [[0, 0, height]], "time": {"duration": 1, "frame_rate": 240},
                        "solver.substeps": 1})
        bounced = run.time > np.sqrt(2 * height / G)
        energy = run.position[bounced, 0, 2] + run.velocity[bounced, 0, 2]**2 / (2 * G)
        assert np.median(energy) == pytest.approx(0.64 * height, rel=5e-3)


def downhill(run):
    """How far the block has come (T,), m."""
    moved = run.measures["centre_of_mass"] - run.measures["centre_of_mass"][0]
    return moved @ DOWNHILL


def test_block_slides(simulate):
    closed = G * (np.sin(SLOPE) - 0.3 * np.cos(SLOPE))
    assert closed == pytest.approx(2.356287, abs=1e-6)
    run = simulate(Path("validation/incline_slides.yaml"))
    np.testing.assert_allclose(downhill(run)[[30, 60]], [closed / 8, closed / 2], rtol=0.01)
    assert run.velocity[-1].mean(axis=0) @ DOWNHILL == pytest.approx(closed, rel=0.01)
    assert np.abs((run.position[-1] - run.position[0]) @ UPWARD).max() < 1e-3, "flat on the incline"
    assert run.measures["penetration_max"].max() < 1e-3


def test_block_sticks(simulate):
    run = simulate(Path("validation/incline_sticks.yaml"))
    assert np.abs(downhill(run)).max() < 1e-3
    settled = downhill(run)[run.time > 0.2]
    assert np.abs(settled - settled[0]).max() < 1e-5, "what sticks hardly creeps"


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_friction_cone(simulate, share):
    """2 % below tan 30 it slides, with the little acceleration that is left; 2 % above it stands."""
    friction = share * np.tan(SLOPE)
    run = simulate(Path("validation/incline_slides.yaml"), {"effects.friction": friction, "solver.substeps": 64})
    acceleration = 2 * np.polyfit(run.time[20:], downhill(run)[20:], 2)[0]
    if share < 1:
        assert acceleration == pytest.approx(G * (np.sin(SLOPE) - friction * np.cos(SLOPE)), rel=0.01)
    else:
        assert np.abs(downhill(run)).max() < 1e-4
        assert abs(acceleration) < 1e-5
