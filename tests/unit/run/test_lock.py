"""Two writers of one trajectory: the second is told who the first is, and a dead one is in nobody's way."""

import os
import signal
import subprocess
import sys

import pytest

from verlet_numba.run.lock import BusyError, Lock

HOLD = """
import sys, time
from pathlib import Path
from verlet_numba.run.lock import Lock
with Lock(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that has the lock of a trajectory."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, tmp_path / "a.vtkhdf"], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_writer_is_told_who_the_first_is(holder, tmp_path):
    with pytest.raises(BusyError, match=rf"a\.vtkhdf is being written by process {holder.pid} on \S+ since 20\S+; wait"):
        Lock(tmp_path / "a.vtkhdf").__enter__()
    with Lock(tmp_path / "b.vtkhdf"):
        pass


def test_a_killed_holder_is_in_nobodys_way(holder, tmp_path):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert os.listdir(tmp_path) == [".a.vtkhdf.lock"]
    with Lock(tmp_path / "a.vtkhdf") as lock:
        assert f"process {os.getpid()} on" in lock.file.read_text()
    assert os.listdir(tmp_path) == []


def test_a_stopped_holder_holds(holder, tmp_path):
    holder.send_signal(signal.SIGSTOP)
    with pytest.raises(BusyError):
        Lock(tmp_path / "a.vtkhdf").__enter__()


def test_two_threads_of_a_process_are_two_writers(tmp_path):
    with Lock(tmp_path / "a"), pytest.raises(BusyError, match=str(os.getpid())):
        Lock(tmp_path / "a").__enter__()
    with Lock(tmp_path / "a"):
        pass


def test_a_file_that_its_holder_has_removed_meanwhile_is_of_no_use(tmp_path, monkeypatch):
    """Opened before the first holder leaves, locked after: a third would lock the file that is made next."""
    first, second, opening = Lock(tmp_path / "a").__enter__(), Lock(tmp_path / "a"), Lock._open
    descriptor = os.open(second.file, os.O_RDWR)
    first.__exit__(None, None, None)
    monkeypatch.setattr(Lock, "_open", lambda self: monkeypatch.setattr(Lock, "_open", opening) or descriptor)
    with second, pytest.raises(BusyError):
        Lock(tmp_path / "a").__enter__()


def test_file_systems_without_locks_are_no_hindrance(tmp_path, monkeypatch):
    def refuse(descriptor, operation):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("verlet_numba.run.lock.fcntl.flock", refuse)
    with Lock(tmp_path / "a"):
        pass
    assert os.listdir(tmp_path) == []
