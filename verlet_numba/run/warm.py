"""Machine code for a scene's effects, made ahead of its runs: once for each cluster node or image."""

import time
from pathlib import Path

from verlet_numba._jit import CACHE
from verlet_numba.run.engine import start, warm
from verlet_numba.scene.build import build
from verlet_numba.scene.prepare import Prepared

PLACES = (Path(__file__).parents[1] / "scenes", Path(__file__).parents[2] / "scenes")    # installed; in a clone


def paper_scenes() -> list[Path]:
    """The scenes of the paper that come with the program. Raises FileNotFoundError where they are missing."""
    found = [scene for place in PLACES for scene in sorted((place / "paper").glob("*.yaml"))]
    if not found:
        raise FileNotFoundError("the scenes of the paper are not installed; name scenes to compile for")
    return found


def warm_up(prepared: Prepared) -> tuple[float, Path]:
    """Compile, or load from the cache, everything a scene needs. Returns seconds and the cache's folder."""
    clock = time.perf_counter()
    warm(start(build(prepared.scene, prepared.bodies, prepared.loaded.folder)))
    return time.perf_counter() - clock, CACHE
