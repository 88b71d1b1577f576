"""Islands: entities that hang together by touches, and the touches sorted by them.

What is in different islands cannot influence each other within a substep, so each is solved on its own: a body far away
does not change how often another one is swept. What nothing moves, the world first of all, joins nothing.
"""

from verlet_numba._jit import inlined, kernel


@inlined
def root_of(parent, e):
    """The root of e's tree; every other node on the way is hung one higher (path halving, Tarjan & van Leeuwen 1984)."""
    while parent[e] != e:
        parent[e] = parent[parent[e]]
        e = parent[e]
    return e


@inlined
def movable(mass, e):
    """Whether entity e gives way to an impulse at all."""
    return mass[e, 0] > 0.0 or mass[e, 4] + mass[e, 5] + mass[e, 6] > 0.0


@kernel
def sort_islands(first, second, listed, mass, parent, label, order, island):
    """Sort touches by island, islands in the order of their first touch. Returns the number of islands.

    first, second (T,): entities of touch t < listed; mass (E, 10): those of no response join nothing, the world is one;
    parent (E,): every touched entity its own on entry.
    Out: order (T,): touches, island by island; island (T + 1,): where each begins; label (E,): scratch.
    """
    for t in range(listed):
        if movable(mass, first[t]) and movable(mass, second[t]):
            a, b = root_of(parent, first[t]), root_of(parent, second[t])
            parent[max(a, b)] = min(a, b)
        label[first[t]] = -1
        label[second[t]] = -1
    islands = 0
    for t in range(listed):
        root = root_of(parent, first[t] if movable(mass, first[t]) else second[t])
        if label[root] < 0:
            label[root] = islands
            island[islands] = 0
            islands += 1
        island[label[root]] += 1
    begin = 0
    for i in range(islands):
        begin += island[i]
        island[i] = begin
    island[islands] = begin
    for t in range(listed - 1, -1, -1):
        i = label[root_of(parent, first[t] if movable(mass, first[t]) else second[t])]
        island[i] -= 1
        order[island[i]] = t
    return islands
