"""What stands in a trajectory file before its first frame: H5MD groups, constraints, bodies, provenance, VTK's view.

What the readers insist on, found by trial:

- VTK's HDF5 cannot read the virtual datasets of libver "latest". ("earliest", "v110") also leaves no "open for
  writing" mark behind after a kill; SWMR shuts ordinary readers out after one.
- The H5MD attribute unit="m" makes MDAnalysis fail; the CF attribute units="m" does not.
- Every dimension needs a scale, or xarray refuses its group.
- Stock VTK reads gzip and shuffle, not lzf, blosc or zstd.
"""

import hashlib
import secrets
from dataclasses import dataclass
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from verlet_numba._version import __version__
from verlet_numba.run.vtkhdf import create_vtkhdf, write_static

FORMAT = 1                          # version of the file format
LIBVER = ("earliest", "v110")
CHUNK_BYTES = 65536                 # small frames share a chunk of about this size
CHUNK_FRAMES = 64
CHUNK_ROWS = 512                    # of time, step and observables
PIECE_BYTES = 4 << 20               # a frame above this size is cut into pieces
TEXT = h5py.string_dtype()
UNITS = {"position": "m", "velocity": "m s-1"}

Integers = NDArray[np.int64]


class Quantity(NamedTuple):
    """One observable of the whole scene: CF units ("1": none), 1 or 3 components, dtype."""

    units: str
    width: int
    dtype: str


class BodyTable(NamedTuple):
    """One row a body, in scene order, copies one after another; lists or arrays of B entries."""

    name: list[str]
    kind: list[str]
    first_particle: ArrayLike
    particles: ArrayLike
    first_face: ArrayLike           # among the scene's triangles
    faces: ArrayLike
    mass: ArrayLike                 # kg


@dataclass(frozen=True, eq=False)
class Contents:
    """All that is known of a trajectory before its first frame. Particles in file order: scene order, body by body."""

    particles: int
    pairs: Integers                             # (C, 2) distance constraints
    lengths: NDArray[np.float64]                # (C,) m
    lines: list[Integers]                       # polylines
    polygons: Integers                          # (F, 3) triangles
    bodies: BodyTable
    observables: dict[str, Quantity]
    provenance: dict[str, str | int | float]    # scene_text, folder, scene (JSON), command, seed, versions, cpu, start
    fields: tuple[str, ...] = ("position",)     # position first; velocity
    dtype: str = "f4"
    precision_bits: int = 24                    # significant bits of a stored float; 23 and less round

    def cells(self) -> tuple[dict[str, Any], Integers]:
        """VTK's vertices (particles on no line and no triangle, so that they show), lines, polygons; body of each."""
        drawn = np.concatenate([np.zeros(0, np.int64), np.ravel(self.polygons), *self.lines])
        vertices = np.setdiff1d(np.arange(self.particles), drawn)
        firsts = np.concatenate([vertices, [line[0] for line in self.lines], self.polygons[:, 0]]).astype(np.int64)
        body = np.searchsorted(np.asarray(self.bodies.first_particle), firsts, side="right") - 1
        return {"Vertices": vertices[:, None], "Lines": self.lines, "Polygons": self.polygons}, body

    def topology(self, planned_frames: int) -> bytes:
        """Digest of all that a blank file depends on: everything but lengths, masses and what provenance says."""
        bodies = self.bodies._replace(mass=len(self.bodies.name))
        arrays = (self.pairs, self.polygons, *self.lines, *map(np.asarray, bodies[2:]))
        names = (planned_frames, chunk_shape(self.particles, self.dtype, planned_frames), self.particles, self.fields, self.dtype,
                 bodies.name, bodies.kind, self.observables,
                 {name: type(value) for name, value in self.provenance.items()}, [array.shape for array in arrays])
        digest = hashlib.sha256(repr(names).encode())
        for array in arrays:
            digest.update(np.ascontiguousarray(array).data)
        return digest.digest()


def chunk_shape(particles: int, dtype: str, planned_frames: int) -> tuple[int, int, int]:
    """About 64 KiB of whole frames; one frame from 5,000 particles on; equal pieces of a frame above 4 MiB."""
    particles = max(1, particles)       # a scene without bodies has chunks too
    frame = particles * 3 * np.dtype(dtype).itemsize
    frames = max(1, min(CHUNK_FRAMES, planned_frames, CHUNK_BYTES // frame))
    return frames, -(-particles // -(-frame // PIECE_BYTES)), 3


def blank(contents: Contents, planned_frames: int) -> bytes:
    """A file with every group and dataset of a trajectory and no frame, made in memory; `fill_in` completes it.

    Making some seventy datasets takes HDF5 longer than a short run, so the last blank is kept: runs of a sweep share it.
    """
    global _kept
    digest = contents.topology(planned_frames)
    known, image = _kept
    if known != digest:
        name = f"blank {secrets.token_hex(8)}"          # HDF5 knows open files by name: two threads must not share one
        with h5py.File(name, "w", driver="core", backing_store=False, libver=LIBVER) as file:
            create_layout(file, contents, planned_frames)
            file.flush()
            image = file.id.get_file_image()
        _kept = digest, image
    return image


_kept: tuple[bytes, bytes] = (b"", b"")         # digest of what a blank depends on, and the blank


def create_layout(file: h5py.File, contents: Contents, planned_frames: int) -> None:
    """Create every group and dataset of a trajectory, with no frame in it; what runs of equal topology differ in is left blank."""
    sources = _create_trajectory(file, contents, planned_frames)
    _create_observables(file, contents.observables, planned_frames)
    _create_constraints(file.create_group("connectivity/distance"), contents)
    _create_bodies(file.create_group("bodies"), contents.bodies)
    _create_provenance(file.create_group("provenance"), contents.provenance)
    create_vtkhdf(file, *contents.cells(), sources, planned_frames)


def fill_in(file: h5py.File, contents: Contents) -> None:
    """Write what a blank lacks: lengths of sticks, masses of bodies, provenance."""
    numbers = {"connectivity/distance/length": contents.lengths, "bodies/mass": np.asarray(contents.bodies.mass)}
    texts = {f"provenance/{name}": np.array(value, TEXT if isinstance(value, str) else None)
             for name, value in contents.provenance.items()}
    for path, values in (numbers | texts).items():
        h5py.h5d.open(file.id, path.encode()).write(h5py.h5s.ALL, h5py.h5s.ALL, np.ascontiguousarray(values))


def _scale(group: h5py.Group, name: str, size: int) -> h5py.Dataset:
    """A dimension without values of its own, as netCDF-4 writes it; it takes no space."""
    scale = group.create_dataset(name, (size,), np.int8)
    scale.make_scale(f"This is a netCDF dimension but not a netCDF variable. {size:9d}")
    return scale


def _attach(dataset: h5py.Dataset, *scales: h5py.Dataset) -> None:
    for axis, scale in enumerate(scales):
        dataset.dims[axis].attach_scale(scale)


def _create_trajectory(file: h5py.File, contents: Contents, planned_frames: int) -> dict[str, h5py.Dataset]:
    root = file.create_group("h5md")
    root.attrs["version"] = np.array([1, 1], np.int32)
    root.create_group("author").attrs["name"] = "unknown"
    creator = root.create_group("creator")
    creator.attrs["name"], creator.attrs["version"] = "verlet-numba", __version__
    group = file.create_group("particles/trajectory")
    box = group.create_group("box")
    box.attrs["dimension"], box.attrs["boundary"] = 3, np.array([b"none"] * 3)
    rows = min(CHUNK_ROWS, planned_frames)
    time = group.create_dataset("time", (0,), np.float64, maxshape=(None,), chunks=(rows,))
    time.make_scale("time")
    time.attrs["units"] = "s"
    step = group.create_dataset("step", (0,), np.int64, maxshape=(None,), chunks=(rows,))
    group["spatial"] = np.array(list("xyz"), "S1")
    group["spatial"].make_scale("spatial")
    particle = _scale(group, "particle", contents.particles)
    _attach(step, time)
    values = {}
    for name in contents.fields:
        element = group.create_group(name)
        values[name] = element.create_dataset(
            "value", (0, contents.particles, 3), contents.dtype, maxshape=(None, contents.particles or None, 3),
            chunks=chunk_shape(contents.particles, contents.dtype, planned_frames),
            compression="gzip", compression_opts=1, shuffle=True)
        values[name].attrs["units"] = UNITS[name]
        _attach(values[name], time, particle, group["spatial"])
        element["time"], element["step"] = time, step
    return values


def _create_observables(file: h5py.File, observables: dict[str, Quantity], planned_frames: int) -> None:
    trajectory = file["particles/trajectory"]
    group = file.create_group("observables")
    for name, quantity in observables.items():
        element = group.create_group(name)
        tail = () if quantity.width == 1 else (quantity.width,)
        value = element.create_dataset("value", (0, *tail), quantity.dtype, maxshape=(None, *tail),
                                       chunks=(min(CHUNK_ROWS, planned_frames), *tail))
        value.attrs["units"] = quantity.units
        scales = ("time", "spatial")[:value.ndim]
        for link in ("step", *scales):      # xarray looks for a group's scales in the group
            element[link] = trajectory[link]
        _attach(value, *(trajectory[scale] for scale in scales))


def _create_constraints(group: h5py.Group, contents: Contents) -> None:
    constraint, end = _scale(group, "constraint", len(contents.pairs)), _scale(group, "end", 2)
    _attach(write_static(group, "pairs", contents.pairs.astype(np.int32)), constraint, end)
    length = write_static(group, "length", np.zeros(len(contents.pairs)))
    length.attrs["units"] = "m"
    _attach(length, constraint)


def _create_bodies(group: h5py.Group, bodies: BodyTable) -> None:
    scale = _scale(group, "body", len(bodies.name))
    for name, column in bodies._asdict().items():
        if name in ("name", "kind"):
            dataset = group.create_dataset(name, data=column, dtype=h5py.string_dtype())
        else:
            dataset = write_static(group, name, np.zeros(len(bodies.name)) if name == "mass" else np.asarray(column, np.int64))
        _attach(dataset, scale)
    group["mass"].attrs["units"] = "kg"


def _create_provenance(group: h5py.Group, provenance: dict[str, str | int | float]) -> None:
    """`status` and `end` have a fixed size, so that they change in place."""
    group.attrs["format"] = FORMAT
    for name, value in provenance.items():
        group[name] = type(value)()
    group["timing"] = "{}"
    group.create_dataset("status", (), "S16", data=b"running")
    group.create_dataset("end", (), "S40", data=b"")
