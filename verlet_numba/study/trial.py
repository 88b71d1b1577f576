"""A scene run in memory under other settings: what it gives, and what it costs."""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from verlet_numba.buffers.arrays import Array
from verlet_numba.frame import OK
from verlet_numba.run.contents import observables
from verlet_numba.run.engine import run_chunk, start, warm
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.load import Loaded, loads
from verlet_numba.scene.place import place
from verlet_numba.scene.plan import bodies_meet, frame_count
from verlet_numba.scene.schema import Reference
from verlet_numba.study.measures import numbers, parted, rest_time
from verlet_numba.study.phases import phase_seconds

SAMPLES = 64                    # frames of a run that are kept, at most
IN_FULL = {"output.precision": "float64", "output.fields": [], "output.observables": True, "expect": []}
Settings = Mapping[str, Any]    # overrides by their dotted path


@dataclass(frozen=True)
class Outcome:
    """One run. Frames are samples of those of the scene, the first and the last among them."""

    sound: bool                             # False: it diverged
    seconds: float                          # of the processor, for the whole run
    time: NDArray[np.float64]               # (T,) s
    position: NDArray[np.float64]           # (T, N, 3) m, in the order of the scene
    measures: dict[str, float]              # over all frames, as `summarised`
    final: dict[str, float]                 # what `reference` may name, in the last frame


def under(loaded: Loaded, settings: Settings, sets: Sequence[str]) -> Loaded:
    """The scene under these settings. Raises SceneError for what the scene or the program does not allow."""
    overrides = [f"{path}={json.dumps(value, ensure_ascii=False)}" for path, value in {**settings, **IN_FULL}.items()]
    return loads(loaded.source.text, loaded.source.name, [*sets, *overrides])


class Trial:
    """A scene with overrides, compiled; it can be run again and again."""

    def __init__(self, loaded: Loaded, settings: Settings, sets: Sequence[str] = ()) -> None:
        """Lays `sets`, the user's overrides, and then the settings over the scene's text, and compiles it (compile_seconds).

        Raises SceneError for settings that the scene or the program does not allow.
        """
        self.settings = dict(settings)
        self.loaded = under(loaded, settings, sets)
        self.scene = self.loaded.scene
        self.bodies = place(self.scene, self.loaded.folder, self.loaded.source)
        model, clock = self._started(), time.perf_counter()
        effects = model.world.effects
        self.touches = bodies_meet(model.world) or effects.contact is not None      # something may touch something
        warm(model)
        self.compile_seconds = time.perf_counter() - clock

    def _started(self) -> Model:
        return start(build(self.scene, self.bodies, self.loaded.folder))

    def run(self, shift: float = 0.0, seed: int = 0) -> Outcome:
        """Simulate the scene; every free particle starts off its place by up to `shift` [m], at random from the seed."""
        model = self._started()
        displace(model, shift, seed)
        count = frame_count(self.scene)
        chunk = frames(model, count)
        clock = time.thread_time()
        status = run_chunk(model, chunk)
        seconds = time.thread_time() - clock
        if status != OK:
            return Outcome(False, seconds, np.zeros(0), np.zeros((0, model.particles, 3)), {}, {})
        chosen = np.unique(np.linspace(0, count - 1, min(SAMPLES, count)).round().astype(int))
        time_of = np.arange(count) / self.scene.time.frame_rate
        series = observables(chunk.measures)
        series["rest_time"] = np.full(1, rest_time(time_of, series["speed_max"]))
        return Outcome(True, seconds, time_of[chosen], chunk.position[chosen], summarised(series), at_end(series))

    def phases(self, seconds: float) -> tuple[dict[str, float], float]:
        """Seconds of each phase of a run, and of the whole run, which takes about so many seconds."""
        return phase_seconds(self._started(), frame_count(self.scene), seconds)


def displace(model: Model, shift: float, seed: int) -> None:
    """Move every free particle, its speed kept."""
    particles = model.world.particles
    offset = np.random.default_rng(seed).uniform(-shift, shift, particles.position.shape) * (particles.inverse_mass > 0)
    for points in (particles.position, particles.previous):
        points += offset.astype(points.dtype)


def at_end(series: Mapping[str, Array]) -> dict[str, float]:
    """The last number of everything that a `reference` may name."""
    names = {name: parted(name) for name in get_args(Reference.model_fields["measure"].annotation)}
    return {name: float(numbers(series[whole], component)[-1]) for name, (whole, component) in names.items()}


def summarised(series: Mapping[str, Array]) -> dict[str, float]:
    """One number a measure: what does not depend on where each particle of a chaotic run ends up."""
    energy, momentum = series["total_energy"], series["momentum"]
    centre = series["centre_of_mass"][-1]
    return {"energy_drift": float(energy[-1] - energy[0]),
            "energy_gain": float((energy - np.minimum.accumulate(energy)).max()),
            "momentum_change": float(np.linalg.norm(momentum - momentum[0], axis=1).max()),
            "constraint_error_max": float(series["constraint_error_max"].max()),
            "constraint_error_rms": float(np.sqrt(np.mean(series["constraint_error_rms"] ** 2))),
            "penetration_max": float(series["penetration_max"].max()),
            "rest_time": float(series["rest_time"][0]),
            "relaxations": float(series["relaxations"].sum()),
            **{f"centre_of_mass_{axis}": float(value) for axis, value in zip("xyz", centre, strict=True)}}
