"""Exact contact of deformable bodies: vertices with triangles and edges with edges, among each other, with themselves, with
rigid bodies and with colliders, both ways.

Once a substep the closest points of features near each other are taken at its *start*, a state without intersections, and
the unit vector between them. After the relaxation these gaps are gone through once: what has come nearer than both radii
along that vector is moved apart, each point by its weight and inverse mass, rigid bodies as a whole, so that momentum is
kept. Contact has the last word, and what the substep itself has brought nearer is also what friction acts on; overlap that
stood already is shifted without becoming speed.

With `continuous_collision` gaps whose points go far are those at the time of impact (kernels/impact_time.py), and what only
passes by is let pass.

**Nothing passes through.** A gap is safe if one fixed plane keeps its two features apart at the start and at the end of
their straight ways: then it does so on the way, and whatever part of its step each point takes. Points of any other gap may
go HOLD of the gap at most, so that what is left of it is more than nothing. Where points have got farther than gaps were
looked for with, they are looked for again. So every way taken is free of crossings, as long as what paths prescribe leaves
room. After Wu,
Wang & Wang 2020 (A Safe and Fast Repulsion Method for GPU-based Cloth Self Collisions) and Chen, Diaz, Yuksel 2025 (Offset
Geometric Contact), which bound the step of every vertex by its distances.
"""

import math

import numpy as np

from verlet_numba._jit import inlined, kernel
from verlet_numba.buffers import NO_ROOM
from verlet_numba.effects.contact import separate
from verlet_numba.effects.friction import coefficients
from verlet_numba.effects.touch import weigh_one
from verlet_numba.kernels.impact_time import NEVER, time_of_impact
from verlet_numba.kernels.near_features import find_gaps, list_features
from verlet_numba.kernels.pieces import list_against_others, list_among, update_edges, update_pieces
from verlet_numba.physics.friction import held
from verlet_numba.physics.rigid import cross, times_symmetric

GROWTH = 1.25           # times the step that a point is about to take: how far it is expected to get, with the floor added
LASTING = 4.0           # steps that a list shall last
HOLD = 0.45             # of a gap: how far its points may go if no plane keeps them apart; below one half
LEAST = 0.1             # of a gap: what a plane has to leave of it
CLOSE = 1.0 - 1e-9      # of a step: held back by less than the rest, it is not held back


@kernel
def find_exact(position, previous, contact, exact):
    """List the gaps that may close in this substep. False: no room (grow and call again)."""
    if exact is None:
        return True
    points, gaps = exact.points, exact.gaps
    bring(position, previous, points)
    bring_corners(contact, points)
    mean_step(points, exact.among, exact.drift)
    gaps.listed[0] = 0
    if not find_against(exact, exact.against):
        return tell_short(exact)
    choose_frame(gaps.listed[0] > 0, exact.drift, exact.frame, exact.least)
    fits = find_among(exact, exact.among) and 2 * gaps.listed[0] <= gaps.gap.size
    return (spare(exact.among) and spare(exact.against) and fits) or tell_short(exact)


@kernel
def tell_short(exact):
    """False, and the gaps say that they had no room unless a list of pairs does."""
    if not (is_short(exact.among) or is_short(exact.against)):
        exact.gaps.listed[0] = NO_ROOM
    return False


@kernel
def is_short(listing):
    """Whether a list of pairs had no room."""
    if listing is None:
        return False
    return listing.made[0] == NO_ROOM


@kernel
def spare(listing):
    """Whether a list leaves half of its room free, so that it may be made again at the end of the substep; else it is undone."""
    if listing is None:
        return True
    if 2 * listing.made[0] <= listing.left.size and 2 * listing.pairs.listed[0] <= listing.pairs.first.size:
        return True
    listing.made[0] = NO_ROOM
    return False


@kernel
def bring(position, previous, points):
    """The particles where they are, and where they were at the start of the substep."""
    start, now, shift = points.start, points.now, points.shift
    for i in range(3):
        x, u = position[i], previous[i]
        for k in range(x.size):
            now[k, i], start[k, i], shift[k, i] = x[k], u[k], 0.0


@kernel
def bring_corners(contact, points):
    """The corners of colliders, at the start and at the end of the substep."""
    if contact is None:
        return
    solids, start, now, local = contact.solids, points.start, points.now, points.local
    first = now.shape[0] - points.solid.size
    for c in range(points.solid.size):
        s = points.solid[c]
        for i in range(3):
            now[first + c, i], start[first + c, i] = solids.origin[i, s], solids.origin_before[i, s]
            for j in range(3):
                now[first + c, i] += solids.rotation[i, j, s] * local[j, c]
                start[first + c, i] += solids.rotation_before[i, j, s] * local[j, c]


@kernel
def mean_step(points, among, drift):
    """The mean step of the deformable bodies' particles; none where they do not meet."""
    if among is None:
        return
    start, now, soft = points.start, points.now, points.soft
    x = y = z = 0.0
    for p in soft:
        x, y, z = x + (now[p, 0] - start[p, 0]), y + (now[p, 1] - start[p, 1]), z + (now[p, 2] - start[p, 2])
    drift[0], drift[1], drift[2] = x / soft.size, y / soft.size, z / soft.size


@kernel
def choose_frame(grounded, drift, frame, least):
    """Points are held back towards the mean step of all, but where rigid bodies or colliders are near towards none.

    Features that are not near each other may then part from that mean by twice its length: if their reach is less, steps
    are counted without it.
    """
    if grounded and 4.0 * (drift[0]**2 + drift[1]**2 + drift[2]**2) > (1.0 - LEAST) * least * least:
        for i in range(3):
            drift[i] = 0.0
    for i in range(3):
        frame[i] = 0.0 if grounded else drift[i]


@kernel
def find_against(exact, listing):
    """Gaps of deformable bodies with rigid ones and colliders. False: no room."""
    if listing is None:
        return True
    points, drift = exact.points, exact.drift
    bound_steps(points.start, points.now, drift, math.sqrt(drift[0]**2 + drift[1]**2 + drift[2]**2), exact.floor, listing.step)
    return find_again(exact, listing, None)


@kernel
def find_among(exact, listing):
    """Gaps between deformable bodies. False: no room."""
    if listing is None:
        return True
    points = exact.points
    bound_steps(points.start, points.now, exact.drift, 0.0, exact.floor, listing.step)
    return find_again(exact, listing, 1)


@kernel
def find_again(exact, listing, among):
    """Add the gaps that the present steps may close, from a new list if that is called for. False: no room."""
    points = exact.points
    if outdated(listing):
        renew(points, exact.pieces, listing)
        exact.tally[0] += 1
        if not (list_pieces(points.start, exact.pieces, exact.itself, listing, among)
                and list_features(points.start, points, exact.pieces, listing)):
            listing.made[0] = NO_ROOM
            return False
    return find_gaps(points, listing, exact.gaps, exact.continuous)


@kernel
def list_pieces(place, pieces, itself, listing, among):
    """List the pairs of pieces among deformable bodies, or if `among` is None of those against others. False: no room."""
    if among is None:
        return list_against_others(pieces, listing.stack, listing.pairs)
    update_edges(place, pieces)
    return list_among(pieces, itself, listing.stack, listing.pairs)


@kernel
def bound_steps(start, now, drift, beside, floor, step):
    """How far every point may get in this substep, relative to the drift: a little farther than it is about to."""
    u, v, w = drift[0], drift[1], drift[2]
    for p in range(step.size):
        x, y, z = now[p, 0] - start[p, 0] - u, now[p, 1] - start[p, 1] - v, now[p, 2] - start[p, 2] - w
        step[p] = GROWTH * (math.sqrt(x * x + y * y + z * z) + beside) + floor


@kernel
def outdated(listing):
    """Whether a list is yet to be made, or a point may use up its slack in this substep."""
    path, step, slack = listing.path, listing.step, listing.slack
    kept = 0
    for p in range(path.size):
        kept += path[p] + step[p] <= slack[p]
    return listing.made[0] < 0 or kept < path.size


@kernel
def renew(points, pieces, listing):
    """A list is to be made from where the points are at the start: their ways begin anew."""
    path, step, slack = listing.path, listing.step, listing.slack
    listing.made[0] = -1
    for p in range(path.size):
        path[p], slack[p] = 0.0, LASTING * step[p]
    update_pieces(points.start, points.radius, slack, pieces)


@kernel
def part_exact(position, previous, inverse_mass, contact, exact):
    """Move features apart that have come nearer than their reach, after the relaxation: gap by gap, the last found first."""
    if exact is None:
        return
    points, gaps = exact.points, exact.gaps
    if gaps.listed[0] > 0:
        now = points.now
        for i in range(3):
            x = position[i]
            for k in range(x.size):
                now[k, i] = x[k]
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


@kernel
def limit_exact(position, exact):
    """Hold points back that might pass through something on their way, and note the ways taken. Nothing comes after it."""
    if exact is None:
        return
    points, frame, scale = exact.points, exact.frame, exact.scale
    now = points.now
    for i in range(3):
        x = position[i]
        for k in range(x.size):
            now[k, i] = x[k]
    for k in range(scale.size):
        scale[k] = 1.0
    if not (farther_against(exact, exact.against) and farther_among(exact, exact.among)):
        for k in range(scale.size):         # more is near all at once than there is room for: this time nothing moves
            bound_one(now, points.start, frame, points.moves, k, 0.0, scale)
        hold_back(position, points, frame, exact.wholes, scale, 1)
    changed = 1
    while changed > 0:                      # what was taken to pass by may hit what is held back
        changed = bound_gaps(points, frame, exact.gaps, exact.floor, scale, exact.continuous)
        hold_back(position, points, frame, exact.wholes, scale, changed)
    held_back = 0
    for k in range(position.shape[1]):
        if scale[k] < 1.0:
            held_back += 1
            for i in range(3):
                position[i, k] = now[k, i]
    exact.tally[2] += held_back
    exact.tally[1] += 1
    drift, zero = exact.drift, 0.0
    walk(points, drift[0], drift[1], drift[2], exact.among)
    walk(points, zero, zero, zero, exact.against)


@kernel
def bound_gaps(points, frame, gaps, floor, scale, continuous):
    """Points of gaps that nothing keeps open may go a part of them at most. How many are held back more than before.

    What passes by does so at a part of `floor` [m] at least.
    """
    now, start, moves, changed = points.now, points.start, points.moves, 0
    for g in range(gaps.listed[0]):
        gap, two, low, high, far = gaps.gap[g], gaps.edges[g], np.inf, -np.inf, 0.0
        nx, ny, nz = gaps.normal[g, 0], gaps.normal[g, 1], gaps.normal[g, 2]
        lead = gaps.point[g, 0]
        for k in range(4):
            p = gaps.point[g, k]
            x, y, z = now[p, 0] - start[p, 0] - frame[0], now[p, 1] - start[p, 1] - frame[1], now[p, 2] - start[p, 2] - frame[2]
            before = (nx * (start[p, 0] - start[lead, 0]) + ny * (start[p, 1] - start[lead, 1])
                      + nz * (start[p, 2] - start[lead, 2]))
            after = before + nx * x + ny * y + nz * z
            if k == 0 or (k == 1 and two == 1):
                low = min(low, before, after)
            else:
                high = max(high, before, after)
            far = max(far, x * x + y * y + z * z)
        most = HOLD * gap
        if low - high >= LEAST * gap or far <= most * most or passes(
                continuous, start, now, gaps.point, g, two, LEAST * min(gap, floor)):
            continue
        for k in range(4):
            changed += bound_one(now, start, frame, moves, gaps.point[g, k], most, scale)
    return changed


@kernel
def passes(continuous, start, now, point, g, edges, reach):
    """Whether the features of a gap pass each other by on their ways as they are now."""
    if continuous is None:
        return False
    return time_of_impact(start, now, point[g, 0], point[g, 1], point[g, 2], point[g, 3], edges, reach) == NEVER


@inlined
def bound_one(now, start, frame, moves, p, most, scale):
    """Point p may get so far at most, relative to the frame. 1: it got farther and is held back."""
    x, y, z = now[p, 0] - start[p, 0] - frame[0], now[p, 1] - start[p, 1] - frame[1], now[p, 2] - start[p, 2] - frame[2]
    squared, changed = x * x + y * y + z * z, 0
    if squared > most * most and moves[p]:
        share = most / math.sqrt(squared)
        changed = 1 if share < CLOSE else 0
        scale[p] *= share
        now[p, 0] = start[p, 0] + frame[0] + share * x
        now[p, 1] = start[p, 1] + frame[1] + share * y
        now[p, 2] = start[p, 2] + frame[2] + share * z
    return changed


@kernel
def farther_against(exact, listing):
    """If points have got farther than gaps with rigid bodies and colliders were looked for: look again. False: no room."""
    if listing is None:
        return True
    gaps, zero = exact.gaps, 0.0
    if not widened(exact.points, zero, zero, zero, listing.step):
        return True
    listed = gaps.listed[0]
    if not find_again(exact, listing, None):
        return False
    if gaps.listed[0] > listed:
        choose_frame(True, exact.drift, exact.frame, exact.least)
    return True


@kernel
def farther_among(exact, listing):
    """The same of gaps between deformable bodies."""
    if listing is None:
        return True
    drift = exact.drift
    if not widened(exact.points, drift[0], drift[1], drift[2], listing.step):
        return True
    return find_again(exact, listing, 1)


@kernel
def widened(points, u, v, w, step):
    """Whether a point has got farther than expected, relative to (u, v, w): it is expected to now."""
    now, start, found = points.now, points.start, 0
    for p in range(step.size):
        x, y, z = now[p, 0] - start[p, 0] - u, now[p, 1] - start[p, 1] - v, now[p, 2] - start[p, 2] - w
        squared = x * x + y * y + z * z
        if squared > step[p] * step[p]:
            step[p] = math.sqrt(squared)
            found += 1
    return found > 0


@kernel
def hold_back(position, points, frame, wholes, scale, changed):
    """Rigid bodies are held back as a whole: all of their particles as far as the first of them."""
    if wholes is None:
        return
    if changed == 0:
        return
    now, start = points.now, points.start
    for b in range(wholes.size.size):
        first, stride, least = wholes.first[b], wholes.stride[b], 1.0
        last = first + wholes.size[b] * stride
        for k in range(first, last, stride):
            least = min(least, scale[k])
        if least < 1.0:
            for k in range(first, last, stride):
                scale[k] = least
                for i in range(3):
                    now[k, i] = start[k, i] + frame[i] + least * (position[i, k] - start[k, i] - frame[i])


@kernel
def walk(points, u, v, w, listing):
    """Add this substep's steps, relative to (u, v, w), to the ways."""
    if listing is None:
        return
    now, start, path = points.now, points.start, listing.path
    for p in range(path.size):
        x, y, z = now[p, 0] - start[p, 0] - u, now[p, 1] - start[p, 1] - v, now[p, 2] - start[p, 2] - w
        path[p] += math.sqrt(x * x + y * y + z * z)


@kernel
def deepest_gap(exact):
    """By how much the features of a gap were nearer than their reach when the last substep began [m], 0 if none was."""
    if exact is None:
        return 0.0
    deepest = 0.0
    for g in range(exact.gaps.listed[0]):
        deepest = max(deepest, exact.gaps.reach[g] - exact.gaps.gap[g])
    return deepest


@kernel
def pushing_gaps(exact):
    """How many gaps were opened in the last substep."""
    if exact is None:
        return 0
    pushed = 0
    for g in range(exact.gaps.listed[0]):
        pushed += exact.gaps.push[g] > 0.0
    return pushed
