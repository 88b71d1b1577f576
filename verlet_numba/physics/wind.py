"""Air against a triangle: F = density/2 area |u.n| (u.n) n, u the air's velocity relative to the triangle, n its normal."""

from verlet_numba._jit import formula


@formula
def pressure(abx, aby, abz, acx, acy, acz, ux, uy, uz, yielding, zero):
    """Force over density/2 [m^4/s^2]: area |u.n| (u.n) n, from two edges [m] and the relative velocity [m/s].

    With the cross product c = ab x ac, area = |c|/2 and n = c/|c|: the force is |u.c| (u.c) c / (2 |c|^2).

    A corner that such triangles accelerate by k |u.n| in all gives way within the step h: solved for the velocity of the
    central difference, as in physics/resistance.py, the force is divided by 1 + k h/2. Without that, a strong wind throws
    a light cloth past the wind's own speed. With k = valence share area |u.n| and area |u.n| = |u.c|/2, the divisor is
    1 + yielding |u.c|/2 for yielding = valence share h/2 [s/m^3 per m^3/kg of density]. `zero` gives the precision and is
    what a triangle without area feels.
    """
    cx, cy, cz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    squared = cx * cx + cy * cy + cz * cz
    along = ux * cx + uy * cy + uz * cz
    twice = squared + squared
    scale = abs(along) * along / (twice + yielding * squared * abs(along)) if twice > zero else zero
    return cx * scale, cy * scale, cz * scale
