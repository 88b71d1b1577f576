"""Pictures: what is in front hides what is behind, all of the motion is in sight, files are what they claim to be."""

import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from verlet_numba.run.trajectory import BodyTable, Contents, TrajectoryFile
from verlet_numba.study import reader
from verlet_numba.study import render as pictures
from verlet_numba.study.camera import NOTHING, Camera, frame_points, rotation_about, visible
from verlet_numba.study.render import BACKGROUND, RenderError, render
from verlet_numba.study.surfaces import PALETTE, ball, ground, placed, room, solid

COLLIDERS = [
    {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]},
    {"kind": "sphere", "radius": 0.1, "position": [0.6, 0, 0.1]},
    {"kind": "cylinder", "radius": 0.1, "axis": [0, 1, 0], "length": 0.4, "position": [-0.6, 0, 0.1],
     "spin": {"axis": [0, 0, 1], "rate": 1.0}, "path": [[0, 0, 0, 0], [1, 0.2, 0, 0]]},
    {"kind": "box", "size": [0.2, 0.2, 0.2], "position": [0, 0.6, 0.1]}]


def write(path, colliders=COLLIDERS, frames=12, **provenance):
    """A square that falls to the ground, a rope of three particles and two loose ones beside it."""
    start = np.array([[-0.3, -0.3, 1], [0.3, -0.3, 1], [0.3, 0.3, 1], [-0.3, 0.3, 1], [-0.5, 0, 1], [-0.5, 0, 0.7],
                      [-0.5, 0, 0.4], [0.5, 0.5, 0.5], [0.5, 0.5, 0.8]])
    time = np.arange(frames) / 12
    position = start - np.array([0, 0, 0.35]) * time[:, None, None]
    bodies = BodyTable(["sheet", "line", "dust"], ["cloth", "rope", "particles"], [0, 4, 7], [4, 3, 2], [0, 2, 2],
                       [2, 0, 0], [1, 1, 1])
    scene = {"name": "still_life", "bodies": [{"name": "line", "thickness": 0.05}, {"name": "sheet"}, {"name": "dust"}],
             "colliders": colliders}
    contents = Contents(9, np.zeros((0, 2), int), np.zeros(0), [np.array([4, 5, 6])], np.array([[0, 1, 2], [0, 2, 3]]),
                        bodies, {}, {"scene_text": "", "scene": json.dumps(scene), **provenance})
    with TrajectoryFile(path, contents, frames) as file:
        file.append(time, np.arange(frames), {"position": position}, {})
        file.finish("complete", "", {})
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("render") / "still_life.vtkhdf")


def share(pixels, colour):
    """Part of the pixels that have the hue of a colour, whatever their brightness."""
    pixels = pixels.reshape(-1, 3).astype(float)
    hue = pixels / np.linalg.norm(pixels, axis=1, keepdims=True)
    return np.mean(np.linalg.norm(hue - colour / np.linalg.norm(colour), axis=1) < 0.06)


def test_a_sheet_shows_the_frames_asked_for_and_every_body(path, tmp_path):
    assert render(path, tmp_path / "a.png", [0, 5, -1], width=200, height=150) == [0, 5, 11]
    with Image.open(tmp_path / "a.png") as image:
        assert image.format == "PNG"
        assert image.size == (2 * 206 + 6, 15 + 2 * 156)
        pixels = np.asarray(image)
    for colour, least in zip(PALETTE[:3], (0.01, 0.002, 0.0002), strict=True):
        assert share(pixels, colour) > least


def test_six_frames_are_chosen_evenly(path, tmp_path):
    assert render(path, tmp_path / "a.png", width=80, height=60) == [0, 2, 4, 7, 9, 11]


def test_a_gif_moves_at_its_own_pace(path, tmp_path):
    assert render(path, tmp_path / "a.gif", width=80, height=60) == list(range(12))
    with Image.open(tmp_path / "a.gif") as image:
        assert (image.format, image.n_frames, image.size) == ("GIF", 12, (80, 60))
        assert image.info["duration"] == 80
        first = np.asarray(image.convert("RGB"))
        image.seek(11)
        assert (first != np.asarray(image.convert("RGB"))).any()


def test_equal_input_gives_equal_pictures(path, tmp_path):
    for name in ("a.png", "b.png"):
        render(path, tmp_path / name, [3], width=80, height=60)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(("output", "frames", "message"), [
    ("a.avi", None, "cannot write .avi; use .png, .gif, .mp4"), ("a", None, "without suffix; use .png, .gif, .mp4"),
    ("a.png", [12], "there is no frame 12: it has 12"), ("a.png", [-13], "there is no frame -13")])
def test_what_cannot_be_drawn_is_refused_in_one_line(path, tmp_path, output, frames, message):
    with pytest.raises(RenderError, match=message):
        render(path, tmp_path / output, frames)
    assert not (tmp_path / output).exists()


def test_a_damaged_scene_is_refused_in_one_line(tmp_path):
    with pytest.raises(reader.TrajectoryError, match="damaged"):
        render(write(tmp_path / "a.vtkhdf", [{"kind": "box", "size": "huge"}]), tmp_path / "a.png")


def test_a_room_is_open_towards_the_camera(tmp_path):
    collider = {"kind": "room", "size": [2.0, 2.0, 2.0], "position": [0, 0, 1]}
    walls = [part for part in room(collider, 0.0, np.array([5.0, -7.0, 4.0]), 1.0) if part.normal is not None]
    assert sorted(tuple(np.rint(wall.normal).astype(int)) for wall in walls) == [(0, -1, 0), (0, 0, 1), (1, 0, 0)]
    render(write(tmp_path / "a.vtkhdf", [collider]), tmp_path / "a.png", [0], width=80, height=60)
    with Image.open(tmp_path / "a.png") as image:
        assert share(np.asarray(image), PALETTE[0]) > 0.003     # nothing hides the cloth


def test_the_pictures_code_is_light():
    heavy = {"numba", "matplotlib", "trimesh", "scipy", "PIL"}
    code = f"import sys, verlet_numba.study.render; print(*{heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"


@given(arrays(np.float64, (12, 3), elements=st.floats(-10, 10)), st.floats(-180, 180), st.floats(-80, 80))
def test_the_camera_has_every_point_in_sight(points, azimuth, elevation):
    camera = frame_points(points, 160, 120, azimuth, elevation)
    pixels, depth = camera.project(points)
    assert (depth > 0).all()
    assert (np.abs(pixels / [160, 120] - 0.5) <= 0.45).all()


def test_the_camera_keeps_z_up():
    camera = frame_points(np.eye(3), 160, 120)
    pixels, _ = camera.project(np.array([[0.0, 0, 0], [0, 0, 1]]))
    assert pixels[1, 1] < pixels[0, 1]
    assert camera.axes[0, 2] == 0
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(camera.axes) == pytest.approx(-1)      # right, up, away: left-handed


def looking_down():
    return Camera(np.array([0.0, 0, 10]), np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]]), 100.0, 60, 40)


def test_each_pixel_shows_the_nearest_triangle():
    """Against a ray through each pixel's centre, intersected with every triangle."""
    camera, chance, hits = looking_down(), np.random.default_rng(4), 0
    for _ in range(40):
        triangles = chance.uniform(-3, 3, (6, 3, 3))
        seen = visible(camera, triangles)
        for row, column in chance.integers(0, (40, 60), (20, 2)):
            ray = np.array([(column + 0.5 - 30) / 100, -(row + 0.5 - 20) / 100, -1.0])
            distances = []
            for a, b, c in triangles:
                u, v, t = np.linalg.solve(np.stack([b - a, c - a, -ray], axis=1), camera.eye - a)
                distances.append(t if u > 0 and v > 0 and u + v < 1 else np.inf)
            expected = NOTHING if np.isinf(distances).all() else np.argmin(distances)
            assert seen[row, column] == expected
            hits += expected != NOTHING
    assert hits > 100


def test_a_shadow_falls_away_from_the_light():
    camera = looking_down()._replace(focal=40.0)
    tiles = ground({"kind": "plane"}, 0.0, camera.eye, np.zeros(3), 10.0, BACKGROUND)[0]
    square = np.array([[[-1, -1, 2], [1, -1, 2], [1, 1, 2]], [[-1, -1, 2], [1, 1, 2], [-1, 1, 2.0]]])
    light = np.array([-0.6, 0.0, 0.8])
    dark = pictures.shadow(camera, square, tiles, light) > 0.5
    _, column = np.nonzero(dark)
    assert column.mean() == pytest.approx(30 + 40 * 1.5 / 10, abs=0.6)     # moved by 2 * 0.6 / 0.8 to the right
    assert column.max() - column.min() + 1 == pytest.approx(40 * 2 / 10, abs=1)


def test_colliders_move_as_the_scene_says():
    spinning = COLLIDERS[2]
    place = placed(spinning, 0.5)
    np.testing.assert_allclose(place.origin, [-0.5, 0, 0.1])
    np.testing.assert_allclose(place.of(np.array([0.0, 1, 0])) - place.origin, [-np.sin(0.5), np.cos(0.5), 0])
    np.testing.assert_allclose(placed(spinning, 9.0).origin, [-0.4, 0, 0.1])
    started = {"kind": "sphere", "path": [[0, 1, 2, 3], [1, 2, 2, 3]]}
    np.testing.assert_allclose(placed(started, 0.5).origin, [1.5, 2, 3])


def test_files_of_meshes_are_those_of_the_scene_wherever_the_trajectory_is(tmp_path):
    """Of the folder that the scene was in when it ran, or, if that is gone, of the trajectory's own."""
    scenes, away, both = (tmp_path / name for name in ("scenes", "away", "both"))
    for folder in (scenes, away, both):
        folder.mkdir()
    corner = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n"
    (scenes / "corner.obj").write_text(corner + "f 1 2 4\n")
    (both / "corner.obj").write_text(corner)
    seen = {}
    for name, folder, scene in (("away", away, scenes), ("lost", away, tmp_path / "lost"), ("moved", both, tmp_path / "lost"),
                                ("both", both, scenes)):
        path = write(folder / f"{name}.vtkhdf", [{"kind": "mesh", "file": "corner.obj"}], folder=str(scene))
        with reader.open(path) as trajectory:
            seen[name] = len(pictures.View(trajectory, 40, 30).solids[0])
    assert seen == {"away": 2, "lost": 0, "moved": 1, "both": 2}


@pytest.mark.parametrize(("collider", "volume"), [
    ({"kind": "box", "size": [1, 2, 3]}, 6), ({"kind": "sphere", "radius": 2.0}, 4 / 3 * np.pi * 8),
    ({"kind": "cylinder", "radius": 0.5, "axis": [1, 1, 0], "length": 2.0}, np.pi / 2)])
def test_solids_are_closed_and_of_the_right_size(collider, volume, tmp_path):
    triangles = solid(collider, [tmp_path])
    cones = (np.cross(triangles[:, 0], triangles[:, 1]) * triangles[:, 2]).sum(axis=1) / 6        # turned outwards, all
    assert (cones > 0).all()
    assert cones.sum() == pytest.approx(volume, rel=0.01)


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_a_ball_is_a_closed_surface_of_unit_radius(levels):
    triangles = ball(levels)
    np.testing.assert_allclose(np.linalg.norm(triangles, axis=2), 1)
    corners, places = np.unique(triangles.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    faces = places.reshape(-1, 3)
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    assert len(corners) - len(edges) + len(faces) == 2


def test_rotation_turns_counter_clockwise():
    np.testing.assert_allclose(rotation_about([0, 0, 2], np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
