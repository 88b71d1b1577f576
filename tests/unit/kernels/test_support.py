"""Support mapping: scanning and climbing find the same heights, on plateaus and among repeated corners too."""

import numpy as np
import pytest
from hull_pairs import hulls_of

from verlet_numba.kernels.support import climbed, scanned
from verlet_numba.scene.capacity import narrow_of as scratch


def grid_box(n):
    """A box with (n + 1)^2 corners on every side: large plateaus."""
    ticks = np.linspace(-1, 1, n + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3)
    return points[np.abs(points).max(axis=1) == 1]


def grid_graph(hulls, points, n):
    """The graph of such a box by hand: neighbours on the grid, none across."""
    steps = np.abs(points[:, None] - points[None]).sum(axis=2)
    near = (steps > 0) & (steps < 2.5 / n)
    neighbours = np.concatenate([[0], near.sum(axis=1).cumsum()])
    hulls.graph[0] = 0
    return hulls._replace(neighbours=neighbours, neighbour=np.nonzero(near)[1])


@pytest.mark.parametrize("size", [1, 2, 4, 5, 12, 100])
def test_the_first_of_the_highest_is_found(size):
    rng = np.random.default_rng(size)
    for _ in range(50):
        points = rng.integers(-2, 3, (size, 3)).astype(float)
        hulls, d = hulls_of([np.ones((3, 3)), points]), rng.integers(-2, 3, 3).astype(float)
        assert scanned(hulls.corner, 4, size, *d) == 4 + np.argmax(points @ d)


def test_climbing_reaches_the_top_from_everywhere():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3))
    points = np.concatenate([points / np.linalg.norm(points, axis=1)[:, None], 0.7 * np.eye(3)])
    hulls = hulls_of([points], graphs=[0])
    seen, row = scratch(hulls).seen, hulls.graph[0]
    outer = [k for k in range(len(points)) if hulls.neighbours[row + k + 1] > hulls.neighbours[row + k]]
    assert len(outer) == 300            # what lies inside has no neighbours
    for _ in range(200):
        d = rng.normal(size=3)
        top = climbed(hulls.corner, 0, row, hulls.neighbours, hulls.neighbour, seen, rng.choice(outer), *d)
        assert points[top] @ d == pytest.approx((points @ d).max(), rel=1e-14)


@pytest.mark.parametrize("copies", [1, 2])
def test_a_plateau_does_not_stop_the_climb(copies):
    """On a side whose corners are all of one height, and among corners repeated, no neighbour is higher."""
    n, rng = 6, np.random.default_rng(1)
    points = np.repeat(grid_box(n), copies, axis=0)
    hulls = grid_graph(hulls_of([points]), points, n)
    if copies == 2:             # of two corners in one place one knows only the other, which knows all others
        pairs = [[k + 1] if k % 2 == 0 else [k - 1, *(e - e % 2 + 1 for e in set(
            hulls.neighbour[hulls.neighbours[k]:hulls.neighbours[k + 1]].tolist()))] for k in range(len(points))]
        hulls = hulls._replace(neighbours=np.cumsum([0, *map(len, pairs)]), neighbour=np.concatenate(pairs))
    seen = scratch(hulls).seen
    directions = [*np.eye(3), *-np.eye(3), [1, 1, 0], [0, -1, 1], [1, 1, 1], *rng.normal(size=(50, 3))]
    for d in np.array(directions, float):
        for warm in rng.integers(0, len(points), 10):
            top = climbed(hulls.corner, 0, 0, hulls.neighbours, hulls.neighbour, seen, warm, *d)
            assert points[top] @ d == pytest.approx((points @ d).max(), rel=1e-14)
