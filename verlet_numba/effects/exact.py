"""Exact contact of deformable bodies: vertices with triangles and edges with edges, among each other, with themselves, with
rigid bodies and with colliders, both ways.

Once a substep the closest points of features near each other are taken at its *start*, a state without intersections, and
the unit vector between them. After the relaxation these gaps are gone through once: what has come nearer than both radii
along that vector is moved apart, each point by its weight and inverse mass, rigid bodies as a whole, so that momentum is
kept. Contact has the last word, and what the substep itself has brought nearer is also what friction acts on; overlap that
stood already is shifted without becoming speed.

With `continuous_collision` gaps whose points go far are those at the time of impact (kernels/impact_time.py), and what only
passes by is let pass.

Opened by effects/open_gaps.py; what gaps do not keep apart is held back by effects/hold_back.py.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.buffers.arrays import NO_ROOM
from verlet_numba.kernels.near_features import find_gaps, list_features
from verlet_numba.kernels.pieces import list_pieces, update_edges, update_pieces

GROWTH = 1.25           # times the step that a point is about to take: how far it is expected to get, with the floor added
LASTING = 4.0           # steps that a list shall last
LEAST = 0.1             # of a gap: what a plane has to leave of it, and the mean step of a reach


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
def bring_now(position, now):
    """Where the particles are, as points."""
    for i in range(3):
        x = position[i]
        for k in range(x.size):
            now[k, i] = x[k]


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
    return find_again(exact, listing, 0)


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
    """Add the gaps that the present steps may close, from a new list if that is called for. among: as of `list_pieces`."""
    points = exact.points
    if outdated(listing):
        renew(points, exact.pieces, listing)
        exact.tally[0] += 1
        if among:
            update_edges(points.start, exact.pieces)
        if not (list_pieces(exact.pieces, among, exact.itself, listing.stack, listing.pairs)
                and list_features(points.start, points, exact.pieces, listing)):
            listing.made[0] = NO_ROOM
            return False
    return find_gaps(points, listing, exact.gaps, exact.continuous)


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
