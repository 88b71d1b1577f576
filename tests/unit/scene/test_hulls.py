"""Convex parts of rigid bodies: corners, neighbours to climb along, and parts of what is not convex."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.scene import shapes
from verlet_numba.scene.clearance import hull_clearance, surface_distance
from verlet_numba.scene.crossing import crossed
from verlet_numba.scene.half_edge import half_edges
from verlet_numba.scene.hulls import CLIMB, SNAP, decompose, hull_faces, hulls_of, is_convex, part, split, volume


def cloud(kind, seed, count):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    if kind == "sphere":
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == "lattice":
        points = rng.integers(-2, 3, (count, 3)).astype(float)
    elif kind == "pancake":
        points[:, 2] *= 1e-6
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return 10.0**rng.integers(-6, 7) * (points @ turn + rng.normal(size=3))


def climb(points, hull, direction):
    """The corner furthest along a direction, found from neighbour to neighbour."""
    height, at = points[hull.corners] @ direction, 0
    while True:
        near = hull.neighbour[hull.start[at]:hull.start[at + 1]]
        best = near[np.argmax(height[near])]
        if height[best] <= height[at]:
            return height[at]
        at = best


@given(kind=st.sampled_from(["ball", "sphere", "lattice", "pancake"]), seed=st.integers(0, 2**32 - 1),
       count=st.integers(20, 200))
def test_hulls_hold_their_points(kind, seed, count):
    points = cloud(kind, seed, count)
    hull = part(points, np.arange(count))
    size = np.ptp(points, axis=0).max()
    assert set(hull.triangles.ravel().tolist()) == set(hull.corners.tolist())
    directions = np.random.default_rng(seed).normal(size=(30, 3))
    heights = points @ directions.T
    np.testing.assert_allclose(heights[hull.corners].max(axis=0), heights.max(axis=0), atol=1e-9 * size)
    assert volume(points, hull.triangles) > 0
    if kind != "pancake":
        assert hull_clearance(points, hull.triangles, points).max() <= 1e-9 * size
    if len(hull.corners) > CLIMB:
        for k, direction in enumerate(directions):
            assert climb(points, hull, direction) == pytest.approx(heights[:, k].max(), abs=1e-9 * size)
    else:
        assert len(hull.neighbour) == 0


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 100))
def test_hulls_of_points_in_no_special_place_are_closed_surfaces(seed, count):
    points = cloud("ball", seed, count)
    surface = half_edges(hull_faces(points))
    assert (surface.twin >= 0).all()
    assert len(surface.vertices) - len(surface.edges) + len(surface.faces) == 2
    assert is_convex(points, surface.faces)


@pytest.mark.parametrize(("shape", "corners"), [
    (shapes.box([1, 2, 3e-6], mass=1), 8),
    (shapes.icosahedron(1e6, mass=1), 12),
])
def test_boxes_and_icosahedra_are_one_part_of_all_their_particles(shape, corners):
    hull, = hulls_of(shape)
    np.testing.assert_array_equal(hull.corners, np.arange(corners))
    assert volume(shape.positions, hull.triangles) == pytest.approx(volume(shape.positions, shape.triangles))
    assert len(hull.neighbour) == 0


def test_particles_within_faces_are_no_corners():
    solid = trimesh.creation.box().subdivide().subdivide()
    hull = part(np.array(solid.vertices), np.arange(len(solid.vertices)))
    assert len(hull.corners) == 8


def test_what_is_not_rigid_has_no_hull():
    assert hulls_of(shapes.cloth([1, 1], [3, 3], mass=1)) == ()


@pytest.mark.parametrize("points", [np.eye(3), np.random.default_rng(1).normal(size=(9, 2)) @ np.ones((2, 3))])
def test_points_in_a_plane_have_no_hull(points):
    with pytest.raises(ValueError, match="in a plane"):
        hull_faces(points)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_convexity_is_relative(scale):
    ball = trimesh.creation.icosphere(2)
    positions = np.array(ball.vertices) * scale
    assert is_convex(positions, ball.faces)
    positions[7] *= 1 - 1e-7
    assert is_convex(positions, ball.faces)
    positions[7] *= 0.7
    assert not is_convex(positions, ball.faces)


def dented_ball(seed):
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(2)
    unit = np.array(ball.vertices)
    waves = sum(np.sin(2 * unit @ rng.normal(size=3) + rng.uniform(0, 6)) for _ in range(3))
    return unit * (1 + 0.1 * waves[:, None]), np.array(ball.faces)


@pytest.mark.parametrize("seed", range(3))
def test_parts_fill_a_dented_ball(seed):
    positions, triangles = dented_ball(seed)
    assert len(crossed(positions, triangles)) == 0
    particles, parts = split(positions, triangles)
    np.testing.assert_array_equal(particles[:len(positions)], positions)
    used = np.unique(np.concatenate([np.arange(len(positions)), *parts]))
    np.testing.assert_array_equal(used, np.arange(len(particles)))

    size = np.ptp(positions, axis=0).max()
    filled = sum(volume(particles, part(particles, numbers).triangles) for numbers in parts)
    assert 0.99 < filled / volume(positions, triangles) < 1.2
    points = np.random.default_rng(seed).uniform(positions.min(axis=0), positions.max(axis=0), (2000, 3))
    depth = surface_distance(positions, triangles, points)
    from_parts = np.min([hull_clearance(particles, part(particles, numbers).triangles, points) for numbers in parts], axis=0)
    assert (from_parts[depth < 0] < 2 * SNAP * size).all()          # the body lies in its parts
    assert (from_parts[depth > 0.1 * size] > 0).all()               # and its surroundings do not


def test_the_same_surface_is_always_cut_alike():
    positions, triangles = dented_ball(1)
    for one, other in zip(*(decompose(positions, triangles) for _ in range(2)), strict=True):
        np.testing.assert_array_equal(one, other)


def test_new_particles_keep_apart():
    torus = trimesh.creation.torus(1, 0.4, major_sections=12, minor_sections=8)
    positions = np.array(torus.vertices)
    particles, parts = split(positions, np.array(torus.faces))
    distance = np.linalg.norm(particles[:, None] - particles[len(positions):], axis=2)
    distance[distance == 0] = np.inf
    assert distance.min() > SNAP * np.ptp(positions, axis=0).max()
    assert len(parts) > 2


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
@pytest.mark.parametrize(("shift", "expected"), [((3, 0, 0), False), ((.3, .4, .5), True), ((1, 0, 0), False)])
def test_crossing_surfaces_are_found_and_touching_ones_are_not(scale, shift, expected):
    two = trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation(shift)])
    found = crossed(np.array(two.vertices) * scale, np.array(two.faces))
    assert (len(found) > 0) == expected
