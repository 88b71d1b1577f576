"""Traversals list exactly the pairs that all pairs give, whatever the shapes; what saves work never changes the list."""

import numpy as np
import pytest
from sphere_tree_cases import CRATE, DIE, bent, case, crumpled, expected, found, listed, sheet, turned, without_bounds

from verlet_numba.kernels.sphere_candidates import find_spheres
from verlet_numba.kernels.sphere_tree import expire, list_against, list_pairs, update_layered, update_wrapped
from verlet_numba.physics.flatness import unfolded
from verlet_numba.scene import shapes
from verlet_numba.scene.sphere_trees import candidates_of


@pytest.mark.parametrize("part", range(4))
def test_pairs_are_those_of_all_pairs(part):
    """A30: 1,000 seeds of several small bodies of every kind, some on top of each other, at any scale and place."""
    total = 0
    for seed in range(250 * part, 250 * part + 250):
        rng = np.random.default_rng(seed)
        scale, real = 10.0 ** rng.integers(-6, 7), rng.choice([np.float32, np.float64])
        things = []
        for _ in range(rng.integers(1, 4)):
            kind, copies = rng.integers(4), rng.integers(1, 3)
            if kind == 0:
                shape = shapes.rope([0, 0, 0], [scale, 0, 0], rng.integers(1, 12), mass=1, thickness=0.1 * scale)
            elif kind == 1:
                shape = sheet(*rng.integers(2, 8, 2), 0.05 * scale, rng.choice(["one", "both"]), (scale, scale))
            elif kind == 2:
                shape = shapes.particles(rng.normal(size=(rng.integers(1, 12), 3)) * scale, [1], radius=0.1 * scale)
            else:
                shape = DIE
            spread = rng.choice([0.0, 0.1, 1.0]) * scale
            place = np.stack([turned(shape.positions, rng) + rng.normal(size=(len(shape.positions), 3)) * spread
                              + rng.uniform(-1, 1, 3) * scale for _ in range(copies)])
            if rng.integers(2):
                place = np.round(place / scale * 4) / 4 * scale         # equal points, points on lines
            things.append((shape, place + rng.choice([0.0, 100.0]) * scale))
        if all(shape.rigid for shape, _ in things):
            continue
        this, margin = case(things, real), rng.choice([0.0, 0.1, 0.5]) * scale
        this.inverse_mass[rng.uniform(size=len(this.inverse_mass)) < 0.1] = 0
        pairs = found(this, margin)
        assert pairs == expected(this, margin), seed
        assert found(this, margin, itself=False) == expected(this, margin, itself=False), seed
        total += len(pairs)
    assert total > 1000


@pytest.mark.parametrize("diagonals", ["one", "both"])
def test_pairs_of_folded_and_crumpled_cloth(diagonals):
    """Bounds on edges pass over parts that are flat; no pair is lost by it, near or compressed as they may be."""
    seen = passed = 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        nx, ny = rng.integers(2, 30, 2)
        shape = sheet(nx, ny, rng.uniform(0, 1) / nx, diagonals, (1, rng.uniform(0.5, 2) * ny / nx))
        waves, height = rng.integers(1, 4), rng.uniform(0, 3)
        place = [bent(shape, lambda u, w=waves, h=height: h * np.sin(2 * np.pi * w * u), rng.uniform(0.3, 1.2)),
                 crumpled(shape, rng, rng.integers(0, 5), rng.uniform(0.4, 1.1)),
                 bent(shape, lambda u, h=height: h * 5 * u)][seed % 3]
        this, margin = case([(shape, turned(place, rng)[None])]), rng.uniform(0, 1) / nx
        pairs = found(this, margin)
        assert pairs == expected(this, margin), seed
        assert pairs == found(this, margin, layered=without_bounds(this.layered)), seed
        seen += len(pairs)
        row, reach = this.layered.bound[0], (2 * shape.radius + margin) / this.layered.lattice[0, 2]
        passed += bool(unfolded(*row, *this.layered.lattice[0, :2], reach))
    assert seen > 1000
    assert 5 < passed < 100


def test_flat_cloth_is_passed_over_as_a_whole():
    shape = sheet(40, 40, 0.3 / 39)
    this = case([(shape, turned(shape.positions, np.random.default_rng(0))[None] + 3.0)])
    assert found(this, 0.3 / 39) == set()
    bound, lattice = this.layered.bound[0], this.layered.lattice[0]
    assert lattice[2] == pytest.approx(2 / 39)
    for ratio, whole in [(0.999, True), (1.001, False)]:
        assert bool(unfolded(*bound, *lattice[:2], ratio)) is whole


def test_flat_sheets_that_lie_on_each_other():
    """Bounds prove nothing between two bodies."""
    shape = sheet(12, 12, 0.05)
    this = case([(shape, shape.positions + np.array([[[0, 0, 0]], [[0.01, 0, 0.04]]]))])
    assert found(this, 0.0) == expected(this, 0.0)
    assert len(found(this, 0.0)) >= 12 * 12


def test_flat_parts_on_both_sides_of_a_loop():
    """Two columns of edges make a narrow loop: the flat parts beside it lie on each other, but no path of flat edges joins them."""
    shape, near = sheet(40, 4, 0.8 / 39, "both", (1, 3 / 39)), 0
    for column in range(1, 36):
        slope = np.zeros(40)
        slope[column + 1], slope[column + 2] = 2 * np.pi / 3, 4 * np.pi / 3
        this = case([(shape, bent(shape, lambda u, slope=slope: slope)[None])])
        pairs = found(this, 0.8 / 39)
        assert pairs == expected(this, 0.8 / 39), column
        near += len(pairs)
    assert near > 1000


def test_bounds_hold_for_all_edges_within():
    """unfolded: against the least singular values of F in all corners of both boxes."""
    rng = np.random.default_rng(8)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 6)).reshape(6, -1).T.reshape(-1, 2, 3)
    proven = tight = 0
    for _ in range(3000):
        a, b = rng.uniform(0.5, 2, 2)
        frame = turned(np.eye(3), rng) @ (np.eye(3) + 0.3 * rng.normal(size=(3, 3)))
        middle, half = frame[:2] * [[a], [b]], rng.uniform(0, 0.5) * rng.uniform(size=(2, 3))
        least = np.linalg.svd((middle + signs * half) / [[a], [b]], compute_uv=False)[:, 1].min()
        bound = (*(middle - half).ravel(), *(middle + half).ravel(), a, b)
        assert not unfolded(*bound, least * (1 + 1e-9))
        proven += bool(unfolded(*bound, least * 0.5))
        tight += bool(unfolded(*bound, least * 0.95))
    assert proven > 1000
    assert tight > 300


def test_bounds_of_a_node_hold_the_edges_its_particles_own():
    shape = sheet(23, 17, 0.01)
    rng = np.random.default_rng(2)
    this = case([(shape, crumpled(shape, rng, 3)[None])])
    update_layered(this.position, this.layered)
    x = this.position[:, this.copies[0]].T.reshape(23, 17, 3)
    seen = 0
    for (i, last, j, end), bound in zip(this.layered.rectangle, this.layered.bound, strict=True):
        along = x[i + 1:last + 2, j:end + 1] - x[i:min(last, 21) + 1, j:end + 1]
        across = np.diff(x[i:last + 1, max(j - 1, 0):end + 2], axis=1)
        if along.size:
            low, high = (np.concatenate([f(each, axis=(0, 1)) for each in (along, across)]) for f in (np.min, np.max))
            np.testing.assert_array_equal(bound, np.concatenate([low, high]))
            seen += 1
    assert seen > 20


def test_spheres_hold_their_particles():
    rng = np.random.default_rng(4)
    shape = sheet(13, 9, 0.05)
    rope = shapes.rope([0, 0, 0], [1, 2, 0], 30, mass=1, thickness=0.1)
    this = case([(shape, crumpled(shape, rng, 4)[None]), (rope, rope.positions[None])])
    update_layered(this.position, this.layered)
    skip, particle, sphere = this.layered.skip, this.layered.particle, this.layered.sphere
    for k in range(len(skip)):
        below = particle[k:skip[k]]
        below = below[below >= 0]
        gaps = np.linalg.norm(this.position[:, below].T - sphere[k, :3], axis=1) + this.layered.radius[below]
        assert gaps.max() <= sphere[k, 3]
        assert sphere[k, 3] <= 2 * gaps.max()


def test_no_room_is_told_and_the_list_is_complete_once_there_is():
    rng = np.random.default_rng(1)
    shape = shapes.particles(rng.uniform(size=(60, 3)), [1], radius=0.05)
    this = case([(shape, shape.positions[None])])
    update_layered(this.position, this.layered)
    full = found(this, 0.1)
    for capacity in (0, 1, len(full) - 1):
        assert not list_pairs(this.layered, this.inverse_mass, 0.1, True, this.stack, candidates_of(capacity))
    assert found(this, 0.1, capacity=len(full)) == full


def test_stacks_are_long_enough():
    """All particles in one point: every pair of nodes is visited."""
    for count in (1, 2, 3, 5, 100):
        shape = shapes.particles(np.zeros((count, 3)), [1])
        this = case([(shape, np.zeros((2, count, 3))), (DIE, DIE.positions[None])])
        first, second = this.stack
        first[:], second[:] = -7, -7
        assert len(found(this, 10.0)) == count * (2 * count - 1)
        assert found(this, 10.0) == expected(this, 10.0)
        stack = this.stack
        stack.first[:] = -7
        update_layered(this.position, this.layered)
        assert list_pairs(this.layered, this.inverse_mass, 10.0, True, stack, candidates_of(100_000))
        assert list_against(this.layered, this.position, this.wrapped, 10.0, stack, candidates_of(100_000))
        assert stack.first[-1] == -7


WEIGHTS = np.array([(i, j, 12 - i - j) for i in range(13) for j in range(13 - i)]) / 12     # of points within a triangle


def leaf_spheres(this, leaves):
    """Centre and radius of the smallest sphere of each triangle, by brute force over its sides and its circumcircle."""
    result = []
    for corners in leaves:
        a, b, c = this.position[:, corners].T.astype(float)
        best = None
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            middle, radius = (p + q) / 2, np.linalg.norm(p - q) / 2
            if np.linalg.norm(r - middle) <= radius and (best is None or radius > best[1]):
                best = middle, radius
        if best is None:
            u, v = b - a, c - a
            offset = np.linalg.solve(2 * np.array([u, v, np.cross(u, v)]), [u @ u, v @ v, 0])
            best = a + offset, np.linalg.norm(offset)
        result.append(best)
    centre, radius = zip(*result, strict=True)
    return np.array(centre), np.array(radius)


@pytest.mark.parametrize("seed", range(20))
def test_particles_near_rigid_triangles(seed):
    """Deformable against rigid, after any rigid motion: all that are near a triangle, none that is not near its sphere."""
    rng = np.random.default_rng(seed)
    cloth = sheet(9, 7, 0.02)
    rope = shapes.rope([0, 0, 0], [1, 0, 0], 12, mass=1, thickness=0.05)

    def placed(shape, copies, spread):
        return shape, np.stack([turned(shape.positions, rng) + rng.uniform(-spread, spread, 3) for _ in range(copies)])

    this = case([placed(DIE, 3, 0.6), placed(cloth, 1, 0.2), placed(rope, 2, 0.4), placed(CRATE, 2, 0.6)],
                rng.choice([np.float32, np.float64]))
    margin, touched = 0.02, 0
    triangles = [own[triangle] for shape, own in this.rigid for triangle in shape.triangles]
    for _ in range(3):                                                  # three substeps: the rigid bodies move on
        for _, own in this.rigid:
            centre = this.position[:, own].mean(axis=1, keepdims=True)
            this.position[:, own] = (turned((this.position[:, own] - centre).T, rng).T + centre
                                     + rng.uniform(-0.1, 0.1, (3, 1))).astype(this.position.dtype)
        expire(this.wrapped)
        update_layered(this.position, this.layered)
        candidates = candidates_of(100_000)
        assert list_against(this.layered, this.position, this.wrapped, margin, this.stack, candidates)
        pairs = listed(candidates)
        assert len(set(pairs)) == len(pairs)
        soft, leaves = np.concatenate(this.copies), np.array(triangles)
        place, reach = this.position[:, soft].T.astype(float), this.layered.radius[soft] + margin
        inside = np.einsum("sk,fkc->fsc", WEIGHTS, this.position.T[leaves].astype(float))
        near = np.linalg.norm(place[:, None, None] - inside, axis=3).min(axis=2) < reach[:, None] * (1 - 1e-6)
        centre, radius = leaf_spheres(this, triangles)
        possible = np.linalg.norm(place[:, None] - centre, axis=2) < (reach[:, None] + radius) * (1 + 1e-6)
        assert {(soft[p], f) for p, f in np.argwhere(near)} <= set(pairs) <= {(soft[p], f) for p, f in np.argwhere(possible)}
        touched += near.sum()
    assert touched > 0


def test_wrapped_spheres_hold_the_body_after_rigid_motion():
    rng = np.random.default_rng(6)
    for shape in (DIE, CRATE):
        this = case([(shape, shape.positions[None])])
        wrapped, rest = this.wrapped, this.position.copy()
        update = np.empty_like(wrapped.sphere)
        for _ in range(50):
            this.position[:] = (turned(rest.T, rng) + rng.normal(size=3) * 10.0 ** rng.integers(-2, 4)).T
            for k in range(len(wrapped.skip)):
                update_wrapped(this.position, wrapped.support, update, k)
                below = wrapped.leaf[k:wrapped.skip[k]]
                own = np.unique(shape.triangles[below[below >= 0]])
                gap = np.linalg.norm(this.position[:, own].T - update[k, :3], axis=1)
                assert gap.max() <= update[k, 3] * (1 + 1e-9)
                assert update[k, 3] <= gap.max() * (1 + 1e-8) + 1e-9


def test_spheres_are_computed_only_where_a_descent_leads():
    this = case([(sheet(5, 5, 0.01), sheet(5, 5, 0.01).positions[None]), (DIE, DIE.positions[None] + [50, 0, 0])])
    update_layered(this.position, this.layered)
    expire(this.wrapped)
    assert list_against(this.layered, this.position, this.wrapped, 0.1, this.stack, candidates_of(10))
    assert (this.wrapped.stamp == this.wrapped.now[0]).sum() == 1
    this.position[0, this.rigid[0][1]] -= 50
    expire(this.wrapped)
    assert list_against(this.layered, this.position, this.wrapped, 0.1, this.stack, candidates_of(10_000))
    assert 20 < (this.wrapped.stamp == this.wrapped.now[0]).sum() <= len(this.wrapped.skip)


def test_attached_particles_never_meet():
    rope = shapes.rope([0, 0, 0], [1, 0, 0], 4, mass=1, thickness=0.1)
    place = rope.positions + np.array([[[0, 0, 0]], [[1, 0, 0]]])
    this = case([(rope, place)])
    joint = np.array([[this.copies[0][-1], this.copies[1][0]]])
    assert tuple(sorted(joint[0].tolist())) in found(this, 0.0)
    joined = case([(rope, place)], attached=joint)
    assert found(joined, 0.0) == found(this, 0.0) - {tuple(sorted(joint[0].tolist()))}


def test_particles_never_meet_the_leaves_they_are_held_at():
    """Rigid leaves are numbered after all particles."""
    rope = shapes.rope([0, 0, 0], [1, 0, 0], 4, mass=1, thickness=0.1)
    this = case([(rope, rope.positions[None]), (CRATE, CRATE.positions[None])])
    update_layered(this.position, this.layered)
    every, count = candidates_of(1000), len(this.layered.radius)
    assert list_against(this.layered, this.position, this.wrapped, 10.0, this.stack, every)
    held, leaf = listed(every)[3]
    apart, partner = this.layered.apart.copy(), this.layered.partner
    apart[held + 1:] += 1
    partner = np.insert(partner, apart[held + 1] - 1, count + leaf)
    some = candidates_of(1000)
    assert list_against(this.layered._replace(apart=apart, partner=partner), this.position, this.wrapped, 10.0, this.stack, some)
    assert set(listed(every)) - set(listed(some)) == {(held, leaf)}
    assert len(listed(every)) == len(listed(some)) + 1


def test_nothing_is_nothing():
    update_layered(None, None)
    expire(None)
    assert list_pairs(None, None, 0.0, True, None, None)
    assert list_against(None, None, None, 0.0, None, None)
    assert find_spheres(None, None, None, True, None, None)
