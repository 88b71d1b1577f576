"""Buffers of the resistance to bending: the hinges of cloth in runs, the joints of ropes one after another."""

import math

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.constraints import Bending, Hinges, Joints
from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.numbering import Group, Numbering
from verlet_numba.scene.runs import joined, lanes
from verlet_numba.scene.schema import Scene


def bending_of(scene: Scene, bodies: list[Body], numbering: Numbering, inverse_mass: Floats) -> Bending | None:
    """All hinges and joints; None if the scene has none, or nothing that makes them stiff."""
    bending = scene.effects.bending
    if bending is None or bending.stiffness == 0.0:
        return None
    hinges, joints = hinges_of(bodies, numbering, inverse_mass), joints_of(bodies, numbering, inverse_mass)
    if hinges is None and joints is None:
        return None
    x = rate(bending.stiffness) / scene.solver.substeps
    share = (1.0, 0.0, 0.0) if math.isinf(x) else (x**2 / (1 + x) ** 2, 2 * x / (1 + x) ** 2, 1 / (1 + x) ** 2)
    return Bending(gate(share, np.float64), hinges, joints)


def rate(stiffness: float) -> float:
    """The x for which (1 + x) exp(-x) = 1 - stiffness: a frame takes so much of an error, from rest (physics/returning.py)."""
    if stiffness == 1.0:
        return math.inf
    low, high = 0.0, 1000.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (1 + middle) * math.exp(-middle) > 1 - stiffness else (low, middle)
    return low


def folds(shape: Shape) -> Integers:
    """(H, 4) the inner edges of a cloth from particle to particle, and the third corners to their left and right."""
    if shape.layout[0] != "grid":
        return np.zeros((0, 4), np.int64)
    third = {(int(t[k]), int(t[(k + 1) % 3])): int(t[(k + 2) % 3]) for t in shape.triangles for k in range(3)}
    rows = [(a, b, c, third[b, a]) for (a, b), c in third.items() if a < b and (b, a) in third]
    return np.array(sorted(rows), np.int64).reshape(-1, 4)


def hinges_of(bodies: list[Body], numbering: Numbering, inverse_mass: Floats) -> Hinges | None:
    """The hinges of every cloth."""
    groups = [(group, corners) for group in numbering.groups if len(corners := folds(group.shape))]
    if not groups:
        return None
    firsts, counts, weights, rests = [], [], [], []
    for group, corners in groups:
        laid = lanes(group, corners)
        start = np.repeat(laid.first, laid.count, axis=1)
        corner = start + (np.arange(laid.count.sum()) - np.repeat(np.cumsum(laid.count) - laid.count, laid.count))
        firsts.append(laid.first)
        counts.append(laid.count)
        weights.append(np.where(laid.active, inverse_mass[corner], 0.0))
        rests.append(np.where(laid.active, dihedral(placed(group, bodies), corners)[:, laid.copy, np.maximum(laid.item, 0)], 0.0))
    count, weight, rest = joined(counts), np.concatenate(weights, axis=1), np.concatenate(rests, axis=1)
    numbers = (np.concatenate(firsts, axis=1), count, np.cumsum(count) - count)
    memory = np.zeros(weight.shape[1])
    return Hinges(*(gate(each, np.int64) for each in numbers),
                  *(gate(each, np.float64) for each in (weight, rest, memory, memory.copy())))


def placed(group: Group, bodies: list[Body]) -> Floats:
    """(K, P, 3) where all copies of a group start."""
    return np.concatenate([bodies[b].positions for b in group.members])


def dihedral(positions: Floats, corners: Integers) -> Floats:
    """(2, K, H) cosine and sine of the hinges (H, 4) of copies (K, P, 3), as physics/hinge.py has them."""
    a, b, c, d = (positions[:, column] for column in corners.T)
    e, p, q = b - a, c - a, d - a
    one, other = np.cross(e, p), np.cross(q, e)
    found = np.stack([np.sum(one * other, axis=2), np.linalg.norm(e, axis=2) * np.sum(other * p, axis=2)])
    length = np.hypot(*found)
    return np.asarray(np.divide(found, length, out=np.zeros_like(found), where=length > 0))


def joints_of(bodies: list[Body], numbering: Numbering, inverse_mass: Floats) -> Joints | None:
    """The joints of every rope."""
    ropes = [(body, index) for body, index in zip(bodies, numbering.bodies, strict=True) if body.shape.layout[0] == "line"]
    corners = [np.stack([index[:, :-2], index[:, 1:-1], index[:, 2:]]).reshape(3, -1) for _, index in ropes]
    found = np.concatenate([np.zeros((3, 0), np.int64), *corners], axis=1)
    if not found.size:
        return None
    rest = np.concatenate([openings(body.positions).ravel() for body, _ in ropes])
    return Joints(gate(found, np.int64), gate(inverse_mass[found], np.float64), gate(rest, np.float64),
                  *(gate(np.zeros(rest.size), np.float64) for _ in range(2)))


def openings(positions: Floats) -> Floats:
    """(K, P - 2) angles [rad] at the inner particles of chains (K, P, 3)."""
    u, v = positions[:, :-2] - positions[:, 1:-1], positions[:, 2:] - positions[:, 1:-1]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), np.sum(u * v, axis=2)))
