"""How fast bodies become that fall on what is below them: from the height h with sqrt(v^2 + 2 g h).

Heights are those of boxes about bodies and colliders at the start, along gravity; what lies between, and the air, would make them
less fast. What is pinned or attached does not fall freely.
"""

import numpy as np

from verlet_numba.scene.body import Body, Floats
from verlet_numba.scene.schema import Scene
from verlet_numba.scene.schema_colliders import Collider


def landing_speeds(scene: Scene, bodies: list[Body], speed: Floats, below: Floats) -> Floats:
    """(B, S) m/s: of bodies with these speeds (B,) at the start when they come down on each box (S, 2, 3); 0 if they miss it."""
    gravity = np.asarray(scene.effects.gravity or (0.0, 0.0, 0.0), float)
    strength, attached = float(np.linalg.norm(gravity)), {name for row in scene.attachments for name in row[::2]}
    drop = np.zeros((len(bodies), len(below)))
    for index, body in enumerate(bodies if strength and len(below) else []):
        if not body.pinned.any() and body.name not in attached:
            drop[index] = drops(box_of(body.positions), below, gravity / strength)
    return np.where(drop > 0, np.sqrt(speed[:, None] ** 2 + 2 * strength * drop), 0.0)


def drops(boxes: Floats, below: Floats, down: Floats) -> Floats:
    """(S,) m how far the highest of some boxes (K, 2, 3) falls along `down` onto each of others (S, 2, 3); 0 if none is over it."""
    upright = int(np.abs(down).argmax())
    beside = [axis for axis in range(3) if axis != upright]
    over = ((boxes[:, None, 0][..., beside] < below[None, :, 1][..., beside])
            & (boxes[:, None, 1][..., beside] > below[None, :, 0][..., beside])).all(axis=2)
    bottom, top = (boxes[:, 1], below[:, 0]) if down[upright] > 0 else (boxes[:, 0], below[:, 1])
    gap = np.where(over, (top[None, :, upright] - bottom[:, None, upright]) * np.sign(down[upright]), 0.0)
    return np.asarray(gap.max(axis=0, initial=0.0))


def box_of(positions: Floats) -> Floats:
    """(K, 2, 3) least and largest coordinates of copies (K, P, 3)."""
    return np.stack([positions.min(axis=1), positions.max(axis=1)], axis=1)


def box_about(collider: Collider) -> Floats:
    """(2, 3) the same of a box, a sphere or a cylinder where it stands at the start."""
    match collider.kind:
        case "box":
            half = np.asarray(collider.size) / 2
        case "sphere":
            half = np.full(3, collider.radius)
        case "cylinder":
            axis = np.asarray(collider.axis) / np.linalg.norm(collider.axis)
            half = np.abs(axis) * collider.length / 2 + collider.radius * np.sqrt(np.maximum(0, 1 - axis**2))
        case _:
            raise ValueError(f"a {collider.kind} has no such box")
    return np.asarray(np.asarray(collider.position) + np.outer([-1, 1], half), float)
