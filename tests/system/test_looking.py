"""The commands that turn a trajectory into something to look at elsewhere: view, export, films."""

import subprocess
import sys

import pytest
from trajectories import variety


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    return variety(tmp_path_factory.mktemp("looking") / "variety.vtkhdf")


def test_view_tells_what_it_left_out(verlet, trajectory, tmp_path):
    whole = verlet("view", trajectory, "-o", tmp_path / "a.html")
    assert whole.stderr == ""
    assert whole.stdout.startswith(f"{tmp_path / 'a.html'}: 31 frames, 0.")
    thin = verlet("view", trajectory, "-o", tmp_path / "b.html", "--budget", "0.003")
    assert "31 frames are more than 0.003 MB of positions, so one in 3 is shown" in thin.stderr
    assert ": 11 frames, " in thin.stdout
    assert (tmp_path / "b.html").stat().st_size < (tmp_path / "a.html").stat().st_size
    quiet = verlet("view", trajectory, "-o", tmp_path / "c.html", "--budget", "0.003", "-q")
    assert (quiet.stdout, quiet.stderr) == ("", "")


def test_export_tells_what_it_wrote(verlet, trajectory, tmp_path):
    told = verlet("export", trajectory, "-o", tmp_path / "a.obj", "--frames", "0:6:2").stdout
    assert told == f"{tmp_path / 'a_0000.obj'} to {tmp_path / 'a_0004.obj'}: 3 files\n"
    assert verlet("export", trajectory, "-o", tmp_path / "a.pc2").stdout == f"{tmp_path / 'a.pc2'}: written\n"
    refused = verlet("export", trajectory, "-o", tmp_path / "a.obj", code=2)
    assert refused.stderr == f"verlet-numba: {tmp_path / 'a_0000.obj'} exists already; give another with -o, or --overwrite\n"
    verlet("export", trajectory, "-o", tmp_path / "a.obj", "--overwrite")


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["view", "RUN", "-o", "x.pdf"], 2, "cannot write .pdf; use .html"),
    (["view", "none.vtkhdf", "-o", "x.html"], 2, "'none.vtkhdf' does not exist"),
    (["view", "RUN", "-o", "x.html", "--frames", "99"], 2, "there is no frame 99"),
    (["view", "RUN", "-o", "there.html"], 2, "exists"),
    (["export", "RUN", "-o", "x.fbx"], 2, "cannot write .fbx; use .usdc"),
    (["export", "there.html", "-o", "x.pc2"], 1, "no HDF5"),
    (["export", "RUN", "-o", "none/x.obj"], 2, "none is no folder"),
    (["export", "RUN", "-o", "x.pc2", "--frames", "0,1,5"], 2, "PC2"),
    (["render", "RUN", "-o", "x.avi"], 2, "cannot write .avi; use .png, .gif, .mp4")])
def test_what_cannot_be_done_is_told(verlet, trajectory, tmp_path, arguments, code, words):
    (tmp_path / "there.html").write_text("mine", encoding="utf-8")
    told = verlet(*[str(trajectory) if word == "RUN" else word for word in arguments], cwd=tmp_path, code=code)
    assert words in told.stderr
    assert told.stderr.count("\n") == 1 or told.stderr.startswith("Usage: ")
    assert told.stdout == ""
    assert [file.name for file in tmp_path.iterdir()] == ["there.html"]
    assert (tmp_path / "there.html").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("output", ["x.html", "x.pc2", "x.obj"])
def test_no_simulator_is_loaded(trajectory, tmp_path, output):
    command = "view" if output == "x.html" else "export"
    done = subprocess.run([sys.executable, "-X", "importtime", "-m", "verlet_numba", command, str(trajectory), "-o", output],
                          cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60)
    loaded = {line.rsplit("|", 1)[1].strip().split(".")[0] for line in done.stderr.splitlines() if "|" in line}
    assert {"h5py", "numpy"} <= loaded
    assert not loaded & {"numba", "llvmlite", "matplotlib", "trimesh"}
