"""Several contacts a pair of hulls, against clipped polygons in numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold_cases import (
    BOX,
    TIP,
    UP,
    aligned,
    clipped,
    contacts,
    hull_area,
    icosahedron,
    least_height,
    moved,
    narrow,
    on,
    prism,
    scene,
    seen,
    supporting,
    turned,
    widened,
)
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.hulls import POINTS
from verlet_numba.kernels.manifold import FLAT, widen

SHAPES = {"box": BOX, "prism": prism(6), "triangle": prism(3), "icosahedron": icosahedron()}


@pytest.mark.parametrize("upper", SHAPES)
@pytest.mark.parametrize("lower", ["box", "prism", "triangle"])
@pytest.mark.parametrize("seed", range(8))
def test_faces_share_the_polygon_that_clipping_finds(upper, lower, seed):
    rng = np.random.default_rng(seed)
    pose = Rotation.random(random_state=seed)
    n = pose.apply(UP)
    upright = turned(rng.uniform(0, 7), 0.002 * (seed % 2), rng.uniform(0, 7)).apply(SHAPES[upper] * rng.uniform(0.3, 1, (1, 3)))
    aside, gap, b, shared = rng.uniform(-0.5, 0.5, 2), rng.uniform(-0.01, 0.01), pose.apply(SHAPES[lower]), ()
    while not len(shared):
        a = pose.apply(on(moved(upright, *aside), SHAPES[lower], gap))
        shared = clipped(supporting(a, n), supporting(b, n))
        aside = 0.5 * aside             # if they miss each other
    found = widened(a, b, n)
    flat = seen(np.array([pa for pa, _, _ in found]), n)
    if len(shared) <= POINTS:
        exact = least_height(shared) > 1.1 * FLAT       # shapes here have a reach below 1.1
        assert hull_area(flat) == pytest.approx(hull_area(shared), rel=1e-9 if exact else 10 * FLAT)
    else:
        assert len(flat) == POINTS
        assert 0.9 * hull_area(shared) < hull_area(flat) < hull_area(shared)
    np.testing.assert_array_less(0, 1e-9 + np.array([gap for _, _, gap in found]) - min(gap for _, _, gap in found))


@pytest.mark.parametrize(("angle", "number", "area"), [(0, 4, 1.0), (np.pi / 6, 8, 0.8453), (np.pi / 4, 8, 2 * 2**0.5 - 2),
                                                       (1e-12, 4, 1.0), (1e-8, 4, 1.0), (1e-4, 4, 1.0), (np.pi / 2, 4, 1.0)])
def test_stacked_boxes(angle, number, area):
    found = widened(on(turned(angle).apply(BOX), BOX), BOX, UP)
    assert len(found) == number
    assert hull_area(np.array([pa[:2] for pa, _, _ in found])) == pytest.approx(area, abs=1e-4)
    np.testing.assert_allclose([gap for _, _, gap in found], 0, atol=1e-12)


def test_small_box_on_a_large_one_and_below_it():
    small = on(moved(turned(0.3).apply(0.01 * BOX), 3, 2), 100 * BOX)
    for a, b, n in ((small, 100 * BOX, UP), (100 * BOX, small, -UP)):
        found = widened(a, b, n)
        assert len(found) == 4
        assert hull_area(np.array([p[:2] for p, _, _ in found])) == pytest.approx(1e-4, rel=1e-9)


def test_edge_across_a_face():
    leaning = on(turned(0.4).apply(Rotation.from_euler("y", 45, degrees=True).apply(BOX)), BOX, -0.01)
    found = widened(leaning, BOX, UP)
    assert len(found) == 2
    length = min(1, 1 / np.cos(0.4))
    assert np.linalg.norm(found[0][0] - found[1][0]) == pytest.approx(length)
    np.testing.assert_allclose([gap for _, _, gap in found], -0.01)


def test_corner_on_a_face_and_edges_that_cross_keep_their_contact():
    corner = aligned(np.ones(3), -UP).apply(BOX)
    edge = Rotation.from_euler("y", 45, degrees=True).apply(BOX)
    for a, b in ((on(corner, BOX), BOX), (on(turned(1).apply(edge), edge), edge), (on(icosahedron(), corner), corner)):
        before = narrow(a, b, UP)
        case = scene([(a, b, before, UP)])
        kept = [array.copy() for array in case.meetings]
        assert widen(*case)
        for array, same in zip(case.meetings, kept, strict=True):
            np.testing.assert_array_equal(array, same)


def test_parallel_edges_touch_in_two_points_and_in_one_when_turned():
    edge = Rotation.from_euler("x", 45, degrees=True).apply(BOX)
    apart = []
    for angle in (0, 1e-12, 1e-6, 1e-4, 3e-4, 1e-3, 3e-3, 0.1):
        found = widened(on(moved(turned(angle).apply(edge), 0.2), edge), edge, UP)
        apart.append(np.linalg.norm(found[0][0] - found[-1][0]))
    assert apart[:3] == pytest.approx([0.8] * 3, abs=1e-6)
    assert apart[-1] == 0
    assert (np.diff(apart) <= 1e-7).all()
    assert (np.diff(apart) >= -0.5).all()


def test_boxes_tilt_from_four_points_to_two_to_one():
    numbers = []
    for tilt in (0, 1e-9, 1e-3, 0.02, 0.3):
        a = on(turned(0.1, tilt, 0.1).apply(BOX), BOX)
        numbers.append(len(widened(a, BOX, UP)))
    assert numbers == [8, 8, 8, 2, 2]
    assert len(widened(on(turned(0.1, 0.3, 0.6).apply(BOX), BOX), BOX, UP)) == 1
    gaps = [gap for _, _, gap in widened(on(turned(0, 1e-3).apply(BOX), BOX), BOX, UP)]
    np.testing.assert_allclose(sorted(gaps), [0, 0, 1e-3, 1e-3], atol=1e-6)


@pytest.mark.parametrize("tilt", [0, 1e-4, 3e-3, 0.02])
def test_pancakes(tilt):
    """Upper corners are near the support plane too; the gaps are those of the lower ones."""
    pancake = BOX * [1, 1, 1e-3]
    a = turned(0.4 if tilt < 0.01 else 0, tilt).apply(pancake)
    found = widened(on(a, pancake), pancake, UP)
    assert len(found) == (8 if tilt < 0.01 else 2)
    for pa, _, gap in found:
        assert gap == pytest.approx(np.tan(tilt) * (pa[1] - a[np.argmin(a[:, 2]), 1]), abs=1e-9)


def test_needle_of_any_roll_rests_on_its_lowest_side():
    needle = BOX * [1, 1e-3, 1e-3]
    for roll in (0, 0.3, np.pi / 4):
        a = on(Rotation.from_euler("x", roll).apply(needle), BOX)
        found = widened(a, BOX, UP)
        assert len(found) == 2
        np.testing.assert_allclose([gap for _, _, gap in found], 0, atol=1e-12)


def test_same_pose_faces_that_touch_at_an_edge_and_collinear_corners_are_finite():
    beside = moved(BOX, 1)
    beads = np.concatenate([BOX, moved(BOX, 0.5), BOX])
    for a, b in ((BOX, BOX), (on(beside, BOX), BOX), (on(beads, BOX), BOX), (on(BOX, beads), beads)):
        found = widened(a, b, UP)
        assert np.isfinite(np.array([gap for _, _, gap in found])).all()
        assert len(found) >= 2
    assert len(widened(on(beads, BOX), BOX, UP)) == 4


def test_spheres_stay_single_and_capsules_lie_on_two_points():
    ball = on(TIP, BOX, 0.3)
    assert len(widened(ball, BOX, UP, (0.3, 0.0))) == 1
    rod = on(np.array([[-0.4, 0.1, 0], [0.3, 0.2, 0]]), BOX, 0.3)
    found = widened(rod, BOX, UP, (0.3, 0.0))
    assert len(found) == 2
    np.testing.assert_allclose([gap for _, _, gap in found], 0, atol=1e-12)
    stub = on(np.array([[-0.001, 0, 0], [0.001, 0, 0]]), BOX, 0.3)
    assert len(widened(stub, BOX, UP, (0.3, 0.0))) == 1


def test_many_corners_keep_most_of_the_area_and_the_deepest_point():
    found = widened(on(prism(400), 3 * BOX), 3 * BOX, UP)
    assert len(found) == POINTS
    assert hull_area(np.array([pa[:2] for pa, _, _ in found])) > 0.85 * np.pi * 0.6**2
    rng = np.random.default_rng(3)
    ball = rng.normal(size=(1000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    for seed in range(10):
        assert 1 <= len(widened(on(Rotation.random(random_state=seed).apply(ball), 5 * BOX), 5 * BOX, UP)) <= POINTS


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_any_scale(scale):
    a = on(turned(0.3, 1e-3).apply(BOX), BOX, -1e-3)
    one, other = widened(a, BOX, UP), widened(scale * a, scale * BOX, UP)
    np.testing.assert_allclose(np.array([p for p, _, _ in other]), scale * np.array([p for p, _, _ in one]), atol=1e-9 * scale)


UNIT = st.floats(-1, 1)


@given(st.sampled_from(list(SHAPES)), st.sampled_from(list(SHAPES)), st.floats(0, 7), st.sampled_from([0, 1e-3, 0.1]),
       st.tuples(UNIT, UNIT, UNIT), st.integers(0, 1000), st.booleans())
@settings(max_examples=80, deadline=None)
def test_points_move_and_turn_with_the_hulls_and_are_the_same_for_the_pair_swapped(upper, lower, angle, tilt, shift, seed, swap):
    b = -SHAPES[lower]
    a = on(moved(turned(angle, tilt, 0.3).apply(SHAPES[upper] * [0.9, 0.8, 0.7]), 0.213, 0.117), b, -1e-3)
    pose = Rotation.random(random_state=seed)
    posed = [pose.apply(hull) + shift for hull in (a, b)]
    n = pose.apply(UP)
    before = widened(a, b, UP)
    after = widened(*posed[::-1], -n) if swap else widened(*posed, n)
    assert len(before) == len(after)
    expected = pose.apply(np.array([(pa + pb) / 2 for pa, pb, _ in before])) + shift
    for pa, pb, _ in after:
        assert np.linalg.norm(expected - (pa + pb) / 2, axis=1).min() < 1e-7


def many(capacity):
    """Pairs that become eight, stay one, become two, stay one, become four."""
    corner = aligned(np.ones(3), -UP).apply(BOX)
    edge = turned(0.4).apply(Rotation.from_euler("y", 45, degrees=True).apply(BOX))
    uppers = [turned(0.5).apply(BOX), corner, edge, corner, BOX]
    pairs = [(on(a, BOX), BOX) for a in uppers]
    return scene([(a, b, narrow(a, b, UP), UP) for a, b in pairs], capacity)


def test_contacts_of_a_pair_stay_side_by_side_and_each_pair_has_its_own():
    case = many(16)
    assert widen(*case)
    found = contacts(case)
    assert [len(found[pair]) for pair in range(5)] == [8, 1, 2, 1, 4]
    again = many(16)
    assert widen(*again)
    for array, same in zip(case.meetings, again.meetings, strict=True):
        np.testing.assert_array_equal(array, same)


@pytest.mark.parametrize("capacity", [5, 8, 15])
def test_full_meetings_say_so_and_are_left_as_they_were(capacity):
    case, same = many(capacity), many(capacity)
    assert not widen(*case)
    assert case.meetings.listed[0] == NO_ROOM
    case.meetings.listed[0] = same.meetings.listed[0]
    for array, before in zip(case.meetings, same.meetings, strict=True):
        np.testing.assert_array_equal(array, before)
    contacts(case)


@pytest.mark.parametrize("round_ones", [[0], [1], [0, 1], [0, 4, 9]])
def test_hulls_without_a_face_to_rest_on_keep_their_contact(round_ones):
    case, whole = many(16), many(16)
    case.hulls.flat[round_ones] = 0
    assert widen(*case)
    assert widen(*whole)
    single = {h // 2 for h in round_ones}
    expected = [1 if pair in single else number for pair, number in enumerate([8, 1, 2, 1, 4])]
    found = contacts(case)
    assert [len(found[pair]) for pair in range(5)] == expected
    for pair, many_points in contacts(whole).items():
        if pair not in single:
            np.testing.assert_array_equal(np.array([gap for *_, gap in found[pair]]), [gap for *_, gap in many_points])


def test_corners_of_hulls_without_a_face_are_not_looked_at():
    case = many(16)
    case.hulls.flat[:] = 0
    case.hulls.corner[:] = np.nan
    before = [array.copy() for array in case.meetings]
    assert widen(*case)
    for array, same in zip(case.meetings, before, strict=True):
        np.testing.assert_array_equal(array, same)


def test_nothing_listed():
    case = many(16)
    case.meetings.listed[0] = 0
    assert widen(*case)
    assert case.meetings.listed[0] == 0
