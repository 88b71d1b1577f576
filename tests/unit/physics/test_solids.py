"""Distances and normals of solids, against numerical gradients and against the scene's own distances."""

import numpy as np
import pytest

from verlet_numba.physics.solids import box, cylinder, plane, sphere
from verlet_numba.scene.clearance import clearance
from verlet_numba.scene.schema_colliders import BoxCollider, CylinderCollider, PlaneCollider, SphereCollider

NORMAL = np.array([2.0, -1.0, 2.0]) / 3
SOLIDS = {
    "plane": (plane, (*NORMAL, 0.3), PlaneCollider(kind="plane", point=tuple(0.3 * NORMAL), normal=tuple(NORMAL))),
    "sphere": (sphere, (0.8,), SphereCollider(kind="sphere", radius=0.8)),
    "box": (box, (0.5, 0.9, 0.7), BoxCollider(kind="box", size=(1.0, 1.8, 1.4))),
    "cylinder": (cylinder, (0.6, 0.9), CylinderCollider(kind="cylinder", radius=0.6, length=1.8))}
POINTS = np.random.default_rng(0).uniform(-1.8, 1.8, (400, 3))


@pytest.fixture(params=SOLIDS)
def solid(request):
    formula, extent, collider = SOLIDS[request.param]
    return lambda p: formula(*p, *extent), collider


def test_distance_is_that_of_the_scene(solid):
    surface, collider = solid
    found = np.array([surface(p)[0] for p in POINTS])
    np.testing.assert_allclose(found, clearance(collider, POINTS), atol=1e-13)
    assert (found < 0).sum() > 10
    assert (found > 0).sum() > 10


def test_normal_is_the_gradient_of_the_distance(solid):
    surface, _ = solid
    step, agree = 1e-6, 0
    for p in POINTS:
        normal = np.array(surface(p)[1:])
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
        gradient = [(surface(p + d)[0] - surface(p - d)[0]) / (2 * step) for d in step * np.eye(3)]
        agree += np.allclose(gradient, normal, atol=1e-5)
    assert agree >= len(POINTS) - 2         # the gradient jumps where the nearest point is not unique


def test_foot_of_the_normal_lies_on_the_surface(solid):
    surface, _ = solid
    for p in POINTS:
        gap, *normal = surface(p)
        assert surface(p - gap * np.array(normal))[0] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("p", [(0, 0, 0), (0.5, 0, 0), (0.5, 0.9, 0.7), (0, 0, 0.7), (0, 0, 2), (-0.0, 0, 0.9), (0.6, 0, 0.9)])
def test_normals_are_unit_vectors_in_special_places(solid, p):
    gap, *normal = solid[0](np.array(p, float))
    assert np.isfinite(gap)
    assert np.linalg.norm(normal) == pytest.approx(1)


def test_centre_of_a_sphere_is_a_radius_deep():
    assert sphere(0.0, 0.0, 0.0, 2.0) == (-2, 0, 0, 1)
