"""How deeply bodies overlap at the start, those that are not convex by their parts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.scene.body import Body, Shape
from verlet_numba.scene.overlap import hull_overlap, overlap_depth
from verlet_numba.scene.shapes import box, icosahedron, particles

L = Shape("mesh", ("points",), np.array([(x, y, z) for z in (0, 1) for x, y in [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2),
                                                                             (0, 1)]], float),
          np.ones(14), np.zeros((0, 2), np.int64), np.zeros(0), rigid=True,
          parts=(np.array([0, 1, 2, 6, 7, 8, 9, 13]), np.array([3, 4, 5, 6, 10, 11, 12, 13])))
"""Arms of width 1 along x and y: over [0, 2] x [0, 1] and [0, 1] x [1, 2]; the notch is [1, 2] x [1, 2]."""


def body(shape, position=(0, 0, 0), scale=1.0):
    positions = (shape.positions + position)[None] * scale
    return Body("body", shape, positions, np.zeros_like(positions), np.zeros(len(shape.positions), bool), (0, 0), 0)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
@pytest.mark.parametrize(("centre", "depth"), [
    ((1.6, 1.6, 0.5), 0), ((1.5, 1.3, 0.5), 0), ((1.5, 1.15, 0.5), 0.1), ((1.2, 1.6, 0.5), 0.05), ((0.5, 1.5, 0.5), 0.75),
    ((1.5, 0.5, 1.2), 0.05), ((1.6, 1.6, 2), 0)])
def test_a_box_in_the_notch_of_an_l_is_free(centre, depth, scale):
    cube, angle = body(box([0.5, 0.5, 0.5], mass=1), centre, scale), body(L, scale=scale)
    for one, other in ((cube, angle), (angle, cube)):
        assert overlap_depth(one, other) == pytest.approx(depth * scale, abs=1e-12 * scale)


def test_two_ls_may_hold_each_other():
    turned = Shape(L.kind, L.layout, L.positions * [-1, -1, 1], L.masses, L.sticks, L.lengths, rigid=True, parts=L.parts)
    assert overlap_depth(body(L), body(turned, (3.01, 3.01, 0))) == 0
    assert overlap_depth(body(L), body(turned, (3.01, 2.9, 0))) == pytest.approx(0)         # slid along, still beside it
    assert overlap_depth(body(L), body(turned, (2.9, 2.9, 0))) == pytest.approx(0.1)


@pytest.mark.parametrize(("point", "depth"), [((1.5, 1.5, 0.5), 0), ((1.5, 1.05, 0.5), 0.15), ((0.5, 0.7, 0.5), 0.5),
                                              ((0.5, 1.5, 0.6), 0.6), ((2.5, 0.5, 0.5), 0)])
def test_a_bead_in_the_notch_of_an_l_is_free(point, depth):
    bead = body(particles([point], [1.0], radius=0.2))
    assert overlap_depth(bead, body(L)) == pytest.approx(depth)
    assert overlap_depth(body(L), bead) == pytest.approx(depth)


@given(seed=st.integers(0, 2**32 - 1), apart=st.floats(0, 2.5))
def test_convex_hulls_against_their_difference(seed, apart):
    """Depth by brute force: how far the origin lies within the hull of all differences of corners."""
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(seed)
    hulls = []
    for shape, at in ((icosahedron(1, mass=1), 0.0), (box(rng.uniform(0.5, 2, 3), mass=1), apart)):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        hulls.append((shape.positions @ (turn * np.linalg.det(turn)).T + [at, 0, 0], shape.triangles))
    differences = (hulls[0][0][:, None] - hulls[1][0]).reshape(-1, 3)
    depth = max(0.0, -ConvexHull(differences).equations[:, 3].max())
    assert hull_overlap(*hulls) == pytest.approx(depth, abs=1e-7)
