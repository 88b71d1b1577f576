"""Where triangulated surfaces pass through themselves and each other."""

import numpy as np
from numpy.typing import NDArray

from verlet_numba.scene.body import Floats, Integers
from verlet_numba.scene.shapes import edges

FLAT = 1e-12            # of the product of three sides: a tetrahedron with less than a sixth of this volume is flat
CHUNK = 2_000_000       # pairs of an edge and a triangle looked at together


def crossed(positions: Floats, triangles: Integers) -> Integers:
    """The triangles, in ascending order, that an edge of the surface passes through; touching is no crossing."""
    return np.unique(crossings(positions, triangles)[1])


def crossings(positions: Floats, triangles: Integers) -> tuple[Integers, Integers]:
    """Edges (M, 2) and the triangles (M,) that they pass through; touching is no crossing."""
    pairs = edges(triangles)
    pairs = pairs[np.argsort(positions[pairs, 0].min(axis=1), kind="stable")]   # along x, so that a chunk meets few triangles
    lower, upper = positions[triangles].min(axis=1), positions[triangles].max(axis=1)
    chunk = max(1, min(256, CHUNK // max(1, len(triangles))))
    ends, found = [np.zeros((0, 2), np.int64)], [np.zeros(0, np.int64)]
    for first in range(0, len(pairs), chunk):
        some = pairs[first:first + chunk]
        low, high = positions[some].min(axis=1), positions[some].max(axis=1)
        near = np.flatnonzero(((lower <= high.max(axis=0)) & (upper >= low.min(axis=0))).all(axis=1))
        e, t = np.nonzero(((low[:, None] <= upper[near]) & (high[:, None] >= lower[near])).all(axis=2))
        apart = (some[e][:, :, None] != triangles[near[t]][:, None]).all(axis=(1, 2))
        e, t = e[apart], near[t[apart]]
        passes = _passes(*np.moveaxis(positions[some[e]], 1, 0), *np.moveaxis(positions[triangles[t]], 1, 0))
        ends.append(some[e[passes]])
        found.append(t[passes])
    return np.concatenate(ends), np.concatenate(found)


def _passes(p: Floats, q: Floats, a: Floats, b: Floats, c: Floats) -> NDArray[np.bool_]:
    """Whether segments pq cross triangles abc: p and q lie on either side, and pq turns the same way about all sides."""
    either = _side(p, a, b, c) * _side(q, a, b, c)
    turns = _side(p, q, a, b) + _side(p, q, b, c) + _side(p, q, c, a)
    return np.asarray((either < 0) & (np.abs(turns) == 3))


def _side(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Sign (N,) of the volume of tetrahedra abcd, 0 if they are flat."""
    sides = b - a, c - a, d - a
    six_volumes = np.einsum("ni,ni->n", sides[0], np.cross(*sides[1:]))
    flat = FLAT * np.prod([np.linalg.norm(side, axis=1) for side in sides], axis=0)
    return np.where(np.abs(six_volumes) > flat, np.sign(six_volumes), 0.0)
