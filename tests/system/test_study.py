"""The commands that look at runs: analyze, compare, verify."""

import csv
import json
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest
from PIL import Image
from trajectories import write

FALL = """\
version: 1
time: {duration: 0.5, frame_rate: 60}
effects: {gravity: [0, 0, -9.81]}
bodies: [{kind: particles, name: stone, positions: [[0, 0, 0]], masses: [1]}]
"""
HOLDS = "expect:\n  - {measure: centre_of_mass, equal: 1.22625, tolerance: 1.0e-6, from: 0.5, body: stone}\n"
FAILS = "expect:\n  - {measure: speed_max, max: 4.9, to: 0.499}\n  - {measure: speed_max, max: 4.9}\n"
STORM = ("version: 1\ntime: {duration: 4, frame_rate: 60}\nsolver: {substeps: 1, precision: float32}\n"
         "effects: {gravity: [0, 0, -1000], wind: {velocity: [0, 0, 0], density: 1.0e-20}}\n"
         "bodies: [{kind: cloth, name: sheet, size: [1.0e+8, 1.0e+8], resolution: [2, 2], mass: 1}]\n"
         "expect: [{measure: contacts, max: 0}]\n")
PEAK_MEMORY = """\
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.fixture
def scenes(tmp_path):
    """A folder with a scene that holds, one that fails and one that expects nothing."""
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "holds.yaml").write_text(FALL + HOLDS, encoding="utf-8")
    (folder / "fails.yaml").write_text(FALL + FAILS, encoding="utf-8")
    (folder / "silent.yaml").write_text(FALL, encoding="utf-8")
    return folder


# --- analyze ------------------------------------------------------------------------------------------------------------

def test_analyze_tells_what_the_file_holds(verlet, mixed):
    told = json.loads(verlet("analyze", mixed.trajectory, "--json").stdout)["files"][0]
    assert (told["frames"], told["status"], told["file"]) == (31, "complete", str(mixed.trajectory))
    assert told["last_time"] == pytest.approx(0.5)
    with h5py.File(mixed.trajectory) as file:
        for name in file["observables"]:
            values, measure = file[f"observables/{name}/value"][:], told["measures"][name]
            assert measure["source"] == "recorded"
            for key, expected in (("first", values[0]), ("last", values[-1]), ("least", values.min(axis=0)),
                                  ("most", values.max(axis=0)), ("mean", values.mean(axis=0))):
                np.testing.assert_allclose(measure[key], expected)
    assert {"rest_time", "orientation_flips", "outside"} <= set(told["measures"])
    assert "self_intersections" not in told["measures"]
    assert told["measures"]["rest_time"]["value"] is None


def test_positions_alone_tell_nearly_the_same(verlet, mixed):
    """The file has velocities, positions of single precision, and bodies of given and of shared masses."""
    recorded, computed = (json.loads(verlet("analyze", mixed.trajectory, "--json", *more).stdout)["files"][0]["measures"]
                          for more in ([], ["--recompute"]))
    assert set(recorded) - set(computed) == {"contacts", "relaxations", "fallbacks", "resting"}
    for name in ("kinetic_energy", "potential_energy", "total_energy", "momentum", "angular_momentum", "centre_of_mass",
                 "speed_max"):
        assert computed[name]["source"] == "positions"
        np.testing.assert_allclose(computed[name]["last"], recorded[name]["last"], rtol=1e-5, atol=1e-5, err_msg=name)
    for name in ("constraint_error_max", "constraint_error_rms", "penetration_max"):
        np.testing.assert_allclose(computed[name]["most"], recorded[name]["most"], rtol=0, atol=3e-6, err_msg=name)


def test_bodies_add_up_to_the_scene(verlet, mixed):
    def energy(*more):
        return json.loads(verlet("analyze", mixed.trajectory, "--json", "--measure", "total_energy", *more).stdout)[
            "files"][0]["measures"]["total_energy"]["last"]

    bodies = [energy("--body", name) for name in ("crate", "sheet", "dice", "line", "lid", "dots")]
    assert sum(bodies) == pytest.approx(energy("--recompute"), rel=1e-9)
    assert sum(energy("--body", f"dice.{k}") for k in range(3)) == pytest.approx(bodies[2], rel=1e-9)


def test_files_side_by_side(verlet, mixed, tmp_path):
    shutil.copy(mixed.trajectory, tmp_path / "other.vtkhdf")
    text = verlet("analyze", mixed.trajectory, tmp_path / "other.vtkhdf", "--measure", "total_energy").stdout
    row = next(line for line in text.splitlines() if line.startswith("total_energy")).split()
    assert len(row) == 2 + 2 * 3
    assert row[2:5] == row[5:8]
    both = json.loads(verlet("analyze", tmp_path, mixed.trajectory, "--json").stdout)["files"]
    assert [each["file"] for each in both] == [str(tmp_path / "other.vtkhdf"), str(mixed.trajectory)]


def test_csv_has_a_row_a_frame(verlet, mixed, tmp_path):
    verlet("analyze", mixed.trajectory, "--csv", tmp_path / "x.csv", "--measure", "momentum", "--measure", "rest_time",
           "--measure", "self_intersections")
    with (tmp_path / "x.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["file", "frame", "time", "momentum_x", "momentum_y", "momentum_z", "rest_time", "self_intersections"]
    assert [int(row["frame"]) for row in rows] == list(range(31))
    with h5py.File(mixed.trajectory) as file:
        momentum = file["observables/momentum/value"][:]
    np.testing.assert_array_equal([[float(row[f"momentum_{axis}"]) for axis in "xyz"] for row in rows], momentum)
    assert {row["rest_time"] for row in rows} == {""}


def test_plot_draws_the_course(verlet, mixed, tmp_path):
    verlet("analyze", mixed.trajectory, "--plot", tmp_path / "x.png")
    with Image.open(tmp_path / "x.png") as image:
        assert image.format == "PNG"
        assert len(image.getcolors(1 << 24)) > 20
    before = (tmp_path / "x.png").read_bytes()
    assert "exists already" in verlet("analyze", mixed.trajectory, "--plot", tmp_path / "x.png", code=2).stderr
    assert (tmp_path / "x.png").read_bytes() == before


@pytest.mark.parametrize(("arguments", "code", "words"), [
    ([], 2, "FILE_OR_FOLDER"), (["none.vtkhdf"], 2, "'none.vtkhdf' does not exist"),
    (["."], 1, "no trajectory file"), (["x.txt"], 1, "no HDF5"),
    (["MIXED", "--plot", "x.jpg"], 2, ".png"), (["MIXED", "--measure", "momentun"], 2, "no measure 'momentun'"),
    (["MIXED", "--body", "crat"], 2, "no body 'crat'"), (["MIXED", "--body", "crate", "--measure", "contacts"], 2, "whole scene"),
    (["MIXED", "--csv", "none/x.csv"], 2, "none")])
def test_analyze_says_what_it_cannot(verlet, mixed, tmp_path, arguments, code, words):
    (tmp_path / "x.txt").write_text("x", encoding="utf-8")
    told = verlet("analyze", *[str(mixed.trajectory) if word == "MIXED" else word for word in arguments], cwd=tmp_path, code=code)
    assert words in told.stderr
    assert len(told.stderr.splitlines()) == 1 or "Usage" in told.stderr


@pytest.mark.parametrize("command", ["analyze", "compare"])
def test_no_simulator_is_loaded(mixed, command):
    files = [str(mixed.trajectory)] * (2 if command == "compare" else 1)
    done = subprocess.run([sys.executable, "-X", "importtime", "-m", "verlet_numba", command, *files], capture_output=True,
                          text=True, check=True, timeout=60)
    loaded = {line.rsplit("|", 1)[1].strip().split(".")[0] for line in done.stderr.splitlines() if "|" in line}
    assert {"h5py", "numpy"} <= loaded
    assert not loaded & {"numba", "llvmlite", "matplotlib", "trimesh"}


@pytest.mark.validate
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts memory as Linux does")
def test_memory_does_not_grow_with_the_file(verlet, tmp_path):
    """331 MB of positions and velocities are measured in less than 260 MB, Python itself included."""
    rng = np.random.default_rng(0)
    frame = rng.normal(size=(1, 23, 3))
    many = np.broadcast_to(frame, (300_000, 23, 3))
    write(tmp_path / "large.vtkhdf", many, many)
    told = verlet("-c", PEAK_MEMORY, sys.executable, "-m", "verlet_numba", "analyze", tmp_path / "large.vtkhdf",
                  program=[sys.executable]).stdout
    assert int(told) * 1024 < 260e6


# --- compare ------------------------------------------------------------------------------------------------------------

def test_compare_finds_what_differs(verlet, mixed, tmp_path):
    """By exit code and in words."""
    other = tmp_path / "other.vtkhdf"
    shutil.copy(mixed.trajectory, other)
    assert verlet("compare", mixed.trajectory, other).stdout == "no difference in 31 frames\n"
    with h5py.File(other, "r+") as file:
        file["particles/trajectory/position/value"][17, 20 + 12 + 2, 1] += 0.25      # after crate and sheet: dice.1, particle 2
    told = verlet("compare", mixed.trajectory, other, code=1)
    assert "frame 17, 0.283333 s: body dice, copy 1, particle 2: 0.25 m apart" in told.stdout
    assert "by more than 0.3 m" in verlet("compare", mixed.trajectory, other, "--tolerance", "0.3").stdout


@pytest.mark.parametrize(("files", "code", "words"), [
    (["none", "MIXED"], 2, "'none' does not exist"), (["MIXED", "x.txt"], 1, "no HDF5"), (["MIXED"], 2, "B"),
    (["MIXED", "MIXED", "--tolerance", "-1"], 2, "tolerance")])
def test_compare_says_what_it_cannot(verlet, mixed, tmp_path, files, code, words):
    (tmp_path / "x.txt").write_text("x", encoding="utf-8")
    told = verlet("compare", *[str(mixed.trajectory) if word == "MIXED" else word for word in files], cwd=tmp_path, code=code)
    assert words in told.stderr
    assert code == 2 or len(told.stderr.splitlines()) == 1


# --- verify -------------------------------------------------------------------------------------------------------------

def test_verify_tells_case_figure_bound_and_verdict(verlet, scenes):
    told = verlet("verify", scenes, code=1, cwd=scenes.parent).stdout
    lines = [" ".join(line.split()) for line in told.splitlines()]
    assert lines == [
        f"{scenes / 'fails.yaml'}: FAILED", "held speed_max to 0.499 s 4.7415 <= 4.9 m/s",
        "FAILED speed_max 4.905 <= 4.9 m/s at 0.5 s", f"{scenes / 'holds.yaml'}: held",
        "held centre_of_mass of stone from 0.5 s 1.22625 = 1.22625 ± 1e-06 m",
        f"2 cases, 1 held, 1 skipped, which expect nothing, failed: {scenes / 'fails.yaml'}"]
    assert [path.name for path in scenes.parent.iterdir()] == ["scenes"], "nothing is left behind"


def test_verify_is_good_where_all_is(verlet, scenes):
    told = json.loads(verlet("verify", scenes / "holds.yaml", "--json").stdout)
    assert told["skipped"] == 0
    assert told["failed"] == 0
    case = told["cases"][0]
    assert (case["verdict"], case["trouble"]) == ("held", "")
    assert case["expectations"][0] | {"figure": 0} == {
        "measure": "centre_of_mass", "equal": 1.22625, "tolerance": 1e-6, "from": 0.5, "body": "stone", "verdict": "held",
        "figure": 0, "time": 0.5, "reason": ""}
    assert case["expectations"][0]["figure"] == pytest.approx(1.22625, abs=1e-9)


def test_scenes_that_expect_nothing_are_skipped_and_not_all_may_be(verlet, tmp_path, scenes):
    (scenes / "fails.yaml").write_text(FALL, encoding="utf-8")
    assert verlet("verify", scenes).stdout.splitlines()[-1] == "1 case, 1 held, 2 skipped, which expect nothing"
    (scenes / "holds.yaml").unlink()
    told = verlet("verify", scenes, code=2)
    assert "none of 2 scenes in" in told.stderr
    assert "`expect: [{measure:" in told.stderr
    assert told.stdout == ""


def test_a_divergence_is_a_failed_case(verlet, tmp_path, scenes):
    (scenes / "fails.yaml").write_text(STORM, encoding="utf-8")
    told = json.loads(verlet("verify", scenes, "--json", code=1).stdout)
    assert [case["verdict"] for case in told["cases"]] == ["failed", "held"]
    assert "diverged in step" in told["cases"][0]["trouble"]


@pytest.mark.parametrize(("text", "words"), [
    (FALL + "expect: [{measure: speed, max: 1}]\n", "wrong.yaml:5:20: expect.0.measure"),
    (FALL + "expect: [{measure: contacts, max: 1, body: stone}]\n", "whole scene"), (FALL, "nothing under `expect`")])
def test_wrong_scenes_are_told_before_anything_runs(verlet, scenes, text, words):
    (scenes / "wrong.yaml").write_text(text, encoding="utf-8")
    told = verlet("verify", "wrong.yaml", "holds.yaml", cwd=scenes, code=2)
    assert words in told.stderr
    assert told.stdout == ""
