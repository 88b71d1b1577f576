"""Machine code for a scene's effects, made ahead of its runs: once for each cluster node or image."""

import time
from pathlib import Path

from verlet_numba._jit import CACHE
from verlet_numba.run.engine import start, warm
from verlet_numba.scene.build import build
from verlet_numba.scene.prepare import Prepared


def warm_up(prepared: Prepared) -> tuple[float, Path]:
    """Compile, or load from the cache, everything a scene needs. Returns seconds and the cache's folder."""
    clock = time.perf_counter()
    warm(start(build(prepared.scene, prepared.bodies, prepared.loaded.folder)))
    return time.perf_counter() - clock, CACHE
