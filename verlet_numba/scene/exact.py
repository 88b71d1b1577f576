"""Buffers of exact contact (effects/exact.py)."""

import numpy as np

from verlet_numba.buffers import NEARER, SPHERE, Contacts, Exact, Friction, Gaps, Listing, Points, Wholes, gate
from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.colliders import FIRST_ROOM, Solid
from verlet_numba.scene.numbering import Numbering, spread
from verlet_numba.scene.pieces import Placed, at_rest, body_surfaces, of_solid, pieces_of
from verlet_numba.scene.rigid import rigid_bodies
from verlet_numba.scene.sphere_trees import candidates_of, spacing, stack_of

LEAST_RADIUS = 1e-3     # of the deformable bodies' spacing: what has no thickness is still met from a distance
FLOOR = 0.02            # of it: the step that is allowed for even where nothing moves


def exact_of(bodies: list[Body], numbering: Numbering, found: list[Solid], contact: Contacts | None, together: Integers,
             inverse_mass: Floats, belongs: Integers, friction: Friction | None, itself: bool, side: float) -> Exact | None:
    """Exact contact of a scene's deformable bodies; None if they meet nothing.

    together (A, 2): particles that are attached; belongs (n,): rigid body or -1; itself: whether bodies meet themselves;
    side: the shortest stick of deformable bodies, m.
    """
    least, size = LEAST_RADIUS * side, len(inverse_mass)
    soft = list(body_surfaces(bodies, numbering, False, least))
    others = list(body_surfaces(bodies, numbering, True, least))
    corners, solids, radii = [np.zeros((0, 3))], [np.zeros(0, np.int64)], [np.zeros(0)]
    for s, solid in enumerate(found) if contact is not None else ():
        if (surface := of_solid(solid)) is not None:
            local = surface[0]
            others.append(Placed(surface[1], (size + sum(map(len, solids)) + np.arange(len(local)))[None]))
            corners.append(local)
            solids.append(np.full(len(local), s))
            radii.append(np.full(len(local), solid.extent[0] if solid.kind == SPHERE else 0.0))
    several = sum(len(placed.points) for placed in soft) > 1 or itself
    if not soft or (not several and not others):
        return None
    pieces = pieces_of(soft, others)
    points = points_of(bodies, numbering, found, np.concatenate(solids), np.concatenate(corners), np.concatenate(radii), together,
                       inverse_mass, belongs, friction, least)
    count = len(points.free)
    return Exact(pieces, points, 1 if itself else None, listing_of(pieces, count) if several else None,
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


def points_of(bodies: list[Body], numbering: Numbering, found: list[Solid], solid: Integers, local: Floats, rounding: Floats,
              together: Integers, inverse_mass: Floats, belongs: Integers, friction: Friction | None, least: float) -> Points:
    """The points: n particles, and the corners of colliders."""
    size, corners = len(inverse_mass), len(solid)
    count = size + corners
    deformable = spread(numbering, [float(not body.shape.rigid) for body in bodies], size) > 0
    radius = np.concatenate([spread(numbering, [0.0 if body.shape.rigid else max(body.shape.radius, least) for body in bodies],
                                    size), rounding])
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
    return Points(*(gate(np.zeros((count, 3)), np.float64) for _ in range(3)), gate(np.flatnonzero(deformable), np.int64),
                  gate(np.concatenate([np.where(deformable, inverse_mass, 0.0), np.zeros(corners)]), np.float64),
                  gate(moves, np.int64), gate(radius, np.float64),
                  None if friction is None else gate(coefficients(friction, found, solid), np.float64),
                  gate(joined(count, together), np.int64), gate(body, np.int64), gate(rest, np.float64),
                  gate(np.concatenate([whole, np.full(corners, -1)]), np.int64), gate(solid, np.int64), gate(local.T, np.float64))


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


def listing_of(pieces: object, count: int, room: int = FIRST_ROOM) -> Listing:
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
    """Room for twice as much of what was full: a list that could not be made, or else the gaps."""
    if exact is None:
        return None
    grown = {name: listing_of(exact.pieces, len(exact.points.free), 2 * len(listing.left))
             for name in ("among", "against") if (listing := getattr(exact, name)) is not None and listing.made[0] < 0}
    if not grown:
        grown["gaps"] = gaps_of(2 * len(exact.gaps.gap))
    return exact._replace(**grown)
