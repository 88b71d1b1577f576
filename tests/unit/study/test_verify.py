"""Expectations: what holds, what fails, where it is worst; and failing where it should."""

from typing import get_args

import numpy as np
import pytest
from trajectories import FRAMES, SCENE, write

from verlet_numba.run.postmortem import Divergence
from verlet_numba.run.simulate import Summary
from verlet_numba.scene.load import loads
from verlet_numba.scene.schema import COUNTED, Component, Expect, Measure
from verlet_numba.study import reader
from verlet_numba.study.measures import UNITS, USUAL, VECTORS
from verlet_numba.study.verify import Case, hold, judge, scenes_in, trouble_of

TIME = np.arange(7) / 60
VALUES = np.array([0.0, 3.0, 1.0, 2.0, -1.0, 5.0, 2.0])


def expect(**keys):
    return Expect.model_validate({"measure": "speed_max", **keys})


@pytest.mark.parametrize(("keys", "held", "figure", "frame"), [
    ({"max": 5}, True, 5, 5), ({"max": 4.9}, False, 5, 5), ({"max": 4.9, "tolerance": 0.1}, True, 5, 5),
    ({"max": 4.9, "tolerance": 0.09}, False, 5, 5), ({"min": -1}, True, -1, 4), ({"min": 0}, False, -1, 4),
    ({"min": 0, "tolerance": 1}, True, -1, 4), ({"equal": 2, "tolerance": 3}, True, -1, 4),
    ({"equal": 2, "tolerance": 2.9}, False, -1, 4), ({"equal": 2}, False, -1, 4),
    ({"max": 3, "to": 0.08}, True, 3, 1), ({"max": 3, "from": 5 / 60}, False, 5, 5), ({"max": 2, "from": 0.1}, True, 2, 6),
    ({"max": 2, "from": 2 / 60, "to": 4 / 60}, True, 2, 3), ({"equal": 1, "from": 2 / 60, "to": 2 / 60}, True, 1, 2)])
def test_every_frame_of_the_time_counts(keys, held, figure, frame):
    verdict = hold(expect(**keys), TIME, VALUES)
    assert (verdict.held, verdict.figure, verdict.time) == (held, figure, pytest.approx(TIME[frame]))


@pytest.mark.parametrize("keys", [{"from": 0.2}, {"from": 0.02, "to": 0.03}])
def test_no_frame_is_no_proof(keys):
    """A run that ended before its time, or a time between two frames: nothing was seen, so nothing held."""
    verdict = hold(expect(max=1e9, **keys), TIME, VALUES)
    assert (verdict.held, verdict.figure) == (False, None)
    assert "no frame" in verdict.reason


def test_times_are_met_in_spite_of_rounding():
    """0.3 is 18/60, but not in binary."""
    time = np.arange(1000) / 60
    for frame in range(1000):
        assert hold(expect(max=0, **{"from": float(f"{frame / 60:.12g}"), "to": float(f"{frame / 60:.12g}")}), time,
                    np.zeros(1000)).held


@pytest.mark.parametrize("bound", [{"max": 1}, {"min": 1}, {"equal": 1}])
def test_what_is_no_number_does_not_hold(bound):
    values = np.where(np.arange(7) == 3, np.nan, 1.0)
    assert not hold(expect(tolerance=1e9, **bound), TIME, values).held


@pytest.mark.parametrize(("value", "held"), [(2.0, True), (3.0, False), (np.inf, False)])
def test_one_value_a_run(value, held):
    """rest_time, inf if there is no rest."""
    verdict = hold(expect(measure="rest_time", max=2), TIME, np.array([value]))
    assert verdict.held == held
    assert verdict.as_dict()["figure"] == (value if np.isfinite(value) else None)


def test_what_cannot_be_measured_does_not_hold(tmp_path):
    """How deep a body is in a mesh; the rest of what is expected of the body is judged."""
    scene = {**SCENE, "colliders": [{"kind": "mesh", "file": "bowl.obj", "name": "bowl"}]}
    position = np.zeros((FRAMES, 23, 3))
    with reader.open(write(tmp_path / "x.vtkhdf", position, position, scene)) as trajectory:
        found = judge(trajectory, [expect(measure=name, max=1, body="crate") for name in ("penetration_max", "speed_max")])
    assert [(verdict.held, verdict.figure) for verdict in found] == [(False, None), (True, 0)]


def test_components_of_vectors_are_seen(tmp_path):
    """A crate that drifts along y: its distance from the origin, above which it stands, hardly tells."""
    position = np.zeros((FRAMES, 23, 3))
    position[:, :, 2], position[:, :, 1] = 1.0, -0.01 * np.arange(FRAMES)[:, None] / (FRAMES - 1)
    with reader.open(write(tmp_path / "x.vtkhdf", position, position)) as trajectory:
        found = judge(trajectory, [expect(measure=f"centre_of_mass{axis}", equal=value, tolerance=1e-3, body="crate")
                                   for axis, value in (("", 1), (".x", 0), (".y", 0), (".z", 1))])
    assert [verdict.held for verdict in found] == [True, True, False, True]
    assert found[2].figure == pytest.approx(-0.01)
    assert found[2].bound == "= 0 ± 0.001 m"


def test_a_run_that_diverged_fails_whatever_held():
    summary = Summary("x", status="diverged", divergence=Divergence(3, 0.1, "sheet", 5, "none"))
    case = Case("x", [hold(expect(max=9), TIME, VALUES)], trouble=trouble_of(summary))
    assert not case.held
    assert "diverged in step 3" in "\n".join(case.lines())
    assert Case("x", [hold(expect(max=9), TIME, VALUES)], trouble=trouble_of(Summary("x"))).held
    assert trouble_of(Summary("x", status="stopped"))


def test_a_case_tells_figure_bound_and_verdict():
    case = Case("scene.yaml", [hold(expect(max=4, tolerance=0.5, **{"from": 0.05}, body="crate"), TIME, VALUES),
                               hold(expect(min=-2), TIME, VALUES)])
    lines = list(case.lines())
    assert lines[0] == "scene.yaml: FAILED"
    assert " ".join(lines[1].split()) == "FAILED speed_max of crate from 0.05 s 5 <= 4 ± 0.5 m/s at 0.0833333 s"
    assert " ".join(lines[2].split()) == "held speed_max -1 >= -2 m/s"
    told = case.as_dict()
    assert (told["verdict"], [each["verdict"] for each in told["expectations"]]) == ("failed", ["failed", "held"])
    assert told["expectations"][0]["from"] == 0.05


def test_measures_are_those_of_the_scene_files():
    names = list(get_args(Measure))
    assert list(UNITS) == names
    assert {f"{name}.{axis}" for name in VECTORS for axis in "xyz"} == set(get_args(Component))
    assert set(VECTORS) | set(COUNTED) | set(USUAL) <= set(names)


@pytest.mark.parametrize("measure", COUNTED)
def test_what_is_counted_for_the_scene_is_not_expected_of_a_body(measure):
    scene = ("version: 1\ntime: {duration: 1}\nbodies: [{kind: box, name: crate, size: [1, 1, 1], mass: 1}]\n"
             f"expect:\n  - {{measure: {measure}, max: 1, body: crate}}\n")
    with pytest.raises(ValueError, match=r"s\.yaml:5:\d+: expect\.0\.body: .*whole scene"):
        loads(scene, "s.yaml")


def test_folders_are_searched(tmp_path):
    for name in ("b.yaml", "deep/a.yaml", "c.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")
    assert scenes_in([tmp_path, tmp_path / "c.txt"]) == [tmp_path / "b.yaml", tmp_path / "deep/a.yaml", tmp_path / "c.txt"]
