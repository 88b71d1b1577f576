"""Triangulated surfaces as half-edges (P4 of the paper): faces, edges and vertices, and which of them meet.

Half-edge h = 3 f + k runs along side k of face f, from corner k to the next one, with the face on its left. Its twin
runs along the same edge the other way, in the neighbouring face; on a border there is none.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from verlet_numba.scene.body import Integers


class SurfaceError(ValueError):
    """Triangles that are no surface, and `face`, the number of the first that is to blame."""

    def __init__(self, face: int, message: str) -> None:
        super().__init__(message)
        self.face = face


@dataclass(frozen=True, eq=False)
class HalfEdges:
    """Those of F consistently wound triangles, one or two an edge; `half_edges` builds them."""

    twin: Integers                  # (3 F,) half-edge along the same edge, -1 on a border
    next: Integers                  # (3 F,) half-edge that follows in its face
    vertex: Integers                # (3 F,) where it starts
    face: Integers                  # (3 F,)

    @property
    def faces(self) -> Integers:
        """Triangles (F, 3)."""
        return self.vertex.reshape(-1, 3)

    @cached_property
    def edges(self) -> Integers:
        """The edges (E, 2), each once, smaller vertex number first, in ascending order."""
        once = self.twin < np.arange(len(self.twin))
        return np.asarray(np.unique(np.sort(np.stack([self.vertex, self.end], axis=1)[once], axis=1), axis=0))

    @cached_property
    def vertices(self) -> Integers:
        """Numbers of the vertices that faces use, in ascending order."""
        return np.unique(self.vertex)

    @cached_property
    def end(self) -> Integers:
        """(3 F,) vertex at which each half-edge ends."""
        return np.asarray(self.vertex[self.next])

    @cached_property
    def outgoing(self) -> Integers:
        """(P,) a half-edge that starts at each vertex, on the border if there is one; -1 for vertices without faces."""
        start = np.full(self.vertex.max(initial=-1) + 1, -1)
        inside, border = np.flatnonzero(self.twin >= 0), np.flatnonzero(self.twin < 0)
        start[self.vertex[inside]] = inside
        start[self.vertex[border]] = border
        return start

    def turn(self, vertex: int) -> Iterator[int]:
        """The half-edges that start at a vertex, counter-clockwise; about a border vertex from border to border."""
        first = h = int(self.outgoing[vertex])
        while h >= 0:
            yield h
            h = int(self.twin[self.next[self.next[h]]])
            if h == first:
                return

    def faces_around(self, vertex: int) -> list[int]:
        """The faces at a vertex, counter-clockwise."""
        return [int(self.face[h]) for h in self.turn(vertex)]

    def neighbours(self, vertex: int) -> list[int]:
        """The vertices that an edge joins to this one, counter-clockwise."""
        around = list(self.turn(vertex))
        found = [int(self.end[h]) for h in around]
        if around and self.twin[around[0]] < 0:          # the last border edge ends here and has no twin that starts here
            found.append(int(self.vertex[self.next[self.next[around[-1]]]]))
        return found

    def borders(self) -> list[Integers]:
        """The loops of vertices along which the surface is open, faces on the left; none if it is closed."""
        loops, left = [], set(np.flatnonzero(self.twin < 0).tolist())
        while left:
            first = h = min(left)
            loop = []
            while True:
                left.discard(h)
                loop.append(int(self.vertex[h]))
                h = int(self.next[h])
                while self.twin[h] >= 0:                 # turn about the end until the border goes on
                    h = int(self.next[self.twin[h]])
                if h == first:
                    break
            loops.append(np.array(loop))
        return loops

    def pinched(self) -> Integers:
        """Faces, in ascending order, at vertices where several fans of faces meet in nothing but the vertex."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        after = self.twin[self.next[self.next]]
        h = np.flatnonzero(after >= 0)
        links = coo_array((np.ones(len(h)), (h, after[h])), shape=(len(after), len(after)))
        _, fan = connected_components(links, directed=False)
        first = np.full(len(self.outgoing), -1)
        first[self.vertex] = fan
        wrong = np.isin(self.vertex, self.vertex[first[self.vertex] != fan])
        return np.unique(self.face[wrong])


def half_edges(triangles: Integers) -> HalfEdges:
    """The half-edges of triangles (F, 3).

    Raises SurfaceError if more than two of them share an edge, or if two run along it the same way.
    """
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)        # (3 F, 2), directed
    _, edge, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.ravel()
    number = np.arange(len(sides))
    if (count > 2).any():
        face = int(np.argmax(count[edge] > 2)) // 3
        raise SurfaceError(face, "has a side in common with more than one other")
    order = np.argsort(edge, kind="stable")
    paired = np.flatnonzero(count[edge[order]] == 2)
    one, other = order[paired[::2]], order[paired[1::2]]
    along = sides[one, 0] == sides[other, 0]
    if along.any():
        raise SurfaceError(int(one[along].min()) // 3, "is wound against its neighbour: turn it around")
    twin = np.full(len(sides), -1)
    twin[one], twin[other] = other, one
    return HalfEdges(twin, number - number % 3 + (number + 1) % 3, sides[:, 0].copy(), number // 3)


def adjacency(pairs: Integers, vertices: int) -> tuple[Integers, Integers]:
    """Neighbours of each vertex by edges (E, 2): those of v are neighbour[start[v]:start[v + 1]], in ascending order.

    Returns start (vertices + 1,) and neighbour (2 E,).
    """
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    return np.searchsorted(both[:, 0], np.arange(vertices + 1)), both[:, 1].copy()
