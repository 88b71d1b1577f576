"""Chains of sticks as buffers: families of parallel chains, group by group and block by block."""

from dataclasses import replace
from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.constraints import Lines, Softness
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.chains import Family, families, unchained
from verlet_numba.scene.constraints import Parts, empty, per_copy, stacked
from verlet_numba.scene.numbering import LANES, Group, Numbering

TRACE = 2 / 3       # power of the precision: a chain drawn tight between two pins has no solution, and this keeps it harmless
SETTLED = (2.0, 1e-4)   # relative error of a stick that is not worth another solve: woven into cloth, in a chain of its own


def loose(bodies: list[Body], numbering: Numbering) -> tuple[list[Body], Numbering]:
    """The same bodies and groups, with the sticks alone that are in no chain."""
    groups = tuple(replace(group, shape=unchained(group.shape)) for group in numbering.groups)
    return [replace(body, shape=unchained(body.shape)) for body in bodies], replace(numbering, groups=groups)


def lines_of(bodies: list[Body], numbering: Numbering, inverse_mass: Floats, step: float,
             real: Any) -> tuple[Lines | None, Softness | None]:
    """All chains of a scene, and what compliance remembers. inverse_mass: (n,) 1/kg; step [s]."""
    laid = [laid_out(group, bodies, family, block) for group in numbering.groups
            for template in [families(group.shape)] for block in range(group.blocks) for family in template]
    if not laid:
        return None, None
    real, parts = np.dtype(real), stacked([empty(), *(part for part, _ in laid)])
    first, shift, rows, woven = np.array([where for _, where in laid]).T
    lanes = np.array([len(part.rest) for part, _ in laid])
    data = np.cumsum(lanes) - lanes
    w = inverse_mass[parts.ends]
    active = ~parts.masked & (w.sum(0) > 0)
    softness = parts.compliance / step**2
    diagonal = np.where(active, w.sum(0) + softness, 0.0)
    before = np.arange(lanes.sum()) - np.repeat(shift, lanes)
    goes_on = active & (before >= np.repeat(data, lanes)) & active[before]
    share = np.where(active, softness / np.where(active, diagonal, 1.0), 0.0)
    whole_numbers = [first, shift, lanes, data, rows, np.add.reduceat(active, data)]
    reals = [parts.rest, diagonal * (1 + np.finfo(real).eps ** TRACE), np.where(goes_on, w[0], 0.0)]
    room = [(3, lanes.max()), (lanes.max(),), (lanes.max(),), (lanes.max(),), (3, (lanes + shift).max()),
            (3, max(1, lanes[rows > 0].max(initial=0)))]
    settled = gate(np.where(woven, *SETTLED), np.float64)
    buffers = [*(gate(values, np.int64) for values in whole_numbers), settled, *(gate(values, real) for values in reals),
               *(gate(np.zeros(size), real) for size in room), *(gate(np.zeros(size), np.int64) for size in (lanes.max(), 1))]
    if not parts.compliance.any():
        return Lines(*buffers), None
    return Lines(*buffers), Softness(gate(share, real), gate(np.zeros(len(share)), real))


def laid_out(group: Group, bodies: list[Body], family: Family, block: int) -> tuple[Parts, Integers]:
    """A family of chains over the copies of one block: constraints, and first particle, shift, rows if turned, 1 if woven."""
    width = group.block
    copy = block * width + np.arange(width)
    item = np.repeat(family.items[:, None], width, axis=1)
    item[:, copy >= group.copies] = -1
    copy = np.broadcast_to(np.minimum(copy, group.copies - 1), item.shape).ravel()
    item = item.ravel()
    first, shift = group.first + (block * group.slots + family.first) * width, family.shift * width
    start = first + np.arange(len(item))
    rest = np.where(item >= 0, per_copy(group, bodies, "lengths")[copy, np.maximum(item, 0)], 1.0)
    parts = Parts(np.stack([start, start + shift]), rest, per_copy(group, bodies, "compliance")[copy], item < 0)
    return parts, np.array([first, shift, family.rows if family.rows > 1 and shift < LANES else 0,
                            group.shape.layout[0] == "grid"])
