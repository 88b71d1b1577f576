"""The world of a scene: order of the file, masses, weights, and bodies that do not feel who stands beside them."""

from dataclasses import replace

import numpy as np
import pytest
import worlds

from verlet_numba.buffers.constraints import Runs, Sticks
from verlet_numba.run.engine import start
from verlet_numba.scene.build import build

COMPANY = [{"kind": "rope", "name": "line", "start": [0, 9, 3], "end": [1, 9, 3], "segments": 6, "mass": 0.5},
           worlds.FREE["bodies"][1]]


def everything(**solver):
    return worlds.started(worlds.with_changes(worlds.EVERYTHING, solver=solver))


def test_the_order_of_the_file_is_that_of_the_scene():
    model = everything()
    order = model.world.observed.scene_order
    start = np.concatenate([body.positions.reshape(-1, 3) for body in model.bodies])
    np.testing.assert_array_equal(model.world.particles.position[:, order].T, start)
    masses = np.concatenate([np.tile(body.shape.masses, body.copies) for body in model.bodies])
    np.testing.assert_array_equal(model.world.observed.mass, masses)
    positions, _, _ = worlds.advanced(model, 1)
    np.testing.assert_array_equal(positions[0], start)


def test_pinned_particles_and_ghosts_have_no_inverse_mass():
    model = everything()
    inverse_mass, order = model.world.particles.inverse_mass, model.world.observed.scene_order
    pinned = np.concatenate([np.tile(body.pinned, body.copies) for body in model.bodies])
    np.testing.assert_allclose(inverse_mass[order], np.where(pinned, 0, 1 / model.world.observed.mass))
    ghosts = np.setdiff1d(np.arange(len(inverse_mass)), order)
    assert len(ghosts)
    assert not inverse_mass[ghosts].any()
    assert not model.world.effects.gravity.acceleration[:, ghosts].any()


def test_ghosts_stay_where_they_are():
    model = everything()
    ghosts = np.setdiff1d(np.arange(model.world.particles.inverse_mass.size), model.world.observed.scene_order)
    worlds.advanced(model, 5)
    np.testing.assert_array_equal(model.world.particles.position[:, ghosts], 0)


def constraints_of(model):
    """(particle, particle): rest, weights of every active constraint, in particles of the file; and all that are there."""
    number = {inner: p for p, inner in enumerate(model.world.observed.scene_order)}
    found = {}
    for part in (model.world.runs, model.world.sticks):
        if isinstance(part, Runs):
            ends = np.concatenate([part.first[:, [r]] + np.arange(part.lanes[r]) for r in range(len(part.lanes))], axis=1)
            assert (part.weight.sum(0) > 0).sum() == part.active
        elif isinstance(part, Sticks):
            ends = part.ends
        for c in np.flatnonzero(part.weight.sum(0) > 0):
            pair = number[ends[0, c]], number[ends[1, c]]
            assert pair not in found
            found[pair] = (part.rest[c], *part.weight[:, c])
    return found


def test_weights_are_shares_of_the_inverse_mass_softened_by_compliance():
    model = everything()
    found, h, w = constraints_of(model), model.world.solver.step, np.zeros(0)
    w = model.world.particles.inverse_mass[model.world.observed.scene_order]
    first = expected = arm = 0
    for body in model.bodies:
        arm = first if body.name == "arm" else arm
        for _ in range(body.copies):
            for (i, j), rest in zip(body.shape.sticks + first, body.shape.lengths, strict=True):
                if w[i] + w[j] > 0:
                    total = w[i] + w[j] + body.shape.compliance / h**2
                    np.testing.assert_allclose(found[i, j], [rest, w[i] / total, w[j] / total], rtol=1e-13)
                    expected += 1
            first += len(body.pinned)
    assert len(found) == expected + len(model.scene.attachments)
    assert found[12 + 5, arm][0] == 0           # the rope's end, attached


def test_tolerance_and_approximation_of_nothing_are_absent():
    assert everything(tolerance=0.0, square_root="exact").world.solver[3:] == (None, None)
    assert everything(tolerance=0.02, square_root="approximate").world.solver[3:] == (0.02, 1)


def test_compliance_needs_memory_only_over_several_passes():
    assert everything(iterations=1).world.runs_softness is None
    assert everything(iterations=2).world.runs_softness is not None


# --- A body does not feel who else is there ---------------------------------------------------------------------------

def dice(kind, precision, contact="auto", **solver):
    """300 copies of a body that fly and tumble, and the scene; a rope and single sticks keep them company."""
    body = {"box": {"kind": "box", "size": [0.1, 0.2, 0.3]}, "icosahedron": {"kind": "icosahedron", "radius": 0.1},
            "rope": {"kind": "rope", "start": [0, 0, 0], "end": [0.1, 0.05, 0], "segments": 3, "length": 0.2},
            "cloth": {"kind": "cloth", "size": [0.2, 0.1], "resolution": [3, 4]}}[kind]
    many = {**body, "name": "many", "mass": 1, "count": 300, "angular_velocity": [3, 1, -8],
            "scatter": {"inside": [[-5, -5, 0], [5, 5, 9]], "speed": [1, 4]}}
    return worlds.placed(worlds.with_changes(worlds.FREE, solver={"precision": precision, **solver},
                                             effects={"contact": contact}, bodies=[*COMPANY, many]))


def trajectory(scene, bodies):
    """Positions (F, K, P, 3) of the last body after a few frames."""
    positions, _, _ = worlds.advanced(start(build(scene, bodies)), 4)
    last = bodies[-1].positions
    return positions[:, -last.shape[0] * last.shape[1]:].reshape(4, *last.shape)


def part(body, first, last):
    return replace(body, positions=body.positions[first:last], velocities=body.velocities[first:last])


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.validate)])
@pytest.mark.parametrize("kind", ["box", pytest.param("icosahedron", marks=pytest.mark.validate), "rope", "cloth"])
def test_alone_among_copies_or_in_a_group_the_bits_are_the_same(kind, precision):
    scene, (*company, many) = dice(kind, precision)
    same_bits(scene, company, many)


@pytest.mark.parametrize(("kind", "key", "value"), [
    ("rope", "order", "lines"), ("cloth", "order", "lines"), ("box", "gradient", "step_start"),
    ("cloth", "gradient", "step_start")])
def test_they_are_in_whole_chains_and_along_directions_at_the_start(kind, key, value):
    scene, (*company, many) = dice(kind, "float64", "none", **{key: value})
    same_bits(scene, company, many)


def same_bits(scene, company, many):
    """A body flies alike alone, among copies, and in a group with others."""
    together = trajectory(scene, [*company, many])
    assert np.abs(together[-1] - together[0]).max() > 0.1
    for first, last in ((0, 1), (299, 300), (128, 129), (5, 8), (7, 16), (100, 229)):
        np.testing.assert_array_equal(trajectory(scene, [*company, part(many, first, last)]), together[:, first:last])
    grouped = trajectory(scene, [*company, part(many, 0, 37), part(many, 37, 53)])      # two bodies of the scene, one group
    np.testing.assert_array_equal(grouped, together[:, 37:53])
