"""One relaxation pass over all distance constraints (paper, 3.2 and 6.2).

Constraints are relaxed one after another in the order of the buffers (Gauss-Seidel). Those of a run share no
particle, so the vector loop gives exactly the result of the scalar one. Rows are sliced before the inner loop: LLVM
then checks once that they do not overlap, and vectorises.
"""

import numpy as np

from verlet_numba._jit import kernel
from verlet_numba.physics.distance import deviates, stretch, stretch_approximate


@kernel
def returned(squared, rest, approximate):
    """The part of the separation to take back, with the exact or the approximate square root."""
    if approximate is None:
        return stretch(squared, rest)
    return stretch_approximate(squared, rest)


@kernel
def relax_runs(position, runs, softness, tolerance, approximate):
    """Relax every run once. Returns the number of constraints relaxed: all that are active, or those off tolerance."""
    if runs is None:
        return 0
    if softness is not None:
        return relax_soft_runs(position, runs, softness, tolerance, approximate)
    if tolerance is not None:
        return relax_tolerant_runs(position, runs, tolerance, approximate)
    x, y, z = position[0], position[1], position[2]
    tiny = np.finfo(position.dtype).tiny
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        rest, gi, gj = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n]
        for k in range(n):
            ax, ay, az, bx, by, bz = xi[k], yi[k], zi[k], xj[k], yj[k], zj[k]     # so that they are loaded once
            dx, dy, dz = bx - ax, by - ay, bz - az
            f = returned(dx * dx + dy * dy + dz * dz + tiny, rest[k], approximate)
            fi, fj = f * gi[k], f * gj[k]
            xi[k] = ax + fi * dx
            yi[k] = ay + fi * dy
            zi[k] = az + fi * dz
            xj[k] = bx - fj * dx
            yj[k] = by - fj * dy
            zj[k] = bz - fj * dz
    return runs.active


@kernel
def relax_tolerant_runs(position, runs, tolerance, approximate):
    """The same, leaving alone what is within the relative tolerance (paper, 7)."""
    x, y, z = position[0], position[1], position[2]
    zero, slack = position.dtype.type(0), position.dtype.type(tolerance)
    tiny = np.finfo(position.dtype).tiny
    relaxed = 0
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        rest, gi, gj = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n]
        for k in range(n):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            squared = dx * dx + dy * dy + dz * dz + tiny
            off = deviates(squared, rest[k], slack) & (gi[k] + gj[k] > zero)
            relaxed += off
            f = returned(squared, rest[k], approximate) if off else zero
            fi, fj = f * gi[k], f * gj[k]
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return relaxed


@kernel
def relax_soft_runs(position, runs, softness, tolerance, approximate):
    """The same for compliant sticks over several passes: the spring's tension so far is set against the stretch.

    With C = f d the stretch and s the share of the compliance, the multiplier of the passes so far stands for the
    stretch `given` = compliance / h^2 lambda; the correction is C - given, and given grows by s (C - given)
    (Macklin et al. 2016, XPBD, eq. 18, in lengths).
    """
    x, y, z = position[0], position[1], position[2]
    zero, slack = position.dtype.type(0), position.dtype.type(slack_of(tolerance))
    tiny = np.finfo(position.dtype).tiny
    relaxed = 0
    for r in range(runs.lanes.size):
        i, j, n, d = runs.first[0, r], runs.first[1, r], runs.lanes[r], runs.data[r]
        xi, yi, zi, xj, yj, zj = x[i:i + n], y[i:i + n], z[i:i + n], x[j:j + n], y[j:j + n], z[j:j + n]
        rest, gi, gj = runs.rest[d:d + n], runs.weight[0, d:d + n], runs.weight[1, d:d + n]
        share, given = softness.share[d:d + n], softness.given[d:d + n]
        for k in range(n):
            dx, dy, dz = xj[k] - xi[k], yj[k] - yi[k], zj[k] - zi[k]
            squared = dx * dx + dy * dy + dz * dz + tiny
            missing = returned(squared, rest[k], approximate) * np.sqrt(squared) - given[k]
            off = (abs(missing) >= slack * rest[k]) & (gi[k] + gj[k] > zero)
            relaxed += off
            missing = missing if off else zero
            given[k] += share[k] * missing
            f = missing / np.sqrt(squared)
            fi, fj = f * gi[k], f * gj[k]
            xi[k] += fi * dx
            yi[k] += fi * dy
            zi[k] += fi * dz
            xj[k] -= fj * dx
            yj[k] -= fj * dy
            zj[k] -= fj * dz
    return counted(relaxed, runs.active, tolerance)


@kernel
def counted(relaxed, active, tolerance):
    """How many constraints of an instance were relaxed: without a tolerance all that are active."""
    if tolerance is None:
        return active
    return relaxed


@kernel
def relax_sticks(position, sticks, softness, tolerance, approximate):
    """Relax single sticks in order, in the same arithmetic as runs. Returns the number relaxed."""
    if sticks is None:
        return 0
    x, y, z = position[0], position[1], position[2]
    real, tiny = position.dtype.type, np.finfo(position.dtype).tiny
    slack, relaxed = real(slack_of(tolerance)), 0
    for c in range(sticks.rest.size):
        i, j, gi, gj = sticks.ends[0, c], sticks.ends[1, c], sticks.weight[0, c], sticks.weight[1, c]
        dx, dy, dz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
        off, f = share_of(dx * dx + dy * dy + dz * dz + tiny, sticks.rest[c], slack, softness, c, approximate)
        if off and gi + gj > real(0):
            relaxed += 1
            fi, fj = f * gi, f * gj
            x[i] += fi * dx
            y[i] += fi * dy
            z[i] += fi * dz
            x[j] -= fj * dx
            y[j] -= fj * dy
            z[j] -= fj * dz
    return relaxed


@kernel
def share_of(squared, rest, slack, softness, c, approximate):
    """Whether stick c is off tolerance (always, where that is 0), and which part of its separation to take back."""
    if softness is None:
        off = slack == 0 or deviates(squared, rest, slack)
        return off, returned(squared, rest, approximate)
    return soft_share(squared, rest, slack, softness, c, approximate)


@kernel
def soft_share(squared, rest, slack, softness, c, approximate):
    """The same less what the spring's tension accounts for (see relax_soft_runs)."""
    length = np.sqrt(squared)
    missing = returned(squared, rest, approximate) * length - softness.given[c]
    off = abs(missing) >= slack * rest
    if off:
        softness.given[c] += softness.share[c] * missing
    return off, missing / length


@kernel
def slack_of(tolerance):
    """The relative tolerance, 0 where there is none."""
    if tolerance is None:
        return 0.0
    return tolerance


@kernel
def forget(softness):
    """Before the first pass of a substep, no tension has been given."""
    if softness is None:
        return
    softness.given[:] = 0
