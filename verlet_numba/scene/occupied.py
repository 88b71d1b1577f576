"""What stands in a scene, as scattered copies see it: colliders and the bodies placed before them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body, Floats, Shape
from verlet_numba.scene.clearance import Surface, clear_of_spheres, clearance, hull_clearance
from verlet_numba.scene.hulls import hulls_in_place
from verlet_numba.scene.problems import Problem
from verlet_numba.scene.scatter import Free
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_bodies import Body as Entry
from verlet_numba.scene.schema_colliders import MeshCollider
from verlet_numba.scene.schema_common import Rotation
from verlet_numba.scene.shapes import ShapeError
from verlet_numba.scene.source import Source


def rotation_matrix(rotation: Rotation | None) -> Floats:
    """The matrix (3, 3) of a turn about an axis (Rodrigues)."""
    if rotation is None:
        return np.eye(3)
    x, y, z = np.asarray(rotation.axis) / np.linalg.norm(rotation.axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.deg2rad(rotation.degrees)
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def centre_of_mass(shape: Shape) -> Floats:
    """(3,) m, about the body's own origin."""
    return np.asarray(shape.masses @ shape.positions / shape.masses.sum())


def bounding_radius(shape: Shape) -> float:
    """Radius (m) of a sphere about the centre of mass that holds all particles, contact radius included."""
    return float(np.linalg.norm(shape.positions - centre_of_mass(shape), axis=1).max()) + shape.radius


def load_surfaces(scene: Scene, folder: Path, source: Source) -> tuple[dict[int, Surface], list[Problem]]:
    """The surfaces of mesh colliders, turned, by the collider's number; and what cannot be read."""
    surfaces: dict[int, Surface] = {}
    problems: list[Problem] = []
    for index, collider in enumerate(scene.colliders):
        if collider.kind == "mesh":
            try:
                surfaces[index] = surface_of(collider, folder)
            except ShapeError as error:
                problems.append(source.problem(("colliders", index, error.key), str(error)))
    return surfaces, problems


def surface_of(collider: MeshCollider, folder: Path) -> Surface:
    """The surface of a mesh collider, turned, about its origin. Raises ShapeError for a file that will not do."""
    from verlet_numba.scene.mesh import surface

    vertices, triangles = surface(folder / collider.file)
    return vertices * collider.scale @ rotation_matrix(collider.rotation).T, triangles


class Occupied:
    """What scattered copies must keep clear of: colliders and the bodies placed so far.

    A rigid body at a given place is its convex parts, a scattered one its bounding sphere. Everything else is spheres
    about its particles that together cover its sticks and triangles: a point of a triangle is at most
    side / sqrt(3) away from the nearest corner, side its longest one.
    """

    def __init__(self, scene: Scene, surfaces: dict[int, Surface], placed: dict[int, Body]) -> None:
        self.scene, self.surfaces = scene, surfaces
        self.hulls = [hull for body in placed.values() for hull in hulls_in_place(body)]
        self.centres, self.radii = np.zeros((0, 3)), np.zeros(0)
        for index, body in placed.items():
            if not body.shape.rigid:
                self.add(scene.bodies[index], body)

    def add(self, entry: Entry, body: Body) -> None:
        """Keep clear of a body by spheres: one a copy if it was scattered, else one a particle."""
        shape = body.shape
        if entry.scatter:
            centres = np.einsum("p,kpi->ki", shape.masses / shape.masses.sum(), body.positions)
            radius = bounding_radius(shape)
        else:
            centres = body.positions.reshape(-1, 3)
            longest = float(shapes.stick_lengths(centres, shape.sticks).max(initial=0))
            radius = shape.radius + longest / 3**0.5
        self.centres = np.concatenate([self.centres, centres])
        self.radii = np.concatenate([self.radii, np.full(len(centres), radius)])

    def free(self, radius: float) -> Free:
        """The test whether spheres of this radius are clear of everything."""
        def test(points: Floats) -> NDArray[np.bool_]:
            clear = np.ones(len(points), np.bool_)
            for index, collider in enumerate(self.scene.colliders):
                clear[clear] = clearance(collider, points[clear], self.surfaces.get(index)) >= radius
            for corners, triangles in self.hulls:
                clear[clear] = hull_clearance(corners, triangles, points[clear]) >= radius
            clear[clear] = clear_of_spheres(points[clear], radius, self.centres, self.radii)
            return clear
        return test
