"""Where touches are and what they wish: lines, arms and slides, and how far their entities give way to impulses."""

import math

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.contact import pose_of
from verlet_numba.effects.touch import COLLIDERS
from verlet_numba.physics.pose import inward, outward
from verlet_numba.physics.rigid import across, response

SHARE = 0.2                 # of what a gap is off: what touches that go on pushing correct in a substep, or all but
SMALL = 1e-3                # of the size of the smaller
RECOVERY = 2.5              # 1/s: an overlap in which two meet is given back at this many sizes of the smaller a second


@kernel
def aim_colliders(position, contact, rigid, touches, number, h):
    """Lines and wishes of the touches with colliders."""
    if contact is None or rigid is None:
        return
    x, y, z = position[0], position[1], position[2]
    particle, normal, bound, anchor = contact.particle, contact.normal, contact.bound, contact.anchor
    first, source, mass, reach, line, answer = touches.first, touches.source, rigid.mass, rigid.reach, touches.line, touches.answer
    overlap, met, memory, kick, recalled = contact.overlap, contact.met, contact.memory, rigid.kick, touches.recalled
    for t in range(touches.until[COLLIDERS]):
        c, e = source[t], first[t]
        k, m = particle[c], memory[c]
        nx, ny, nz = normal[0, c], normal[1, c], normal[2, c]
        rx, ry, rz = x[k] - mass[e, 1], y[k] - mass[e, 2], z[k] - mass[e, 3]
        sx = x[k] - anchor[0, c] + (kick[e, 0] + kick[e, 4] * rz - kick[e, 5] * ry)
        sy = y[k] - anchor[1, c] + (kick[e, 1] + kick[e, 5] * rx - kick[e, 3] * rz)
        sz = z[k] - anchor[2, c] + (kick[e, 2] + kick[e, 3] * ry - kick[e, 4] * rx)
        line[t, 0], line[t, 1], line[t, 2] = nx, ny, nz
        line[t, 3], line[t, 4], line[t, 5] = rx, ry, rz
        line[t, 6] = line[t, 7] = line[t, 8] = 0.0
        line[t, 9], line[t, 10], line[t, 11] = sx, sy, sz
        gap = nx * x[k] + ny * y[k] + nz * z[k] - bound[c]
        standing = 0.0 if answer[t, 4] > 0.0 else nx * sx + ny * sy + nz * sz - gap
        overlap[m] = min(still_given(overlap[m], met[m], number, RECOVERY * reach[e] * h), max(0.0, standing))
        met[m] = number
        answer[t, 0] = -gap - left_for_later(standing, overlap[m], recalled[t, 0], SMALL * reach[e])


@inlined
def still_given(overlap, met, number, rate):
    """What an overlap that two had when they met may still be, shrinking by `rate` [m] a substep: anything as they meet."""
    left = math.inf
    if met == number:
        left = overlap
    elif met == number - 1:
        left = max(0.0, overlap - rate)
    return left


@inlined
def left_for_later(standing, overlap, push, most):
    """Which part of what a gap was off at the substep's start stays [m]; standing: positive where they overlapped.

    A touch that begins with the push of the last substep corrects a SHARE, of an overlap and of a gap alike, or all but `most`
    of it. Else that push would be the sum of all errors so far: with the gap x, its speed v and the push e beyond what is
    needed, a mode of an island of which the sweeps solve the part k in a substep goes as
        e' = -k (SHARE x + v + e),  v' = e,  x' = v  a substep,  so  s^3 + k s^2 + k s + k SHARE = 0,
    which dies away only if k > SHARE (Routh). Of a large heap, whose softest modes have a small k, contacts would open and
    close for ever.
    """
    left = overlap
    if push > 0.0:
        rest = max(-most, min((1.0 - SHARE) * standing, most))
        left = rest if standing < 0.0 else max(overlap, rest)
    return left


@kernel
def aim_hulls(meet, hulls, contact, rigid, touches, which, number, h):
    """Lines and wishes of the touches between hulls, from the corners where they are.

    Two bodies push each other midway between the points of theirs that touch: with equal and opposite impulses at one point
    angular momentum is kept, whatever they overlap by. The deepest of a pair's contacts, which stand side by side, is its
    overlap: so contacts are aimed the same again, however often.
    """
    if meet is None or rigid is None:
        return
    corner, weight, normal = meet.meetings.corner, meet.meetings.weight, meet.meetings.normal
    one, pair, rounding = meet.pairs.first, meet.meetings.pair, hulls.rounding
    other, body, particle, start = meet.pairs.second, hulls.body, hulls.particle, hulls.start
    x, y, z = hulls.corner[0], hulls.corner[1], hulls.corner[2]
    first, second, source, line, answer = touches.first, touches.second, touches.source, touches.line, touches.answer
    mass, step, moved, kick, reach = rigid.mass, rigid.step, rigid.moved, rigid.kick, rigid.reach
    overlap, met, recalled = meet.pairs.overlap, meet.pairs.met, touches.recalled
    world, last, left = reach.size - 1, -1, 0.0
    for t in range(touches.until[which - 1], touches.until[which]):
        m, a, b = source[t], first[t], second[t]
        g, q = one[pair[m]], other[pair[m]]
        px, py, pz = point_of(x, y, z, corner, weight, m, 0)
        qx, qy, qz = point_of(x, y, z, corner, weight, m, 3)
        nx, ny, nz = normal[0, m], normal[1, m], normal[2, m]
        gap = nx * (px - qx) + ny * (py - qy) + nz * (pz - qz) - rounding[g] - rounding[q]
        if body[g] < 0 and particle[start[g]] < 0:      # the collider was the first hull
            px, py, pz, qx, qy, qz, nx, ny, nz, q = qx, qy, qz, px, py, pz, -nx, -ny, -nz, g
        if b != world and reach[a] > 0.0 and reach[b] > 0.0:     # what one gains in angular momentum the other loses
            px, py, pz = 0.5 * (px + qx), 0.5 * (py + qy), 0.5 * (pz + qz)
            qx, qy, qz = px, py, pz
        px, py, pz = px - mass[a, 1], py - mass[a, 2], pz - mass[a, 3]
        sx, sy, sz = shift_of(step, moved, kick, a, px, py, pz)
        if b == world:
            tx, ty, tz = carried_by(contact, hulls.solid[q], qx, qy, qz)
            size = reach[a]
            qx = qy = qz = 0.0
        else:
            qx, qy, qz = qx - mass[b, 1], qy - mass[b, 2], qz - mass[b, 3]
            tx, ty, tz = shift_of(step, moved, kick, b, qx, qy, qz)
            size = min(reach[a], reach[b]) if min(reach[a], reach[b]) > 0.0 else max(reach[a], reach[b])
        sx, sy, sz = sx - tx, sy - ty, sz - tz
        line[t, 0], line[t, 1], line[t, 2] = nx, ny, nz
        line[t, 3], line[t, 4], line[t, 5] = px, py, pz
        line[t, 6], line[t, 7], line[t, 8] = qx, qy, qz
        line[t, 9], line[t, 10], line[t, 11] = sx, sy, sz
        p = pair[m]
        if p != last:
            last, left = p, still_given(overlap[p], met[p], number, RECOVERY * size * h)
            overlap[p], met[p] = 0.0, number
        standing = 0.0 if answer[t, 4] > 0.0 else nx * sx + ny * sy + nz * sz - gap
        own = min(left, max(0.0, standing))
        answer[t, 0] = -gap - left_for_later(standing, own, recalled[t, 0], SMALL * size)
        overlap[p] = max(overlap[p], own)


@inlined
def point_of(x, y, z, corner, weight, m, side):
    """The point of meeting m on the first (side 0) or second (3) hull."""
    i, j, k = corner[side, m], corner[side + 1, m], corner[side + 2, m]
    a, b, c = weight[side, m], weight[side + 1, m], weight[side + 2, m]
    return a * x[i] + b * x[j] + c * x[k], a * y[i] + b * y[j] + c * y[k], a * z[i] + b * z[j] + c * z[k]


@inlined
def shift_of(step, moved, kick, e, rx, ry, rz):
    """Displacement of entity e at the arm r since the start of the substep, what its velocity was given included."""
    ox, oy, oz = (step[e, 3] + moved[e, 3] + kick[e, 3], step[e, 4] + moved[e, 4] + kick[e, 4],
                  step[e, 5] + moved[e, 5] + kick[e, 5])
    return (step[e, 0] + moved[e, 0] + kick[e, 0] + (oy * rz - oz * ry),
            step[e, 1] + moved[e, 1] + kick[e, 1] + (oz * rx - ox * rz),
            step[e, 2] + moved[e, 2] + kick[e, 2] + (ox * ry - oy * rx))


@kernel
def carried_by(contact, solid, x, y, z):
    """Displacement [m] of the point of a collider that is at (x, y, z) now, in this substep."""
    if contact is None:
        return 0.0, 0.0, 0.0
    solids = contact.solids
    origin, rotation, earlier, turned = solids.origin, solids.rotation, solids.origin_before, solids.rotation_before
    px, py, pz = inward(x, y, z, pose_of(origin, rotation, solid))
    pose = pose_of(earlier, turned, solid)
    px, py, pz = outward(px, py, pz, pose)
    return x - (px + pose[0]), y - (py + pose[1]), z - (pz + pose[2])


@kernel
def respond(friction, rigid, touches):
    """How far the two entities of every touch give way to a unit impulse along its line, and across it."""
    if rigid is None:
        return
    first, second, line, answer, mass = touches.first, touches.second, touches.line, touches.answer, rigid.mass
    for t in range(touches.until[-1]):
        a, b = first[t], second[t]
        n, r, q = (line[t, 0], line[t, 1], line[t, 2]), (line[t, 3], line[t, 4], line[t, 5]), (line[t, 6], line[t, 7], line[t, 8])
        one = (mass[a, 0], mass[a, 4], mass[a, 5], mass[a, 6], mass[a, 7], mass[a, 8], mass[a, 9])
        other = (mass[b, 0], mass[b, 4], mass[b, 5], mass[b, 6], mass[b, 7], mass[b, 8], mass[b, 9])
        along = response(r, n, n, one) + response(q, n, n, other)
        answer[t, 1] = 1.0 / along if along > 0.0 else 0.0
        respond_across(friction, line, answer, t, n, r, q, one, other)


@kernel
def respond_across(friction, line, answer, t, n, r, q, one, other):
    """Two directions across the line of touch t, and the inverse of the matrix of responses to impulses along them."""
    if friction is None:
        return
    u, v = across(*n)
    uu = response(r, u, u, one) + response(q, u, u, other)
    uv = response(r, u, v, one) + response(q, u, v, other)
    vv = response(r, v, v, one) + response(q, v, v, other)
    determinant = uu * vv - uv * uv
    s = 1.0 / determinant if determinant > 0.0 else 0.0
    for e in range(3):
        line[t, 12 + e], line[t, 15 + e] = u[e], v[e]
    answer[t, 5], answer[t, 6], answer[t, 7] = vv * s, -uv * s, uu * s
