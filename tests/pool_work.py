"""What the tests of the worker pool have it do; a module of its own, since worker processes import it."""

import os
import signal
import time
from pathlib import Path
from typing import NamedTuple


class Parts(NamedTuple):
    """A batch; `folder`: where each part leaves a mark every time it is begun."""

    keys: tuple[str, ...]
    folder: Path

    def only(self, keys):
        return Parts(tuple(key for key in self.keys if key in keys), self.folder)


def tries(folder: Path, key: str) -> int:
    """How often a part was begun."""
    return len(list(folder.glob(f"{key}.*")))


def begun(folder: Path, key: str) -> int:
    count = tries(folder, key)
    (folder / f"{key}.{count}.{os.getpid()}").touch()
    return count


def mark(batch: Parts, begin, done) -> None:
    """The outcome of a part is its number of earlier tries. `die...` kills its worker by SIGKILL, `exit...` ends it, `once...` the
    first time alone, `error...` raises."""
    for key in batch.keys:
        begin(key)
        before = begun(batch.folder, key)
        if key.startswith("die") or (key.startswith("once") and before == 0):
            os.kill(os.getpid(), signal.SIGKILL)
        if key.startswith("exit"):
            os._exit(7)
        if key.startswith("error"):
            raise ValueError("no such thing")
        done(key, before)


def slowly(batch: Parts, begin, done) -> None:
    """The outcome of a part is the number of files that it left, one a finished try."""
    for key in batch.keys:
        begin(key)
        time.sleep(0.02)
        (batch.folder / f"{key}.{time.time_ns()}").touch()
        done(key, tries(batch.folder, key))
