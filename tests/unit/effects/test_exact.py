"""Exact contact: gaps of all features near each other, momentum, friction, and the bound that lets nothing pass."""

import json

import numpy as np
import pytest
import worlds

from verlet_numba.effects.exact import deepest_gap, find_exact, pushing_gaps
from verlet_numba.effects.hold_back import limit_exact
from verlet_numba.effects.open_gaps import part_exact
from verlet_numba.kernels.impact_time import apart_at
from verlet_numba.scene.crossing import crossings
from verlet_numba.scene.exact import roomier_exact

CLOTH = {"kind": "cloth", "name": "sheet", "size": [0.5, 0.4], "resolution": [6, 5], "mass": 0.3, "thickness": 0.03}
OTHER = {**CLOTH, "name": "other", "position": [0.03, 0.02, 0.05], "rotation": {"axis": [1, 2, 3], "degrees": 40}}
ROPE = {"kind": "rope", "name": "line", "start": [-0.4, 0.1, 0.03], "end": [0.4, 0.05, -0.03], "segments": 7, "mass": 0.2,
        "thickness": 0.02}
NET = {"kind": "particles", "name": "net", "positions": [[0, 0, 0.04], [0.2, 0, 0.05], [0.1, 0.2, 0.04], [0.3, 0.3, 0.1]],
       "masses": [1, 2, 3, 4], "sticks": [[0, 1], [1, 2], [2, 0]], "radius": 0.01, "contact_geometry": "segments"}
BOX = {"kind": "box", "size": [0.2, 0.3, 0.1], "position": [0.1, 0, -0.05]}
BALL = {"kind": "sphere", "radius": 0.1, "position": [-0.1, 0.1, 0.1]}
TUBE = {"kind": "cylinder", "radius": 0.05, "axis": [1, 1, 0], "length": 0.4, "position": [0, 0, 0.1]}
DIE = {"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 0.5, "position": [0.05, 0.02, 0.06]}
SCENES = {"cloth": ([CLOTH, OTHER], []), "ropes": ([CLOTH, ROPE, {**ROPE, "name": "more", "start": [0, -0.4, 0.02]}, NET], []),
          "colliders": ([CLOTH, ROPE], [BOX, BALL, TUBE]), "rigid": ([CLOTH, ROPE, NET, DIE], [])}


class Case:
    """Bodies near each other whose particles have made random steps; the arguments of the effect's kernels."""

    def __init__(self, name, step=0.01, seed=0, friction=0.4, **effects):
        bodies, colliders = SCENES[name]
        scene = {"time": {"duration": 1}, "solver": {"deformable_contact": "exact"}, "bodies": bodies, "colliders": colliders,
                 "effects": {"self_collision": True, "friction": friction, **effects}}
        self.model = worlds.started(json.loads(json.dumps(scene)))
        world = self.model.world
        self.position, self.previous, self.inverse_mass, _ = world.particles
        rng = np.random.default_rng(seed)
        self.position += rng.normal(size=self.position.shape) * step / 3 * (self.inverse_mass > 0)
        self.previous[:] = self.position
        self.position += rng.normal(size=self.position.shape) * step * (self.inverse_mass > 0)
        self.contact, self.exact = world.effects.contact, world.effects.exact

    def find(self):
        while not find_exact(self.position, self.previous, self.contact, self.exact):
            self.exact = roomier_exact(self.exact)
        return self

    def part(self):
        part_exact(self.position, self.previous, self.inverse_mass, None, self.exact)

    def momentum(self, places):
        moving = self.inverse_mass > 0
        mass = 1 / self.inverse_mass[moving]
        return (places[:, moving] * mass).sum(axis=1)

    def features(self):
        """All pairs of features that may meet: (a, b, c, d, edges)."""
        pieces = self.exact.pieces
        trees = [np.arange(pieces.root[t], pieces.root[t + 1]) for t in range(len(pieces.root) - 1)]
        owned = [pieces.piece[nodes][pieces.piece[nodes] >= 0] for nodes in trees]

        def of(tree, start, what):
            return [(e, *np.atleast_1d(what.T[k])) for e in owned[tree] for k in range(start[e], start[e + 1])]

        for t in range(pieces.soft):
            for u in range(t, len(trees)):
                v, w = (of(k, pieces.vertices, pieces.vertex) for k in (t, u))
                f, g = (of(k, pieces.triangles, pieces.triangle) for k in (t, u))
                d, e = (of(k, pieces.edges, pieces.edge) for k in (t, u))
                pairs = [(a, b, 0) for a in v for b in g] + [(a, b, 0) for a in w for b in f if u > t]
                pairs += [(a, b, 1) for i, a in enumerate(d) for b in (e if u > t else e[i + 1:])
                          if not (a[1] == a[2] and g) and not (b[1] == b[2] and f)]
                yield from ((*a[1:], *b[1:], edges) for a, b, edges in pairs)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.validate] * (name == "colliders")) for name in SCENES])
def test_every_pair_that_could_touch_is_found(name):
    """What the trees find is what all pairs give, and closest points are those of physics/closest.py."""
    case = Case(name).find()
    exact, points, gaps = case.exact, case.exact.points, case.exact.gaps
    found = {(*map(int, gaps.point[g]), int(gaps.edges[g])): g for g in range(gaps.listed[0])}
    assert len(found) == gaps.listed[0] > 10
    count = 0
    for a, b, c, d, edges in case.features():
        one, two = ({a, b}, {c, d}) if edges else ({a}, {b, c, d})
        if one & two or not any(points.moves[k] for k in one | two):
            continue
        weight = apart_at(0.0, points.start, points.start, a, b, c, d, edges)
        distance, reach = weight[7], points.radius[a] + points.radius[d]
        if points.body[a] >= 0 and points.body[a] == points.body[d]:
            reach = min(reach, 0.5 * apart_at(0.0, points.rest, points.rest, a, b, c, d, edges)[7])
        listing = exact.among if max(points.body[[a, d]] < 0) == 0 else exact.against
        near = distance - reach < max(listing.step[list(one)]) + max(listing.step[list(two)])
        keys = [(a, b, c, d, edges)] + [(c, d, a, b, 1)] * edges
        match = [found[key] for key in keys if key in found]
        assert bool(match) == (near and distance > 0), (a, b, c, d, edges)
        if match:
            count += 1
            g = match[0]
            across = gaps.weight[g] @ points.start[gaps.point[g]]
            np.testing.assert_allclose(np.linalg.norm(across), distance, rtol=1e-9)
            np.testing.assert_allclose(gaps.normal[g], across / distance, atol=1e-6)
            assert gaps.reach[g] == pytest.approx(reach)
    assert count == len(found)


def twin(case):
    """Gaps opened one after another, the last first, as vectors: positions (A, 3) and shifts after it, of particles alone."""
    points, gaps = case.exact.points, case.exact.gaps
    n = case.position.shape[1]
    now, start, free = points.now.copy(), points.start, points.free
    now[:n] = case.position.T
    shift = np.zeros_like(now)
    for g in range(gaps.listed[0] - 1, -1, -1):
        k, w, normal = gaps.point[g], gaps.weight[g], gaps.normal[g]
        push = gaps.reach[g] - normal @ (w @ now[k])
        give = (w**2 * free[k]).sum()
        if push <= 0 or give <= 0:
            continue
        fresh = push - min(push, max(0.0, gaps.reach[g] - gaps.gap[g]))
        slide = w @ (now[k] - start[k])
        slide -= normal * (normal @ slide)
        mu = points.friction[:, k[0]] * points.friction[:, k[3]]
        static, dynamic = np.sqrt(mu)
        size = np.linalg.norm(slide)
        share = 0.0 if size == 0 else 1.0 if size <= static * fresh else dynamic * fresh / size
        move = (push * normal - share * slide) / give
        for point, weight in zip(k, w, strict=True):
            now[point] += weight * free[point] * move
            shift[point] += weight * free[point] * (push - fresh) * normal / give
    return now[:n].T, shift[:n].T


@pytest.mark.parametrize("name", ["cloth", "ropes", pytest.param("colliders", marks=pytest.mark.validate)])
def test_gaps_open_as_the_twin_says(name):
    case = Case(name).find()
    position, shift = twin(case)
    before = case.previous.copy()
    case.part()
    np.testing.assert_allclose(case.position, position, atol=1e-13)
    np.testing.assert_allclose(case.previous, before + shift, atol=1e-13)
    assert pushing_gaps(case.exact) > 3
    assert deepest_gap(case.exact) > 0


@pytest.mark.parametrize("name", ["cloth", "ropes", "rigid"])
def test_momentum_is_kept(name):
    """Of all bodies together, whatever friction and overlap: to rounding."""
    case = Case(name, friction=0.8).find()
    before = [case.momentum(places) for places in (case.position, case.previous)]
    old = case.position.copy()
    case.part()
    assert np.abs(case.position - old).max() > 1e-3
    for places, momentum in zip((case.position, case.previous), before, strict=True):
        np.testing.assert_allclose(case.momentum(places), momentum, rtol=0, atol=1e-12)


def test_a_rigid_body_moves_as_a_whole():
    """To first order: its sticks change with the square of what it turns by."""
    case = Case("rigid").find()
    die = case.model.numbering.bodies[3][0]
    before, old = np.linalg.norm(np.diff(case.position[:, die], axis=1), axis=0), case.position.copy()
    case.part()
    moved = np.linalg.norm(case.position[:, die] - old[:, die], axis=0).max()
    assert moved > 1e-4
    after = np.linalg.norm(np.diff(case.position[:, die], axis=1), axis=0)
    assert np.abs(after / before - 1).max() < 10 * (moved / 0.1)**2


def test_the_same_anywhere():
    """Moved by a power of two all is found and moved as before."""
    places = []
    for shift in (0.0, 64.0):
        case = Case("cloth")
        for array in (case.position, case.previous):
            array[:] = np.round(array * 2**30) / 2**30 + shift
        case.find().part()
        places.append(case.position - shift)
    np.testing.assert_allclose(places[0], places[1], atol=1e-12)


@pytest.mark.parametrize("continuous", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step", [0.02, 0.3])
def test_nothing_passes_through(step, seed, continuous):
    """However far points would go, on the ways that they are left with no edge ever passes through a triangle.

    Two sheets apart at the start; particles aim anywhere. Judged at 60 moments of the way.
    """
    case = Case("cloth", continuous_collision=continuous)
    sheet, other = (index[0] for index in case.model.numbering.bodies)
    i, j = np.meshgrid(np.arange(6), np.arange(5), indexing="ij")
    flat = np.stack([0.1 * i.ravel(), 0.1 * j.ravel(), np.zeros(30)])
    case.previous[:, sheet], case.previous[:, other] = flat, flat + np.array([[0.03], [0.02], [0.035]])
    case.position[:] = case.previous + np.random.default_rng(seed).normal(size=case.position.shape) * step
    case.position[:, case.inverse_mass == 0] = case.previous[:, case.inverse_mass == 0]
    triangles = np.concatenate([index[0][body.shape.triangles] for body, index in
                                zip(case.model.bodies, case.model.numbering.bodies, strict=True)])
    case.find()
    case.part()
    limit_exact(case.position, case.exact)
    start = case.exact.points.start[:case.position.shape[1]]
    for t in np.linspace(0, 1, 60):
        places = start + t * (case.position.T - start)
        assert len(crossings(places, triangles)[1]) == 0
