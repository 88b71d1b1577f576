"""What touches in a substep: entities (rigid bodies, single particles that meet hulls) and the touches between them.

A rigid body has no orientation matrix and no stored inertia: mass, centre, inertia and the twist of the step follow from
its particles, where they are. Pinned particles leave it what freedom remains: one pin is a pivot, two or more on a line
are an axis, others hold it.
"""

import math

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.friction import coefficients
from verlet_numba.physics.rigid import about_axis, cross, inverse_symmetric, times_symmetric

COLLIDERS, HULLS, MIXED = 0, 1, 2           # Touches.until
ON_AXIS = 1e-6                              # of the pins' distance: pins nearer to a line than this are on it


@kernel
def begin_touches(rigid, touches):
    """Nothing touches yet in this substep."""
    if rigid is None:
        return
    order, first, parent, entity = rigid.order, rigid.first, rigid.parent, rigid.entity
    for i in range(rigid.touched[0]):
        e = order[i]
        parent[e] = -1
        if e >= rigid.bodies:
            entity[first[e]] = -1
    rigid.touched[0] = 0
    touches.until[:] = 0


@inlined
def enter(parent, order, touched, e):
    """Entity e is touched: an island of its own as yet."""
    if parent[e] < 0:
        parent[e] = e
        order[touched[0]] = e
        touched[0] += 1


@kernel
def touch_colliders(contact, friction, restitution, rigid, touches):
    """Contacts of rigid bodies' particles with colliders become touches with the world."""
    if rigid is None:
        return
    t = 0
    if contact is not None:
        t = touches_of_contacts(contact, friction, restitution, rigid, touches)
    touches.until[COLLIDERS] = touches.until[HULLS] = touches.until[MIXED] = t


@kernel
def touches_of_contacts(contact, friction, restitution, rigid, touches):
    """Number of contacts of rigid bodies, listed as touches."""
    particle, solid, body = contact.particle, contact.solid, contact.body
    first, second, source, answer = touches.first, touches.second, touches.source, touches.answer
    parent, order, touched, world = rigid.parent, rigid.order, rigid.touched, rigid.size.size - 1
    t = 0
    for c in range(contact.listed[0]):
        b = body[particle[c]]
        if b >= 0:
            enter(parent, order, touched, b)
            first[t], second[t], source[t] = b, world, c
            answer[t, 2], answer[t, 3] = grip_of(friction, particle[c], solid[c])
            answer[t, 4] = leave_of(restitution, c)
            t += 1
    return t


@kernel
def grip_of(friction, k, s):
    """Static and dynamic friction of particle k on collider s."""
    if friction is None:
        return 0.0, 0.0
    return coefficients(friction.particle, friction.solid, k, s)


@kernel
def leave_of(restitution, c):
    """The separation [m] with which contact c leaves an impact."""
    if restitution is None:
        return 0.0
    return restitution.rebound[c]


@kernel
def touch_hulls(meet, hulls, friction, restitution, rigid, touches, which):
    """Meetings become touches; where one hull is a collider's the second entity is the world, whichever hull it was."""
    if meet is None or rigid is None:
        return
    one, other, pair = meet.pairs.first, meet.pairs.second, meet.meetings.pair
    body, start, particle = hulls.body, hulls.start, hulls.particle
    first, second, source, answer = touches.first, touches.second, touches.source, touches.answer
    parent, order, touched, world = rigid.parent, rigid.order, rigid.touched, rigid.size.size - 1
    bodies, entity, leads = rigid.bodies, rigid.entity, rigid.first
    t = touches.until[which]
    for m in range(meet.meetings.listed[0]):
        g, h = one[pair[m]], other[pair[m]]
        a = entity_of(body[g], particle[start[g]], bodies, entity, leads, touched, world)
        if a != world:
            enter(parent, order, touched, a)
        b = entity_of(body[h], particle[start[h]], bodies, entity, leads, touched, world)
        if b != world:
            enter(parent, order, touched, b)
        first[t], second[t], source[t] = (b, a, m) if a == world else (a, b, m)
        answer[t, 2], answer[t, 3] = grip_between(friction, which, g, h)
        answer[t, 4], answer[t, 8] = 0.0, bounce_between(restitution, which, g, h)
        t += 1
    touches.until[which:] = t


@inlined
def entity_of(b, k, bodies, entity, leads, touched, world):
    """The entity of a hull of body b whose first corner is particle k: the body, the particle by itself, or the world."""
    e = world
    if b >= 0:
        e = b
    elif k >= 0:
        if entity[k] < 0:
            entity[k] = bodies + touched[0]
            leads[entity[k]] = k
        e = entity[k]
    return e


@kernel
def grip_between(friction, which, g, h):
    """Static and dynamic friction of hull g on hull h of the HULLS or the MIXED: the geometric mean of the two materials."""
    if friction is None:
        return 0.0, 0.0
    own = friction.hull if which == HULLS else friction.point
    return math.sqrt(own[0, g] * own[0, h]), math.sqrt(own[1, g] * own[1, h])


@kernel
def bounce_between(restitution, which, g, h):
    """Restitution of hull g on hull h of the HULLS or the MIXED: the larger of the two."""
    if restitution is None:
        return 0.0
    own = restitution.hull if which == HULLS else restitution.point
    return max(own[g], own[h])


@kernel
def weigh(position, previous, inverse_mass, rigid):
    """Mass, centre, inverse inertia and the twist of the step of every entity that is touched."""
    if rigid is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    first, stride, size, parent, mass, step = rigid.first, rigid.stride, rigid.size, rigid.parent, rigid.mass, rigid.step
    twist, moved, kick = rigid.twist, rigid.moved, rigid.kick
    for e in range(parent.size):        # in their own order: neighbours share lines of the cache
        if parent[e] < 0:
            continue
        begin, by = first[e], stride[e]
        weighed = weigh_one(x, y, z, u, v, w, inverse_mass, begin, begin + size[e] * by, by)
        for column in range(10):
            mass[e, column] = weighed[column]
        for column in range(6):
            step[e, column] = weighed[10 + column]
            twist[e, column] = moved[e, column] = kick[e, column] = 0.0


@kernel
def weigh_one(x, y, z, u, v, w, inverse_mass, begin, end, by):
    """1/mass, centre, inverse inertia and twist of the step of the particles begin, begin + by ... end, all of one mass.

    Moments are summed about the first particle, then moved to the centre: I_c = I - M (d^2 1 - d d^T), L_c = L - M d x p.
    """
    free = 0.0
    for k in range(begin, end, by):
        free += inverse_mass[k] > 0
    if free * by < end - begin:
        return weigh_pinned(x, y, z, u, v, w, inverse_mass, begin, end, by)
    ax, ay, az, m = np.float64(x[begin]), np.float64(y[begin]), np.float64(z[begin]), 1.0 / inverse_mass[begin]
    sx = sy = sz = xx = yy = zz = xy = xz = yz = px = py = pz = lx = ly = lz = 0.0
    for k in range(begin, end, by):
        dx, dy, dz, gx, gy, gz = x[k] - ax, y[k] - ay, z[k] - az, x[k] - u[k], y[k] - v[k], z[k] - w[k]
        sx, sy, sz, px, py, pz = sx + dx, sy + dy, sz + dz, px + gx, py + gy, pz + gz
        xx, yy, zz, xy, xz, yz = xx + dx * dx, yy + dy * dy, zz + dz * dz, xy + dx * dy, xz + dx * dz, yz + dy * dz
        lx, ly, lz = lx + (dy * gz - dz * gy), ly + (dz * gx - dx * gz), lz + (dx * gy - dy * gx)
    one = 1.0 / free
    cx, cy, cz = sx * one, sy * one, sz * one
    xx, yy, zz, xy, xz, yz = xx - sx * cx, yy - sy * cy, zz - sz * cz, xy - sx * cy, xz - sx * cz, yz - sy * cz
    lx, ly, lz = lx - (cy * pz - cz * py), ly - (cz * px - cx * pz), lz - (cx * py - cy * px)
    inverse = inverse_symmetric(yy + zz, xx + zz, xx + yy, -xy, -xz, -yz)
    ox, oy, oz = times_symmetric(inverse[0], inverse[1], inverse[2], inverse[3], inverse[4], inverse[5], lx, ly, lz)
    w = 1.0 / m
    return (w * one, ax + cx, ay + cy, az + cz, inverse[0] * w, inverse[1] * w, inverse[2] * w, inverse[3] * w, inverse[4] * w,
            inverse[5] * w, px * one, py * one, pz * one, ox, oy, oz)


@kernel
def weigh_pinned(x, y, z, u, v, w, inverse_mass, begin, end, by):
    """The same for a body with pins: it turns about them and goes where they go."""
    pins = cx = cy = cz = px = py = pz = 0.0
    for k in range(begin, end, by):
        if not inverse_mass[k] > 0:
            pins, cx, cy, cz = pins + 1.0, cx + x[k], cy + y[k], cz + z[k]
            px, py, pz = px + (x[k] - u[k]), py + (y[k] - v[k]), pz + (z[k] - w[k])
    cx, cy, cz, px, py, pz = cx / pins, cy / pins, cz / pins, px / pins, py / pins, pz / pins
    xx = yy = zz = xy = xz = yz = lx = ly = lz = 0.0
    for k in range(begin, end, by):
        if inverse_mass[k] > 0:
            m, dx, dy, dz = 1.0 / inverse_mass[k], x[k] - cx, y[k] - cy, z[k] - cz
            xx, yy, zz = xx + m * (dy * dy + dz * dz), yy + m * (dx * dx + dz * dz), zz + m * (dx * dx + dy * dy)
            xy, xz, yz = xy - m * dx * dy, xz - m * dx * dz, yz - m * dy * dz
            gx, gy, gz = cross(dx, dy, dz, x[k] - u[k] - px, y[k] - v[k] - py, z[k] - w[k] - pz)
            lx, ly, lz = lx + m * gx, ly + m * gy, lz + m * gz
    inverse = inverse_symmetric(xx, yy, zz, xy, xz, yz)
    if pins > 1:
        axis = axis_of_pins(x, y, z, inverse_mass, begin, end, by, cx, cy, cz)
        inverse = about_axis(xx, yy, zz, xy, xz, yz, axis[0], axis[1], axis[2])
    ox, oy, oz = times_symmetric(inverse[0], inverse[1], inverse[2], inverse[3], inverse[4], inverse[5], lx, ly, lz)
    return (0.0, cx, cy, cz, inverse[0], inverse[1], inverse[2], inverse[3], inverse[4], inverse[5], px, py, pz, ox, oy, oz)


@kernel
def axis_of_pins(x, y, z, inverse_mass, begin, end, by, cx, cy, cz):
    """The unit vector along the pins of a body if they stand on a line, else zero: the body is held."""
    far, ax, ay, az = 0.0, 0.0, 0.0, 0.0
    for k in range(begin, end, by):
        dx, dy, dz = x[k] - cx, y[k] - cy, z[k] - cz
        if not inverse_mass[k] > 0 and dx * dx + dy * dy + dz * dz > far:
            far, ax, ay, az = dx * dx + dy * dy + dz * dz, dx, dy, dz
    for k in range(begin, end, by):
        if not inverse_mass[k] > 0:
            dx, dy, dz = cross(ax, ay, az, x[k] - cx, y[k] - cy, z[k] - cz)
            if dx * dx + dy * dy + dz * dz > ON_AXIS * ON_AXIS * far * far:
                return 0.0, 0.0, 0.0
    length = math.sqrt(far)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return ax / length, ay / length, az / length
