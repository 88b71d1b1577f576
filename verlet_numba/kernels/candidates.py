"""The list of pairs that may meet outlives substeps (Verlet 1967): it is made anew when a hull has left its room.

When the list is made, each hull is given a slack on top of its reach, and pairs are listed whose hulls would come within
the margin if both used theirs up. A hull that has moved by d and grown by g since then is still inside its room if
d + g <= slack. While all are, two hulls closer than the margin are listed:
    |c_i - c_j| then <= |c_i - c_j| now + d_i + d_j < reach_i + reach_j now + margin + d_i + d_j
                     <= (reach + slack)_i + (reach + slack)_j then + margin.

More slack makes fewer lists of more pairs. Least in all, at 100 ns a pair and substep and 110 ns a hull and list (1,000 and
10,000 bouncing icosahedra at 10 % fill, 480 substeps a second): SLACK 0.02 to 0.05 and a horizon of 2 to 4 substeps, 4 to 8
where nine in ten rest. Then one substep in four to ten makes a list, of 1.0 to 1.4 pairs a hull; without slack it is every
one, at 1.4 to 2 times the cost.
"""

import math

from verlet_numba._jit import formula, kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels import broad
from verlet_numba.kernels.copying import copy, copy_points

NEVER = -2              # Pairs.met before any substep
KEPT, RENEWED, FULL = 0, 1, 2
SLACK = 0.05                    # of the reach: for what rests, or moves otherwise than it did
FASTER = 1.25                   # of the motion that the last substep foretells


@kernel
def refresh(hulls, still, pairs, spare, search, margin, horizon, all_pairs):
    """Make `pairs` list all hulls that are closer than the margin [m]: KEPT as it is, RENEWED or FULL.

    The first call makes the list; a renewed one shall last for about `horizon` substeps. Pairs that stay keep axis and
    face; new ones get the difference of the centres, and no face. still (H,): hulls that never move. FULL: nothing has
    changed; give `pairs` (its contents kept), `spare` and `search.code` more room, all alike, and call again.
    """
    known, turn = search.made[0] > 0, search.turn[0]
    centre, now, before = hulls.centre, search.last[turn], search.last[1 - turn]
    if not outran(centre, search.anchor, hulls.reach, search.extent, now) and known:
        search.turn[0] = 1 - turn
        return KEPT
    give_room(search.radius, hulls.reach, centre, before, still, 0.5 * margin, horizon, known)
    if all_pairs:
        listed = broad.all_pairs(centre, search.radius, hulls.body, still, spare.first, spare.second)
    else:
        listed = broad.sweep(centre, search.radius, hulls.body, still, spare.first, spare.second, search)
    if listed == NO_ROOM:
        spare.listed[0] = NO_ROOM
        return FULL
    carry(centre, pairs, spare, pairs.listed[0], listed)
    replace(pairs, spare, listed)
    give_room(search.extent, hulls.reach, centre, before, still, 0.0, horizon, known)
    copy_points(centre, search.anchor)
    search.turn[0] = 1 - turn
    search.made[0] += 1
    return RENEWED


@kernel
def outran(centre, anchor, reach, extent, now):
    """Whether a hull has left its room; one that is lost (not a number) has none. Copies the centres on the way."""
    x, y, z, u, v, w = centre[0], centre[1], centre[2], anchor[0], anchor[1], anchor[2]
    a, b, c = now[0], now[1], now[2]
    gone = 0
    for h in range(reach.size):
        dx, dy, dz, slack = x[h] - u[h], y[h] - v[h], z[h] - w[h], extent[h] - reach[h]
        gone += dx * dx + dy * dy + dz * dz > slack * abs(slack)
        a[h], b[h], c[h] = x[h], y[h], z[h]
    return gone > 0


@formula
def slack_of(reach, dx, dy, dz, horizon):
    """Slack of a hull that moved by (dx, dy, dz) [m] in the last substep."""
    motion = math.sqrt(dx * dx + dy * dy + dz * dz)
    return SLACK * reach + FASTER * horizon * (motion if motion < broad.FAR else 0.0)


@kernel
def give_room(room, reach, centre, last, still, more, horizon, known):
    """Write reach, slack and `more` of every hull; before the first list no motion is known."""
    x, y, z, u, v, w = centre[0], centre[1], centre[2], last[0], last[1], last[2]
    moved = 1.0 if known else 0.0
    for h in range(reach.size):
        slack = 0.0
        if not still[h]:
            slack = slack_of(reach[h], moved * (x[h] - u[h]), moved * (y[h] - v[h]), moved * (z[h] - w[h]), horizon)
        room[h] = reach[h] + slack + more


@kernel
def carry(centre, pairs, spare, before, listed):
    """Give the pairs listed in `spare` what they learnt in `pairs`: both ascend, so one walk along them finds all."""
    x, y, z = centre[0], centre[1], centre[2]
    old_first, old_second, old_axis, old_face = pairs.first, pairs.second, pairs.axis, pairs.face
    first, second, axis, face = spare.first, spare.second, spare.axis, spare.face
    old_push, old_overlap, old_met, push, overlap, met = pairs.push, pairs.overlap, pairs.met, spare.push, spare.overlap, spare.met
    old_points, old_given, points, given = pairs.points, pairs.given, spare.points, spare.given
    k = 0
    for m in range(listed):
        i, j = first[m], second[m]
        while k < before and (old_first[k] < i or (old_first[k] == i and old_second[k] < j)):
            k += 1
        if k < before and old_first[k] == i and old_second[k] == j:
            push[m], overlap[m], met[m] = old_push[k], old_overlap[k], old_met[k]
            for row in range(3):
                axis[row, m] = old_axis[row, k]
            for row in range(6):
                face[row, m] = old_face[row, k]
            points[m] = old_points[k]
            copy(old_given[k], given[m], 4 * points[m])
        else:
            push[m], overlap[m], met[m] = 0.0, 0.0, NEVER
            axis[0, m], axis[1, m], axis[2, m] = x[i] - x[j], y[i] - y[j], z[i] - z[j]
            points[m] = 0
            for row in range(6):
                face[row, m] = -1


@kernel
def replace(pairs, spare, listed):
    """Copy the pairs listed in `spare`."""
    pairs.listed[0] = listed
    copy(spare.first, pairs.first, listed)
    copy(spare.second, pairs.second, listed)
    copy(spare.push, pairs.push, listed)
    copy(spare.overlap, pairs.overlap, listed)
    copy(spare.met, pairs.met, listed)
    copy(spare.points, pairs.points, listed)
    for m in range(listed):
        copy(spare.given[m], pairs.given[m], 4 * spare.points[m])
    for row in range(3):
        copy(spare.axis[row], pairs.axis[row], listed)
    for row in range(6):
        copy(spare.face[row], pairs.face[row], listed)
