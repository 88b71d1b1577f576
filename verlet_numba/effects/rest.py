"""Rest: rigid bodies that stay slow and are held up stop moving, and cost nothing until something comes near (P24).

An island is what hangs together by meetings of hulls: it rests, and wakes, as one. A body is slow as long as no particle of
it has got farther from where it was than the speed asked for would take it in the time asked for: so what trembles in place
is slow, and what creeps is not. An island is put to rest once all its bodies have been slow for that time, while one of them
is pushed by what nothing moves (a collider, a fixed body) or hangs by a pin. So nothing comes to rest in mid-air, where a
body may be slow for a moment, but nothing pushes it. A body that follows a path or is attached to another one never rests,
nor does a deformable one, nor what touches them.

A body at rest stays where it is to the last bit: its previous position is its position, and whatever integration and
relaxation do to it is undone. It meets neither colliders nor what is quiet itself. As soon as a hull that is awake is close
enough to meet it, or a collider that moves comes near, its island is awake again within that same substep, so nothing is ever
solved against a body at rest. What its contacts had learnt, how they pushed and the motion that was left are kept, and taken
for those of the substep before: it goes on, to rounding, as if it had never rested.

A second of 1,000 icosahedra on a floor, 480 substeps, takes 1.15 s awake and 0.055 s at rest, most of it for the frames.
"""

from verlet_numba._jit import formula, kernel
from verlet_numba.buffers.contact import FIXED, HUNG, RESTLESS
from verlet_numba.effects.contact import find_contacts
from verlet_numba.effects.meet import distance_of
from verlet_numba.effects.mesh_contact import find_mesh_contacts
from verlet_numba.kernels.copying import copy
from verlet_numba.kernels.islands import root_of
from verlet_numba.physics.verlet import verlet


@kernel
def at_rest(rest):
    """The number of bodies at rest."""
    if rest is None:
        return 0
    resting, count = rest.resting, 0
    for b in range(resting.size):
        count += resting[b]
    return count


@kernel
def depth_at_rest(rest):
    """How deep hulls at rest penetrate each other [m]; 0 if none does."""
    if rest is None:
        return 0.0
    island, depth, deepest = rest.island, rest.depth, 0.0
    for b in range(island.size):
        if rest.resting[b]:
            deepest = max(deepest, depth[island[b]])
    return deepest


@kernel
def idle(rest, moving):
    """Whether nothing is awake and nothing moves."""
    if rest is None or moving is not None:
        return False
    return rest.awake[0] == 0


@kernel
def find_at_colliders(position, previous, inverse_mass, contact, meshes, rest):
    """List the particles that touch colliders, of what is awake. False: no room (grow and call again)."""
    if rest is None:
        return (find_contacts(position, previous, inverse_mass, contact)
                and find_mesh_contacts(position, previous, inverse_mass, contact, meshes))
    return (find_contacts(position, previous, rest.free, contact)
            and find_mesh_contacts(position, previous, rest.free, contact, meshes))


@kernel
def hold(position, previous, inverse_mass, rest):
    """Bring what rests back to where it was."""
    if rest is None:
        return
    free = rest.free
    for axis in range(3):
        now, before = position[axis], previous[axis]
        for k in range(now.size):
            now[k] = before[k] if free[k] < inverse_mass[k] else now[k]


@kernel
def settle(position, previous, number, rest, contact, hulls, meet, points, mixed, touches, features):
    """Put to rest what has been slow for long enough and is held up, by what touched in the last substep."""
    if rest is None:
        return
    if count_slow(position, rest) == 0:
        return
    join(rest)
    back_by_colliders(rest, contact)
    meet_islands(rest, hulls, meet, features)
    meet_restless(rest, points, mixed)
    if lie_down(position, previous, number - 1, rest) == 0:
        return
    quieten(rest, hulls)
    keep_depth(position, number - 1, rest, hulls, meet)
    if rest.awake[0] == 0:
        clear_contacts(contact)
        clear_meetings(meet)
        clear_meetings(mixed)
        clear_touches(touches)


@kernel
def count_slow(position, rest):
    """Count the substeps for which each body has been slow; how many have been for long enough."""
    x, y, z, u, v, w = position[0], position[1], position[2], rest.anchor[0], rest.anchor[1], rest.anchor[2]
    kind, first, stride, size, resting, slow = rest.kind, rest.first, rest.stride, rest.size, rest.resting, rest.slow
    limit, wait, ripe = rest.drift * rest.drift, rest.wait, 0
    for b in range(kind.size):
        if resting[b] or kind[b] == RESTLESS or kind[b] == FIXED:
            continue
        begin, end, by, far = first[b], first[b] + size[b] * stride[b], stride[b], False
        for k in range(begin, end, by):
            dx, dy, dz = x[k] - u[k], y[k] - v[k], z[k] - w[k]
            if not dx * dx + dy * dy + dz * dz <= limit:
                far = True
                break
        if far:
            for k in range(begin, end, by):
                u[k], v[k], w[k] = x[k], y[k], z[k]
        slow[b] = 0 if far else slow[b] + 1
        ripe += slow[b] >= wait
    return ripe


@kernel
def join(rest):
    """Every body is an island of its own as yet; pins back it."""
    kind, parent, backed = rest.kind, rest.parent, rest.backed
    for b in range(kind.size):
        parent[b], backed[b] = b, kind[b] == HUNG


@kernel
def back_by_colliders(rest, contact):
    """Colliders back the bodies whose particles they push."""
    if contact is None:
        return
    particle, push, body, backed = contact.particle, contact.push, rest.body, rest.backed
    for c in range(contact.listed[0]):
        b = body[particle[c]]
        if b >= 0 and push[c] > 0.0:
            backed[b] = 1


@kernel
def meet_islands(rest, hulls, meet, features):
    """Bodies whose hulls meet are in one island; colliders' hulls and fixed bodies back those that they push."""
    if meet is None:
        return
    one, other, pair, body, particle, start = (meet.pairs.first, meet.pairs.second, meet.meetings.pair, hulls.body, hulls.particle,
                                               hulls.start)
    kind, parent, backed, slow = rest.kind, rest.parent, rest.backed, rest.slow
    push, by_pair = pushes(meet, features)
    for m in range(meet.meetings.listed[0]):
        p = pair[m]
        g, h = one[p], other[p]
        a, b = body[g], body[h]
        firm, against = a < 0 or kind[a] == FIXED, b < 0 or kind[b] == FIXED
        if firm and against:
            continue
        if not firm and not against:
            a, b = root_of(parent, a), root_of(parent, b)
            parent[max(a, b)] = min(a, b)
            continue
        b, h = (b, g) if firm else (a, h)
        if body[h] < 0 and particle[start[h]] >= 0:     # a particle by itself, which never rests
            slow[b] = 0
        elif push[p if by_pair else m] > 0.0:
            backed[b] = 1


@kernel
def meet_restless(rest, points, mixed):
    """Bodies that deformable ones touch are not slow."""
    if mixed is None:
        return
    hull, pair, body, slow = mixed.pairs.first, mixed.meetings.pair, points.body, rest.slow
    for m in range(mixed.meetings.listed[0]):
        slow[body[hull[pair[m]]]] = 0


@kernel
def pushes(meet, features):
    """How hulls pushed each other in the last substep, and whether by pair or by meeting."""
    if features is None:
        return meet.pairs.push, True
    return meet.meetings.push, False


@kernel
def lie_down(position, previous, number, rest):
    """Put islands to rest that are slow and backed; `number`: of the last substep. Returns how many bodies lay down."""
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    kind, first, stride, size, free, wait = rest.kind, rest.first, rest.stride, rest.size, rest.free, rest.wait
    resting, slow, since, island, depth = rest.resting, rest.slow, rest.since, rest.island, rest.depth
    ax, ay, az = rest.anchor[0], rest.anchor[1], rest.anchor[2]
    parent, backed, least = rest.parent, rest.backed, rest.least
    copy(slow, least, kind.size)
    for b in range(kind.size):
        r = root_of(parent, b)
        least[r], backed[r] = min(least[r], slow[b]), max(backed[r], backed[b])
    lain = 0
    for b in range(kind.size):
        r = root_of(parent, b)
        if resting[b] or kind[b] == FIXED or least[r] < wait or not backed[r]:
            continue
        resting[b], since[b], island[b], depth[b] = 1, number, r, 0.0
        for k in range(first[b], first[b] + size[b] * stride[b], stride[b]):
            ax[k], ay[k], az[k] = u[k], v[k], w[k]
            u[k], v[k], w[k], free[k] = x[k], y[k], z[k], 0.0
        lain += 1
    rest.awake[0] -= lain
    return lain


@kernel
def quieten(rest, hulls):
    """Hulls are quiet while their body rests."""
    if hulls is None:
        return
    body, kind, resting, quiet = hulls.body, rest.kind, rest.resting, rest.quiet
    for h in range(body.size):
        if body[h] >= 0:
            quiet[h] = resting[body[h]] or kind[body[h]] == FIXED


@kernel
def keep_depth(position, number, rest, hulls, meet):
    """Keep how deep the hulls of islands that have just lain down penetrate."""
    if meet is None:
        return
    x, y, z = position[0], position[1], position[2]
    corner, weight, normal, pair = meet.meetings.corner, meet.meetings.weight, meet.meetings.normal, meet.meetings.pair
    one, other, corners, particle, rounding = meet.pairs.first, meet.pairs.second, hulls.corner, hulls.particle, hulls.rounding
    body, resting, since, island, depth = hulls.body, rest.resting, rest.since, rest.island, rest.depth
    for m in range(meet.meetings.listed[0]):
        g, h = one[pair[m]], other[pair[m]]
        b = body[g] if body[g] >= 0 and resting[body[g]] else body[h]
        if b >= 0 and resting[b] and since[b] == number:
            distance = distance_of(x, y, z, corners, particle, corner, weight, normal, m)
            depth[island[b]] = max(depth[island[b]], rounding[g] + rounding[h] - distance)


@kernel
def clear_contacts(contact):
    """No particle touches a collider."""
    if contact is None:
        return
    contact.listed[0] = 0


@kernel
def clear_meetings(meet):
    """No hulls meet."""
    if meet is None:
        return
    meet.meetings.listed[0] = 0


@kernel
def clear_touches(touches):
    """No entities touch."""
    if touches is None:
        return
    touches.until[:] = 0


@kernel
def wake(position, acceleration, inverse_mass, number, h, rest, contact, hulls, meet, points, mixed, moving):
    """Wake the islands that something awake is near, and let them begin this substep. True: find what touches once more."""
    if rest is None:
        return False
    rest.roused[:] = 0
    rouse_by_colliders(position, rest, contact, moving)
    rouse_by_hulls(rest, hulls, meet)
    rouse_by_hulls(rest, points, mixed)
    resting, island, roused = rest.resting, rest.island, rest.roused
    woken = 0
    for b in range(resting.size):
        if resting[b] and roused[island[b]]:
            woken += 1
    if woken == 0:
        return False
    recollect_particles(number, rest, contact)
    recollect_pairs(number, rest, hulls, meet)
    for b in range(resting.size):
        if resting[b] and roused[island[b]]:
            resting[b] = rest.slow[b] = 0
            begin, by = rest.first[b], rest.stride[b]
            rise(position, acceleration, inverse_mass, rest.anchor, rest.free, begin, begin + by * rest.size[b], by, h)
    rest.awake[0] += woken
    quieten(rest, hulls)
    return True


@kernel
def rouse_by_colliders(position, rest, contact, moving):
    """Colliders that move now keep awake what is near them."""
    if moving is None or contact is None:
        return
    x, y, z, solids = position[0], position[1], position[2], contact.solids
    origin, far = solids.origin, solids.reach
    first, reach, resting, slow, island, roused = rest.first, rest.reach, rest.resting, rest.slow, rest.island, rest.roused
    for m in range(moving.collider.size):
        s = moving.collider[m]
        if stands(origin, solids.origin_before, solids.rotation, solids.rotation_before, s):
            continue
        for b in range(first.size):
            k = first[b]
            if near(x[k] - origin[0, s], y[k] - origin[1, s], z[k] - origin[2, s], far[s] + reach[b]):
                slow[b] = 0
                if resting[b]:
                    roused[island[b]] = 1


@kernel
def stands(origin, origin_before, rotation, rotation_before, s):
    """Whether collider s has not moved in this substep."""
    for axis in range(3):
        if origin[axis, s] != origin_before[axis, s]:
            return False
        for column in range(3):
            if rotation[axis, column, s] != rotation_before[axis, column, s]:
                return False
    return True


@formula
def near(x, y, z, reach):
    """Whether the vector (x, y, z) is shorter than the reach, which may be infinite [m]."""
    return x * x + y * y + z * z < reach * reach


@kernel
def rouse_by_hulls(rest, hulls, meet):
    """Hulls that are awake wake what they meet."""
    if meet is None:
        return
    one, other, pair, body = meet.pairs.first, meet.pairs.second, meet.meetings.pair, hulls.body
    resting, island, roused = rest.resting, rest.island, rest.roused
    for m in range(meet.meetings.listed[0]):
        for h in (one[pair[m]], other[pair[m]]):
            if body[h] >= 0 and resting[body[h]]:       # quiet hulls do not meet: the other one is awake
                roused[island[body[h]]] = 1


@kernel
def recollect_particles(number, rest, contact):
    """What a woken particle learnt when it touched colliders last is of the substep before this one."""
    if contact is None:
        return
    body, met, resting, since, island, roused = rest.body, contact.met, rest.resting, rest.since, rest.island, rest.roused
    for m in range(met.size):
        b = body[m % body.size]
        if b >= 0 and resting[b] and roused[island[b]] and met[m] == since[b]:
            met[m] = number - 1


@kernel
def recollect_pairs(number, rest, hulls, meet):
    """The same for pairs of hulls that rested with each other."""
    if meet is None:
        return
    one, other, met, body = meet.pairs.first, meet.pairs.second, meet.pairs.met, hulls.body
    resting, since, island, roused = rest.resting, rest.since, rest.island, rest.roused
    for p in range(meet.pairs.listed[0]):
        a, b = body[one[p]], body[other[p]]
        b = a if a >= 0 and resting[a] and roused[island[a]] else b
        if b >= 0 and resting[b] and roused[island[b]] and met[p] == since[b]:
            met[p] = number - 1


@kernel
def rise(position, acceleration, inverse_mass, before, free, begin, end, by, h):
    """The step that the particles of a woken body would have taken when it was put to rest; `before`: a substep earlier."""
    square, zero = position.dtype.type(h * h), position.dtype.type(0)
    for k in range(begin, end, by):
        free[k] = inverse_mass[k]
        for axis in range(3):
            here = position[axis, k]
            position[axis, k] = verlet(here, before[axis, k], pull(acceleration, axis, k, zero) * square)


@kernel
def pull(acceleration, axis, k, zero):
    """Acceleration of particle k [m/s^2]."""
    if acceleration is None:
        return zero
    return acceleration[axis, k]
