"""`order: lines`: what whole chains hold that sticks one by one do not."""

import numpy as np
import pytest

G = 9.81
SEGMENTS = 20


def scene(body, substeps, order, duration=2.0, **solver):
    return {"version": 1, "time": {"duration": duration, "frame_rate": 60}, "bodies": [body],
            "solver": {"substeps": substeps, "order": order, **solver}, "effects": {"gravity": [0, 0, -G], "contact": "none"}}


def weighted(degrees):
    """A rope of 20 sticks that starts straight, at an angle from the bottom, with a weight of 1000 of its particles."""
    way = np.array([np.sin(np.radians(degrees)), 0, -np.cos(np.radians(degrees))])
    return {"kind": "particles", "name": "rope", "positions": (np.arange(SEGMENTS + 1)[:, None] / SEGMENTS * way).tolist(),
            "masses": [1] * SEGMENTS + [1000], "pinned": [0], "sticks": [[k, k + 1] for k in range(SEGMENTS)]}


@pytest.mark.parametrize("degrees", [0, 20, 90])
def test_a_rope_holds_a_thousandfold_weight(simulate, degrees):
    """At 8 substeps within 0.1 %, hanging and swinging; stick by stick it is drawn to more than one and a half of its length."""
    run = simulate(scene(weighted(degrees), 8, "lines"))
    assert run.measures["constraint_error_max"].max() < 1e-3
    assert simulate(scene(weighted(degrees), 8, "sequential")).measures["constraint_error_max"].max() > 0.5
    if degrees:
        assert np.ptp(run.position[:, -1, 0]) > np.sin(np.radians(degrees))         # it does swing


def test_a_weight_swings_like_a_pendulum(simulate):
    """Its period, from one passage through the bottom to the next but one, is that of a point mass but for the rope's 1 %."""
    run = simulate(scene(weighted(20), 16, "lines", 3.0))
    x = run.position[:, -1, 0]
    crossing = np.flatnonzero(np.diff(np.sign(x)))
    times = run.time[crossing] - x[crossing] / np.diff(x)[crossing] / 60
    period = 2 * np.pi / np.sqrt(G) * (1 + np.radians(20)**2 / 16)
    assert times[1] - times[0] == pytest.approx(period / 2, rel=0.01)


def hung(side):
    return {"kind": "cloth", "name": "sheet", "size": [1, 1], "resolution": [side, side], "mass": 1, "pinned": [0, side - 1]}


def strain(run, side):
    """Mean |length / rest - 1| of rows and columns at the end."""
    place = run.position[-1].reshape(side, side, 3) * (side - 1)
    return np.mean([abs(np.linalg.norm(np.diff(place, axis=axis), axis=2) - 1).mean() for axis in (0, 1)])


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_hung_cloth_is_stiffer_in_lines(simulate, precision):
    lines, sticks = (strain(simulate(scene(hung(20), 8, order, precision=precision)), 20) for order in ("lines", "sequential"))
    assert lines < 2e-4
    assert sticks > 20 * lines


def test_cloth_in_few_substeps_stays_whole(simulate):
    """Chains whose linear systems say nothing are relaxed stick by stick."""
    run = simulate(scene(hung(30), 2, "lines"))
    assert run.measures["fallbacks"].sum() == 0             # they count what `step_start` lets go
    assert strain(run, 30) < 0.3
    assert np.abs(run.position).max() < 3
