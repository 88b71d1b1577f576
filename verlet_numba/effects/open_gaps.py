"""Gaps of exact contact are opened: what has come nearer than its reach is moved apart, with friction, momentum kept.

Each point moves by its weight and inverse mass, a rigid body as a whole, by the impulse that opens the gap along its normal
(effects/exact.py). The part of it that only undoes overlap from before the substep makes no speed.
"""

import math

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.contact import separate
from verlet_numba.effects.exact import bring_now
from verlet_numba.effects.friction import coefficients
from verlet_numba.effects.touch import weigh_one
from verlet_numba.physics.friction import held
from verlet_numba.physics.rigid import cross, times_symmetric


@kernel
def part_exact(position, previous, inverse_mass, contact, exact):
    """Move features apart that have come nearer than their reach, after the relaxation: gap by gap, the last found first."""
    if exact is None:
        return
    points, gaps = exact.points, exact.gaps
    if gaps.listed[0] > 0:
        now = points.now
        bring_now(position, now)
        begin_wholes(exact.wholes)
        point, weight, normal, reach = gaps.point, gaps.weight, gaps.normal, gaps.reach
        for g in range(gaps.listed[0] - 1, -1, -1):
            a, b, c, d = point[g, 0], point[g, 1], point[g, 2], point[g, 3]
            p, q, r, s = weight[g, 0], weight[g, 1], weight[g, 2], weight[g, 3]
            x = p * now[a, 0] + q * now[b, 0] + r * now[c, 0] + s * now[d, 0]
            y = p * now[a, 1] + q * now[b, 1] + r * now[c, 1] + s * now[d, 1]
            z = p * now[a, 2] + q * now[b, 2] + r * now[c, 2] + s * now[d, 2]
            push = reach[g] - (x * normal[g, 0] + y * normal[g, 1] + z * normal[g, 2])
            if push > 0.0:
                open_gap(position, previous, inverse_mass, points, exact.wholes, gaps, g, push, x, y, z)
        take_back(position, previous, points)
    separate(position, contact)


@kernel
def begin_wholes(wholes):
    if wholes is None:
        return
    for b in range(wholes.stamp.size):
        wholes.stamp[b] = 0


@kernel
def open_gap(position, previous, inverse_mass, points, wholes, gaps, g, push, x, y, z):
    """Open a gap by the push along its normal, and take back sliding within the cone of friction. (x, y, z): across the gap."""
    now, start, free, gap, reach = points.now, points.start, points.free, gaps.gap[g], gaps.reach[g]
    a, b, c, d = gaps.point[g, 0], gaps.point[g, 1], gaps.point[g, 2], gaps.point[g, 3]
    p, q, r, s = gaps.weight[g, 0], gaps.weight[g, 1], gaps.weight[g, 2], gaps.weight[g, 3]
    nx, ny, nz = gaps.normal[g, 0], gaps.normal[g, 1], gaps.normal[g, 2]
    soft = p * p * free[a] + q * q * free[b] + r * r * free[c] + s * s * free[d]
    give = soft + give_of_whole(position, previous, inverse_mass, points, wholes, gaps, g, nx, ny, nz)
    if not give > 0.0:
        return
    standing = min(push, max(0.0, reach - gap))
    fresh = push - standing
    gaps.push[g] = fresh
    sx = x - (p * start[a, 0] + q * start[b, 0] + r * start[c, 0] + s * start[d, 0])
    sy = y - (p * start[a, 1] + q * start[b, 1] + r * start[c, 1] + s * start[d, 1])
    sz = z - (p * start[a, 2] + q * start[b, 2] + r * start[c, 2] + s * start[d, 2])
    along = sx * nx + sy * ny + sz * nz
    sx, sy, sz = sx - along * nx, sy - along * ny, sz - along * nz
    slide, across = math.sqrt(sx * sx + sy * sy + sz * sz), give        # a body that also turns gives way more along the slide
    if slide > 0.0:
        across = soft + give_of_whole(position, previous, inverse_mass, points, wholes, gaps, g, sx / slide, sy / slide, sz / slide)
    share = grip(points.friction, a, d, slide, fresh * across / give) / across
    fx, fy, fz = push * nx / give - share * sx, push * ny / give - share * sy, push * nz / give - share * sz
    standing /= give
    tx, ty, tz = standing * nx, standing * ny, standing * nz
    shove_point(now, points.shift, a, p * free[a], fx, fy, fz, tx, ty, tz)
    shove_point(now, points.shift, b, q * free[b], fx, fy, fz, tx, ty, tz)
    shove_point(now, points.shift, c, r * free[c], fx, fy, fz, tx, ty, tz)
    shove_point(now, points.shift, d, s * free[d], fx, fy, fz, tx, ty, tz)
    shove_whole(position, points, wholes, gaps, g, fx, fy, fz, tx, ty, tz)


@inlined
def shove_point(now, shift, k, by, fx, fy, fz, tx, ty, tz):
    """Move point k by its share of the impulse f; of it the part t makes no speed."""
    now[k, 0] += by * fx
    now[k, 1] += by * fy
    now[k, 2] += by * fz
    shift[k, 0] += by * tx
    shift[k, 1] += by * ty
    shift[k, 2] += by * tz


@kernel
def grip(friction, a, d, slide, push):
    """Which part of the slide across the normal friction takes back; push: what the same impulse would move across [m]."""
    if friction is None:
        return 0.0
    if slide == 0.0:
        return 0.0
    static, dynamic = coefficients(friction, friction, a, d)
    return held(slide, push, static, dynamic)


@kernel
def give_of_whole(position, previous, inverse_mass, points, wholes, gaps, g, nx, ny, nz):
    """How rigid bodies give way to an impulse along the unit vector n at a gap: 1/M + (r x n) . I^-1 (r x n), of both sides."""
    if wholes is None:
        return 0.0
    give, m = 0.0, wholes.mass
    for side in range(2):
        e, x, y, z = whole_side(points, gaps, g, side)
        if e < 0:
            continue
        if wholes.stamp[e] == 0:
            wholes.stamp[e] = 1
            begin, by = wholes.first[e], wholes.stride[e]
            weighed = weigh_one(position[0], position[1], position[2], previous[0], previous[1], previous[2], inverse_mass,
                                begin, begin + wholes.size[e] * by, by)
            for column in range(10):
                m[e, column] = weighed[column]
        tx, ty, tz = cross(x - m[e, 1], y - m[e, 2], z - m[e, 3], nx, ny, nz)
        ox, oy, oz = times_symmetric(m[e, 4], m[e, 5], m[e, 6], m[e, 7], m[e, 8], m[e, 9], tx, ty, tz)
        give += m[e, 0] + tx * ox + ty * oy + tz * oz
    return give


@kernel
def whole_side(points, gaps, g, side):
    """The rigid body of the first (side 0) or the second feature of a gap, -1 if it has none, and its closest point."""
    ends = 1 + gaps.edges[g]
    low, high = (0, ends) if side == 0 else (ends, 4)
    e, sign, x, y, z = points.whole[gaps.point[g, low]], 1.0 - 2.0 * side, 0.0, 0.0, 0.0
    for k in range(low, high):
        p, w = gaps.point[g, k], sign * gaps.weight[g, k]
        x, y, z = x + w * points.now[p, 0], y + w * points.now[p, 1], z + w * points.now[p, 2]
    return e, x, y, z


@kernel
def shove_whole(position, points, wholes, gaps, g, fx, fy, fz, tx, ty, tz):
    """Move the rigid bodies of a gap by the twist that the impulse f gives the first; of it the part t makes no speed."""
    if wholes is None:
        return
    for side in range(2):
        e, x, y, z = whole_side(points, gaps, g, side)
        if e >= 0:
            sign = 1.0 - 2.0 * side
            twist(points.now, position, wholes, e, x, y, z, sign * fx, sign * fy, sign * fz)
            twist(points.shift, position, wholes, e, x, y, z, sign * tx, sign * ty, sign * tz)


@kernel
def twist(moved, place, wholes, e, x, y, z, fx, fy, fz):
    """Move all particles of a rigid body by the impulse f at the point (x, y, z). place (3, n) m: where they were weighed."""
    m = wholes.mass
    ax, ay, az = cross(x - m[e, 1], y - m[e, 2], z - m[e, 3], fx, fy, fz)
    ax, ay, az = times_symmetric(m[e, 4], m[e, 5], m[e, 6], m[e, 7], m[e, 8], m[e, 9], ax, ay, az)
    first, stride = wholes.first[e], wholes.stride[e]
    for k in range(first, first + wholes.size[e] * stride, stride):
        dx, dy, dz = place[0, k] - m[e, 1], place[1, k] - m[e, 2], place[2, k] - m[e, 3]
        ux, uy, uz = cross(ax, ay, az, dx, dy, dz)
        moved[k, 0] += m[e, 0] * fx + ux
        moved[k, 1] += m[e, 0] * fy + uy
        moved[k, 2] += m[e, 0] * fz + uz


@kernel
def take_back(position, previous, points):
    """The particles where contact has moved them; what makes no speed moves their previous places along."""
    now, shift = points.now, points.shift
    for i in range(3):
        x, u = position[i], previous[i]
        for k in range(x.size):
            x[k] = now[k, i]
            u[k] += shift[k, i]
