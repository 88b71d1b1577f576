"""`verlet-numba accuracy`: files, one document, exit codes."""

import json

import pytest
import yaml

BOB = {"name": "bob", "time": {"duration": 0.5}, "effects": {"gravity": [0, 0, -9.81]}, "bodies": [
    {"kind": "particles", "name": "bob", "positions": [[0, 0, 0], [1, 0, 0]], "masses": [1, 1], "pinned": [0], "sticks": [[0, 1]]}]}
AXIS = ("--axis", "solver.substeps=2,4,8", "--budget", 20)


@pytest.fixture
def scene(write_scene):
    return write_scene(**BOB)


def test_table_files_and_the_cheapest(verlet, scene, tmp_path):
    done = verlet("accuracy", scene, *AXIS, "--target-error", 1e-2, cwd=tmp_path)
    assert {path.name for path in (tmp_path / "bob.accuracy").iterdir()} == {"accuracy.csv", "accuracy.json", "accuracy.png"}
    assert all(f"substeps {k}" in done.stdout for k in (2, 4, 8))
    points = {point["settings"]["solver.substeps"]: point for point in
              json.loads((tmp_path / "bob.accuracy/accuracy.json").read_text())["points"]}
    assert points[2]["error"] > points[4]["error"] > points[8]["error"]
    pasted = yaml.safe_load(done.stdout[done.stdout.index("solver:"):])
    named = points[pasted["solver"]["substeps"]]
    assert named["error"] < 1e-2
    assert all(point["seconds_per_simulated_second"] >= named["seconds_per_simulated_second"]
               for point in points.values() if point["error"] < 9e-3)
    again = verlet("accuracy", scene, *AXIS, cwd=tmp_path, code=2)
    assert "exists already" in again.stderr


def test_json_stands_alone_and_an_error_out_of_reach_is_told(verlet, scene, tmp_path):
    done = verlet("accuracy", scene, *AXIS, "--target-error", 1e-12, "--json", "-o", tmp_path / "out", code=1)
    document = json.loads(done.stdout)
    assert document["cheapest"] is None
    assert len(document["points"]) == 3
    assert "no setting of these is known to have an error of at most 1e-12 m" in done.stderr


@pytest.mark.parametrize(("words", "message"), [
    (["--axis", "solver.substeps"], "write PATH=VALUE"), (["--axis", "solver.substeps=1,2,3", "--runs", "2"], "more than 2"),
    (["--set", "solver.substeps=0"], "solver.substeps"), (["--axis", "solver.substep=1,2"], "did you mean 'substeps'")])
def test_wrong_words_are_refused(verlet, scene, tmp_path, words, message):
    assert message in verlet("accuracy", scene, *words, "-o", tmp_path / "out", code=2).stderr
