"""Stock clients open a trajectory of cloth, rope, boxes and particles without a converter and see h5py's numbers."""

import warnings

import numpy as np
import pytest

from verlet_numba.run.simulate import simulate
from verlet_numba.scene.prepare import prepare

POSITION, VELOCITY = "particles/trajectory/position/value", "particles/trajectory/velocity/value"


@pytest.fixture(scope="module", params=["whole", "resumed"])
def mixed(request, mixed, tmp_path_factory):
    """Also the file of a run that stopped after each of its first ten frames."""
    if request.param == "whole":
        return mixed
    prepared, path = prepare(mixed.scene), tmp_path_factory.mktemp("resumed") / "mixed.vtkhdf"
    for _ in range(10):
        assert simulate(prepared, path, resume=True, max_time=1e-9, quiet=True).status == "stopped"
    assert simulate(prepared, path, resume=True, quiet=True).resumed_at == 10
    return mixed._replace(trajectory=path)


def test_a_resumed_file_is_that_of_an_undisturbed_run(mixed, found, datasets):
    whole = datasets(mixed.folder / "mixed.vtkhdf")
    differ = {path for path in found.keys() | whole.keys() if not np.array_equal(found[path], whole[path])}
    assert differ <= {f"provenance/{name}" for name in ("start", "end", "timing", "command")}


@pytest.fixture(scope="module")
def found(mixed, datasets):
    return datasets(mixed.trajectory)


@pytest.fixture(scope="module")
def vtk_reader(mixed):
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(mixed.trajectory))
    reader.UpdateInformation()
    return reader


def shown(reader, step):
    """What VTK makes of one step: polygonal data."""
    reader.SetStep(step)
    reader.Update()
    return reader.GetOutputDataObject(0)


def numbers(cells):
    """Cells of VTK as lists of point numbers."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if cells.GetNumberOfCells() == 0:
        return []
    offsets, points = (vtk_to_numpy(array) for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray()))
    return [row.tolist() for row in np.split(points, offsets[1:-1])]


def test_vtk_sees_every_step(vtk_reader, found):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    times = vtk_reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
    np.testing.assert_array_equal(times, found["particles/trajectory/time"])
    assert vtk_reader.GetNumberOfSteps() == len(times)
    for step in (0, 17, len(times) - 1):
        data = shown(vtk_reader, step)
        assert data.IsA("vtkPolyData")
        np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), found[POSITION][step])
        np.testing.assert_array_equal(vtk_to_numpy(data.GetPointData().GetArray("velocity")), found[VELOCITY][step])


def test_vtk_sees_points_lines_triangles_and_whose_they_are(vtk_reader, found):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = shown(vtk_reader, 3)
    points, lines, triangles = (numbers(cells) for cells in (data.GetVerts(), data.GetLines(), data.GetPolys()))
    assert points == [[72]]                                     # the one particle on no line and no triangle
    assert lines == [[56, 57, 58, 59, 60, 61], [70, 71]]        # the rope, and the stick
    assert triangles == found["VTKHDF/Polygons/Connectivity"].reshape(-1, 3).tolist()
    owner = np.repeat(np.arange(8), found["bodies/particles"])
    first = [cell[0] for cell in (*points, *lines, *triangles)]
    np.testing.assert_array_equal(vtk_to_numpy(data.GetCellData().GetArray("body")), owner[first])


def test_mdanalysis(mixed, found):
    mda = pytest.importorskip("MDAnalysis")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")         # about units and topology, of which an H5MD file of ours has none
        universe = mda.Universe.empty(found[POSITION].shape[1], trajectory=True)
        universe.load_new(str(mixed.trajectory), format="H5MD", convert_units=False)
        assert len(universe.trajectory) == len(found["particles/trajectory/time"])
        for k, frame in enumerate(universe.trajectory):
            assert frame.time == pytest.approx(found["particles/trajectory/time"][k])
            np.testing.assert_array_equal(frame.positions, found[POSITION][k])
            np.testing.assert_array_equal(frame.velocities, found[VELOCITY][k])


@pytest.mark.parametrize("group", ["particles/trajectory/position", "particles/trajectory/velocity",
                                   "observables/total_energy", "observables/momentum"])
def test_xarray_time_series(mixed, found, group):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(mixed.trajectory, engine="h5netcdf", group=group) as data:
        np.testing.assert_array_equal(data["value"], found[f"{group}/value"])
        np.testing.assert_array_equal(data["time"], found["particles/trajectory/time"])
        assert data["value"].dims[0] == "time"
        assert data["value"].attrs["units"]


@pytest.mark.parametrize(("group", "names"), [
    ("bodies", ("first_particle", "particles", "first_face", "faces", "mass")),
    ("connectivity/distance", ("pairs", "length"))])
def test_xarray_tables(mixed, found, group, names):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(mixed.trajectory, engine="h5netcdf", group=group) as data:
        for name in names:
            np.testing.assert_array_equal(data[name], found[f"{group}/{name}"])
