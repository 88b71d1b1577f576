"""Friction: sliding displacement taken back, up to Coulomb's share of the push (paper, left out of its text).

It acts after the last relaxation pass, so that what sticks stands where it stood at the start of the substep, to
rounding: it cannot creep.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.physics.friction import held


@kernel
def rub(position, contact, friction):
    """Take back sliding relative to the collider's surface, contact by contact, of particles that answer alone."""
    if friction is None:
        return
    for c in range(contact.listed[0]):
        k, push = contact.particle[c], contact.push[c]
        if push > 0.0 and contact.body[k] < 0:
            static, dynamic = coefficients(contact, friction, c)
            sx, sy, sz, slide = slide_of(position, contact, c, 0.0, 0.0, 0.0)
            if slide > 0.0:
                share = held(slide, push, static, dynamic)
                position[0, k] -= share * sx
                position[1, k] -= share * sy
                position[2, k] -= share * sz


@kernel
def coefficients(contact, friction, c):
    """Static and dynamic coefficient of contact c: the geometric mean of the two materials."""
    k, s = contact.particle[c], contact.solid[c]
    return (math.sqrt(friction.particle[0, k] * friction.solid[0, s]),
            math.sqrt(friction.particle[1, k] * friction.solid[1, s]))


@kernel
def slide_of(position, contact, c, mx, my, mz):
    """Displacement along the surface since the start of the substep, with (mx, my, mz) to come, and its length [m]."""
    k = contact.particle[c]
    nx, ny, nz = contact.normal[0, c], contact.normal[1, c], contact.normal[2, c]
    sx = position[0, k] + mx - contact.anchor[0, c]
    sy = position[1, k] + my - contact.anchor[1, c]
    sz = position[2, k] + mz - contact.anchor[2, c]
    rise = nx * sx + ny * sy + nz * sz
    sx, sy, sz = sx - rise * nx, sy - rise * ny, sz - rise * nz
    return sx, sy, sz, math.sqrt(sx * sx + sy * sy + sz * sz)
