"""Lists of the constraint graph: the paper's own example, distances and repeats; and the buffers made of them."""

from itertools import pairwise

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.scene import shapes
from verlet_numba.scene.body import Body
from verlet_numba.scene.constraint_graph import REPEATS, buckets_of, constraint_list, graph_of, levels, lists
from verlet_numba.scene.constraints import constraints
from verlet_numba.scene.numbering import number

V, A, B, D, E = range(5)
FIGURE_7 = np.array([[V, A], [A, D], [D, E], [E, B], [B, V], [A, B], [A, E]])
"""A pentagon c1 ... c5 from v round, with two diagonals c6, c7: seven sticks hold five particles rigid in the plane."""


def numbered(stick_list):
    """As the paper writes it: c1 is stick 0."""
    return [f"c{c + 1}" for c in stick_list]


@st.composite
def connected(draw):
    """Sticks (C, 2) of a connected body: a tree and some more, in any order and direction."""
    count = draw(st.integers(2, 14))
    tree = [(draw(st.integers(0, i - 1)), i) for i in range(1, count)]
    more = draw(st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=20))
    pairs = {frozenset(pair) for pair in [*tree, *more] if pair[0] != pair[1]}
    return np.array(draw(st.permutations([tuple(sorted(pair)) for pair in sorted(map(sorted, pairs))])))


def distances(sticks, particle):
    """Path lengths by relaxing every edge as often as there are particles (Bellman-Ford)."""
    far = np.full(sticks.max() + 1, np.inf)
    far[particle] = 0
    for _ in far:
        for i, j in sticks:
            far[i], far[j] = min(far[i], far[j] + 1), min(far[j], far[i] + 1)
    return far


def test_the_papers_example():
    """Section 6.2: C_v = <c1, c5, c2, c6, c7, c4, c3>; c1 and c5 come 3 times, c2, c6, c7 and c4 3/2 times, c3 at least once."""
    assert numbered(constraint_list(FIGURE_7, V, "once")) == ["c1", "c5", "c2", "c6", "c7", "c4", "c3"]
    near, middle, far = ["c1", "c5"], ["c2", "c6", "c7", "c4"], ["c3"]
    assert numbered(constraint_list(FIGURE_7, V, "by_level")) == 3 * near + 2 * middle + far
    assert numbered(constraint_list(FIGURE_7, V, "halving")) == 3 * near + 2 * middle + far


def test_repeats_of_five_levels():
    chain = np.array([[k, k + 1] for k in range(5)])
    times = {repeats: np.bincount(constraint_list(chain, 0, repeats)).tolist() for repeats in REPEATS}
    assert times == {"by_level": [5, 3, 2, 2, 1], "halving": [5, 3, 2, 1, 1], "once": [1, 1, 1, 1, 1]}


def test_icosahedron_has_three_levels_and_two_ways_to_repeat():
    sticks = shapes.icosahedron(1.0, mass=1.0).sticks
    for v in range(12):
        assert [len(level) for level in levels(sticks, v)] == [6, 25, 5]
        by_level = constraint_list(sticks, v, "by_level")
        assert len(by_level) == 3 * 6 + 2 * 25 + 5
        np.testing.assert_array_equal(by_level, constraint_list(sticks, v, "halving"))


@given(sticks=connected(), data=st.data())
@settings(deadline=None)
def test_every_stick_stands_at_its_distance(sticks, data):
    v = data.draw(st.integers(0, int(sticks.max())))
    far = distances(sticks, v)[sticks].min(1)
    found = levels(sticks, v)
    assert sorted(c for level in found for c in level) == list(range(len(sticks)))
    for k, level in enumerate(found):
        assert (far[level] == k).all()
    np.testing.assert_array_equal(constraint_list(sticks, v, "once"), [c for level in found for c in level])
    for repeats, times in REPEATS.items():
        order = constraint_list(sticks, v, repeats)
        counts = np.bincount(order, minlength=len(sticks))
        assert [counts[level[0]] for level in found] == [max(1, times(len(found), k)) for k in range(1, len(found) + 1)]
        assert counts[found[-1]].tolist() == [1] * len(found[-1])
        assert all(a <= b for a, b in pairwise(far[order]))


@given(sticks=connected(), pins=st.sets(st.integers(0, 13)), repeats=st.sampled_from(sorted(REPEATS)))
@settings(deadline=None)
def test_lists_of_a_family_are_images_of_one(sticks, pins, repeats):
    """C_v has the levels of v in any order within a level, and the turn takes sticks and weights to such."""
    free = 1.0 - np.isin(sticks.T, list(pins))
    weight = free / np.maximum(free.sum(0), 1)
    count = int(sticks.max()) + 1
    entries, family, turns = buckets_of(sticks, weight, count, repeats)
    for v, (f, turn) in enumerate(zip(family[1:], turns[1:], strict=True)):
        assert turn.particles[turn.base] == v
        assert sorted(turn.particles) == list(range(count))
        for c, image in enumerate(turn.sticks):
            expected = dict(zip(turn.particles[sticks[c]], weight[:, c], strict=True))
            assert dict(zip(sticks[image], weight[:, image], strict=True)) == expected
        plain, far = constraint_list(sticks, v, repeats), distances(sticks, v)[sticks].min(1)
        taken = turn.sticks[entries[f]]
        np.testing.assert_array_equal(far[taken], far[plain])
        np.testing.assert_array_equal(np.bincount(taken), np.bincount(plain))


def test_symmetry_is_found_where_it_is_and_nowhere_else():
    ring = np.array([[k, (k + 1) % 7] for k in range(7)])
    same = np.full((2, 7), 0.5)
    assert len(buckets_of(ring, same, 7, "once").entries) == 1 + 1
    pinned = np.where(ring.T == 3, 0.0, np.where((ring.T == 3).any(0), 1.0, 0.5))
    assert len(buckets_of(ring, pinned, 7, "once").entries) == 1 + 4
    long = np.array([[k, (k + 1) % 100] for k in range(100)])
    assert len(buckets_of(long, np.full((2, 100), 0.5), 100, "once").entries) == 1 + 100


def bodies_of(*entries):
    """Bodies (shape, copies, pinned particles), all at the origin."""
    made = []
    for k, (shape, copies, pins) in enumerate(entries):
        positions = np.repeat(shape.positions[None], copies, axis=0)
        pinned = np.isin(np.arange(len(shape.positions)), pins)
        made.append(Body(f"body {k}", shape, positions, np.zeros_like(positions), pinned, (0.0, 0.0), 0.0))
    return made


def inverse_masses(bodies, numbering):
    found = np.zeros(numbering.size)
    for body, index in zip(bodies, numbering.bodies, strict=True):
        found[index] = np.where(body.pinned, 0, 1 / body.shape.masses)
    return found


def test_buffers_of_several_kinds():
    """Two sizes of icosahedra in one group, one with a pin; a box; and a rope, which is none of the graph's business."""
    small, large = (shapes.icosahedron(radius, mass=1.0) for radius in (0.1, 0.2))
    box, rope = shapes.box([1, 2, 3], mass=1.0), shapes.rope([0, 0, 0], [1, 0, 0], segments=3, mass=1.0)
    bodies = bodies_of((small, 3, []), (rope, 2, []), (large, 2, [5]), (box, 1, []), (small, 2, []))
    numbering = number(bodies)
    graph = graph_of(bodies, numbering, inverse_masses(bodies, numbering), "by_level", "float32")
    rigid = [numbering.bodies[b] for b in (0, 2, 3, 4)]
    np.testing.assert_array_equal(graph.body[0], np.concatenate([index[:, 0] for index in rigid]))
    np.testing.assert_array_equal(graph.body[1], [0, 0, 0, 36, 36, 72, 0, 0])
    np.testing.assert_array_equal(graph.bucket, [0, 0, 0, 13, 13, 26, 0, 0])
    np.testing.assert_array_equal(graph.family[:13], [0] + [1] * 12)
    sizes = graph.particles[graph.family]
    np.testing.assert_array_equal(sizes, [12] * 26 + [8] * 9)
    assert graph.start[-1] == 8
    np.testing.assert_array_equal(graph.sorted[:2, :5], graph.body[:, [0, 1, 2, 6, 7]])
    assert graph.rest.dtype == graph.weight.dtype == graph.packed.dtype == graph.lengths.dtype == np.float32
    assert graph.packed.shape[1] >= (graph.particles * graph.lanes).max()
    assert graph.lengths.size >= ((graph.sticks[1] - graph.sticks[0]) * graph.lanes).max()
    for bucket, body, shape, moved in ((0, 0, small, -1), (13 + 1 + 5, 3, large, 5), (26 + 1 + 7, 5, box, 7)):
        family = graph.family[bucket]
        weight = graph.weight[:, slice(*graph.sticks[:, family])]
        image = graph.images[graph.turn[1, bucket]:][:len(shape.sticks)]
        ordered = image[graph.entry[slice(*graph.listed[:, family])]]
        np.testing.assert_array_equal(ordered, lists(shape, weight, "by_level")[moved + 1])
        np.testing.assert_array_equal(graph.ends[:, slice(*graph.sticks[:, family])], shape.sticks.T)
        rest = graph.rest[graph.body[1, body]:][:len(shape.sticks)]
        np.testing.assert_array_equal(rest, shape.lengths.astype(np.float32))
    pinned = (graph.ends[:, 36:72] == 5).astype(float)
    np.testing.assert_allclose(graph.weight[:, 36:72], np.where(pinned.any(0), 1 - pinned, 0.5))


def test_bodies_of_other_sizes_are_of_one_kind():
    """They are relaxed side by side, each with its own rest lengths."""
    sizes = [shapes.icosahedron(radius, mass=1 / radius) for radius in (0.1, 0.2, 0.3)]
    bodies = bodies_of(*((shape, 2, []) for shape in sizes))
    numbering = number(bodies)
    graph = graph_of(bodies, numbering, inverse_masses(bodies, numbering), "once", "float64")
    np.testing.assert_array_equal(graph.bucket, 0)
    np.testing.assert_array_equal(graph.body[1], [0, 0, 36, 36, 72, 72])
    np.testing.assert_array_equal(graph.rest, np.concatenate([shape.lengths for shape in sizes]))


def test_no_rigid_body_has_no_graph():
    bodies = bodies_of((shapes.rope([0, 0, 0], [1, 0, 0], segments=3, mass=1.0), 2, []))
    numbering = number(bodies)
    assert graph_of(bodies, numbering, inverse_masses(bodies, numbering), "once", "float64") is None


@pytest.mark.parametrize("copies", [1, 300])
def test_sticks_of_rigid_bodies_can_be_left_out_of_the_runs(copies):
    scene, bodies = worlds.placed(worlds.EVERYTHING)
    icosahedra = bodies_of((shapes.icosahedron(0.1, mass=1.0), copies, []))
    numbering = number(bodies + icosahedra)
    arguments = (bodies + icosahedra, numbering, np.zeros((0, 2), np.int64), inverse_masses(bodies + icosahedra, numbering),
                 0.01, scene.solver.iterations, "float64")
    every, rest = constraints(*arguments), constraints(*arguments, rigid=False)
    left_out = sum(body.copies * len(body.shape.sticks) for body in bodies + icosahedra if body.shape.rigid)
    assert active(every) - active(rest) == left_out > 36 * copies
    assert rest.angles is not None


def active(found):
    """Constraints that are not masked out."""
    return sum(int((part.weight.sum(0) > 0).sum()) for part in (found.runs, found.sticks) if part is not None)
