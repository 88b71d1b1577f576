"""Buffers of the orientation guard."""

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import Orientation
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rigid import rigid_bodies

FLAT = 1e-6         # of a body's size, cubed: the volume of what has no inside


def orientation_of(bodies: list[Body], numbering: Numbering) -> Orientation | None:
    """What is watched: rigid bodies that have a volume and no pins. None if there are none."""
    watched = [(body, index, corners) for body, index in rigid_bodies(bodies, numbering)
               if not body.pinned.any() and (corners := spanning(body.shape.positions)) is not None]
    if not watched:
        return None
    each = [Orientation(index[:, 0], index[:, 1] - index[:, 0], np.full(len(index), index.shape[1]), index[:, corners].T,
                        np.full(len(index), np.sign(volume_of(body.shape.positions[corners]))))
            for body, index, corners in watched]
    first, stride, size, corner, sign = (np.concatenate(parts, axis=-1) for parts in zip(*each, strict=True))
    return Orientation(gate(first, np.int64), gate(stride, np.int64), gate(size, np.int64), gate(corner, np.int64),
                       gate(sign, np.float64))


def spanning(positions: Floats) -> Integers | None:
    """Four particles that span a large volume: each farthest from what those before it span. None if all lie in a plane."""
    centred = positions - positions[0]
    chosen, directions = [0], np.zeros((0, 3))
    for _ in range(3):
        away = centred - centred @ directions.T @ directions
        farthest = int(np.argmax(np.linalg.norm(away, axis=1)))
        length = float(np.linalg.norm(away[farthest]))
        if length == 0.0:
            return None
        chosen.append(farthest)
        directions = np.vstack([directions, away[farthest] / length])
    corners = np.array(chosen)
    enough = FLAT * float(np.linalg.norm(centred, axis=1).max()) ** 3
    return corners if abs(volume_of(positions[corners])) > enough else None


def volume_of(corners: Floats) -> float:
    """Signed volume [m^3], times six, of a tetrahedron (4, 3)."""
    return float(np.linalg.det(corners[1:] - corners[0]))
