"""Sweeps on a Dask cluster: a real scheduler and workers on the loopback interface, one of which is killed."""

import json
import os
import signal
import subprocess
import sys

import pytest
from sweeps_under_way import assert_whole, at_work, rows, start, until

pytestmark = pytest.mark.validate
pytest.importorskip("distributed", reason="Dask distributed is not installed: pip install 'verlet-numba[cluster]'")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Address of a scheduler with two workers that are started again when they die, and the pids of those at work by `busy`."""
    folder = tmp_path_factory.mktemp("cluster")
    file = folder / "scheduler.json"
    ours = {"cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    scheduler = subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
                                  "--scheduler-file", file, "--no-dashboard", "--no-show"], **ours)
    nannies = subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", file, "--nworkers", "2",
                                "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1"], **ours)
    until(lambda: file.exists() and file.stat().st_size)
    yield file
    for process in (nannies, scheduler):
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def address(file):
    return json.loads(file.read_text())["address"]


def busy():
    """Processes that have a trajectory of a sweep called `clustered` open."""
    return [int(pid) for pid in os.listdir("/proc") if pid.isdigit() and at_work(pid, "clustered/runs/")]


def test_a_sweep_survives_a_killed_worker_stops_on_a_cluster_and_ends_without_it(tmp_path, cluster):
    sweep = start(tmp_path, "--cluster", address(cluster), output="clustered", runs=8)
    os.kill(until(busy)[0], signal.SIGKILL)
    done = until(lambda: list((tmp_path / "clustered/runs").glob("*/result.json")))
    sweep.send_signal(signal.SIGTERM)
    _, err = sweep.communicate(timeout=120)
    assert sweep.returncode == 143, err
    assert "Traceback" not in err
    until(lambda: not busy())
    known = {path: path.stat().st_mtime_ns for path in done}
    sweep = start(tmp_path, "--jobs", "1", output="clustered", runs=8)
    _, err = sweep.communicate(timeout=600)
    assert sweep.returncode == 0, err
    assert_whole(tmp_path / "clustered", 8)
    assert all(path.stat().st_mtime_ns == before for path, before in known.items())
    start(tmp_path, "--cluster", address(cluster), output="clustered", runs=8).communicate(timeout=120)
    assert len(rows(tmp_path / "clustered")) == 8


def test_no_scheduler_is_told_in_a_line(tmp_path):
    sweep = start(tmp_path, "--cluster", "tcp://127.0.0.1:1", output="alone", runs=2)
    _, err = sweep.communicate(timeout=120)
    assert sweep.returncode == 1
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in err
