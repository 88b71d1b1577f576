"""Rigid bodies answer to contacts as a whole, without orientation matrices: everything comes from their particles.

Moving only the particles that touch cannot hold a heap: relaxation gives most of the push back, and a body neither rests
nor bounces nor sticks as its mass would. So the touches of an island are solved on one twist (translation and rotation)
of each entity, by projected Gauss-Seidel with Coulomb's cone, and relaxation then has little left to do. A touch pushes
by an impulse [kg m]: force times the step squared; its slide is the displacement of the first against the second entity
since the start of the substep.
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.effects.contact import pose_of
from verlet_numba.effects.touch import COLLIDERS
from verlet_numba.kernels.islands import sort_islands
from verlet_numba.physics.pose import inward, outward, rotation
from verlet_numba.physics.rigid import across, cross, response, times_symmetric

SWEEPS = 48                 # over an island, at most
FEW_SWEEPS = 4              # over an island of more touches than
FEW_TOUCHES = 128           # these: what they leave, the next substep takes up
SETTLED = 1e-7              # of the largest impulse: a sweep that changes less is the last
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
    overlap, met, kick, recalled = contact.overlap, contact.met, rigid.kick, touches.recalled
    for t in range(touches.until[COLLIDERS]):
        c, e = source[t], first[t]
        k = particle[c]
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
        overlap[k] = still_given(overlap[k], met[k], number, max(0.0, standing), RECOVERY * reach[e] * h)
        met[k] = number
        answer[t, 0] = -gap - left_for_later(standing, overlap[k], recalled[t, 0], SMALL * reach[e])


@inlined
def still_given(overlap, met, number, standing, rate):
    """What an overlap that two had when they met may still be, having shrunk by `rate` [m] a substep: 0 for all that met apart."""
    left = standing
    if met >= number - 1:
        left = min(max(0.0, overlap - rate if met < number else overlap), standing)
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
    angular momentum is kept, whatever they overlap by.
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
    world = reach.size - 1
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
        standing = 0.0 if answer[t, 4] > 0.0 else nx * sx + ny * sy + nz * sz - gap
        overlap[p] = still_given(overlap[p], met[p], number, max(0.0, standing), RECOVERY * size * h)
        met[p] = number
        answer[t, 0] = -gap - left_for_later(standing, overlap[p], recalled[t, 0], SMALL * size)


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


@inlined
def relative(twist, a, b, line, t):
    """Displacement of entity a against b at the arms of touch t by their twists."""
    ax, ay, az, bx, by, bz = line[t, 3], line[t, 4], line[t, 5], line[t, 6], line[t, 7], line[t, 8]
    return ((twist[a, 0] + twist[a, 4] * az - twist[a, 5] * ay) - (twist[b, 0] + twist[b, 4] * bz - twist[b, 5] * by),
            (twist[a, 1] + twist[a, 5] * ax - twist[a, 3] * az) - (twist[b, 1] + twist[b, 5] * bx - twist[b, 3] * bz),
            (twist[a, 2] + twist[a, 3] * ay - twist[a, 4] * ax) - (twist[b, 2] + twist[b, 3] * by - twist[b, 4] * bx))


@inlined
def strike(twist, mass, e, rx, ry, rz, jx, jy, jz):
    """Give entity e the impulse j at the arm r."""
    w = mass[e, 0]
    twist[e, 0] += w * jx
    twist[e, 1] += w * jy
    twist[e, 2] += w * jz
    tx, ty, tz = cross(rx, ry, rz, jx, jy, jz)
    ox, oy, oz = times_symmetric(mass[e, 4], mass[e, 5], mass[e, 6], mass[e, 7], mass[e, 8], mass[e, 9], tx, ty, tz)
    twist[e, 3] += ox
    twist[e, 4] += oy
    twist[e, 5] += oz


@kernel
def link(rigid, touches):
    """Sort the touches by island; nothing has been given yet."""
    if rigid is None:
        return
    touches.islands[0] = sort_islands(touches.first, touches.second, touches.until[-1], rigid.mass, rigid.parent,
                                      touches.label, touches.order, touches.island)


@kernel
def recall_colliders(contact, rigid, touches, number):
    """What pushed in the last substep pushes now, to begin with: touches with colliders."""
    if rigid is None:
        return
    touches.given[:touches.until[-1]] = 0.0
    if contact is None:
        return
    particle, solid, kept, grip, keeper, met = (contact.particle, contact.solid, contact.kept, contact.grip, contact.keeper,
                                                contact.met)
    source, recalled = touches.source, touches.recalled
    for t in range(touches.until[COLLIDERS]):
        k = particle[source[t]]
        share = 1.0 if keeper[k] == solid[source[t]] and met[k] >= number - 1 else 0.0
        recalled[t, 0] = share * kept[k]
        for axis in range(3):
            recalled[t, 1 + axis] = share * grip[axis, k]


@kernel
def recall_hulls(meet, rigid, touches, which, number):
    """The same between hulls: a pair's contacts stand side by side; where their number has changed they share what it was."""
    if meet is None or rigid is None:
        return
    pair, source, recalled = meet.meetings.pair, touches.source, touches.recalled
    points, learnt, met = meet.pairs.points, meet.pairs.given, meet.pairs.met
    begin, end = touches.until[which - 1], touches.until[which]
    while begin < end:
        p, last = pair[source[begin]], begin + 1
        while last < end and pair[source[last]] == p:
            last += 1
        known = points[p] if met[p] >= number - 1 else 0
        for column in range(4):
            whole = 0.0
            for k in range(known):
                whole += learnt[p, 4 * k + column]
            for t in range(begin, last):
                recalled[t, column] = learnt[p, 4 * (t - begin) + column] if known == last - begin else whole / (last - begin)
        begin = last


@inlined
def gripping(given, line, t):
    """The impulse across of touch t, on its first entity."""
    f, g = given[t, 1], given[t, 2]
    return f * line[t, 12] + g * line[t, 15], f * line[t, 13] + g * line[t, 16], f * line[t, 14] + g * line[t, 17]


@kernel
def keep_colliders(contact, rigid, touches):
    """What the touches with colliders pushed in this substep is where the next begins."""
    if contact is None or rigid is None:
        return
    particle, solid, kept, keeper, given, source = (contact.particle, contact.solid, contact.kept, contact.keeper, touches.given,
                                                    touches.source)
    push, w, grip, line = contact.push, rigid.mass, contact.grip, touches.line
    for t in range(touches.until[COLLIDERS]):
        k = particle[source[t]]
        kept[k] = grip[0, k] = grip[1, k] = grip[2, k] = 0.0
    for t in range(touches.until[COLLIDERS]):
        c, k = source[t], particle[source[t]]
        if given[t, 0] > kept[k]:
            kept[k], keeper[k] = given[t, 0], solid[c]
            grip[0, k], grip[1, k], grip[2, k] = gripping(given, line, t)
        push[c] = given[t, 0] * w[touches.first[t], 0]


@kernel
def keep_hulls(meet, rigid, touches, which):
    """The same between hulls, pair by pair."""
    if meet is None or rigid is None:
        return
    pair, source, given, push = meet.meetings.pair, touches.source, touches.given, meet.pairs.push
    points, learnt, line = meet.pairs.points, meet.pairs.given, touches.line
    for t in range(touches.until[which - 1], touches.until[which]):
        p = pair[source[t]]
        push[p], points[p] = 0.0, 0
    for t in range(touches.until[which - 1], touches.until[which]):
        p = pair[source[t]]
        k = 4 * points[p]
        push[p] += given[t, 0]
        points[p] += 1
        learnt[p, k] = given[t, 0]
        learnt[p, k + 1], learnt[p, k + 2], learnt[p, k + 3] = gripping(given, line, t)


@kernel
def begin_pass(again, friction, rigid, touches):
    """Nothing has been given in this pass, but what the first one recalls."""
    if rigid is None:
        return
    for i in range(rigid.touched[0]):
        rigid.twist[rigid.order[i]] = 0.0
    if again:
        return
    first, second, line, given, twist, mass = touches.first, touches.second, touches.line, touches.given, rigid.twist, rigid.mass
    recalled = touches.recalled
    grip_again(friction, touches)
    for t in range(touches.until[-1]):
        j = given[t, 0] = recalled[t, 0]
        if j > 0.0:
            fx, fy, fz = gripping(given, line, t)
            jx, jy, jz = j * line[t, 0] + fx, j * line[t, 1] + fy, j * line[t, 2] + fz
            strike(twist, mass, first[t], line[t, 3], line[t, 4], line[t, 5], jx, jy, jz)
            strike(twist, mass, second[t], line[t, 6], line[t, 7], line[t, 8], -jx, -jy, -jz)


@kernel
def grip_again(friction, touches):
    """What gripped in the last substep grips now, as far as it is across the line still."""
    if friction is None:
        return
    line, given, recalled = touches.line, touches.given, touches.recalled
    for t in range(touches.until[-1]):
        x, y, z = recalled[t, 1], recalled[t, 2], recalled[t, 3]
        given[t, 1] = line[t, 12] * x + line[t, 13] * y + line[t, 14] * z
        given[t, 2] = line[t, 15] * x + line[t, 16] * y + line[t, 17] * z


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
def sweeps_of(touches):
    """Sweeps over an island of so many touches."""
    return SWEEPS if touches <= FEW_TOUCHES else FEW_SWEEPS


@kernel
def shove(friction, rigid, touches):
    """Solve the touches of every island: gaps are opened as wished, slides are taken back within the cone of friction."""
    if rigid is None:
        return
    first, second, order, island = touches.first, touches.second, touches.order, touches.island
    line, answer, given, twist, mass = touches.line, touches.answer, touches.given, rigid.twist, rigid.mass
    world = rigid.size.size - 1
    for i in range(touches.islands[0]):
        begin, end = island[i], island[i + 1]
        for sweep in range(sweeps_of(end - begin)):
            change = largest = 0.0
            for o in range(begin, end):
                t = order[o if sweep % 2 == 0 else begin + end - 1 - o]     # forth and back: no touch is always the last
                a, b = first[t], second[t]
                nx, ny, nz = line[t, 0], line[t, 1], line[t, 2]
                ux, uy, uz = relative(twist, a, b, line, t)
                push = max(0.0, given[t, 0] + (answer[t, 0] - (nx * ux + ny * uy + nz * uz)) * answer[t, 1])
                j = push - given[t, 0]
                if push == 0.0 and j == 0.0:            # apart, and it was: nothing to grip
                    continue
                given[t, 0] = push
                px, py, pz, qx, qy, qz = line[t, 12], line[t, 13], line[t, 14], line[t, 15], line[t, 16], line[t, 17]
                sx, sy, sz = line[t, 9] + ux, line[t, 10] + uy, line[t, 11] + uz
                f, g = grip(friction, given[t, 1], given[t, 2], px * sx + py * sy + pz * sz, qx * sx + qy * sy + qz * sz,
                            answer[t, 5], answer[t, 6], answer[t, 7], answer[t, 2] * push, answer[t, 3] * push)
                df, dg = f - given[t, 1], g - given[t, 2]
                given[t, 1], given[t, 2] = f, g
                jx, jy, jz = j * nx + df * px + dg * qx, j * ny + df * py + dg * qy, j * nz + df * pz + dg * qz
                if jx != 0.0 or jy != 0.0 or jz != 0.0:
                    strike(twist, mass, a, line[t, 3], line[t, 4], line[t, 5], jx, jy, jz)
                    if b != world:
                        strike(twist, mass, b, line[t, 6], line[t, 7], line[t, 8], -jx, -jy, -jz)
                    change = max(change, abs(jx), abs(jy), abs(jz))
                largest = max(largest, push)
            if change <= SETTLED * largest:
                break


@formula
def sliding(f, g, xx, xy, yy, r, length):
    """The impulse of size r that opposes the slide which it leaves; (f, g): the one that would leave none, of this length.

    With the responses K, its inverse A = (xx, xy, yy) and f0 = (f, g), the impulse p leaves the slide K (p - f0). That is
    -a p where (1 + a A) p = f0, and a > 0 follows from |p| = r: 1/|p| is all but linear in a (More & Sorensen 1983).
    p = P / D with P = f0 + a c, c the adjugate of A times f0, and D = det(1 + a A): one division and one root a step of Newton's
        a <- a - L^2 (D - L / r) / (D' L^2 - D P . c), L = |P|, from a = 0.
    """
    if r == 0.0:
        return 0.0, 0.0
    trace, determinant, one = xx + yy, xx * yy - xy * xy, 1.0 / r
    cx, cy = yy * f - xy * g, xx * g - xy * f
    a, p, q, size = 0.0, f, g, length
    for _ in range(3):
        d, slope, squared = 1.0 + a * (trace + a * determinant), trace + 2.0 * a * determinant, size * size
        a -= squared * (d - size * one) / (slope * squared - d * (p * cx + q * cy))
        p, q = f + a * cx, g + a * cy
        size = math.sqrt(p * p + q * q)
    share = r / size
    return share * p, share * q


@formula
def grip(friction, f, g, p, q, uu, uv, vv, static, dynamic):
    """The impulse across in two directions, (f, g) so far, that takes back the slide (p, q) as far as friction holds.

    uu, uv, vv: inverse of the responses across; static, dynamic: as much as friction can hold. All of the slide is taken
    back within the static cone; else as much as dynamic friction has, against the slide that remains.
    """
    if friction is None:
        return 0.0, 0.0
    x, y = f - (uu * p + uv * q), g - (uv * p + vv * q)
    length = math.sqrt(x * x + y * y)
    if length > static:
        x, y = sliding(x, y, uu, uv, vv, min(dynamic, length), length)
    return x, y


@kernel
def displace(position, inverse_mass, rigid):
    """Move the particles of every touched entity by its twist, turning it about its centre exactly."""
    if rigid is None:
        return
    x, y, z = position[0], position[1], position[2]
    first, stride, size, parent = rigid.first, rigid.stride, rigid.size, rigid.parent
    twist, moved, mass = rigid.twist, rigid.moved, rigid.mass
    for e in range(parent.size):
        if parent[e] < 0:
            continue
        px, py, pz, ox, oy, oz = twist[e, 0], twist[e, 1], twist[e, 2], twist[e, 3], twist[e, 4], twist[e, 5]
        if px == py == pz == ox == oy == oz == 0.0:
            continue
        cx, cy, cz = mass[e, 1], mass[e, 2], mass[e, 3]
        xx, xy, xz, yx, yy, yz, zx, zy, zz = rotation(ox, oy, oz)
        for k in range(first[e], first[e] + size[e] * stride[e], stride[e]):
            if inverse_mass[k] > 0:
                rx, ry, rz = x[k] - cx, y[k] - cy, z[k] - cz
                x[k] = cx + px + (xx * rx + xy * ry + xz * rz)
                y[k] = cy + py + (yx * rx + yy * ry + yz * rz)
                z[k] = cz + pz + (zx * rx + zy * ry + zz * rz)
        mass[e, 1], mass[e, 2], mass[e, 3] = cx + px, cy + py, cz + pz
        for column in range(6):
            moved[e, column] += twist[e, column]


@kernel
def rebound(friction, rigid, touches):
    """Velocities after the passes: an impact leaves as it should, what was pushed out of an overlap does not fly off.

    Impulses that change the velocity alone. They open a gap where a rebound is due, with friction for that push too; and
    where two separate only because they were pushed apart, they take that speed away, never more than the push gave.
    """
    if rigid is None:
        return
    first, second, order, island = touches.first, touches.second, touches.order, touches.island
    line, answer, given, kick, mass = touches.line, touches.answer, touches.given, rigid.kick, rigid.mass
    for t in range(touches.until[-1]):                  # the last pass has moved them since; what was kicked before stands in both
        ux, uy, uz = relative(rigid.twist, first[t], second[t], line, t)
        vx, vy, vz = relative(kick, first[t], second[t], line, t)
        line[t, 9], line[t, 10], line[t, 11] = line[t, 9] + ux - vx, line[t, 10] + uy - vy, line[t, 11] + uz - vz
    for i in range(touches.islands[0]):
        begin, end = island[i], island[i + 1]
        for sweep in range(SWEEPS if end - begin <= FEW_TOUCHES else 1):
            change = largest = 0.0
            for o in range(begin, end):
                t = order[o if sweep % 2 == 0 else begin + end - 1 - o]
                if given[t, 0] == 0.0:
                    continue
                a, b = first[t], second[t]
                nx, ny, nz = line[t, 0], line[t, 1], line[t, 2]
                ux, uy, uz = relative(kick, a, b, line, t)
                sx, sy, sz = line[t, 9] + ux, line[t, 10] + uy, line[t, 11] + uz
                leaving = nx * sx + ny * sy + nz * sz
                most = math.inf if answer[t, 4] > 0.0 else 0.0
                total = min(most, max(-given[t, 0], given[t, 3] + (answer[t, 4] - leaving) * answer[t, 1]))
                j = total - given[t, 3]
                given[t, 3] = total
                jx, jy, jz = j * nx, j * ny, j * nz
                if total > 0.0:
                    push = given[t, 0] + total
                    px, py, pz, qx, qy, qz = line[t, 12], line[t, 13], line[t, 14], line[t, 15], line[t, 16], line[t, 17]
                    f, g = grip(friction, given[t, 1], given[t, 2], px * sx + py * sy + pz * sz, qx * sx + qy * sy + qz * sz,
                                answer[t, 5], answer[t, 6], answer[t, 7], answer[t, 2] * push, answer[t, 3] * push)
                    df, dg = f - given[t, 1], g - given[t, 2]
                    given[t, 1], given[t, 2] = f, g
                    jx, jy, jz = jx + df * px + dg * qx, jy + df * py + dg * qy, jz + df * pz + dg * qz
                if jx != 0.0 or jy != 0.0 or jz != 0.0:
                    strike(kick, mass, a, line[t, 3], line[t, 4], line[t, 5], jx, jy, jz)
                    strike(kick, mass, b, line[t, 6], line[t, 7], line[t, 8], -jx, -jy, -jz)
                change, largest = max(change, abs(j)), max(largest, given[t, 0])
            if change <= SETTLED * largest:
                break


@kernel
def kick_back(position, previous, inverse_mass, rigid):
    """Move the previous positions of entities against what their velocity was given."""
    if rigid is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    first, stride, size, parent, kick, mass = rigid.first, rigid.stride, rigid.size, rigid.parent, rigid.kick, rigid.mass
    for e in range(parent.size):
        if parent[e] < 0:
            continue
        px, py, pz, ox, oy, oz = kick[e, 0], kick[e, 1], kick[e, 2], kick[e, 3], kick[e, 4], kick[e, 5]
        if px == py == pz == ox == oy == oz == 0.0:
            continue
        for k in range(first[e], first[e] + size[e] * stride[e], stride[e]):
            if inverse_mass[k] > 0:
                dx, dy, dz = cross(ox, oy, oz, x[k] - mass[e, 1], y[k] - mass[e, 2], z[k] - mass[e, 3])
                u[k], v[k], w[k] = u[k] - (px + dx), v[k] - (py + dy), w[k] - (pz + dz)
