"""The order in which a rigid body's sticks are relaxed after a collision: outwards from the particle that moved most.

In the constraint graph particles are vertices and sticks are edges. The list C_v of a particle v holds every stick of
the body by its level, 1 + the path distance from v to the stick's nearer end (paper, 6.2). Of n levels the nearest
comes n times, the farthest at least once. Each level is repeated as a whole: relaxing the same stick twice running
would do nothing, it has its length already.
"""

from collections import defaultdict
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.buffers.arrays import gate
from verlet_numba.buffers.constraints import Graph
from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.constraints import plain, weights
from verlet_numba.scene.numbering import Numbering, padded
from verlet_numba.scene.symmetry import Turn, turns

REPEATS: dict[str, Callable[[int, int], int]] = {
    "by_level": lambda n, k: -(-n // k), "halving": lambda n, k: -(-n // 2 ** (k - 1)), "once": lambda n, k: 1}
"""How often level k of n comes: n/k or n/2^(k-1), rounded up, or once."""

MOST_LANES = 96             # bodies side by side; 32 take up to half as long again, 192 save nothing
LANES = 16                  # large bodies are fewer, but this many at least and in multiples of it
PACKED_BYTES = 131_072      # that they fill: a quarter of a second-level cache
Key = tuple[int, bytes, bytes]


def levels(sticks: Integers, particle: int) -> list[list[int]]:
    """Numbers of the sticks (C, 2) of a connected body, level by level, in the order in which a breadth-first search meets them.

    That order gives the paper's own example, and of the sticks of one particle the template's order.
    """
    meeting = defaultdict(list)
    for c, (i, j) in enumerate(sticks.tolist()):
        meeting[i].append((c, j))
        meeting[j].append((c, i))
    distance, queue, met, found = {particle: 0}, [particle], set[int](), list[list[int]]()
    for p in queue:
        for c, q in meeting[p]:
            if c not in met:
                met.add(c)
                if len(found) == distance[p]:
                    found.append([])
                found[-1].append(c)
            if q not in distance:
                distance[q] = distance[p] + 1
                queue.append(q)
    return found


def constraint_list(sticks: Integers, particle: int, repeats: str) -> Integers:
    """C_v of a particle: numbers of the sticks (C, 2), nearest level first, each level as often as `repeats` says."""
    found = levels(sticks, particle)
    return np.array([c for k, level in enumerate(found, 1) for c in level * REPEATS[repeats](len(found), k)], np.int64)


class Buckets(NamedTuple):
    """Of a kind: bucket 0 for the template's own order, bucket v + 1 for C_v. Those of a family are relaxed side by side."""

    entries: list[Integers]     # of each family: numbers of sticks
    family: Integers            # (P + 1,) of each bucket
    turns: list[Turn]           # of each bucket: its list is the family's under the turn


def buckets_of(sticks: Integers, weight: Floats, count: int, repeats: str) -> Buckets:
    """The buckets of bodies of `count` particles with sticks (C, 2) of weights (2, C).

    Particles that a symmetry takes to each other see the same levels, so C_v may be the image of another particle's list.
    """
    own, found = np.arange(len(sticks)), turns(sticks, weight, count)
    bases, family = np.unique([turn.base for turn in found], return_inverse=True)
    return Buckets([own, *(constraint_list(sticks, v, repeats) for v in bases.tolist())], np.array([0, *family + 1]),
                   [Turn(0, np.arange(count), own), *found])


def lists(shape: Shape, weight: Floats, repeats: str) -> list[Integers]:
    """What a body's buckets are relaxed by: the template's own order, then C_v of every particle."""
    entries, family, found = buckets_of(shape.sticks, weight, len(shape.positions), repeats)
    return [turn.sticks[entries[f]] for f, turn in zip(family, found, strict=True)]


def lanes_of(shape: Shape, itemsize: int) -> int:
    """Bodies that are packed side by side: as many as stay in the cache with positions and rest lengths."""
    fit = PACKED_BYTES // (itemsize * (3 * len(shape.positions) + len(shape.sticks)))
    return min(max(fit // LANES, 1) * LANES, MOST_LANES)


class Kind(NamedTuple):
    """Bodies that share topology, weights and stride, so that lists relax them side by side."""

    shape: Shape                # of one of them
    stride: int
    weight: Floats              # (2, C)


def kind_of(shape: Shape, index: Integers, inverse_mass: Floats) -> tuple[Key, Kind]:
    """The kind of a body whose copies have the inner indices (K, P), and a key that tells kinds apart."""
    weight, _ = weights(plain(shape.sticks.T, shape.lengths, 0.0), inverse_mass[index[0]], 1.0)
    stride = int(index[0, 1] - index[0, 0])
    return (stride, shape.sticks.tobytes(), weight.tobytes()), Kind(shape, stride, weight)


def graph_of(bodies: list[Body], numbering: Numbering, inverse_mass: Floats, repeats: str, real: Any) -> Graph | None:
    """The rigid bodies of a scene, numbered body by body and copy by copy, with the lists of every kind of them.

    inverse_mass: (n,) 1/kg; repeats: a key of REPEATS; real: dtype of the run. None without rigid bodies. Before any
    collision every body is in the bucket of its template's order. Lists take memory as particles times sticks of a kind.
    """
    kinds: dict[Key, Kind] = {}
    rests: dict[tuple[Key, bytes], Floats] = {}
    first, kind, own = [], [], []
    for body, index in zip(bodies, numbering.bodies, strict=True):
        if body.shape.rigid:
            key, found = kind_of(body.shape, index, inverse_mass)
            alike = (key, body.shape.lengths.tobytes())
            kinds.setdefault(key, found)
            rests.setdefault(alike, body.shape.lengths)
            first.append(index[:, 0])
            kind.append(np.full(len(index), list(kinds).index(key)))
            own.append(np.full(len(index), list(rests).index(alike)))
    if not first:
        return None
    column = np.cumsum([0, *map(len, rests.values())])[np.concatenate(own)]
    return assembled(list(kinds.values()), np.stack([np.concatenate(first), column]), np.concatenate(kind),
                     np.concatenate(list(rests.values())), repeats, np.dtype(real))


def assembled(kinds: list[Kind], body: Integers, kind: Integers, rest: Floats, repeats: str, real: np.dtype[Any]) -> Graph:
    """Buffers of bodies (2, G), as in Graph, of these kinds (G,), all in the buckets of their template's order."""
    known: dict[tuple[bytes, bytes], Buckets] = {}
    made = []
    for each in kinds:
        key, count = (each.shape.sticks.tobytes(), each.weight.tobytes()), len(each.shape.positions)
        if key not in known:
            known[key] = buckets_of(each.shape.sticks, each.weight, count, repeats)
        made.append(known[key])
    entries, families = [entry for each in made for entry in each.entries], [len(each.entries) for each in made]
    ends, sticks = (np.cumsum([0, *map(len, each)]) for each in (entries, [each.shape.sticks for each in kinds]))
    size = np.array([len(each.shape.positions) for each in kinds])
    lanes = np.array([lanes_of(each.shape, real.itemsize) for each in kinds])
    bucket = (np.cumsum(size + 1) - size - 1)[kind]
    family = np.concatenate([each.family for each in made]) + np.repeat(np.cumsum(families) - families, size + 1)
    places, images = ([turn.particles * each.stride for each, own in zip(kinds, made, strict=True) for turn in own.turns],
                      [turn.sticks for own in made for turn in own.turns])
    turn = np.stack([np.cumsum([0, *map(len, rows)])[:-1] for rows in (places, images)])
    order = np.argsort(family[bucket], kind="stable")
    start = np.cumsum([0, *np.bincount(family[bucket], minlength=sum(families))])
    per_family = [np.repeat(values, families, axis=-1) for values in
                  (np.array([each.stride for each in kinds]), size, lanes, np.stack([sticks[:-1], sticks[1:]]))]
    whole_numbers = [body, bucket, family, turn, np.concatenate([body, turn[:, bucket]])[:, order], start, *per_family,
                     np.stack([ends[:-1], ends[1:]]), np.concatenate(entries), np.concatenate(places), np.concatenate(images),
                     np.concatenate([each.shape.sticks.T for each in kinds], axis=1)]
    room = np.zeros((3, padded(int((size * lanes).max()), real.itemsize)))
    reals = [np.concatenate([each.weight for each in kinds], axis=1), rest, room, np.zeros(int((np.diff(sticks) * lanes).max()))]
    return Graph(*(gate(values, np.int64) for values in whole_numbers), *(gate(values, real) for values in reals))
