"""Coulomb friction between positions: a normal displacement `push` lets friction take back up to mu push along the surface.

Both are displacements of the same particle in the same substep, so their ratio is that of the forces.
"""

from verlet_numba._jit import formula


@formula
def held(slide, push, static, dynamic):
    """Which part of the sliding displacement `slide` [m] friction takes back: all within the static cone, else dynamic push."""
    if slide <= static * push:
        return 1.0
    return dynamic * push / slide
