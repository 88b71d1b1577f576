"""Rest geometry: numbering, closed and outward surfaces, sticks, masses, slack ropes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.scene import shapes


def euler_characteristic(shape):
    return len(shape.positions) - len(shapes.edges(shape.triangles)) + len(shape.triangles)


def assert_closed_and_outward(shape):
    sides = np.concatenate([shape.triangles[:, [0, 1]], shape.triangles[:, [1, 2]], shape.triangles[:, [2, 0]]])
    assert len(np.unique(sides, axis=0)) == len(sides)
    assert {tuple(side) for side in sides} == {tuple(side[::-1]) for side in sides}
    corners = shape.positions[shape.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("fi,fi->f", normals, corners.mean(axis=1)) > 0).all()


def inertia(shape):
    x, m = shape.positions, shape.masses
    return np.einsum("p,pi,pi->", m, x, x) * np.eye(3) - np.einsum("p,pi,pj->ij", m, x, x)


@pytest.mark.parametrize("shape", [shapes.box([1, 2, 3], mass=8), shapes.icosahedron(2, mass=12)],
                         ids=["box", "icosahedron"])
def test_solids_are_closed_outward_spheres_whose_edges_are_sticks(shape):
    assert euler_characteristic(shape) == 2
    assert_closed_and_outward(shape)
    joined = {tuple(sorted(stick)) for stick in shape.sticks.tolist()}
    assert {tuple(edge) for edge in shapes.edges(shape.triangles).tolist()} < joined
    assert len(joined) == len(shape.sticks)
    np.testing.assert_array_equal(shape.lengths, shapes.stick_lengths(shape.positions, shape.sticks))
    np.testing.assert_allclose(shape.masses, 1)


def test_box_corners_follow_their_number():
    shape = shapes.box([2, 4, 6], mass=1)
    for ix, iy, iz in np.ndindex(2, 2, 2):
        np.testing.assert_array_equal(shape.positions[4 * ix + 2 * iy + iz], [2 * ix - 1, 4 * iy - 2, 6 * iz - 3])
    assert (len(shape.triangles), len(shape.sticks)) == (12, 22)


def test_icosahedron_has_30_edges_and_6_diameters():
    shape = shapes.icosahedron(3, mass=1)
    np.testing.assert_allclose(np.linalg.norm(shape.positions, axis=1), 3, rtol=1e-15)
    np.testing.assert_allclose(np.sort(shape.lengths), [6 * np.sin(2 * np.pi / 5) ** -1 / 2] * 30 + [6] * 6, rtol=1e-14)
    assert len(shape.triangles) == 20


def test_icosahedron_has_the_inertia_of_a_spherical_shell():
    """12 equal particles: 2/3 M R^2 about every axis."""
    mass, radius = 1.7, 0.3
    expected = 2 / 3 * mass * radius**2
    found = inertia(shapes.icosahedron(radius, mass=mass))
    np.testing.assert_allclose(found, expected * np.eye(3), rtol=0, atol=1e-12 * expected)


def test_density_is_per_volume_area_and_length():
    assert shapes.box([1, 2, 3], density=10).masses.sum() == pytest.approx(60)
    assert shapes.cloth([2, 3], [3, 4], density=10).masses.sum() == pytest.approx(60)
    assert shapes.rope([0, 0, 0], [2, 0, 0], 4, length=3, density=10).masses.sum() == pytest.approx(30)
    corners = (solid := shapes.icosahedron(2, density=1)).positions[solid.triangles]
    assert solid.masses.sum() == pytest.approx(np.linalg.det(corners).sum() / 6, rel=1e-14)


@pytest.mark.parametrize(("diagonals", "count"), [("one", 9 + 8 + 6), ("both", 9 + 8 + 12)])
def test_cloth_numbers_triangles_and_families(diagonals, count):
    shape = shapes.cloth([3, 2], [4, 3], diagonals=diagonals, mass=1, thickness=0.02)
    for i, j in np.ndindex(4, 3):
        np.testing.assert_allclose(shape.positions[3 * i + j], [i - 1.5, j - 1, 0], atol=1e-15)
    np.testing.assert_array_equal(shape.triangles[:2], [[0, 3, 4], [0, 4, 1]])
    assert euler_characteristic(shape) == 1
    assert shape.layout == ("grid", 4, 3)
    assert shape.radius == 0.01
    along = shape.positions[shape.sticks[:, 1]] - shape.positions[shape.sticks[:, 0]]
    np.testing.assert_allclose(along[:9], [[1, 0, 0]] * 9, atol=1e-15)
    np.testing.assert_allclose(along[9:17], [[0, 1, 0]] * 8, atol=1e-15)
    np.testing.assert_allclose(along[17:23], [[1, 1, 0]] * 6, atol=1e-15)
    assert len(shape.sticks) == count
    joined = {tuple(sorted(stick)) for stick in shape.sticks.tolist()}
    triangle_edges = {tuple(edge) for edge in shapes.edges(shape.triangles).tolist()}
    assert triangle_edges == joined if diagonals == "one" else triangle_edges < joined


def test_taut_rope_is_straight():
    shape = shapes.rope([0, 0, 1], [2, 0, 1], 4, mass=5)
    np.testing.assert_allclose(shape.positions, [[0, 0, 1], [0.5, 0, 1], [1, 0, 1], [1.5, 0, 1], [2, 0, 1]])
    np.testing.assert_array_equal(shape.lengths, [0.5] * 4)
    np.testing.assert_array_equal(shape.lines[0], range(5))
    np.testing.assert_array_equal(shape.masses, [1] * 5)


coordinate = st.floats(-3, 3).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate, coordinate)


@given(start=point, end=point, slack=st.floats(1e-6, 20), segments=st.integers(2, 60), gravity=point)
def test_slack_rope_is_an_arc_of_equal_sticks_below_the_chord(start, end, slack, segments, gravity):
    start, end, gravity = map(np.array, (start, end, gravity))
    distance = np.linalg.norm(end - start)
    length = (distance or 1) * (1 + slack)
    shape = shapes.rope(start, end, segments, length=length, mass=1, gravity=gravity)
    points = shape.positions
    np.testing.assert_array_equal(points[[0, -1]], [start, end])
    np.testing.assert_allclose(shapes.stick_lengths(points, shape.sticks), length / segments, rtol=1e-9)
    np.testing.assert_allclose(shape.lengths, length / segments)
    # One circle: every particle is as far from its centre, found from the chords' turning angle.
    turn = points[2:] - 2 * points[1:-1] + points[:-2]
    sizes = np.linalg.norm(turn, axis=1)
    np.testing.assert_allclose(sizes, sizes[0], rtol=1e-5, atol=1e-9 * length)
    # One plane, which holds gravity; below the chord.
    down = gravity if gravity.any() else np.array([0, 0, -1.0])
    normal = np.cross(end - start, down)
    if np.linalg.norm(normal) > 1e-6 * np.linalg.norm(down) * max(distance, 1e-9):
        assert np.abs((points - start) @ normal).max() <= 1e-6 * length * np.linalg.norm(normal)
        assert (points.mean(axis=0) - (start + end) / 2) @ down > 0


@pytest.mark.parametrize("gravity", [None, (0, 0, -9.81), (0, 0, 9.81)])
def test_vertical_slack_rope_sags_towards_x(gravity):
    shape = shapes.rope([0, 0, 2], [0, 0, 0], 10, length=3, mass=1, gravity=gravity)
    assert (shape.positions[1:-1, 0] > 0).all()
    np.testing.assert_array_equal(shape.positions[:, 1], 0)


def test_slack_rope_without_gravity_hangs_towards_minus_z():
    middle = shapes.rope([-1, 0, 1], [1, 0, 1], 2, length=2 * np.sqrt(2), mass=1).positions[1]
    np.testing.assert_allclose(middle, [0, 0, 0], atol=1e-12)


def test_loop_of_rope_is_a_regular_polygon_below_its_point():
    shape = shapes.rope([0, 0, 0], [0, 0, 0], 6, length=6, mass=1, gravity=(0, 0, -1))
    np.testing.assert_allclose(np.linalg.norm(shape.positions - [0, 0, -1], axis=1), 1, atol=1e-12)


def test_particles_keep_initial_or_given_lengths_and_angles():
    shape = shapes.particles([[1, 0, 0], [0, 0, 0], [0, 2, 0]], [1, 2, 3], sticks=[(0, 1), (1, 2, 5.0)],
                             angles=[(0, 1, 2), (1, 0, 2, 30.0)], radius=0.1, compliance=1e-3)
    np.testing.assert_array_equal(shape.lengths, [1, 5])
    np.testing.assert_allclose(shape.angle_values, [np.pi / 2, np.pi / 6])
    np.testing.assert_array_equal([line.tolist() for line in shape.lines], [[0, 1], [1, 2]])
    np.testing.assert_array_equal(shape.masses, [1, 2, 3])
    assert (shape.radius, shape.compliance, shape.rigid, shape.layout) == (0.1, 1e-3, False, ("points",))


def test_particles_without_sticks_have_empty_arrays():
    shape = shapes.particles([[0, 0, 0]], [1])
    assert shape.sticks.shape == (0, 2)
    assert shape.angles.shape == (0, 3)
