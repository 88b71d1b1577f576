"""Camera and z-buffer: triangles in space become, for every pixel, the number of the triangle seen there."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FRAGMENTS = 1 << 17     # pixels tested at once
NOTHING = -1


class Camera(NamedTuple):
    """Perspective camera. Pixels count from the upper left corner."""

    eye: Floats         # (3,) m
    axes: Floats        # (3, 3), rows: right, up, forward
    focal: float        # pixels
    width: int
    height: int

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Pixels (..., 2) and depths (...) m of points (..., 3)."""
        x, y, depth = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            column, row = 0.5 * self.width + self.focal * x / depth, 0.5 * self.height - self.focal * y / depth
        return np.stack([column, row], -1), depth


def frame_points(points: Floats, width: int, height: int, azimuth: float = -55.0, elevation: float = 20.0,
                 view: float = 28.0, fill: float = 0.88) -> Camera:
    """The nearest camera that sees all points (P, 3) within the part `fill` of the picture, z up. Angles in degrees.

    With the eye at (ex, ey, -d) in camera axes, z away from it, a point (x, y, z) is in the picture if
    abs(x - ex) <= t (z + d), t the tangent of half the angle of view. Left and right edge thus ask for
    t d + ex >= max(x - t z) and t d - ex >= max(-x - t z); the nearest eye meets both at once.
    """
    a, e = np.radians([azimuth, elevation])
    forward = -np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    axes = np.stack([right, np.cross(right, forward), forward])
    focal = 0.5 * height / np.tan(np.radians(view) / 2)
    x, y, z = axes @ points.T
    middle, distance = [], 0.0
    for side, pixels in ((x, width), (y, height)):
        t = fill * 0.5 * pixels / focal
        high, low = (side - t * z).max(), (-side - t * z).max()
        middle.append(0.5 * (high - low))       # ex, then ey
        distance = max(distance, 0.5 * (high + low) / t)
    distance = max(distance, 0.05 * (np.linalg.norm(np.ptp(points, axis=0)) or 1.0) - z.min())
    return Camera(np.array([*middle, -distance]) @ axes, axes, focal, width, height)


def visible(camera: Camera, triangles: Floats) -> NDArray[np.int32]:
    """(height, width) number of the nearest of the triangles (M, 3, 3) at each pixel's centre, or NOTHING.

    Within a triangle the barycentric coordinates and the inverse depth are linear functions of the pixel. Triangles
    of about one size on the screen are tested together on a grid of that size.
    """
    corners, depth = camera.project(triangles)
    nearest = np.zeros(camera.height * camera.width)
    found = np.full(nearest.size, NOTHING, np.int32)
    screen = np.array([camera.width, camera.height])
    with np.errstate(invalid="ignore"):
        low = np.clip(np.ceil(corners.min(axis=1) - 0.5), 0, screen)
        high = np.clip(np.floor(corners.max(axis=1) - 0.5), -1, screen - 1)
    size = (high - low + 1).max(axis=1)
    seen = (depth > 0).all(axis=1) & (high >= low).all(axis=1)
    exponent = np.ceil(np.log2(np.maximum(size, 1))).astype(int)
    for level in np.unique(exponent[seen]):
        numbers = np.flatnonzero(seen & (exponent == level))
        step = max(1, FRAGMENTS >> (2 * int(level)))
        for start in range(0, len(numbers), step):
            part = numbers[start:start + step]
            _draw(corners[part], 1 / depth[part], low[part], high[part], 1 << int(level), part, camera.width,
                  nearest, found)
    return found.reshape(camera.height, camera.width)


def _draw(corners: Floats, inverse: Floats, low: Floats, high: Floats, size: int, numbers: Integers, width: int,
          nearest: Floats, found: NDArray[np.int32]) -> None:
    """Triangles of at most `size` pixels a side, from pixel `low` to `high`, into the buffers."""
    edge = corners[:, 1:] - corners[:, :1]
    area = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.stack([edge[:, 1, 1], -edge[:, 1, 0]], 1) / area[:, None]        # gradients of the coordinates
        second = np.stack([-edge[:, 0, 1], edge[:, 0, 0]], 1) / area[:, None]
    y, x = (low[:, 1, None, None] + np.arange(size)[:, None], low[:, 0, None, None] + np.arange(size))
    dx, dy = x + 0.5 - corners[:, 0, 0, None, None], y + 0.5 - corners[:, 0, 1, None, None]
    with np.errstate(invalid="ignore"):
        u = first[:, 0, None, None] * dx + first[:, 1, None, None] * dy
        v = second[:, 0, None, None] * dx + second[:, 1, None, None] * dy
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (x <= high[:, 0, None, None]) & (y <= high[:, 1, None, None])
    which, row, column = np.nonzero(inside)
    u, v = u[inside], v[inside]
    near = inverse[which, 0] + u * (inverse[which, 1] - inverse[which, 0]) + v * (inverse[which, 2] - inverse[which, 0])
    pixel = ((low[which, 1] + row) * width + low[which, 0] + column).astype(np.int64)
    better = near > nearest[pixel]
    which, near, pixel = which[better], near[better], pixel[better]
    order = np.argsort(near)        # of several on one pixel the last, the nearest, stays
    nearest[pixel[order]] = near[order]
    found[pixel[order]] = numbers[which[order]]


def rotation_about(axis: ArrayLike, angle: float) -> Floats:
    """(3, 3) rotation by `angle` rad about `axis` of any length (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Any = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return np.asarray(turned)
