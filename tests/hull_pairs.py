"""Hulls and pairs of them as buffers, for tests of the narrow phase."""

import numpy as np

from verlet_numba.buffers.hulls import Hulls
from verlet_numba.scene.capacity import meetings_of
from verlet_numba.scene.capacity import pairs_of as empty_pairs


def hulls_of(points, roundings=None, graphs=()):
    """Hulls of colliders, each the corners (n, 3) given; those whose numbers are in `graphs` get their hull's edges."""
    from scipy.spatial import ConvexHull
    sizes = np.array([len(p) for p in points])
    padded = -(-sizes // 4) * 4
    start = np.concatenate([[0], np.cumsum(padded)])
    corner = np.concatenate([p[np.where(np.arange(n) < len(p), np.arange(n), 0)] for p, n in zip(points, padded, strict=True)])
    graph, ends, neighbour = np.full(len(points), -1), [0], []
    for h in graphs:
        around = [set() for _ in points[h]]
        for simplex in ConvexHull(points[h]).simplices:
            for k in simplex:
                around[k] |= set(simplex.tolist()) - {k}
        graph[h] = len(ends) - 1
        for corners in around:
            neighbour += sorted(corners)
            ends.append(len(neighbour))
    rounding = np.zeros(len(points)) if roundings is None else np.asarray(roundings, float)
    centre = np.array([np.mean(p, axis=0) for p in points]).T
    reach = np.array([np.linalg.norm(p - c, axis=1).max() for p, c in zip(points, centre.T, strict=True)]) + rounding
    none, corner = np.full(len(points), -1), np.ascontiguousarray(corner.T, float)
    return Hulls(body=none, start=start, size=sizes, particle=np.full(start[-1], -1), corner=corner,
                 centre=np.ascontiguousarray(centre), solid=none, local=np.zeros_like(corner), reach=reach, rounding=rounding,
                 flat=np.zeros_like(none), graph=graph, neighbours=np.array(ends), neighbour=np.array(neighbour, np.int64))


def pairs_of(first, second):
    """Pairs that know nothing yet."""
    first, second = np.array(first, np.int64).reshape(-1), np.array(second, np.int64).reshape(-1)
    pairs = empty_pairs(len(first))
    pairs.listed[0], pairs.first[:], pairs.second[:], pairs.face[:] = len(first), first, second, -1
    return pairs


def meetings_for(room):
    """Room for meetings."""
    return meetings_of(room)


def witnesses(hulls, meetings):
    """The points (3, n) of the first and of the second hull where they meet."""
    n = meetings.listed[0]
    points = hulls.corner[:, meetings.corner[:, :n]] * meetings.weight[:, :n]
    return points[:, :3].sum(axis=1), points[:, 3:].sum(axis=1)


def difference_depth(first, second):
    """Depth of penetration by brute force, from the hull of all differences of corners (n, 3); negative where apart."""
    from scipy.spatial import ConvexHull
    return -ConvexHull((first[:, None] - second[None]).reshape(-1, 3)).equations[:, 3].max()


def distance(first, second, axis=None, bound=np.inf, graphs=()):
    """GJK on two sets of corners (n, 3): how it ended, the number of vertices, v, and the simplex' labels and weights."""
    from verlet_numba.kernels.gjk import gjk
    from verlet_numba.scene.capacity import narrow_of as scratch
    hulls = hulls_of([first, second], graphs=graphs)
    narrow = scratch(hulls)
    start = hulls.centre[:, 0] - hulls.centre[:, 1] if axis is None else np.asarray(axis, float)
    status, n, *v = gjk(hulls.corner, hulls.neighbours, hulls.neighbour, narrow.seen, hulls.start[0], hulls.size[0], hulls.graph[0],
                        hulls.start[1], hulls.size[1], hulls.graph[1], *start, bound, narrow.vertex, narrow.label, narrow.weight)
    return status, n, np.array(v), narrow.label[:, :n] - hulls.start[[0, 1]][:, None], narrow.weight[:n].copy()


def meet(first, second, roundings=(0.0, 0.0), margin=np.inf):
    """The meeting of two sets of corners (n, 3): normal, gap, the points of either, and how many corners carry each."""
    from verlet_numba.kernels.narrow import collide
    from verlet_numba.scene.capacity import narrow_of as scratch
    hulls, meetings = hulls_of([first, second], roundings), meetings_for(1)
    assert collide(hulls, pairs_of([0], [1]), meetings, scratch(hulls), margin, None)
    if meetings.listed[0] == 0:
        return None
    p, q = witnesses(hulls, meetings)
    carriers = tuple((meetings.weight[:, 0].reshape(2, 3) > 0).sum(axis=1).tolist())
    return meetings.normal[:, 0], meetings.gap[0], p[:, 0], q[:, 0], carriers


def box(x, y, z):
    """Corners of a box about the origin with these edges."""
    return np.array([(i * x, j * y, k * z) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])


def rotated(points, axis, angle):
    """Points (n, 3) turned about an axis through the origin."""
    from scipy.spatial.transform import Rotation
    return Rotation.from_rotvec(angle * np.asarray(axis, float) / np.linalg.norm(axis)).apply(points)
