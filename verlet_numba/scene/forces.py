"""What accelerates the particles of a scene, as buffers; None for what the scene does not name."""

from typing import Any

import numpy as np

from verlet_numba.buffers import world
from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.forces import Damping, Drag, Gravity, Wind
from verlet_numba.scene.body import Body, Floats
from verlet_numba.scene.numbering import Numbering
from verlet_numba.scene.runs import joined, lanes
from verlet_numba.scene.schema_effects import Effects


def lanes_of(vector: tuple[float, float, float], moves: Any, real: Any) -> Any:
    """(3, n) a vector for every particle that moves, zero for the others."""
    return gate(np.where(moves, np.array(vector, float)[:, None], 0.0), real)


def gravity(effects: Effects, inverse_mass: Floats, real: Any) -> Gravity | None:
    if effects.gravity is None:
        return None
    return Gravity(lanes_of(effects.gravity, inverse_mass > 0, real))


def others_accelerate(effects: world.Effects) -> bool:
    """Whether anything but gravity does."""
    return any(effect is not None for effect in (effects.wind, effects.drag, effects.damping))


def beside_others(effects: world.Effects) -> Gravity | None:
    """Gravity as the frame loop has it: alone it is an acceleration that is set once, before the first step."""
    alone = effects.gravity is not None and not others_accelerate(effects)
    return Gravity(None) if alone else effects.gravity


def drag(effects: Effects, inverse_mass: Floats, real: Any) -> Drag | None:
    if effects.drag is None or effects.drag.linear == effects.drag.quadratic == 0.0:
        return None
    moves = inverse_mass > 0
    air = None if effects.wind is None else lanes_of(effects.wind.velocity, moves, real)
    linear, quadratic = (np.where(moves, rate, 0.0) for rate in (effects.drag.linear, effects.drag.quadratic))
    return Drag(gate(linear, real), gate(quadratic, real), air)


def damping(effects: Effects, inverse_mass: Floats, step: float) -> Damping | None:
    if not effects.damping:
        return None
    return Damping(*(gate(factor, np.float64) for factor in decay(np.where(inverse_mass > 0, effects.damping, 0.0), step)))


def decay(rate: Floats, step: float) -> tuple[Floats, Floats]:
    """Gain [1] and loss [1/s^2] of damping at a rate [1/s] in steps [s], as physics/resistance.py has them."""
    lost = -np.expm1(-rate * step)
    return np.divide(lost, rate * step, out=np.ones(rate.shape), where=rate > 0), lost / step**2


def wind(effects: Effects, bodies: list[Body], numbering: Numbering, inverse_mass: Floats, real: Any) -> Wind | None:
    """Wind on the triangles of every body; None if the scene has none."""
    groups = [group for group in numbering.groups if len(group.shape.triangles)]
    if effects.wind is None or effects.wind.density == 0.0 or not groups:
        return None
    firsts, counts, shares = [], [], []
    for group in groups:
        laid = lanes(group, group.shape.triangles)
        start = np.repeat(laid.first, laid.count, axis=1)
        corner = start + (np.arange(laid.count.sum()) - np.repeat(np.cumsum(laid.count) - laid.count, laid.count))
        firsts.append(laid.first)
        counts.append(laid.count)
        shares.append(np.where(laid.active, effects.wind.density / 6.0 * inverse_mass[corner], 0.0))
    count, share = joined(counts), np.concatenate(shares, axis=1)
    velocity = np.repeat(np.array(effects.wind.velocity, float)[:, None], share.shape[1], axis=1)
    return Wind(gate(np.concatenate(firsts, axis=1), np.int64), gate(count, np.int64), gate(np.cumsum(count) - count, np.int64),
                gate(velocity, real), gate(share, real))
