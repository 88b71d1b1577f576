"""Pairs of hulls that touch, and their contacts by clipping polygons."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from verlet_numba.buffers.hulls import POINTS, Hulls, Manifold, Meetings, Pairs
from verlet_numba.kernels.manifold import NEAR, PARALLEL, widen

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
