"""Impacts of bodies: what meets with a speed leaves with a share of it, one impact after another (Newton's restitution).

Within a substep the paths are straight lines: two that are apart by g at its start and would be at -d at its end meet after
the part s = g / (g + d) of it. The impulse (1 + e) v / W turns their approach v into a separation e v; the velocities
change by D = W j, so positions by (1 - s) D and previous positions by -s D. Impacts are gone through until none approaches
any more: so a row of balls hands an impulse on, as Newton's cradle does, instead of sharing it.

Speeds that two steps of acceleration can give are no impact: what rests does not hop.
"""

import math

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.effects.aim import aim_hulls, respond
from verlet_numba.effects.meet import gather
from verlet_numba.effects.response import displace, relative, strike
from verlet_numba.effects.touch import COLLIDERS, HULLS, MIXED

ROUNDS = 64         # through the touches or pairs, at most


@kernel
def strike_bodies(position, inverse_mass, acceleration, contact, meet, hulls, mixed, points, friction, restitution, rigid, touches,
                  number, h):
    """Impacts between hulls. What they leave with stands in Touches.answer, so that it is kept after the passes."""
    if restitution is None or rigid is None:
        return
    if meet is None and mixed is None:
        return
    aim_hulls(meet, hulls, contact, rigid, touches, HULLS, number, h)
    aim_hulls(mixed, points, contact, rigid, touches, MIXED, number, h)
    respond(friction, rigid, touches)
    first, second, line, answer = touches.first, touches.second, touches.line, touches.answer
    twist, kick, mass = rigid.twist, rigid.kick, rigid.mass
    begin, end = touches.until[COLLIDERS], touches.until[MIXED]
    for _ in range(ROUNDS):
        struck = 0
        for t in range(begin, end):
            if answer[t, 8] == 0.0:
                continue
            a, b = first[t], second[t]
            nx, ny, nz = line[t, 0], line[t, 1], line[t, 2]
            ux, uy, uz = relative(twist, a, b, line, t)
            vx, vy, vz = relative(kick, a, b, line, t)
            moved = nx * ux + ny * uy + nz * uz
            approach = nx * line[t, 9] + ny * line[t, 10] + nz * line[t, 11]
            gap = -answer[t, 0] + moved
            speed = approach + moved + nx * vx + ny * vy + nz * vz
            if gap >= 0.0 or -speed <= 2.0 * pull(acceleration, rigid.first[a], rigid.first[b], h):
                continue
            before = max(0.0, -answer[t, 0] - approach)
            s = min(1.0, before / -speed)
            j = -(1.0 + answer[t, 8]) * speed * answer[t, 1]
            hit(twist, mass, a, b, line, t, (1.0 - s) * j)
            hit(kick, mass, a, b, line, t, s * j)
            struck += 1
        if struck == 0:
            break
    for t in range(begin, end):
        ux, uy, uz = relative(twist, first[t], second[t], line, t)
        vx, vy, vz = relative(kick, first[t], second[t], line, t)
        leaving = (line[t, 0] * (line[t, 9] + ux + vx) + line[t, 1] * (line[t, 10] + uy + vy)
                   + line[t, 2] * (line[t, 11] + uz + vz))
        answer[t, 4] = max(0.0, leaving) if answer[t, 8] > 0.0 else 0.0
    displace(position, inverse_mass, rigid)
    gather(position, hulls, None)
    gather(position, points, None)


@inlined
def hit(twist, mass, a, b, line, t, j):
    """Give the impulse j along the line of touch t to entity a, and -j to b."""
    jx, jy, jz = j * line[t, 0], j * line[t, 1], j * line[t, 2]
    strike(twist, mass, a, line[t, 3], line[t, 4], line[t, 5], jx, jy, jz)
    strike(twist, mass, b, line[t, 6], line[t, 7], line[t, 8], -jx, -jy, -jz)


@kernel
def pull(acceleration, i, j, h):
    """By how much acceleration changes the displacement of particle i against j from one step to the next, at most [m]."""
    if acceleration is None:
        return 0.0
    ax, ay, az = (acceleration[0, i] - acceleration[0, j], acceleration[1, i] - acceleration[1, j],
                  acceleration[2, i] - acceleration[2, j])
    return math.sqrt(np.float64(ax * ax + ay * ay + az * az)) * h * h


@kernel
def strike_spheres(position, previous, inverse_mass, acceleration, spheres, restitution, h):
    """Impacts between particles of deformable bodies and point masses, at the moment when their spheres meet."""
    if spheres is None or restitution is None:
        return
    first, second, radius, share = spheres.candidates.first, spheres.candidates.second, spheres.radius, restitution.particle
    x, y, z, u, v, w = position[0], position[1], position[2], previous[0], previous[1], previous[2]
    for _ in range(ROUNDS):
        struck = 0
        for c in range(spheres.candidates.listed[0]):
            i, j = first[c], second[c]
            e = max(share[i], share[j])
            if e == 0.0:
                continue
            reach = np.float64(radius[i]) + radius[j]
            px, py, pz = np.float64(u[j]) - u[i], np.float64(v[j]) - v[i], np.float64(w[j]) - w[i]
            dx, dy, dz = np.float64(x[j]) - x[i] - px, np.float64(y[j]) - y[i] - py, np.float64(z[j]) - z[i] - pz
            s = meeting(px * px + py * py + pz * pz - reach * reach, px * dx + py * dy + pz * dz, dx * dx + dy * dy + dz * dz)
            if s > 1.0:
                continue
            nx, ny, nz = px + s * dx, py + s * dy, pz + s * dz
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            if length == 0.0:
                continue
            nx, ny, nz = nx / length, ny / length, nz / length
            speed = nx * dx + ny * dy + nz * dz
            if -speed <= 2.0 * pull(acceleration, i, j, h):
                continue
            here, there = np.float64(inverse_mass[i]), np.float64(inverse_mass[j])
            change = -(1.0 + e) * speed / (here + there)
            here, there = -here * change, there * change
            bounce_off(x, y, z, u, v, w, i, here * nx, here * ny, here * nz, s)
            bounce_off(x, y, z, u, v, w, j, there * nx, there * ny, there * nz, s)
            struck += 1
        if struck == 0:
            break


@inlined
def bounce_off(x, y, z, u, v, w, k, dx, dy, dz, s):
    """Change the displacement of particle k by d at the part s of the substep."""
    x[k], y[k], z[k] = x[k] + (1.0 - s) * dx, y[k] + (1.0 - s) * dy, z[k] + (1.0 - s) * dz
    u[k], v[k], w[k] = u[k] - s * dx, v[k] - s * dy, w[k] - s * dz


@inlined
def meeting(c, b, a):
    """The part of the step after which |p + s d| is the reach: a s^2 + 2 b s + c = 0; 2: not in it; 0: they touch and approach.

    a = d . d, b = p . d, c = p . p - reach^2.
    """
    s, root = 2.0, b * b - a * c
    if b < 0.0 and c <= 0.0:
        s = 0.0
    elif b < 0.0 and root >= 0.0:
        s = c / (math.sqrt(root) - b)
    return s
