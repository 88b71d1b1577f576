"""Runs of scenes held against what they expect of themselves."""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.run.simulate import COMPLETE, Summary, simulate
from verlet_numba.scene.installed import SWEEPS
from verlet_numba.scene.prepare import Prepared, prepare
from verlet_numba.scene.problems import SceneError
from verlet_numba.scene.schema import Expect
from verlet_numba.study import reader
from verlet_numba.study.measures import UNITS, measurable, measure, numbers, parted
from verlet_numba.study.reader import Array, Trajectory

IN_FULL = ("output.fields=[velocity]", "output.observables=true", "output.precision=float64", "output.precision_bits=24")
"""What a scene is judged by, whatever its own file would hold."""

SIGNS = {"max": "<=", "min": ">=", "equal": "="}
ROUNDING = 1e-9         # of a time: by so much a frame may miss `from` and `to`


class Verdict(NamedTuple):
    """One expectation, and what became of it."""

    expected: Expect
    held: bool
    figure: float | None        # the worst value in [from, to]; None where there is none
    time: float | None          # s, when it was that bad
    reason: str = ""            # why there is no figure

    @property
    def bound(self) -> str:
        """The bound as the scene states it, with its unit."""
        unit = f" {UNITS[parted(self.expected.measure)[0]]}".rstrip()
        stated = next(f"{sign} {bound:.6g}" for key, sign in SIGNS.items() if (bound := getattr(self.expected, key)) is not None)
        wide = f" ± {self.expected.tolerance:.6g}" if self.expected.tolerance else ""
        return f"{stated}{wide}{unit}"

    @property
    def subject(self) -> str:
        """What is measured, of what, and when."""
        expected = self.expected
        of = f" of {expected.body}" if expected.body else ""
        start = f" from {expected.start:g} s" if expected.start else ""
        end = f" to {expected.end:g} s" if expected.end is not None else ""
        return f"{expected.measure}{of}{start}{end}"

    def as_dict(self) -> dict[str, Any]:
        finite = self.figure is not None and np.isfinite(self.figure)
        return {**self.expected.model_dump(by_alias=True, exclude_none=True), "verdict": "held" if self.held else "failed",
                "figure": self.figure if finite else None, "time": self.time, "reason": self.reason}


@dataclass
class Case:
    """A scene that was run: its verdicts, and a divergence or signal that ended it before its time."""

    scene: str
    verdicts: list[Verdict] = field(default_factory=list)
    seconds: float = 0.0            # of simulation
    trouble: str = ""
    signal: int | None = None

    @property
    def held(self) -> bool:
        return not self.trouble and all(verdict.held for verdict in self.verdicts)

    def as_dict(self) -> dict[str, Any]:
        return {"scene": self.scene, "verdict": "held" if self.held else "failed", "seconds": self.seconds, "trouble": self.trouble,
                "expectations": [verdict.as_dict() for verdict in self.verdicts]}

    def lines(self) -> Iterator[str]:
        """Case, figures, bounds and verdicts as text."""
        yield f"{self.scene}: {'held' if self.held else 'FAILED'}"
        if self.trouble:
            yield f"  {self.trouble}"
        for verdict in self.verdicts:
            figure = "none" if verdict.figure is None else f"{verdict.figure:.6g}"
            when = verdict.reason if verdict.time is None else "" if verdict.held else f"at {verdict.time:.6g} s"
            told = "held  " if verdict.held else "FAILED"
            yield f"  {told}  {verdict.subject:<52}{figure:>14}  {verdict.bound:<26}{when}".rstrip()


def scenes_in(places: Sequence[Path]) -> list[Path]:
    """Scene files as named, and all those in folders, in alphabetical order; folders `sweeps` hold none."""
    found = [sorted(place.rglob("*.yaml")) if place.is_dir() else [place] for place in places]
    return [scene for scenes in found for scene in scenes if scene in places or scene.parent.name != SWEEPS]


def prepare_all(scenes: Sequence[Path]) -> list[Prepared]:
    """Scenes ready to be run and judged in full. Raises one SceneError with the problems of all of them."""
    found, problems = [], []
    for scene in scenes:
        try:
            found.append(prepare(scene, IN_FULL))
        except SceneError as error:
            problems += error.problems
    if problems:
        raise SceneError(problems)
    return found


def run_case(prepared: Prepared, quiet: bool = False) -> Case:
    """Run a scene in a folder of its own, which is gone afterwards, and judge it."""
    case = Case(str(prepared.loaded.source.name))
    with tempfile.TemporaryDirectory(prefix="verlet-numba-") as folder:
        output = Path(folder) / "trajectory.vtkhdf"
        summary = simulate(prepared, output, command="verify", quiet=quiet)
        case.seconds, case.signal = summary.seconds.get("simulate", 0.0), summary.signal
        case.trouble = trouble_of(summary)
        if summary.frames:
            with reader.open(output) as trajectory:
                case.verdicts = judge(trajectory, prepared.scene.expect)
    return case


def trouble_of(summary: Summary) -> str:
    """Why a run did not come to its end; empty if it did."""
    if summary.divergence is not None:
        return str(summary.divergence)
    return "" if summary.status == COMPLETE else f"{summary.status} after {summary.simulated_seconds:g} s"


def judge(trajectory: Trajectory, expectations: Sequence[Expect]) -> list[Verdict]:
    """Every expectation against the frames of a trajectory; each body is read once. What cannot be measured does not hold."""
    named = {expected.body: [parted(other.measure)[0] for other in expectations if other.body == expected.body]
             for expected in expectations}
    found = {body: measure(trajectory, measurable(trajectory, dict.fromkeys(names), body), body) for body, names in named.items()}
    verdicts = []
    for expected in expectations:
        name, component = parted(expected.measure)
        if name in found[expected.body]:
            verdicts.append(hold(expected, trajectory.time, numbers(found[expected.body][name], component)))
        else:
            verdicts.append(Verdict(expected, False, None, None, "cannot be measured here"))
    return verdicts


def hold(expected: Expect, time: Array, values: Array) -> Verdict:
    """The frame of [from, to] that comes nearest to breaking an expectation, or breaks it most; values (T,) or (1,)."""
    slack = ROUNDING * np.maximum(1.0, np.abs(time))
    within = np.flatnonzero((time >= expected.start - slack) & (time <= (np.inf if expected.end is None else expected.end) + slack))
    if not len(within):
        return Verdict(expected, False, None, None, "no frame in this time")
    values = np.broadcast_to(values, time.shape)[within]
    excess = excess_of(expected, values)
    worst = int(np.argmax(np.where(np.isnan(excess), np.inf, excess)))
    return Verdict(expected, bool(excess[worst] <= expected.tolerance), float(values[worst]), float(time[within[worst]]))


def excess_of(expected: Expect, values: Array) -> Array:
    """By how much values are beyond a bound, negative within it."""
    if expected.max is not None:
        return np.asarray(values - expected.max)
    if expected.min is not None:
        return np.asarray(expected.min - values)
    return np.abs(values - expected.equal)
