"""Rigid bodies answer to contacts as a whole, without orientation matrices: everything comes from their particles.

Moving only the particles that touch cannot hold a heap: relaxation gives most of the push back, and a body neither rests
nor bounces nor sticks as its mass would. So the touches of an island are solved on one twist (translation and rotation)
of each entity, by projected Gauss-Seidel with Coulomb's cone, and relaxation then has little left to do. A touch pushes
by an impulse [kg m]: force times the step squared; its slide is the displacement of the first against the second entity
since the start of the substep.
"""

import math

from verlet_numba._jit import formula, inlined, kernel
from verlet_numba.kernels.islands import sort_islands
from verlet_numba.physics.friction import sliding
from verlet_numba.physics.pose import rotation
from verlet_numba.physics.rigid import cross, times_symmetric

SWEEPS = 48                 # over an island, at most
FEW_SWEEPS = 4              # over an island of more touches than
FEW_TOUCHES = 128           # these: what they leave, the next substep takes up
SETTLED = 1e-7              # of the largest impulse: a sweep that changes less is the last


@kernel
def link(rigid, touches):
    """Sort the touches by island; nothing has been given yet."""
    if rigid is None:
        return
    touches.islands[0] = sort_islands(touches.first, touches.second, touches.until[-1], rigid.mass, rigid.parent,
                                      touches.label, touches.order, touches.island)


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
    world = rigid.size.size - 1
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
                    if b != world:
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
