"""The folder of a sweep: whose it is, and what is in it."""

import numpy as np
import pytest
from trajectories import write

from verlet_numba.batch.document import read_document
from verlet_numba.batch.group import Job
from verlet_numba.batch.planning import plan
from verlet_numba.batch.sweep import Ended, RefusedError, claim, locked, present
from verlet_numba.batch.work import program, result_of
from verlet_numba.run.simulate import Summary
from verlet_numba.study import sweep_folder as disk
from verlet_numba.study.sweep_folder import Result, SweepError

SCENE = "version: 1\ntime: {duration: 0.1}\nbodies: [{kind: box, name: crate, size: [1, 1, 1], mass: 1}]\n"


@pytest.fixture
def planned(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    return plan(read_document(tmp_path / "scene.yaml", ["bodies.crate.mass=1,2,3"]))


@pytest.fixture
def folder(tmp_path, planned):
    """The sweep's folder, of whose three runs the first is complete, the second diverged, the third failed."""
    place = tmp_path / "sweep"
    claim(planned, place, planned.runs, resume=False)
    for run, status, frames in zip(planned.runs, ("complete", "diverged", "failed"), (2, 0, 0), strict=True):
        disk.write_result(place, Result(run.id, status, 1.5, {"speed_max": 2.0, "rest_time": None}, frames, "why", "old"))
    (disk.run_folder(place, planned.runs[0].id) / disk.TRAJECTORY).touch()
    return place


def test_a_result_counts_while_its_files_are_whole(planned, folder):
    first, second, third = (run.id for run in planned.runs)
    assert set(present(folder, planned.runs)) == {first, second}
    assert disk.read_result(folder, third).status == "failed"
    (disk.run_folder(folder, first) / disk.TRAJECTORY).unlink()
    (disk.run_folder(folder, second) / disk.RESULT).write_text("{}")
    assert present(folder, planned.runs) == {}


def test_a_folder_belongs_to_one_sweep(planned, folder, tmp_path):
    with pytest.raises(RefusedError, match="go on with --resume"):
        claim(planned, folder, planned.runs, resume=False)
    claim(planned, folder, planned.runs, resume=True)
    other = plan(read_document(tmp_path / "scene.yaml", ["bodies.crate.mass=1,2"]))
    with pytest.raises(RefusedError, match="another sweep, 3 runs of"):
        claim(other, folder, other.runs, resume=True)
    with pytest.raises(RefusedError, match="is no sweep"):
        claim(planned, tmp_path, planned.runs, resume=True)


def test_a_shard_joins_a_folder_that_has_nothing_of_it(planned, tmp_path):
    claim(planned, tmp_path / "s", planned.runs[:1], resume=False)
    disk.write_result(tmp_path / "s", Result(planned.runs[0].id, "failed", 0.0, {}))
    claim(planned, tmp_path / "s", planned.runs[1:], resume=False)


def test_one_process_at_a_time_runs_a_shard(folder):
    again = locked(folder, (1, 2))
    with locked(folder, (1, 2)), locked(folder, (2, 2)), pytest.raises(SweepError, match="another process"):
        again.__enter__()
    with locked(folder, (1, 2)):
        pass


def test_a_damaged_plan_is_told(folder):
    (folder / disk.PLAN).write_text('{"format": 1, "runs": [{"id": "a"}, {"id": "a"}]}')
    with pytest.raises(SweepError, match="no plan of a sweep"):
        disk.table(folder)
    (folder / disk.PLAN).write_text("{")
    with pytest.raises(SweepError, match="cannot be read"):
        disk.table(folder)


def test_a_write_that_fails_leaves_what_was_there(tmp_path, monkeypatch):
    disk.write_atomically(tmp_path / "a", "old")
    monkeypatch.setattr("os.replace", lambda *paths: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        disk.write_atomically(tmp_path / "a", "new")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_text() == "old"


def test_failures_and_results_of_another_program_are_told(planned, folder):
    ended = Ended(planned, 3, kept=list(present(folder, planned.runs).values()))
    told = "\n".join(ended.troubles())
    assert "1 diverged: why" in told
    assert f"{planned.runs[1].id}  bodies.crate.mass=2" in told
    assert "2 results were made by another version of the program (old) and are kept" in told
    assert f"made anew by {program()}" in told


def test_a_diverged_run_keeps_its_good_frames_and_says_why(tmp_path):
    path = write(tmp_path / "t.vtkhdf", np.zeros((3, 23, 3)), observables={"speed_max": np.array([1.0, 5.0, 2.0])})
    summary = Summary(str(path), frames=3, status="diverged", seconds={"build": 1.0, "simulate": 0.5})
    found = result_of(Job("a", None, path, ""), summary, ["speed_max"])
    assert found == Result("a", "diverged", 1.5, {"speed_max": 5.0}, 3, "", program())
    assert result_of(Job("a", None, path, ""), MemoryError("no room"), ["speed_max"]).reason == "MemoryError: no room"
