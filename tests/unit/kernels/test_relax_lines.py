"""Chains relaxed as a whole, as scenes lay them out, against the naive twin with its dense matrices."""

import numpy as np
import pytest
import worlds
from reference_constraints import Stick, chains, relax_pieces

from verlet_numba.kernels.relax import forget
from verlet_numba.kernels.relax_lines import relax_lines

PASSES = 3
TOLERANCE = {"float64": 1e-9, "float32": 2e-3}
WAYS = [(0.0, "exact", False), (0.02, "exact", False), (0.0, "approximate", False), (0.0, "exact", True),
        (0.02, "approximate", True)]
SCATTERED = {"inside": [[-20] * 3, [20] * 3]}
ARM = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 0], [5, 0, 0], [6, 0, 0], [6, 1, 0], [5, 1, 0], [8, 0, 0], [9, 0, 0]]


def scene(precision, square_root, tolerance, soft):
    """Cloth alone and in copies, with one and both diagonals, ropes alone and in copies; particles in and out of chains."""
    compliance = {"compliance": 1e-4} if soft else {}
    cloth = {"kind": "cloth", "size": [1, 1.3], "mass": 1.7, **compliance}
    rope = {"kind": "rope", "start": [0, 0, 0], "end": [1, 2, 0], "mass": 0.6, **compliance}
    return {
        "time": {"duration": 1}, "effects": {"contact": "none"},
        "solver": {"order": "lines", "precision": precision, "square_root": square_root, "tolerance": tolerance,
                   "iterations": PASSES, "substeps": 2},
        "bodies": [
            {**cloth, "name": "sheet", "resolution": [5, 7], "pinned": [0, 3, 4, 30]},
            {**cloth, "name": "strip", "resolution": [4, 2], "diagonals": "one"},
            {**cloth, "name": "towels", "resolution": [3, 4], "pinned": [0], "count": 11, "scatter": SCATTERED},
            {**rope, "name": "line", "segments": 17, "pinned": [0, 9]},
            {**rope, "name": "strings", "segments": 5, "count": 3, "scatter": SCATTERED},
            {"kind": "particles", "name": "arms", "positions": ARM, "masses": [1, 2, 0.01, 3, 1, 1, 2, 1, 3, 4], "pinned": [1],
             "sticks": [[2, 1], [3, 2], [0, 3], [4, 5], [5, 6], [6, 7], [7, 4], [8, 9]], **compliance},
            {"kind": "icosahedron", "name": "die", "radius": 0.1, "mass": 1}]}


def relaxed(model, start):
    """Positions (N, 3) in the file's order after some passes from `start`, constraints relaxed, and chains that fell back."""
    world = model.world
    order = world.observed.scene_order
    x = world.particles.position
    x[:, order] = start.T
    forget(world.lines_softness)
    count = sum(relax_lines(x, world.particles.inverse_mass, world.lines, world.lines_softness, world.solver.tolerance,
                            world.solver.approximate) for _ in range(PASSES))
    return x[:, order].T, count, world.lines.singly[0]


def twin(model, start):
    """The same, one chain after another."""
    x, w = start.astype(float), model.world.particles.inverse_mass[model.world.observed.scene_order].astype(float)
    found, first = [], 0
    for body in model.bodies:
        for _ in range(body.copies):
            sticks = [Stick(*(first + ends), rest, body.shape.compliance)
                      for ends, rest in zip(body.shape.sticks, body.shape.lengths, strict=True)]
            found += [([sticks[c] for c in chain], body.shape.layout[0] != "grid") for chain in chains(body.shape)[0]]
            first += len(body.pinned)
    solver = model.scene.solver
    counts = np.zeros(2, int)
    for _ in range(PASSES):
        for chain, again in found:
            counts += relax_pieces(x, w, chain, model.world.solver.step, solver.tolerance, solver.square_root == "approximate",
                                   again)
    return x, *counts


def jittered(model, share):
    start = np.concatenate([body.positions.reshape(-1, 3) for body in model.bodies])
    return (start + share * np.random.default_rng(3).normal(size=start.shape)).astype(model.world.particles.position.dtype)


@pytest.mark.parametrize(("tolerance", "square_root", "soft"), WAYS)
@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.validate)])
def test_chains_are_the_twins(precision, tolerance, square_root, soft):
    model = worlds.built(scene(precision, square_root, tolerance, soft))
    start = jittered(model, 0.02)
    x, count, fallen = relaxed(model, start)
    expected, expected_count, expected_fallen = twin(model, start)
    np.testing.assert_allclose(x, expected, atol=TOLERANCE[precision])
    assert (count, fallen) == (expected_count, expected_fallen) == (expected_count, 0)
    assert not np.allclose(x, start, atol=1e-3)
    assert 0 < count < 1e4


def test_chains_beyond_what_is_linear_are_relaxed_stick_by_stick():
    model = worlds.built(scene("float64", "exact", 0.0, True))
    start = jittered(model, 0.4)
    x, count, fallen = relaxed(model, start)
    expected, expected_count, expected_fallen = twin(model, start)
    np.testing.assert_allclose(x, expected, atol=1e-6)
    assert (count, fallen) == (expected_count, expected_fallen)
    assert 5 < fallen < 0.8 * PASSES * 200


def test_a_chain_drawn_tight_between_two_pins_stays_finite():
    """Its system has no solution: nothing along it can give way."""
    body = {"kind": "rope", "name": "line", "start": [0, 0, 0], "end": [1, 0, 0], "segments": 20, "mass": 1, "pinned": [0, 20]}
    for precision in ("float64", "float32"):
        model = worlds.built({"time": {"duration": 1}, "effects": {"contact": "none"}, "bodies": [body],
                              "solver": {"order": "lines", "precision": precision}})
        start = np.zeros((21, 3), precision)
        start[:, 0] = np.linspace(0, 1.02, 21)
        x, count, _ = relaxed(model, start)
        assert count == 20 * PASSES
        np.testing.assert_allclose(x, start, atol=1e-3)


def test_particles_in_one_place_stay_finite():
    model = worlds.built(scene("float64", "exact", 0.0, False))
    x, _, _ = relaxed(model, np.zeros_like(jittered(model, 0.0)))
    np.testing.assert_array_equal(x, 0)


def test_nothing_to_relax_is_nothing():
    assert relax_lines(np.ones((3, 2)), np.ones(2), None, None, None, None) == 0
