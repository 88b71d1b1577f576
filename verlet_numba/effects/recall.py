"""What touches learn: each begins with the impulse that it ended the last substep with (warm start).

Of a push the amount is kept, of a grip the vector, since the directions across a line may turn.
"""

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.response import strike
from verlet_numba.effects.touch import COLLIDERS


@kernel
def recall_colliders(contact, rigid, touches, number):
    """What pushed in the last substep pushes now, to begin with: touches with colliders."""
    if rigid is None:
        return
    touches.given[:touches.until[-1]] = 0.0
    if contact is None:
        return
    particle, solid, memory, kept, grip, met = (contact.particle, contact.solid, contact.memory, contact.kept, contact.grip,
                                                contact.met)
    source, recalled = touches.source, touches.recalled
    for t in range(touches.until[COLLIDERS]):
        c = source[t]
        m = memory[c] = remembered(contact, particle[c], solid[c], number)
        share = 1.0 if met[m] >= number - 1 else 0.0
        recalled[t, 0] = share * kept[m]
        for axis in range(3):
            recalled[t, 1 + axis] = share * grip[axis, m]


@kernel
def remembered(contact, k, s, number):
    """Where particle k remembers collider s; one that it does not know takes the place of the one it met the longest ago."""
    keeper, met, oldest = contact.keeper, contact.met, k
    for m in range(k, keeper.size, contact.radius.size):
        if keeper[m] == s:
            return m
        if met[m] < met[oldest]:
            oldest = m
    keeper[oldest], met[oldest] = s, number - 2         # taken, but not met in the last substep
    return oldest


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
    recalled, world = touches.recalled, rigid.size.size - 1
    grip_again(friction, touches)
    for t in range(touches.until[-1]):
        j = given[t, 0] = recalled[t, 0]
        if j > 0.0:
            fx, fy, fz = gripping(given, line, t)
            jx, jy, jz = j * line[t, 0] + fx, j * line[t, 1] + fy, j * line[t, 2] + fz
            strike(twist, mass, first[t], line[t, 3], line[t, 4], line[t, 5], jx, jy, jz)
            if second[t] != world:
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
    memory, kept, grip, given, source = contact.memory, contact.kept, contact.grip, touches.given, touches.source
    push, w, line = contact.push, rigid.mass, touches.line
    for t in range(touches.until[COLLIDERS]):
        c, m = source[t], memory[source[t]]
        kept[m] = given[t, 0]
        grip[0, m], grip[1, m], grip[2, m] = gripping(given, line, t)
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
