"""Friction: sliding displacement taken back, up to Coulomb's share of the push (paper, left out of its text).

It acts after the last relaxation pass, so that what sticks stands where it stood at the start of the substep, to
rounding: it cannot creep.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.physics.friction import held


@kernel
def rub(position, contact, friction):
    """Take back sliding relative to the collider's surface, contact by contact."""
    if friction is None:
        return
    for c in range(contact.listed[0]):
        push = contact.push[c]
        if push > 0.0:
            k, s = contact.particle[c], contact.solid[c]
            static = math.sqrt(friction.particle[0, k] * friction.solid[0, s])
            dynamic = math.sqrt(friction.particle[1, k] * friction.solid[1, s])
            take_back(position, k, contact, c, push, static, dynamic)


@kernel
def take_back(position, k, contact, c, push, static, dynamic):
    """Move particle k back along its slide: all of it within the static cone, else dynamic times the push."""
    nx, ny, nz = contact.normal[0, c], contact.normal[1, c], contact.normal[2, c]
    sx = position[0, k] - contact.anchor[0, c]
    sy = position[1, k] - contact.anchor[1, c]
    sz = position[2, k] - contact.anchor[2, c]
    rise = nx * sx + ny * sy + nz * sz
    sx, sy, sz = sx - rise * nx, sy - rise * ny, sz - rise * nz
    slide = math.sqrt(sx * sx + sy * sy + sz * sz)
    if slide > 0.0:
        share = held(slide, push, static, dynamic)
        position[0, k] -= share * sx
        position[1, k] -= share * sy
        position[2, k] -= share * sz
