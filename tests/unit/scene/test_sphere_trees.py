"""Trees of spheres as they are built: balanced whatever the points, with the smallest spheres and the right exclusions."""

from dataclasses import replace
from math import log2

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.numbering import number
from verlet_numba.scene.sphere_trees import (
    halved,
    halved_grid,
    lattice_of,
    layered_of,
    node_support,
    smallest_spheres,
    wrapped_of,
)

NONE = np.zeros((0, 2), np.int64)


def body(shape, copies=1):
    place = np.repeat(shape.positions[None], copies, axis=0)
    return Body("thing", shape, place, np.zeros_like(place), np.zeros(len(shape.positions), bool), (0.0, 0.0), 0.0)


def sheet(nx, ny, thickness=0.0, diagonals="both", size=(1, 1)):
    return shapes.cloth(size, [nx, ny], diagonals=diagonals, mass=1, thickness=thickness)


def check(tree, count):
    """Preorder with skip links, every leaf once; returns the depth. Not recursive."""
    assert sorted(tree.leaf[tree.leaf >= 0]) == list(range(count))
    assert len(tree.skip) == 2 * count - 1
    todo, deepest, seen = [(0, len(tree.skip), 0)], 0, 0
    while todo:
        k, end, depth = todo.pop()
        seen += 1
        deepest = max(deepest, depth)
        assert tree.skip[k] == end
        assert tree.level[k] == depth
        if tree.leaf[k] < 0:
            middle = tree.skip[k + 1]
            assert k + 1 < middle < end
            todo += [(k + 1, middle, depth + 1), (middle, end, depth + 1)]
        else:
            assert end == k + 1
    assert seen == len(tree.skip)
    return deepest


@pytest.mark.parametrize("count", [1, 2, 3, 5, 17, 1000, 20_000])
@pytest.mark.parametrize("kind", ["equal", "line", "geometric", "random"])
def test_depth_is_that_of_a_balanced_tree(count, kind):
    """B43."""
    along = np.arange(count, dtype=float)
    points = {"equal": np.ones((count, 3)), "line": along[:, None] * [1, 2, 3],
              "geometric": 2.0 ** -np.minimum(along, 900)[:, None] * [1, 0, 0],
              "random": np.random.default_rng(0).normal(size=(count, 3))}[kind]
    depth = check(halved(points), count)
    assert depth <= 2 * log2(count)


@settings(deadline=None)
@given(st.integers(2, 30), st.integers(2, 30), st.floats(0.01, 100))
def test_depth_and_rectangles_of_a_grid(nx, ny, ratio):
    tree = halved_grid(nx, ny, 1.0, ratio)
    depth = check(tree, nx * ny)
    assert depth <= 2 * log2(nx * ny)
    for k in range(len(tree.skip)):
        below = tree.leaf[k:tree.skip[k]]
        i, j = np.divmod(below[below >= 0], ny)
        assert tree.rectangle[k].tolist() == [i.min(), i.max(), j.min(), j.max()]


def test_halves_lie_apart_along_the_longest_extent():
    points = np.random.default_rng(3).uniform(size=(100, 3)) * [1, 5, 2]
    tree = halved(points)
    left, right = (points[[leaf for leaf in part if leaf >= 0]] for part in (tree.leaf[1:tree.skip[1]], tree.leaf[tree.skip[1]:]))
    assert left[:, 1].max() <= right[:, 1].min()
    assert len(left) == len(right)


SOLIDS = {"tetrahedron": (np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(8), 0.61237244),
          "cube": (shapes.box([1, 1, 1], mass=1).positions, 0.86602540),
          "icosahedron": (shapes.icosahedron(np.sin(2 * np.pi / 5), mass=1).positions, 0.95105652)}


def spheres_about(points):
    return smallest_spheres(points, np.arange(len(points)), np.array([0]), np.array([len(points)]))


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_spheres_of_solids_with_edge_one(name, scale):
    """A29."""
    points, expected = SOLIDS[name]
    assert np.partition(np.linalg.norm(points - points[0], axis=1), 1)[1] == pytest.approx(1)
    centre, radius, support = spheres_about(points * scale)
    assert radius[0] / scale == pytest.approx(expected, abs=1e-8)
    assert radius[0] / scale == pytest.approx(np.linalg.norm(points, axis=1).max(), rel=1e-12)
    np.testing.assert_allclose(centre[0], 0, atol=1e-12 * scale)
    assert len(np.unique(support)) <= 4


def test_spheres_of_many_sets_are_smallest():
    """Held against a plain iteration that creeps towards the centre (Badoiu and Clarkson 2003)."""
    rng = np.random.default_rng(5)
    sets = [rng.normal(size=(size, 3)) * rng.uniform(0, 1, 3) ** 4 for size in rng.integers(1, 60, 50)]
    size = np.array([len(each) for each in sets])
    points = np.concatenate(sets)
    centre, radius, support = smallest_spheres(points, np.arange(len(points)), np.cumsum(size) - size, size)
    for b, each in enumerate(sets):
        assert np.linalg.norm(each - centre[b], axis=1).max() <= radius[b] * (1 + 1e-11)
        crept = each.mean(axis=0)
        for step in range(2, 1000):
            crept += (each[np.argmax(np.linalg.norm(each - crept, axis=1))] - crept) / step
        bound = np.linalg.norm(each - crept, axis=1).max()
        assert radius[b] <= bound * (1 + 1e-12)
        assert radius[b] >= bound * (1 - 3e-2)
        held = spheres_about(points[support[b]])
        assert held[1][0] == pytest.approx(radius[b], rel=1e-9)


def test_spheres_of_degenerate_sets():
    for points in (np.ones((7, 3)), np.arange(9.0)[:, None] * [1, 2, -1], np.repeat(SOLIDS["cube"][0], 3, axis=0),
                   np.random.default_rng(0).integers(0, 3, (50, 3)) * [1.0, 1.0, 0.0]):
        centre, radius, _ = spheres_about(points)
        assert np.linalg.norm(points - centre, axis=1).max() == pytest.approx(radius[0], abs=1e-12)
        assert radius[0] <= np.linalg.norm(np.ptp(points, axis=0)) / 2 * (1 + 1e-12)


def test_support_of_every_node_holds_all_points_below():
    shape = shapes.icosahedron(1.0, mass=1)
    tree = halved(shape.positions[shape.triangles].mean(axis=1))
    support = node_support(tree, shape.positions, list(shape.triangles))
    centre, radius, _ = smallest_spheres(shape.positions, support.ravel(), 4 * np.arange(len(support)), np.full(len(support), 4))
    for k in range(len(support)):
        below = tree.leaf[k:tree.skip[k]]
        points = shape.positions[shape.triangles[below[below >= 0]]].reshape(-1, 3)
        assert np.linalg.norm(points - centre[k], axis=1).max() <= radius[k] * (1 + 1e-11)


def test_wrapped_trees_are_those_of_every_copy():
    bodies = [body(shapes.box([1, 2, 3], mass=1), 3), body(sheet(3, 3)), body(shapes.icosahedron(1, mass=1), 2)]
    numbering = number(bodies)
    wrapped = wrapped_of(bodies, numbering)
    assert np.diff(wrapped.root).tolist() == [23] * 3 + [39] * 2
    assert sorted(wrapped.leaf[wrapped.leaf >= 0]) == list(range(3 * 12 + 2 * 20))
    copies = [own for b in (0, 2) for own in numbering.bodies[b]]
    for t, own in enumerate(copies):
        nodes = slice(wrapped.root[t], wrapped.root[t + 1])
        assert set(wrapped.support[nodes].ravel()) <= set(own)
        assert wrapped.skip[wrapped.root[t]] == wrapped.root[t + 1]
    assert wrapped_of(bodies[1:2], number(bodies[1:2])) is None


NONE = np.zeros((0, 2), np.int64)


def never(layered):
    return {(p, int(q)) for p in range(len(layered.radius)) for q in layered.partner[layered.apart[p]:layered.apart[p + 1]]}


@pytest.mark.parametrize("shape", [sheet(5, 4, 0.1), sheet(5, 4, 0.9, "one"), shapes.rope([0, 0, 0], [1, 0, 0], 1, mass=1),
                                   shapes.rope([0, 0, 0], [1, 0, 0], 9, mass=1, thickness=0.5)])
def test_pairs_that_never_meet(shape):
    bodies = [body(shapes.box([1, 1, 1], mass=1)), body(shape, 2)]
    numbering = number(bodies)
    copies = numbering.bodies[1]
    expected = {tuple(copies[k, list(stick)]) for k in range(2) for stick in shape.sticks}
    for i, p in enumerate(shape.positions):
        for j in range(i):
            if np.linalg.norm(p - shape.positions[j]) < 2 * shape.radius:
                expected |= {(copies[k, i], copies[k, j]) for k in range(2)}
    layered = layered_of(bodies, numbering, numbering.size, np.float64, NONE)
    assert never(layered) == expected | {(j, i) for i, j in expected}


def pulled(particle, radius, spot, other):
    """The largest gap that any motion can open between two spheres whose bodies are joined."""
    return np.linalg.norm(particle) + np.linalg.norm(spot) - radius - other


@pytest.mark.parametrize("thick", [0.05, 0.3, 0.9])
def test_what_an_attachment_holds_together_never_meets(thick):
    """A rope's particles and those of a cloth that it is tied to, which no motion parts; likewise the hull of a box."""
    line, cloth = shapes.rope([0, 0, 0], [1, 0, 0], 9, mass=1, thickness=thick), sheet(5, 4, 0.2)
    crate = replace(shapes.box([1, 1, 1], mass=1), radius=0.04)
    bodies = [body(crate, 3), body(line, 2), body(cloth)]
    numbering = number(bodies)
    (crates, lines, cloths), size = numbering.bodies, numbering.size + 3        # arrays may be longer than the numbering
    apart = layered_of(bodies, numbering, size, np.float64, NONE)
    attached = np.array([[crates[1, 6], lines[1, 2]], [lines[0, 9], cloths[0, 7]]])
    expected = {(lines[1, s], size + 1) for s, p in enumerate(line.positions)
                if s == 2 or pulled(p - line.positions[2], line.radius, np.zeros(3), 0.04) < 0}
    for s, p in enumerate(line.positions):
        for t, q in enumerate(cloth.positions):
            gap = pulled(p - line.positions[9], line.radius, q - cloth.positions[7], cloth.radius)
            expected |= {(lines[0, s], cloths[0, t]), (cloths[0, t], lines[0, s])} if gap < 0 else set()
    expected |= {(lines[0, 9], cloths[0, 7]), (cloths[0, 7], lines[0, 9]), (crates[1, 6], lines[1, 2]), (lines[1, 2], crates[1, 6])}
    layered = layered_of(bodies, numbering, size, np.float64, attached)
    assert never(layered) - never(apart) == expected
    assert len(expected) > (30 if thick > 0.5 else 4)


@pytest.mark.parametrize("diagonals", ["one", "both"])
@pytest.mark.parametrize("thickness", [0.0, 0.04, 0.3, 3.0])
@pytest.mark.parametrize("size", [(1, 1), (0.2, 1), (3, 1)])
@pytest.mark.parametrize("resolution", [(2, 2), (2, 7), (8, 6)])
def test_closest_pair_that_may_meet(diagonals, thickness, size, resolution):
    shape = sheet(*resolution, thickness, diagonals, size)
    count = len(shape.positions)
    distance = np.linalg.norm(shape.positions[:, None] - shape.positions, axis=2)
    distance[np.eye(count, dtype=bool)] = np.inf
    distance[shape.sticks[:, 0], shape.sticks[:, 1]] = distance[shape.sticks[:, 1], shape.sticks[:, 0]] = np.inf
    distance[distance < thickness] = np.inf
    dx, dy, closest = lattice_of(shape)
    assert (dx, dy) == pytest.approx((size[0] / (resolution[0] - 1), size[1] / (resolution[1] - 1)))
    assert closest <= distance.min() * (1 + 1e-12)
    if distance.min() < thickness + 2 * max(dx, dy):
        assert closest == pytest.approx(distance.min())
