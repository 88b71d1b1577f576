"""The part of a trajectory file that VTK reads: VTKHDF 2.0, temporal PolyData.

https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/. Points and point data are virtual datasets onto
the particles' own, so that nothing is stored twice. They must be made at their final size (an unlimited one of this
shape is refused) and may be longer than what they show. The cells are the same in every step.
"""

from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]


def write_static(group: h5py.Group, name: str, data: NDArray[Any]) -> h5py.Dataset:
    """A dataset that never changes; compressed where that can gain anything."""
    if data.nbytes < 4096:
        return group.create_dataset(name, data=data)
    return group.create_dataset(name, data=data, compression="gzip", compression_opts=1, shuffle=True)


def create_vtkhdf(file: h5py.File, cells: dict[str, Sequence[Integers] | Integers], cell_body: Integers,
                  sources: dict[str, h5py.Dataset], planned_frames: int) -> None:
    """Create /VTKHDF with no frame yet.

    `cells`: Vertices, Lines, Polygons -> one array of point numbers a cell; `cell_body`: body of every cell, in this
    order; `sources`: "position" and other point data -> dataset (T, N, 3).
    """
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array([2, 0], np.int64)
    root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
    particles = sources["position"].shape[1]
    root["NumberOfPoints"] = np.array([particles], np.int64)
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        _create_cells(root.create_group(kind), cells.get(kind, ()))
    root.create_group("PointData")
    write_static(root.create_group("CellData"), "body", cell_body.astype(np.int32))
    point_data = [name for name in sources if name != "position"]
    _create_steps(root.create_group("Steps"), particles, planned_frames, point_data)
    for name, source in sources.items():
        _create_virtual(root, "Points" if name == "position" else f"PointData/{name}", source, planned_frames)


def _create_cells(group: h5py.Group, cells: Sequence[Integers] | Integers) -> None:
    offsets = np.cumsum([0, *map(len, cells)], dtype=np.int64)
    connectivity = np.concatenate([np.zeros(0, np.int64), *cells]).astype(np.int64)
    write_static(group, "Connectivity", connectivity)
    write_static(group, "Offsets", offsets)
    group["NumberOfCells"] = np.array([len(cells)], np.int64)
    group["NumberOfConnectivityIds"] = np.array([len(connectivity)], np.int64)


def _create_steps(steps: h5py.Group, particles: int, planned_frames: int, point_data: list[str]) -> None:
    """Where each step begins is known beforehand; how many steps there are, NSteps, is what a commit changes."""
    steps.attrs["NSteps"] = np.int64(0)
    offsets = write_static(steps, "PointOffsets", np.arange(planned_frames, dtype=np.int64) * particles)
    steps.create_dataset("NumberOfParts", (planned_frames,), np.int64, fillvalue=1)     # never written: takes no space
    steps.create_dataset("PartOffsets", (planned_frames,), np.int64)
    steps["ConnectivityIdOffsets"] = steps.create_dataset("CellOffsets", (planned_frames, 4), np.int64)
    steps["CellDataOffsets/body"] = steps["PartOffsets"]
    steps.create_group("PointDataOffsets")
    for name in point_data:
        steps["PointDataOffsets"][name] = offsets
    # Its own dataset: with a hard link to the particles' time, h5netcdf would take its name for the dimension's.
    steps.create_dataset("Values", (0,), np.float64, maxshape=(None,), chunks=(min(512, planned_frames),))


def _create_virtual(root: h5py.Group, name: str, source: h5py.Dataset, planned_frames: int) -> None:
    """(T N, 3), row by row onto the (T, N, 3) of `source`. h5py's VirtualLayout cannot change the shape."""
    flat = h5py.h5s.create_simple((planned_frames * source.shape[1], 3))
    cube = h5py.h5s.create_simple((planned_frames, *source.shape[1:]))
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_virtual(flat, b".", source.name.encode(), cube)
    h5py.h5d.create(root.id, name.encode(), h5py.h5t.py_create(source.dtype), flat, dcpl=properties)
