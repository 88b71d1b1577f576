"""After a divergence: the substep, particle and constraint where it broke."""

from dataclasses import asdict, dataclass

import numpy as np

from verlet_numba.buffers.world import NUMBER, World
from verlet_numba.run.contents import copy_names
from verlet_numba.run.engine import State, run_substep, sound
from verlet_numba.scene.body import Body
from verlet_numba.scene.build import Model


@dataclass(frozen=True)
class Divergence:
    """Where a simulation ceased to be one. `constraint`: the worst one when all was still finite."""

    step: int
    time: float                     # s
    body: str
    particle: int                   # of that body
    constraint: str

    def __str__(self) -> str:
        return (f"diverged in step {self.step} at {self.time:.6g} s: body {self.body!r}, particle {self.particle} is not finite; "
                f"worst constraint before: {self.constraint}. Try more substeps or a smaller speed")

    def as_dict(self) -> dict[str, object]:
        return asdict(self)


def examine(model: Model, before: State, most: int) -> Divergence:
    """Repeat the chunk from the state before it, substep by substep (at most so many), until a position is not finite."""
    before.restore(model)
    last = State.of(model)
    for _ in range(most):
        last = State.of(model)
        run_substep(model)
        if not sound(model.world):
            break
    step, order = int(model.world.clock[NUMBER]), model.world.observed.scene_order
    lost = ~np.isfinite(model.world.particles.position[:, order]).all(0)
    if not lost.any():              # finite, but too far for the file
        lost = np.abs(model.world.particles.position[:, order]).max(0) == np.abs(model.world.particles.position).max()
    name, particle = whose(model.bodies, int(np.argmax(lost)))
    last.restore(model)
    return Divergence(step, step * model.world.solver.step, name, particle, worst_constraint(model.world, model.bodies))


def whose(bodies: list[Body], particle: int) -> tuple[str, int]:
    """Name of the body, and the number in it, of a particle of the file."""
    for body in bodies:
        count = len(body.shape.positions)
        if particle < body.copies * count:
            return copy_names(body)[particle // count], particle % count
        particle -= body.copies * count
    raise IndexError(particle)


def worst_constraint(world: World, bodies: list[Body]) -> str:
    """The distance constraint that is farthest off its length, in words."""
    observed = world.observed
    if not len(observed.rest):
        return "none, the scene has no sticks"
    position = world.particles.position.astype(float)
    i, j = observed.pairs
    with np.errstate(all="ignore"):
        length = np.linalg.norm(position[:, j] - position[:, i], axis=0)
        error = np.abs(length / observed.rest - 1.0)
    worst = int(np.nanargmax(np.where(observed.rest > 0, error, 0.0))) if np.isfinite(error).any() else 0
    place = np.empty(position.shape[1], np.int64)
    place[observed.scene_order] = np.arange(len(observed.scene_order))
    name, first = whose(bodies, int(place[i[worst]]))
    _, second = whose(bodies, int(place[j[worst]]))
    return f"stick {first}-{second} of {name!r}, {length[worst]:.4g} m long instead of {observed.rest[worst]:.4g} m"
