"""A trajectory as an xarray.Dataset: dimensions and units have names, and nothing is read before it is asked for."""

from typing import Any

import numpy as np
import xarray
from xarray.backends import BackendArray
from xarray.core import indexing

from verlet_numba.study.measures import UNITS, VECTORS
from verlet_numba.study.reader import Array, Trajectory


class LazyField(BackendArray):      # type: ignore[misc]    # xarray's class has no types
    """Positions or velocities behind xarray's indexing: of an index only the frames that it names are read."""

    def __init__(self, trajectory: Trajectory, name: str) -> None:
        self.trajectory, self.name = trajectory, name
        self.shape = (trajectory.frames, trajectory.particles, 3)
        self.dtype = self._read(slice(0)).dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Array:
        found: Array = indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._part)
        return found

    def _part(self, key: tuple[Any, ...]) -> Array:
        frames, *rest = key
        found: Array = self._read(frames)[(*([slice(None)] * isinstance(frames, slice)), *rest)]
        return found

    def _read(self, frames: Any) -> Array:
        values = (self.trajectory.positions if self.name == "position" else self.trajectory.velocities)(frames)
        return np.asarray(values)


def dataset(trajectory: Trajectory) -> xarray.Dataset:
    """Variables `position` and `velocity` (time, particle, axis) and every observable (time) or (time, axis).

    Coordinates: time in s, the axes' names, and for every particle the name of its `body`.
    """
    names = np.array([body.name for body in trajectory.bodies] or [""])
    counts = [body.particles for body in trajectory.bodies] or [0]
    variables: dict[str, Any] = {}
    for name, unit in (("position", "m"), ("velocity", "m/s")):
        if name == "position" or trajectory.velocities(slice(0)) is not None:
            lazy = indexing.CopyOnWriteArray(indexing.LazilyIndexedArray(LazyField(trajectory, name)))
            variables[name] = xarray.Variable(("time", "particle", "axis"), lazy, {"units": unit})
    for name, values in trajectory.observables.items():
        dimensions = ("time", "axis") if name in VECTORS else ("time",)
        variables[name] = xarray.Variable(dimensions, values, {"units": UNITS.get(name, "")})
    coordinates = {"time": ("time", trajectory.time, {"units": "s"}), "axis": ["x", "y", "z"],
                   "body": ("particle", np.repeat(names, counts))}
    told = {"title": str(trajectory.scene.get("name") or ""), "status": trajectory.provenance.get("status", "")}
    return xarray.Dataset(variables, coordinates, told)
