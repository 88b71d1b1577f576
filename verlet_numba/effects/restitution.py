"""Restitution: what hits a collider leaves it with a share of its approach.

Before the passes, an impact's plane is raised to where the rebound ends within the substep. After them, the previous
position is moved so that the particle leaves with the rebound's displacement; that too is a push for friction.
"""

from verlet_numba._jit import kernel
from verlet_numba.effects.contact import height
from verlet_numba.physics.restitution import impact


@kernel
def foresee(particles, contact, restitution, h):
    """Find the contacts that hit in this substep and raise their bound to the rebound's end."""
    if restitution is None:
        return
    for c in range(contact.listed[0]):
        k, s = contact.particle[c], contact.solid[c]
        restitution.rebound[c] = 0.0
        share = max(float(restitution.particle[k]), restitution.solid[s])
        after = height(particles.position, contact, c)
        if share > 0.0 and after < 0.0:
            before = max(0.0, after - approach(particles.position, contact, c))
            pull = normal_acceleration(particles.acceleration, contact, c)
            gap, restitution.rebound[c] = impact(before, after, pull, h, share)
            contact.bound[c] += gap


@kernel
def approach(position, contact, c):
    """Displacement along the normal in this substep [m], relative to the collider; negative: nearer."""
    k, total = contact.particle[c], 0.0
    for axis in range(3):
        total += contact.normal[axis, c] * (position[axis, k] - contact.anchor[axis, c])
    return total


@kernel
def normal_acceleration(acceleration, contact, c):
    """Acceleration along the normal of contact c [m/s^2]."""
    if acceleration is None:
        return 0.0
    k, total = contact.particle[c], 0.0
    for axis in range(3):
        total += contact.normal[axis, c] * acceleration[axis, k]
    return total


@kernel
def bounce(particles, contact, restitution):
    """Give what hit the displacement that it leaves with, by moving its previous position along the normal."""
    if restitution is None:
        return
    for c in range(contact.listed[0]):
        k = contact.particle[c]
        if restitution.rebound[c] > 0.0 and contact.push[c] > 0.0 and contact.body[k] < 0:
            excess = approach(particles.position, contact, c) - restitution.rebound[c]
            contact.push[c] -= excess
            for axis in range(3):
                particles.previous[axis, k] += excess * contact.normal[axis, c]
