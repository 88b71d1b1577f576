"""Whether a convex hull has a face to rest on, which takes several contacts, and not only small ones to roll over."""

import numpy as np

from verlet_numba.scene.body import Floats, Integers
from verlet_numba.scene.clearance import planes

WIDE = 0.5              # of the square of the reach: the area of a face to rest on; an icosahedron's have 0.48
COPLANAR = 1e-5         # of the reach: how far from a face's plane its corners may be


def rests_on_a_face(corners: Floats, triangles: Integers) -> bool:
    """Whether a hull has a face with an area of at least WIDE times the reach squared, in any proportions: see `evened`.

    Triangles are in one face if they look the same way and their corners lie in one plane: that of the largest triangle,
    then that of the largest one left, until too little is left.
    """
    if not len(triangles):
        return False
    corners = evened(corners, triangles)
    normals, offsets = planes(corners, triangles)
    normals *= np.sign(offsets)[:, None]                        # outwards: the origin lies inside
    reach = np.linalg.norm(corners, axis=1).max()
    a, b, c = triangles.T
    area = np.linalg.norm(np.cross(corners[b] - corners[a], corners[c] - corners[a]), axis=1) / 2
    left, enough = area.copy(), WIDE * reach**2
    for seed in np.argsort(-area, kind="stable"):
        if left.sum() < enough:
            return False
        if left[seed] > 0:
            near = corners @ normals[seed] >= abs(offsets[seed]) - COPLANAR * reach
            face = near[a] & near[b] & near[c] & (normals @ normals[seed] > 0)
            if area[face].sum() >= enough:
                return True
            left[face] = 0
    return False


def evened(corners: Floats, triangles: Integers) -> Floats:
    """Corners (C, 3) of the hull's image under the affine map that gives it the second moments of a ball.

    Such a map keeps faces and makes a beam the cube that it was drawn out from. With x from the mean of the corners, the
    tetrahedron of the mean and a triangle pqr of share w of the volume adds, with s = p + q + r,

        w s / 4  to the mean of x,    w (p p' + q q' + r r' + s s') / 20  to the mean of x x'.

    With L L' the covariance, L^-1 x has the identity for covariance. A first map makes the corners themselves as even, so that
    thin hulls lose no digits.
    """
    even = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[0]
    tetrahedra = even[triangles]
    share = np.abs(np.linalg.det(tetrahedra))
    share /= share.sum()
    total = tetrahedra.sum(axis=1)
    mean = share @ total / 4
    square = (np.einsum("f,fki,fkj->ij", share, tetrahedra, tetrahedra) + np.einsum("f,fi,fj->ij", share, total, total)) / 20
    return np.asarray(np.linalg.solve(np.linalg.cholesky(square - np.outer(mean, mean)), (even - mean).T).T)
