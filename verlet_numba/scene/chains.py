"""Chains of sticks: what `order: lines` solves as a whole, and slots in which chains that are parallel lie side by side.

A rope is a chain, a cloth has its diagonals, rows and columns. Of a body of particles each connected part that is a chain
from end to end, of two sticks at least, is one; its other sticks are relaxed one by one.
"""

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from verlet_numba.scene.body import Integers, Shape

DIRECTIONS = ((1, -1), (1, 1), (0, 1), (1, 0))      # of cloth, in their order: what holds its shape comes last


@dataclass(frozen=True, eq=False)
class Family:
    """Parallel chains of a template: lane m joins slots first + m and first + shift + m, and goes on from lane m - shift."""

    first: int
    shift: int
    items: Integers             # (M,) number of the stick that each lane is, -1: none
    rows: int = 1               # chains that lie one behind the other, each a stretch of M / rows lanes


def paths(shape: Shape) -> list[Integers]:
    """Particles of every connected part of a body of particles that is a chain, from end to end."""
    meeting = defaultdict(list)
    for i, j in shape.sticks.tolist():
        meeting[i].append(j)
        meeting[j].append(i)
    found, seen = [], set[int]()
    for end in sorted(p for p, others in meeting.items() if len(others) == 1):
        path, last = [end], -1
        while len(onward := [p for p in meeting[path[-1]] if p != last]) == 1:
            last = path[-1]
            path.append(onward[0])
        if not onward and len(path) > 2 and end not in seen:
            found.append(np.array(path, np.int64))
        seen.update(path)
    return found


def slots_along(shape: Shape) -> tuple[Integers, int]:
    """The slot of each particle of a shape in which chains are affine, and how many slots there are."""
    count = len(shape.positions)
    match shape.layout:
        case ("points",) if not shape.rigid:
            first = [np.zeros(0, np.int64), *paths(shape)]
            order = np.concatenate([*first, np.setdiff1d(np.arange(count), np.concatenate(first))])
            slot = np.empty(count, np.int64)
            slot[order] = np.arange(count)
            return slot, count
        case ("grid", _, _):
            return np.arange(count), count + 1          # the last lane of a diagonal ends one behind the last particle
        case _:
            return np.arange(count), count


def families(shape: Shape) -> list[Family]:
    """The families of chains of a shape, in the order in which they are relaxed."""
    if shape.rigid or not len(shape.sticks):
        return []
    match shape.layout:
        case ("line",):
            return [Family(0, 1, np.arange(len(shape.sticks)))]
        case ("grid", int(nx), int(ny)):
            return [family for direction in DIRECTIONS if (family := woven(shape, nx, ny, direction)) is not None]
        case _:
            return strung(shape)


def woven(shape: Shape, nx: int, ny: int, direction: tuple[int, int]) -> Family | None:
    """The chains of a cloth in one direction; None if it has none."""
    low, high = np.sort(shape.sticks, axis=1).T
    i, j = direction
    mine = np.flatnonzero((high // ny - low // ny == i) & (high % ny - low % ny == j))
    items = np.full((nx - i) * ny, -1)
    items[low[mine]] = mine
    return Family(0, i * ny + j, items, rows=nx - i if i == 0 else 1) if len(mine) else None


def strung(shape: Shape) -> list[Family]:
    """The chains of a body of particles, each a family of its own."""
    number = {pair: c for c, pair in enumerate(map(tuple, np.sort(shape.sticks, axis=1).tolist()))}
    found, first = [], 0
    for path in paths(shape):
        pairs = np.sort(np.stack([path[:-1], path[1:]], axis=1), axis=1).tolist()
        found.append(Family(first, 1, np.array([number[i, j] for i, j in pairs], np.int64)))
        first += len(path)
    return found


def chained(shape: Shape) -> NDArray[np.bool_]:
    """(C,) whether each stick is in a chain."""
    found = np.zeros(len(shape.sticks), bool)
    for family in families(shape):
        found[family.items[family.items >= 0]] = True
    return found


def unchained(shape: Shape) -> Shape:
    """A shape with the sticks alone that are in no chain."""
    left = ~chained(shape)
    return replace(shape, sticks=shape.sticks[left], lengths=shape.lengths[left])
