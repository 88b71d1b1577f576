"""The inner numbering: bodies of equal topology side by side, so that they are lanes of one vector loop.

A group holds all copies of all bodies of one topology. Its particles take slots; the particle in slot s of copy k has
the index first + (k // B) S B + s B + k % B, for S slots and blocks of B copies. Slots are chosen so that the
constraints of a rope or a cloth are runs of their own: a rope's even particles come before its odd ones, a cloth is
four blocks by the parity of row and column, each row one ghost longer than needed, so that neighbours in a block's
row-major order are neighbours in the cloth or one of them is a ghost. Where chains are solved as a whole, slots follow
them instead (chains.py).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.chains import slots_along

BLOCK_SLOTS = 3072      # slots of a block: 12 particles of icosahedra x 256 lanes; 128 lanes take 12 % longer in float32
SMALL_SLOTS = 4096      # a group up to this size is a single block
LANES = 8               # blocks of more copies than this are padded to a multiple of it


@dataclass(frozen=True, eq=False)
class Group:
    """Copies of one topology and where they stand."""

    shape: Shape                    # of the first member; the others share its topology
    members: tuple[int, ...]        # bodies of the scene
    slot: Integers                  # (P,) slot of each particle
    slots: int                      # S, ghosts included
    block: int                      # B, copies a block
    blocks: int
    copies: int
    first: int                      # inner index of the group's first particle

    @property
    def size(self) -> int:
        return self.slots * self.block * self.blocks

    def index(self, copy: Integers, slot: Integers) -> Integers:
        """Inner indices (K, ...) of slots in copies."""
        copy = copy.reshape(copy.shape + (1,) * slot.ndim)
        return self.first + (copy // self.block) * (self.slots * self.block) + slot * self.block + copy % self.block


@dataclass(frozen=True, eq=False)
class Numbering:
    groups: tuple[Group, ...]
    bodies: tuple[Integers, ...]    # of each body of the scene: (K, P) inner indices
    size: int                       # n

    @property
    def scene_order(self) -> Integers:
        """(N,) the inner index of every particle of the file."""
        return np.concatenate([np.zeros(0, np.int64), *(body.ravel() for body in self.bodies)])


def slots(shape: Shape) -> tuple[Integers, int]:
    """The slot of each particle of a shape, and how many slots there are."""
    count = len(shape.positions)
    match shape.layout:
        case ("line",):
            particle = np.arange(count)
            return particle // 2 + (particle % 2) * ((count + 1) // 2), count
        case ("grid", int(nx), int(ny)):
            i, j = np.divmod(np.arange(count), ny)
            rows, pitch = (nx + 1) // 2, (ny + 1) // 2 + 1
            return ((i % 2) * 2 + j % 2) * rows * pitch + (i // 2) * pitch + j // 2, 4 * rows * pitch
        case _:
            return np.arange(count), count


def block_size(slots: int, copies: int) -> int:
    """Copies a block: all of a small group, else as many as stay in the cache, in whole vectors."""
    if slots * copies <= SMALL_SLOTS or copies == 1:
        block = copies
    else:
        most = max(1, BLOCK_SLOTS // slots)
        blocks = -(-copies // most)
        block = -(-copies // blocks)
    return -(-block // LANES) * LANES if block > LANES else block


def topology(shape: Shape) -> tuple[object, ...]:
    """Bodies with the same key run side by side."""
    return (shape.layout, len(shape.positions), shape.sticks.tobytes(), shape.angles.tobytes(), shape.triangles.tobytes())


def number(bodies: list[Body], *, lines: bool = False) -> Numbering:
    """Give every particle its inner index. lines: chains of sticks are solved as a whole."""
    members: dict[tuple[object, ...], list[int]] = {}
    for b, body in enumerate(bodies):
        members.setdefault(topology(body.shape), []).append(b)
    groups, indices, first = [], dict[int, Integers](), 0
    for group_members in members.values():
        shape = bodies[group_members[0]].shape
        slot, count = slots_along(shape) if lines else slots(shape)
        copies = sum(bodies[b].copies for b in group_members)
        block = block_size(count, copies)
        group = Group(shape, tuple(group_members), slot, count, block, -(-copies // block), copies, first)
        start = 0
        for b in group_members:
            indices[b] = group.index(np.arange(start, start + bodies[b].copies), slot)
            start += bodies[b].copies
        groups.append(group)
        first += group.size
    return Numbering(tuple(groups), tuple(indices[b] for b in range(len(bodies))), first)


def spread(numbering: Numbering, values: list[Any], size: int) -> Floats:
    """(size,) values of every body, a number or (K, P), at the inner indices of its particles; 0 for ghosts."""
    result = np.zeros(size)
    for index, value in zip(numbering.bodies, values, strict=True):
        result[index] = value
    return result


def padded(size: int, itemsize: int) -> int:
    """Length of a row so that the rows of x, y and z do not fall on the same lines of the cache: off a multiple of 4 KiB."""
    size = max(size, 1)
    while size * itemsize % 4096 < 512 or size * itemsize % 64:
        size += 1
    return size
