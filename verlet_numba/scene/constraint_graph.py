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

from verlet_numba.buffers import Graph, gate
from verlet_numba.scene.body import Body, Floats, Integers, Shape
from verlet_numba.scene.constraints import plain, weights
from verlet_numba.scene.numbering import Numbering, padded

REPEATS: dict[str, Callable[[int, int], int]] = {
    "by_level": lambda n, k: -(-n // k), "halving": lambda n, k: -(-n // 2 ** (k - 1)), "once": lambda n, k: 1}
"""How often level k of n comes: n/k or n/2^(k-1), rounded up, or once."""

PACKED_BYTES = 24_576       # bodies side by side fill three quarters of a first-level cache of 32 KiB
LANES = 16                  # in whole multiples of this
MOST_LANES = 128


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


def lists(shape: Shape, repeats: str) -> list[Integers]:
    """What a body's buckets are relaxed by: the template's own order, then C_v of every particle."""
    return [np.arange(len(shape.sticks)), *(constraint_list(shape.sticks, v, repeats) for v in range(len(shape.positions)))]


def lanes_of(particles: int, itemsize: int) -> int:
    """Bodies that are packed side by side."""
    fit = PACKED_BYTES // (3 * particles * itemsize)
    return min(max(fit // LANES, 1) * LANES, MOST_LANES)


class Kind(NamedTuple):
    """Bodies that share topology, rest lengths, masses and stride, so that lists relax them side by side."""

    shape: Shape
    stride: int
    weight: Floats              # (2, C)


def kind_of(shape: Shape, index: Integers, inverse_mass: Floats) -> tuple[tuple[bytes | int, ...], Kind]:
    """The kind of a body whose copies have the inner indices (K, P), and a key that tells kinds apart."""
    weight, _ = weights(plain(shape.sticks.T, shape.lengths, 0.0), inverse_mass[index[0]], 1.0)
    stride = int(index[0, 1] - index[0, 0])
    return (stride, shape.sticks.tobytes(), shape.lengths.tobytes(), weight.tobytes()), Kind(shape, stride, weight)


def graph_of(bodies: list[Body], numbering: Numbering, inverse_mass: Floats, repeats: str, real: Any) -> Graph | None:
    """The rigid bodies of a scene, numbered body by body and copy by copy, with the lists of every kind of them.

    inverse_mass: (n,) 1/kg; repeats: a key of REPEATS; real: dtype of the run. None without rigid bodies. Before any
    collision every body is in the bucket of its template's order. Lists take memory as particles times sticks of a kind.
    """
    rigid = [(body.shape, index) for body, index in zip(bodies, numbering.bodies, strict=True) if body.shape.rigid]
    if not rigid:
        return None
    kinds: dict[tuple[bytes | int, ...], Kind] = {}
    first, kind = [], []
    for shape, index in rigid:
        key, found = kind_of(shape, index, inverse_mass)
        kinds.setdefault(key, found)
        first.append(index[:, 0])
        kind.append(np.full(len(index), list(kinds).index(key)))
    return assembled(list(kinds.values()), np.concatenate(first), np.concatenate(kind), repeats, np.dtype(real))


def assembled(kinds: list[Kind], first: Integers, kind: Integers, repeats: str, real: np.dtype[Any]) -> Graph:
    """Buffers of bodies at `first` (G,), of these kinds (G,); every body in the bucket of its template's order."""
    ordered = {each.shape.sticks.tobytes(): each.shape for each in kinds}
    listed = {topology: lists(shape, repeats) for topology, shape in ordered.items()}
    sticks = np.cumsum([0, *(len(each.shape.sticks) for each in kinds)])
    entries = [base + part for each, base in zip(kinds, sticks, strict=False) for part in listed[each.shape.sticks.tobytes()]]
    size = np.array([len(each.shape.positions) for each in kinds])
    lanes = np.array([lanes_of(particles, real.itemsize) for particles in size])
    buckets = size + 1
    bucket = (np.cumsum(buckets) - buckets)[kind]
    bodies = np.bincount(bucket, minlength=buckets.sum())
    per_bucket = [np.repeat(values, buckets) for values in ([each.stride for each in kinds], size, lanes)]
    whole_numbers = [first, bucket, first[np.argsort(bucket, kind="stable")], np.cumsum([0, *bodies]), *per_bucket,
                     np.cumsum([0, *map(len, entries)]), np.concatenate(entries),
                     np.concatenate([each.shape.sticks.T for each in kinds], axis=1)]
    reals = [np.concatenate([each.shape.lengths for each in kinds]), np.concatenate([each.weight for each in kinds], axis=1),
             np.zeros((3, padded(int((size * lanes).max()), real.itemsize)))]
    return Graph(*(gate(values, np.int64) for values in whole_numbers), *(gate(values, real) for values in reals))
