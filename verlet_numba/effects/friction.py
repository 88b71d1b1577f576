"""Friction: sliding displacement taken back, up to Coulomb's share of the push (paper, left out of its text).

It acts after the last relaxation pass, so that a particle that sticks stands where it stood at the start of the
substep, to rounding: it cannot creep. (Rigid bodies creep by what the sweeps of effects/response.py leave: about 1e-6 m/s.)
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.effects.contact import instance
from verlet_numba.physics.friction import held


@kernel
def rub(position, contact, friction):
    """Take back sliding relative to the collider's surface, contact by contact, of particles that answer alone."""
    if friction is None or contact is None:
        return
    particle, solid, body, push = contact.particle, contact.solid, contact.body, contact.push
    normal, anchor, own, other = contact.normal, contact.anchor, friction.particle, friction.solid
    instances = other.shape[1] // contact.solids.kind.size
    x, y, z = position[0], position[1], position[2]
    for c in range(contact.listed[0]):
        k = particle[c]
        if push[c] > 0.0 and body[k] < 0:
            static, dynamic = coefficients(own, other, k, solid[c] * instances + instance(k, instances))
            sx, sy, sz, slide = slide_of(normal, anchor, c, x[k], y[k], z[k])
            if slide > 0.0:
                share = held(slide, push[c], static, dynamic)
                x[k] -= share * sx
                y[k] -= share * sy
                z[k] -= share * sz


@inlined
def coefficients(own, other, k, s):
    """Static and dynamic coefficient of particle k on solid s: the geometric mean of the two materials."""
    return math.sqrt(own[0, k] * other[0, s]), math.sqrt(own[1, k] * other[1, s])


@formula
def slide_of(normal, anchor, c, x, y, z):
    """Displacement of the point (x, y, z) along the surface since the start of the substep, and its length [m]."""
    nx, ny, nz = normal[0, c], normal[1, c], normal[2, c]
    sx, sy, sz = x - anchor[0, c], y - anchor[1, c], z - anchor[2, c]
    rise = nx * sx + ny * sy + nz * sz
    sx, sy, sz = sx - rise * nx, sy - rise * ny, sz - rise * nz
    return sx, sy, sz, math.sqrt(sx * sx + sy * sy + sz * sz)
