"""Reading trajectories: what was written comes back, and no broken file gives anything but one clear line."""

import contextlib
import json
import random
import subprocess
import sys

import h5py
import numpy as np
import pytest

import verlet_numba
from verlet_numba.run.trajectory import BodyTable, Contents, Quantity, TrajectoryFile
from verlet_numba.study import reader

FRAMES = 20
SCENE = {"name": "trio", "colliders": [{"kind": "plane"}]}
POSITIONS = np.random.default_rng(1).normal(size=(FRAMES, 9, 3)).astype("f4")


@pytest.fixture
def path(tmp_path):
    bodies = BodyTable(["dust", "line", "sheet"], ["particles", "rope", "cloth"], [0, 2, 5], [2, 3, 4], [0, 0, 0],
                       [0, 0, 2], [1.0, 2.0, 3.0])
    contents = Contents(
        9, np.array([[2, 3], [3, 4]]), np.array([1.0, 2.0]), [np.array([2, 3, 4])], np.array([[5, 6, 7], [5, 7, 8]]),
        bodies,
        {"kinetic_energy": Quantity("J", 1, "f8"), "momentum": Quantity("kg m s-1", 3, "f8")},
        {"scene_text": "name: trio", "scene": json.dumps(SCENE), "seed": 4}, ("position", "velocity"))
    number = np.arange(FRAMES)
    with TrajectoryFile(tmp_path / "trio.vtkhdf", contents, FRAMES) as file:
        file.append(number / 60, number, {"position": POSITIONS, "velocity": -POSITIONS},
                    {"kinetic_energy": number, "momentum": POSITIONS[:, 0]})
        file.finish("complete", "2024-01-01", {"relax": 2})
    return tmp_path / "trio.vtkhdf"


def test_everything_written_comes_back(path):
    with reader.open(path) as trajectory:
        assert (len(trajectory), trajectory.particles) == (FRAMES, 9)
        np.testing.assert_array_equal(trajectory.time, np.arange(FRAMES) / 60)
        np.testing.assert_array_equal(trajectory.step, np.arange(FRAMES))
        np.testing.assert_array_equal(trajectory.velocities(), -POSITIONS)
        assert trajectory.bodies[1] == ("line", "rope", 2, 3, 0, 0, 2.0)
        assert [body.name for body in trajectory.bodies] == ["dust", "line", "sheet"]
        assert [line.tolist() for line in trajectory.lines] == [[2, 3, 4]]
        assert trajectory.triangles.tolist() == [[5, 6, 7], [5, 7, 8]]
        assert trajectory.vertices.tolist() == [0, 1]
        assert trajectory.pairs.tolist() == [[2, 3], [3, 4]]
        assert trajectory.lengths.tolist() == [1, 2]
        assert set(trajectory.observables) == {"kinetic_energy", "momentum"}
        np.testing.assert_array_equal(trajectory.observables["momentum"], POSITIONS[:, 0])
        assert trajectory.scene == SCENE
        assert trajectory.provenance["status"] == "complete"
        assert trajectory.provenance["seed"] == 4


@pytest.mark.parametrize("frames", [0, -1, slice(None), slice(3, 12, 4), slice(None, None, -1), slice(5, 5), [4, 2, 2],
                                    np.array([7, -1])])
def test_frames_are_chosen_as_from_an_array(path, frames):
    with reader.open(path) as trajectory:
        np.testing.assert_array_equal(trajectory.positions(frames), POSITIONS[frames])


def test_uncommitted_frames_are_not_shown(path):
    with h5py.File(path, "r+") as file:
        file["VTKHDF/Steps"].attrs.modify("NSteps", np.int64(6))
    with reader.open(path) as trajectory:
        assert len(trajectory.time) == len(trajectory.positions()) == len(trajectory.observables["momentum"]) == 6
        np.testing.assert_array_equal(trajectory.positions(-1), POSITIONS[5])
        with pytest.raises(IndexError):
            trajectory.positions(6)


def test_missing_and_foreign_files_are_refused_in_one_line(tmp_path):
    (tmp_path / "text").write_text("not HDF5")
    (tmp_path / "empty").write_text("")
    with h5py.File(tmp_path / "foreign", "w") as file:
        file["x"] = 1
    for name, message in (("missing", "no such file"), (".", "no such file"), ("text", "no HDF5 file"),
                          ("empty", "no HDF5 file"), ("foreign", "no trajectory")):
        with pytest.raises(reader.TrajectoryError, match=message) as caught:
            reader.open(tmp_path / name)
        assert "\n" not in str(caught.value)


def read_all(path):
    with reader.open(path) as trajectory:
        trajectory.positions(), trajectory.velocities(), trajectory.scene, trajectory.bodies, trajectory.observables
        return trajectory.lines, trajectory.triangles, trajectory.pairs, trajectory.lengths, trajectory.time


@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.9, 0.999])
def test_a_truncated_file_is_a_clear_error(path, part):
    data = path.read_bytes()
    path.write_bytes(data[:int(part * len(data))])
    with pytest.raises(reader.TrajectoryError, match="truncated"):
        read_all(path)


def test_flipped_bits_never_give_another_exception(path):
    data, chance, unread = path.read_bytes(), random.Random(2), 0
    for _ in range(150):
        damaged = bytearray(data)
        damaged[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        unread += 1
        with contextlib.suppress(reader.TrajectoryError):
            read_all(path)
            unread -= 1
    assert 0 < unread < 150


def test_the_reader_is_light():
    heavy = {"numba", "matplotlib", "trimesh", "scipy"}
    code = f"import sys, verlet_numba.study.reader; print(*{heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"


# --- the Python API -------------------------------------------------------------------------------------------------------

def test_a_body_is_read_alone(path):
    with verlet_numba.open(path) as run:
        line, sheet = run.body("line"), run.body("sheet")
        assert (len(line), line.kind, line.mass) == (3, "rope", 2.0)
        np.testing.assert_array_equal(line.positions(), POSITIONS[:, 2:5])
        np.testing.assert_array_equal(line.positions(-1), POSITIONS[-1, 2:5])
        np.testing.assert_array_equal(sheet.velocities([3, 1]), -POSITIONS[[3, 1], 5:])
        assert sheet.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
        assert [part.tolist() for part in line.lines] == [[0, 1, 2]]
        assert (line.pairs.tolist(), line.lengths.tolist()) == ([[0, 1], [1, 2]], [1, 2])
        assert (sheet.lines, len(sheet.pairs)) == ([], 0)
        with pytest.raises(reader.TrajectoryError, match="no body 'lin'; there are dust, line, sheet"):
            run.body("lin")


def test_xarray_reads_what_is_asked_of_it(path, monkeypatch):
    xarray = pytest.importorskip("xarray")
    with verlet_numba.open(path) as run:
        found = run.to_xarray()
        assert isinstance(found, xarray.Dataset)
        asked = []
        field = reader.Trajectory._field
        monkeypatch.setattr(reader.Trajectory, "_field", lambda self, name, frames, *rest: asked.append(frames) or field(
            self, name, frames, *rest))
        np.testing.assert_array_equal(found.position.sel(time=0.1, method="nearest"), POSITIONS[6])
        np.testing.assert_array_equal(found.velocity[2:9:3, 1, 0], -POSITIONS[2:9:3, 1, 0])
        assert asked == [6, slice(2, 9, 3)], "and nothing else was read"
        np.testing.assert_array_equal(found.position[::-1, [7, 0]], POSITIONS[::-1, [7, 0]])
        np.testing.assert_array_equal(found.position.where(found.body == "sheet", drop=True), POSITIONS[:, 5:])
        assert found.momentum.dims == ("time", "axis")
        assert found.kinetic_energy.attrs["units"] == "J"
        assert found.position.attrs["units"] == "m"


def test_opening_by_the_package_is_light(path):
    """The name alone loads nothing, reading no simulator."""
    code = (f"import sys, verlet_numba; print(*{{'numpy', 'h5py', 'numba'}} & set(sys.modules)); verlet_numba.open({str(path)!r});"
            "print(*{'numba', 'matplotlib', 'trimesh', 'scipy', 'xarray'} & set(sys.modules))")
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n\n"
