"""The paper's response of rigid bodies (P18 to P21): the features that touch are moved apart, relaxation carries it on.

A feature is a weighted set of particles: a vertex, an edge or a face with the barycentric weights c of its contact point
p. Moved with x_i' = x_i + w_i c_i / s (q - p), s = sum_j w_j c_j^2, w the inverse masses, its point lands on q (the
paper's eqs. 8 and 9 for any masses). Its momentum is then (q - p) / s: so 1/s is the mass with which a feature counts,
and q = (M_A p_A + M_B p_B) / (M_A + M_B) with M = 1/s keeps momentum. `point` selects M: that of the feature, that of
the body, or the bodies' the wrong way round, as eq. 10 is printed. What is pinned does not move, whatever M says.
"""

import math

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers.contact import FEATURE, PRINTED
from verlet_numba.effects.touch import HULLS, grip_between
from verlet_numba.physics.friction import held


@kernel
def begin_features(inverse_mass, meet, hulls, features):
    """Nothing has been pushed yet in this substep; how the features give way."""
    if features is None or meet is None:
        return
    corner, weight, particle = meet.meetings.corner, meet.meetings.weight, hulls.particle
    push, give = meet.meetings.push, meet.meetings.give
    for m in range(meet.meetings.listed[0]):
        push[m] = 0.0
        for side in range(2):
            s = 0.0
            for e in range(3 * side, 3 * side + 3):
                k = particle[corner[e, m]]
                if k >= 0:
                    s += inverse_mass[k] * weight[e, m] * weight[e, m]
            give[side, m] = s


@inlined
def point_of(x, y, z, corners, particle, corner, weight, m, side):
    """The contact point of meeting m on the first (side 0) or second (3) hull, where its particles are now."""
    px = py = pz = 0.0
    for e in range(side, side + 3):
        q, c = corner[e, m], weight[e, m]
        if c != 0.0:
            k = particle[q]
            if k >= 0:
                px, py, pz = px + c * x[k], py + c * y[k], pz + c * z[k]
            else:
                px, py, pz = px + c * corners[0, q], py + c * corners[1, q], pz + c * corners[2, q]
    return px, py, pz


@inlined
def shift(x, y, z, inverse_mass, particle, corner, weight, m, side, s, dx, dy, dz):
    """Move a feature so that its point moves by d (P20)."""
    for e in range(side, side + 3):
        k = particle[corner[e, m]]
        if weight[e, m] != 0.0 and k >= 0 and s > 0.0:
            f = inverse_mass[k] * weight[e, m] / s
            x[k] += f * dx
            y[k] += f * dy
            z[k] += f * dz


@kernel
def part_of_the_way(point, sa, sb, ma, mb):
    """Which part of the way the first feature moves; sa, sb: inverse masses of the features, ma, mb: masses of the bodies."""
    if sa == 0.0 or sb == 0.0:
        return 0.0 if sa == 0.0 else 1.0
    if point == FEATURE:
        return sa / (sa + sb)
    if point == PRINTED:
        return ma / (ma + mb)
    return mb / (ma + mb)


@kernel
def part_features(position, inverse_mass, meet, hulls, features, which):
    """Move the features of every meeting that penetrates until they touch, along its normal."""
    if features is None or meet is None:
        return
    x, y, z = position[0], position[1], position[2]
    corner, weight, normal, pair = meet.meetings.corner, meet.meetings.weight, meet.meetings.normal, meet.meetings.pair
    one, other, corners, particle, rounding = meet.pairs.first, meet.pairs.second, hulls.corner, hulls.particle, hulls.rounding
    push, give, point = meet.meetings.push, meet.meetings.give, features.point
    mass = features.mass if which == HULLS else features.mass_point
    for m in range(meet.meetings.listed[0]):
        g, h = one[pair[m]], other[pair[m]]
        nx, ny, nz = normal[0, m], normal[1, m], normal[2, m]
        px, py, pz = point_of(x, y, z, corners, particle, corner, weight, m, 0)
        qx, qy, qz = point_of(x, y, z, corners, particle, corner, weight, m, 3)
        depth = rounding[g] + rounding[h] - (nx * (px - qx) + ny * (py - qy) + nz * (pz - qz))
        if depth <= 0.0:
            continue
        sa, sb = give[0, m], give[1, m]
        if sa + sb == 0.0:
            continue
        da = part_of_the_way(point, sa, sb, mass[g], mass[h]) * depth
        db = da - depth
        shift(x, y, z, inverse_mass, particle, corner, weight, m, 0, sa, da * nx, da * ny, da * nz)
        shift(x, y, z, inverse_mass, particle, corner, weight, m, 3, sb, db * nx, db * ny, db * nz)
        push[m] += depth


@kernel
def rub_features(position, previous, inverse_mass, meet, hulls, features, friction, which):
    """Take back sliding of the features that were pushed, after the last pass, within Coulomb's share of the push."""
    if features is None or meet is None or friction is None:
        return
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    corner, weight, normal, pair = meet.meetings.corner, meet.meetings.weight, meet.meetings.normal, meet.meetings.pair
    one, other, corners, particle, push = meet.pairs.first, meet.pairs.second, hulls.corner, hulls.particle, meet.meetings.push
    give = meet.meetings.give
    for m in range(meet.meetings.listed[0]):
        sa, sb = give[0, m], give[1, m]
        if push[m] == 0.0 or sa + sb == 0.0:
            continue
        nx, ny, nz = normal[0, m], normal[1, m], normal[2, m]
        ax, ay, az = point_of(x, y, z, corners, particle, corner, weight, m, 0)
        bx, by, bz = point_of(u, v, w, corners, particle, corner, weight, m, 0)
        cx, cy, cz = point_of(x, y, z, corners, particle, corner, weight, m, 3)
        dx, dy, dz = point_of(u, v, w, corners, particle, corner, weight, m, 3)
        sx, sy, sz = (ax - bx) - (cx - dx), (ay - by) - (cy - dy), (az - bz) - (cz - dz)
        rise = nx * sx + ny * sy + nz * sz
        sx, sy, sz = sx - rise * nx, sy - rise * ny, sz - rise * nz
        slide = math.sqrt(sx * sx + sy * sy + sz * sz)
        if slide > 0.0:
            static, dynamic = grip_between(friction, which, one[pair[m]], other[pair[m]])
            back = held(slide, push[m], static, dynamic)
            fa, fb = -back * sa / (sa + sb), back * sb / (sa + sb)
            shift(x, y, z, inverse_mass, particle, corner, weight, m, 0, sa, fa * sx, fa * sy, fa * sz)
            shift(x, y, z, inverse_mass, particle, corner, weight, m, 3, sb, fb * sx, fb * sy, fb * sz)
