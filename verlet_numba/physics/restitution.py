"""Impact within a step: where a particle is at the end of it, and the displacement that it leaves with.

Verlet's path in the step is the parabola through gap(0), gap(h) with the constant acceleration a: a velocity
v = (gap(h) - gap(0)) / h - a h/2 at its start. It meets the surface at the first root s of gap(0) + v s + a s^2/2,
leaves with -e (v + a s), and flies on for h - s. What Verlet needs is the displacement of a step that would end in
that flight: the flight's parabola continued backwards to the step's start. Exact for constant acceleration.
"""

import math

from verlet_numba._jit import formula


@formula
def impact(before, after, a, h, e):
    """Gap at the end of the step [m] and displacement [m] along the normal; gaps before >= 0 > after, a [m/s^2], h [s].

    A particle that would come down again within the same step stays on the surface: (0, 0).
    """
    v = (after - before) / h - 0.5 * a * h
    root = math.sqrt(max(0.0, v * v - 2.0 * a * before))
    fall = root - v
    s = min(h, 2.0 * before / fall) if fall > 0.0 else 0.0
    leave = -e * (v + a * s)
    left = h - s
    if leave <= 0.0 or leave + 0.5 * a * h <= 0.0:
        return 0.0, 0.0
    return leave * left + 0.5 * a * left * left, leave * h + 0.5 * a * h * (left - s)
