"""Continuous collision of rigid bodies: what goes far in a substep is stopped by what it meets on its way.

Contacts are sought where everything is at the end of a step: what is by then on the other side is not met. So bodies that go
farther than a quarter of the least thickness have their vertices, faces and edges followed along the step, with those of
other bodies and of colliders (kernels/impact_time.py). Where two meet, both are given, as whole bodies, the impulse that
keeps them apart along the vector between them at the time of impact: without restitution, momentum kept. What still would
pass is held back short of its impact. All this comes before contacts are sought, which find the bodies touching.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.effects.exact import bring, bring_corners, tell_short
from verlet_numba.effects.hold_back import bound_gaps, hold_back
from verlet_numba.effects.open_gaps import begin_wholes, give_of_whole, shove_whole, take_back
from verlet_numba.kernels.impact_time import NEVER, apart_at, time_of_impact
from verlet_numba.kernels.near_features import list_features, of_pair
from verlet_numba.kernels.pieces import list_pieces, update_pieces

ROUNDS = 256            # through the impacts, at most: they are few
SETTLED = 1e-6          # of the largest impulse: a round that changes less is the last


@kernel
def arrest(position, previous, inverse_mass, contact, rapid):
    """Stop rigid bodies that would pass through something in this substep. False: no room (grow and call again)."""
    if rapid is None:
        return True
    points = rapid.points
    bring(position, previous, points)
    bring_corners(contact, points)
    if not any_rapid(points, rapid.wholes, rapid.least):
        return True
    rapid.gaps.listed[0] = 0
    if not find_impacts(rapid, rapid.among, 1) or not find_impacts(rapid, rapid.against, 0):
        return tell_short(rapid)
    if rapid.gaps.listed[0] > 0:
        answer(position, previous, inverse_mass, rapid)
    return True


@kernel
def any_rapid(points, wholes, least):
    """Whether any particle of a rigid body goes farther than `least`."""
    start, now, found = points.start, points.now, 0
    for b in range(wholes.size.size):
        first, stride = wholes.first[b], wholes.stride[b]
        for k in range(first, first + wholes.size[b] * stride, stride):
            x, y, z = now[k, 0] - start[k, 0], now[k, 1] - start[k, 1], now[k, 2] - start[k, 2]
            found += x * x + y * y + z * z > least * least
    return found > 0


@kernel
def find_impacts(rapid, listing, among):
    """Add the impacts of features, of rigid bodies with each other or with colliders, to the gaps. False: no room."""
    if listing is None:
        return True
    points, gaps = rapid.points, rapid.gaps
    start, now, step, slack, path = points.start, points.now, listing.step, listing.slack, listing.path
    listing.made[0] = -1
    for p in range(step.size):
        x, y, z = now[p, 0] - start[p, 0], now[p, 1] - start[p, 1], now[p, 2] - start[p, 2]
        step[p] = slack[p] = math.sqrt(x * x + y * y + z * z)
        path[p] = 0.0
    update_pieces(start, points.radius, slack, rapid.pieces)
    if not (list_pieces(rapid.pieces, among, None, listing.stack, listing.pairs)
            and list_features(start, points, rapid.pieces, listing)):
        listing.made[0] = NO_ROOM
        return False
    listed = gaps.listed[0]
    for n in range(listing.made[0]):
        a, b, c, d, two = listing.point[n, 0], listing.point[n, 1], listing.point[n, 2], listing.point[n, 3], listing.edges[n]
        if of_pair(step, a, b, c, d, two) <= rapid.least:
            continue
        far = apart_at(0.0, start, now, a, b, c, d, two)[7]
        reach = min(listing.reach[n] + rapid.floor, 0.5 * far)         # what is as near as that already may halve it
        t = time_of_impact(start, now, a, b, c, d, two, reach)
        if t == NEVER or t == 0.0:
            continue
        if listed == gaps.gap.size:
            return False
        p, q, r, s, x, y, z, distance = apart_at(t, start, now, a, b, c, d, two)
        gaps.point[listed, 0], gaps.point[listed, 1], gaps.point[listed, 2], gaps.point[listed, 3] = a, b, c, d
        gaps.weight[listed, 0], gaps.weight[listed, 1], gaps.weight[listed, 2], gaps.weight[listed, 3] = p, q, r, s
        gaps.normal[listed, 0], gaps.normal[listed, 1], gaps.normal[listed, 2] = x / distance, y / distance, z / distance
        gaps.gap[listed], gaps.reach[listed], gaps.edges[listed], gaps.push[listed] = far, reach, two, 0.0
        listed += 1
    gaps.listed[0] = listed
    return True


@kernel
def answer(position, previous, inverse_mass, rapid):
    """Give the bodies the impulses of their impacts, and hold back what they do not stop.

    Impulses push only; a round may take back what an earlier one gave too much (projected Gauss-Seidel).
    """
    points, gaps, wholes, scale, frame = rapid.points, rapid.gaps, rapid.wholes, rapid.scale, rapid.frame
    now = points.now
    begin_wholes(wholes)
    for _ in range(ROUNDS):
        change = largest = 0.0
        for g in range(gaps.listed[0]):
            nx, ny, nz = gaps.normal[g, 0], gaps.normal[g, 1], gaps.normal[g, 2]
            across = 0.0
            for k in range(4):
                p, w = gaps.point[g, k], gaps.weight[g, k]
                across += w * (nx * now[p, 0] + ny * now[p, 1] + nz * now[p, 2])
            give = give_of_whole(position, previous, inverse_mass, points, wholes, gaps, g, nx, ny, nz)
            if give > 0.0:
                given = gaps.push[g]
                gaps.push[g] = max(0.0, given + (gaps.reach[g] - across) / give)
                f = gaps.push[g] - given
                shove_whole(position, points, wholes, gaps, g, f * nx, f * ny, f * nz, 0.0, 0.0, 0.0)
                change, largest = max(change, abs(f)), max(largest, gaps.push[g])
        if change <= SETTLED * largest:
            break
    take_back(position, previous, points)
    for k in range(scale.size):
        scale[k] = 1.0
    changed = 1
    while changed > 0:
        changed = bound_gaps(points, frame, gaps, rapid.floor, scale, 1)
        hold_back(position, points, frame, wholes, scale, changed)
    for k in range(position.shape[1]):
        if scale[k] < 1.0:
            for i in range(3):
                position[i, k] = now[k, i]
