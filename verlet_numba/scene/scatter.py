"""Random places for many copies of a body, without overlap: bounding spheres, random turns, random velocities."""

from collections.abc import Callable
from itertools import product
from math import floor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from verlet_numba.scene.body import Floats, Integers

MORTON_DIGITS = 10      # of a coordinate, binary

Free = Callable[[Floats], NDArray[np.bool_]]
"""Of sphere centres (N, 3), which ones (N,) keep the sphere clear of everything that stands there already."""


class NoRoomError(ValueError):
    """Fewer spheres fit than asked for; `fitted` is how many did."""

    def __init__(self, fitted: int) -> None:
        super().__init__(f"only {fitted} fit")
        self.fitted = fitted


def scatter(count: int, radius: float, inside: ArrayLike, free: Free, rng: np.random.Generator) -> Floats:
    """Centres (count, 3) of spheres of `radius` (m) that lie wholly inside the box [lower, upper] and do not overlap.

    Copies that are neighbours in space are mostly so in memory: 10,000 icosahedra are simulated a quarter faster than in
    random order.

    Random sequential placement: uniformly distributed, and quick up to a quarter of the volume. Fuller boxes get a
    lattice with as much jitter as its cells leave. Raises NoRoomError if that does not hold `count` either.
    """
    lower, upper = np.asarray(inside, float)
    radius = max(radius, 1e-9 * float(np.max(upper - lower)))       # points, too, keep apart
    if np.any(upper - lower < 2 * radius * (1 - 1e-12)):
        raise NoRoomError(0)
    centres = _place_in_turn(count, radius, lower + radius, upper - radius, free, rng)
    if len(centres) == count:
        return centres[along_a_curve(centres)]
    lattice = _jittered_lattice(count, radius, lower, upper, rng)
    lattice = lattice[free(lattice)]
    if len(lattice) < count:
        raise NoRoomError(max(len(centres), len(lattice)))
    return np.asarray(lattice[:count][along_a_curve(lattice[:count])])


def along_a_curve(points: Floats) -> Integers:
    """The order of points (N, 3) along a space-filling curve (Morton 1966): by the interleaved digits of their coordinates."""
    low = points.min(axis=0, initial=np.inf)
    side = max(float((points - low).max(initial=0.0)), 1e-300)
    cells = np.minimum((points - low) / side * 2**MORTON_DIGITS, 2**MORTON_DIGITS - 1).astype(np.int64)
    digits = np.arange(MORTON_DIGITS)
    places = 3 * digits[:, None] + np.arange(3)
    return np.argsort(((cells[:, None] >> digits[:, None] & 1) << places).sum(axis=(1, 2)), kind="stable")


def _place_in_turn(count: int, radius: float, lower: Floats, upper: Floats, free: Free,
                   rng: np.random.Generator) -> Floats:
    """Up to `count` centres, drawn one after another and kept if clear of all before; gives up after 30 draws a copy.

    Centres are found by cells of one diameter: those that could be too near lie in the 27 cells around.
    """
    diameter, nearest = 2 * radius, 4 * radius * radius
    around = list(product((-1, 0, 1), repeat=3))
    cells: dict[tuple[int, int, int], list[tuple[float, float, float]]] = {}
    kept: list[tuple[float, float, float]] = []
    draws = 30 * count + 1000
    while len(kept) < count and draws > 0:
        batch = min(draws, 2 * (count - len(kept)) + 64)
        draws -= batch
        candidates = rng.uniform(lower, upper, (batch, 3))
        for x, y, z in candidates[free(candidates)].tolist():
            i, j, k = floor(x / diameter), floor(y / diameter), floor(z / diameter)
            if any((x - u) ** 2 + (y - v) ** 2 + (z - w) ** 2 < nearest
                   for a, b, c in around for u, v, w in cells.get((i + a, j + b, k + c), ())):
                continue
            cells.setdefault((i, j, k), []).append((x, y, z))
            kept.append((x, y, z))
            if len(kept) == count:
                break
    return np.array(kept).reshape(-1, 3)


def _jittered_lattice(count: int, radius: float, lower: Floats, upper: Floats, rng: np.random.Generator) -> Floats:
    """Centres in cells of a lattice that hold a sphere each, moved at random within the cell; cells in random order.

    All cells, or 20 a copy if there are more.
    """
    cells = np.clip(np.floor((upper - lower) / (2 * radius) * (1 + 1e-12)), 1, 1e6).astype(np.int64)
    total = int(cells.prod())
    chosen = rng.choice(total, min(total, 20 * count + 1000), replace=False)
    corners = np.stack(np.unravel_index(chosen, cells), axis=1)
    pitch = (upper - lower) / cells
    play = np.maximum(pitch / 2 - radius, 0)
    return np.asarray(lower + (corners + 0.5) * pitch + rng.uniform(-1, 1, corners.shape) * play)


def random_rotations(count: int, rng: np.random.Generator) -> Floats:
    """Rotation matrices (count, 3, 3), uniformly distributed: a normalised Gaussian quaternion (Shoemake 1992)."""
    w, x, y, z = (q := rng.normal(size=(4, count))) / np.linalg.norm(q, axis=0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return np.moveaxis(np.array(rows), -1, 0)


def random_velocities(count: int, speed: ArrayLike, rng: np.random.Generator) -> Floats:
    """Velocities (count, 3) in m/s: directions uniform on the sphere, speeds uniform in [lowest, highest]."""
    slowest, fastest = np.asarray(speed, float)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return np.asarray(rng.uniform(slowest, fastest, (count, 1)) * direction)
