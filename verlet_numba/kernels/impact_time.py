"""When two features on straight ways first come within a distance of each other: never told too late, and never missed.

Additive continuous collision detection (Li, Kaufman & Jiang 2021, Codimensional Incremental Potential Contact, algorithm 1).
With the mean step taken off, no two points of the features come nearer by more than v t, v the largest step of the first
feature's corners and that of the second's together. So at the distance d they are free for (d - reach) / v, of which a part
is gone; then the distance is measured anew, until little is left or the step is over. No equation is
solved: parallel edges, triangles without area and points that move in a plane need no case of their own.
"""

import math

from verlet_numba._jit import kernel
from verlet_numba.physics.closest import length, of_segments, on_triangle

PART = 0.9              # of the free time that is gone at once
LEFT = 0.1              # of the reach, or of the first distance if that is less: nearer than that is touching
HAIR = 1e-6             # of the first distance: the same where there is no reach
ROUNDS = 256            # of measuring: then it is said to touch where it has got to
ROUNDING = 1e-14        # of the coordinates: how much a distance may be off
NEVER = 2.0             # a time after the step's end


@kernel
def apart_at(t, start, now, a, b, c, d, edges):
    """Features when all points have gone the part t of their ways: weights of the points, the vector across, the distance.

    start and now (A, 3) m; a vertex a and a triangle b, c, d, or two edges a, b and c, d. Seen from point a, so that the
    result does not depend on where everything is.
    """
    x, y, z = now[a, 0] - start[a, 0], now[a, 1] - start[a, 1], now[a, 2] - start[a, 2]
    bx = start[b, 0] - start[a, 0] + t * (now[b, 0] - start[b, 0] - x)
    by = start[b, 1] - start[a, 1] + t * (now[b, 1] - start[b, 1] - y)
    bz = start[b, 2] - start[a, 2] + t * (now[b, 2] - start[b, 2] - z)
    cx = start[c, 0] - start[a, 0] + t * (now[c, 0] - start[c, 0] - x)
    cy = start[c, 1] - start[a, 1] + t * (now[c, 1] - start[c, 1] - y)
    cz = start[c, 2] - start[a, 2] + t * (now[c, 2] - start[c, 2] - z)
    dx = start[d, 0] - start[a, 0] + t * (now[d, 0] - start[d, 0] - x)
    dy = start[d, 1] - start[a, 1] + t * (now[d, 1] - start[d, 1] - y)
    dz = start[d, 2] - start[a, 2] + t * (now[d, 2] - start[d, 2] - z)
    if edges:
        u, v, squared = of_segments(0.0, 0.0, 0.0, bx, by, bz, cx, cy, cz, dx, dy, dz)
        p, q, r, s = 1.0 - u, u, v - 1.0, -v
    else:
        u, v, w, squared = on_triangle(0.0, 0.0, 0.0, bx, by, bz, cx, cy, cz, dx, dy, dz)
        p, q, r, s = 1.0, -u, -v, -w
    return (p, q, r, s, q * bx + r * cx + s * dx, q * by + r * cy + s * dy, q * bz + r * cz + s * dz, math.sqrt(squared))


@kernel
def quickest(start, now, a, b, c, d, edges):
    """The most by which the features may come nearer in the step, and how far their points are and get from point a."""
    u, v, w = 0.0, 0.0, 0.0
    for k in (a, b, c, d):
        u, v, w = u + (now[k, 0] - start[k, 0]), v + (now[k, 1] - start[k, 1]), w + (now[k, 2] - start[k, 2])
    u, v, w, one, other, far = 0.25 * u, 0.25 * v, 0.25 * w, 0.0, 0.0, 0.0
    for place, k in enumerate((a, b, c, d)):
        step = length(now[k, 0] - start[k, 0] - u, now[k, 1] - start[k, 1] - v, now[k, 2] - start[k, 2] - w)
        if place == 0 or (place == 1 and edges):
            one = max(one, step)
        else:
            other = max(other, step)
        far = max(far, length(start[k, 0] - start[a, 0], start[k, 1] - start[a, 1], start[k, 2] - start[a, 2]))
    return one + other, far


@kernel
def time_of_impact(start, now, a, b, c, d, edges, reach):
    """The part of the step, 0 to 1, that is safe: up to it the features stay farther apart than `reach`. NEVER: all of it.

    0 where they are as near as that at the start. Arguments as in `apart_at`; reach in m, at least 0.
    """
    step, far = quickest(start, now, a, b, c, d, edges)
    trace = ROUNDING * (far + step)
    free = apart_at(0.0, start, now, a, b, c, d, edges)[7] - reach - trace
    if not free > 0.0:
        return 0.0
    least, t = min(LEFT * free, max(LEFT * reach, HAIR * free)), 0.0
    for _ in range(ROUNDS):
        if free > step * (1.0 - t):
            return NEVER
        t += PART * free / step
        if t >= 1.0:
            return NEVER
        free = apart_at(t, start, now, a, b, c, d, edges)[7] - reach - trace
        if free <= least:
            break
    return t
