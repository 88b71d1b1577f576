"""Room on the disk, looked for before the work begins."""

import shutil
from pathlib import Path


class SpaceError(OSError):
    """The disk has too little room for what is to be written."""


def require(path: Path, size: int) -> None:
    """Raise SpaceError unless the disk of `path` has `size` bytes free for this user."""
    free = shutil.disk_usage(path.parent).free
    if free < size:
        raise SpaceError(f"{path} and its checkpoints may take {megabytes(size)}, and the disk has {megabytes(free)} free: "
                         "make room, write fewer frames or fields, or give another place with -o")


def megabytes(size: int) -> str:
    return f"{size / 1e6:,.1f} MB"
