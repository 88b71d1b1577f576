"""The scene doctor: what is allowed, but unlikely to be meant or unlikely to go well. Warnings, never errors."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from verlet_numba.scene.body import Body
from verlet_numba.scene.clearance import clearance
from verlet_numba.scene.occupied import load_surfaces
from verlet_numba.scene.overlap import overlaps
from verlet_numba.scene.problems import Path as Key
from verlet_numba.scene.problems import Problem
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_colliders import Collider
from verlet_numba.scene.shapes import stick_lengths
from verlet_numba.scene.source import Source

Warnings = Iterator[tuple[Key, str]]

TOUCH = 1e-6            # of a body's size: overlap up to this is touching
STRETCH = 0.01          # relative length error at the start that is worth a word
MASS_RATIO = 100.0      # of particles joined to each other, above which few passes leave visible stretch
RESOLVED = 1e-3         # of the smallest stick: coarser spacing of numbers than this spoils its length


def examine(scene: Scene, bodies: list[Body], folder: Path, source: Source) -> list[Problem]:
    """Warnings about a scene and its placed bodies, with positions in the file, in the order of the checks below."""
    surfaces, unread = load_surfaces(scene, folder, source)
    found = [*_bracing(scene, bodies), *_sticks(scene, bodies), *_attachments(scene, bodies)]
    if scene.effects.contact != "none":
        for index, collider in enumerate(scene.colliders):
            if collider.kind != "mesh" or index in surfaces:
                found += _inside(collider, scene, bodies, lambda points, c=collider, s=surfaces.get(index):
                                 clearance(c, points, s))
            found += _too_fast(collider, scene, bodies)
        found += [*overlaps(scene, bodies), *_not_simulated(scene, bodies)]
    found += _precision(scene, bodies)
    return unread + [source.problem(path, message) for path, message in found]
