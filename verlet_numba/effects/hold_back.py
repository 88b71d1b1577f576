"""Nothing passes through: points whose ways no gap keeps apart are held back.

A gap is safe if one fixed plane keeps its two features apart at the start and at the end of
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
from verlet_numba.effects.exact import LEAST, bring_now, choose_frame, find_again
from verlet_numba.kernels.impact_time import NEVER, time_of_impact

HOLD = 0.45             # of a gap: how far its points may go if no plane keeps them apart; below one half
CLOSE = 1.0 - 1e-9      # of a step: held back by less than the rest, it is not held back


@kernel
def limit_exact(position, exact):
    """Hold points back that might pass through something on their way, and note the ways taken. Nothing comes after it."""
    if exact is None:
        return
    points, frame, scale = exact.points, exact.frame, exact.scale
    now = points.now
    bring_now(position, now)
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
    if not find_again(exact, listing, 0):
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
