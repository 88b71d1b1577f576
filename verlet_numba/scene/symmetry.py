"""Symmetries of a body's sticks: permutations of its particles under which sticks stay sticks and weights stay weights."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from verlet_numba.scene.body import Floats, Integers

MOST_PARTICLES = 64         # of a body whose symmetries are searched for
MOST_TRIALS = 10_000        # of an image for a particle, before a symmetry is given up
Joined = list[dict[int, tuple[float, float]]]


class Turn(NamedTuple):
    """Particle p and stick c of a body are taken to these; `base` is taken to the particle that the turn belongs to."""

    base: int
    particles: Integers         # (P,)
    sticks: Integers            # (C,); their ends possibly exchanged, and their weights with them


def joined_by(sticks: Integers, weight: Floats, count: int) -> Joined:
    """Of every particle its neighbours, with the weights of the stick to each: its own and the neighbour's."""
    joined: Joined = [{} for _ in range(count)]
    for (i, j), (gi, gj) in zip(sticks.tolist(), weight.T.tolist(), strict=True):
        joined[i][j], joined[j][i] = (gi, gj), (gj, gi)
    return joined


def outwards(joined: Joined, base: int) -> list[tuple[int, int]]:
    """The particles of a connected body in the order of a breadth-first search, each with the one it was met from."""
    found, met = [(base, base)], {base}
    for p, _ in found:
        new = [q for q in joined[p] if q not in met]
        met.update(new)
        found += [(q, p) for q in new]
    return found


def symmetry(joined: Joined, base: int, particle: int) -> list[int] | None:
    """Images of all particles under a symmetry that takes base to particle, by backtracking; None if none is found.

    A particle's image is a neighbour of its predecessor's image, joined as the particle is to all that have images.
    """
    order, image, trials = outwards(joined, base), dict[int, int](), 0

    def fits(p: int, q: int) -> bool:
        alike = len(joined[p]) == len(joined[q]) and q not in image.values()
        return alike and all(joined[p].get(r) == joined[q].get(s) for r, s in image.items())

    choices: list[Iterator[int]] = [iter([particle])]
    while choices and trials < MOST_TRIALS:
        p = order[len(choices) - 1][0]
        image.pop(p, None)
        q = next(choices[-1], None)
        trials += 1
        if q is None:
            choices.pop()
        elif fits(p, q):
            image[p] = q
            if len(image) == len(order):
                return [image[k] for k in range(len(order))]
            choices.append(iter(joined[image[order[len(image)][1]]]))
    return None


def turns(sticks: Integers, weight: Floats, count: int) -> list[Turn]:
    """A turn for every particle of a connected body, of as few bases as are found; sticks (C, 2), weight (2, C)."""
    joined, same = joined_by(sticks, weight, count), [np.arange(count), np.arange(len(sticks))]
    number = {frozenset(pair): c for c, pair in enumerate(sticks.tolist())}
    bases, found = list[int](), list[Turn]()
    for v in range(count):
        tried = ((u, symmetry(joined, u, v)) for u in bases if count <= MOST_PARTICLES and len(number) == len(sticks))
        base, image = next(((u, image) for u, image in tried if image), (v, None))
        if image is None:
            bases.append(v)
            found.append(Turn(v, *same))
        else:
            moved = [number[frozenset(pair)] for pair in np.array(image)[sticks].tolist()]
            found.append(Turn(base, np.array(image), np.array(moved)))
    return found
