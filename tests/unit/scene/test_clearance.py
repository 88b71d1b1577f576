"""Signed distances from colliders, against sampled surfaces and each other."""

import numpy as np
import pytest
import trimesh

from verlet_numba.scene import shapes
from verlet_numba.scene.clearance import clear_of_spheres, clearance, hull_clearance, surface_distance
from verlet_numba.scene.schema_colliders import (
    BoxCollider,
    CylinderCollider,
    PlaneCollider,
    RoomCollider,
    SphereCollider,
)

POINTS = np.random.default_rng(0).uniform(-2, 2, (500, 3))


@pytest.mark.parametrize(("collider", "surface"), [
    (BoxCollider(kind="box", size=(1, 2, 1.5), position=(0.2, 0, 0)),
     trimesh.creation.box((1, 2, 1.5)).apply_translation((0.2, 0, 0))),
    (SphereCollider(kind="sphere", radius=1.0, position=(0, 0.3, 0)),
     trimesh.creation.icosphere(3).apply_translation((0, 0.3, 0))),
    (CylinderCollider(kind="cylinder", radius=0.7, length=2.0, axis=(0, 0, 3), position=(0, 0, 0.1)),
     trimesh.creation.cylinder(0.7, 2, sections=400).apply_translation((0, 0, 0.1))),
], ids=["box", "sphere", "cylinder"])
def test_solids_agree_with_their_triangles(collider, surface):
    found = clearance(collider, POINTS)
    np.testing.assert_allclose(found, surface_distance(surface.vertices, surface.faces, POINTS), atol=5e-3)
    assert (found < 0).any()
    assert (found > 0).any()


def test_cylinder_lies_along_its_axis():
    across = CylinderCollider(kind="cylinder", radius=0.5, length=4.0, axis=(0, 2, 0))
    found = clearance(across, np.array([[0, 0, 0.8], [0, 2.5, 0], [0, 1.8, 0], [0.8, 2.4, 0]]))
    np.testing.assert_allclose(found, [0.3, 0.5, -0.2, 0.5])


def test_plane_and_room_are_positive_in_free_space():
    plane = PlaneCollider(kind="plane", point=(0, 0, 1), normal=(0, 0, 5))
    np.testing.assert_allclose(clearance(plane, np.array([[7, 0, 3], [0, 2, 0.5]])), [2, -0.5])
    room = RoomCollider(kind="room", size=(4, 4, 4), position=(0, 0, 2))
    np.testing.assert_allclose(clearance(room, np.array([[0, 0, 0.5], [0, 1.9, 2], [0, 0, -1], [5, 6, 2]])),
                               [0.5, 0.1, -1, -5])


def test_collider_on_a_path_stands_where_the_path_begins_unless_placed():
    path = ((0, 1, 0, 0), (1, 5, 0, 0))
    begins = SphereCollider(kind="sphere", radius=1, path=path)
    placed = SphereCollider(kind="sphere", radius=1, path=path, position=(0, 0, 0))
    assert clearance(begins, np.array([[1.0, 0, 0]])) == [-1]
    assert clearance(placed, np.array([[1.0, 0, 0]])) == [0]


def test_hull_is_exact_within_and_never_too_far_outside():
    box = shapes.box([1, 2, 1.5], mass=1)
    bound = hull_clearance(box.positions, box.triangles, POINTS)
    exact = clearance(BoxCollider(kind="box", size=(1, 2, 1.5)), POINTS)
    np.testing.assert_allclose(bound[exact < 0], exact[exact < 0], atol=1e-12)
    assert (bound <= exact + 1e-12).all()
    np.testing.assert_array_equal(bound > 0, exact > 0)


def test_spheres_that_touch_are_clear():
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [3, 0, 0]])
    found = clear_of_spheres(points, 1, np.array([[0.0, 2, 0], [5, 0, 0]]), np.array([1.0, 1.0]))
    np.testing.assert_array_equal(found, [True, True, True])
    np.testing.assert_array_equal(clear_of_spheres(points, 1.1, np.array([[0.0, 2, 0]]), np.array([1.0])),
                                  [False, False, True])
