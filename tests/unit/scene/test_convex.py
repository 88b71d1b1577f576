"""Hulls of a scene as buffers: against the bodies and colliders that they belong to."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import worlds
from scipy.spatial import ConvexHull

from verlet_numba.buffers.hulls import Hulls
from verlet_numba.scene.body import Body, Shape
from verlet_numba.scene.colliders import solids_of
from verlet_numba.scene.convex import CYLINDER_SIDES, LANES, hulls_of_scene, rests_on_faces
from verlet_numba.scene.hulls import CLIMB, hulls_of, part
from verlet_numba.scene.load import loads
from verlet_numba.scene.numbering import number
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.shapes import box, icosahedron

L = Shape("mesh", ("points",), np.array([(x, y, z) for z in (0, 1) for x, y in [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2),
                                                                             (0, 1)]], float),
          np.ones(14), np.zeros((0, 2), np.int64), np.zeros(0), rigid=True,
          parts=(np.array([0, 1, 2, 6, 7, 8, 9, 13]), np.array([3, 4, 5, 6, 10, 11, 12, 13])))
"""Two boxes, over and beside a notch."""

COLLIDERS = """
version: 1
time: {duration: 1}
colliders:
  - {kind: room, size: [9, 9, 9]}
  - {kind: sphere, radius: 0.3, position: [1, 2, 3]}
  - {kind: cylinder, radius: 0.5, length: 2, axis: [1, 2, 2], position: [3, 2, 1]}
  - {kind: box, size: [1, 2, 3], position: [-1, 0, 0]}
"""


def ball(subdivisions):
    solid = trimesh.creation.icosphere(subdivisions)
    positions = np.array(solid.vertices)
    return Shape("mesh", ("points",), positions, np.ones(len(positions)), np.zeros((0, 2), np.int64), np.zeros(0), rigid=True,
                 triangles=np.array(solid.faces))


def body(shape, copies=1, seed=0):
    """Copies of a shape, each in a pose of its own."""
    rng = np.random.default_rng(seed)
    turns = np.linalg.qr(rng.normal(size=(copies, 3, 3)))[0]
    turns *= np.linalg.det(turns)[:, None, None]
    positions = np.einsum("kij,pj->kpi", turns, shape.positions) + rng.uniform(-9, 9, (copies, 1, 3))
    return Body("body", shape, positions, np.zeros_like(positions), np.zeros(len(shape.positions), bool), (0, 0), 0)


def scene(*bodies, colliders=COLLIDERS):
    loaded: Scene = loads(colliders, "scene.yaml").scene
    return hulls_of_scene(list(bodies), number(list(bodies)), solids_of(loaded, Path())[0])


def columns(hulls, h):
    return np.arange(hulls.start[h], hulls.start[h] + hulls.size[h])


def test_every_copy_has_a_hull_for_each_of_its_parts():
    bodies = [body(icosahedron(0.5, mass=1), 3, 1), body(L, 4, 2), body(box([1, 2, 3], mass=1), 1, 3), body(ball(2), 2, 4)]
    numbering = number(bodies)
    hulls = hulls_of_scene(bodies, numbering, [])
    np.testing.assert_array_equal(hulls.body, [0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 8, 9])
    expected = [(index[k], one.positions[k], hull) for one, index in zip(bodies, numbering.bodies, strict=True)
                for k in range(one.copies) for hull in hulls_of(one.shape)]
    for h, (particle, positions, hull) in enumerate(expected):
        own = columns(hulls, h)
        np.testing.assert_array_equal(hulls.particle[own], particle[hull.corners])
        np.testing.assert_array_equal(hulls.corner[:, own], positions[hull.corners].T)
        np.testing.assert_allclose(hulls.centre[:, h], positions[hull.corners].mean(axis=0), rtol=1e-12)
        assert hulls.reach[h] == pytest.approx(np.linalg.norm(hulls.corner[:, own] - hulls.centre[:, [h]], axis=0).max())
    assert (hulls.solid == -1).all()
    assert (hulls.rounding == 0).all()
    np.testing.assert_array_equal(hulls.flat, [0] * 3 + [1] * 9 + [0] * 2)


def test_corners_are_padded_to_whole_vectors_by_the_first():
    hulls = scene(body(icosahedron(1, mass=1)), body(ball(1), 2), body(L))
    assert (hulls.start % LANES == 0).all()
    for h, (begin, end) in enumerate(zip(hulls.start[:-1], hulls.start[1:], strict=True)):
        assert 0 <= end - begin - hulls.size[h] < LANES
        for array in (hulls.particle, hulls.corner, hulls.local):
            padding = array[..., begin + hulls.size[h]:end]
            np.testing.assert_array_equal(padding, np.broadcast_to(array[..., begin:begin + 1], padding.shape))


def test_colliders_have_the_hulls_of_their_solids():
    hulls = scene(body(icosahedron(1, mass=1)))
    np.testing.assert_array_equal(hulls.solid, [-1, 6, 7, 8])            # the room's six walls have none
    np.testing.assert_array_equal(hulls.body, [0, -1, -1, -1])
    np.testing.assert_array_equal(hulls.size, [12, 1, 2 * CYLINDER_SIDES, 8])
    np.testing.assert_array_equal(hulls.flat, [0, 0, 1, 1])
    np.testing.assert_array_equal(hulls.rounding, [0, 0.3, 0, 0])
    np.testing.assert_allclose(hulls.reach[1:], [0.3, np.hypot(0.5, 1), np.linalg.norm([1, 2, 3]) / 2])
    np.testing.assert_allclose(hulls.centre[:, 1:].T, [[1, 2, 3], [3, 2, 1], [-1, 0, 0]], atol=1e-12)
    assert (hulls.particle[hulls.start[1]:] == -1).all()
    cylinder = hulls.corner[:, columns(hulls, 2)]
    np.testing.assert_allclose(np.abs(np.array([1, 2, 2]) / 3 @ (cylinder - [[3], [2], [1]])), 1)
    assert ConvexHull(cylinder.T).volume == pytest.approx(2 * np.pi * 0.25, rel=2e-3)
    np.testing.assert_allclose(hulls.local[2, columns(hulls, 2)], np.repeat([1, -1], CYLINDER_SIDES))


def test_only_bodies_call_for_hulls():
    assert scene() is None


def test_large_hulls_are_climbed_along_their_edges_and_copies_share_them():
    hulls = scene(body(ball(2), 3), body(icosahedron(1, mass=1)), body(ball(3), 2))
    climbed = hulls.size > CLIMB
    np.testing.assert_array_equal(climbed, [True] * 3 + [False] + [True] * 2 + [False, True, False])
    np.testing.assert_array_equal(hulls.graph >= 0, climbed)
    assert len(np.unique(hulls.graph[climbed])) == 3
    assert len(hulls.neighbours) == 162 + 642 + 2 * CYLINDER_SIDES + 1
    assert hulls.neighbours[-1] == len(hulls.neighbour)
    for h in np.flatnonzero(climbed):
        surface = ConvexHull(hulls.corner[:, columns(hulls, h)].T).simplices
        expected = [set() for _ in range(hulls.size[h])]
        for simplex in surface.tolist():
            for corner in simplex:
                expected[corner] |= set(simplex) - {corner}
        for corner in range(hulls.size[h]):
            row = hulls.graph[h] + corner
            found = hulls.neighbour[hulls.neighbours[row]:hulls.neighbours[row + 1]].tolist()
            if h < 7:               # Qhull splits a cylinder's faces one way or another
                assert set(found) == expected[corner]
            assert len(found) >= 3


def climb(hulls, h, direction):
    height, at = direction @ hulls.corner[:, columns(hulls, h)], 0
    while True:
        row = hulls.graph[h] + at
        around = hulls.neighbour[hulls.neighbours[row]:hulls.neighbours[row + 1]]
        best = around[np.argmax(height[around])]
        if height[best] <= height[at]:
            return height[at], height.max()
        at = best


def test_climbing_finds_the_farthest_corner():
    hulls = scene(body(ball(2), 3))
    directions = np.random.default_rng(5).normal(size=(50, 3))
    for h in (0, 2, 4):
        for direction in directions:
            assert np.equal(*climb(hulls, h, direction))


def test_without_large_hulls_there_are_no_neighbours():
    hulls = hulls_of_scene([body(L, 2)], number([body(L, 2)]), [])
    np.testing.assert_array_equal(hulls.graph, [-1] * 4)
    np.testing.assert_array_equal(hulls.neighbours, [0])
    assert len(hulls.neighbour) == 0


FLOOR = COLLIDERS[:COLLIDERS.index("  - {kind: sphere")] + "  - {kind: box, size: [9, 9, 1]}\n"
ROOM = FLOOR[:FLOOR.index("  - {kind: box")]
CRATE, DIE, ANGLE = body(box([1, 1, 1], mass=1)), body(icosahedron(1, mass=1), 5), body(L)


@pytest.mark.parametrize(("bodies", "colliders", "expected"), [
    ([DIE], FLOOR, False), ([DIE, CRATE], ROOM, False), ([CRATE], ROOM, False), ([ANGLE], ROOM, False),
    ([CRATE], FLOOR, True), ([CRATE, ANGLE], ROOM, True), ([DIE, CRATE], FLOOR, True), ([DIE], COLLIDERS, False)])
def test_several_contacts_are_for_flat_hulls_that_can_meet(bodies, colliders, expected):
    assert rests_on_faces(scene(*bodies, colliders=colliders)) == expected


def test_the_buffers_of_a_built_scene_are_these():
    model = worlds.built(worlds.with_changes(worlds.EVERYTHING, effects={"rest": None}))
    hulls = model.world.effects.hulls
    assert isinstance(hulls, Hulls)
    assert all(array.flags.c_contiguous for array in hulls)
    np.testing.assert_array_equal(hulls.flat, [0, 0, 0, 1, 0, 1, 0, 1, 1, 1, 1])      # dice, crate, die, block, colliders
    resting = worlds.built(worlds.EVERYTHING).world.effects.hulls.flat
    np.testing.assert_array_equal(resting, [1, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1])           # what shall rest, on small faces too


def test_a_part_of_particles_within_has_fewer_corners():
    positions = np.concatenate([box([1, 1, 1], mass=1).positions, np.random.default_rng(1).uniform(-0.4, 0.4, (40, 3))])
    shape = Shape("mesh", ("points",), positions, np.ones(48), np.zeros((0, 2), np.int64), np.zeros(0), rigid=True)
    hulls = hulls_of_scene([body(shape)], number([body(shape)]), [])
    np.testing.assert_array_equal(hulls.size, [8])
    np.testing.assert_array_equal(np.sort(hulls.particle), part(positions, np.arange(48)).corners)
