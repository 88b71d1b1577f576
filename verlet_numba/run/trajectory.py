"""Writing a trajectory: frames are compressed and stored beside the simulation, the count of frames last.

Blocks of frames go to one background thread. It makes the chunks of the compressed datasets itself and hands HDF5 the
finished bytes (`compression`); `ordered_file` brings them to the disk so that a kill never harms committed frames.
"""

import json
import secrets
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from verlet_numba.run.compression import STORED_RAW, encode, round_mantissa
from verlet_numba.run.layout import LIBVER, BodyTable, Contents, Quantity, blank, fill_in
from verlet_numba.run.ordered_file import OrderedFile

__all__ = ["BodyTable", "Contents", "Quantity", "TrajectoryFile"]

TEMPORARY = "[0-9a-f]" * 8      # a pattern: what makes the name unique that a file has before its first commit
UNDER_WAY = 2       # blocks that may wait for the disk while the simulation goes on
CACHE_BYTES = 65536 # of HDF5 for the chunks of each dataset: they are written once, and its 8 MiB each would grow with the run


class DifferenceError(ValueError):
    """Frames simulated again are not those that a file has."""


@dataclass(frozen=True)
class _Block:
    """k consecutive frames: rows of growing datasets, path -> (k,) or (k, 3); fields, name -> (k, N, 3)."""

    rows: dict[str, NDArray[Any]]
    fields: dict[str, NDArray[Any]]

    def __len__(self) -> int:
        return len(next(iter(self.rows.values())))

    def __getitem__(self, part: slice) -> "_Block":
        return _Block({name: data[part] for name, data in self.rows.items()},
                      {name: data[part] for name, data in self.fields.items()})

    def __add__(self, other: "_Block") -> "_Block":
        return _Block({name: np.concatenate([data, other.rows[name]]) for name, data in self.rows.items()},
                      {name: np.concatenate([data, other.fields[name]]) for name, data in self.fields.items()})


class _Rows:
    """A dataset (T,) or (T, w) that grows by rows. h5py's own opening and indexing take ten times as long."""

    def __init__(self, file: h5py.File, path: str) -> None:
        self.id = h5py.h5d.open(file.id, path.encode())
        self.dtype, self.type = self.id.dtype, h5py.h5t.py_create(self.id.dtype)

    def write(self, first: int, rows: NDArray[Any]) -> None:
        shape = (first + len(rows), *rows.shape[1:])
        self.id.set_extent(shape)
        target = h5py.h5s.create_simple(shape)
        target.select_hyperslab((first,) + (0,) * (rows.ndim - 1), rows.shape)
        self.id.write(h5py.h5s.create_simple(rows.shape), target, np.ascontiguousarray(rows, self.dtype), self.type)


class _Chunked:
    """A field (T, N, 3) in gzip + shuffle chunks of whole frames, written without HDF5's own filters."""

    def __init__(self, dataset: h5py.Dataset) -> None:
        self.id, self.shape, self.chunk = dataset.id, dataset.shape[1:], dataset.chunks

    def extend(self, frames: int) -> None:
        self.id.set_extent((frames, *self.shape))

    def write(self, first: int, frames: NDArray[Any], raw: bool) -> None:
        """The chunk that starts at frame `first`, the rest of it zero; `raw` without compression."""
        for start in range(0, self.shape[0], self.chunk[1]):
            piece = frames[:, start:start + self.chunk[1]]
            if piece.shape != self.chunk:
                piece, part = np.zeros(self.chunk, frames.dtype), piece
                piece[:part.shape[0], :part.shape[1]] = part
            data = piece.tobytes() if raw else encode(piece)
            self.id.write_direct_chunk((first, start, 0), data, STORED_RAW if raw else 0)


class _AtOnce(Executor):
    """Does everything in the caller's thread."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future


class TrajectoryFile:
    """Writer of one trajectory; a context manager, which closes the file and leaves `status` at "running".

    Frames are committed (counted, and readable whatever happens) chunk by chunk; `flush` commits all of them. A chunk
    that is committed before it is full is stored without compression, then and for good: what it lacks is written
    behind what it has, so that no committed byte is ever moved.

    The file has a temporary name in its folder until the first commit, and is removed if there never is one.
    """

    def __init__(self, path: str | Path, contents: Contents, planned_frames: int, overwrite: bool = False,
                 resume_at: int | None = None, beside: bool = True) -> None:
        """`beside`: write while the caller goes on, instead of waiting for each block.

        `resume_at`: go on with the existing file; the first frame appended is this one. What it has already is kept, and
        what is appended again must equal it.

        Raises FileExistsError if `path` exists (without `overwrite` and `resume_at`), another OSError if its folder
        cannot be written to, ValueError if the file to go on with has fewer than `resume_at` frames or other particles.
        """
        self.path = Path(path)
        self.frames = 0                             # committed
        self._contents, self._overwrite = contents, overwrite
        self._most_under_way = UNDER_WAY if beside else 0
        self._named = resume_at is not None
        self._refuse_to_overwrite()
        self._disk = self._open_disk()
        try:
            if resume_at is None:
                self._disk.write(memoryview(blank(contents, planned_frames)))
            self._file = h5py.File(self._disk, "r+", libver=LIBVER, locking=False, rdcc_nbytes=CACHE_BYTES)
            if resume_at is None:
                fill_in(self._file, contents)
            self._attach()
            if resume_at is None:
                self._begin()
            else:
                self._resume(resume_at)
            self._commit(self.frames)
        except BaseException:
            self._release()
            raise
        self._thread: Executor = ThreadPoolExecutor(1, "trajectory") if beside else _AtOnce()
        self._under_way: deque[Future[None]] = deque()

    def append(self, time: ArrayLike, step: ArrayLike, fields: Mapping[str, ArrayLike],
               observables: Mapping[str, ArrayLike]) -> None:
        """k frames: time (k,) s, step (k,), fields name -> (k, N, 3), observables name -> (k,) or (k, 3); all copied.

        Returns while they are being written. Raises OSError if an earlier block could not be written, with the frames
        up to the last commit intact, DifferenceError if it differs from what the file has; nothing can be appended after
        that. Raises ValueError beyond the planned frames.
        """
        rows = dict.fromkeys(("particles/trajectory/time", "VTKHDF/Steps/Values"), np.array(time, np.float64))
        rows["particles/trajectory/step"] = np.array(step, np.int64)
        rows |= {f"observables/{name}/value": np.array(observables[name]) for name in self._contents.observables}
        block = _Block(rows, {name: np.array(fields[name], self._contents.dtype, order="C") for name in self._fields})
        self._appended += len(block)
        if self._appended > self._planned:
            raise ValueError(f"{self.path}: frame {self._appended - 1} is beyond the {self._planned} planned")
        self._wait(max(0, self._most_under_way - 1))
        self._under_way.append(self._thread.submit(self._write, block))
        if not self._most_under_way:
            self._wait(0)

    def flush(self, sync: bool = False) -> None:
        """Commit every frame appended so far, and with `sync` wait for the disk. Raises OSError as `append` does."""
        self._wait(0)
        self._thread.submit(self._write_rest).result()
        if sync:
            self._disk.sync()

    def finish(self, status: str, end: str, timing: Mapping[str, Any]) -> None:
        """Commit every frame, state how and when (ISO 8601) the run ended and where its wall seconds went, and close.

        status: complete, stopped or diverged. Raises OSError as `append` does; the file is closed even so.
        """
        try:
            self.flush()
            for name, value in (("status", status), ("end", end), ("timing", json.dumps(timing))):
                self._file[f"provenance/{name}"][()] = value
            self._commit(self.frames)
        finally:
            self.close()

    def close(self) -> None:
        """Close the file with what is committed. Closing twice does no harm."""
        self._thread.shutdown()
        self._release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    @property
    def chunk_frames(self) -> int:
        """Frames a chunk: appending multiples of it leaves nothing to `flush`."""
        return self._chunk_frames

    # Opening

    def _refuse_to_overwrite(self) -> None:
        if not (self._named or self._overwrite) and self.path.exists():
            raise FileExistsError(f"{self.path} exists already; give another path, overwrite it or resume it")

    def _open_disk(self) -> OrderedFile:
        if self._named:
            return OrderedFile(self.path, create=False)
        try:
            return OrderedFile(self.path.with_name(f".{self.path.name}.{secrets.token_hex(4)}.part"), create=True)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path.parent)) from error

    def _attach(self) -> None:
        group = self._file["particles/trajectory"]
        self._fields = {name: _Chunked(group[name]["value"]) for name in self._contents.fields}
        self._chunk_frames = int(self._fields["position"].chunk[0])
        paths = ["particles/trajectory/time", "particles/trajectory/step", "VTKHDF/Steps/Values"]
        paths += [f"observables/{name}/value" for name in self._contents.observables]
        self._rows = {path: _Rows(self._file, path) for path in paths}
        self._count = h5py.h5a.open(self._file["VTKHDF/Steps"].id, b"NSteps")
        self._planned = len(self._file["VTKHDF/Steps/PointOffsets"])

    def _begin(self) -> None:
        """A new file: nothing is stored, and nothing waits for its chunk to be full."""
        self._appended = self._stored = 0
        self._known = range(0)
        self._raw = False
        self._rest = _Block({path: np.zeros((0, *rows.id.shape[1:]), rows.dtype) for path, rows in self._rows.items()},
                            {name: np.zeros((0, *field.shape), self._contents.dtype) for name, field in self._fields.items()})

    def _resume(self, frame: int) -> None:
        """Take up the chunk that is not full, as the file has it."""
        committed = int(self._file["VTKHDF/Steps"].attrs["NSteps"])
        particles = self._fields["position"].shape[0]
        if frame > committed or particles != self._contents.particles:
            raise ValueError(f"{self.path} has {committed} frames of {particles} particles; "
                             f"cannot go on at frame {frame} with {self._contents.particles}")
        self.frames, self._appended = committed, frame
        self._known = range(frame, committed)       # frames still to be appended that the file has already
        self._stored = committed - committed % self._chunk_frames       # frames in full chunks
        self._raw = self._stored < committed        # the chunk behind them is on the disk, uncompressed
        self._rest = self._read(self._stored, committed)
        self._file["provenance/status"][()] = "running"

    # Writing, in the background thread

    def _write(self, block: _Block) -> None:
        """Store and commit every chunk that is full; keep the rest."""
        self._disk.check()
        for frames in block.fields.values() if self._contents.precision_bits < 24 else ():
            round_mantissa(frames, self._contents.precision_bits)
        block = self._new(block)
        block = self._rest + block if len(self._rest) else block
        full = len(block) - len(block) % self._chunk_frames
        if full:
            self._store(block[:full])
            self._stored, self._raw = self._stored + full, False
        self._rest = block[full:]

    def _new(self, block: _Block) -> _Block:
        """What the file does not have yet; what it has is held against it."""
        if not self._known:
            return block
        known, self._known = self._known[:len(block)], self._known[len(block):]
        again, there = block[:len(known)], self._read(known.start, known.stop)
        for mine, theirs in ((again.rows, there.rows), (again.fields, there.fields)):
            for name, data in mine.items():
                differs = (data != theirs[name]).reshape(len(known), -1).any(1)
                if differs.any():
                    raise DifferenceError(f"{self.path}: frame {known[int(differs.argmax())]} as simulated now differs in {name}; "
                                          "another scene, program or machine has written it")
        return block[len(known):]

    def _read(self, first: int, last: int) -> _Block:
        """Frames of the file. Before anything is stored: HDF5 2.0 misreads a chunk that was made longer directly."""
        part = slice(first, last)
        return _Block({path: self._file[path][part] for path in self._rows},
                      {name: self._file[f"particles/trajectory/{name}/value"][part] for name in self._fields})

    def _write_rest(self) -> None:
        self._disk.check()
        if self._stored + len(self._rest) > self.frames:
            self._raw = True
            self._store(self._rest)

    def _store(self, block: _Block) -> None:
        """Write behind the full chunks, then commit."""
        last = self._stored + len(block)
        for path, rows in block.rows.items():
            self._rows[path].write(self._stored, rows)
        for name, frames in block.fields.items():
            self._fields[name].extend(last)
            for first in range(0, len(block), self._chunk_frames):
                self._fields[name].write(self._stored + first, frames[first:first + self._chunk_frames],
                                         raw=self._raw and first == 0)
        self._commit(last)

    def _commit(self, frames: int) -> None:
        """All data first, then the count; the file's name after its first frames."""
        h5py.h5f.flush(self._file.id)
        self._count.write(np.array(frames, np.int64))
        h5py.h5f.flush(self._file.id)
        self._disk.check()
        self.frames = frames
        if frames and not self._named:
            self._refuse_to_overwrite()
            self._disk.rename(self.path)
            self._named = True

    # Ending

    def _wait(self, under_way: int) -> None:
        """Until at most so many blocks are under way; raises what a block raised."""
        while len(self._under_way) > under_way:
            self._under_way.popleft().result()

    def _release(self) -> None:
        if file := self.__dict__.pop("_file", None):
            file.close()
        self._disk.close()
        if not self._named:
            self._disk.path.unlink(missing_ok=True)
