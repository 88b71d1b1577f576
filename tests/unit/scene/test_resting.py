"""Which hulls have a face to rest on."""

import itertools

import numpy as np
import pytest
import trimesh

from verlet_numba.scene.hulls import hull_faces, part, surface_of
from verlet_numba.scene.resting import evened, rests_on_a_face

GOLDEN = (1 + 5**0.5) / 2
SIGNS = list(itertools.product((-1, 1), repeat=3))


def cyclic(*corner):
    """The even permutations of a corner, with all signs."""
    return np.unique([np.roll(np.multiply(corner, sign), k) for k in range(3) for sign in SIGNS], axis=0)


def prism(sides, height):
    turn = 2 * np.pi * np.arange(sides) / sides
    return np.array([[np.cos(a), np.sin(a), z] for a in turn for z in (0, height)])


CUBE = np.array(SIGNS, float)
FLAT = {
    "cube": CUBE,
    "beam": CUBE * [1, 1, 30],
    "plate": CUBE * [1, 1, 1e-4],
    "tetrahedron": CUBE[[0, 3, 5, 6]],
    "octahedron": cyclic(1, 0, 0),
    "dodecahedron": np.concatenate([CUBE, cyclic(0, 1 / GOLDEN, GOLDEN)]),
    "prism": prism(3, 1),
    "rod": prism(64, 50),
    "disc": prism(500, 0.01),
    "cone": np.concatenate([prism(100, 0)[::2], [[0.3, 0, 5]]]),
    "tessellated cube": np.array(trimesh.creation.box().subdivide().subdivide().vertices),
}
ROUND = {
    "icosahedron": cyclic(0, 1, GOLDEN),
    "long icosahedron": cyclic(0, 1, GOLDEN) * [1, 2, 20],
    "ball": np.array(trimesh.creation.icosphere(3).vertices),
    "lens": np.array(trimesh.creation.icosphere(3).vertices) * [1, 1, 1e-3],
}


def hull_in_some_pose(corners, seed, noise=0.0):
    rng = np.random.default_rng(seed)
    points = 10.0**rng.integers(-6, 7) * (corners @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3))
    points = points + noise * np.ptp(points) * rng.uniform(-1, 1, points.shape)
    return surface_of(points, part(points, np.arange(len(points))))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", FLAT)
def test_solids_with_large_faces_rest_on_them(name, seed):
    assert rests_on_a_face(*hull_in_some_pose(FLAT[name], seed))


def test_paper_rests_on_its_faces():
    paper = CUBE * [1, 1, 1e-9]
    assert rests_on_a_face(paper, hull_faces(paper))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ROUND)
def test_solids_with_small_faces_do_not(name, seed):
    assert not rests_on_a_face(*hull_in_some_pose(ROUND[name], seed))


def test_points_have_no_face():
    assert not rests_on_a_face(np.zeros((1, 3)), np.zeros((0, 3), np.int64))


@pytest.mark.parametrize("name", ["octahedron", "dodecahedron", "disc", "tessellated cube"])
def test_triangles_nearly_in_a_plane_are_one_face(name):
    assert rests_on_a_face(*hull_in_some_pose(FLAT[name], 1, noise=1e-7))


@pytest.mark.parametrize("seed", range(5))
def test_evened_hulls_have_the_moments_of_a_ball(seed):
    """Against points drawn from within the hull."""
    points = np.random.default_rng(seed).normal(size=(12, 3)) * [1, 2, 5] + [7, 8, 9]
    corners, triangles = surface_of(points, part(points, np.arange(12)))
    even = evened(corners, triangles)
    to_even = np.linalg.lstsq(np.c_[corners, np.ones(len(corners))], even, rcond=None)[0]
    np.testing.assert_allclose(np.c_[corners, np.ones(len(corners))] @ to_even, even, atol=1e-9)
    solid = trimesh.Trimesh(even, triangles, process=False)
    if solid.volume < 0:
        solid.invert()
    np.testing.assert_allclose(solid.center_mass, 0, atol=1e-9)
    inertia = solid.moment_inertia / solid.volume       # that of a ball: of second moments a, 2 a about each axis
    np.testing.assert_allclose(inertia, 2 * np.eye(3), atol=1e-9)
