"""Pictures of a trajectory without a display: a sheet of frames (PNG) or a moving one (GIF)."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verlet_numba.study import reader
from verlet_numba.study.camera import NOTHING, Camera, Floats, frame_points, visible
from verlet_numba.study.reader import Trajectory
from verlet_numba.study.surfaces import Surface, body_surfaces, ground, placed, room, solid, surface, COLLIDER

SKY = np.array([[0.90, 0.93, 0.97], [1.0, 1.0, 1.0]])       # above, below
BACKGROUND = np.array([0.97, 0.98, 0.99])                   # what grounds fade into
LIGHT = np.array([0.25, -0.45, 0.86])
FINE = 2                # pixels a side that make one of the picture
SHADOW = 0.72
SHEET_FRAMES, GIF_FRAMES = 6, 120
FRAMED = 60             # frames the camera is fitted to
INK = (40, 44, 52)


class RenderError(Exception):
    """A picture that cannot be made; one line says why and what to do."""


def render(path: str | Path, output: str | Path, frames: Sequence[int] | None = None, width: int = 560,
           height: int = 420) -> list[int]:
    """Draw frames of a trajectory to `output` and return which.

    A .png shows all of them side by side, six by default, evenly spread; a .gif one after another, by default all or
    120 evenly spread, at their own pace (50 a second at most). `width` and `height` are those of one frame, pixels.
    Raises RenderError for another suffix or a frame that does not exist, TrajectoryError for an unreadable file,
    OSError for an output that cannot be written.
    """
    output = Path(output)
    if output.suffix.lower() not in (".png", ".gif"):
        raise RenderError(f"{output}: cannot write {output.suffix or 'a file without suffix'}; use .png or .gif")
    with reader.open(path) as trajectory:
        chosen = choose(trajectory, frames, GIF_FRAMES if output.suffix.lower() == ".gif" else SHEET_FRAMES)
        view = View(trajectory, width, height)
        pictures = (label(view.draw(frame), f"{trajectory.time[frame]:.2f} s") for frame in chosen)
        title = str(trajectory.scene.get("name") or Path(path).stem)
        if output.suffix.lower() == ".png":
            sheet(list(pictures), title).save(output)
        else:
            animation(pictures, trajectory.time[chosen], title, output)
    return chosen


def choose(trajectory: Trajectory, frames: Sequence[int] | None, most: int) -> list[int]:
    """The frames asked for, negative ones counted from the end, or at most `most`, evenly spread."""
    count = len(trajectory)
    if count == 0:
        raise RenderError(f"{trajectory.path}: has no frames")
    if frames is None:
        return [int(frame) for frame in np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))]
    for frame in frames:
        if not -count <= frame < count:
            raise RenderError(f"{trajectory.path}: there is no frame {frame}: it has {count}, counted from 0")
    return [frame % count for frame in frames]


class View:
    """A trajectory seen by a fixed camera that has all of its motion in sight."""

    def __init__(self, trajectory: Trajectory, width: int, height: int) -> None:
        self.trajectory = trajectory
        self.colliders = [entry for entry in trajectory.scene.get("colliders") or () if isinstance(entry, dict)]
        self.folder = trajectory.path.parent
        self.light = LIGHT / np.linalg.norm(LIGHT)
        shown = choose(trajectory, None, FRAMED)
        points = trajectory.positions(shown).astype(float).reshape(-1, 3)
        points = points[np.isfinite(points).all(axis=1)]
        low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (-np.ones(3), np.ones(3))
        self.scale = max(float(np.linalg.norm(high - low)), 1e-6)
        points = np.concatenate([points, *self._framed_colliders(shown)])
        low, high = points.min(axis=0), points.max(axis=0)
        self.centre, self.scale = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 1e-6)
        margin = 0.01 * self.scale * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (points[:, None] + margin).reshape(-1, 3) if len(points) < 1e5 else points
        self.camera = frame_points(corners, FINE * width, FINE * height)

    def _framed_colliders(self, frames: list[int]) -> Iterable[Floats]:
        """Corners of the colliders that are not much larger than the motion."""
        for collider in self.colliders:
            half = 0.5 * np.array(collider["size"], float) if collider["kind"] == "room" else None
            points = solid(collider, self.folder).reshape(-1, 3) if half is None else \
                half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            if len(points) and np.linalg.norm(np.ptp(points, axis=0)) < 3 * self.scale:
                for time in self.trajectory.time[frames]:
                    yield placed(collider, time).of(points)

    def draw(self, frame: int) -> NDArray[np.uint8]:
        """(height, width, 3) pixels."""
        time = float(self.trajectory.time[frame])
        grounds, casters = [], body_surfaces(self.trajectory, self.trajectory.positions(frame).astype(float), self.scale)
        for collider in self.colliders:
            if collider["kind"] == "plane":
                grounds += ground(collider, time, self.camera.eye, self.centre, self.scale, BACKGROUND)
            elif collider["kind"] == "room":
                grounds += room(collider, time, self.camera.eye, self.scale)
            else:
                triangles = placed(collider, time).of(solid(collider, self.folder))
                casters.append(surface(triangles, COLLIDER))
        casters = [part for part in casters if len(part.triangles)]
        image = paint(self.camera, grounds + casters, self.light)
        return np.rint(255 * image.clip(0, 1)).astype(np.uint8)


def paint(camera: Camera, surfaces: list[Surface], light: Floats) -> Floats:
    """(height, width, 3), 0 to 1: surfaces lit from `light`, their shadows on those that are not shaded."""
    sky = np.linspace(0, 1, camera.height)[:, None, None]
    image = np.broadcast_to(SKY[0] + sky * (SKY[1] - SKY[0]), (camera.height, camera.width, 3)).copy()
    if surfaces:
        triangles = np.concatenate([part.triangles for part in surfaces])
        colours = np.concatenate([shade(part, camera.eye, light) if part.shaded else part.colours for part in surfaces])
        shaded = np.repeat([part.shaded for part in surfaces], [len(part.triangles) for part in surfaces])
        seen = visible(camera, triangles)
        image[seen != NOTHING] = colours[seen[seen != NOTHING]]
        for plane in receivers(triangles[~shaded], light):
            darken(image, camera, triangles[shaded], plane, on_plane(triangles, plane)[seen] & (seen != NOTHING), light)
    return image.reshape(camera.height // FINE, FINE, camera.width // FINE, FINE, 3).mean(axis=(1, 3))


def shade(part: Surface, eye: Floats, light: Floats) -> Floats:
    """Lambert's law for sides turned to the eye, with light from all around and a little from the eye."""
    normal = np.cross(part.triangles[:, 1] - part.triangles[:, 0], part.triangles[:, 2] - part.triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    view = eye - part.triangles.mean(axis=1)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    facing = (normal * view).sum(axis=1)
    lit = np.maximum(0, np.sign(facing) * (normal @ light))
    return part.colours * (0.38 + 0.57 * lit + 0.15 * np.abs(facing))[:, None]
