"""Whether sticks hold a body rigid, and the sticks that are missing.

The rigidity matrix R has a row for each stick, d(length)/d(positions): the unit vector u of the stick at one end, -u at
the other. Velocities that stretch no stick are its null space. Translations and rotations always lie in it; a body is
(infinitesimally) rigid if nothing else does (Asimow & Roth 1978).
"""

import numpy as np

from verlet_numba.scene.body import Floats, Integers

TOLERANCE = 1e-9        # singular values below this part of the largest count as zero; a unit row has norm sqrt(2)
DENSE_LIMIT = 400       # particles up to which `brace` decomposes the whole matrix


def rigidity_matrix(positions: Floats, sticks: Integers) -> Floats:
    """R (C, 3 P), rows of unit directions so that its rank does not depend on the scale; zero rows for zero lengths."""
    unit = _unit(positions[sticks[:, 0]] - positions[sticks[:, 1]])
    matrix = np.zeros((len(sticks), len(positions), 3))
    row = np.arange(len(sticks))
    matrix[row, sticks[:, 0]] = unit
    matrix[row, sticks[:, 1]] = -unit
    return matrix.reshape(len(sticks), positions.size)


def rank(positions: Floats, sticks: Integers) -> int:
    """Number of independent sticks: the rank of the rigidity matrix, by singular values."""
    return _numerical_rank(rigidity_matrix(positions, sticks))


def full_rank(positions: Floats) -> int:
    """The rank that sticks between all pairs would have: d P - d (d + 1) / 2 for points that span d dimensions.

    That is 3 P - 6 for a solid body. Points in a plane or on a line reach 2 P - 3 or P - 1: to first order no stick
    resists bending out of them.
    """
    d = _numerical_rank(positions - positions[0]) if len(positions) else 0
    return d * len(positions) - d * (d + 1) // 2


def is_rigid(positions: Floats, sticks: Integers) -> bool:
    """True if the sticks hold the particles as sticks between all pairs would."""
    return holds_together(positions, sticks) or rank(positions, sticks) == full_rank(positions)


def brace(positions: Floats, sticks: Integers) -> Integers:
    """`sticks` (C, 2) followed by those that make the body rigid; `sticks` itself if it is rigid already.

    Up to DENSE_LIMIT particles these are the fewest possible. Larger bodies are braced by `grow`, which costs little
    but may add more.
    """
    if len(positions) > DENSE_LIMIT:
        return grow(positions, sticks)
    return sticks if holds_together(positions, sticks) else _brace_exactly(positions, sticks)


def holds_together(positions: Floats, sticks: Integers) -> bool:
    """True if one cluster grows over the whole body without another stick, which proves it rigid and costs little."""
    return bool(_braced_tetrahedron(positions, _neighbours(positions, sticks))) and len(grow(positions, sticks)) == len(sticks)


def _brace_exactly(positions: Floats, sticks: Integers) -> Integers:
    """Adds one stick after another that raises the rank by one, the one the remaining floppy motions stretch most.

    `motion` holds an orthonormal basis of the null space, as vectors (P, 3, k). Pair (i, j) stretches by
    u . (motion_i - motion_j). Holding it takes the direction w of that k-vector out of the basis.
    """
    missing = full_rank(positions) - rank(positions, sticks)
    if missing == 0:
        return sticks
    matrix = np.concatenate([rigidity_matrix(positions, sticks), np.zeros((1, positions.size))])
    _, singular, basis = np.linalg.svd(matrix, full_matrices=True)
    motion = basis[np.sum(singular > TOLERANCE * max(singular[0], 1)):].T.reshape(len(positions), 3, -1)
    added = []
    for _ in range(missing):
        i, j, stretch = _most_stretched(positions, motion)
        added.append([i, j])
        complement = np.linalg.svd(stretch[None], full_matrices=True)[2][1:]
        motion = motion @ complement.T
    return np.concatenate([sticks.reshape(-1, 2), np.array(added, np.int64)])


def _most_stretched(positions: Floats, motion: Floats) -> tuple[int, int, Floats]:
    """The pair of particles whose distance the motions change fastest, and by how much each of them does (k,)."""
    best, winner = -1.0, (0, 0, np.zeros(0))
    for i in range(len(positions) - 1):
        unit = _unit(positions[i] - positions[i + 1:])
        stretch = np.einsum("jc,jck->jk", unit, motion[i] - motion[i + 1:])
        size = np.round(np.linalg.norm(stretch, axis=1), 9)         # equal ones stay equal on every machine
        j = int(np.argmax(size))
        if size[j] > best:
            best, winner = float(size[j]), (i, i + 1 + j, stretch[j])
    return winner


def grow(positions: Floats, sticks: Integers) -> Integers:
    """`sticks` and those that let one rigid cluster grow over the whole body, one particle at a time.

    A particle held by three sticks of independent directions to a rigid cluster belongs to it. Tetrahedra that are
    connected through faces need no further stick. Time is linear in the number of sticks for bodies of that kind.
    """
    count = len(positions)
    neighbours = _neighbours(positions, sticks)
    added: list[tuple[int, int]] = []

    def join(i: int, j: int) -> None:
        if j not in neighbours[i]:
            neighbours[i].add(j)
            neighbours[j].add(i)
            added.append((min(i, j), max(i, j)))

    cluster = _braced_tetrahedron(positions, neighbours) or _spanning_tetrahedron(positions)
    for row, i in enumerate(cluster):
        for j in cluster[:row]:
            join(i, j)
    inside = set(cluster)
    waiting = sorted(set().union(*(neighbours[i] for i in cluster)) - inside)
    while len(inside) < count:
        held = None
        while waiting and held is None:
            candidate = waiting.pop()
            if candidate not in inside and _held(positions, candidate, neighbours[candidate] & inside):
                held = candidate
        if held is None:                            # nothing is held: tie the particle that lacks least
            held = max((p for p in range(count) if p not in inside), key=lambda p: (len(neighbours[p] & inside), -p))
            for anchor in cluster:
                if _held(positions, held, neighbours[held] & inside):
                    break
                join(held, anchor)
        inside.add(held)
        waiting.extend(sorted(neighbours[held] - inside))
    return np.concatenate([sticks, np.array(sorted(added), np.int64).reshape(-1, 2)])


def _neighbours(positions: Floats, sticks: Integers) -> list[set[int]]:
    """The particles that sticks join to each particle."""
    neighbours: list[set[int]] = [set() for _ in positions]
    for i, j in sticks.tolist():
        neighbours[i].add(j)
        neighbours[j].add(i)
    return neighbours


def _held(positions: Floats, particle: int, anchors: set[int]) -> bool:
    """True if the sticks from `particle` to `anchors` have three independent directions."""
    if len(anchors) < 3:
        return False
    return _numerical_rank(_unit(positions[particle] - positions[sorted(anchors)]), tolerance=1e-6) == 3


def _braced_tetrahedron(positions: Floats, neighbours: list[set[int]]) -> list[int]:
    """Four particles, not in one plane, that already have all six sticks between them; [] if there are none."""
    for i, near in enumerate(neighbours):
        for j in sorted(near):
            for k in sorted(near & neighbours[j]):
                for last in sorted(near & neighbours[j] & neighbours[k]):
                    if _held(positions, last, {i, j, k}):
                        return [i, j, k, last]
    return []


def _spanning_tetrahedron(positions: Floats) -> list[int]:
    """Four particles far apart: each in turn the farthest from the point, line and plane of those before."""
    rest = positions - positions[0]
    chosen = [0]
    for _ in range(3):
        farthest = int(np.argmax(np.linalg.norm(rest, axis=1)))
        chosen.append(farthest)
        axis = rest[farthest] / np.linalg.norm(rest[farthest])
        rest = rest - (rest @ axis)[:, None] * axis
    return chosen


def _numerical_rank(matrix: Floats, tolerance: float = TOLERANCE) -> int:
    if matrix.size == 0:
        return 0
    singular = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(singular > tolerance * singular[0])) if singular[0] > 0 else 0


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))
