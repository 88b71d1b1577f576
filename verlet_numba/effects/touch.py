"""What touches in a substep: entities (rigid bodies, single particles that meet hulls) and the touches between them.

A rigid body has no orientation matrix and no stored inertia: mass, centre, inertia and the twist of the step follow from
its particles, where they are. Pinned particles leave it what freedom remains: one pin is a pivot, two or more on a line
are an axis, others hold it.
"""

import math

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
def touch_hulls(meet, hulls, friction, rigid, touches, which):
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
        answer[t, 2], answer[t, 3] = grip_between(friction, g, h)
        answer[t, 4] = 0.0
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
def grip_between(friction, g, h):
    """Static and dynamic friction of hull g on hull h: the geometric mean of the two materials."""
    if friction is None:
        return 0.0, 0.0
    return (math.sqrt(friction.hull[0, g] * friction.hull[0, h]), math.sqrt(friction.hull[1, g] * friction.hull[1, h]))


@kernel
def weigh(position, previous, inverse_mass, rigid):
    """Mass, centre, inverse inertia and the twist of the step of every entity that is touched."""
    if rigid is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    first, stride, size, order, mass, step = rigid.first, rigid.stride, rigid.size, rigid.order, rigid.mass, rigid.step
    twist, moved, kick = rigid.twist, rigid.moved, rigid.kick
    for i in range(rigid.touched[0]):
        e = order[i]
        begin, by = first[e], stride[e]
        end = begin + size[e] * by
        weighed = weigh_one(x, y, z, inverse_mass, begin, end, by)
        for column in range(10):
            mass[e, column] = weighed[column]
        gone = step_of(x, y, z, u, v, w, inverse_mass, begin, end, by, weighed)
        for column in range(6):
            step[e, column] = gone[column]
            twist[e, column] = moved[e, column] = kick[e, column] = 0.0


@kernel
def weigh_one(x, y, z, inverse_mass, begin, end, by):
    """1/mass, centre and inverse inertia of the particles begin, begin + by ... end; pins take freedom away."""
    mass = cx = cy = cz = 0.0
    pins, px, py, pz = 0, 0.0, 0.0, 0.0
    for k in range(begin, end, by):
        if inverse_mass[k] > 0:
            m = 1.0 / inverse_mass[k]
            mass, cx, cy, cz = mass + m, cx + m * x[k], cy + m * y[k], cz + m * z[k]
        else:
            pins, px, py, pz = pins + 1, px + x[k], py + y[k], pz + z[k]
    if pins > 0:
        cx, cy, cz = px / pins, py / pins, pz / pins
    else:
        cx, cy, cz = cx / mass, cy / mass, cz / mass
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(begin, end, by):
        if inverse_mass[k] > 0:
            m, dx, dy, dz = 1.0 / inverse_mass[k], x[k] - cx, y[k] - cy, z[k] - cz
            xx, yy, zz = xx + m * (dy * dy + dz * dz), yy + m * (dx * dx + dz * dz), zz + m * (dx * dx + dy * dy)
            xy, xz, yz = xy - m * dx * dy, xz - m * dx * dz, yz - m * dy * dz
    if pins == 0:
        return 1.0 / mass, cx, cy, cz, *inverse_symmetric(xx, yy, zz, xy, xz, yz)
    if pins == 1:
        return 0.0, cx, cy, cz, *inverse_symmetric(xx, yy, zz, xy, xz, yz)
    ax, ay, az = axis_of_pins(x, y, z, inverse_mass, begin, end, by, cx, cy, cz)
    return 0.0, cx, cy, cz, *about_axis(xx, yy, zz, xy, xz, yz, ax, ay, az)


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


@kernel
def step_of(x, y, z, u, v, w, inverse_mass, begin, end, by, weighed):
    """The twist that brought the particles from their previous places: momentum and angular momentum of the step, as displacements."""
    inverse, cx, cy, cz = weighed[0], weighed[1], weighed[2], weighed[3]
    mass = px = py = pz = 0.0
    for k in range(begin, end, by):
        pinned = not inverse_mass[k] > 0
        if pinned == (inverse == 0.0):          # a body with pins goes where they go
            m = 1.0 if pinned else 1.0 / inverse_mass[k]
            mass, px, py, pz = mass + m, px + m * (x[k] - u[k]), py + m * (y[k] - v[k]), pz + m * (z[k] - w[k])
    px, py, pz = px / mass, py / mass, pz / mass
    lx = ly = lz = 0.0
    for k in range(begin, end, by):
        if inverse_mass[k] > 0:
            m = 1.0 / inverse_mass[k]
            dx, dy, dz = cross(x[k] - cx, y[k] - cy, z[k] - cz, x[k] - u[k] - px, y[k] - v[k] - py, z[k] - w[k] - pz)
            lx, ly, lz = lx + m * dx, ly + m * dy, lz + m * dz
    ox, oy, oz = times_symmetric(weighed[4], weighed[5], weighed[6], weighed[7], weighed[8], weighed[9], lx, ly, lz)
    return px, py, pz, ox, oy, oz
