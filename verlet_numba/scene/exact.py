"""Buffers of exact contact (effects/exact.py)."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import NO_ROOM, gate
from verlet_numba.buffers.contact import BOX, CYLINDER, SPHERE, Contacts, Friction
from verlet_numba.buffers.exact import NEARER, Exact, Gaps, Listing, Pieces, Points, Wholes
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import FIRST_ROOM, Solid
from verlet_numba.scene.numbering import Numbering, spread
from verlet_numba.scene.pieces import Placed, at_rest, body_surfaces, of_solid, pieces_of
from verlet_numba.scene.rigid import rigid_bodies
from verlet_numba.scene.slipping import width
from verlet_numba.scene.sphere_trees import candidates_of, spacing, stack_of

LEAST_RADIUS = 1e-3     # of the deformable bodies' spacing: what has no thickness is still met from a distance
FLOOR = 0.02            # of it: the step that is allowed for even where nothing moves
RAPID = 0.25            # of the least thickness of rigid bodies and colliders: what goes farther in a substep is followed
SHORT = 0.1             # of that: how far from each other rigid bodies are stopped, as they turn meanwhile
SIZES = {BOX: 3, SPHERE: 1, CYLINDER: 2}        # how many entries of their extent are half of a thickness


def exact_of(bodies: list[Body], numbering: Numbering, found: list[Solid], contact: Contacts | None, together: Integers,
             inverse_mass: Floats, belongs: Integers, friction: Friction | None, itself: bool, continuous: bool, thick: bool,
             side: float) -> Exact | None:
    """Exact contact of a scene's deformable bodies; None if they meet nothing.

    together (A, 2): particles that are attached; belongs (n,): rigid body or -1; itself: whether bodies meet themselves;
    continuous: whether impacts are sought along the step; thick: whether radii count, or bodies meet as surfaces without any;
    side: the shortest stick of deformable bodies, m.
    """
    least, size = LEAST_RADIUS * side, len(inverse_mass)
    if not thick:
        bodies = [replace(body, shape=replace(body.shape, radius=0.0)) for body in bodies]
    soft = list(body_surfaces(bodies, numbering, False, least))
    others = list(body_surfaces(bodies, numbering, True, least))
    corners = corners_of(found if contact is not None else [], size)
    others += corners.placed
    several = sum(len(placed.points) for placed in soft) > 1 or itself
    if not soft or (not several and not others):
        return None
    pieces = pieces_of(soft, others)
    points = points_of(bodies, numbering, found, corners, together, inverse_mass, belongs, friction, least)
    count = len(points.free)
    return Exact(pieces, points, 1 if itself else None, 1 if continuous else None, listing_of(pieces, count) if several else None,
                 listing_of(pieces, count) if others else None, gaps_of(FIRST_ROOM), wholes_of(bodies, numbering),
                 gate(np.ones(count), np.float64), gate(np.zeros(3), np.float64), gate(np.zeros(3), np.float64), FLOOR * side,
                 least_reach(bodies, least), gate(np.zeros(3), np.int64))


def least_reach(bodies: list[Body], least: float) -> float:
    """How near features of deformable bodies may come, at the least, m: by their radii, or by their distance at rest."""
    found = [np.inf]
    for body in bodies:
        shape = body.shape
        if not shape.rigid:
            found.append(2 * max(shape.radius, least))
            if shape.layout[0] == "grid":
                found.append(NEARER * float(np.prod(spacing(shape))) / float(np.hypot(*spacing(shape))))
            elif shape.segments:
                found.append(NEARER * float(shape.lengths.min(initial=np.inf)) if shape.layout[0] == "line" else 0.0)
    return min(found)


def rapid_of(bodies: list[Body], numbering: Numbering, found: list[Solid], contact: Contacts | None, inverse_mass: Floats,
             belongs: Integers) -> Exact | None:
    """What stops rigid bodies that go far; None if there is none that may meet another one or a collider but planes."""
    size, rigid = len(inverse_mass), list(body_surfaces(bodies, numbering, True, 0.0))
    corners, count = corners_of(found if contact is not None else [], size), sum(len(placed.points) for placed in rigid)
    if not (inverse_mass[belongs >= 0] > 0).any() or count + len(corners.placed) < 2:
        return None
    pieces = pieces_of(rigid, corners.placed)
    points = points_of(bodies, numbering, found, corners, np.zeros((0, 2), np.int64), inverse_mass, belongs, None, 0.0)
    total, wide = len(points.free), [width(body.shape) for body in bodies if body.shape.rigid]
    far = RAPID * min(wide + [2 * min(solid.extent[:SIZES[solid.kind]]) for solid in found if solid.kind in SIZES])
    return Exact(pieces, points, None, 1, listing_of(pieces, total) if count > 1 else None,
                 listing_of(pieces, total) if corners.placed else None, gaps_of(FIRST_ROOM), wholes_of(bodies, numbering),
                 gate(np.ones(total), np.float64), gate(np.zeros(3), np.float64), gate(np.zeros(3), np.float64), SHORT * far,
                 far, gate(np.zeros(3), np.int64))


class Corners(NamedTuple):
    """The corners of colliders, numbered from n on: their surfaces, and of each its collider, place and radius."""

    placed: list[Placed]
    solid: Integers
    local: Floats
    rounding: Floats


def corners_of(found: list[Solid], size: int) -> Corners:
    """Of all colliders but planes, which vertices meet."""
    placed, local, solid, rounding = [], [np.zeros((0, 3))], [np.zeros(0, np.int64)], [np.zeros(0)]
    for s, each in enumerate(found):
        if (surface := of_solid(each)) is not None:
            placed.append(Placed(surface[1], (size + sum(map(len, solid)) + np.arange(len(surface[0])))[None]))
            local.append(surface[0])
            solid.append(np.full(len(surface[0]), s))
            rounding.append(np.full(len(surface[0]), each.extent[0] if each.kind == SPHERE else 0.0))
    return Corners(placed, np.concatenate(solid), np.concatenate(local), np.concatenate(rounding))


def points_of(bodies: list[Body], numbering: Numbering, found: list[Solid], corner: Corners, together: Integers,
              inverse_mass: Floats, belongs: Integers, friction: Friction | None, least: float) -> Points:
    """The points: n particles, and the corners of colliders."""
    size, corners = len(inverse_mass), len(corner.solid)
    count = size + corners
    deformable = spread(numbering, [float(not body.shape.rigid) for body in bodies], size) > 0
    radius = np.concatenate([spread(numbering, [0.0 if body.shape.rigid else max(body.shape.radius, least) for body in bodies],
                                    size), corner.rounding])
    body, rest, number = np.full(count, -1), np.zeros((count, 3)), 0
    for each, index in zip(bodies, numbering.bodies, strict=True):
        if not each.shape.rigid:
            body[index] = number + np.arange(len(index))[:, None]
            rest[index] = at_rest(each.shape)
            number += len(index)
    moves = np.concatenate([inverse_mass > 0, np.zeros(corners, bool)])
    held = np.zeros(int(belongs.max(initial=-1)) + 2, bool)
    held[belongs[inverse_mass > 0]] = True
    whole = np.where((belongs >= 0) & held[belongs], belongs, -1)
    start, now, shift = (gate(np.zeros((count, 3)), np.float64) for _ in range(3))
    own = None if friction is None else gate(coefficients(friction, found, corner.solid), np.float64)
    return Points(start=start, now=now, shift=shift, soft=gate(np.flatnonzero(deformable), np.int64),
                  free=gate(np.concatenate([np.where(deformable, inverse_mass, 0.0), np.zeros(corners)]), np.float64),
                  moves=gate(moves, np.int64), radius=gate(radius, np.float64), friction=own,
                  same=gate(joined(count, together), np.int64), body=gate(body, np.int64), rest=gate(rest, np.float64),
                  whole=gate(np.concatenate([whole, np.full(corners, -1)]), np.int64), solid=gate(corner.solid, np.int64),
                  local=gate(corner.local.T, np.float64))


def coefficients(friction: Friction, found: list[Solid], solid: Integers) -> Floats:
    """(2, A) static and dynamic. The centre of a ball does not turn with it: of balls vertices alone feel friction."""
    of_corners = friction.solid[:, solid].copy()
    of_corners[:, [found[s].kind == SPHERE for s in solid]] = 0.0
    return np.concatenate([np.asarray(friction.particle, float), of_corners], axis=1)


def joined(count: int, together: Integers) -> Integers:
    """(A,) the first of the points that each is held together with."""
    same = np.arange(count)
    for i, j in np.sort(together, axis=1):
        one, other = sorted((same[i], same[j]))
        same[same == other] = one
    return same


def wholes_of(bodies: list[Body], numbering: Numbering) -> Wholes | None:
    """Rigid bodies, none weighed yet."""
    index = [copy for _, copies in rigid_bodies(bodies, numbering) for copy in copies]
    if not index:
        return None
    return Wholes(gate([own[0] for own in index], np.int64), gate([own[1] - own[0] for own in index], np.int64),
                  gate([len(own) for own in index], np.int64), gate(np.zeros((len(index), 10)), np.float64),
                  gate(np.zeros(len(index)), np.int64))


def listing_of(pieces: Pieces, count: int, room: int = FIRST_ROOM) -> Listing:
    """Room for so many pairs of pieces and of features, none looked for yet."""
    return Listing(stack_of(pieces), candidates_of(room), gate([-1], np.int64), gate(np.zeros((room, 4)), np.int64),
                   gate(np.zeros(room), np.int64), gate(np.zeros(room), np.float64), gate(np.zeros(room), np.float64),
                   *(gate(np.zeros(count), np.float64) for _ in range(3)))


def gaps_of(room: int) -> Gaps:
    """Room for so many gaps."""
    return Gaps(gate(np.zeros(1), np.int64), gate(np.zeros((room, 4)), np.int64), gate(np.zeros(room), np.int64),
                gate(np.zeros((room, 4)), np.float64), gate(np.zeros((room, 3)), np.float64),
                *(gate(np.zeros(room), np.float64) for _ in range(3)))


def roomier_exact(exact: Exact | None) -> Exact | None:
    """Room for twice as much of what had too little: a list of pairs, or the gaps."""
    if exact is None:
        return None
    size, among, against = len(exact.points.free), exact.among, exact.against
    if among is not None and among.made[0] == NO_ROOM:
        return exact._replace(among=listing_of(exact.pieces, size, 2 * len(among.left)))
    if against is not None and against.made[0] == NO_ROOM:
        return exact._replace(against=listing_of(exact.pieces, size, 2 * len(against.left)))
    if exact.gaps.listed[0] == NO_ROOM:
        return exact._replace(gaps=gaps_of(2 * len(exact.gaps.gap)))
    return exact
