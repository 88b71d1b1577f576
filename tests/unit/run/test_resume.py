"""Runs that stop, are killed or find their checkpoints damaged go on to the datasets of an undisturbed run."""

import errno
import json
import multiprocessing
import os
import resource
import shutil
import signal
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import worlds

from verlet_numba.run import checkpoint
from verlet_numba.run.resume import ResumeError, first_difference
from verlet_numba.run.simulate import Summary, simulate
from verlet_numba.run.space import SpaceError
from verlet_numba.run.trajectory import DifferenceError
from verlet_numba.scene.prepare import prepare

OF_THE_PROCESS = ("provenance/start", "provenance/end", "provenance/timing")
AT_ONCE = 1e-9          # s; a run stops at the first look at its clock
SHORT = {"time": {"duration": 0.5, "frame_rate": 60}, "solver": {"substeps": 5}}
PENDULUM = {**SHORT, "bodies": [{"kind": "particles", "positions": [[0, 0, 0], [1, 0, 0], [1, 0, 1]], "masses": [1, 1, 1],
                                 "pinned": [0], "sticks": [[0, 1], [1, 2]]}]}
ROPE = {**SHORT, "output": {"precision_bits": 14, "fields": ["velocity"]},
        "bodies": [{"kind": "rope", "start": [0, 0, 1], "end": [1, 0, 1], "segments": 20, "mass": 1, "pinned": [0]}]}
CLOTH = {**SHORT, "effects": {"self_collision": True, "friction": 0.3}, "colliders": [{"kind": "plane"}],
         "bodies": [{"kind": "cloth", "size": [1, 0.2], "resolution": [21, 5], "mass": 0.1, "thickness": 0.04,
                     "position": [0, 0, 0.55], "rotation": {"axis": [0, 1, 0], "degrees": 88}}]}
HEAP = {"time": {"duration": 4, "frame_rate": 30}, "solver": {"substeps": 8},
        "effects": {"friction": 0.5, "rest": {"speed": 0.5, "time": 0.2}}, "output": {"precision": "float64"},
        "bodies": [{"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 1, "count": 20,
                    "scatter": {"inside": [[-0.2, -0.2, 0.2], [0.2, 0.2, 2]], "speed": [0, 1]}}],
        "colliders": [{"kind": "room", "size": [0.8, 0.8, 4], "position": [0, 0, 2]}]}


def write(folder, mapping):
    """The mapping as a scene file in a folder, prepared."""
    (folder / "scene.yaml").write_text(json.dumps({"version": 1, "name": "scene", **mapping}), encoding="utf-8")
    return prepare(folder / "scene.yaml")


@pytest.fixture
def scene(tmp_path):
    """scene(mapping): this scene as a file, prepared."""
    return lambda mapping: write(tmp_path, mapping)


@pytest.fixture
def pieces(monkeypatch):
    """pieces(substeps): runs look at the clock after so many substeps, as a rule in the middle of a frame."""
    return lambda substeps: monkeypatch.setattr("verlet_numba.run.engine.BUDGET", substeps)


def run(prepared, path, **options) -> Summary:
    return simulate(prepared, path, quiet=True, **options)


def datasets(path):
    """Every dataset but those of the process, under every name."""
    with h5py.File(path, locking=False) as file:
        return {name: data for name, data in walk(file, "") if name not in OF_THE_PROCESS}


def walk(group, place):
    for name, item in group.items():
        if isinstance(item, h5py.Dataset):
            yield place + name, item[()]
        else:
            yield from walk(item, f"{place}{name}/")


def assert_same(a, b):
    a, b = datasets(a), datasets(b)
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def told(summary):
    """What two runs of one scene must agree in."""
    return {name: value for name, value in summary.so_far().items() if name not in ("seconds", "chunks")}


def in_folder(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "scene.yaml")


CASES = {"pendulum": PENDULUM, "rope": ROPE, "cloth": CLOTH, "everything": worlds.with_changes(worlds.EVERYTHING, **SHORT),
         "heap": HEAP}


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.validate] * (name in ("cloth", "everything", "heap"))) for name in CASES])
def test_a_run_that_stops_again_and_again_has_the_datasets_of_an_undisturbed_one(scene, pieces, tmp_path, name):
    prepared = scene(CASES[name])
    whole = run(prepared, tmp_path / "whole.vtkhdf")
    pieces(3)
    stops, before, path = 0, 0, tmp_path / "parts.vtkhdf"
    while (summary := run(prepared, path, resume=True, max_time=AT_ONCE)).status == "stopped":
        assert (summary.signal, summary.resumed_at) == (None, before or None)
        stops, before = stops + 1, summary.frames
    assert stops > 1.5 * (whole.frames - 1)         # most of them in the middle of a frame
    assert (summary.status, summary.resumed_at) == ("complete", before)
    assert told(summary) == told(whole)
    assert sum(frames for frames, _, _ in summary.chunks) == summary.frames
    assert_same(tmp_path / "whole.vtkhdf", path)
    if name == "heap":
        resting = datasets(path)["observables/resting/value"]
        assert resting.max() > 10
        assert (np.diff(resting) < 0).any()             # some wake again
    assert in_folder(tmp_path) == ["parts.vtkhdf", "whole.vtkhdf"]


def test_a_scene_without_bodies_and_observables_goes_on(scene, pieces, tmp_path):
    prepared = scene({"time": {"duration": 1}, "output": {"observables": False}})
    pieces(7)
    for _ in range(3):
        assert run(prepared, tmp_path / "a.vtkhdf", resume=True, max_time=AT_ONCE).status == "stopped"
    assert run(prepared, tmp_path / "a.vtkhdf", resume=True).status == "complete"
    run(prepared, tmp_path / "b.vtkhdf")
    assert_same(tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf")


@pytest.mark.validate
def test_buffers_that_have_grown_are_kept_as_they_are(tmp_path):
    from verlet_numba.run.engine import grown

    model = worlds.started(worlds.EVERYTHING)
    origin = checkpoint.origin(model.world)
    model.world = grown(model.world)
    worlds.advanced(model, 3)
    checkpoint.write(tmp_path / "a", origin, {"frames": 3}, model.world)
    other = worlds.started(worlds.EVERYTHING)
    assert checkpoint.origin(other.world) == origin
    other.world = checkpoint.restored(other.world, checkpoint.newest(tmp_path / "a", 3).arrays)
    for (name, a), (_, b) in zip(checkpoint.arrays(model.world), checkpoint.arrays(other.world), strict=True):
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert a.dtype == b.dtype
    for a, b in zip(worlds.advanced(model, 20), worlds.advanced(other, 20), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A folder with a rope's scene, its whole run, and a run that has stopped several times."""
    folder = tmp_path_factory.mktemp("half")
    prepared = write(folder, ROPE)
    run(prepared, folder / "whole.vtkhdf")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("verlet_numba.run.engine.BUDGET", 3)
        for _ in range(13):         # two a frame
            run(prepared, folder / "a.vtkhdf", resume=True, max_time=AT_ONCE)
    assert in_folder(folder) == ["a.vtkhdf", "a.vtkhdf.checkpoint", "a.vtkhdf.checkpoint.previous", "whole.vtkhdf"]
    return folder


@pytest.fixture
def stopped(half, tmp_path):
    """A prepared rope, the file of its whole run, and a file with 7 frames and checkpoints of 7 and of 6 frames."""
    shutil.copytree(half, tmp_path, dirs_exist_ok=True)
    return prepare(tmp_path / "scene.yaml"), tmp_path / "whole.vtkhdf", tmp_path / "a.vtkhdf"


@pytest.mark.parametrize(("damaged", "resumed_at"), [((0,), 6), ((0, 1), 0), ((1,), 7)])
def test_a_damaged_checkpoint_is_passed_over(stopped, damaged, resumed_at):
    prepared, whole, path = stopped
    for number in damaged:
        place = checkpoint.names(path)[number]
        place.write_bytes(place.read_bytes()[:-1])
    summary = run(prepared, path, resume=True)
    assert (summary.status, summary.resumed_at) == ("complete", resumed_at)
    assert_same(whole, path)


def test_frames_that_are_there_are_held_against_those_simulated_again(stopped):
    prepared, _, path = stopped
    checkpoint.remove(path)
    with h5py.File(path, "r+") as file:
        file["observables/total_energy/value"][5] += 1
    with pytest.raises(DifferenceError, match=r"a\.vtkhdf: frame 5 as simulated now differs in observables/total_energy"):
        run(prepared, path, resume=True)


@pytest.mark.parametrize("how", ["kernels", "version", "start"])
def test_checkpoints_of_another_simulation_are_refused(stopped, monkeypatch, how):
    prepared, _, path = stopped
    words = {"kernels": r"another version of the program \(its kernels differ\)", "version": r"verlet-numba .* instead of 9\.9",
             "start": "of another start"}[how]
    changed = {"kernels": {"kernels": "changed"}, "version": {"verlet-numba": "9.9"}, "start": {}}[how]
    other = checkpoint.program() | changed
    monkeypatch.setattr(checkpoint, "program", lambda: other)
    if how == "start":
        prepared.bodies[0].positions[0, 3, 1] += 1e-12
    before = path.read_bytes()
    with pytest.raises(ResumeError, match=rf"a\.vtkhdf\.checkpoint .*{words}"):
        run(prepared, path, resume=True)
    assert path.read_bytes() == before


def test_files_of_other_scenes_and_no_trajectories_are_refused(stopped, scene, tmp_path):
    prepared, _, path = stopped
    before = path.read_bytes()
    with pytest.raises(ResumeError, match="is planned for 31 frames, not for 6"):
        run(prepared, path, resume=True, count=5)
    with pytest.raises(ResumeError, match=r"of another scene: bodies\.0\.mass is 1\.0 there, 2\.0 here"):
        run(scene({**ROPE, "bodies": [{**ROPE["bodies"][0], "mass": 2}]}), path, resume=True)
    assert path.read_bytes() == before
    (tmp_path / "text").write_text("precious")
    with h5py.File(tmp_path / "other", "w") as file:
        file["x"] = 1
    for name in ("text", "other"):
        with pytest.raises(ResumeError, match=f"{name} is no trajectory"):
            run(prepared, tmp_path / name, resume=True)


@pytest.mark.parametrize(("there", "here", "words"), [
    ({"a": [1, {"b": 2}]}, {"a": [1, {"b": 2}]}, None), ({"a": [1, {"b": 2}]}, {"a": [1, {"b": 3}]}, "a.1.b is 2 there, 3 here"),
    ({}, {"a": {"b": "x" * 90}}, 'a is null there, {"b": "' + "x" * 50 + "... here"), ({"a": 1}, {}, "a is 1 there, null here"),
    ({"a": [1]}, {"a": [1, 2]}, "a is [1] there, [1, 2] here"), ({"a": []}, {"a": {}}, "a is [] there, {} here")])
def test_differences_of_scenes_are_named(there, here, words):
    assert first_difference(there, here) == words


def test_a_signal_while_compiling_changes_nothing(stopped, monkeypatch):
    prepared, _, path = stopped
    before = {name: (path.parent / name).read_bytes() for name in in_folder(path.parent)}
    monkeypatch.setattr("verlet_numba.run.simulate.warm", lambda model: os.kill(os.getpid(), signal.SIGTERM))
    summary = run(prepared, path, resume=True)
    assert (summary.status, summary.signal, summary.frames) == ("stopped", signal.SIGTERM, 7)
    assert {name: (path.parent / name).read_bytes() for name in in_folder(path.parent)} == before
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_what_is_complete_is_left_as_it_is(stopped):
    prepared, whole, path = stopped
    first = run(prepared, path, resume=True)
    before = path.read_bytes(), path.stat().st_mtime_ns
    again = run(prepared, path, resume=True)
    assert (path.read_bytes(), path.stat().st_mtime_ns) == before
    assert (again.status, again.resumed_at) == ("complete", 31)
    assert told(again) == told(first)
    assert again.seconds == first.seconds
    assert_same(whole, path)


def test_a_new_run_under_the_name_takes_the_checkpoints_away(stopped):
    prepared, _, path = stopped
    run(prepared, path, overwrite=True, count=3)
    assert not any(name.exists() for name in checkpoint.names(path))


def test_a_disk_without_room_is_noticed_before_the_work(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9 - 50_000, 50_000))
    monkeypatch.setattr("verlet_numba.run.simulate.warm", lambda model: pytest.fail("compiled first"))
    with pytest.raises(SpaceError, match=r"a\.vtkhdf and its checkpoints may take 0\.\d MB, and the disk has 0\.1 MB free"):
        run(scene(ROPE), tmp_path / "a.vtkhdf")
    assert in_folder(tmp_path) == []


def test_a_checkpoint_without_room_is_an_oserror_and_the_run_goes_on_later(stopped, monkeypatch):
    prepared, whole, path = stopped

    def full(descriptor):
        if next(good) is None:
            raise OSError(errno.ENOSPC, "No space left on device")

    for calls, name in (([None], r"a\.vtkhdf'"), ([1, None], r"a\.vtkhdf\.checkpoint'")):
        good = iter(calls)
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", full)
            with pytest.raises(OSError, match=rf"No space left.*{name}"):
                run(prepared, path, resume=True, max_time=AT_ONCE)
        assert in_folder(path.parent) == ["a.vtkhdf", "a.vtkhdf.checkpoint", "a.vtkhdf.checkpoint.previous", "whole.vtkhdf"]
    assert run(prepared, path, resume=True).status == "complete"
    assert_same(whole, path)


def test_a_thread_may_run_it(scene, tmp_path):
    """As the workers of a cluster do; Python lets only the main thread listen to signals."""
    found = []
    thread = threading.Thread(target=lambda: found.append(run(scene(ROPE), tmp_path / "a.vtkhdf")))
    thread.start()
    thread.join()
    assert found[0].status == "complete"


def killed(prepared, path, seconds):
    """A process that runs it is killed after so many seconds; whether it had come to its end before."""
    process = multiprocessing.get_context("fork").Process(target=run, args=(prepared, path), kwargs={"resume": True})
    process.start()
    process.join(seconds)
    if process.is_alive():
        os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL)
    return process.exitcode != 0


def limited(prepared, path):
    """In a process that may not write files beyond 300 kB, as on a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
    with pytest.raises(OSError, match="File too large"):
        run(prepared, path)


def test_a_run_goes_on_when_a_full_disk_has_room_again(scene, tmp_path):
    prepared, path = scene({**ROPE, "time": {"duration": 50}}), tmp_path / "a.vtkhdf"
    run(prepared, tmp_path / "whole.vtkhdf")
    process = multiprocessing.get_context("fork").Process(target=limited, args=(prepared, path))
    process.start()
    process.join()
    assert process.exitcode == 0
    assert 0 < committed(path, datasets(tmp_path / "whole.vtkhdf")) < 3001
    assert run(prepared, path, resume=True).status == "complete"
    assert_same(tmp_path / "whole.vtkhdf", path)


@pytest.mark.parametrize("kills", [6, pytest.param(200, marks=pytest.mark.validate)])
def test_kills_at_random_moments_lose_no_frame(scene, tmp_path, monkeypatch, kills):
    """Whatever was committed can be read after every one of them, and each run comes to the datasets of an undisturbed one."""
    monkeypatch.setattr("verlet_numba.run.simulate.CHECKPOINT_SECONDS", 0.02)
    monkeypatch.setattr("verlet_numba.run.simulate.CHUNK_SECONDS", 0.01)
    prepared = scene({**ROPE, "time": {"duration": 20, "frame_rate": 60}, "solver": {"substeps": 50}})
    clock = time.perf_counter()
    run(prepared, tmp_path / "whole.vtkhdf")
    seconds = time.perf_counter() - clock
    whole, random, path = datasets(tmp_path / "whole.vtkhdf"), np.random.default_rng(1), tmp_path / "a.vtkhdf"
    done = frames = 0
    while done < kills:
        was_killed = killed(prepared, path, random.uniform(0, seconds))
        done += was_killed
        if path.exists():
            now = committed(path, whole)
            assert now >= frames
            frames = now
        if not was_killed:
            assert_same(tmp_path / "whole.vtkhdf", path)
            assert in_folder(tmp_path) == ["a.vtkhdf", "whole.vtkhdf"]
            path.unlink()
            frames = 0
    run(prepared, path, resume=True)
    assert_same(tmp_path / "whole.vtkhdf", path)
    assert in_folder(tmp_path) == ["a.vtkhdf", "whole.vtkhdf"]


def committed(path: Path, whole):
    """Count of committed frames, each of them as in the undisturbed run."""
    with h5py.File(path, locking=False) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        for name in ("particles/trajectory/position/value", "particles/trajectory/time", "observables/total_energy/value"):
            np.testing.assert_array_equal(file[name][:count], whole[name][:count])
    return count
