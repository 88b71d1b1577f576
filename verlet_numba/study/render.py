"""Pictures of a trajectory without a display: a sheet of frames (PNG) or a moving one (GIF, MP4)."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verlet_numba.study import moving, reader
from verlet_numba.study.camera import NOTHING, Camera, Floats, frame_points, visible
from verlet_numba.study.reader import Trajectory, TrajectoryError
from verlet_numba.study.surfaces import COLLIDER, Surface, body_surfaces, ground, placed, room, solid, surface

BACKGROUND = np.array([0.96, 0.97, 0.99])
LIGHT = np.array([-0.24, -0.54, 0.81])      # towards it: above, from the left and a little from the front
FINE = 2                # pixels a side that make one of the picture
SHADOW_DEPTH = 0.38
SOFT = 2.5              # pixels, the blur of a shadow's edge
MOST = {".png": 6, ".gif": 120, ".mp4": 240}        # frames of a picture, by its suffix, unless they are chosen
FRAMED = 60             # frames the camera is fitted to
INK = (40, 44, 52)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])      # of a cube


class RenderError(Exception):
    """A picture that cannot be made; one line says why and what to do."""


def render(path: str | Path, output: str | Path, frames: Sequence[int | slice] | None = None, width: int = 560,
           height: int = 420) -> list[int]:
    """Draw frames of a trajectory to `output` and return which.

    A .png shows all of them side by side, six by default, evenly spread; a .gif or .mp4 one after another at their own
    pace, by default all or the most of MOST, evenly spread; what comes too fast after another for the format is left out.
    `width` and `height` are those of one frame, pixels. Raises RenderError for another suffix, a frame that does not
    exist or a missing package, TrajectoryError for an unreadable file, OSError for an output that cannot be written.
    """
    output = Path(output)
    suffix = output.suffix.lower()
    if suffix not in MOST:
        raise RenderError(f"{output}: cannot write {suffix or 'a file without suffix'}; use {', '.join(MOST)}")
    with reader.open(path) as trajectory:
        if trajectory.particles == 0:
            raise RenderError(f"{path}: has no particles, so there is nothing to draw")
        chosen = choose(trajectory, frames, MOST[suffix])
        clock = moving.clock(trajectory.time[chosen])
        if suffix != ".png":
            kept = moving.apart(clock, moving.SHORTEST[suffix])
            chosen, clock = [chosen[k] for k in kept], clock[kept]
        title = str(trajectory.scene.get("name") or Path(path).stem)
        try:
            view = View(trajectory, width, height)
            pictures = (label(view.draw(frame), f"{trajectory.time[frame]:.2f} s") for frame in chosen)
            if suffix == ".png":
                sheet(list(pictures), title).save(output)
            elif suffix == ".gif":
                moving.write_gif(list(pictures), clock, title, output)
            else:
                moving.write_mp4(pictures, clock, title, output)
        except ImportError as error:
            raise RenderError(f"{output}: needs imageio-ffmpeg: pip install 'verlet-numba[video]'") from error
        except (LookupError, TypeError, ValueError, ArithmeticError) as error:
            raise TrajectoryError(f"{path}: cannot be drawn, its scene or its numbers are damaged ({error!r})") from error
    return chosen


def choose(trajectory: Trajectory, frames: Sequence[int | slice] | None, most: int) -> list[int]:
    """The frames asked for, negative ones counted from the end, slices cut to what there is; or at most `most`, evenly spread."""
    count = len(trajectory)
    if count == 0:
        raise RenderError(f"{trajectory.path}: has no frames")
    if frames is None:
        return [int(frame) for frame in np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(int))]
    chosen: list[int] = []
    for frame in frames:
        if isinstance(frame, slice):
            chosen += range(count)[frame]
        elif -count <= frame < count:
            chosen.append(frame % count)
        else:
            raise RenderError(f"{trajectory.path}: there is no frame {frame}: it has {count}, counted from 0")
    if not chosen:
        raise RenderError(f"{trajectory.path}: has none of these frames: it has {count}, counted from 0")
    return chosen


class View:
    """A trajectory seen by a fixed camera that has all of its motion in sight."""

    def __init__(self, trajectory: Trajectory, width: int, height: int) -> None:
        self.trajectory = trajectory
        self.colliders = [entry for entry in trajectory.scene.get("colliders") or () if isinstance(entry, dict)]
        folders = Path(trajectory.provenance.get("folder", "")), trajectory.path.parent      # of the scene when it ran; moved since
        self.solids = [solid(collider, folders) for collider in self.colliders]
        self.light = LIGHT / np.linalg.norm(LIGHT)
        shown = choose(trajectory, None, FRAMED)
        points = trajectory.positions(shown).astype(float).reshape(-1, 3)
        points = points[np.isfinite(points).all(axis=1)]
        self.scale = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        points = np.concatenate([points, *self._framed_colliders(shown)])
        self.scale = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
        self.centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self.camera = frame_points(points, FINE * width, FINE * height)

    def _framed_colliders(self, frames: list[int]) -> Iterable[Floats]:
        """Corners of the colliders that are not much larger than the motion."""
        for collider, triangles in zip(self.colliders, self.solids, strict=True):
            points = triangles.reshape(-1, 3)
            if collider["kind"] == "room":
                points = 0.5 * np.array(collider["size"], float) * CORNERS
            if len(points) and np.linalg.norm(np.ptp(points, axis=0)) < 3 * self.scale:
                moves = collider.get("path") or collider.get("spin")
                for time in self.trajectory.time[frames if moves else frames[:1]]:
                    yield placed(collider, time).of(points)

    def draw(self, frame: int) -> NDArray[np.uint8]:
        """(height, width, 3) pixels."""
        time = float(self.trajectory.time[frame])
        positions = self.trajectory.positions(frame).astype(float)
        found = body_surfaces(self.trajectory, positions, self.scale)
        for collider, triangles in zip(self.colliders, self.solids, strict=True):
            if collider["kind"] == "plane":
                found += ground(collider, time, self.camera.eye, self.centre, self.scale, BACKGROUND)
            elif collider["kind"] == "room":
                found += room(collider, time, self.camera.eye, self.scale)
            else:
                found.append(surface(placed(collider, time).of(triangles), COLLIDER))
        image = paint(self.camera, [part for part in found if len(part.triangles)], self.light)
        return np.asarray(np.rint(255 * image.clip(0, 1)), np.uint8)


def paint(camera: Camera, surfaces: list[Surface], light: Floats) -> Floats:
    """(height, width, 3), 0 to 1: surfaces lit from `light`, and their shadows on the ground."""
    image: Floats = np.broadcast_to(BACKGROUND, (camera.height, camera.width, 3)).copy()
    if surfaces:
        triangles = np.concatenate([part.triangles for part in surfaces])
        seen = visible(camera, triangles)
        colours = np.concatenate([shade(part, camera.eye, light) if part.solid else part.colours for part in surfaces])
        image[seen != NOTHING] = colours[seen[seen != NOTHING]]
        casters = np.concatenate([np.zeros((0, 3, 3)), *(part.triangles for part in surfaces if part.solid)])
        first = np.cumsum([0, *(len(part.triangles) for part in surfaces)])
        for k, part in enumerate(surfaces):
            if part.normal is not None and part.normal @ light > 0.5:
                here = (seen >= first[k]) & (seen < first[k + 1])
                image[here] *= 1 - SHADOW_DEPTH * shadow(camera, casters, part, light)[here][:, None]
    return np.asarray(image.reshape(camera.height // FINE, FINE, camera.width // FINE, FINE, 3).mean(axis=(1, 3)))


def shadow(camera: Camera, casters: Floats, ground: Surface, light: Floats) -> Floats:
    """(height, width) how far each pixel of a flat ground is in the shadow of `casters`, 0 to 1, with soft edges."""
    from scipy.ndimage import gaussian_filter

    normal = np.asarray(ground.normal)
    above = (casters - ground.triangles[0, 0]) @ normal
    cast = casters - (above / (normal @ light))[..., None] * light
    covered = visible(camera, cast[(above > 0).any(axis=1)]) != NOTHING
    return np.asarray(gaussian_filter(covered.astype(np.float32), SOFT))


def shade(part: Surface, eye: Floats, light: Floats) -> Floats:
    """Lambert's law for sides turned to the eye, with light from all around and a little from the eye."""
    normal = np.cross(part.triangles[:, 1] - part.triangles[:, 0], part.triangles[:, 2] - part.triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    view = eye - part.triangles.mean(axis=1)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    facing = (normal * view).sum(axis=1)
    lit = np.maximum(0, np.sign(facing) * (normal @ light))
    return np.asarray(part.colours * (0.36 + 0.66 * lit + 0.10 * np.abs(facing))[:, None])


def label(pixels: NDArray[np.uint8], text: str) -> Any:
    """A Pillow image of a frame with a text in its lower right corner."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(pixels)
    font = ImageFont.load_default(0.045 * image.height)
    spot = (0.97 * image.width, 0.96 * image.height)
    ImageDraw.Draw(image).text(spot, text, fill=INK, font=font, anchor="rs")
    return image


def sheet(pictures: list[Any], title: str) -> Any:
    """Pillow images side by side under a title, in about as many columns as rows."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = pictures[0].size
    columns = min(len(pictures), int(np.ceil(np.sqrt(len(pictures)))))
    rows = -(-len(pictures) // columns)
    gap = 6
    head = int(0.1 * height)
    page = Image.new("RGB", (columns * (width + gap) + gap, head + rows * (height + gap)), "white")
    font = ImageFont.load_default(0.055 * height)
    ImageDraw.Draw(page).text((2 * gap, 0.5 * head), title, fill=INK, font=font, anchor="lm")
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        page.paste(picture, (gap + column * (width + gap), head + row * (height + gap)))
    return page
