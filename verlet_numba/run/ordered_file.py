"""A file that is whole after every kill: bytes reach the disk in an order that never breaks what was committed before.

HDF5 writes a flush in the order of addresses, so that a kill half-way can leave an index that points at what is not
there yet, or a header that promises a longer file. Here everything new is written at once, behind the committed end,
where no reader looks; what changes in place is held back until all of the new stands. Changes in place are few, small
and go from low to high addresses: the superblock first, and the root of an index before its branches.

A write that fails (disk full, size limit, quota) is therefore harmless: the committed part is untouched. HDF5 is not
told, since closing a file after a failed write can crash it; it goes on in memory, and `check` raises.
"""

import os
from pathlib import Path


class OrderedFile:
    """File object for `h5py.File`. `flush`, which HDF5 calls at the end of each of its own, is the commit."""

    def __init__(self, path: Path, create: bool) -> None:
        flags = os.O_RDWR | (os.O_CREAT | os.O_EXCL if create else 0) | getattr(os, "O_BINARY", 0)
        self.path = path
        self.descriptor = os.open(path, flags, 0o666)
        self.position = 0
        self.length = os.fstat(self.descriptor).st_size     # as HDF5 sees it
        self.committed = self.length
        self.held: dict[int, bytes] = {}                    # address -> changes in place that wait; disjoint
        self.failure: OSError | None = None

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self.position = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self.position, os.SEEK_END: self.length}[whence]
        return self.position

    def tell(self) -> int:
        return self.position

    def write(self, data: memoryview) -> int:
        start, self.position = self.position, self.position + len(data)
        self.length = max(self.length, self.position)
        old = min(len(data), max(0, self.committed - start))       # bytes in front of the committed end
        if old:
            self._hold(start, bytes(data[:old]))
        if old < len(data):
            self._write_through(start + old, data[old:])
        return len(data)

    def readinto(self, buffer: memoryview) -> int:
        start = self.position
        size = max(0, min(len(buffer), self.length - start))
        self.position += size
        found = os.pread(self.descriptor, size, start)
        buffer[:size] = found + bytes(size - len(found))
        for address, data in self._overlapping(start, start + size):
            low, high = max(address, start), min(address + len(data), start + size)
            buffer[low - start:high - start] = data[low - address:high - address]
        return size

    def read(self, size: int = -1) -> bytes:
        buffer = bytearray(max(0, self.length - self.position) if size < 0 else size)
        return bytes(buffer[:self.readinto(memoryview(buffer))])

    def truncate(self, size: int) -> int:
        """A longer file is made longer at once. It never becomes shorter than what is committed."""
        self.length = size
        if self.failure is None and size >= self.committed:
            try:
                os.ftruncate(self.descriptor, size)
            except OSError as error:
                self.failure = error
        return size

    def flush(self) -> None:
        """Commit: the held changes go out, lowest address first."""
        if self.failure is None:
            for address in sorted(self.held):
                self._write_through(address, memoryview(self.held.pop(address)))
            self.committed = self.length

    def sync(self) -> None:
        """Wait until the disk has what is committed. Raises OSError as `check` does."""
        try:
            os.fsync(self.descriptor)
        except OSError as error:
            self.failure = self.failure or error
        self.check()

    def check(self) -> None:
        """Raise the first failed write's OSError, with the file's name."""
        if self.failure is not None:
            raise OSError(self.failure.errno, self.failure.strerror, str(self.path)) from self.failure

    def rename(self, path: Path) -> None:
        os.replace(self.path, path)
        self.path = path

    def close(self) -> None:
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1

    def _write_through(self, start: int, data: memoryview) -> None:
        done = 0
        try:
            while self.failure is None and done < len(data):
                done += os.pwrite(self.descriptor, data[done:], start + done)
        except OSError as error:
            self.failure = error
        if done < len(data):
            self._hold(start + done, bytes(data[done:]))

    def _hold(self, start: int, data: bytes) -> None:
        for address, old in self._overlapping(start, start + len(data)):
            del self.held[address]
            data = old[:max(0, start - address)] + data + old[max(0, start + len(data) - address):]
            start = min(start, address)
        self.held[start] = data

    def _overlapping(self, start: int, stop: int) -> list[tuple[int, bytes]]:
        return [(address, data) for address, data in self.held.items()
                if address < stop and start < address + len(data)]
