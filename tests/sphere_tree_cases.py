"""Bodies with their sphere trees, and which pairs of them are near, by brute force."""

from typing import NamedTuple

import numpy as np

from verlet_numba.kernels.sphere_tree import list_pairs, update_layered
from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.numbering import number
from verlet_numba.scene.sphere_trees import candidates_of, layered_of, stack_of, wrapped_of

NONE = np.zeros((0, 2), np.int64)
DIE, CRATE = shapes.icosahedron(0.3, mass=1), shapes.box([0.3, 0.5, 0.2], mass=1)


class Case(NamedTuple):
    layered: object
    wrapped: object
    position: np.ndarray        # (3, n)
    inverse_mass: np.ndarray
    copies: list                # (P,) inner indices of every deformable copy
    rigid: list                 # (shape, (P,) inner indices) of every rigid copy

    @property
    def stack(self):
        return stack_of(self.layered, self.wrapped)


def case(things, real=np.float64, attached=None):
    """Things are (shape, positions (K, P, 3))."""
    bodies = [Body("thing", shape, place, 0 * place, np.zeros(len(shape.positions), bool), (0.0, 0.0), 0.0)
              for shape, place in things]
    numbering = number(bodies)
    position, inverse_mass = np.zeros((3, numbering.size), real), np.zeros(numbering.size, real)
    for body, index in zip(bodies, numbering.bodies, strict=True):
        position[:, index] = body.positions.transpose(2, 0, 1)
        inverse_mass[index] = 1
    copies = [(body.shape, own) for body, index in zip(bodies, numbering.bodies, strict=True) for own in index]
    return Case(layered_of(bodies, numbering, numbering.size, real, NONE if attached is None else attached),
                wrapped_of(bodies, numbering), position, inverse_mass, [own for shape, own in copies if not shape.rigid],
                [(shape, own) for shape, own in copies if shape.rigid])


def listed(candidates):
    count = candidates.listed[0]
    return list(zip(candidates.first[:count].tolist(), candidates.second[:count].tolist(), strict=True))


def found(case, margin, itself=True, layered=None, capacity=100_000):
    layered, candidates = layered or case.layered, candidates_of(capacity)
    update_layered(case.position, layered)
    assert list_pairs(layered, case.inverse_mass, margin, itself, case.stack, candidates)
    pairs = listed(candidates)
    assert len(set(pairs)) == len(pairs)
    assert all(i < j for i, j in pairs)
    return set(pairs)


def expected(case, margin, itself=True):
    """The naive twin: all pairs of particles."""
    x, radius = case.position.astype(float), case.layered.radius.astype(float)
    body = np.full(x.shape[1], -1)
    for copy, own in enumerate(case.copies):
        body[own] = copy
    squared = sum((x[c][:, None] - x[c]) ** 2 for c in range(3))
    near = squared < (radius[:, None] + radius + margin) ** 2
    near &= (body[:, None] >= 0) & (body >= 0) & (case.inverse_mass[:, None] + case.inverse_mass > 0)
    if not itself:
        near &= body[:, None] != body
    for p in range(len(radius)):
        near[p, case.layered.partner[case.layered.apart[p]:case.layered.apart[p + 1]]] = False
    return {(int(i), int(j)) for i, j in np.argwhere(np.triu(near, 1))}


def without_bounds(layered):
    return layered._replace(row=np.full_like(layered.row, -1), node=layered.node[:0])


def turned(points, rng):
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T


def sheet(nx, ny, thickness, diagonals="both", size=(1, 1)):
    return shapes.cloth(size, [nx, ny], diagonals=diagonals, mass=1, thickness=thickness)


def bent(shape, angle, lengthwise=1.0):
    """A cloth along a curve whose slope is angle(u), u in 0..1 along i: as long as at rest, times a factor along i."""
    nx, ny = shape.layout[1:]
    u = (np.arange(nx) / (nx - 1)).repeat(ny)
    grid = angle(np.arange(nx) / (nx - 1))
    step = np.linalg.norm(shape.positions[ny] - shape.positions[0]) * lengthwise
    along = np.cumsum(np.concatenate([[0], step * np.cos(grid[1:])]))
    up = np.cumsum(np.concatenate([[0], step * np.sin(grid[1:])]))
    row = np.rint(u * (nx - 1)).astype(int)
    return np.stack([along[row], shape.positions[:, 1], up[row]], axis=1)


def crumpled(shape, rng, rounds, squeeze=1.0):
    """A cloth creased along random lines, each side turned about it; then squeezed."""
    points = shape.positions.copy()
    for _ in range(rounds):
        origin, axis = points[rng.integers(len(points))], rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        side = np.cross(axis, rng.normal(size=3))
        beyond = (points - origin) @ side > 0
        angle, arms = rng.uniform(-np.pi, np.pi), points[beyond] - origin
        points[beyond] = origin + (arms * np.cos(angle) + np.cross(axis, arms) * np.sin(angle)
                                   + np.outer(arms @ axis, axis) * (1 - np.cos(angle)))
    return points * squeeze + rng.normal(size=points.shape) * rng.choice([0, 0.002, 0.02])
