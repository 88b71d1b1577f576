"""One writer a trajectory: a lock that its holder cannot leave behind.

A file that names its holder (host, process, start) has to be believed after a kill, on this machine or another. The kernel's
`flock` has not: it goes with the process, however that ends, and Linux' NFS hands it to the server, so that it holds
between machines. What the file says is for the message alone. Where a file system has no locks there are none.
"""

import errno
import fcntl
import os
import socket
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


class BusyError(Exception):
    """Another process writes this file."""


class Lock:
    """A context manager within which nobody else writes what stands at `path`.

    Raises BusyError, which names the holder, if somebody does; OSError if the folder cannot be written to.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = path.with_name(f".{path.name}.lock")

    def __enter__(self) -> Self:
        self.descriptor = self._open()
        while not self._stands():               # its holder has just removed the file: that lock is of no use
            os.close(self.descriptor)
            self.descriptor = self._open()
        holder = f"process {os.getpid()} on {socket.gethostname()} since {datetime.now(UTC).isoformat(timespec='seconds')}"
        with suppress(OSError):                 # a full disk: the lock holds without a name
            os.ftruncate(self.descriptor, 0)
            os.pwrite(self.descriptor, holder.encode(), 0)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.file.unlink(missing_ok=True)
        os.close(self.descriptor)

    def _open(self) -> int:
        try:
            try:
                descriptor = os.open(self.file, os.O_RDWR | os.O_CREAT, 0o666)
            except PermissionError:                 # another user's, left by a kill: it may be locked all the same
                descriptor = os.open(self.file, os.O_RDONLY)
        except OSError as failure:
            raise OSError(failure.errno, failure.strerror, str(self.path.parent)) from failure
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(descriptor, 1000, 0).decode(errors="replace") or "another process"
            os.close(descriptor)
            raise BusyError(f"{self.path} is being written by {holder}; wait for it, or give another file with -o") from None
        except OSError as failure:
            if failure.errno not in NO_LOCKS:
                os.close(descriptor)
                raise
        return descriptor

    def _stands(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self.descriptor), os.stat(self.file))
        except FileNotFoundError:
            return False
