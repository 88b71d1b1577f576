"""Which bodies overlap where they start, and how deeply. Scattered copies are placed clear of everything."""

from collections.abc import Iterator

import numpy as np

from verlet_numba.scene.body import Body, Floats, Integers
from verlet_numba.scene.clearance import Surface, hull_clearance, planes
from verlet_numba.scene.hulls import hulls_in_place
from verlet_numba.scene.problems import Path as Key
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.shapes import edges

TOUCH = 1e-6            # of the smaller body's size: overlap up to this is touching
RECOVERY = 2.5          # 1/s: how fast whole bodies give an overlap back, in radii of the smaller one (effects/aim.py)
MOST_BODIES = 2000      # more bodies than this, and
MOST_AXES = 50_000      # pairs with more candidate axes than this, are not compared
CHUNK = 2_000_000       # pairs of points looked at together


def overlaps(scene: Scene, bodies: list[Body]) -> Iterator[tuple[Key, str]]:
    """Pairs of bodies that overlap at the start, except those attached to each other, under the later one's path."""
    once = [index for index, entry in enumerate(scene.bodies) if not entry.scatter]
    if not 2 <= len(once) <= MOST_BODIES:
        return
    attached = {frozenset((a, b)) for a, _, b, _ in scene.attachments}
    points = [bodies[index].positions[0] for index in once]
    radii = np.array([bodies[index].shape.radius for index in once])[:, None]
    lower = np.array([p.min(axis=0) for p in points]) - radii
    upper = np.array([p.max(axis=0) for p in points]) + radii
    meet = ((lower[:, None] < upper) & (lower < upper[:, None])).all(axis=2)
    for second, first in np.argwhere(np.tril(meet, -1)).tolist():
        a, b = bodies[once[first]], bodies[once[second]]
        if frozenset((a.name, b.name)) in attached or (a.pinned.all() and b.pinned.all()):
            continue
        smaller = min((upper[index] - lower[index]).max() for index in (first, second))
        depth = overlap_depth(a, b)
        if depth > TOUCH * smaller:
            yield ("bodies", once[second]), (f"overlaps body {a.name} at the start, by {depth:.3g} m: "
                                              f"{consequence(scene, a.shape.rigid, b.shape.rigid)}")


def consequence(scene: Scene, *rigid: bool) -> str:
    """What becomes of two bodies that overlap at the start."""
    if not any(rigid):
        return "the first step pushes them apart"
    if scene.solver.response == "feature":
        return "the first steps throw them apart"
    return f"they part slowly, by {RECOVERY:g} times the radius of the smaller rigid one a second"


def overlap_depth(a: Body, b: Body) -> float:
    """How deeply the first copies of two bodies overlap, m; 0 if they do not, as far as it can be told cheaply.

    Rigid bodies are compared as convex parts, a rigid and another one by the other's particles, and the rest by their
    particles alone.
    """
    radius = a.shape.radius + b.shape.radius
    if a.shape.rigid and b.shape.rigid:
        parts = hulls_in_place(b)
        return max(hull_overlap(p, q) for p in hulls_in_place(a) for q in parts)
    if a.shape.rigid or b.shape.rigid:
        solid, soft = (a, b) if a.shape.rigid else (b, a)
        apart = min(float(hull_clearance(*hull, soft.positions[0]).min()) for hull in hulls_in_place(solid))
        return max(0.0, radius - apart)
    return max(0.0, radius - _distance(a.positions[0], b.positions[0], radius)) if radius > 0 else 0.0


def _distance(a: Floats, b: Floats, limit: float) -> float:
    """The least distance between two sets of points, `limit` if it is larger; only where their boxes meet is looked."""
    a = a[((a >= b.min(axis=0) - limit) & (a <= b.max(axis=0) + limit)).all(axis=1)]
    if len(a):
        b = b[((b >= a.min(axis=0) - limit) & (b <= a.max(axis=0) + limit)).all(axis=1)]
    nearest = limit
    chunk = max(1, CHUNK // max(1, len(b)))
    for start in range(0, len(a) if len(b) else 0, chunk):
        nearest = min(nearest, float(np.linalg.norm(a[start:start + chunk, None] - b, axis=2).min()))
    return nearest


def hull_overlap(a: Surface, b: Surface) -> float:
    """Depth by which two convex polyhedra overlap: the least overlap of their shadows on the axes that can part them.

    Those are the normals of the faces of both, and the cross products of an edge of one and an edge of the other.
    """
    p, q = a[0], b[0]
    depth = _shared(p, q, np.concatenate([planes(*a)[0], planes(*b)[0]]))
    if depth == 0:
        return 0.0
    u, v = _directions(*a), _directions(*b)
    if len(u) * len(v) > MOST_AXES:
        return 0.0
    axes = np.cross(u[:, None], v).reshape(-1, 3)
    length = np.linalg.norm(axes, axis=1)
    parting = length > 1e-9
    return min(depth, _shared(p, q, axes[parting] / length[parting, None]))


def _shared(p: Floats, q: Floats, axes: Floats) -> float:
    """The least overlap of the shadows of two sets of points on unit vectors (A, 3), 0 if some do not overlap."""
    on_p, on_q = p @ axes.T, q @ axes.T
    shared = np.minimum(on_p.max(axis=0) - on_q.min(axis=0), on_q.max(axis=0) - on_p.min(axis=0))
    return max(0.0, float(shared.min(initial=np.inf)))


def _directions(positions: Floats, triangles: Integers) -> Floats:
    """Unit directions (E, 3) of a hull's edges, parallel ones once."""
    ends = positions[edges(triangles)]
    direction = ends[:, 1] - ends[:, 0]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    dominant = np.argmax(np.abs(direction), axis=1)
    direction *= np.sign(np.take_along_axis(direction, dominant[:, None], axis=1))
    _, first = np.unique(np.round(direction, 9), axis=0, return_index=True)
    return np.asarray(direction[first])
