"""What a run was like: counted while it goes, kept in its checkpoints, told at its end."""

from dataclasses import asdict, dataclass, field
from typing import Any, Self

from verlet_numba.buffers.arrays import Array
from verlet_numba.buffers.world import CONTACTS, ERROR_MAX, PENETRATION, RELAXATIONS
from verlet_numba.run.postmortem import Divergence
from verlet_numba.scene.schema import Scene

TORN = 1.0                  # constraint error beyond which nothing is left of a body
COMPLETE, STOPPED, BROKEN = "complete", "stopped", "diverged"


@dataclass
class Summary:
    """What a run was like. Extremes are over the frames of the file, times over all processes that took part."""

    output: str
    frames: int = 0
    substeps: int = 0
    simulated_seconds: float = 0.0
    status: str = COMPLETE
    relaxations: int = 0
    contacts: int = 0                       # most of any frame
    constraint_error_max: float = 0.0
    constraint_error_end: float = 0.0       # of the last frame
    penetration_max: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)      # wall time by phase
    chunks: list[tuple[int, float, float]] = field(default_factory=list)    # frames, seconds simulated, seconds handed over
    divergence: Divergence | None = None
    signal: int | None = None
    resumed_at: int | None = None           # the first frame of this process, if it is not the first process

    @property
    def steps_per_second(self) -> float:
        return self.substeps / self.seconds["simulate"] if self.seconds.get("simulate") else 0.0

    @property
    def real_time_factor(self) -> float:
        return self.simulated_seconds / self.seconds["simulate"] if self.seconds.get("simulate") else 0.0

    @property
    def torn(self) -> bool:
        """Whether the run, finite though it is, has come apart: some stick ends at more than twice its length."""
        return self.constraint_error_end > TORN

    def spend(self, phase: str, seconds: float) -> None:
        self.seconds[phase] = self.seconds.get(phase, 0.0) + seconds

    def count(self, scene: Scene, measures: Array) -> None:
        """Take (k, COLUMNS) measures of the next k > 0 frames in."""
        self.frames += len(measures)
        self.substeps = (self.frames - 1) * scene.solver.substeps
        self.simulated_seconds = (self.frames - 1) / scene.time.frame_rate
        self.relaxations += int(measures[:, RELAXATIONS].sum())
        self.contacts = max(self.contacts, int(measures[:, CONTACTS].max()))
        self.constraint_error_max = max(self.constraint_error_max, float(measures[:, ERROR_MAX].max()))
        self.constraint_error_end = float(measures[-1, ERROR_MAX])
        self.penetration_max = max(self.penetration_max, float(measures[:, PENETRATION].max()))

    def timing(self) -> dict[str, Any]:
        """Wall seconds by phase and by chunk."""
        frames, simulate, write = zip(*self.chunks, strict=True) if self.chunks else ((), (), ())
        return {"phases": self.seconds, "chunks": {"frames": frames, "simulate": simulate, "write": write}}

    def as_dict(self) -> dict[str, Any]:
        """For JSON: all but the chunks, and the two rates."""
        told = asdict(self)
        del told["chunks"]
        return told | {"torn": self.torn, "steps_per_second": self.steps_per_second, "real_time_factor": self.real_time_factor}

    def so_far(self) -> dict[str, Any]:
        """What a later process needs to go on counting."""
        return {name: value for name, value in asdict(self).items() if name not in OF_A_PROCESS}

    @classmethod
    def going_on(cls, output: str, before: dict[str, Any]) -> Self:
        """The summary of a run that goes on from what `so_far` told."""
        return cls(output, **{**before, "chunks": [tuple(chunk) for chunk in before["chunks"]]}, resumed_at=before["frames"])


OF_A_PROCESS = ("output", "status", "divergence", "signal", "resumed_at")
