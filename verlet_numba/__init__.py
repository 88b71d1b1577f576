"""Position-based (Verlet) simulation of ropes, cloth and rigid bodies, in batches, from the command line.

`verlet_numba.open(FILE)` reads a trajectory: docs/python.md.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from verlet_numba._version import __version__

if TYPE_CHECKING:
    from verlet_numba.study.reader import Trajectory

__all__ = ["__version__", "open"]


def open(path: str | Path) -> "Trajectory":
    """Open a trajectory file for reading, even while it is being written; a context manager.

    Neither Numba nor the simulator is loaded. Raises verlet_numba.study.reader.TrajectoryError for what is no trajectory.
    """
    from verlet_numba.study.reader import open as open_trajectory

    return open_trajectory(path)
