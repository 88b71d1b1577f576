"""Chains of distance constraints, each relaxed as a whole: rows, columns and diagonals of cloth, ropes, chains of sticks.

With e_k = x_k+1 - x_k and the correction x_k += w_k (m_k e_k - m_k-1 e_k-1), the linearised constraints of a chain are one
tridiagonal system for the multipliers m [kg],

    (w_k + w_k+1 + a) e_k.e_k m_k - w_k e_k.e_k-1 m_k-1 - w_k+1 e_k.e_k+1 m_k+1 = |e_k| (|e_k| - rest_k),

a = compliance / h^2, solved by elimination and back substitution (Thomas 1949). Written with e and not the unit vector, it
takes one square root and one division a stick. Chains of a family lie side by side: constraint k joins particles k and
k + shift and goes on from constraint k - shift, so that every stretch of `shift` constraints is a vector loop. Where that is
short (rows of a single cloth) the system is turned: its columns become rows.

The solve is one step of Newton's method. Where it changes a stick by more than TURN of its length, lines say nothing about
what happens: that chain is relaxed stick by stick instead, and counted.
"""

import math

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.buffers import FALLEN
from verlet_numba.kernels.relax import share_of
from verlet_numba.physics.distance import excess, stretch_approximate

TURN = 2.0          # times its length: no turn changes a stick by more
TILE = 8            # numbers of a line of the cache, in double precision


@kernel
def relax_lines(position, inverse_mass, lines, softness, tolerance, approximate, counts):
    """Relax every chain once, family by family. Returns the number of constraints in the chains that were relaxed."""
    if lines is None:
        return 0
    vector, pivot, bond, pull = lines.vector, lines.pivot, lines.bond, lines.pull
    moved, turned, apart = lines.moved, lines.turned, lines.apart
    relaxed = 0
    for r in range(lines.lanes.size):
        i, s, n, d, rows = lines.first[r], lines.shift[r], lines.lanes[r], lines.data[r], lines.rows[r]
        rest, diagonal, coupling = lines.rest[d:d + n], lines.diagonal[d:d + n], lines.coupling[d:d + n]
        measure(position, i, s, n, rest, diagonal, vector, pivot, pull, approximate)
        ease(softness, d, n, vector, pull)
        relaxed += leave(tolerance, s, n, rest, diagonal, coupling, vector, pull, apart, lines.active[r])
        couple(vector, s, n, coupling, bond)
        if rows == 0:
            solve(pivot, bond, pull, s, n)
        else:
            turn(pivot, turned[0], rows, n // rows)
            turn(bond, turned[1], rows, n // rows)
            turn(pull, turned[2], rows, n // rows)
            solve(turned[0], turned[1], turned[2], s * rows, n)
            turn(turned[2], pull, n // rows, rows)
        weigh(inverse_mass, i, s, n, vector, pull, moved)
        wild = count_wild(s, n, rest, diagonal, moved, apart)
        if wild > 0:
            spread(apart, coupling, s, n)
            counts[FALLEN] += let_go(diagonal, coupling, apart, pull, n)
            weigh(inverse_mass, i, s, n, vector, pull, moved)
        shift(position, moved, i, s, n)
        tense(softness, d, n, diagonal, vector, pull)
        if wild > 0:
            relax_singly(position, inverse_mass, i, s, n, rest, diagonal, apart, softness, d, approximate)
    return relaxed


@kernel
def owed(squared, rest, approximate):
    """What is missing of the rest length, times the length [m^2], with the exact or the approximate square root."""
    if approximate is None:
        return excess(squared, rest)
    return squared * stretch_approximate(squared, rest)


@kernel
def measure(position, i, s, n, rest, diagonal, vector, pivot, pull, approximate):
    """The chains' vectors, the diagonal and the right side of their systems."""
    x, y, z = position[0], position[1], position[2]
    xi, yi, zi, j = x[i:i + n], y[i:i + n], z[i:i + n], i + s
    xj, yj, zj = x[j:j + n], y[j:j + n], z[j:j + n]
    ex, ey, ez, p, b = vector[0, :n], vector[1, :n], vector[2, :n], pivot[:n], pull[:n]
    tiny = np.finfo(position.dtype).tiny
    for k in range(n):
        dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
        squared = dx * dx + dy * dy + dz * dz + tiny
        ex[k], ey[k], ez[k] = dx, dy, dz
        p[k] = diagonal[k] * squared
        b[k] = owed(squared, rest[k], approximate)


@kernel
def ease(softness, d, n, vector, pull):
    """Compliant sticks in several passes: what the spring's tension so far accounts for is not missing."""
    if softness is None:
        return
    given = softness.given[d:d + n]
    for k in range(n):
        pull[k] -= given[k] * length(vector, k)


@kernel
def length(vector, k):
    return math.sqrt(vector[0, k] * vector[0, k] + vector[1, k] * vector[1, k] + vector[2, k] * vector[2, k])


@kernel
def leave(tolerance, s, n, rest, diagonal, coupling, vector, pull, apart, active):
    """Chains within the relative tolerance from end to end have nothing to solve. Returns the constraints of the others."""
    if tolerance is None:
        return active
    for k in range(n):
        apart[k] = diagonal[k] > 0 and abs(pull[k]) > tolerance * rest[k] * length(vector, k)
    spread(apart, coupling, s, n)
    relaxed = 0
    for k in range(n):
        if apart[k] == 0:
            pull[k] = 0.0
        elif diagonal[k] > 0:
            relaxed += 1
    return relaxed


@kernel
def couple(vector, s, n, coupling, bond):
    """What each constraint shares with the one that it goes on from."""
    ax, ay, az, bx, by, bz = vector[0, s:n], vector[1, s:n], vector[2, s:n], vector[0], vector[1], vector[2]
    w, b = coupling[s:n], bond[s:n]
    for k in range(n - s):
        b[k] = w[k] * (ax[k] * bx[k] + ay[k] * by[k] + az[k] * bz[k])


@kernel
def solve(pivot, bond, pull, s, n):
    """Elimination along the chains, `s` of them at a time, and back substitution: `pull` becomes the multipliers.

    A constraint that is masked out has a pivot of 0 and gets no multiplier.
    """
    zero, one = pivot.dtype.type(0), pivot.dtype.type(1)
    for k in range(min(s, n)):
        pivot[k] = one / pivot[k] if pivot[k] > zero else zero
        pull[k] *= pivot[k]
    for a in range(s, n, s):
        m = min(s, n - a)
        p, b, w = pivot[a:a + m], pull[a:a + m], bond[a:a + m]
        q, c = pivot[a - s:a - s + m], pull[a - s:a - s + m]
        for k in range(m):
            left = p[k] - w[k] * w[k] * q[k]
            left = one / left if left > zero else zero
            p[k] = left
            b[k] = (b[k] + w[k] * c[k]) * left
    for a in range((n - 1) // s * s - s, -1, -s):
        m = min(s, n - a - s)
        p, b, w, c = pivot[a:a + m], pull[a:a + m], bond[a + s:a + s + m], pull[a + s:a + s + m]
        for k in range(m):
            b[k] += p[k] * w[k] * c[k]


@kernel
def turn(matrix, turned, rows, columns):
    """Transpose rows x columns numbers, tile by tile."""
    for a in range(0, rows, TILE):
        for b in range(0, columns, TILE):
            for i in range(a, min(a + TILE, rows)):
                for j in range(b, min(b + TILE, columns)):
                    turned[j * rows + i] = matrix[i * columns + j]


@kernel
def weigh(inverse_mass, i, s, n, vector, pull, moved):
    """By how much the multipliers move each particle."""
    head, tail = inverse_mass[i:i + n], inverse_mass[i + s:i + s + n]
    for axis in range(3):
        e, one, other = vector[axis, :n], moved[axis, :n], moved[axis, s:s + n]
        for k in range(n):
            one[k] = head[k] * (pull[k] * e[k])
        moved[axis, n:n + s] = 0
        for k in range(n):
            other[k] -= tail[k] * (pull[k] * e[k])


@kernel
def count_wild(s, n, rest, diagonal, moved, apart):
    """Mark and count the sticks that would change by more than TURN of their length, or to what is no number."""
    ax, ay, az, bx, by, bz = moved[0], moved[1], moved[2], moved[0, s:], moved[1, s:], moved[2, s:]
    most, zero, wild = rest.dtype.type(TURN * TURN), rest.dtype.type(0), 0
    for k in range(n):
        dx, dy, dz = bx[k] - ax[k], by[k] - ay[k], bz[k] - az[k]
        tame = (dx * dx + dy * dy + dz * dz <= most * rest[k] * rest[k]) | (diagonal[k] == zero)
        apart[k] = not tame
        wild += not tame
    return wild


@kernel
def spread(apart, coupling, s, n):
    """What is marked on one constraint is marked on all of its chain."""
    for k in range(s, n):
        if coupling[k] > 0 and apart[k - s]:
            apart[k] = 1
    for k in range(n - 1, s - 1, -1):
        if coupling[k] > 0 and apart[k]:
            apart[k - s] = 1


@kernel
def let_go(diagonal, coupling, apart, pull, n):
    """Chains that are marked get no multipliers. Returns how many they are."""
    chains = 0
    for k in range(n):
        if apart[k]:
            pull[k] = 0.0
            chains += diagonal[k] > 0 and coupling[k] == 0
    return chains


@kernel
def shift(position, moved, i, s, n):
    """Move the particles."""
    for axis in range(3):
        x, by = position[axis, i:i + n + s], moved[axis]
        for k in range(n + s):
            x[k] += by[k]


@kernel
def tense(softness, d, n, diagonal, vector, pull):
    """Compliant sticks in several passes: the stretch that the tension now accounts for grows by compliance / h^2 times it."""
    if softness is None:
        return
    given, share = softness.given[d:d + n], softness.share[d:d + n]
    for k in range(n):
        given[k] += share[k] * diagonal[k] * pull[k] * length(vector, k)


@kernel
def relax_singly(position, inverse_mass, i, s, n, rest, diagonal, apart, softness, d, approximate):
    """The marked constraints one after another, from the first of each chain to its last."""
    x, y, z = position[0], position[1], position[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    for k in range(n):
        if apart[k] and diagonal[k] > 0:
            p, q = i + k, i + k + s
            dx, dy, dz = x[q] - x[p], y[q] - y[p], z[q] - z[p]
            _, f = share_of(dx * dx + dy * dy + dz * dz + tiny, rest[k], real(0), softness, d + k, approximate)
            fi, fj = f * inverse_mass[p] / diagonal[k], f * inverse_mass[q] / diagonal[k]
            x[p] += fi * dx
            y[p] += fi * dy
            z[p] += fi * dz
            x[q] -= fj * dx
            y[q] -= fj * dy
            z[q] -= fj * dz
