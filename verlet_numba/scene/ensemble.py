"""Several scenes of equal topology as one world, whose instances they are (buffers.Observed).

Particle k of a scene alone becomes the particles I k to I k + I - 1, one of each of I instances. So every run of
constraints becomes one that is I times as long, and a stick of a single body a run of I lanes; what stands in buffers by
particle, stick or triangle stands there I times, side by side. No two instances share a constraint or a search, and the order
of relaxation within each is that of the scene alone: with strict arithmetic its bits are the same.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from verlet_numba.buffers.arrays import Array, gate
from verlet_numba.buffers.constraints import Runs, Softness, Sticks
from verlet_numba.buffers.world import INSTANCES, SUMS, World
from verlet_numba.scene.build import Model
from verlet_numba.scene.numbering import padded

PARTICLES = {"particles.position", "particles.previous", "particles.inverse_mass", "particles.acceleration",
             "effects.gravity.acceleration", "effects.drag.linear", "effects.drag.quadratic", "effects.drag.air",
             "effects.damping.gain", "effects.damping.loss", "effects.contact.radius", "effects.contact.body",
             "effects.contact.planes_only", "effects.contact.within", "effects.friction.particle", "effects.restitution.particle",
             "snapshot.position", "snapshot.before"}
"""Values of every particle, which instances may differ in."""
VALUES = {"runs.rest", "runs.weight", "runs_softness.share", "runs_softness.given", "effects.wind.velocity", "effects.wind.share",
          "effects.carried.start", "effects.friction.solid", "effects.restitution.solid", "observed.mass", "observed.gravity",
          "observed.rest", "snapshot.touching"}
"""Other values that they may differ in."""
PLACES = {"runs.first", "runs.lanes", "runs.data", "effects.wind.first", "effects.wind.lanes", "effects.wind.data",
          "observed.scene_order", "observed.pairs"}
"""Where runs and particles of the first instance stand, and how many there are."""
LISTS = {"effects.carried.particle", "effects.carried.path"}
"""What is gone through one by one: particles of every instance, and the path of each, the same for all."""
BESIDE_EFFECTS = {"gravity", "wind", "drag", "damping", "carried", "moving", "contact", "friction", "restitution"}
"""Effects that a world of several instances may have: none of them lets two particles meet."""
BESIDE_PARTS = {"particles", "runs", "runs_softness", "effects", "solver", "observed", "snapshot", "clock"}
"""And the other parts of it. Lines, graphs, angles and a tolerance count relaxations as they go, of all instances together."""

LINE = 64               # bytes of a line of the cache


@dataclass
class Ensemble(Model):
    """The model of several scenes: scene, bodies and numbering are those of the first."""

    beginning: tuple[Array, Array]          # (3, n) m, m/s

    def given(self) -> tuple[Array, Array]:
        position, velocity = self.beginning
        return position, velocity.copy()


def together(members: list[Model]) -> Ensemble:
    """The model of scenes that `likeness` finds alike, at most INSTANCES of them. It takes over the buffers of the first."""
    first, sums = members[0], gate(np.zeros(SUMS), np.float64) if len(members) > 1 else None
    worlds = [in_runs(member.world) for member in members]
    real = first.world.particles.position.dtype
    size = padded(first.numbering.size * len(members), real.itemsize)
    world = merged("", worlds, first.numbering.size, size)
    position, velocity = (beside(list(arrays), first.numbering.size, size)
                          for arrays in zip(*(member.given() for member in members), strict=True))
    return Ensemble(first.scene, first.bodies, first.numbering, world._replace(
        observed=world.observed._replace(instances=len(members), sums=sums)), (position, velocity))


def merged(path: str, parts: list[Any], particles: int, size: int) -> Any:
    """A part of the world of all instances from that of each; `particles` of each are the first of `size` of all."""
    part, count = parts[0], len(parts)
    if isinstance(part, tuple):
        fields = (merged(f"{path}.{name}".lstrip("."), [getattr(each, name) for each in parts], particles, size)
                  for name in part._fields)           # type: ignore[attr-defined]  # all tuples of a world have names
        return type(part)(*fields)
    if part is None:
        return None
    if path in PARTICLES:
        return beside(parts, particles, size)
    if path in VALUES:
        return beside(parts)
    if path in PLACES:
        return part * count
    if path in LISTS:
        return beside([each * count + i for i, each in enumerate(parts)] if path.endswith("particle") else parts)
    return part


def beside(arrays: list[Array], most: int | None = None, size: int = 0) -> Array:
    """The last axes of arrays, or the first `most` of their entries, side by side; then zeros up to `size`."""
    joined = np.stack([array[..., :most] for array in arrays], axis=-1).reshape(*arrays[0].shape[:-1], -1)
    room = aligned((*joined.shape[:-1], max(size, joined.shape[-1])), joined.dtype)
    room[..., :joined.shape[-1]] = joined
    return room


def aligned(shape: tuple[int, ...], dtype: Any) -> Array:
    """Zeros that begin with a line of the cache: the lanes of 16 instances then do as well, and no vector lies across two lines."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    room = np.zeros(size + LINE, np.uint8)
    begin = -room.ctypes.data % LINE
    zeros: Array = room[begin:begin + size].view(dtype).reshape(shape)
    return zeros


def in_runs(world: World) -> World:
    """The same world with its single sticks as runs of one lane, which follow the others. Sticks between pins do nothing."""
    if world.sticks is None:
        return world
    sticks, moves = world.sticks, moving(world.sticks)
    count = int(moves.sum())
    before = world.runs or Runs(np.zeros((2, 0), np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64),
                                sticks.rest[:0], sticks.weight[:, :0], 0)
    runs = Runs(np.concatenate([before.first, sticks.ends[:, moves]], axis=1),
                np.concatenate([before.lanes, np.ones(count, np.int64)]),
                np.concatenate([before.data, len(before.rest) + np.arange(count)]),
                np.concatenate([before.rest, sticks.rest[moves]]),
                np.concatenate([before.weight, sticks.weight[:, moves]], axis=1), before.active + count)
    softness = world.runs_softness
    if world.sticks_softness is not None:
        share = world.sticks_softness.share[moves]
        share = share if softness is None else np.concatenate([softness.share, share])
        softness = Softness(share, np.zeros_like(share))
    return world._replace(runs=runs, runs_softness=softness, sticks=None, sticks_softness=None)


def moving(sticks: Sticks) -> Array:
    """(C,) which sticks move anything."""
    active: Array = sticks.weight.sum(0) > 0
    return active


def likeness(model: Model) -> bytes | None:
    """Equal for scenes that may be instances of one world; None: the scene is simulated in a world of its own."""
    alone, world, scene = model.world, in_runs(model.world), model.scene
    mixed = None not in (alone.runs, alone.sticks) and (alone.runs_softness is None) != (alone.sticks_softness is None)
    parts = {name for name, part in world._asdict().items() if part is not None}
    effects = {name for name, effect in world.effects._asdict().items() if effect is not None}
    bodies_answer = world.effects.contact is not None and (world.effects.contact.body >= 0).any()
    if mixed or bodies_answer or world.solver.tolerance or not parts <= BESIDE_PARTS or not effects <= BESIDE_EFFECTS:
        return None
    digest = hashlib.sha256(repr((scene.time, scene.output, world.solver)).encode())
    digest.update((world.particles.inverse_mass > 0).tobytes())
    if alone.sticks is not None:
        digest.update(moving(alone.sticks).tobytes())
    for path, value in leaves("", world):
        digest.update(f"{path} {getattr(value, 'dtype', '')} {np.shape(value)}".encode())
        if path not in PARTICLES | VALUES and path.split(".")[0] != "solver":
            digest.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
    return digest.digest()


def leaves(path: str, part: Any) -> Iterator[tuple[str, Any]]:
    """Every array and number of a part of a world, and its path."""
    if not isinstance(part, tuple):
        yield path, part
        return
    for name, value in zip(part._fields, part, strict=True):   # type: ignore[attr-defined]  # as above
        yield from leaves(f"{path}.{name}".lstrip("."), value)


def most_beside(model: Model, bytes_a_block: int) -> int:
    """How many instances of a scene make a block of about so many bytes."""
    own: int = sum(value.nbytes for path, value in leaves("", model.world) if path in PARTICLES | VALUES and value is not None)
    return min(INSTANCES, max(1, bytes_a_block // max(own, 1)))
