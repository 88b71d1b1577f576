"""Constraints and triangles of groups as runs: affine stretches of lanes that share no particle.

The order of relaxation is the order of the runs: block by block, and within a block class by class. A class is a set
of constraints of the template whose slots lie at a constant offset: one colour of a rope (even, odd) or of a cloth
(direction x parity of row x parity of column), or a single constraint of a body without structure. The lanes between
its first and last constraint that are none are masked by weights of 0.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import Array
from verlet_numba.scene.body import Integers, Shape
from verlet_numba.scene.numbering import Group

LANES_WORTH_A_RUN = 4       # with fewer copies, a body without structure is relaxed stick by stick


@dataclass(frozen=True, eq=False)
class Span:
    """A class of a template: items at these places of it, lane m of the run at slots first + m."""

    items: Integers             # (M,) numbers of the constraints (or triangles)
    lane: Integers              # (M,) their lanes
    first: Integers             # (arity,) slots of lane 0
    lanes: int


def spans(shape: Shape, corners: Integers, slot: Integers) -> list[Span]:
    """The classes of a template's constraints (C, 2) or triangles (F, 3), in the order in which they are relaxed."""
    places = slot[corners]
    found = []
    for items in classes(shape, corners):
        lane = places[items, 0]
        first = places[items[np.argmin(lane)]]
        offsets = places[items] - lane[:, None]
        if (offsets != offsets[0]).any():
            raise AssertionError("constraints of a class must lie at a constant offset")
        found.append(Span(items, lane - first[0], first, int(np.ptp(lane)) + 1))
    return found


def classes(shape: Shape, corners: Integers) -> list[Integers]:
    """Numbers of the constraints of each class; diagonals of cloth before its rows and columns, which hold its shape."""
    match shape.layout:
        case ("line",):
            keys = corners[:, 0] % 2
        case ("grid", int(_), int(ny)):
            i, j = np.divmod(corners, ny)
            straight = (i[:, 1:] == i[:, :1]).any(1) | (j[:, 1:] == j[:, :1]).any(1) if corners.shape[1] == 2 else 0
            steps = ((i[:, 1:] - i[:, :1] + 1) * 3 + (j[:, 1:] - j[:, :1] + 1)) @ (9 ** np.arange(corners.shape[1] - 1))
            keys = ((straight * 1000 + steps) * 2 + i[:, 0] % 2) * 2 + j[:, 0] % 2
        case _:
            keys = np.arange(len(corners))
    order = np.argsort(keys, kind="stable")
    return [items for items in np.split(order, np.flatnonzero(np.diff(keys[order])) + 1) if len(items)]


def worth_runs(group: Group) -> bool:
    """Whether a group's constraints are long enough runs to be vector lanes."""
    return group.shape.layout != ("points",) or group.copies >= LANES_WORTH_A_RUN


@dataclass(frozen=True, eq=False)
class Lanes:
    """Runs of one group over all of its blocks, and which constraint of which copy each lane is."""

    first: Integers             # (arity, R) inner indices
    count: Integers             # (R,)
    item: Integers              # (L,) number of the constraint or triangle, -1 for a masked lane
    copy: Integers              # (L,) number of the copy in its group

    @property
    def active(self) -> Array:
        return self.item >= 0


def lanes(group: Group, corners: Integers) -> Lanes:
    """Lay the classes of a group's template out over its copies, block by block."""
    template = spans(group.shape, corners, group.slot)
    firsts, counts, items, copies = [], [], [], []
    for block in range(group.blocks):
        base = group.first + block * group.slots * group.block
        copy = block * group.block + np.arange(group.block)
        for span in template:
            item = np.full((span.lanes, group.block), -1)
            item[span.lane] = span.items[:, None]
            item[:, copy >= group.copies] = -1
            firsts.append(base + span.first * group.block)
            counts.append(span.lanes * group.block)
            items.append(item.ravel())
            copies.append(np.broadcast_to(np.minimum(copy, group.copies - 1), item.shape).ravel())
    return Lanes(np.array(firsts, np.int64).reshape(-1, corners.shape[1]).T, np.array(counts, np.int64),
                 joined(items), joined(copies))


def joined(parts: list[Any]) -> Integers:
    return np.concatenate([np.zeros(0, np.int64), *parts])
