"""Rigid bodies answer to contacts as a whole, without orientation matrices: everything comes from their particles.

Moving only the particles that touch cannot do it: relaxation gives most of the push back, and a body neither rests nor
bounces nor sticks as its mass would. So the contacts of a body in a substep are solved on one twist (translation and
rotation) of all its particles, by projected Gauss-Seidel, and relaxation then has little left to do. Pushes are kept
as displacements of the touching particle alone, impulse over its mass: the same quantity that friction weighs.
"""

import math

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.contact import risen
from verlet_numba.effects.friction import coefficients, slide_of
from verlet_numba.effects.restitution import approach
from verlet_numba.physics.friction import held
from verlet_numba.physics.pose import turn
from verlet_numba.physics.rigid import cross, inverse_symmetric, lever

SWEEPS = 16             # of projected Gauss-Seidel, at most
SETTLED = 1e-7          # of the largest impulse: a sweep that changes less is the last
NOTHING = -1e300        # a wish that no impulse is needed for


@kernel
def gather(position, inverse_mass, contact, rigid):
    """Link the contacts of each rigid body, and find mass, centre and inertia of those that are touched."""
    if rigid is None:
        return
    head, order, after, particle, body = rigid.head, rigid.order, contact.after, contact.particle, contact.body
    for t in range(rigid.touched[0]):
        head[order[t]] = -1
    touched = 0
    for c in range(contact.listed[0]):
        b = body[particle[c]]
        if b >= 0:
            if head[b] < 0:
                weigh(position, inverse_mass, rigid, b)
                order[touched] = b
                touched += 1
            after[c] = head[b]
            head[b] = c
    rigid.touched[0] = touched


@kernel
def weigh(position, inverse_mass, rigid, b):
    """Inverse mass, centre of mass and inverse inertia of body b, from its particles where they are."""
    x, y, z = position[0], position[1], position[2]
    first, stride = rigid.first[b], rigid.stride[b]
    last = first + rigid.size[b] * stride
    mass = cx = cy = cz = 0.0
    for k in range(first, last, stride):
        m = 1.0 / inverse_mass[k]
        mass, cx, cy, cz = mass + m, cx + m * x[k], cy + m * y[k], cz + m * z[k]
    cx, cy, cz = cx / mass, cy / mass, cz / mass
    xx = yy = zz = xy = xz = yz = 0.0
    for k in range(first, last, stride):
        m, dx, dy, dz = 1.0 / inverse_mass[k], x[k] - cx, y[k] - cy, z[k] - cz
        xx, yy, zz = xx + m * (dy * dy + dz * dz), yy + m * (dx * dx + dz * dz), zz + m * (dx * dx + dy * dy)
        xy, xz, yz = xy - m * dx * dy, xz - m * dx * dz, yz - m * dy * dz
    rigid.inverse_mass[b] = 1.0 / mass
    rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b] = cx, cy, cz
    inverse = inverse_symmetric(xx, yy, zz, xy, xz, yz)
    for e in range(6):
        rigid.inverse_inertia[e, b] = inverse[e]


@inlined
def inertia_of(inertia, b):
    """The inverse inertia of body b."""
    return inertia[0, b], inertia[1, b], inertia[2, b], inertia[3, b], inertia[4, b], inertia[5, b]


@kernel
def twist(position, inverse_mass, contact, rigid, b, wanted, given):
    """The twist that brings every contact of body b up by `wanted` (L,) [m], with what was `given` (L,) accumulated.

    given: displacement of the particle by the impulses so far [m], never below 0. Returns translation and rotation.
    """
    x, y, z = position[0], position[1], position[2]
    particle, normal, after = contact.particle, contact.normal, contact.after
    cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
    w, inertia, head = rigid.inverse_mass[b], inertia_of(rigid.inverse_inertia, b), rigid.head[b]
    px = py = pz = ox = oy = oz = 0.0
    for _ in range(SWEEPS):
        c, change, largest = head, 0.0, 0.0
        while c >= 0:
            k, nx, ny, nz = particle[c], normal[0, c], normal[1, c], normal[2, c]
            tx, ty, tz, ix, iy, iz, answer = lever(x[k] - cx, y[k] - cy, z[k] - cz, nx, ny, nz, w, inertia)
            rise = nx * px + ny * py + nz * pz + tx * ox + ty * oy + tz * oz
            before = given[c] / inverse_mass[k]
            total = max(0.0, before + (wanted[c] - rise) / answer)
            impulse, given[c] = total - before, total * inverse_mass[k]
            px, py, pz = px + impulse * w * nx, py + impulse * w * ny, pz + impulse * w * nz
            ox, oy, oz = ox + impulse * ix, oy + impulse * iy, oz + impulse * iz
            change, largest = max(change, abs(impulse)), max(largest, total)
            c = after[c]
        if change <= SETTLED * largest:
            break
    return px, py, pz, ox, oy, oz


@kernel
def displace(position, rigid, b, moved):
    """Move all particles of body b by a twist, turning it about its centre exactly."""
    x, y, z = position[0], position[1], position[2]
    px, py, pz, ox, oy, oz = moved
    if px == py == pz == ox == oy == oz == 0.0:
        return
    cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
    first, stride = rigid.first[b], rigid.stride[b]
    ax, ay, az = turn(1.0, 0.0, 0.0, ox, oy, oz, 1.0)
    bx, by, bz = turn(0.0, 1.0, 0.0, ox, oy, oz, 1.0)
    ex, ey, ez = turn(0.0, 0.0, 1.0, ox, oy, oz, 1.0)
    for k in range(first, first + rigid.size[b] * stride, stride):
        rx, ry, rz = x[k] - cx, y[k] - cy, z[k] - cz
        x[k] = cx + px + (ax * rx + bx * ry + ex * rz)
        y[k] = cy + py + (ay * rx + by * ry + ey * rz)
        z[k] = cz + pz + (az * rx + bz * ry + ez * rz)
    rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b] = cx + px, cy + py, cz + pz


@kernel
def shove(position, inverse_mass, contact, rigid):
    """Move every touched body out of its colliders as a whole."""
    if rigid is None:
        return
    x, y, z = position[0], position[1], position[2]
    particle, normal, bound, after, wanted = contact.particle, contact.normal, contact.bound, contact.after, rigid.wanted
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        c = rigid.head[b]
        while c >= 0:
            k = particle[c]
            wanted[c] = bound[c] - risen(normal, c, x[k], y[k], z[k])
            c = after[c]
        displace(position, rigid, b, twist(position, inverse_mass, contact, rigid, b, wanted, contact.push))


@kernel
def rebound(position, previous, inverse_mass, contact, restitution, rigid):
    """Give touched bodies the velocity, as a whole, with which their impacts leave; by moving previous positions."""
    if restitution is None or rigid is None:
        return
    x, y, z = position[0], position[1], position[2]
    particle, normal, anchor, after, push = contact.particle, contact.normal, contact.anchor, contact.after, contact.push
    leaves, wanted, given = restitution.rebound, rigid.wanted, rigid.given
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        c, hits = rigid.head[b], 0
        while c >= 0:
            k, given[c], wanted[c] = particle[c], 0.0, NOTHING
            if leaves[c] > 0.0 and push[c] > 0.0:
                wanted[c] = leaves[c] - approach(normal, anchor, c, x[k], y[k], z[k])
                hits += 1
            c = after[c]
        if hits == 0:
            continue
        kick_back(position, previous, rigid, b, twist(position, inverse_mass, contact, rigid, b, wanted, given))
        c = rigid.head[b]
        while c >= 0:
            push[c] += given[c]
            c = after[c]


@kernel
def kick_back(position, previous, rigid, b, moved):
    """Move the previous positions of body b against a twist: the body gains it as displacement of the step."""
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    px, py, pz, ox, oy, oz = moved
    cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
    first, stride = rigid.first[b], rigid.stride[b]
    for k in range(first, first + rigid.size[b] * stride, stride):
        dx, dy, dz = cross(ox, oy, oz, x[k] - cx, y[k] - cy, z[k] - cz)
        u[k], v[k], w[k] = u[k] - (px + dx), v[k] - (py + dy), w[k] - (pz + dz)


@kernel
def rub_bodies(position, inverse_mass, contact, friction, rigid):
    """Take back the sliding of touched bodies as a whole, after the last pass: what sticks stands where it stood."""
    if friction is None or rigid is None:
        return
    for t in range(rigid.touched[0]):
        b = rigid.order[t]
        displace(position, rigid, b, hold(position, inverse_mass, contact, friction, rigid, b))


@kernel
def hold(position, inverse_mass, contact, friction, rigid, b):
    """The twist that takes back the sliding at the contacts of body b, each within Coulomb's share of its push."""
    x, y, z = position[0], position[1], position[2]
    particle, solid, push, after = contact.particle, contact.solid, contact.push, contact.after
    normal, anchor, grip, own, other = contact.normal, contact.anchor, rigid.grip, friction.particle, friction.solid
    cx, cy, cz = rigid.centre[0, b], rigid.centre[1, b], rigid.centre[2, b]
    w, inertia, head = rigid.inverse_mass[b], inertia_of(rigid.inverse_inertia, b), rigid.head[b]
    px = py = pz = ox = oy = oz = 0.0
    for sweep in range(SWEEPS):
        c, change, largest = head, 0.0, 0.0
        while c >= 0:
            if sweep == 0:
                grip[0, c] = grip[1, c] = grip[2, c] = 0.0
            k = particle[c]
            rx, ry, rz = x[k] - cx, y[k] - cy, z[k] - cz
            tx, ty, tz = cross(ox, oy, oz, rx, ry, rz)
            sx, sy, sz, slide = slide_of(normal, anchor, c, x[k] + px + tx, y[k] + py + ty, z[k] + pz + tz)
            if push[c] > 0.0 and slide > 0.0:
                answer = lever(rx, ry, rz, sx / slide, sy / slide, sz / slide, w, inertia)[6]
                gx, gy, gz = grip[0, c] - sx / answer, grip[1, c] - sy / answer, grip[2, c] - sz / answer
                static, dynamic = coefficients(own, other, k, solid[c])
                length = math.sqrt(gx * gx + gy * gy + gz * gz)
                share = held(length * inverse_mass[k], push[c], static, dynamic) if length > 0.0 else 1.0
                jx, jy, jz = gx * share - grip[0, c], gy * share - grip[1, c], gz * share - grip[2, c]
                grip[0, c], grip[1, c], grip[2, c] = gx * share, gy * share, gz * share
                change, largest = max(change, abs(jx), abs(jy), abs(jz)), max(largest, length * share)
                px, py, pz = px + jx * w, py + jy * w, pz + jz * w
                _, _, _, ix, iy, iz, _ = lever(rx, ry, rz, jx, jy, jz, w, inertia)
                ox, oy, oz = ox + ix, oy + iy, oz + iz
            c = after[c]
        if change <= SETTLED * largest:
            break
    return px, py, pz, ox, oy, oz
