"""A heap on several threads is the heap on one, bit for bit."""

import numpy as np
import pytest
import worlds

from verlet_numba._jit import use_threads
from verlet_numba.run import engine

HEAP = {"time": {"duration": 1, "frame_rate": 60}, "effects": {"gravity": [0, 0, -9.81], "friction": 0.5},
        "bodies": [{"kind": "icosahedron", "radius": 0.1, "mass": 1, "count": 60,
                    "scatter": {"inside": [[-0.4, -0.4, -0.4], [0.4, 0.4, 0.4]], "speed": [0, 2]}}],
        "colliders": [{"kind": "room", "size": [0.8, 0.8, 0.8]}], "output": {"precision": "float64"}}


@pytest.mark.validate
def test_a_heap_on_several_threads_is_that_on_one(monkeypatch):
    monkeypatch.setattr(engine, "MANY", 2)
    position, _, measures = worlds.advanced(worlds.started(HEAP), 20)
    threaded = worlds.started(HEAP)
    assert engine.spread_over(threaded, 2).world.effects.meet.beside is not None
    position_beside, _, measures_beside = worlds.advanced(threaded, 20)
    use_threads(1)
    assert measures[:, engine.PENETRATION].max() > 0
    np.testing.assert_array_equal(position, position_beside)
    np.testing.assert_array_equal(measures, measures_beside)
