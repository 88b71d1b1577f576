"""Half-edges: what meets what on closed and open surfaces, and what is no surface."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.scene.half_edge import SurfaceError, adjacency, half_edges

CLOSED = {      # and their Euler characteristic
    "box": (trimesh.creation.box(), 2),
    "sphere": (trimesh.creation.icosphere(2), 2),
    "torus": (trimesh.creation.torus(1, 0.3, major_sections=7, minor_sections=5), 0),
    "tube": (trimesh.creation.annulus(0.5, 1, 1, sections=8), 0),
}
FAN = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]])


def neighbours_by_hand(triangles, vertex):
    return set(triangles[(triangles == vertex).any(axis=1)].ravel().tolist()) - {vertex}


def check(surface, triangles):
    """All that holds of any surface."""
    h = np.arange(len(surface.twin))
    inside = surface.twin >= 0
    np.testing.assert_array_equal(surface.twin[surface.twin[inside]], h[inside])
    np.testing.assert_array_equal(surface.vertex[surface.twin[inside]], surface.end[inside])
    np.testing.assert_array_equal(surface.next[surface.next[surface.next]], h)
    np.testing.assert_array_equal(surface.face[surface.next], surface.face)
    np.testing.assert_array_equal(surface.faces, triangles)
    sides = {tuple(sorted((t[k], t[k - 1]))) for t in triangles.tolist() for k in range(3)}
    assert list(map(tuple, surface.edges.tolist())) == sorted(sides)
    np.testing.assert_array_equal(surface.vertices, np.unique(triangles))


@pytest.mark.parametrize("name", CLOSED)
def test_closed_surfaces(name):
    solid, euler = CLOSED[name]
    triangles = np.array(solid.faces)
    surface = half_edges(triangles)
    check(surface, triangles)
    assert (surface.twin >= 0).all()
    assert surface.borders() == []
    assert len(surface.pinched()) == 0
    assert len(surface.vertices) - len(surface.edges) + len(surface.faces) == euler


@given(name=st.sampled_from(sorted(CLOSED)), seed=st.integers(0, 2**32 - 1), kept=st.floats(0.05, 1))
def test_what_is_left_of_a_surface(name, seed, kept):
    """With faces torn out, borders and fans appear; each is found as a count by hand finds it."""
    triangles = np.array(CLOSED[name][0].faces)
    triangles = triangles[np.random.default_rng(seed).random(len(triangles)) < kept]
    if not len(triangles):
        return
    surface = half_edges(triangles)
    check(surface, triangles)
    loops = surface.borders()
    assert sum(map(len, loops)) == np.sum(surface.twin < 0)
    directed = {(int(a), int(b)) for a, b in zip(surface.vertex, surface.end, strict=True)}
    for loop in loops:
        assert len(loop) >= 3
        for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True):
            assert (a, b) in directed
            assert (b, a) not in directed
    pinched = set(surface.pinched().tolist())
    for vertex in surface.vertices.tolist():
        faces = set(np.flatnonzero((triangles == vertex).any(axis=1)).tolist())
        around = surface.faces_around(vertex)
        assert len(around) == len(set(around))
        if set(around) == faces:
            assert sorted(surface.neighbours(vertex)) == sorted(neighbours_by_hand(triangles, vertex))
        else:
            assert set(around) < faces <= pinched


def test_neighbours_go_round_counter_clockwise_from_border_to_border():
    surface = half_edges(FAN)
    assert surface.neighbours(0) == [1, 2, 3, 4]
    assert surface.faces_around(0) == [0, 1, 2]
    assert surface.neighbours(2) == [3, 0, 1]
    assert [loop.tolist() for loop in surface.borders()] == [[0, 1, 2, 3, 4]]
    closed = half_edges(np.concatenate([FAN, [[0, 4, 1]]]))
    around = closed.neighbours(0)
    assert np.roll(around, -around.index(1)).tolist() == [1, 2, 3, 4]
    assert [loop.tolist() for loop in closed.borders()] == [[1, 2, 3, 4]]


def test_vertices_without_faces_have_no_neighbours():
    surface = half_edges(FAN + 1)
    assert surface.neighbours(0) == []
    assert surface.faces_around(0) == []


def test_faces_that_meet_in_a_vertex_alone_are_pinched():
    bow_tie = half_edges(np.array([[7, 8, 9], [0, 1, 2], [0, 3, 4]]))
    assert bow_tie.pinched().tolist() == [1, 2]
    assert len(bow_tie.borders()) == 3 or sum(map(len, bow_tie.borders())) == 9


@pytest.mark.parametrize(("triangles", "face", "message"), [
    ([[5, 6, 7], [0, 1, 2], [1, 0, 3], [0, 1, 4]], 1, "more than one other"),
    ([[5, 6, 7], [0, 1, 2], [0, 1, 3]], 1, "wound against its neighbour"),
    ([[0, 1, 2], [0, 1, 2]], 0, "wound against its neighbour"),
])
def test_what_is_no_surface_is_named(triangles, face, message):
    with pytest.raises(SurfaceError, match=message) as error:
        half_edges(np.array(triangles))
    assert error.value.face == face


def test_adjacency_lists_each_edge_from_both_ends():
    start, neighbour = adjacency(np.array([[0, 3], [0, 1], [1, 3]]), 5)
    assert [neighbour[start[v]:start[v + 1]].tolist() for v in range(5)] == [[1, 3], [0, 3], [], [0, 1], []]
    start, neighbour = adjacency(np.zeros((0, 2), np.int64), 2)
    assert start.tolist() == [0, 0, 0]
    assert len(neighbour) == 0
