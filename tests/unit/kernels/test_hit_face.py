"""Hit faces: depth and normal of hulls that meet, in the positions that go wrong first."""

import numpy as np
import pytest
from hull_pairs import box, difference_depth, hulls_of, meet, meetings_for, pairs_of, rotated
from scipy.spatial import ConvexHull

from verlet_numba.kernels.narrow import collide
from verlet_numba.scene.capacity import narrow_of as scratch

SCALES = [1e-6, 1.0, 1e6]


@pytest.mark.parametrize("scale", SCALES)
def test_the_face_is_the_nearest_of_the_whole_difference(scale):
    rng = np.random.default_rng(0)
    unique = 0
    for _ in range(60):
        first, second = (scale * rng.normal(size=(rng.integers(4, 20), 3)) for _ in range(2))
        planes = ConvexHull((first[:, None] - second[None]).reshape(-1, 3)).equations
        planes = planes[np.argsort(-planes[:, 3])]
        normal, gap, p, q, carriers = meet(first, second, margin=0.0)
        assert -gap == pytest.approx(-planes[0, 3], rel=1e-9)
        np.testing.assert_allclose(p - q, gap * normal, atol=1e-12 * scale)
        assert sum(carriers) <= 4
        others = planes[planes[:, :3] @ planes[0, :3] < 1 - 1e-9]
        if others[:, 3].max() < planes[0, 3] * (1 + 1e-6):
            unique += 1
            np.testing.assert_allclose(-normal, planes[0, :3], atol=1e-9)
    assert unique > 50


@pytest.mark.parametrize("shape", ["box", "flat", "rod", "point", "heap"])
@pytest.mark.parametrize("scale", SCALES)
def test_identical_bodies_in_one_pose(shape, scale):
    """B6: finite and deterministic, and as deep as they are thick."""
    points = {"box": box(1, 2, 3), "flat": box(1, 2, 0), "rod": box(1, 0, 0), "point": np.zeros((1, 3)),
              "heap": np.random.default_rng(0).normal(size=(30, 3))}[shape]
    points = scale * rotated(points + np.array([0.3, 0.2, 0.1]), [1, 2, 3], 0.7)
    normal, gap, p, q, _ = meet(points, points)
    assert np.isfinite([*normal, gap, *p, *q]).all()
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
    depth = {"box": 1.0, "heap": None}.get(shape, 0.0)
    depth = difference_depth(points / scale, points / scale) if depth is None else depth
    assert gap == pytest.approx(-depth * scale, rel=1e-9, abs=1e-12 * scale)
    again = meet(points, points)
    np.testing.assert_array_equal([*normal, gap], [*again[0], again[1]])


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_exact_touch_has_the_normal_of_the_face(scale, away):
    """B15: boxes that touch face to face, to rounding on either side of it."""
    for turn in (0.0, 0.4):
        for slip in (0.0, 0.3):
            for error in (0.0, 1e-16, -1e-16, 3e-15, -3e-15):
                second = rotated(box(1, 1, 1), [1, 1, 0], turn) + away
                first = rotated(box(1, 1, 1) + np.array([slip, 0.2 * slip, 1 + error]), [1, 1, 0], turn) + away
                normal, gap, _, _, carriers = meet(scale * first, scale * second)
                np.testing.assert_allclose(normal, rotated(np.array([[0, 0, 1.0]]), [1, 1, 0], turn)[0], atol=1e-12 * (1 + away))
                assert abs(gap) <= 1e-14 * scale * (1 + away)
                assert sum(carriers) <= 4


def test_a_pancake_that_is_grazed_gives_the_flat_face():
    """B16: 1 : 1000, met near its rim by a corner that is just below its surface: out is up, not out over the rim."""
    pancake = np.array([(np.cos(a), np.sin(a), z) for a in np.linspace(0, 2 * np.pi, 24, endpoint=False) for z in (-5e-4, 5e-4)])
    tip = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.3], [-0.1, 0.1, 0.3], [-0.1, -0.1, 0.3]])
    for far in (0.0, 0.5, 0.9, 0.98):
        for depth in (1e-5, 1e-4, 4e-4):
            normal, gap, p, _, carriers = meet(tip + np.array([far, 0.0, 5e-4 - depth]), pancake)
            np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-9)
            assert gap == pytest.approx(-depth, rel=1e-9)
            np.testing.assert_allclose(p, [far, 0, 5e-4 - depth], atol=1e-12)
            assert carriers[0] == 1


@pytest.mark.parametrize("gap", [1e-3, 1e-6])
def test_edges_that_turn_through_the_parallel_keep_their_normal(gap):
    """B14: nearly parallel edges that cross above each other: up, to the root of what rounding is of the gap."""
    roof = rotated(box(1, 1, 1), [1, 0, 0], np.pi / 4)
    angles = [0.0, *np.geomspace(1e-14, 1e-3, 23)]
    for sign in (1, -1):
        for angle in angles:
            first = rotated(roof, [0, 0, 1], sign * angle) + np.array([0.1, 0.0, np.sqrt(2) + gap])
            normal, found, _, _, carriers = meet(first, roof)
            assert found == pytest.approx(gap, abs=1e-9)
            assert sum(carriers) <= 4
            np.testing.assert_allclose(normal, [0, 0, 1], atol=(1e-15 / gap) ** 0.5)


def test_flat_bodies_that_cross_and_rods_in_one_line():
    plate = box(1, 1, 0)
    normal, gap, _, _, _ = meet(plate, rotated(plate, [0, 0, 1], 0.5) + np.array([0.3, 0.2, 0.0]))
    np.testing.assert_allclose(np.abs(normal), [0, 0, 1], atol=1e-12)
    assert gap == pytest.approx(0, abs=1e-14)
    normal, gap, p, q, _ = meet(box(1, 0, 0), box(1, 0, 0) + np.array([0.5, 0.0, 0.0]))
    assert normal[0] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(p, q, atol=1e-12)
    normal, gap, _, _, carriers = meet(box(1, 0, 0) + np.array([0.1, 0.1, 0]), box(0, 1, 0))
    np.testing.assert_allclose(np.abs(normal), [0, 0, 1], atol=1e-12)
    assert carriers == (2, 2)


def test_a_polytope_that_is_full_gives_its_best_face():
    rng = np.random.default_rng(5)
    first, second = rng.normal(size=(400, 3)), rng.normal(size=(400, 3)) + 0.1
    first, second = (p / np.linalg.norm(p, axis=1)[:, None] for p in (first, second))
    hulls, depth = hulls_of([first, second]), difference_depth(first[::4], second[::4])
    full = scratch(hulls)
    small = full._replace(vertex=full.vertex[:, :12].copy(), label=full.label[:, :12].copy())
    gaps = []
    for narrow in (small, full):
        meetings = meetings_for(1)
        assert collide(hulls, pairs_of([0], [1]), meetings, narrow, 0.0, None)
        gaps.append(meetings.gap[0])
    assert gaps[1] <= -depth
    assert gaps[1] < gaps[0] < 0            # from inside: not deep enough, but a face
