"""Sticks, angles and attachments of a scene as buffers."""

from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.constraints import Angles, Runs, Softness, Sticks
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.numbering import Group, Numbering
from verlet_numba.scene.runs import joined, lanes, worth_runs


class Parts(NamedTuple):
    """Distance constraints before they are cast: ends (2, C), rest and compliance (C,), in the order of relaxation."""

    ends: Integers
    rest: Floats
    compliance: Floats
    masked: Array               # (C,) lanes that are no constraint


def per_copy(group: Group, bodies: list[Body], values: str) -> Floats:
    """(K, ...) a shape's values for every copy of the group."""
    return np.concatenate([np.repeat(np.asarray(getattr(bodies[b].shape, values), float)[None], bodies[b].copies, 0)
                           for b in group.members])


def run_parts(groups: list[Group], bodies: list[Body]) -> tuple[Parts, Integers, Integers, Integers]:
    """Lanes of all groups whose constraints are runs, with first (2, R), count and data (R,)."""
    parts, firsts, counts = [empty()], [np.zeros((2, 0), np.int64)], []
    for group in groups:
        laid = lanes(group, group.shape.sticks)
        item, active = np.maximum(laid.item, 0), laid.active
        start = np.repeat(laid.first, laid.count, axis=1)
        offset = np.arange(laid.count.sum()) - np.repeat(np.cumsum(laid.count) - laid.count, laid.count)
        rest = per_copy(group, bodies, "lengths")[laid.copy, item] if len(group.shape.sticks) else np.zeros(0)
        soft = per_copy(group, bodies, "compliance")[laid.copy]
        parts.append(Parts(start + offset, np.where(active, rest, 1.0), soft, ~active))
        firsts.append(laid.first)
        counts.append(laid.count)
    count = joined(counts)
    return stacked(parts), np.concatenate(firsts, axis=1), count, np.cumsum(count) - count


def stick_parts(groups: list[Group], bodies: list[Body], numbering: Numbering, attachments: Integers) -> Parts:
    """Constraints of single bodies without structure, then the attachments (A, 2) of inner indices, at rest length 0."""
    parts = [empty()]
    for group in groups:
        for b in group.members:
            shape = bodies[b].shape
            for index in numbering.bodies[b]:
                ends = index[shape.sticks.reshape(-1, 2)].T
                parts.append(plain(ends, shape.lengths, shape.compliance))
    parts.append(plain(attachments.reshape(-1, 2).T, np.zeros(len(attachments)), 0.0))
    return stacked(parts)


def plain(ends: Integers, rest: Floats, compliance: float) -> Parts:
    """Constraints of which none is masked."""
    return Parts(ends, rest, np.full(len(rest), compliance), np.zeros(len(rest), bool))


def empty() -> Parts:
    return plain(np.zeros((2, 0), np.int64), np.zeros(0), 0.0)


def stacked(parts: list[Parts]) -> Parts:
    return Parts(*(np.concatenate(columns, axis=-1) for columns in zip(*parts, strict=True)))


def weights(parts: Parts, inverse_mass: Floats, step: float) -> tuple[Floats, Floats]:
    """Weights (2, C) w_i / (w_i + w_j + compliance / h^2) and the compliance's own share (C,), 0 where masked or immovable.

    With one pass a substep, the weights alone make a compliant stick an implicitly integrated spring (Catto 2011).
    """
    w = inverse_mass[parts.ends]
    w = np.where(parts.masked | (w.sum(0) == 0), 0.0, w)
    softness = np.where(w.sum(0) == 0, 0.0, parts.compliance / step**2)
    total = w.sum(0) + softness
    total[total == 0] = 1.0
    return w / total, softness / total


def softness_of(parts: Parts, share: Floats, passes: int, real: Any) -> Softness | None:
    """Compliance needs memory only over several passes."""
    if passes == 1 or not parts.compliance.any():
        return None
    return Softness(gate(share, real), gate(np.zeros(len(share)), real))


def angles_of(bodies: list[Body], numbering: Numbering) -> Angles | None:
    """Every angle of every copy."""
    corners = [index[:, body.shape.angles].reshape(-1, 3) for body, index in zip(bodies, numbering.bodies, strict=True)]
    values = [np.tile(body.shape.angle_values, body.copies) for body in bodies]
    rest = np.concatenate([np.zeros(0), *values])
    if not len(rest):
        return None
    return Angles(gate(np.concatenate(corners).T, np.int64), gate(rest, np.float64))


class Constraints(NamedTuple):
    runs: Runs | None
    runs_softness: Softness | None
    sticks: Sticks | None
    sticks_softness: Softness | None
    angles: Angles | None


def constraints(bodies: list[Body], numbering: Numbering, attachments: Integers, inverse_mass: Floats,
                step: float, passes: int, real: Any, rigid: bool = True) -> Constraints:
    """All constraints of a scene. attachments: (A, 2) inner indices; inverse_mass: (n,) 1/kg; step [s].

    rigid: False leaves out the sticks of rigid bodies, for relaxation in the order of the constraint graph.
    """
    with_sticks = [group for group in numbering.groups if len(group.shape.sticks) and (rigid or not group.shape.rigid)]
    long = [group for group in with_sticks if worth_runs(group)]
    single = [group for group in with_sticks if not worth_runs(group)]
    runs = sticks = runs_softness = sticks_softness = None
    if long:
        parts, first, count, data = run_parts(long, bodies)
        weight, share = weights(parts, inverse_mass, step)
        runs = Runs(gate(first, np.int64), gate(count, np.int64), gate(data, np.int64), gate(parts.rest, real),
                    gate(weight, real), int((weight.sum(0) > 0).sum()))
        runs_softness = softness_of(parts, share, passes, real)
    if single or len(attachments):
        parts = stick_parts(single, bodies, numbering, attachments)
        weight, share = weights(parts, inverse_mass, step)
        sticks = Sticks(gate(parts.ends, np.int64), gate(parts.rest, real), gate(weight, real))
        sticks_softness = softness_of(parts, share, passes, real)
    return Constraints(runs, runs_softness, sticks, sticks_softness, angles_of(bodies, numbering))
