"""Scenes at the edge of what can be said: every one ends in a sound, readable file."""

import h5py
import numpy as np
import pytest

START = [0.25, -0.5, 1.0]
ONE = {"kind": "particles", "positions": [START], "masses": [1]}
TWICE = {"kind": "particles", "positions": [START, START], "masses": [1, 3]}
ROPE = {"kind": "rope", "start": [0, 0, 0], "end": [1, 0, 0], "segments": 10, "mass": 1, "pinned": [0]}


@pytest.fixture
def simulated(verlet, write_scene, tmp_path, datasets):
    """simulated(**keys): the datasets of this scene's run. All numbers are finite, warnings of the libraries are none."""

    def run(**keys):
        output = {"precision": "float64", "fields": ["velocity"]}
        done = verlet("run", write_scene(output=output, **keys), "-o", tmp_path / "x.vtkhdf")
        assert "Warning" not in done.stderr
        found = datasets(tmp_path / "x.vtkhdf")
        for path, values in found.items():
            assert values.dtype.kind not in "fc" or np.isfinite(values).all(), path
        with h5py.File(tmp_path / "x.vtkhdf") as file:
            assert file["VTKHDF/Steps"].attrs["NSteps"] == len(found["particles/trajectory/time"])
        return found

    return run


def positions(found):
    return found["particles/trajectory/position/value"]


def test_no_bodies(simulated, tmp_path):
    """Nothing to see, but no reason for a stock client to fail either."""
    found = simulated(bodies=[], colliders=[{"kind": "plane"}])
    assert positions(found).shape == (31, 0, 3)
    assert found["bodies/name"].shape == (0,)
    assert found["connectivity/distance/pairs"].shape == (0, 2)
    assert not found["observables/total_energy/value"].any()
    hdf, xarray = pytest.importorskip("vtkmodules.vtkIOHDF"), pytest.importorskip("xarray")
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "x.vtkhdf"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 31
    reader.Update()
    assert reader.GetOutputDataObject(0).GetNumberOfPoints() == 0
    group = "particles/trajectory/position"
    with xarray.open_dataset(tmp_path / "x.vtkhdf", engine="h5netcdf", group=group) as data:
        assert data["value"].shape == (31, 0, 3)


def test_one_particle_falls(simulated):
    found = simulated(bodies=[ONE])
    drop = 0.5 * 9.81 * found["particles/trajectory/time"]**2
    np.testing.assert_allclose(positions(found)[:, 0], START - drop[:, None] * [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("held", [{"pinned": [0, 1]}, {"fixed": True}])
def test_only_pinned_particles_stay(simulated, held):
    found = simulated(bodies=[{**TWICE, "positions": [START, [0.25, -0.5, 2.0]], "sticks": [[0, 1]], **held}],
                      colliders=[{"kind": "plane"}])
    np.testing.assert_array_equal(positions(found), np.broadcast_to(positions(found)[0], (31, 2, 3)))
    assert not found["observables/speed_max/value"].any()


@pytest.mark.parametrize("stick", [[0, 1], [0, 1, 0.5]])
def test_coincident_particles_with_a_stick_of_no_and_of_some_length(simulated, stick):
    """0/0 has no direction: whatever is done about it, the centre of mass falls as if there were no stick."""
    found = simulated(bodies=[{**TWICE, "sticks": [stick]}])
    drop = 0.5 * 9.81 * found["particles/trajectory/time"]**2
    np.testing.assert_allclose(positions(found) @ [0, 0, 1] @ [0.25, 0.75], START[2] - drop, atol=1e-9)
    assert np.linalg.norm(positions(found)[:, 0] - positions(found)[:, 1], axis=1).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("pinned", [[], [0, 1]])
def test_impossible_lengths_are_bounded(simulated, pinned):
    """A triangle of sides 1, 1 and 5 m: it can only be a compromise, and must not gain energy from it."""
    body = {"kind": "particles", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "masses": [1, 1, 1],
            "sticks": [[0, 1, 1], [1, 2, 1], [0, 2, 5]], "pinned": pinned}
    found = simulated(effects={}, bodies=[body], time={"duration": 4})
    energy, error = (found[f"observables/{name}/value"] for name in ("total_energy", "constraint_error_max"))
    assert error[1:].max() < 5
    assert energy[len(energy) // 2:].max() <= energy[:len(energy) // 2].max() * (1 + 1e-9)
    assert np.abs(positions(found) - positions(found).mean(axis=1, keepdims=True)).max() < 10


def test_no_duration_is_the_start_alone(simulated):
    found = simulated(bodies=[ONE], time={"duration": 0})
    np.testing.assert_array_equal(positions(found), [[START]])
    assert found["VTKHDF/Points"].shape == (1, 3)


def test_no_effects_no_gravity(simulated):
    found = simulated(bodies=[{**ONE, "velocity": [1, 2, 3]}], effects={})
    flight = START + found["particles/trajectory/time"][:, None] * [1, 2, 3]
    np.testing.assert_allclose(positions(found)[:, 0], flight, atol=1e-12)
    assert not found["observables/potential_energy/value"].any()


def test_a_step_of_a_second_is_bounded(simulated):
    """Gravity moves every particle by 10 m a step: no accuracy is left, but nothing runs away either."""
    found = simulated(bodies=[ROPE], time={"duration": 200, "frame_rate": 1}, solver={"substeps": 1})
    assert np.abs(positions(found)).max() < 2000
    assert found["observables/speed_max/value"][100:].max() <= found["observables/speed_max/value"][:100].max()


def test_a_step_of_ten_nanoseconds_makes_headway(simulated):
    """It is not lost to rounding: after 1 us the free end has fallen by g t^2/2."""
    found = simulated(bodies=[ROPE], time={"duration": 1e-6, "frame_rate": 1e6}, solver={"substeps": 100})
    assert positions(found)[-1, 10, 2] == pytest.approx(-0.5 * 9.81 * 1e-12, rel=1e-3)
    assert found["observables/constraint_error_max/value"].max() < 1e-9


@pytest.mark.parametrize("mass", [0, -1, float("nan"), float("inf"), "heavy"])
def test_masses_that_are_none_are_refused(verlet, write_scene, mass):
    verlet("check", write_scene(bodies=[{**ONE, "masses": [mass]}]), code=2)
