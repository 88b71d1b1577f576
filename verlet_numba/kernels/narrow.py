"""Narrow phase: which pairs of hulls touch, where and how deep (paper, 5.1 and 6.1).

A pair that is apart has its axis tested; one that met has its hit face tested: while that is still a face of the hulls'
difference and the origin still projects into it, it is the contact, and neither GJK nor the search for a hit face is needed.
A lost face and the vertex opposite to it are where the next search begins.
"""


import numpy as np

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.gjk import APART, MET, gjk
from verlet_numba.kernels.hit_face import SOLID, hit_face, remember
from verlet_numba.kernels.meeting import holds, write
from verlet_numba.kernels.support import support
from verlet_numba.physics.simplex import areas, cross, dot, segment, triangle

ROUNDING = 1e-14        # of a hull's reach and its centre's coordinates: differences of heights that mean nothing
TOUCHING = 1e4          # such differences: a distance that gives no normal

KEPT, AWAY, LOST, ELSEWHERE = 0, 1, 2, 3        # what became of what a pair learnt


@kernel
def gather_hulls(position, hulls):
    """Corners and centres from the particles' positions; a collider's corners stay. The reach follows the corners."""
    px, py, pz = position[0], position[1], position[2]
    x, y, z, particle = hulls.corner[0], hulls.corner[1], hulls.corner[2], hulls.particle
    start, size, centre, reach, rounding = hulls.start, hulls.size, hulls.centre, hulls.reach, hulls.rounding
    for h in range(size.size):
        first = start[h]
        cx = cy = cz = 0.0
        for k in range(first, start[h + 1]):
            p = particle[k]
            if p >= 0:
                x[k], y[k], z[k] = px[p], py[p], pz[p]
        for k in range(first, first + size[h]):
            cx, cy, cz = cx + x[k], cy + y[k], cz + z[k]
        cx, cy, cz = cx / size[h], cy / size[h], cz / size[h]
        farthest = 0.0
        for k in range(first, first + size[h]):
            dx, dy, dz = x[k] - cx, y[k] - cy, z[k] - cz
            farthest = max(farthest, dx * dx + dy * dy + dz * dz)
        centre[0, h], centre[1, h], centre[2, h], reach[h] = cx, cy, cz, np.sqrt(farthest) + rounding[h]

@formula
def feature(points, a, b, c, d, e, f):
    """The face, edge or vertex of the difference with the vertices a - d, b - e, c - f, the last repeated where there are fewer.

    Returns its unit normal (of an edge or a vertex: towards the origin), the distance along it, and the weights of the origin's
    projection; some may be negative. What has no normal has 0, and weights that are none.
    """
    px, py, pz, qx, qy, qz = (points[0, a] - points[0, d], points[1, a] - points[1, d], points[2, a] - points[2, d],
                              points[0, b] - points[0, e], points[1, b] - points[1, e], points[2, b] - points[2, e])
    if b == c and e == f:
        u, v = segment(px, py, pz, qx, qy, qz)
        px, py, pz = u * px + v * qx, u * py + v * qy, u * pz + v * qz
        length, w, whole = np.sqrt(dot(px, py, pz, px, py, pz)), 0.0, 1.0
        nx, ny, nz = -px, -py, -pz
    else:
        u, v, w, nx, ny, nz = areas(px, py, pz, qx, qy, qz,
                                    points[0, c] - points[0, f], points[1, c] - points[1, f], points[2, c] - points[2, f])
        whole = dot(nx, ny, nz, nx, ny, nz)
        length = np.sqrt(whole)
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0, -1.0, -1.0, -1.0
    nx, ny, nz = nx / length, ny / length, nz / length
    return nx, ny, nz, dot(nx, ny, nz, px, py, pz), u / whole, v / whole, w / whole


@formula
def oriented(vertex, label, weight, n):
    """The simplex that is nearest the origin as a feature, of whose sides the outer one is that towards the origin."""
    q, r = (0, 0) if n == 1 else (1, n - 1)
    if n == 3:
        px, py, pz = vertex[0, 0], vertex[1, 0], vertex[2, 0]
        nx, ny, nz = cross(vertex[0, 1] - px, vertex[1, 1] - py, vertex[2, 1] - pz,
                           vertex[0, 2] - px, vertex[1, 2] - py, vertex[2, 2] - pz)
        if dot(nx, ny, nz, px, py, pz) > 0.0:
            q, r = 2, 1
    w = weight[r] if n == 3 else 0.0
    v = weight[q] if n > 1 else 0.0
    return label[0, 0], label[0, q], label[0, r], label[1, 0], label[1, q], label[1, r], weight[0], v, w


@formula
def clamped(vertex, p, q, r, nx, ny, nz):
    """The distance along n of the point nearest the origin on the triangle of these vertices, and its weights."""
    ax, ay, az, bx, by, bz, cx, cy, cz = (vertex[0, p], vertex[1, p], vertex[2, p], vertex[0, q], vertex[1, q], vertex[2, q],
                                          vertex[0, r], vertex[1, r], vertex[2, r])
    u, v, w = triangle(ax, ay, az, bx, by, bz, cx, cy, cz)
    return dot(nx, ny, nz, u * ax + v * bx + w * cx, u * ay + v * by + w * cy, u * az + v * bz + w * cz), u, v, w


@kernel
def met(points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, n,
        vertex, label, weight, corner, across, plane, visible, horizon, stack):
    """The hit face from a simplex of n vertices: whether it is a face, its six columns, and as `feature`, its weights holding."""
    kind, nx, ny, nz, p, q, r = hit_face(points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, n,
                                         vertex, label, weight, corner, across, plane, visible, horizon, stack)
    a, b, c, d, e, f = label[0, p], label[0, q], label[0, r], label[1, p], label[1, q], label[1, r]
    if kind == SOLID:
        nx, ny, nz, distance, u, v, w = feature(points, a, b, c, d, e, f)
        if holds(a, b, c, d, e, f, u, v, w):
            return True, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w
    distance, u, v, w = clamped(vertex, p, q, r, nx, ny, nz)
    return kind == SOLID, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w


@inlined
def recall(points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, bound, face, i, vertex, label):
    """What pair i learnt: what became of it, its six columns, and as `feature`.

    KEPT: it is the contact. AWAY: its normal separates the hulls by more than `bound` [m]. LOST: a face that is no longer the
    nearest; it and the vertex opposite to it are now the first four vertices. ELSEWHERE: the hulls may be apart, and its normal is
    where to begin.
    """
    a, b, c = sa + face[0, i], sa + face[1, i], sa + face[2, i]
    d, e, f = sb + face[3, i], sb + face[4, i], sb + face[5, i]
    nx, ny, nz, distance, u, v, w = feature(points, a, b, c, d, e, f)
    p = support(points, sa, na, ra, neighbours, neighbour, seen, a, nx, ny, nz)
    q = support(points, sb, nb, rb, neighbours, neighbour, seen, d, -nx, -ny, -nz)
    far = dot(nx, ny, nz, points[0, p] - points[0, q], points[1, p] - points[1, q], points[2, p] - points[2, q])
    edge = b == c and e == f
    state = ELSEWHERE
    if far < -bound:
        state = AWAY
    elif far - distance <= noise and holds(a, b, c, d, e, f, u, v, w) and not (edge and distance >= -TOUCHING * noise):
        state = KEPT
    elif far > 0.0 and not edge:
        state = LOST
        remember(points, vertex, label, 0, a, d)
        remember(points, vertex, label, 1, b, e)
        remember(points, vertex, label, 2, c, f)
        remember(points, vertex, label, 3, support(points, sa, na, ra, neighbours, neighbour, seen, a, -nx, -ny, -nz),
                 support(points, sb, nb, rb, neighbours, neighbour, seen, d, nx, ny, nz))
    return state, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w


@formula
def learn(axis, face, i, solid, sa, sb, a, b, c, d, e, f, nx, ny, nz):
    """Pair i keeps a contact's normal and, unless the hulls' difference has no volume, its feature."""
    axis[0, i], axis[1, i], axis[2, i], face[0, i] = -nx, -ny, -nz, -1
    if solid:
        face[0, i], face[1, i], face[2, i] = a - sa, b - sa, c - sa
        face[3, i], face[4, i], face[5, i] = d - sb, e - sb, f - sb


@kernel
def collide(hulls, pairs, meetings, narrow, margin, coherent, quiet=None):
    """Contacts of all pairs whose gap is at most `margin` [m], one a pair, in the order of the pairs.

    coherent: None: every pair is met for the first time, and learns nothing. quiet (H,): two hulls that both are do not meet;
    None: none is. There must be room for as many meetings as there are pairs, or False is returned before any have met: pairs
    learn by meeting, and what they find when they meet again may differ in rounding.
    """
    if pairs.listed[0] > meetings.gap.size:
        meetings.listed[0] = NO_ROOM
        return False
    meetings.listed[0] = collide_some(
        hulls.corner, hulls.centre, hulls.reach, hulls.rounding, hulls.start, hulls.size, hulls.graph, hulls.neighbours,
        hulls.neighbour, narrow.seen, narrow.vertex, narrow.label, narrow.weight, narrow.corner, narrow.across, narrow.plane,
        narrow.visible, narrow.horizon, narrow.stack, pairs.first, pairs.second, pairs.axis, pairs.face, meetings.pair,
        meetings.corner, meetings.weight, meetings.normal, meetings.gap, margin, coherent, quiet, 0, pairs.listed[0], 0)
    return True


@kernel
def collide_some(points, centre, reach, rounding, start, size, graph, neighbours, neighbour, seen, vertex, label, weight, corner,
                 across, plane, visible, horizon, stack, first, second, axis, face, pair, columns, shares, normal, gap, margin,
                 coherent, quiet, begin, end, listed):
    """Write the contacts of the pairs from `begin` to `end` as meetings from number `listed` on; returns the next number."""
    for i in range(begin, end):
        g, h = first[i], second[i]
        if quiet is not None and quiet[g] and quiet[h]:
            continue
        vx, vy, vz = centre[0, g] - centre[0, h], centre[1, g] - centre[1, h], centre[2, g] - centre[2, h]
        span = reach[g] + reach[h]
        if dot(vx, vy, vz, vx, vy, vz) > (span + margin) * (span + margin):
            continue
        sa, na, ra, sb, nb, rb = start[g], size[g], graph[g], start[h], size[h], graph[h]
        both = rounding[g] + rounding[h]
        bound = margin + both
        noise = ROUNDING * (span + abs(centre[0, g]) + abs(centre[1, g]) + abs(centre[2, g])
                            + abs(centre[0, h]) + abs(centre[1, h]) + abs(centre[2, h]))
        found = False
        a = b = c = d = e = f = 0
        nx = ny = nz = distance = u = v = w = 0.0
        if coherent is not None:
            if face[0, i] >= 0:
                state, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w = recall(
                    points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, bound, face, i, vertex, label)
                if state == AWAY:
                    continue
                found = state == KEPT
                if state == LOST:
                    solid, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w = met(
                        points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, 4,
                        vertex, label, weight, corner, across, plane, visible, horizon, stack)
                    found = solid and distance >= 0.0
                    if found:
                        learn(axis, face, i, True, sa, sb, a, b, c, d, e, f, nx, ny, nz)
                vx, vy, vz = -nx, -ny, -nz
            elif axis[0, i] != 0.0 or axis[1, i] != 0.0 or axis[2, i] != 0.0:
                vx, vy, vz = axis[0, i], axis[1, i], axis[2, i]
        if not found:
            status, n, vx, vy, vz = gjk(points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, vx, vy, vz, bound,
                                        vertex, label, weight)
            length = np.sqrt(dot(vx, vy, vz, vx, vy, vz))
            if status == APART or length > bound:
                if coherent is not None:
                    learn(axis, face, i, False, sa, sb, 0, 0, 0, 0, 0, 0, -vx / length, -vy / length, -vz / length)
                continue
            solid = True
            if status == MET or length <= TOUCHING * noise:
                solid, a, b, c, d, e, f, nx, ny, nz, distance, u, v, w = met(
                    points, neighbours, neighbour, seen, sa, na, ra, sb, nb, rb, noise, n,
                    vertex, label, weight, corner, across, plane, visible, horizon, stack)
            else:
                a, b, c, d, e, f, u, v, w = oriented(vertex, label, weight, n)
                nx, ny, nz, distance = -vx / length, -vy / length, -vz / length, -length
            if coherent is not None:
                learn(axis, face, i, solid, sa, sb, a, b, c, d, e, f, nx, ny, nz)
        if -distance > bound:
            continue
        pair[listed] = i
        write(points, columns, shares, normal, gap, listed, a, b, c, d, e, f, u, v, w, -nx, -ny, -nz, -distance - both)
        listed += 1
    return listed
