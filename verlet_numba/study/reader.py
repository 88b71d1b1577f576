"""Reading a trajectory: committed frames as numpy arrays, loaded when asked for."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray

Array = NDArray[Any]
Frames = int | slice | list[int] | NDArray[np.int64]

ALL = slice(None)


class TrajectoryError(Exception):
    """A file that cannot be read as a trajectory; one line says which, why and what to do."""


class Body(NamedTuple):
    """One row of /bodies. Its particles are first_particle ... first_particle + particles - 1; its faces likewise."""

    name: str
    kind: str
    first_particle: int
    particles: int
    first_face: int
    faces: int
    mass: float     # kg


class Observables(Mapping[str, Array]):
    """Columns by name; `read` is called for each once."""

    def __init__(self, names: Iterable[str], read: Callable[[str], Array]) -> None:
        self._columns: dict[str, Array | None] = dict.fromkeys(names)
        self._read = read

    def __getitem__(self, name: str) -> Array:
        column = self._columns[name]
        if column is None:
            column = self._columns[name] = self._read(name)
        return column

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)


class Trajectory:
    """An open trajectory file, read-only; a context manager. Frames behind the committed count are never shown.

    Every access raises TrajectoryError for data that is damaged or missing.
    """

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path = path
        self._file = file
        count = int(self._attribute("VTKHDF/Steps", "NSteps"))
        position = self._dataset("particles/trajectory/position/value")
        time = self._dataset("particles/trajectory/time")
        if position.ndim != 3 or position.shape[2] != 3 or not 0 <= count <= min(len(position), time.size):
            raise TrajectoryError(f"{path}: damaged: {count} frames are counted, {position.shape} are stored")
        self.frames, self.particles = count, int(position.shape[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __len__(self) -> int:
        return self.frames

    def close(self) -> None:
        self._file.close()

    @cached_property
    def time(self) -> NDArray[np.float64]:
        """(T,) s."""
        return self._read("particles/trajectory/time", slice(self.frames))

    @cached_property
    def step(self) -> NDArray[np.int64]:
        """(T,) number of the substep."""
        return self._read("particles/trajectory/step", slice(self.frames))

    def positions(self, frames: Frames = ALL, particles: slice = ALL) -> Array:
        """(k, N, 3) m, or (N, 3) for one frame; frames are counted as in a list, -1 is the last committed."""
        return self._field("position", frames, particles)

    def velocities(self, frames: Frames = ALL, particles: slice = ALL) -> Array | None:
        """Like `positions`, m/s; None in a file without them."""
        return self._field("velocity", frames, particles) if "velocity" in self._names("particles/trajectory") else None

    @cached_property
    def bodies(self) -> list[Body]:
        """In scene order."""
        columns = [self._read(f"bodies/{name}").tolist() for name in Body._fields]
        columns[:2] = [[value.decode(errors="replace") for value in column] for column in columns[:2]]
        return [Body(*row) for row in zip(*columns, strict=False)]

    @cached_property
    def lines(self) -> list[NDArray[np.int64]]:
        """Polylines, each its particles' numbers."""
        offsets = self._read("VTKHDF/Lines/Offsets")
        return np.split(self._read("VTKHDF/Lines/Connectivity"), offsets[1:-1]) if len(offsets) > 1 else []

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """(F, 3) particle numbers."""
        corners = self._read("VTKHDF/Polygons/Connectivity")
        return corners[:len(corners) // 3 * 3].reshape(-1, 3)

    @cached_property
    def vertices(self) -> NDArray[np.int64]:
        """(V,) particles on no line and no triangle."""
        return self._read("VTKHDF/Vertices/Connectivity")

    @cached_property
    def pairs(self) -> NDArray[np.int32]:
        """(C, 2) particles of the distance constraints."""
        return self._read("connectivity/distance/pairs")

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """(C,) m, rest lengths of the pairs."""
        return self._read("connectivity/distance/length")

    @cached_property
    def observables(self) -> "Observables":
        """Name -> (T,) or (T, 3), each read when asked for."""
        return Observables(self._names("observables"), lambda name: self._read(f"observables/{name}/value", slice(self.frames)))

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """What /provenance says: texts, numbers, `status`; `scene` and `timing` are JSON texts."""
        found = {name: self._read(f"provenance/{name}", ()) for name in self._names("provenance")}
        return {name: value.decode(errors="replace") if isinstance(value, bytes) else value.item()
                for name, value in found.items()}

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The scene as resolved."""
        try:
            scene = json.loads(bytes(self._read("provenance/scene", ())))
        except (KeyError, TypeError, ValueError) as error:
            raise TrajectoryError(f"{self.path}: damaged: /provenance/scene is no JSON ({error})") from error
        if not isinstance(scene, dict):
            raise TrajectoryError(f"{self.path}: damaged: /provenance/scene is no JSON object")
        return scene

    def body(self, name: str) -> "BodyView":
        """A body alone, of several copies the copy NAME.K. Raises TrajectoryError if there is none of that name."""
        for body in self.bodies:
            if body.name == name:
                return BodyView(self, body)
        known = ", ".join(body.name for body in self.bodies[:10]) + (" ..." if len(self.bodies) > 10 else "")
        raise TrajectoryError(f"{self.path}: there is no body {name!r}; there are {known or 'none'}")

    def to_xarray(self) -> "xarray.Dataset":
        """Positions, velocities and observables with labels, as an xarray.Dataset that reads what is asked of it, while this file
        is open. Raises ImportError without xarray."""
        from verlet_numba.study.labelled import dataset

        return dataset(self)

    def _field(self, name: str, frames: Frames, particles: slice = ALL) -> Array:
        numbers = np.arange(self.frames)[frames]        # IndexError for a frame that is not there
        path = f"particles/trajectory/{name}/value"
        if np.ndim(numbers) == 0:
            return self._read(path, (int(numbers), particles))
        if isinstance(frames, slice) and len(numbers) and (frames.step or 1) > 0:
            return self._read(path, (slice(int(numbers[0]), int(numbers[-1]) + 1, frames.step), particles))
        unique, places = np.unique(numbers, return_inverse=True)
        return self._read(path, (unique, particles))[places]

    def _item(self, path: str) -> Any:
        try:
            return self._file[path]
        except (KeyError, OSError, RuntimeError, ValueError) as error:
            raise TrajectoryError(f"{self.path}: no trajectory, or damaged: it lacks /{path}") from error

    def _dataset(self, path: str) -> h5py.Dataset:
        item = self._item(path)
        if not isinstance(item, h5py.Dataset):
            raise TrajectoryError(f"{self.path}: damaged: /{path} is no dataset")
        return item

    def _names(self, path: str) -> list[str]:
        try:
            return list(self._item(path))
        except (OSError, RuntimeError, ValueError, TypeError) as error:
            raise TrajectoryError(f"{self.path}: damaged: /{path} cannot be listed ({error})") from error

    def _read(self, path: str, part: Any = ALL) -> Array:
        dataset = self._dataset(path)
        try:
            return dataset[part]       # type: ignore[no-any-return]  # h5py has no types
        except (OSError, RuntimeError, ValueError, TypeError, MemoryError) as error:
            raise TrajectoryError(f"{self.path}: damaged: /{path} cannot be read ({error})") from error

    def _attribute(self, path: str, name: str) -> Any:
        try:
            return self._item(path).attrs[name]
        except (KeyError, OSError, RuntimeError, AttributeError) as error:
            raise TrajectoryError(f"{self.path}: no trajectory, or damaged: /{path} lacks {name}") from error


class BodyView:
    """A body of an open trajectory: its particles are numbered from 0. Arrays are read when they are asked for."""

    def __init__(self, trajectory: Trajectory, body: Body) -> None:
        self._trajectory, self._body = trajectory, body
        self.name, self.kind, self.mass = body.name, body.kind, body.mass      # mass: kg
        self._own = slice(body.first_particle, body.first_particle + body.particles)

    def __len__(self) -> int:
        """The number of its particles."""
        return self._body.particles

    def positions(self, frames: Frames = ALL) -> Array:
        """(k, n, 3) m, or (n, 3) for one frame."""
        return self._trajectory.positions(frames, self._own)

    def velocities(self, frames: Frames = ALL) -> Array | None:
        """Like `positions`, m/s; None in a file without them."""
        return self._trajectory.velocities(frames, self._own)

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """(F, 3) particles, counter-clockwise seen from outside (cloth: from the side of its normal)."""
        faces = slice(self._body.first_face, self._body.first_face + self._body.faces)
        return self._trajectory.triangles[faces] - self._own.start

    @cached_property
    def lines(self) -> list[NDArray[np.int64]]:
        """Polylines, each its particles."""
        return [line - self._own.start for line in self._trajectory.lines if self._own.start <= line[0] < self._own.stop]

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """(C, 2) particles of its distance constraints."""
        return self._trajectory.pairs[self._constraints].astype(np.int64) - self._own.start

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """(C,) m, rest lengths of the pairs."""
        return self._trajectory.lengths[self._constraints]

    @cached_property
    def _constraints(self) -> NDArray[np.bool_]:
        pairs = self._trajectory.pairs
        return np.asarray(((pairs >= self._own.start) & (pairs < self._own.stop)).all(axis=1))


def open(path: str | Path) -> Trajectory:
    """Open a trajectory file for reading, even while it is being written. Raises TrajectoryError."""
    path = Path(path)
    if not path.is_file():
        raise TrajectoryError(f"{path}: no such file")
    try:
        if not h5py.is_hdf5(path):
            raise TrajectoryError(f"{path}: no HDF5 file; a trajectory is what `verlet-numba run` writes")
        file = h5py.File(path, "r", locking=False)
    except (OSError, RuntimeError, ValueError) as error:
        raise TrajectoryError(f"{path}: cannot be opened, it may be truncated ({error})") from error
    try:
        return Trajectory(path, file)
    except BaseException:
        file.close()
        raise
