"""What a contact between hulls consists of: a point of either hull, as weighted corners, and the normal (paper, 5.1).

A face of the hulls' difference has three vertices a - d, b - e, c - f, each a corner of the first hull less one of the second;
the origin's projection u (a - d) + v (b - e) + w (c - f) is a point of the first hull less a point of the second. Three
corners and one are a vertex that meets a face, two and two an edge that meets an edge. Where faces meet in one plane there
may be more: both points then slide together until they are one of the two cases.
"""

import numpy as np

from verlet_numba._jit import formula, kernel
from verlet_numba.physics.simplex import FLAT_SQUARED, cross, dot

INSIDE = 1e-9           # of a weight: how far beyond an edge still counts as on it


@formula
def merged(p, q, r, u, v, w):
    """The weights u, v, w of columns p, q, r, those of a repeated column added up under its first."""
    if q == p:
        u, v = u + v, 0.0
    if r == p:
        u, w = u + w, 0.0
    elif r == q:
        v, w = v + w, 0.0
    return u, v, w


@formula
def holds(a, b, c, d, e, f, u, v, w):
    """Whether the weighted vertices are points of the hulls, as they are everywhere in the parallelogram of two edges."""
    ua, va, wa = merged(a, b, c, u, v, w)
    ub, vb, wb = merged(d, e, f, u, v, w)
    return min(min(min(ua, va), wa), min(min(ub, vb), wb)) >= -INSIDE


@formula
def convex(u, v, w):
    """Weights without what is below 0, their sum 1 again."""
    u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    whole = u + v + w
    return u / whole, v / whole, w / whole


@formula
def carriers(weight, t, first):
    """How many of the three corners from row `first` on carry a point."""
    return (weight[first, t] > 0.0) + (weight[first + 1, t] > 0.0) + (weight[first + 2, t] > 0.0)


@formula
def along_edge(points, corner, weight, t, first):
    """The vector from one corner to another of those that carry the point of rows first to first + 2, and their rows."""
    p = first if weight[first, t] > 0.0 else first + 1
    q = first + 2 if weight[first + 2, t] > 0.0 else first + 1
    i, j = corner[p, t], corner[q, t]
    return points[0, j] - points[0, i], points[1, j] - points[1, i], points[2, j] - points[2, i], p, q


@formula
def rates(points, corner, t, first, tx, ty, tz):
    """How the weights of three corners change as their point moves by t: p's by n . (t x (q - r)) / n . n; 0 where flat."""
    i, j, k = corner[first, t], corner[first + 1, t], corner[first + 2, t]
    ux, uy, uz = points[0, j] - points[0, i], points[1, j] - points[1, i], points[2, j] - points[2, i]
    wx, wy, wz = points[0, k] - points[0, i], points[1, k] - points[1, i], points[2, k] - points[2, i]
    nx, ny, nz = cross(ux, uy, uz, wx, wy, wz)
    size = dot(nx, ny, nz, nx, ny, nz)
    if size <= FLAT_SQUARED * (dot(ux, uy, uz, ux, uy, uz) * dot(wx, wy, wz, wx, wy, wz)):
        return 0.0, 0.0, 0.0
    v = dot(nx, ny, nz, *cross(tx, ty, tz, wx, wy, wz)) / size
    w = -dot(nx, ny, nz, *cross(tx, ty, tz, ux, uy, uz)) / size
    return -v - w, v, w


@formula
def room(weight, rate):
    """How far a weight may change at this rate, and at the opposite one, until it is 0."""
    if rate < 0.0:
        return -weight / rate, np.inf
    if rate > 0.0:
        return np.inf, weight / rate
    return np.inf, np.inf


@kernel
def slide(points, corner, weight, t):
    """Move both points of meeting t together, in the plane in which its faces meet, until it is one of the two cases.

    They move along an edge of the hull that has fewer carriers, the shorter way, until one of the corners carries no more.
    """
    for _ in range(2):
        first, second = carriers(weight, t, 0), carriers(weight, t, 3)
        if first + second <= 4:
            return
        line, whole = (3, 0) if second <= first else (0, 3)
        tx, ty, tz, p, q = along_edge(points, corner, weight, t, line)
        u, v, w = rates(points, corner, t, whole, tx, ty, tz)
        if u == v == w == 0.0:
            return
        ahead, back, last_ahead, last_back = np.inf, np.inf, whole, whole
        for k, rate in ((whole, u), (whole + 1, v), (whole + 2, w), (p, -1.0), (q, 1.0)):
            on, off = room(weight[k, t], rate)
            last_ahead, ahead = (k, on) if on < ahead else (last_ahead, ahead)
            last_back, back = (k, off) if off < back else (last_back, back)
        step, last = (ahead, last_ahead) if ahead <= back else (-back, last_back)
        weight[whole, t] += step * u
        weight[whole + 1, t] += step * v
        weight[whole + 2, t] += step * w
        weight[p, t] -= step
        weight[q, t] += step
        weight[last, t] = 0.0
        for k in (0, 3):
            weight[k, t], weight[k + 1, t], weight[k + 2, t] = convex(weight[k, t], weight[k + 1, t], weight[k + 2, t])


@formula
def write(points, corner, weight, normal, gap, t, a, b, c, d, e, f, u, v, w, nx, ny, nz, distance):
    """Meeting t: columns a, b, c of the first hull and d, e, f of the second, either with the weights u, v, w."""
    ua, va, wa = convex(*merged(a, b, c, u, v, w))
    ub, vb, wb = convex(*merged(d, e, f, u, v, w))
    corner[0, t], corner[1, t], corner[2, t], corner[3, t], corner[4, t], corner[5, t] = a, b, c, d, e, f
    weight[0, t], weight[1, t], weight[2, t], weight[3, t], weight[4, t], weight[5, t] = ua, va, wa, ub, vb, wb
    normal[0, t], normal[1, t], normal[2, t], gap[t] = nx, ny, nz, distance
    if carriers(weight, t, 0) + carriers(weight, t, 3) > 4:
        slide(points, corner, weight, t)
