"""What a user sees when something is wrong: the exit code, one line that says what, and no traceback."""

import json
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

PENDULUM = {"kind": "particles", "name": "pendulum", "positions": [[0, 0, 0], [1, 0, 0]], "masses": [1, 1],
            "pinned": [0], "sticks": [[0, 1]]}
STORM = {"time": {"duration": 4, "frame_rate": 60}, "solver": {"substeps": 1, "precision": "float32"},
         "effects": {"gravity": [0, 0, -1000], "wind": {"velocity": [0, 0, 0], "density": 1e-20}},      # on 1e16 m^2, in
         "bodies": [{"kind": "cloth", "name": "sheet", "size": [1e8, 1e8], "resolution": [2, 2], "mass": 1}]}   # float32
HOUR = {"time": {"duration": 100_000, "frame_rate": 60}, "bodies": [PENDULUM]}      # a minute of work at the least

WRONG = """\
version: 1
time: {duration: 1, frame_rat: 60}
solver: {substeps: 0}
bodies:
  - {kind: box, size: [1, 1, 1]}
  - {kind: bix, size: [1, 1, 1]}
  - {kind: particles, positions: [[0, 0, 0]], masses: [.nan]}
effects:
  gravty: [0, 0, 1]
"""
PLACES = {"2:21": "frame_rate", "3:20": "substeps", "5:5": "mass", "6:12": "box", "7:56": "finite", "9:3": "gravity"}

DONE = ("preset=paper", "order=lines", "repeats=once", "response=feature", "projection_point=printed",
        "deformable_contact=spheres", "broad_phase=all_pairs", "gradient=current", "square_root=approximate", "precision=float32")


def readable(path):
    """Status, committed frames and their finite positions of a file that any HDF5 client opens."""
    with h5py.File(path) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        position, seconds = file["particles/trajectory/position/value"], file["particles/trajectory/time"]
        assert len(position) >= count
        assert np.isfinite(position[:count]).all()
        np.testing.assert_allclose(seconds[:count], np.arange(count) / 60)
        return bytes(file["provenance/status"][()]).rstrip(b"\0").decode(), count


def one_line(done):
    """The single line of stderr."""
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0]


@pytest.mark.parametrize("command", ["run", "check", "plan"])
def test_every_mistake_of_a_scene_at_once(verlet, tmp_path, command):
    (tmp_path / "wrong.yaml").write_text(WRONG, encoding="utf-8")
    lines = verlet(command, "wrong.yaml", cwd=tmp_path, code=2).stderr.splitlines()
    assert len(lines) == len(PLACES)
    for line, (place, word) in zip(lines, PLACES.items(), strict=True):
        assert line.startswith(f"wrong.yaml:{place}: ")
        assert word in line
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.yaml"]


@pytest.mark.parametrize(("override", "column", "words"), [
    ("solver.substep=3", 8, "did you mean 'substeps'"), ("solver", 1, "PATH=VALUE"), ("bodies.pendlum.name=x", 8, "pendulum"),
    ("bodies.3.name=x", 8, "has 1"), ("bodies.nobody.name=x", 8, "there are pendulum"),
    ("solver.substeps=[", 18, "not YAML"), ("solver.substeps=-1", 17, "at least 1")])
def test_wrong_overrides(verlet, write_scene, override, column, words):
    line = one_line(verlet("check", write_scene(bodies=[PENDULUM]), "--set", override, code=2))
    assert line.startswith(f"--set {override}:1:{column}: ")
    assert words in line


def test_what_is_built_is_not_refused(verlet, write_scene):
    sets = [word for key in DONE for word in ("--set", f"solver.{key}")]
    verlet("check", write_scene(bodies=[PENDULUM]), *sets, "--set", "effects.self_collision=true", code=0)
    verlet("check", write_scene(bodies=[PENDULUM]), "--set", "solver.gradient=step_start",
           "--set", "effects.bending={stiffness: 0.5}",
           "--set", "solver.deformable_contact=exact", "--set", "effects.continuous_collision=true",
           "--set", "bodies.0.contact_geometry=segments", code=0)


@pytest.mark.parametrize(("arguments", "words"), [
    (["simulate"], "simulate"), (["run"], "SCENE"), (["run", "s.yaml", "--thread"], "--threads"),
    (["run", "s.yaml", "--threads", "0"], "--threads"), (["run", "s.yaml", "--frames", "-1"], "--frames"),
    (["render", "."], "--output")])
def test_wrong_usage(verlet, tmp_path, arguments, words):
    assert words in verlet(*arguments, cwd=tmp_path, code=2).stderr


def test_scenes_that_are_no_text(verlet, tmp_path):
    """A missing file, a folder, binary garbage and an empty file, each in one line with its name."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "garbage").write_bytes(bytes(range(256)) * 20)
    (tmp_path / "empty").write_bytes(b"")
    for name, words in (("missing", "No such file"), ("folder", "directory"), ("garbage", ""), ("empty", "empty")):
        line = one_line(verlet("run", name, cwd=tmp_path, code=2))
        assert re.match(rf"{name}:\d+:\d+: ", line)
        assert words in line


def test_files_that_are_no_trajectory(verlet, mixed, tmp_path):
    (tmp_path / "garbage").write_bytes(bytes(range(256)) * 20)
    (tmp_path / "half").write_bytes(mixed.trajectory.read_bytes()[:50_000])
    assert "'missing' does not exist" in verlet("render", "missing", "-o", "x.png", cwd=tmp_path, code=2).stderr
    for name in ("garbage", "half", "."):
        line = one_line(verlet("render", name, "-o", "x.png", cwd=tmp_path, code=1))
        assert line.startswith(f"verlet-numba: {name}: ")
    assert not (tmp_path / "x.png").exists()


@pytest.mark.parametrize(("arguments", "code", "words", "problems"), [
    (["run", "wrong.yaml", "--json"], 2, "frame_rat", 6), (["plan", "--json"], 2, "SCENE", 0),
    (["analyze", "none", "--json"], 2, "none", 0), (["analyze", "wrong.yaml", "--json"], 1, "no HDF5", 0)])
def test_errors_are_a_document_too(verlet, tmp_path, arguments, code, words, problems):
    """With --json, one on stdout beside the words on stderr."""
    (tmp_path / "wrong.yaml").write_text(WRONG, encoding="utf-8")
    done = verlet(*arguments, cwd=tmp_path, code=code)
    told = json.loads(done.stdout)
    assert (told["status"], told["exit_code"], len(told.get("problems", []))) == ("failed", code, problems)
    assert words in told["error"]
    assert words in done.stderr
    assert all({"file", "line", "column", "path", "message"} == set(each) for each in told.get("problems", []))


def test_what_has_come_apart_but_stayed_finite_is_told(verlet, write_scene, tmp_path):
    """A stick between pins that are carried eight of its lengths apart."""
    body = {**PENDULUM, "pinned": [0], "path": [[0, 0, 0, 0], [0.1, 9, 0, 0]]}
    held = {"kind": "particles", "name": "post", "positions": [[1, 0, 0]], "masses": [1], "pinned": [0]}
    scene = write_scene(time={"duration": 0.2}, bodies=[body, held], attachments=[["pendulum", 1, "post", 0]])
    done = verlet("run", scene, "-o", "x.vtkhdf", "--json", cwd=tmp_path)
    told = json.loads(done.stdout)
    assert told["torn"]
    assert told["constraint_error_end"] > 1
    assert "has come apart" in done.stderr


def test_debug_shows_the_traceback_and_keeps_the_exit_code(verlet, tmp_path):
    (tmp_path / "garbage").write_bytes(bytes(100))
    for arguments, code, error in ((["run", "missing"], 2, "SceneError"),
                                   (["render", "garbage", "-o", "x.png"], 1, "TrajectoryError")):
        shown = verlet("--debug", *arguments, cwd=tmp_path, code=code).stderr
        assert "Traceback" in shown
        assert error in shown
        assert verlet(*arguments, cwd=tmp_path, code=code).stderr.strip() == shown.splitlines()[-1]


def test_divergence_is_named_and_the_good_frames_are_kept(verlet, write_scene, tmp_path):
    done = verlet("run", write_scene(**STORM), "-o", "x.vtkhdf", "--json", cwd=tmp_path, code=3)
    status, count = readable(tmp_path / "x.vtkhdf")
    assert status == "diverged"
    assert 0 < count < 241
    line = done.stderr.splitlines()[-1]
    named = re.search(r"step (\d+) at (\S+) s: body 'sheet', particle (\d+).*stick \d+-\d+ of 'sheet'", line)
    assert named, line
    assert f"{count:,} good frames" in line
    step = int(named[1])
    assert count <= step
    assert float(named[2]) == pytest.approx(step / 60, rel=1e-5)
    summary = json.loads(done.stdout)
    assert (summary["status"], summary["frames"], summary["divergence"]["step"]) == ("diverged", count, step)
    assert (summary["divergence"]["body"], summary["divergence"]["particle"]) == ("sheet", int(named[3]))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml", "x.vtkhdf"]
    again = verlet("run", "scene.yaml", "-o", "x.vtkhdf", "--resume", cwd=tmp_path, code=3)
    assert "diverged in an earlier run of x.vtkhdf" in again.stderr


def limited(size):
    """What a child process calls before it starts: no file may grow beyond `size` bytes, as on a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_a_full_disk_keeps_what_was_written(verlet, write_scene, tmp_path):
    scene = write_scene(**{**HOUR, "time": {"duration": 2000, "frame_rate": 60}})       # 4 MB
    verlet("warm", scene)           # machine code is a file too
    done = verlet("run", scene, "-q", "-o", "x.vtkhdf", cwd=tmp_path, code=1, preexec_fn=limited(1_000_000))
    line = one_line(done)
    assert "x.vtkhdf" in line
    assert "too large" in line
    status, count = readable(tmp_path / "x.vtkhdf")
    assert status == "running"
    assert count > 0
    assert (tmp_path / "x.vtkhdf").stat().st_size <= 1_000_000


def test_a_disk_too_full_to_begin_leaves_no_file(verlet, write_scene, tmp_path):
    scene = write_scene(bodies=[PENDULUM])
    verlet("warm", scene)
    line = one_line(verlet("run", scene, "-q", "-o", "x.vtkhdf", cwd=tmp_path, code=1, preexec_fn=limited(10_000)))
    assert "x.vtkhdf" in line
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_run_with_its_file_finished(write_scene, tmp_path, number):
    """Sent when frames are in the file. Started as a job of a shell with & would be, that is, with SIGINT ignored."""
    output = tmp_path / "x.vtkhdf"
    process = subprocess.Popen([sys.executable, "-m", "verlet_numba", "run", write_scene(**HOUR), "-o", output],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    wait_for(output, process)
    process.send_signal(number)
    told, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number, errors
    assert "Traceback" not in errors
    status, count = readable(output)
    assert status == "stopped"
    assert f"{count:,} frames kept in {output}" in errors
    assert f"stopped, {count:,} frames" in told
    assert count < 6_000_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml", "x.vtkhdf", "x.vtkhdf.checkpoint"]


def wait_for(path: Path, process: "subprocess.Popen[str]") -> None:
    """Until the file has its name, which is after its first frames."""
    while not path.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
