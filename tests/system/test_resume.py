"""`run --resume`, `--max-time`, signals and a second writer, as a user of the command line meets them."""

import json
import signal
import subprocess
import sys
import time

import h5py
import pytest

PENDULUM = {"kind": "particles", "name": "pendulum", "positions": [[0, 0, 0], [1, 0, 0]], "masses": [1, 1], "pinned": [0],
            "sticks": [[0, 1]]}
MINUTES = {"time": {"duration": 100_000, "frame_rate": 60}, "bodies": [PENDULUM]}
COMPILING = """
import sys, time
import verlet_numba.run.simulate as simulation
from verlet_numba.cli.main import main

def warm(model):
    print("compiling", file=sys.stderr, flush=True)
    time.sleep(600)

simulation.warm = warm
main()
"""
NOTED = """
import os, signal, sys
from verlet_numba.run.signals import StopSignals
with StopSignals() as signals:
    os.kill(os.getpid(), signal.SIGTERM)
    assert signals.stop()
    os.kill(os.getpid(), int(sys.argv[1]))
"""


@pytest.fixture
def started(tmp_path):
    """started(*arguments): the program in a process of its own, which the end of the test ends."""
    processes = []

    def start(*arguments, program=("-m", "verlet_numba")):
        processes.append(subprocess.Popen([sys.executable, *program, *map(str, arguments)], cwd=tmp_path, stdout=subprocess.PIPE,
                                          stderr=subprocess.PIPE, text=True,
                                          preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler)))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def wait_for(path, process):
    """Until the file is there, with its first frames."""
    while not path.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)


def files(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "scene.yaml")


def test_a_command_with_a_short_time_is_repeated_until_it_is_done(verlet, write_scene, tmp_path):
    scene = write_scene(bodies=[PENDULUM])
    done = verlet("run", scene, "-o", "x.vtkhdf", "--resume", "--max-time", 0.001, "--json", cwd=tmp_path, code=5)
    assert "stopped by --max-time; 1 frame kept in x.vtkhdf, and --resume goes on" in done.stderr
    assert (json.loads(done.stdout)["status"], json.loads(done.stdout)["signal"]) == ("stopped", None)
    assert files(tmp_path) == ["x.vtkhdf", "x.vtkhdf.checkpoint"]
    done = verlet("run", scene, "-o", "x.vtkhdf", "--resume", "--json", cwd=tmp_path)
    assert "x.vtkhdf: goes on with frame 1 of 31" in done.stderr
    assert (json.loads(done.stdout)["status"], json.loads(done.stdout)["resumed_at"]) == ("complete", 1)
    again = verlet("run", scene, "-o", "x.vtkhdf", "--resume", cwd=tmp_path)
    assert "x.vtkhdf is complete already" in again.stderr
    assert again.stdout.startswith("x.vtkhdf: complete, 31 frames")
    assert files(tmp_path) == ["x.vtkhdf"]


def test_a_signal_stops_a_run_which_goes_on_later(verlet, started, write_scene, tmp_path):
    scene = write_scene(**MINUTES)
    process = started("run", scene, "-o", "x.vtkhdf", "--json")
    wait_for(tmp_path / "x.vtkhdf", process)
    process.send_signal(signal.SIGTERM)
    told, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM, errors
    summary = json.loads(told)
    assert (summary["status"], summary["signal"]) == ("stopped", signal.SIGTERM)
    assert files(tmp_path) == ["x.vtkhdf", "x.vtkhdf.checkpoint"]
    done = verlet("run", scene, "-o", "x.vtkhdf", "--resume", "--max-time", 0.001, cwd=tmp_path, code=5)
    assert f"goes on with frame {summary['frames']} of 6000001" in done.stderr
    with h5py.File(tmp_path / "x.vtkhdf") as file:
        assert int(file["VTKHDF/Steps"].attrs["NSteps"]) == summary["frames"] + 1


@pytest.fixture
def compiling(started):
    """compiling(*arguments): what the program says on both streams when SIGTERM comes while it compiles."""

    def run(*arguments):
        process = started(*arguments, program=("-c", COMPILING))
        while "compiling" not in process.stderr.readline():
            assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        told, errors = process.communicate(timeout=60)
        assert process.returncode == 128 + signal.SIGTERM
        return json.loads(told), errors.splitlines()[-1]

    return run


def test_a_signal_while_compiling_leaves_nothing_behind(compiling, write_scene, tmp_path):
    told, errors = compiling("run", write_scene(**MINUTES), "--json")
    assert (told["status"], told["frames"]) == ("stopped", 0)
    assert errors.endswith("stopped by a signal before the first frame")
    assert files(tmp_path) == []


def test_verify_tells_what_it_has_when_a_signal_comes(compiling, write_scene, tmp_path):
    scene = write_scene(**MINUTES, expect=[{"measure": "speed_max", "max": 100}])
    (tmp_path / "other.yaml").write_text(scene.read_text())
    told, errors = compiling("verify", scene, tmp_path / "other.yaml", "--json")
    assert [case["trouble"] for case in told["cases"]] == ["stopped after 0 s"]
    assert told["not_run"] == 1
    assert errors == "stopped by a signal; 1 scene not run"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_stops_at_once(number):
    assert subprocess.run([sys.executable, "-c", NOTED, str(int(number))], check=False).returncode == -number


def test_a_second_writer_is_refused_until_the_first_is_dead(verlet, started, write_scene, tmp_path):
    scene = write_scene(**MINUTES)
    process = started("run", scene, "-o", "x.vtkhdf")
    wait_for(tmp_path / "x.vtkhdf", process)
    done = verlet("run", scene, "-o", "x.vtkhdf", "--overwrite", cwd=tmp_path, code=1)
    assert f"x.vtkhdf is being written by process {process.pid} on " in done.stderr
    process.kill()
    process.wait()
    verlet("run", scene, "-o", "x.vtkhdf", "--resume", "--max-time", 0.001, cwd=tmp_path, code=5)
    assert ".x.vtkhdf.lock" not in files(tmp_path)


def test_what_cannot_be_gone_on_with_is_wrong_usage(verlet, write_scene, tmp_path):
    scene = write_scene(bodies=[PENDULUM])
    verlet("run", scene, "-o", "x.vtkhdf", "--max-time", 0.001, cwd=tmp_path, code=5)
    before = (tmp_path / "x.vtkhdf").read_bytes()
    for arguments, words in ((["--resume", "--overwrite"], "give one of them"), (["--max-time", "0"], "--max-time"),
                             (["--resume", "--set", "solver.substeps=3"], "solver.substeps is 8 there, 3 here")):
        assert words in verlet("run", scene, "-o", "x.vtkhdf", *arguments, cwd=tmp_path, code=2).stderr
    assert (tmp_path / "x.vtkhdf").read_bytes() == before
