"""Several contacts a pair of hulls, against clipped polygons in numpy."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.buffers.hulls import POINTS, Hulls, Manifold, Meetings, Pairs
from verlet_numba.kernels.manifold import FLAT, NEAR, PARALLEL, widen

UP = np.array([0.0, 0.0, 1.0])
BOX = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
TIP = np.zeros((1, 3))


def prism(sides, radius=0.6, height=1.0):
    """Corners of an upright prism about the origin."""
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(sides, height / 2)], axis=1)
    return np.concatenate([ring, ring * [1, 1, -1]])


def icosahedron():
    """Corners of an icosahedron of reach 1 that stands on a face."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([np.roll([0, s, t * golden], k) for k in range(3) for s in (-1, 1) for t in (-1, 1)])
    face = corners[np.argsort(corners @ [1, 1, 1])[:3]].mean(0)
    return aligned(face, -UP).apply(corners) / np.hypot(1, golden)


def aligned(a, b):
    return Rotation.align_vectors([b], [a])[0]


class Scene(NamedTuple):
    hulls: Hulls
    pairs: Pairs
    meetings: Meetings
    scratch: Manifold


class Contact(NamedTuple):
    corner: np.ndarray
    weight: np.ndarray
    gap: float


def narrow(a, b, n, rounding=0.0):
    """The contact of greatest depth along n: the points of both hulls that lie over each other, at most four corners."""
    size = np.ptp(np.concatenate([a, b]))
    u, v = np.linalg.svd(n[None])[2][1:]
    lateral = np.concatenate([a - a[0], -(b - a[0])]) @ np.stack([u, v], axis=1) / size
    sums = np.repeat(np.eye(2), [len(a), len(b)], axis=1)
    height = np.concatenate([a - a[0], -(b - a[0])]) @ n / size
    found = linprog(height, A_eq=np.concatenate([lateral.T, sums]), b_eq=[0, 0, 1, 1], method="highs-ds")
    assert found.success
    corner, weight = np.zeros(6, int), np.zeros(6)
    for row, first, last in ((0, 0, len(a)), (3, len(a), len(a) + len(b))):
        used = first + np.argsort(-found.x[first:last])[:3]
        corner[row:row + 3] = used[np.arange(3) % len(used)]
        weight[row:row + len(used)] = found.x[used] / found.x[used].sum()
    return Contact(corner, weight, found.fun * size - rounding)


def scene(pairs, capacity=100):
    """Buffers for pairs (first hull, second hull, contact, normal, roundings), corners padded to whole vectors."""
    bodies = [hull for pair in pairs for hull in pair[:2]]
    padded = [np.concatenate([hull, np.repeat(hull[:1], -len(hull) % 4, axis=0)]) for hull in bodies]
    start = np.concatenate([[0], np.cumsum([len(hull) for hull in padded])])
    size = np.array([len(hull) for hull in bodies])
    rounding = np.array([r for pair in pairs for r in (pair[4] if len(pair) > 4 else (0.0, 0.0))])
    centre = np.array([hull.mean(0) for hull in bodies])
    reach = np.array([np.linalg.norm(hull - c, axis=1).max() for hull, c in zip(bodies, centre, strict=True)]) + rounding
    fields = dict.fromkeys(Hulls._fields, np.zeros(0, int))
    hulls = Hulls(**fields | {"start": start, "size": size, "corner": np.ascontiguousarray(np.concatenate(padded).T),
                              "centre": np.ascontiguousarray(centre.T), "reach": reach, "rounding": rounding,
                              "local": np.zeros((3, 0)), "flat": np.ones(len(bodies), int)})
    m = len(pairs)
    listed = Pairs(np.array([m]), 2 * np.arange(m), 2 * np.arange(m) + 1, np.zeros((3, m)), np.full((6, m), -1), np.zeros(m),
                   np.zeros(m, int), np.zeros((m, 4 * POINTS)), np.zeros(m), np.zeros(m, int))
    meetings = Meetings(np.array([m]), np.full(capacity, -1), np.full((6, capacity), -1), np.full((6, capacity), np.nan),
                        np.full((3, capacity), np.nan), np.full(capacity, np.nan), np.zeros(capacity),
                        np.zeros((2, capacity)))
    for t, (a, _, contact, n, *_) in enumerate(pairs):
        local = np.where(contact.corner < len(a), contact.corner, contact.corner - len(a))
        meetings.corner[:, t] = local + np.repeat(start[2 * t:2 * t + 2], 3)
        meetings.weight[:, t], meetings.normal[:, t], meetings.gap[t], meetings.pair[t] = contact.weight, n, contact.gap, t
    return Scene(hulls, listed, meetings, scratch(max(size), capacity))


def scratch(corners, capacity):
    real, whole = (lambda *shape: np.full(shape, np.nan)), (lambda *shape: np.full(shape, -1))
    return Manifold(whole(capacity), whole(6, capacity), real(6, capacity), real(capacity), whole(corners), real(4, corners),
                    whole(2, 16), real(2, 2, 16), real(2, 16, 16), real(3, 64), whole(6, 64), real(6, 64), whole(64), real(64))


def points(case, t):
    """Points of contact t on both hulls, rebuilt from its weighted corners."""
    corners = case.hulls.corner[:, case.meetings.corner[:, t]] * case.meetings.weight[:, t]
    return corners[:, :3].sum(1), corners[:, 3:].sum(1)


def contacts(case):
    """{pair: [(point of the first, point of the second, gap)]} after checks of everything that holds for all contacts."""
    hulls, pairs, meetings, _ = case
    number, found = meetings.listed[0], {}
    assert (np.diff(meetings.pair[:number]) >= 0).all()
    for t in range(number):
        pair, weight, n = meetings.pair[t], meetings.weight[:, t], meetings.normal[:, t]
        assert (weight >= 0).all()
        np.testing.assert_allclose(weight.reshape(2, 3).sum(1), 1, rtol=1e-14)
        ends = pairs.first[pair], pairs.second[pair]
        for side, h in enumerate(ends):
            assert np.isin(meetings.corner[3 * side:3 * side + 3, t] - hulls.start[h], np.arange(hulls.size[h])).all()
        pa, pb = points(case, t)
        smaller, size = hulls.reach[list(ends)].min(), np.abs(hulls.corner).max()
        gap = n @ (pa - pb) - hulls.rounding[list(ends)].sum()
        assert meetings.gap[t] == pytest.approx(gap, rel=0, abs=1e-12 * smaller + 1e-14 * size)
        aside = pa - pb - n * (n @ (pa - pb))
        assert np.linalg.norm(aside) <= 1.1 * PARALLEL * smaller
        found.setdefault(pair, []).append((pa, pb, meetings.gap[t]))
    assert all(len(some) <= POINTS for some in found.values())
    return found


def widened(a, b, n, rounding=(0.0, 0.0)):
    """Contacts of one pair, after the check that the deepest is as deep as the narrow phase's."""
    before = narrow(a, b, n, sum(rounding))
    case = scene([(a, b, before, n, rounding)])
    assert widen(*case)
    found = contacts(case)[0]
    smaller, size = case.hulls.reach.min(), np.abs(case.hulls.corner).max()
    assert min(gap for _, _, gap in found) <= before.gap + 1e-9 * smaller + 1e-13 * size
    return found


def hull_area(flat):
    """Area of the convex hull, 0 for points on a line."""
    if len(flat) < 3 or np.linalg.svd(flat - flat.mean(0))[1][1] < 1e-12 * np.ptp(flat):
        return 0.0
    return ConvexHull(flat).volume


def clipped(subject, polygon):
    """What two convex polygons, counter-clockwise, share (Sutherland and Hodgman 1974)."""
    for p, q in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inward = np.array([-(q - p)[1], (q - p)[0]])
        side = (subject - p) @ inward
        kept = []
        for i in range(len(subject)):
            if side[i - 1] * side[i] < 0:
                kept.append(subject[i - 1] + (subject[i] - subject[i - 1]) * side[i - 1] / (side[i - 1] - side[i]))
            if side[i] >= 0:
                kept.append(subject[i])
        if not kept:
            return np.zeros((0, 2))
        subject = np.array(kept)
    return subject


def least_height(polygon):
    """The least distance of a corner from the line through its neighbours."""
    before, after = polygon - np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0) - polygon
    area = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return (area / np.linalg.norm(before + after, axis=1)).min()


def seen(corners, n):
    """Coordinates across n."""
    return corners @ np.linalg.svd(n[None])[2][1:].T


def supporting(corners, n):
    """The support polygon against n as corners in the plane across n, counter-clockwise."""
    height = corners @ n
    reach = np.linalg.norm(corners - corners.mean(0), axis=1).max()
    flat = seen(corners[height <= height.min() + NEAR * reach], n)
    return flat[ConvexHull(flat).vertices]


def turned(angle, tilt=0.0, axis=0.0):
    """Rotation about the vertical, then a tilt about a horizontal axis."""
    return Rotation.from_rotvec([tilt * np.cos(axis), tilt * np.sin(axis), 0]) * Rotation.from_rotvec([0, 0, angle])


def moved(hull, x, y=0.0):
    return hull + np.array([x, y, 0])


def on(a, b, gap=0.0):
    """Hull a moved along the vertical so that it rests on b, a gap above."""
    return a + UP * (b[:, 2].max() - a[:, 2].min() + gap)


SHAPES = {"box": BOX, "prism": prism(6), "triangle": prism(3), "icosahedron": icosahedron()}


@pytest.mark.parametrize("upper", SHAPES)
@pytest.mark.parametrize("lower", ["box", "prism", "triangle"])
@pytest.mark.parametrize("seed", range(8))
def test_faces_share_the_polygon_that_clipping_finds(upper, lower, seed):
    rng = np.random.default_rng(seed)
    pose = Rotation.random(random_state=seed)
    n = pose.apply(UP)
    a = turned(rng.uniform(0, 7), 0.002 * (seed % 2), rng.uniform(0, 7)).apply(SHAPES[upper] * rng.uniform(0.3, 1, (1, 3)))
    a = pose.apply(on(moved(a, *rng.uniform(-0.5, 0.5, 2)), SHAPES[lower], rng.uniform(-0.01, 0.01)))
    b = pose.apply(SHAPES[lower])
    shared = clipped(supporting(a, n), supporting(b, n))
    if not len(shared):
        pytest.skip("they miss each other")
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
