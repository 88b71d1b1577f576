"""Resistance to bending: like a naive twin, keeping momenta, decaying as it says whatever the substeps and passes."""

import numpy as np
import pytest
import worlds

from verlet_numba.effects.bending import unbend
from verlet_numba.physics.hinge import angle
from verlet_numba.scene.bending import folds, rate

SHEET = {"kind": "cloth", "name": "sheet", "size": [0.6, 0.5], "resolution": [5, 4], "mass": 0.3, "position": [0, 0, 1]}
LINE = {"kind": "rope", "name": "line", "start": [0, 0, 0], "end": [0.5, 0, 0], "segments": 6, "mass": 0.2}
SLACK = LINE | {"name": "slack", "start": [0, 3, 0], "end": [0.4, 3, 0], "length": 0.6}
TOWELS = SHEET | {"name": "towels", "resolution": [3, 3], "count": 5, "scatter": {"inside": [[5, 5, 5], [9, 9, 9]]}}
LEAF = {"kind": "cloth", "name": "leaf", "size": [1, 1], "resolution": [2, 2], "diagonals": "one", "mass": 1}
TWIG = LINE | {"name": "twig", "segments": 2}
EXACT = {"rtol": 0, "atol": 1e-7}       # what the polynomial of the arc tangent and differences leave


def scene(*bodies, stiffness=0.5, substeps=8, passes=1, order="sequential", precision="float64", **effects):
    return {"time": {"duration": 1, "frame_rate": 60},
            "solver": {"substeps": substeps, "iterations": passes, "order": order, "precision": precision},
            "effects": {"bending": {"stiffness": stiffness}, "contact": "none", **effects}, "bodies": list(bodies),
            "output": {"precision": "float64"}}


def dihedral(a, b, c, d):
    """Of the triangles a b c and b a d; positive where c and d rise."""
    one, other = np.cross(b - a, c - a), np.cross(d - a, b - a)
    return np.arctan2(np.linalg.norm(b - a) * (other @ (c - a)), one @ other)


def opening(i, j, k):
    return np.arctan2(np.linalg.norm(np.cross(i - j, k - j)), (i - j) @ (k - j))


def angles_of(model):
    """Every angle as (function, particles in the order of the file, angle at the start)."""
    found, first = [], 0
    for body in model.bodies:
        for start in body.positions:
            corners = folds(body.shape) if body.shape.layout[0] == "grid" else [
                (k, k + 1, k + 2) for k in range(len(start) - 2)]
            of = dihedral if body.shape.layout[0] == "grid" else opening
            found += [(of, first + np.array(row), of(*start[list(row)])) for row in corners]
            first += len(start)
    return found


def slope(of, points):
    """(corners, 3) gradient by central differences."""
    found, step = np.zeros(points.shape), 1e-6
    for place in np.ndindex(points.shape):
        there, back = points.copy(), points.copy()
        there[place] += step
        back[place] -= step
        found[place] = (of(*there) - of(*back)) / (2 * step)
    return found


def corrected(of, points, masses, rest, owed):
    """The places of an angle's particles when so much of its error, owed(error), is taken away to first order."""
    error = (of(*points) - rest + np.pi) % (2 * np.pi) - np.pi
    gradient, weight = slope(of, points), 1 / masses[:, None]
    return points - owed(error) * weight * gradient / np.sum(weight * gradient**2)


def bent(model, seed=1, share=0.02):
    """Positions and previous positions (N, 3), off those of the start at random, pins apart."""
    rng = np.random.default_rng(seed)
    start = np.concatenate([body.positions.reshape(-1, 3) for body in model.bodies])
    return [start + share * rng.normal(size=start.shape) for _ in range(2)]


def lay(model, position, previous):
    order, particles = model.world.observed.scene_order, model.world.particles
    particles.position[:, order], particles.previous[:, order] = position.T, previous.T


def passes_over(model, count):
    particles = model.world.particles
    for again in range(count):
        unbend(again, particles.position, particles.previous, model.world.effects.bending)
    return particles.position[:, model.world.observed.scene_order].T.astype(float)


@pytest.mark.parametrize(("body", "precision"), [(LEAF, "float64"), (TWIG, "float64"), (LEAF, "float32"), (TWIG, "float32")])
def test_an_angle_is_that_of_the_twin(body, precision):
    """Alone, over three passes, between which another constraint moves a particle."""
    model = worlds.started(scene(body, precision=precision))
    (of, row, rest), = angles_of(model)
    position, previous = bent(model, share=0.1)
    lay(model, position, previous)
    masses, x = model.world.observed.mass[row], rate(0.5) / 8
    before, given, push = of(*previous[row]) - rest, 0.0, np.array([0, 0, 0.01])
    for again in range(3):
        error = of(*position[row]) - rest
        by = (x**2 * error + 2 * x * (error - before) - given) / (1 + x) ** 2
        position[row] = corrected(of, position[row], masses, rest, lambda error, by=by: by)
        given += by
        unbend(again, model.world.particles.position, model.world.particles.previous, model.world.effects.bending)
        position[row[0]] += push
        model.world.particles.position[:, model.world.observed.scene_order[row[0]]] += push
    found = model.world.particles.position[:, model.world.observed.scene_order].T
    np.testing.assert_allclose(found, position, rtol=0, atol=1e-6 if precision == "float32" else 1e-7)


@pytest.mark.parametrize("order", ["sequential", "lines"])
def test_all_angles_have_their_turn(order):
    """With stiffness 1 each is put right in its turn; those of a run share no particle, so they may be done in any order."""
    model = worlds.started(scene(SHEET, LINE, SLACK, TOWELS, stiffness=1, order=order))
    position, previous = bent(model)
    lay(model, position, previous)
    found = passes_over(model, 1)
    hinges = model.world.effects.bending.hinges
    place = {int(p): k for k, p in enumerate(model.world.observed.scene_order)}
    rest, masses = {tuple(row): rest for _, row, rest in angles_of(model)}, model.world.observed.mass
    seen = []
    for r in range(hinges.lanes.size):
        for m in range(hinges.lanes[r]):
            if hinges.weight[:, hinges.data[r] + m].any():
                seen.append(tuple(place[int(first) + m] for first in hinges.first[:, r]))
    assert sorted(seen) == sorted(row for row in rest if len(row) == 4)
    for row in [*seen, *(row for row in rest if len(row) == 3)]:
        of = dihedral if len(row) == 4 else opening
        position[list(row)] = corrected(of, position[list(row)], masses[list(row)], rest[row], lambda error: error)
    np.testing.assert_allclose(found, position, **EXACT | {"atol": 1e-6})


def test_momenta_are_kept():
    """The sums of m dx and of m x cross dx over the places before, angle by angle, vanish."""
    for body in (LEAF, TWIG):
        model = worlds.started(scene(body))
        before, previous = bent(model, share=0.2)
        lay(model, before, previous)
        moved = passes_over(model, 1) - before
        mass = model.world.observed.mass[:, None]
        assert np.abs(moved).max() > 1e-3
        np.testing.assert_allclose(np.sum(mass * moved, axis=0), 0, atol=1e-15)
        np.testing.assert_allclose(np.sum(np.cross(before, mass * moved), axis=0), 0, atol=1e-15)


def test_free_cloth_keeps_momentum_and_angular_momentum():
    """Spinning, crumpled by a centimetre; angular momentum but for what Verlet's steps make of it."""
    model = worlds.started(scene(SHEET | {"angular_velocity": [3, 1, 2], "velocity": [1, 0, 0]}, substeps=32))
    order, particles = model.world.observed.scene_order, model.world.particles
    for points in (particles.position, particles.previous):
        points[:, order] += 0.01 * np.random.default_rng(1).normal(size=(3, len(order)))
    _, _, measures = worlds.advanced(model, 60)
    momentum, angular = measures[1:, 3:6], measures[1:, 6:9]
    np.testing.assert_allclose(momentum, momentum[:1].repeat(59, 0), rtol=0, atol=1e-12)
    assert np.abs(angular - angular[0]).max() < 5e-3 * np.linalg.norm(angular[0])
    assert measures[1:, 0].max() < 1.01 * measures[1, 0]


def folded(body, by, **keys):
    """A single angle that starts at rest, `by` off its own rest, in a run of three frames: the part of that left in each."""
    model = worlds.started(scene(body, **keys))
    (of, row, rest), = angles_of(model)
    start = model.bodies[0].positions[0].copy()
    if of is dihedral:
        a, b = start[row[:2]]
        e = (b - a) / np.linalg.norm(b - a)
        for p in row[2:]:
            along = a + ((start[p] - a) @ e) * e
            reach = np.linalg.norm(start[p] - along)
            start[p] = along + (start[p] - along) * np.cos(by / 2) + [0, 0, reach * np.sin(by / 2)]
    else:
        arm = np.linalg.norm(start[row[2]] - start[row[1]])
        start[row[2]] = start[row[1]] + [arm * np.cos(by), 0, arm * np.sin(by)]
    lay(model, start, start)
    position, _, _ = worlds.advanced(model, 4)
    return np.array([(of(*points[row]) - rest) / (of(*start[row]) - rest) for points in position])


@pytest.mark.parametrize("body", [LEAF, TWIG], ids=["hinge", "joint"])
@pytest.mark.parametrize("stiffness", [0.2, 0.5, 0.9])
def test_an_angle_decays_as_it_says(body, stiffness):
    """From rest as (1 + x) exp(-x), a frame removing `stiffness` of it; more substeps come nearer in proportion."""
    x = rate(stiffness) * np.arange(4)
    closed = (1 + x) * np.exp(-x)
    assert closed[1] == pytest.approx(1 - stiffness)
    errors = [np.abs(folded(body, 0.1, stiffness=stiffness, substeps=k) - closed).max() for k in (8, 16, 32, 64)]
    assert errors[0] < 0.06
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1, atol=0.25)


@pytest.mark.parametrize("body", [LEAF, TWIG], ids=["hinge", "joint"])
def test_passes_and_precision_change_nothing(body):
    once = folded(body, 0.1)
    np.testing.assert_allclose(folded(body, 0.1, passes=4), once, rtol=0, atol=3e-3)
    np.testing.assert_allclose(folded(body, 0.1, precision="float32"), once, rtol=0, atol=3e-3)


@pytest.mark.parametrize("substeps", [1, 8])
def test_full_stiffness_is_rigid(substeps):
    assert np.abs(folded(LEAF, 0.1, stiffness=1, substeps=substeps)[1:]).max() < 0.01


def test_a_shelf_sags_as_far_whatever_the_substeps_and_passes():
    """A rope held by its first two particles, without bending it would hang straight down."""
    shelf = LINE | {"segments": 4, "pinned": [0, 1]}
    ends = []
    for substeps, passes in ((16, 1), (32, 1), (64, 1), (16, 4)):
        model = worlds.started(scene(shelf, substeps=substeps, passes=passes, stiffness=0.2, gravity=[0, 0, -9.81], damping=20))
        ends.append(worlds.advanced(model, 200)[0][-1, -1])
    assert -0.3 < ends[0][2] < -0.1
    np.testing.assert_allclose(ends[:3], ends[:1] * 3, rtol=0, atol=5e-3)
    np.testing.assert_allclose(ends[3], ends[0], rtol=0, atol=5e-3)


def test_pins_stay():
    model = worlds.started(scene(SHEET | {"pinned": [0, 7]}, LINE | {"pinned": [3]}))
    position, previous = bent(model)
    lay(model, position, previous)
    found = passes_over(model, 2)
    held = [0, 7, 20 + 3]
    assert (found[held] == position[held]).all()
    assert (found != position).any(axis=1).sum() > 20


def test_nothing_stiff_is_absent():
    """Stiffness 0, bodies that cannot bend, or no such effect: the same bits."""
    absent = scene(SHEET, LINE)
    del absent["effects"]["bending"]
    models = [worlds.started(absent), worlds.started(scene(SHEET, LINE, stiffness=0))]
    assert all(model.world.effects.bending is None for model in models)
    assert worlds.built(scene(LINE | {"segments": 1}, worlds.CRATE)).world.effects.bending is None
    runs = [worlds.advanced(model, 10)[0] for model in models]
    assert (runs[0] == runs[1]).all()


def test_a_body_alone_is_a_body_among_others():
    alone = worlds.started(scene(SHEET | {"velocity": [0, 0, 1]}, gravity=[1, 0, -9.81]))
    among = worlds.started(scene(LINE, TOWELS, SHEET | {"velocity": [0, 0, 1]}, gravity=[1, 0, -9.81]))
    for model in (alone, among):
        first = model.particles - 20
        place = model.world.observed.scene_order[first:]
        model.world.particles.position[2, place] += 0.05 * np.sin(np.arange(20))
    one, other = (worlds.advanced(model, 5)[0][:, -20:] for model in (alone, among))
    assert (one == other).all()


def test_angles_of_vectors():
    turns = np.linspace(-3.1, 3.1, 401)
    found = [angle(2.5 * np.cos(t), 2.5 * np.sin(t)) for t in turns]
    np.testing.assert_allclose(found, turns, **EXACT)
    assert angle(0.0, 0.0) == 0.0


def test_rate_of_a_stiffness():
    assert [rate(0.0), rate(1.0)] == [0.0, np.inf]
    assert np.isfinite(rate(1 - 1e-15))
