"""What accuracy costs: the reference and its error bar are right, errors fall as they should, the cheapest setting is found."""

import csv
import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from verlet_numba.scene.load import loads
from verlet_numba.study import accuracy_report as report
from verlet_numba.study import axes
from verlet_numba.study.accuracy import Point, Study, mark_front, study
from verlet_numba.study.convergence import distance, horizon, richardson
from verlet_numba.study.trial import Outcome, under

G, SPAN = 9.81, 1.0
PENDULUM = {
    "version": 1, "name": "pendulum", "time": {"duration": SPAN, "frame_rate": 60}, "solver": {"substeps": 8},
    "effects": {"gravity": [0, 0, -G], "damping": 0.0},
    "bodies": [{"kind": "particles", "name": "bob", "positions": [[0, 0, 0], [1, 0, 0]], "masses": [1, 1], "pinned": [0],
                "sticks": [[0, 1]]}]}


def outcome(position, sound=True, seconds=1.0):
    """A run of one particle along x."""
    points = np.zeros((len(position), 1, 3))
    points[:, 0, 0] = position
    return Outcome(sound, seconds, np.linspace(0, 1, len(position)), points, {}, {})


def found(scene, chosen, **options):
    arguments = {"sets": (), "most": 40, "seconds": 20.0, "say": lambda text: None} | options
    return study(loads(json.dumps(scene), "scene.yaml"), chosen=axes.parse(chosen), **arguments)


@pytest.mark.parametrize("order", [1, 2])
def test_richardson_finds_order_and_error(order):
    time = np.linspace(0, 1, 9)
    runs = [outcome(np.sin(time) + 0.3 * time * h**order) for h in (0.04, 0.02, 0.01)]
    reference = richardson(*runs, 100, np.inf)
    assert reference.order == pytest.approx(order, abs=1e-6)
    assert reference.bar == pytest.approx(distance(outcome(np.sin(time)), reference.outcome), rel=1e-6)


def test_what_does_not_converge_has_a_bar_as_large_as_its_changes():
    reference = richardson(*(outcome([0, x]) for x in (0.0, 0.1, 0.4)), 100, np.inf)
    assert reference.bar >= 0.3


def test_only_the_time_that_can_be_predicted_is_compared():
    one, other = outcome([0, 1, 2, 3, 4]), outcome([0, 1, 2.5, 3, 9])
    assert (distance(one, other, 0.3), distance(one, other, 0.5), distance(one, other)) == (0.0, 0.5, 5.0)
    assert distance(one, outcome([0] * 5, sound=False)) == np.inf


def test_horizon_is_where_twins_part():
    time = np.linspace(0, 1, 101)
    assert horizon(outcome(time), outcome(time + 1e-10)) == np.inf
    assert horizon(outcome(time), outcome(time + 1e-10 * np.exp(30 * time))) == pytest.approx(np.log(1e8) / 30, abs=0.011)


def test_reference_is_as_near_the_truth_as_it_says():
    """A pendulum from 90 degrees, by DOP853."""
    result = found(PENDULUM, ["solver.substeps=2,4,8,16,32"])
    truth = solve_ivp(lambda t, y: [y[1], -G * np.cos(y[0])], (0, SPAN), [0, 0], method="DOP853", rtol=1e-12, atol=1e-12,
                      dense_output=True)
    position = np.zeros_like(result.reference.outcome.position)
    angle = -truth.sol(result.reference.outcome.time)[0]
    position[:, 1, 0], position[:, 1, 2] = np.cos(angle), -np.sin(angle)
    exact = Outcome(True, 0.0, result.reference.outcome.time, position, {}, {})
    error = distance(exact, result.reference.outcome)
    assert 0.5 * error <= result.reference.bar <= 2 * error
    errors = {point.settings["solver.substeps"]: point for point in result.points}
    for substeps, point in errors.items():          # first order, as the projection along the present direction is
        assert point.error == pytest.approx(distance(exact, point.outcomes[0]), abs=1.5 * error)
        if substeps > 2:
            assert np.log2(errors[substeps // 2].error / point.error) == pytest.approx(1, abs=0.25)
    assert result.horizon == np.inf
    assert len(result.points[0].seconds) >= 3
    assert set(result.effects) == {"gravity"}       # a damping of 0 is no effect
    assert result.effects["gravity"].error > 0.5


def test_closed_form_is_the_truth_where_there_is_one():
    scene = PENDULUM | {"reference": {"measure": "centre_of_mass", "value": 3.0, "source": "made up"}}
    result = found(scene, ["solver.substeps=4"])
    assert result.reference is None
    assert result.bar == 0.0
    assert result.points[0].error == pytest.approx(3.0 - result.points[0].outcomes[0].final["centre_of_mass"])


@pytest.mark.parametrize(("measure", "value"), [("centre_of_mass.z", -0.5), ("rest_time", 0.25)])
def test_a_closed_form_may_be_a_component_or_the_time_of_rest(measure, value):
    result = found(PENDULUM | {"reference": {"measure": measure, "value": value}}, ["solver.substeps=4"])
    final = result.points[0].outcomes[0].final[measure]
    assert result.points[0].error == abs(final - value)
    assert final < 0 if measure == "centre_of_mass.z" else final == np.inf
    report.as_dict(result)


def test_closed_forms_of_what_only_files_tell_are_refused():
    with pytest.raises(ValueError, match=r"reference\.measure: 'outside' is not one of"):
        loads(json.dumps(PENDULUM | {"reference": {"measure": "outside", "value": 1}}), "scene.yaml")


@pytest.mark.parametrize("axis", ["time.duration=1,2", "time.frame_rate=30,60", "bodies.0.count=1,2", "bodies=[],[]"])
def test_other_particles_or_frames_cannot_be_compared(axis):
    with pytest.raises(axes.AxisError, match="other particles or frames"):
        found(PENDULUM | {"bodies": [{"kind": "box", "size": [1, 1, 1], "mass": 1,
                                      "scatter": {"inside": [[0, 0, 0], [9, 9, 9]]}}]}, [axis])


def test_report_holds_every_setting(tmp_path):
    result = found(PENDULUM, ["solver.substeps=2,4", "solver.iterations=1,2"])
    report.write(result, tmp_path)
    rows = list(csv.DictReader((tmp_path / "accuracy.csv").open()))
    assert [row["what"] for row in rows] == ["setting"] * 4 + ["without gravity"]
    chosen = {(row["solver.substeps"], row["solver.iterations"]) for row in rows[:4]}
    assert chosen == {("2", "1"), ("2", "2"), ("4", "1"), ("4", "2")}
    document = json.loads((tmp_path / "accuracy.json").read_text())
    assert [point["error"] for point in document["points"]] == [point.error for point in result.points]
    assert (tmp_path / "accuracy.png").stat().st_size > 20_000
    text = "\n".join(report.table(result))
    assert all(f"substeps {k}, iterations {n}" in text for k in (2, 4) for n in (1, 2))


def priced(cost, error, bar=0.0, sound=True):
    return Point({"solver.substeps": int(cost)}, 0.0, [outcome([0], sound)], error, False, False, [cost])


def test_front_and_cheapest():
    points = [priced(1, 5), priced(2, 3), priced(3, 4), priced(4, 1), priced(5, 0.1, sound=False)]
    mark_front(points)
    assert [point.front for point in points] == [True, True, False, True, False]
    result = Study("", 1.0, points[0], points, np.inf, 1.0, None, None, {}, {})
    assert result.cheapest(3.5) is points[1]
    assert result.cheapest(1.0) is points[3]
    assert result.cheapest(0.5) is None


def test_axes_are_yaml():
    assert axes.parse(["solver.order=sequential,lines", "solver.tolerance=0,1e-2"]) == {
        "solver.order": ["sequential", "lines"], "solver.tolerance": [0, 0.01]}
    for wrong in ("solver.order", "=1", "a=", "a=[", "a= "):
        with pytest.raises(axes.AxisError, match="write PATH=VALUE"):
            axes.parse([wrong])
    with pytest.raises(axes.AxisError, match="12 settings, more than 10"):
        axes.grid({"a": range(4), "b": range(3)}, 10)


def test_star_leaves_out_orders_that_the_bodies_have_not():
    scene = loads(json.dumps(PENDULUM | {"bodies": [{"kind": "box", "size": [1, 1, 1], "mass": 1}]}), "scene.yaml").scene
    settings = axes.star(scene, 40)
    assert {setting["solver.order"] for setting in settings if "solver.order" in setting} == {"constraint_graph"}
    assert {setting["solver.substeps"] for setting in settings} == {2, 4, 8, 16, 32}
    assert len(axes.star(scene, 7)) == 7


def test_star_has_the_scenes_own_substeps_with_every_choice():
    for substeps in (1, 2, 8):
        scene = loads(json.dumps(PENDULUM | {"solver": {"substeps": substeps}}), "scene.yaml").scene
        assert {"solver.substeps": substeps, "solver.gradient": "step_start"} in axes.star(scene, 40)


def test_a_scene_without_effects_keeps_its_gravity_without_contact():
    bare = loads(json.dumps({key: value for key, value in PENDULUM.items() if key != "effects"}), "scene.yaml")
    for settings in ({"effects.contact": "none"}, {"effects.damping": 0.1}):
        assert under(bare, settings, ()).scene.effects.gravity == (0, 0, -9.81)
    assert under(bare, {"effects.gravity": None}, ()).scene.effects.gravity is None


def test_settings_that_are_not_allowed_are_told():
    result = found(PENDULUM, ["solver.substeps=4,0"])
    assert len(result.points) == 1
    (reason, names), = result.refused.items()
    assert "greater than or equal to 1" in reason or "at least 1" in reason
    assert names == ["substeps 0"]
