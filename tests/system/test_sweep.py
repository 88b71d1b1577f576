"""`sweep` and `analyze` of its folder, as users call them; workers and whole sweeps that are killed."""

import json
import os
import shlex
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sweeps_under_way import SCENE, assert_whole, at_work, command, kill_workers, rows, start, until, workers

SWEEP = """\
version: 1
scene: scene.yaml
parameters:
  effects.gravity: [[0, 0, -9.81], [0, 0, -1.62], [0, 0, -3.7]]
  bodies.stone.masses.0: [1, 2]
measures: [speed_max, total_energy.last, centre_of_mass, rest_time]
"""
PATHS = ["effects.gravity", "bodies.stone.masses.0"]
UNEQUAL = ("command", "start", "end", "timing")        # what two equal runs may differ in


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("sweep")
    (place / "scene.yaml").write_text(SCENE, encoding="utf-8")
    (place / "sweep.yaml").write_text(SWEEP, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def swept(folder, verlet):
    """The folder of the sweep above, run by two workers."""
    done = verlet("sweep", "sweep.yaml", "--jobs", 2, cwd=folder)
    assert "6 of 6 runs" in done.stdout
    return folder / "sweep.sweep"


def timeless(folder):
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows(folder)]


def content(datasets, file):
    return {path: values for path, values in datasets(file).items() if path.split("/")[-1] not in UNEQUAL}


def assert_equal(datasets, one, other):
    one, other = content(datasets, one), content(datasets, other)
    assert one.keys() == other.keys()
    for path, values in one.items():
        np.testing.assert_array_equal(values, other[path], err_msg=path)


def without_seconds(result):
    return {key: value for key, value in json.loads(result.read_text()).items() if key != "seconds"}


# --- what a sweep makes -------------------------------------------------------------------------------------------------

def test_the_table_has_a_row_a_run_in_the_order_of_the_plan(swept):
    found = rows(swept)
    assert list(found[0]) == ["id", *PATHS, "status", "seconds", "speed_max", "total_energy.last", "centre_of_mass_x",
                              "centre_of_mass_y", "centre_of_mass_z", "rest_time"]
    assert [(json.loads(row[PATHS[0]])[2], float(row[PATHS[1]])) for row in found] == [
        (g, m) for g in (-9.81, -1.62, -3.7) for m in (1, 2)]
    for row in found:
        assert row["status"] == "complete"
        assert float(row["speed_max"]) == pytest.approx(-0.5 * json.loads(row[PATHS[0]])[2], rel=1e-3)
        assert row["rest_time"] == ""
    assert not list(swept.rglob(".*.part"))


def test_parquet_has_the_same_table(swept):
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    table = parquet.read_table(swept / "results.parquet").to_pylist()
    for one, other in zip(table, rows(swept), strict=True):
        assert list(one) == list(other)
        assert all(("" if one[key] is None else str(one[key])) == other[key] for key in other if key != PATHS[1])
        assert one[PATHS[1]] == float(other[PATHS[1]])


def test_a_run_is_bit_for_bit_what_its_recorded_command_makes_alone(swept, datasets, verlet, tmp_path):
    trajectory = swept / "runs" / rows(swept)[3]["id"] / "trajectory.vtkhdf"
    words = shlex.split(datasets(trajectory)["provenance/command"].item().decode())
    verlet(*words[1:], "-o", tmp_path / "alone.vtkhdf", "-q")
    assert_equal(datasets, trajectory, tmp_path / "alone.vtkhdf")


def test_shards_together_are_the_whole_bit_for_bit(folder, swept, datasets, verlet):
    verlet("sweep", "sweep.yaml", "--jobs", 1, "--shard", "2/2", "-o", "shards", cwd=folder)
    assert [row["id"] for row in rows(folder / "shards")] == [row["id"] for row in rows(swept)][1::2]
    verlet("sweep", "sweep.yaml", "--jobs", 1, "--shard", "1/2", "-o", "shards", cwd=folder)
    assert timeless(folder / "shards") == timeless(swept)
    for row in rows(swept):
        assert_equal(datasets, *(place / "runs" / row["id"] / "trajectory.vtkhdf" for place in (swept, folder / "shards")))


def test_a_dry_run_shows_the_runs_and_writes_nothing(folder, swept, verlet):
    before = sorted(folder.rglob("*"))
    told = json.loads(verlet("sweep", "scene.yaml", "--vary", "effects.gravity.2=-9:-1", "--samples", 5, "--method", "sobol",
                             "--dry-run", "--json", cwd=folder).stdout)
    assert (told["points"], told["runs"], told["there"], len(told["missing"])) == (5, 5, 0, 5)
    assert "6 there already, 0 to run" in verlet("sweep", "sweep.yaml", "--dry-run", cwd=folder).stdout
    assert sorted(folder.rglob("*")) == before


def test_mistakes_are_told_before_anything_runs(folder, verlet):
    done = verlet("sweep", "scene.yaml", "--vary", "bodies.stone.mases=1,2", "-o", "wrong", code=2, cwd=folder)
    assert "--vary bodies.stone.mases=1,2:1:14: bodies.0.mases: unknown key (did you mean 'masses'?)" in done.stderr
    assert "0.1:0.9" in verlet("sweep", "scene.yaml", "--vary", "bodies", code=2, cwd=folder).stderr
    assert "I/N" in verlet("sweep", "scene.yaml", "--vary", "seed=1,2", "--shard", "3/2", code=2, cwd=folder).stderr
    assert not (folder / "wrong").exists()


# --- again, and what is missing -----------------------------------------------------------------------------------------

def test_a_rerun_does_exactly_what_is_missing(folder, swept, verlet):
    copy = folder / "copy"
    shutil.copytree(swept, copy)
    names = [row["id"] for row in rows(swept)]
    runs = [copy / "runs" / name for name in names]
    assert "go on with --resume" in verlet("sweep", "sweep.yaml", "-o", "copy", code=2, cwd=folder).stderr
    shutil.rmtree(runs[0])
    (runs[2] / "result.json").write_bytes((runs[2] / "result.json").read_bytes()[:-7])
    (runs[4] / "trajectory.vtkhdf").unlink()
    kept = {place: (place / "trajectory.vtkhdf").stat().st_mtime_ns for place in (runs[1], runs[3], runs[5])}
    told = json.loads(verlet("sweep", "sweep.yaml", "-o", "copy", "--resume", "--json", "--jobs", 1, cwd=folder).stdout)
    assert (told["kept"], told["done"], told["failed"]) == (3, 3, [])
    assert kept == {place: (place / "trajectory.vtkhdf").stat().st_mtime_ns for place in kept}
    assert timeless(copy) == timeless(swept)
    again = json.loads(verlet("sweep", "sweep.yaml", "-o", "copy", "--resume", "--json", cwd=folder).stdout)
    assert (again["kept"], again["done"]) == (6, 0)


def test_a_folder_of_another_sweep_is_refused(folder, swept, verlet):
    other = ("sweep", "scene.yaml", "--vary", "seed=1,2", "--resume")
    assert "holds another sweep, 6 runs of scene.yaml" in verlet(*other, "-o", swept, code=2, cwd=folder).stderr
    assert "is no sweep" in verlet(*other, "-o", folder, code=2, cwd=folder).stderr


def test_a_failed_run_is_listed_takes_no_other_with_it_and_is_tried_again(folder, verlet):
    boxes = "[[0,0,0],[1,1,1]],[[0,0,0],[0.1,0.1,0.1]],[[1,1,1],[2,2,2]]"
    arguments = ("sweep", "scene.yaml", "--vary", f"bodies.0.scatter.inside={boxes}", "--jobs", 1, "-o", "fails")
    done = verlet(*arguments, code=4, cwd=folder)
    assert "1 failed: scene.yaml" in done.stderr.replace(f"{folder}/", "")
    assert [row["status"] for row in rows(folder / "fails")] == ["complete", "failed", "complete"]
    assert "2 were there already" in verlet(*arguments, "--resume", code=4, cwd=folder).stdout
    assert "1 failed: " in verlet("analyze", "fails", cwd=folder).stdout


def test_analyze_tells_a_sweep_as_table_json_csv_and_picture(folder, swept, verlet):
    told = verlet("analyze", swept, "--plot", "effects.png", "--csv", "again.csv", cwd=folder).stdout
    assert "6 of 6 runs ended" in told
    assert "total_energy.last" in told
    assert (folder / "again.csv").read_text() == (swept / "results.csv").read_text()
    with Image.open(folder / "effects.png") as picture:
        assert picture.width > 500
        assert len(picture.convert("RGB").getcolors(1 << 24)) > 20
    found = json.loads(verlet("analyze", swept, "--measure", "potential_energy.first", "--json", cwd=folder).stdout)["sweeps"][0]
    assert [list(run["measures"]) for run in found["runs"]] == [["potential_energy.first"]] * 6
    assert found["runs"][1]["parameters"] == {PATHS[0]: [0, 0, -9.81], PATHS[1]: 2}
    verlet("analyze", swept, folder / "scene.yaml", code=2)


# --- kills --------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("runs", "kills"), [(6, 2), pytest.param(200, 50, marks=pytest.mark.validate)])
def test_killed_workers_cost_nothing_but_time(folder, runs, kills):
    sweep = start(folder, "--jobs", "2", output=f"killed_{runs}", runs=runs)
    assert kill_workers(sweep, folder / f"killed_{runs}", runs, kills) == kills
    _, err = sweep.communicate(timeout=900)
    assert sweep.returncode == 0, err
    assert "Traceback" not in err
    assert_whole(folder / f"killed_{runs}", runs)


def test_a_run_that_always_kills_its_worker_is_set_aside(folder):
    sweep = start(folder, "--jobs", "2", output="poisoned", runs=4)
    plan = until(lambda: (folder / "poisoned/sweep.json").exists() and json.loads((folder / "poisoned/sweep.json").read_text()))
    poison = plan["runs"][1]["id"]
    deaths = 0
    while sweep.poll() is None:
        for pid in workers(sweep.pid):
            if at_work(pid, poison):
                os.kill(pid, signal.SIGKILL)
                deaths += 1
                until(lambda pid=pid: not at_work(pid))
        time.sleep(0.005)
    _, err = sweep.communicate()
    assert (sweep.returncode, deaths) == (4, 3), err
    assert "1 killed: its worker process died 3 times, at last by SIGKILL" in err
    assert poison in err
    assert [row["status"] for row in rows(folder / "poisoned")] == ["complete", "killed", *["complete"] * 2]


def test_signals_stop_a_sweep_and_its_workers_and_resume_goes_on(folder):
    sweep = start(folder, "--jobs", "1", output="stopped", runs=3)
    until(lambda: list((folder / "stopped/runs").glob("*/result.json")))
    [worker] = until(lambda: [pid for pid in workers(sweep.pid) if at_work(pid)])
    sweep.send_signal(signal.SIGTERM)
    _, err = sweep.communicate(timeout=60)
    assert sweep.returncode == 143, err
    assert "--resume goes on" in err
    assert "Traceback" not in err
    assert not command(worker)
    done = {path: path.stat().st_mtime_ns for path in (folder / "stopped/runs").glob("*/result.json")}
    assert 1 <= len(rows(folder / "stopped")) == len(done) < 3

    sweep = start(folder, "--jobs", "1", output="stopped", runs=3)
    [worker] = until(lambda: [pid for pid in workers(sweep.pid) if at_work(pid)])
    sweep.kill()
    sweep.communicate()
    until(lambda: not command(worker))

    sweep = start(folder, "--jobs", "1", "-q", output="stopped", runs=3)
    out, err = sweep.communicate(timeout=600)
    assert (sweep.returncode, out, err) == (0, "", "")
    assert_whole(folder / "stopped", 3)
    assert all(path.stat().st_mtime_ns == time_ns for path, time_ns in done.items())
