"""Buffers of what may rest: the rigid bodies of a scene, all awake at the start."""

import math
from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.contact import FIXED, HUNG, LOOSE, RESTLESS, Rest
from verlet_numba.buffers.hulls import Hulls
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.rigid import belongs_to, reach_of, rigid_bodies
from verlet_numba.scene.schema import Scene

BEYOND = 1.1            # times its reach: a body's particles stand so far from the first at most, margins of contact included


def rest_of(scene: Scene, bodies: list[Body], numbering: Numbering, inverse_mass: Floats, hulls: Hulls | None,
            real: Any) -> Rest | None:
    """Rest where the scene calls for it and has rigid bodies that move."""
    whole = rigid_bodies(bodies, numbering)
    if scene.effects.rest is None or not whole:
        return None
    step = 1.0 / (scene.time.frame_rate * scene.solver.substeps)
    kinds = np.concatenate([np.full(len(index), kind_of(body, scene)) for body, index in whole])
    if not np.isin(kinds, (LOOSE, HUNG)).any():
        return None
    total, corners = len(kinds), 0 if hulls is None else len(hulls.body)
    first = np.concatenate([index[:, 0] for _, index in whole])
    stride = np.concatenate([index[:, 1] - index[:, 0] for _, index in whole])
    size = np.concatenate([np.full(len(index), index.shape[1]) for _, index in whole])
    reach = np.concatenate([np.full(len(index), 2.0 * BEYOND * (reach_of(body) + body.shape.radius)) for body, index in whole])
    quiet = np.zeros(corners) if hulls is None else np.where(hulls.body < 0, hulls.solid >= 0, kinds[hulls.body] == FIXED)
    numbers = [gate(np.zeros(total), np.int64) for _ in range(8)]
    wait = max(1, math.ceil(scene.effects.rest.time / step))
    return Rest(scene.effects.rest.speed * wait * step, wait,
                gate([awake(bodies, kinds)], np.int64), gate(kinds, np.int64), gate(first, np.int64), gate(stride, np.int64),
                gate(size, np.int64), gate(reach, np.float64), gate(belongs_to(bodies, numbering, len(inverse_mass)), np.int64),
                gate(inverse_mass.copy(), real), gate(np.full((3, len(inverse_mass)), np.inf), real), gate(quiet, np.int64),
                gate(np.zeros(total), np.float64), *numbers)


def kind_of(body: Body, scene: Scene) -> int:
    """How a rigid body may rest."""
    attached = any(body.name in (a, b) for a, _, b, _ in scene.attachments)
    if attached or body.path is not None:
        return RESTLESS
    if body.pinned.all():
        return FIXED
    return HUNG if body.pinned.any() else LOOSE


def awake(bodies: list[Body], kinds: Integers) -> int:
    """Bodies that move, or are moved along a path."""
    others = sum(body.copies for body in bodies if not body.shape.rigid and (body.path is not None or not body.pinned.all()))
    return others + int((kinds != FIXED).sum())
