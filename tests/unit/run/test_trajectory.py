"""The trajectory file as the stock readers of three ecosystems see it, whole, interrupted, resumed and out of space."""

import os
import resource
import signal
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from verlet_numba.run.layout import chunk_shape
from verlet_numba.run.trajectory import BodyTable, Contents, Quantity, TrajectoryFile

FRAMES = 150


def contents(**changes):
    """Two loose particles, a rope of three, a quad of two triangles."""
    values = {
        "particles": 9,
        "pairs": np.array([[2, 3], [3, 4], [5, 6], [6, 7], [7, 8], [8, 5]]), "lengths": np.linspace(1, 2, 6),
        "lines": [np.array([2, 3, 4])], "polygons": np.array([[5, 6, 7], [5, 7, 8]]),
        "bodies": BodyTable(["dust", "line", "sheet"], ["particles", "rope", "cloth"], [0, 2, 5], [2, 3, 4], [0, 0, 0],
                            [0, 0, 2], [1.0, 2.0, 3.0]),
        "observables": {"kinetic_energy": Quantity("J", 1, "f8"), "momentum": Quantity("kg m s-1", 3, "f8"),
                        "contacts": Quantity("1", 1, "i8")},
        "provenance": {"scene_text": "version: 1", "scene": '{"name": "trio"}', "seed": 3},
        "fields": ("position", "velocity"),
    }
    return Contents(**{**values, **changes})


def frames(first, last, particles=9):
    """Arguments of `append` for frames first to last, each a function of its number alone."""
    number = np.arange(first, last)
    wave = np.sin(number[:, None, None] + np.arange(particles * 3).reshape(particles, 3))
    scalars = {"kinetic_energy": number * 0.5, "momentum": wave[:, 0], "contacts": number * 2}
    return number / 60, number * 8, {"position": wave, "velocity": 60 * wave}, scalars


def write(path, block=FRAMES, last=FRAMES, **changes):
    with TrajectoryFile(path, contents(**changes), FRAMES) as file:
        for first in range(0, last, block):
            file.append(*frames(first, min(first + block, last)))
        file.finish("complete", "2024-01-01T00:00:00+00:00", {"relax": 1.5})
    return path


def datasets(path):
    """Every dataset of a file but its timing, by path."""
    found = {}
    with h5py.File(path, locking=False) as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    del found["provenance/timing"]
    return found


def assert_same(a, b):
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


@pytest.mark.parametrize("changes", [
    {"lengths": np.linspace(3, 4, 6)}, {"provenance": {"scene_text": "other", "scene": "{}" * 9999, "seed": 2**40}},
    {"bodies": contents().bodies._replace(mass=[5.0, 6.0, 7.0])}, {"bodies": contents().bodies._replace(name=["a", "b", "c"])},
    {"polygons": np.array([[5, 6, 7], [5, 7, 6]])}, {"pairs": contents().pairs[::-1]}, {"dtype": "f8"}, {"fields": ("position",)},
    {"observables": {**contents().observables, "momentum": Quantity("other", 3, "f8")}}], ids=lambda changes: next(iter(changes)))
def test_a_file_has_nothing_of_the_one_before(tmp_path, monkeypatch, changes):
    """Files of equal topology begin as copies of one blank."""
    write(tmp_path / "before.vtkhdf")
    after = write(tmp_path / "after.vtkhdf", **changes)
    monkeypatch.setattr("verlet_numba.run.layout._kept", (b"", b""))
    fresh = write(tmp_path / "fresh.vtkhdf", **changes)
    assert_same(datasets(after), datasets(fresh))
    with h5py.File(after) as one, h5py.File(fresh) as other:
        attributes = [{name: dict(item.attrs) for name, item in walked(file)} for file in (one, other)]
        assert repr(attributes[0]) == repr(attributes[1])


def walked(file):
    found = []
    file.visititems(lambda name, item: found.append((name, item)) if not name.startswith("particles/trajectory/box") else None)
    return [(name, item) for name, item in found if isinstance(item, h5py.Group)]


def committed(path):
    """Count of frames, after every one of them was read and compared."""
    with h5py.File(path, locking=False) as file:
        count = int(file["VTKHDF/Steps"].attrs["NSteps"])
        time, step, fields, scalars = frames(0, count)
        for name, values in fields.items():
            np.testing.assert_array_equal(file[f"particles/trajectory/{name}/value"][:count], values.astype("f4"))
            points = file["VTKHDF/Points" if name == "position" else f"VTKHDF/PointData/{name}"][:count * 9]
            np.testing.assert_array_equal(points, values.astype("f4").reshape(-1, 3))
        for name, values in scalars.items():
            np.testing.assert_array_equal(file[f"observables/{name}/value"][:count], values)
        np.testing.assert_array_equal(file["particles/trajectory/time"][:count], time)
        np.testing.assert_array_equal(file["particles/trajectory/step"][:count], step)
        np.testing.assert_array_equal(file["VTKHDF/Steps/Values"][:count], time)
    return count


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return write(tmp_path_factory.mktemp("trajectory") / "trio.vtkhdf", block=40)


def test_h5py_reads_what_the_contract_lists(file):
    assert committed(file) == FRAMES
    with h5py.File(file) as opened:
        position = opened["particles/trajectory/position/value"]
        assert (position.shape, position.dtype) == ((150, 9, 3), "f4")
        assert (position.compression, position.compression_opts, position.shuffle) == ("gzip", 1, True)
        assert opened["VTKHDF/Points"].is_virtual
        np.testing.assert_array_equal(opened["connectivity/distance/pairs"], contents().pairs)
        np.testing.assert_array_equal(opened["connectivity/distance/length"], contents().lengths)
        assert list(opened["bodies/name"].asstr()) == ["dust", "line", "sheet"]
        assert list(opened["bodies/mass"]) == [1, 2, 3]
        provenance = {name: item[()] for name, item in opened["provenance"].items()}
    assert provenance == {"scene_text": b"version: 1", "scene": b'{"name": "trio"}', "seed": 3, "status": b"complete",
                          "end": b"2024-01-01T00:00:00+00:00", "timing": b'{"relax": 1.5}'}


def test_vtk_reads_every_step_cell_and_body(file):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(file))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == FRAMES
    for step in (0, 1, 64, 70, 127, 128, 149):
        reader.SetStep(step)
        reader.Update()
        data = reader.GetOutput()
        _, _, fields, _ = frames(step, step + 1)
        np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), fields["position"][0].astype("f4"))
        velocity = vtk_to_numpy(data.GetPointData().GetArray("velocity"))
        np.testing.assert_array_equal(velocity, fields["velocity"][0].astype("f4"))
        assert (data.GetNumberOfVerts(), data.GetNumberOfLines(), data.GetNumberOfPolys()) == (2, 1, 2)
        assert vtk_to_numpy(data.GetPolys().GetConnectivityArray()).tolist() == [5, 6, 7, 5, 7, 8]
        assert vtk_to_numpy(data.GetCellData().GetArray("body")).tolist() == [0, 0, 1, 2, 2]


def test_mdanalysis_reads_positions_and_velocities(file):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import MDAnalysis
        universe = MDAnalysis.Universe.empty(9, trajectory=False)
        universe.load_new(str(file), format="H5MD", convert_units=False)
        assert len(universe.trajectory) == FRAMES
        for step in universe.trajectory[::37]:
            _, _, fields, _ = frames(step.frame, step.frame + 1)
            np.testing.assert_array_equal(step.positions, fields["position"][0].astype("f4"))
            np.testing.assert_array_equal(step.velocities, fields["velocity"][0].astype("f4"))
            assert step.time == step.frame / 60
        universe.trajectory.close()


def test_xarray_opens_every_group_of_data(file):
    import xarray

    time, _, fields, scalars = frames(0, FRAMES)
    with xarray.open_dataset(file, group="/particles/trajectory/position", engine="h5netcdf") as data:
        assert data["value"].dims == ("time", "particle", "spatial")
        np.testing.assert_array_equal(data["value"], fields["position"].astype("f4"))
        assert data["value"].attrs["units"] == "m"
    for name, dims in (("kinetic_energy", ("time",)), ("momentum", ("time", "spatial")), ("contacts", ("time",))):
        with xarray.open_dataset(file, group=f"/observables/{name}", engine="h5netcdf", decode_times=False) as data:
            assert data["value"].dims == dims
            np.testing.assert_array_equal(data["value"], scalars[name])
            np.testing.assert_array_equal(data["time"], time)
    for group in ("/bodies", "/connectivity/distance", "/particles/trajectory", "/provenance"):
        with xarray.open_dataset(file, group=group, engine="h5netcdf", decode_times=False) as data:
            data.load()


@pytest.mark.parametrize("block", [1, 3, 7, 64])
def test_blocks_of_any_size_give_the_same_datasets(file, tmp_path, block):
    assert_same(datasets(file), datasets(write(tmp_path / "other.vtkhdf", block)))


def test_flush_commits_a_part_of_a_chunk_again_and_again(file, tmp_path):
    path = tmp_path / "flushed.vtkhdf"
    with TrajectoryFile(path, contents(), FRAMES) as writer:
        for first in range(0, FRAMES, 25):
            writer.append(*frames(first, first + 25))
            writer.flush()
            assert writer.frames == committed(path) == first + 25
        writer.finish("complete", "2024-01-01T00:00:00+00:00", {})
    assert_same(datasets(file), datasets(path))


@pytest.mark.parametrize(("stop", "resume_at"), [(64, 64), (70, 70), (100, 40), (128, 1), (150, 150)])
def test_a_resumed_file_has_the_datasets_of_an_undisturbed_one(file, tmp_path, stop, resume_at):
    path = tmp_path / "resumed.vtkhdf"
    with TrajectoryFile(path, contents(), FRAMES) as writer:
        writer.append(*frames(0, stop))
        writer.finish("stopped", "2024-01-01T00:00:00+00:00", {})
    with TrajectoryFile(path, contents(), FRAMES, resume_at=resume_at) as writer:
        for first in range(resume_at, FRAMES, 20):
            writer.append(*frames(first, min(first + 20, FRAMES)))
        assert committed(path) >= stop
        writer.finish("complete", "2024-01-01T00:00:00+00:00", {})
    assert_same(datasets(file), datasets(path))


@pytest.mark.parametrize(("counted", "written", "resume_at"), [(70, 70, 40), (21, 23, 11), (43, 70, 14), (102, 132, 52)])
def test_flushes_while_frames_are_simulated_again_harm_nothing(file, tmp_path, counted, written, resume_at):
    """Also where the one before died with its frames on the disk and not yet counted."""
    path = tmp_path / "run.vtkhdf"
    if os.fork() == 0:
        writer = TrajectoryFile(path, contents(), FRAMES, beside=False)
        writer.append(*frames(0, counted))
        writer.flush()
        writer._count = SimpleNamespace(write=lambda count: os._exit(0))
        writer.append(*frames(counted, written + 1))
        writer.flush()
        os._exit(1)
    assert os.wait()[1] == 0
    with TrajectoryFile(path, contents(), FRAMES, resume_at=resume_at) as writer:
        assert writer.frames == counted
        for first in range(resume_at, FRAMES, 9):
            writer.append(*frames(first, min(first + 9, FRAMES)))
            writer.flush()
        writer.finish("complete", "2024-01-01T00:00:00+00:00", {"relax": 1.5})
    assert_same(datasets(path), datasets(file))


def test_resuming_beyond_the_last_frame_is_refused(tmp_path):
    path = write(tmp_path / "short.vtkhdf", last=10)
    with pytest.raises(ValueError, match="has 10 frames of 9 particles; cannot go on at frame 11"):
        TrajectoryFile(path, contents(), FRAMES, resume_at=11)
    assert committed(path) == 10


def test_frames_beyond_the_plan_are_refused(tmp_path):
    with TrajectoryFile(tmp_path / "a", contents(), 3) as writer, pytest.raises(ValueError, match="beyond the 3"):
        writer.append(*frames(0, 4))


def test_an_existing_file_is_not_overwritten_unasked(tmp_path):
    path = tmp_path / "a.vtkhdf"
    path.write_text("precious")
    with pytest.raises(FileExistsError, match=r"a\.vtkhdf exists"):
        TrajectoryFile(path, contents(), FRAMES)
    with TrajectoryFile(path, contents(), FRAMES, overwrite=True) as writer:
        writer.append(*frames(0, 10))
        assert path.read_text() == "precious"
        writer.flush()
        assert committed(path) == 10
    assert os.listdir(tmp_path) == ["a.vtkhdf"]


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path):
    path = tmp_path / "a.vtkhdf"
    with TrajectoryFile(path, contents(), FRAMES) as writer:
        writer.append(*frames(0, 10))
        path.write_text("precious")
        with pytest.raises(FileExistsError):
            writer.flush()
    assert path.read_text() == "precious"
    assert os.listdir(tmp_path) == ["a.vtkhdf"]


def test_the_name_is_temporary_until_the_first_commit_and_gone_without_one(tmp_path):
    path = tmp_path / "a.vtkhdf"
    with TrajectoryFile(path, contents(), FRAMES):
        assert not path.exists()
        assert len(os.listdir(tmp_path)) == 1
    assert os.listdir(tmp_path) == []


def test_a_folder_that_cannot_be_written_to_is_noticed_at_once(tmp_path):
    with pytest.raises(FileNotFoundError, match="missing"):
        TrajectoryFile(tmp_path / "missing" / "a.vtkhdf", contents(), FRAMES)


KILLED = """
    import importlib.util, os, signal, sys
    spec = importlib.util.spec_from_file_location("cases", sys.argv[1])
    cases = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(cases)
    file = cases.TrajectoryFile(sys.argv[2], cases.contents(), cases.FRAMES)
    for block in range(int(sys.argv[3])):
        file.append(*cases.frames(20 * block, 20 * block + 20))
    file._wait(0)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("blocks", [4, 7])
def test_committed_frames_survive_sigkill(tmp_path, blocks):
    path = tmp_path / "killed.vtkhdf"
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(KILLED), __file__, path, str(blocks)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert committed(path) == 20 * blocks // 64 * 64
    with TrajectoryFile(path, contents(), FRAMES, resume_at=30) as writer:
        writer.append(*frames(30, FRAMES))
        writer.flush()
    assert committed(path) == FRAMES


@pytest.mark.parametrize("chunk_frames", [64, 2])     # 2: so many chunks that HDF5's index splits
def test_committed_frames_survive_a_kill_between_any_two_writes(tmp_path, monkeypatch, chunk_frames):
    """Every state in which the file is ever on the disk is kept, read by HDF5, and gone on with."""
    monkeypatch.setattr("verlet_numba.run.layout.CHUNK_FRAMES", chunk_frames)
    states, snapshot = [], Path(tmp_path, "snapshot")

    def record(name):
        call = getattr(os, name)

        def wrapper(descriptor, *arguments):
            result = call(descriptor, *arguments)
            if writer:
                states.append((writer[0].frames, os.pread(descriptor, os.fstat(descriptor).st_size, 0)))
            return result
        monkeypatch.setattr(os, name, wrapper)

    writer = []
    record("pwrite"), record("ftruncate")
    with TrajectoryFile(tmp_path / "a.vtkhdf", contents(), FRAMES) as file:
        file.append(*frames(0, 64))
        file.flush()
        writer.append(file)
        for first, last in ((64, 70), (70, 81), (81, 140), (140, 145), (145, FRAMES)):
            file.append(*frames(first, last))
            file.flush()
        file.finish("complete", "", {})
        writer.clear()
    assert len(states) > 100
    for count, data in states:
        snapshot.write_bytes(data)
        assert committed(snapshot) >= count
        with TrajectoryFile(snapshot, contents(), FRAMES, resume_at=count) as resumed:
            resumed.append(*frames(count, FRAMES))
            resumed.flush()
        assert committed(snapshot) == FRAMES


@pytest.mark.parametrize("room", [1, 300, 3000, 5000, 9000, 12000])
def test_no_space_is_an_oserror_and_keeps_what_was_committed(tmp_path, room):
    path, limits = tmp_path / "full.vtkhdf", resource.getrlimit(resource.RLIMIT_FSIZE)
    writer = TrajectoryFile(path, contents(), FRAMES)
    writer.append(*frames(0, 64))
    writer.flush()
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + room, limits[1]))
        with pytest.raises(OSError, match=r"File too large.*full"):     # noqa: PT012 - which append meets the limit depends on the room
            writer.append(*frames(64, 128))
            writer.append(*frames(128, FRAMES))
            writer.flush()
        with pytest.raises(OSError, match=r"File too large.*full"):
            writer.finish("complete", "", {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert committed(path) == writer.frames < FRAMES
    with TrajectoryFile(path, contents(), FRAMES, resume_at=64) as writer:
        writer.append(*frames(64, FRAMES))
        writer.flush()
    assert committed(path) == FRAMES


@pytest.mark.parametrize(("particles", "dtype", "planned", "shape"), [
    (1, "f4", 1000, (64, 1, 3)), (1, "f4", 7, (7, 1, 3)), (1600, "f4", 1000, (3, 1600, 3)),
    (5000, "f4", 9, (1, 5000, 3)), (1600, "f8", 1000, (1, 1600, 3)), (1_000_000, "f4", 9, (1, 333_334, 3))])
def test_chunks_hold_whole_frames_of_64_kib_or_pieces_of_large_ones(particles, dtype, planned, shape):
    assert chunk_shape(particles, dtype, planned) == shape


def test_a_frame_of_several_pieces_reads_back(tmp_path, monkeypatch):
    monkeypatch.setattr("verlet_numba.run.layout.PIECE_BYTES", 50)
    path = write(tmp_path / "pieces.vtkhdf", last=5)
    with h5py.File(path) as file:
        assert file["particles/trajectory/position/value"].chunks == (64, 3, 3)
    assert committed(path) == 5


def test_rounded_frames_are_smaller_and_within_the_bound(tmp_path):
    def size(path):
        with h5py.File(path) as file:
            return file["particles/trajectory/position/value"].id.get_storage_size()

    full = write(tmp_path / "full.vtkhdf", last=128)
    rounded = write(tmp_path / "rounded.vtkhdf", last=128, precision_bits=10)
    assert size(rounded) < 0.75 * size(full)
    with h5py.File(full) as a, h5py.File(rounded) as b:
        a, b = a["particles/trajectory/position/value"][()], b["particles/trajectory/position/value"][()]
    assert (np.abs(a - b) <= 2.0**-10 * np.abs(a)).all()
    assert (a != b).any()


def test_float64_is_kept_on_request(tmp_path):
    path = write(tmp_path / "double.vtkhdf", dtype="f8")
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["VTKHDF/Points"], frames(0, FRAMES)[2]["position"].reshape(-1, 3))
