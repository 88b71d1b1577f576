"""Chains of distance constraints, each relaxed as a whole: rows, columns and diagonals of cloth, ropes, chains of sticks.

With e_k = x_k+1 - x_k and the correction x_k += w_k (m_k e_k - m_k-1 e_k-1), the linearised constraints of a chain are one
tridiagonal system for the multipliers m [kg],

    (w_k + w_k+1 + a) e_k.e_k m_k - w_k e_k.e_k-1 m_k-1 - w_k+1 e_k.e_k+1 m_k+1 = |e_k| (|e_k| - rest_k),

a = compliance / h^2, solved by elimination and back substitution (Thomas 1949). Written with e and not the unit vector, it
takes one square root and one division a stick. Chains of a family lie side by side: constraint k joins particles k and
k + shift and goes on from constraint k - shift, so that every stretch of `shift` constraints is a vector loop. Where that is
short (rows of a single cloth) the system is turned: its columns become rows.

The solve is one step of Newton's method. A stick that changes by d is left about d.d / (2 rest^2) too long: chains in which that
is more than the family's `settled` are solved again. So a heavy weight may swing on a light rope, which it draws so tight that
the step does not resolve its waves. Rows of cloth, which the next family spoils again, gain nothing. Where a stick would change
by more than TURN of its length, the linear system says nothing about what happens: that chain is relaxed stick by stick instead.
"""

import math

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.kernels.relax import share_of
from verlet_numba.physics.distance import excess, stretch_approximate

TURN = 2.0          # times its length: no turn changes a stick by more
MOST = 16           # solves of a chain
OPEN, WILD = 1, 2   # chains that are to be solved again, and that are relaxed stick by stick
TILE = 8            # numbers of a line of the cache, in double precision


@kernel
def relax_lines(position, inverse_mass, lines, softness, tolerance, approximate):
    """Relax every chain once, family by family. Returns the number of constraints in the chains that were relaxed."""
    if lines is None:
        return 0
    vector, pivot, bond, pull = lines.vector, lines.pivot, lines.bond, lines.pull
    moved, turned, marks = lines.moved, lines.turned, lines.marks
    relaxed = 0
    for r in range(lines.lanes.size):
        i, s, n, d, rows = lines.first[r], lines.shift[r], lines.lanes[r], lines.data[r], lines.rows[r]
        rest, diagonal, coupling = lines.rest[d:d + n], lines.diagonal[d:d + n], lines.coupling[d:d + n]
        for again in range(MOST):
            measure(position, i, s, n, rest, diagonal, vector, pivot, pull, approximate)
            ease(softness, d, n, vector, pull)
            if again:
                leave_settled(marks, pull, n)
            else:
                relaxed += leave_tolerable(tolerance, s, n, rest, diagonal, coupling, vector, pull, marks, lines.active[r])
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
            unsettled, wild = judge(s, n, rest, diagonal, moved, lines.settled[r])
            if unsettled:
                mark(s, n, rest, diagonal, coupling, moved, marks, lines.settled[r])
            if wild:
                lines.singly[0] += let_go(diagonal, coupling, marks, pull, n)
                weigh(inverse_mass, i, s, n, vector, pull, moved)
            shift(position, moved, i, s, n)
            tense(softness, d, n, diagonal, vector, pull)
            if wild:
                relax_singly(position, inverse_mass, i, s, n, rest, diagonal, marks, softness, d, approximate)
            if unsettled == wild:
                break
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
def leave_tolerable(tolerance, s, n, rest, diagonal, coupling, vector, pull, marks, active):
    """Chains within the relative tolerance from end to end have nothing to solve. Returns the constraints of the others."""
    if tolerance is None:
        return active
    for k in range(n):
        off = diagonal[k] > 0 and abs(pull[k]) > tolerance * rest[k] * length(vector, k)
        marks[k] = OPEN if off else 0
    spread(marks, coupling, s, n)
    leave_settled(marks, pull, n)
    relaxed = 0
    for k in range(n):
        relaxed += marks[k] == OPEN and diagonal[k] > 0
    return relaxed


@kernel
def leave_settled(marks, pull, n):
    """Only chains that are open have something to solve."""
    for k in range(n):
        if marks[k] != OPEN:
            pull[k] = 0.0


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
def judge(s, n, rest, diagonal, moved, settled):
    """How many sticks change too much for one solve, and how many too much for any."""
    ax, ay, az, bx, by, bz = moved[0], moved[1], moved[2], moved[0, s:], moved[1, s:], moved[2, s:]
    real = rest.dtype.type
    zero, little, most, unsettled, wild = real(0), real(2 * settled), real(TURN * TURN), 0, 0
    for k in range(n):
        dx, dy, dz = bx[k] - ax[k], by[k] - ay[k], bz[k] - az[k]
        change, unit, there = dx * dx + dy * dy + dz * dz, rest[k] * rest[k], diagonal[k] > zero
        unsettled += there & (not change <= little * unit)
        wild += there & (not change <= most * unit)
    return unsettled, wild


@kernel
def mark(s, n, rest, diagonal, coupling, moved, marks, settled):
    """Mark the chains of these sticks."""
    little, most = 2 * settled, TURN * TURN
    for k in range(n):
        dx, dy, dz = moved[0, k + s] - moved[0, k], moved[1, k + s] - moved[1, k], moved[2, k + s] - moved[2, k]
        change, unit = dx * dx + dy * dy + dz * dz, rest[k] * rest[k]
        marks[k] = 0 if diagonal[k] == 0 or change <= little * unit else OPEN if change <= most * unit else WILD
    spread(marks, coupling, s, n)


@kernel
def spread(marks, coupling, s, n):
    """The highest mark of a chain's constraints is that of all."""
    for k in range(s, n):
        if coupling[k] > 0:
            marks[k] = max(marks[k], marks[k - s])
    for k in range(n - 1, s - 1, -1):
        if coupling[k] > 0:
            marks[k - s] = max(marks[k], marks[k - s])


@kernel
def let_go(diagonal, coupling, marks, pull, n):
    """Wild chains get no multipliers. Returns how many they are."""
    chains = 0
    for k in range(n):
        if marks[k] == WILD:
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
def relax_singly(position, inverse_mass, i, s, n, rest, diagonal, marks, softness, d, approximate):
    """The constraints of wild chains one after another, from the first of each chain to its last."""
    x, y, z = position[0], position[1], position[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    for k in range(n):
        if marks[k] == WILD and diagonal[k] > 0:
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
