"""Buffers of what answers to contacts as a whole."""

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import Rigid, Touches
from verlet_numba.scene.body import Body, Integers
from verlet_numba.scene.numbering import Numbering


def rigid_bodies(bodies: list[Body], numbering: Numbering) -> list[tuple[Body, Integers]]:
    """Rigid bodies and the inner indices (K, P) of their copies, in the order of their numbers."""
    return [(body, index) for body, index in zip(bodies, numbering.bodies, strict=True) if body.shape.rigid]


def belongs_to(bodies: list[Body], numbering: Numbering, size: int) -> Integers:
    """(n,) the rigid body that each particle belongs to, -1: none."""
    belongs, first = np.full(size, -1, np.int64), 0
    for _, index in rigid_bodies(bodies, numbering):
        belongs[index] = first + np.arange(len(index))[:, None]
        first += len(index)
    return belongs


def rigid_of(bodies: list[Body], numbering: Numbering, size: int, particles: int) -> Rigid:
    """Entities: the rigid bodies, room for so many particles that meet hulls, and the world."""
    whole = rigid_bodies(bodies, numbering)
    first = np.concatenate([np.zeros(0, np.int64), *(index[:, 0] for _, index in whole)])
    stride = np.concatenate([np.zeros(0, np.int64), *(index[:, 1] - index[:, 0] for _, index in whole)])
    counts = np.concatenate([np.zeros(0, np.int64), *(np.full(len(index), index.shape[1]) for _, index in whole)])
    reach = np.concatenate([np.zeros(0), *(np.full(len(index), reach_of(body)) for body, index in whole)])
    total = len(first)
    more = total + particles + 1            # a particle's entity is numbered after all that were touched before it
    begin, by, many = (np.concatenate([array, np.full(more, value)]) for array, value in ((first, 0), (stride, 1), (counts, 1)))
    doubles = [gate(np.zeros((total + more, columns)), np.float64) for columns in (10, 6, 6, 6, 6)]
    return Rigid(total, gate(begin, np.int64), gate(by, np.int64), gate(many, np.int64),
                 gate(np.concatenate([reach, np.zeros(more)]), np.float64),
                 gate(np.full(size, -1), np.int64), gate(np.zeros(1), np.int64), gate(np.zeros(total + more), np.int64),
                 gate(np.full(total + more, -1), np.int64), *doubles)


def reach_of(body: Body) -> float:
    """From the centre of a body to its farthest particle, m."""
    positions = body.shape.positions
    return float(np.linalg.norm(positions - positions.mean(axis=0), axis=1).max())


def touches_of(room: int, entities: int) -> Touches:
    """Room for so many touches between entities."""
    numbers = [gate(np.zeros(length), np.int64) for length in (3, 1, room, room, room, room, room + 1, entities)]
    return Touches(*numbers, *(gate(np.zeros((room, columns)), np.float64) for columns in (18, 9, 4, 4)))


def with_room(rigid: Rigid, more: int) -> Rigid:
    """The same bodies with room for so many entities behind them, the world included; none is touched."""
    bodies = rigid.bodies
    first, stride, size, reach = (np.concatenate([array[:bodies], np.full(more, value, array.dtype)])
                                  for array, value in ((rigid.first, 0), (rigid.stride, 1), (rigid.size, 1), (rigid.reach, 0.0)))
    rigid.entity[:] = -1
    rigid.touched[:] = 0
    mass, step, twist, moved, kick = (gate(np.zeros((bodies + more, columns)), np.float64) for columns in (10, 6, 6, 6, 6))
    return rigid._replace(first=gate(first, np.int64), stride=gate(stride, np.int64), size=gate(size, np.int64),
                          reach=gate(reach, np.float64), order=gate(np.zeros(bodies + more), np.int64),
                          parent=gate(np.full(bodies + more, -1), np.int64), mass=mass, step=step, twist=twist, moved=moved,
                          kick=kick)
