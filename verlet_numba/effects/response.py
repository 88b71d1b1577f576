"""Rigid bodies answer to contacts as a whole, without orientation matrices: everything comes from their particles.

Moving only the particles that touch cannot do it: relaxation gives most of the push back, and a body neither rests nor
bounces nor sticks as its mass would. So the contacts of a body in a substep are solved on one twist (translation and
rotation) of all its particles, by projected Gauss-Seidel, and relaxation then has little left to do. Pushes are kept
as displacements of the touching particle alone, impulse over its mass: the same quantity that friction weighs.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.effects.contact import height
from verlet_numba.effects.friction import coefficients, slide_of
from verlet_numba.effects.restitution import approach
from verlet_numba.physics.friction import held
from verlet_numba.physics.pose import turn
from verlet_numba.physics.rigid import cross, inverse_symmetric, times_symmetric

SWEEPS = 8


@kernel
def gather(particles, contact, rigid):
    """Link the contacts of each rigid body, and find mass, centre and inertia of those that are touched."""
    if rigid is None:
        return
    for t in range(rigid.touched[0]):
        rigid.head[rigid.order[t]] = -1
    rigid.touched[0] = 0
    for c in range(contact.listed[0]):
        b = contact.body[contact.particle[c]]
        if b >= 0:
            if rigid.head[b] < 0:
                weigh(particles, rigid, b)
                rigid.order[rigid.touched[0]] = b
                rigid.touched[0] += 1
            contact.after[c] = rigid.head[b]
            rigid.head[b] = c


@kernel
def weigh(particles, rigid, b):
    """Inverse mass, centre of mass and inverse inertia of body b, from its particles where they are."""
    x, y, z = particles.position[0], particles.position[1], particles.position[2]
    last = rigid.first[b] + rigid.size[b] * rigid.stride[b]
    mass = cx = cy = cz = 0.0
    for k in range(rigid.first[b], last, rigid.stride[b]):
        m = 1.0 / particles.inverse_mass[k]
        mass, cx, cy, cz = mass + m, cx + m * x[k], cy + m * y[k], cz + m * z[k]
    cx, cy, cz = cx / mass, cy / mass, cz / mass
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(rigid.first[b], last, rigid.stride[b]):
        m, dx, dy, dz = 1.0 / particles.inverse_mass[k], x[k] - cx, y[k] - cy, z[k] - cz
        xx, yy, zz = xx + m * (dy * dy + dz * dz), yy + m * (dx * dx + dz * dz), zz + m * (dx * dx + dy * dy)
        xy, xz, yz = xy - m * dx * dy, xz - m * dx * dz, yz - m * dy * dz
    rigid.inverse_mass[b] = 1.0 / mass
    rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b] = cx, cy, cz
    inverse = inverse_symmetric(xx, yy, zz, xy, xz, yz)
    for e in range(6):
        rigid.inverse_inertia[e, b] = inverse[e]


@kernel
def lever(position, rigid, b, k, nx, ny, nz):
    """How body b answers at its particle k along n: r x n, I^-1 (r x n), and the displacement of a unit impulse [1/kg]."""
    rx, ry, rz = (position[0, k] - rigid.centre[0, b], position[1, k] - rigid.centre[1, b], position[2, k] - rigid.centre[2, b])
    tx, ty, tz = cross(rx, ry, rz, nx, ny, nz)
    inertia = rigid.inverse_inertia
    ix, iy, iz = times_symmetric(inertia[0, b], inertia[1, b], inertia[2, b],
                                 inertia[3, b], inertia[4, b], inertia[5, b], tx, ty, tz)
    return tx, ty, tz, ix, iy, iz, rigid.inverse_mass[b] + tx * ix + ty * iy + tz * iz


@kernel
def twist(position, inverse_mass, contact, rigid, b, wanted, given):
    """The twist that brings every contact of body b up by `wanted` (L,) [m], with what was `given` (L,) accumulated.

    given: displacement of the particle by the impulses so far [m], never below 0. Returns translation and rotation.
    """
    px = py = pz = ox = oy = oz = 0.0
    w = rigid.inverse_mass[b]
    for _ in range(SWEEPS):
        c = rigid.head[b]
        while c >= 0:
            nx, ny, nz = contact.normal[0, c], contact.normal[1, c], contact.normal[2, c]
            k = contact.particle[c]
            tx, ty, tz, ix, iy, iz, answer = lever(position, rigid, b, k, nx, ny, nz)
            risen = nx * px + ny * py + nz * pz + tx * ox + ty * oy + tz * oz
            own = inverse_mass[k]
            impulse = (wanted[c] - risen) / answer
            total = max(0.0, given[c] / own + impulse)
            impulse = total - given[c] / own
            given[c] = total * own
            px, py, pz = px + impulse * w * nx, py + impulse * w * ny, pz + impulse * w * nz
            ox, oy, oz = ox + impulse * ix, oy + impulse * iy, oz + impulse * iz
            c = contact.after[c]
    return px, py, pz, ox, oy, oz


@kernel
def shove(particles, contact, rigid):
    """Move every touched body out of its colliders as a whole."""
    if rigid is None:
        return
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        c = rigid.head[b]
        while c >= 0:
            rigid.wanted[c] = -height(particles.position, contact, c)
            c = contact.after[c]
        moved = twist(particles.position, particles.inverse_mass, contact, rigid, b, rigid.wanted, contact.push)
        displace(particles.position, rigid, b, moved)


@kernel
def displace(position, rigid, b, moved):
    """Move all particles of body b by a twist, turning it about its centre exactly."""
    x, y, z = position[0], position[1], position[2]
    px, py, pz, ox, oy, oz = moved
    cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
    for k in range(rigid.first[b], rigid.first[b] + rigid.size[b] * rigid.stride[b], rigid.stride[b]):
        rx, ry, rz = turn(x[k] - cx, y[k] - cy, z[k] - cz, ox, oy, oz, 1.0)
        x[k], y[k], z[k] = cx + px + rx, cy + py + ry, cz + pz + rz
    rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b] = cx + px, cy + py, cz + pz


@kernel
def rebound(particles, contact, restitution, rigid):
    """Give touched bodies the velocity, as a whole, with which their impacts leave; by moving previous positions."""
    if restitution is None or rigid is None:
        return
    x, y, z = particles.position[0], particles.position[1], particles.position[2]
    u, v, w = particles.previous[0], particles.previous[1], particles.previous[2]
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        c = rigid.head[b]
        while c >= 0:
            leaves = restitution.rebound[c] > 0.0 and contact.push[c] > 0.0
            rigid.wanted[c] = restitution.rebound[c] - approach(particles.position, contact, c) if leaves else -1e300
            rigid.given[c] = 0.0
            c = contact.after[c]
        px, py, pz, ox, oy, oz = twist(particles.position, particles.inverse_mass, contact, rigid, b, rigid.wanted, rigid.given)
        c = rigid.head[b]
        while c >= 0:
            contact.push[c] += rigid.given[c]
            c = contact.after[c]
        cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
        for k in range(rigid.first[b], rigid.first[b] + rigid.size[b] * rigid.stride[b], rigid.stride[b]):
            dx, dy, dz = cross(ox, oy, oz, x[k] - cx, y[k] - cy, z[k] - cz)
            u[k], v[k], w[k] = u[k] - (px + dx), v[k] - (py + dy), w[k] - (pz + dz)


@kernel
def rub_bodies(particles, contact, friction, rigid):
    """Take back the sliding of touched bodies as a whole, after the last pass: what sticks stands where it stood."""
    if friction is None or rigid is None:
        return
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        displace(particles.position, rigid, b, grip(particles.position, particles.inverse_mass, contact, friction, rigid, b))


@kernel
def grip(position, inverse_mass, contact, friction, rigid, b):
    """The twist that takes back the sliding at the contacts of body b, each within Coulomb's share of its push."""
    px = py = pz = ox = oy = oz = 0.0
    w = rigid.inverse_mass[b]
    c = rigid.head[b]
    while c >= 0:
        rigid.grip[0, c] = rigid.grip[1, c] = rigid.grip[2, c] = 0.0
        c = contact.after[c]
    for _ in range(SWEEPS):
        c = rigid.head[b]
        while c >= 0:
            if contact.push[c] > 0.0:
                k = contact.particle[c]
                ix, iy, iz = pull(position, inverse_mass, contact, friction, rigid, b, c, px, py, pz, ox, oy, oz)
                px, py, pz = px + ix * w, py + iy * w, pz + iz * w
                _, _, _, tx, ty, tz, _ = lever(position, rigid, b, k, ix, iy, iz)
                ox, oy, oz = ox + tx, oy + ty, oz + tz
            c = contact.after[c]
    return px, py, pz, ox, oy, oz


@kernel
def pull(position, inverse_mass, contact, friction, rigid, b, c, px, py, pz, ox, oy, oz):
    """One step of `grip`: the change of the impulse at contact c [kg m], given the twist so far."""
    k = contact.particle[c]
    own, push = inverse_mass[k], contact.push[c]
    static, dynamic = coefficients(contact, friction, c)
    rx, ry, rz = (position[0, k] - rigid.centre[0, b], position[1, k] - rigid.centre[1, b], position[2, k] - rigid.centre[2, b])
    tx, ty, tz = cross(ox, oy, oz, rx, ry, rz)
    sx, sy, sz, slide = slide_of(position, contact, c, px + tx, py + ty, pz + tz)
    if slide == 0.0:
        return 0.0, 0.0, 0.0
    answer = lever(position, rigid, b, k, sx / slide, sy / slide, sz / slide)[6]
    gx, gy, gz = rigid.grip[0, c] - sx / answer, rigid.grip[1, c] - sy / answer, rigid.grip[2, c] - sz / answer
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    if length > 0.0:
        share = held(length * own, push, static, dynamic)
        gx, gy, gz = gx * share, gy * share, gz * share
    ix, iy, iz = gx - rigid.grip[0, c], gy - rigid.grip[1, c], gz - rigid.grip[2, c]
    rigid.grip[0, c], rigid.grip[1, c], rigid.grip[2, c] = gx, gy, gz
    return ix, iy, iz
