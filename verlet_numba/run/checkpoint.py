"""The whole state of a simulation beside its trajectory, from which it goes on bit for bit.

All arrays of the world are kept, not a list of those that a substep hands to the next: such a list is wrong the day a kernel
learns to remember something. They take about as many bytes as a few dozen frames.

A checkpoint is a line that names the format, a line with the hash of what follows, a line of JSON (who made it, the
summary so far, names, types and shapes), and the arrays as they lie in memory. The hash is looked at before anything else,
so that no damage does harm: `numpy.load` would allocate whatever a damaged header asks for. HDF5 hashes nothing unasked,
and closing a file after a failed write may crash it.

It gets its name when all of it is on the disk; the one before is kept under another name. Whatever moment a kill picks, one
of the two is whole.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from verlet_numba._jit import sources
from verlet_numba._version import __version__
from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.world import World

FORMAT = b"verlet-numba checkpoint 1"


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """What a checkpoint holds: the hashes by which `origin` knows the simulation, its summary so far, arrays by path."""

    origin: dict[str, str]
    summary: dict[str, Any]
    arrays: dict[str, Array]

    @property
    def frames(self) -> int:
        """Frames of the trajectory that were committed before the checkpoint was written."""
        return int(self.summary["frames"])


def origin(world: World) -> dict[str, str]:
    """What a simulation depends on, from its world at the start: what stands in it, and the program."""
    digest = hashlib.blake2b(repr(scalars(world)).encode())
    for path, array in arrays(world):
        digest.update(f"{path} {array.dtype.str} {array.shape}\n".encode())
        digest.update(raw(array))
    return {"start": digest.hexdigest()} | program()


@cache
def program() -> dict[str, str]:
    """What this program is, as far as a simulation depends on it."""
    return {"kernels": sources(), "numba": version("numba"), "verlet-numba": __version__}


def arrays(part: Any, path: str = "") -> Iterator[tuple[str, Array]]:
    """Every array of a world under its path, such as `effects.contact.push`."""
    for name, value in part._asdict().items():
        if isinstance(value, np.ndarray):
            yield path + name, value
        elif isinstance(value, tuple):
            yield from arrays(value, f"{path}{name}.")


def scalars(part: Any) -> list[Any]:
    """Everything else."""
    return [scalars(value) if isinstance(value, tuple) else value for value in part if not isinstance(value, np.ndarray)]


def restored(part: Any, saved: dict[str, Array], path: str = "") -> Any:
    """A world with saved arrays in place of its own, also where buffers had grown.

    What is not among them stays: scratch that a run on another number of threads has not.
    """
    return part._replace(**{
        name: restored(value, saved, f"{path}{name}.") if isinstance(value, tuple) else
        gate(saved.get(path + name, value), value.dtype)
        for name, value in part._asdict().items() if isinstance(value, np.ndarray | tuple)})


def raw(array: Any) -> memoryview:
    """The bytes of an array, not copied."""
    return memoryview(array).cast("B") if array.size else memoryview(b"")


def size(world: World) -> int:
    """Bytes of a checkpoint, nearly."""
    return sum(array.nbytes for _, array in arrays(world))


def names(trajectory: Path) -> tuple[Path, Path, Path]:
    """Where the checkpoint of a trajectory stands, where the one before, and where the next is made."""
    name = f"{trajectory.name}.checkpoint"
    return trajectory.with_name(name), trajectory.with_name(f"{name}.previous"), trajectory.with_name(f".{name}.part")


def write(trajectory: Path, made_from: dict[str, str], summary: dict[str, Any], world: World) -> None:
    """Write the checkpoint of a trajectory. Raises OSError; the ones before are still there then."""
    last, previous, part = names(trajectory)
    found = dict(arrays(world))
    told = {"origin": made_from, "summary": summary,
            "arrays": [(path, array.dtype.str, array.shape) for path, array in found.items()]}
    parts: list[Any] = [json.dumps(told).encode() + b"\n", *map(raw, found.values())]
    digest = hashlib.blake2b()
    for data in parts:
        digest.update(data)
    try:
        with part.open("wb") as file:
            file.write(FORMAT + b"\n" + digest.hexdigest().encode() + b"\n")
            for data in parts:
                file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if last.exists():
            os.replace(last, previous)
        os.replace(part, last)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror, str(last)) from error


def read(path: Path) -> Checkpoint | None:
    """A checkpoint; None if there is none, or it is not whole."""
    try:
        kind, digest, content = path.read_bytes().split(b"\n", 2)
    except (OSError, ValueError):
        return None
    if kind != FORMAT or digest != hashlib.blake2b(content).hexdigest().encode():
        return None
    told, data = json.loads(content[:content.index(b"\n")]), memoryview(content)[content.index(b"\n") + 1:]
    found = {}
    for name, dtype, shape in told["arrays"]:
        count = int(np.prod(shape))
        found[name] = np.frombuffer(data, dtype, count).reshape(shape)
        data = data[count * found[name].itemsize:]
    return Checkpoint(told["origin"], told["summary"], found)


def newest(trajectory: Path, frames: int) -> Checkpoint | None:
    """The newest whole checkpoint of a trajectory that has all the frames which it counts."""
    found = (read(path) for path in names(trajectory)[:2])
    return next((each for each in found if each is not None and each.frames <= frames), None)


def there(trajectory: Path) -> int:
    """Bytes that its checkpoints take on the disk."""
    return sum(path.stat().st_size for path in names(trajectory) if path.exists())


def remove(trajectory: Path) -> None:
    """There is nothing to go on with any more."""
    for path in names(trajectory):
        path.unlink(missing_ok=True)
