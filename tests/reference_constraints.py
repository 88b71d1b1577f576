"""Naive twins of constraints: sticks, chains of sticks, angles, one after another, in numpy (reference.py)."""

import itertools
from dataclasses import dataclass

import numpy as np


@dataclass
class Stick:
    i: int
    j: int
    rest: float
    compliance: float
    multiplier: float = 0.0


def relaxation_order(shape):
    """Numbers of a shape's sticks as they are relaxed: ropes even then odd; cloth diagonals, then along y, then along x."""
    if shape.layout[0] == "line":
        return [c for parity in (0, 1) for c, (i, _) in enumerate(shape.sticks) if i % 2 == parity]
    if shape.layout[0] == "grid":
        ny = shape.layout[2]
        found = {}
        for c, (a, b) in enumerate(shape.sticks):
            step = (b // ny - a // ny, b % ny - a % ny)
            found.setdefault((step, a // ny % 2, a % ny % 2), []).append(c)
        return [c for step in ((-1, 1), (1, 1), (0, 1), (1, 0)) for row in (0, 1) for column in (0, 1)
                for c in found.get((step, row, column), [])]
    return list(range(len(shape.sticks)))


def relax_stick(x, w, stick, h, tolerance=0.0, approximate=False):
    """XPBD (Macklin et al. 2016, eq. 17-18) on rows x (N, 3), inverse masses w. Returns whether it was relaxed.

    C = |d| - rest. Approximately (Jakobsen 2001): d (1 - 2 rest^2 / (d.d + rest^2)) in its place.
    """
    i, j = stick.i, stick.j
    d = x[j] - x[i]
    length = np.linalg.norm(d)
    C = length - stick.rest
    if approximate:
        C = length * (1 - 2 * stick.rest**2 / (length**2 + stick.rest**2))
    alpha = stick.compliance / h**2
    if w[i] + w[j] == 0:
        return False
    if tolerance > 0:
        off = abs(C + alpha * stick.multiplier) if stick.compliance else abs(length - stick.rest)
        if off <= tolerance * stick.rest:
            return False
    change = -(C + alpha * stick.multiplier) / (w[i] + w[j] + alpha)
    stick.multiplier += change
    if length > 0:
        x[i] -= w[i] * change * d / length
        x[j] += w[j] * change * d / length
    return True


def relax_started_stick(x, previous, w, stick, h, tolerance=0.0, approximate=False, present=False, soft=False):
    """SHAKE along r, the stick at the start of the substep: p - r (w_i + w_j) l has the length rest to first order in l.

    In lengths, with C = (p.p - rest^2) / (2 p.r) |r|, it is XPBD along r; a present direction is relax_stick's.
    """
    i, j = stick.i, stick.j
    p, r = x[j] - x[i], previous[j] - previous[i]
    if present or stick.rest == 0:
        return relax_stick(x, w, stick, h, tolerance, approximate)
    if w[i] + w[j] == 0:
        return False
    length, alpha = np.linalg.norm(r), stick.compliance / h**2
    C = (p @ p - stick.rest**2) / (2 * p @ r) * length if p @ r > 0 else 0.0
    off = abs(C + alpha * stick.multiplier) if soft else abs(np.linalg.norm(p) - stick.rest)
    if tolerance > 0 and off <= tolerance * stick.rest:
        return False
    if p @ r <= 0:
        return True
    change = -(C + alpha * stick.multiplier) / (w[i] + w[j] + alpha)
    stick.multiplier += change
    x[i] -= w[i] * change * r / length
    x[j] += w[j] * change * r / length
    return True


def chains(shape):
    """Numbers of the sticks of every chain of a shape, in the order of relaxation, and of those that are in none."""
    ends = {frozenset(stick.tolist()): c for c, stick in enumerate(shape.sticks)}
    found = []
    if shape.layout[0] == "line":
        found = [list(range(len(shape.sticks)))]
    elif shape.layout[0] == "grid":
        nx, ny = shape.layout[1:]
        for di, dj in ((1, -1), (1, 1), (0, 1), (1, 0)):
            for i, j in np.ndindex(nx, ny):
                chain = []
                if not (0 <= i - di < nx and 0 <= j - dj < ny):
                    while 0 <= i + di < nx and 0 <= j + dj < ny:
                        chain.append(ends.get(frozenset((i * ny + j, (i + di) * ny + j + dj))))
                        i, j = i + di, j + dj
                if chain and chain[0] is not None:
                    found.append(chain)
    elif not shape.rigid:
        parts = [{*map(int, stick)} for stick in shape.sticks]
        for part in parts:
            while any(part & other and not part >= other for other in parts):
                part.update(*(other for other in parts if part & other))
        for part in map(set, sorted({tuple(sorted(part)) for part in parts})):
            own = [c for c, stick in enumerate(shape.sticks) if stick[0] in part]
            tips = [p for p in sorted(part) if (shape.sticks[own] == p).sum() == 1]
            if len(own) > 1 and len(tips) == 2 and len(own) == len(part) - 1:
                chain, at = [], tips[0]
                while len(chain) < len(own):
                    chain += [c for c in own if at in shape.sticks[c] and c not in chain]
                    at = shape.sticks[chain[-1]].sum() - at
                found.append(chain)
    return found, sorted(set(range(len(shape.sticks))) - {c for chain in found for c in chain})


def relax_chain(x, w, sticks, h, tolerance=0.0, approximate=False, again=True):
    """All sticks of a chain at once, linearised: J W J^T + alpha as a dense matrix. Returns how many were relaxed, and fell back.

    If a stick would change by more than twice its length, the chain is relaxed stick by stick. With `again`, it is solved
    up to 16 times, until no stick changes by more than makes an error of 1e-4.
    """
    sticks = [stick for stick in sticks if w[stick.i] + w[stick.j] > 0]
    if not sticks:
        return 0, 0
    C, jacobian, alpha = np.zeros(len(sticks)), np.zeros((len(sticks), len(x), 3)), np.zeros(len(sticks))
    for c, stick in enumerate(sticks):
        d = x[stick.j] - x[stick.i]
        length = np.linalg.norm(d)
        C[c] = length - stick.rest
        if approximate:
            C[c] = length * (1 - 2 * stick.rest**2 / (length**2 + stick.rest**2))
        jacobian[c, stick.i], jacobian[c, stick.j] = -d / length, d / length
        alpha[c] = stick.compliance / h**2
    missing = C + alpha * [stick.multiplier for stick in sticks]
    if tolerance > 0 and (abs(missing) <= tolerance * np.array([stick.rest for stick in sticks])).all():
        return 0, 0
    J = jacobian.reshape(len(sticks), -1)
    change = np.linalg.solve(J @ (np.repeat(w, 3)[:, None] * J.T) + np.diag(alpha), -missing)
    moved = w[:, None] * (J.T @ change).reshape(x.shape)
    turned = max(np.linalg.norm(moved[stick.j] - moved[stick.i]) / stick.rest for stick in sticks)
    if turned > 2:
        for stick in sticks:
            relax_stick(x, w, stick, h, 0.0, approximate)
        return len(sticks), 1
    x += moved
    for stick, more in zip(sticks, change, strict=True):
        stick.multiplier += more
    fallen = 0
    if again and turned**2 / 2 > 1e-4:
        fallen = relax_chain(x, w, sticks, h, 0.0, approximate, again < 15 and again + 1)[1]
    return len(sticks), fallen


def relax_pieces(x, w, chain, *how):
    """A chain with pins in it is several: each is left alone, or falls back, without the others."""
    joints = [({one.i, one.j} & {other.i, other.j}).pop() for one, other in itertools.pairwise(chain)]
    cuts = [0, *(c for c, joint in enumerate(joints, 1) if w[joint] == 0), len(chain)]
    return sum((np.array(relax_chain(x, w, chain[a:b], *how)) for a, b in itertools.pairwise(cuts)), np.zeros(2, int))


def relax_angle(x, w, corners, rest):
    """One Gauss-Newton step on the angle at the middle particle: gradients n x u / a and n x v / b, n the plane's normal."""
    i, j, k = corners
    u, v = x[i] - x[j], x[k] - x[j]
    normal = np.cross(u, v)
    angle = np.arctan2(np.linalg.norm(normal), u @ v)
    normal /= np.linalg.norm(normal)
    at_i, at_k = -np.cross(normal, u) / (u @ u), np.cross(normal, v) / (v @ v)
    gradients = {i: at_i, k: at_k, j: -at_i - at_k}
    scale = (rest - angle) / sum(w[p] * (g @ g) for p, g in gradients.items())
    for p, gradient in gradients.items():
        x[p] += scale * w[p] * gradient
