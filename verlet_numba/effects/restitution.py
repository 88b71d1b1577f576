"""Restitution: what hits a collider leaves it with a share of its approach.

Before the passes, an impact's plane is raised to where the rebound ends within the substep. After them, the previous
position is moved so that the particle leaves with the rebound's displacement; that too is a push for friction.
"""

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.contact import instance, risen
from verlet_numba.physics.restitution import impact


@kernel
def foresee(position, acceleration, contact, restitution, h):
    """Find the contacts that hit in this substep and raise their bound to the rebound's end."""
    if restitution is None or contact is None:
        return
    particle, solid, normal, bound, anchor = contact.particle, contact.solid, contact.normal, contact.bound, contact.anchor
    own, other, rebound = restitution.particle, restitution.solid, restitution.rebound
    instances = other.size // contact.solids.kind.size
    x, y, z = position[0], position[1], position[2]
    for c in range(contact.listed[0]):
        k = particle[c]
        rebound[c] = 0.0
        share = max(other[solid[c] * instances + instance(k, instances)], own[k])
        after = risen(normal, c, x[k], y[k], z[k]) - bound[c]
        if share > 0.0 and after < 0.0:
            before = max(0.0, after - approach(normal, anchor, c, x[k], y[k], z[k]))
            gap, rebound[c] = impact(before, after, pull_along(acceleration, normal, c, k), h, share)
            bound[c] += gap


@inlined
def approach(normal, anchor, c, x, y, z):
    """Displacement of the point (x, y, z) along the normal in this substep [m], relative to the collider; negative: nearer."""
    return risen(normal, c, x - anchor[0, c], y - anchor[1, c], z - anchor[2, c])


@kernel
def pull_along(acceleration, normal, c, k):
    """Acceleration of particle k along the normal of contact c [m/s^2]."""
    if acceleration is None:
        return 0.0
    return risen(normal, c, acceleration[0, k], acceleration[1, k], acceleration[2, k])


@kernel
def bounce(position, previous, contact, restitution):
    """Give what hit, and answers alone, the displacement that it leaves with, by moving its previous position."""
    if restitution is None or contact is None:
        return
    particle, body, push, normal, anchor = contact.particle, contact.body, contact.push, contact.normal, contact.anchor
    rebound = restitution.rebound
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    for c in range(contact.listed[0]):
        k = particle[c]
        if rebound[c] > 0.0 and push[c] > 0.0 and body[k] < 0:
            excess = approach(normal, anchor, c, x[k], y[k], z[k]) - rebound[c]
            push[c] += max(0.0, -excess)
            u[k] += excess * normal[0, c]
            v[k] += excess * normal[1, c]
            w[k] += excess * normal[2, c]
