"""What accuracy costs in time: a scene under many settings, each held against what is true of it.

A closed form that the scene names is the truth; else a run with a much shorter step is, with an error bar of its own. A
chaotic scene can be predicted up to its horizon only, found from twin runs: positions are compared up to half of it. What
a setting does to the scene as a whole (energy, momentum, constraints, penetration) is told for any length, as mean and
interval over its repeats, which start a hair apart.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from verlet_numba.scene.load import Loaded
from verlet_numba.scene.problems import SceneError
from verlet_numba.scene.schema import Scene
from verlet_numba.study import axes
from verlet_numba.study.convergence import TWINS, Reference, distance, extent, horizon, richardson
from verlet_numba.study.trial import Outcome, Trial, under

REPEATS, MOST_REPEATS = 3, 15
LONG = 0.3                  # s: as many repeats as make this long in all
FINER = 4                   # times the substeps of the finest setting: the reference, at most
REFERENCE_SHARE = 0.4       # of the budget; what is left of it after the settings are run once:
EFFECTS_SHARE = 0.15        # of the budget, for leaving out effects
HOLLOW = 10.0               # times the error bar of the reference: an error below it is not known
NORMAL = 1.96               # standard deviations of a 95 % interval
EFFECTS = {"contact": "none", "drag": None, "damping": None, "wind": None, "friction": None, "restitution": None,
           "self_collision": False, "bending": None, "rest": None, "continuous_collision": False, "gravity": None}
"""Effects, and what stands for their absence."""
REFERENCE = {"solver.tolerance": 0.0, "solver.square_root": "exact", "solver.precision": "float64", "solver.iterations": 1}


@dataclass
class Point:
    """A setting and what came of it. seconds: of the processor, a simulated second."""

    settings: dict[str, Any]
    compile_seconds: float = 0.0
    outcomes: list[Outcome] = field(default_factory=list)
    error: float = float("inf")         # m, or the measure's unit: against the reference
    hollow: bool = False                # the reference is not known well enough to tell
    front: bool = False                 # nothing is both cheaper and better
    seconds: list[float] = field(default_factory=list)

    @property
    def sound(self) -> bool:
        return bool(self.outcomes) and all(outcome.sound for outcome in self.outcomes)

    @property
    def cost(self) -> float:
        return float(np.median(self.seconds)) if self.seconds else float("inf")

    def interval(self, values: Sequence[float]) -> float:
        """Half the width of the 95 % interval of the mean."""
        known = len(values) > 1 and np.isfinite(values).all()
        return NORMAL * float(np.std(values, ddof=1)) / len(values) ** 0.5 if known else float("nan")

    def statistics(self) -> dict[str, tuple[float, float]]:
        """Mean and half the interval of every measure over the repeats."""
        names = self.outcomes[0].measures if self.sound else {}
        series = {name: [outcome.measures[name] for outcome in self.outcomes] for name in names}
        return {name: (float(np.mean(values)), self.interval(values)) for name, values in series.items()}


@dataclass
class Study:
    """Everything that was found out about a scene."""

    name: str
    duration: float                             # s
    own: Point                                  # the scene's own settings
    points: list[Point]
    horizon: float                              # s
    until: float                                # s: positions are compared up to here
    reference: Reference | None
    closed_form: Any | None                     # scene.reference
    effects: dict[str, Point]                   # the scene's own settings without each effect
    refused: dict[str, list[str]]               # settings that the scene or the program does not allow, by the reason
    unfinished: int = 0                         # settings for which there was no time
    phases: dict[str, float] = field(default_factory=dict)     # s of a run under the scene's own settings, by phase
    whole: float = 0.0                          # s of that run

    @property
    def unit(self) -> str:
        return f"{self.closed_form.measure} at the end" if self.closed_form else "m"

    @property
    def bar(self) -> float:
        """Error bar of the reference; 0 for a closed form."""
        return self.reference.bar if self.reference else 0.0

    def cheapest(self, target: float) -> Point | None:
        """The cheapest setting whose error is known to be at most `target`."""
        good = [point for point in self.points if point.sound and point.error + self.bar <= target]
        return min(good, key=lambda point: point.cost, default=None)


class Budget:
    """Processor seconds that may be spent on running, so that a busy machine compares as much; compiling does not count."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.spent = seconds, 0.0

    def left(self) -> float:
        return self.seconds - self.spent

    def run(self, trial: Trial, shift: float = 0.0, seed: int = 0) -> Outcome:
        outcome = trial.run(shift, seed)
        self.spent += outcome.seconds
        return outcome


def study(loaded: Loaded, sets: Sequence[str], chosen: axes.Axes, most: int, seconds: float,
          say: Callable[[str], object]) -> Study:
    """Compare settings of a scene. chosen {}: a star about its own; most: settings; seconds: budget of running time.

    Raises SceneError if the scene's own settings cannot run, AxisError for axes that make too many.
    """
    budget = Budget(seconds)
    scene = under(loaded, {}, sets).scene
    settings = axes.grid(chosen, most) if chosen else axes.star(scene, most)
    check(loaded, sets, settings, scene)
    own, trial = Point({}), Trial(loaded, {}, sets)
    say(f"the scene's own settings: {scene.solver.substeps} substeps x {scene.solver.iterations}")
    measure(own, trial, budget, 0, 0.0)
    if not own.sound:
        raise ArithmeticError("the scene diverges under its own settings: nothing to compare with")
    base = own.outcomes[0]
    twin = budget.run(trial, TWINS * extent(base), 1)
    far = horizon(base, twin) if twin.sound else 0.0
    until = min(scene.time.duration, 0.5 * far)
    found = Study(scene.name, scene.time.duration, own, [], far, until, None, scene.reference, {}, {})
    if found.closed_form is None:
        finest = max((each.get("solver.substeps", scene.solver.substeps) for each in settings), default=1)
        dear = own.cost * scene.time.duration / scene.solver.substeps
        found.reference = converged(loaded, sets, finest, dear, until, budget, say)
    kept = EFFECTS_SHARE * budget.seconds
    trials = explore(found, loaded, sets, settings, budget, kept, say)
    leave_out(found, loaded, sets, trial, budget, say)
    found.phases, found.whole = trial.phases(base.seconds)
    repeat(found, trials, budget)
    mark_front(found.points)
    return found


def check(loaded: Loaded, sets: Sequence[str], settings: list[dict[str, Any]], scene: Scene) -> None:
    """Raises AxisError for a setting that cannot be compared with the scene, SceneError, that of the last, if none is allowed."""
    refused = []
    for each in settings:
        try:
            other = under(loaded, each, sets).scene
        except SceneError as error:
            refused.append(error)
        else:
            if not axes.same_particles(scene, other):
                raise axes.AxisError(f"{words(each)}: has other particles or frames than the scene, which cannot be compared one "
                                     "by one; vary what leaves `time` and the number of particles as they are")
    if refused and len(refused) == len(settings):
        raise refused[-1]


def measure(point: Point, trial: Trial, budget: Budget, seed: int, shift: float) -> None:
    """One more repeat of a setting."""
    outcome = budget.run(trial, shift if seed else 0.0, seed)
    point.compile_seconds = max(point.compile_seconds, trial.compile_seconds)
    point.outcomes.append(outcome)
    point.seconds.append(outcome.seconds / max(trial.scene.time.duration, 1e-12))


def converged(loaded: Loaded, sets: Sequence[str], finest: int, seconds_a_substep: float, until: float, budget: Budget,
              say: Callable[[str], object]) -> Reference:
    """The reference: as many substeps as its share of the budget pays for, and its half and quarter."""
    affordable = REFERENCE_SHARE * budget.left() / max(seconds_a_substep, 1e-9) / 1.75
    substeps = -(-int(max(finest, min(FINER * finest, affordable))) // 4) * 4
    say(f"the reference: {substeps} substeps, and half and a quarter of them")
    settings = ({**REFERENCE, "solver.substeps": substeps // part} for part in (4, 2, 1))
    coarse, middle, fine = (budget.run(Trial(loaded, each, sets)) for each in settings)
    if not (coarse.sound and middle.sound and fine.sound):
        raise ArithmeticError(f"a reference of {substeps} substeps, or its half or quarter, diverges: nothing to compare with")
    return richardson(coarse, middle, fine, substeps, until)


def explore(found: Study, loaded: Loaded, sets: Sequence[str], settings: list[dict[str, Any]], budget: Budget, kept: float,
            say: Callable[[str], object]) -> list[Trial]:
    """Run every setting once, the cheap ones first, while more than `kept` seconds are left; the trials of the points."""
    trials: list[Trial] = []
    for each in sorted(settings, key=work):
        if budget.left() <= kept:
            found.unfinished += 1
            continue
        try:
            trial = Trial(loaded, each, sets)
        except SceneError as error:
            found.refused.setdefault(error.problems[0].message, []).append(words(each))
            continue
        point = Point(each)
        measure(point, trial, budget, 0, 0.0)
        judge(found, point)
        found.points.append(point)
        trials.append(trial)
        say(f"{words(each)}: error {point.error:.3g}, {point.cost:.3g} s a second")
    return trials


def repeat(found: Study, trials: list[Trial], budget: Budget) -> None:
    """Run settings again in random order while time lasts, each time from a hair beside the scene's start."""
    rng, scale = np.random.default_rng(0), TWINS * extent(found.own.outcomes[0])
    for seed in range(1, MOST_REPEATS):
        for i in rng.permutation(len(trials)):
            if budget.left() > 0.0 and seed < repeats(found.points[i]):
                measure(found.points[i], trials[i], budget, seed, scale)


def repeats(point: Point) -> int:
    """Of a setting: more of short runs, whose times are less certain."""
    return int(np.clip(LONG / point.outcomes[0].seconds, REPEATS, MOST_REPEATS)) if point.sound else 1


def work(settings: dict[str, Any]) -> float:
    """Passes a frame that a setting names."""
    return float(settings.get("solver.substeps", 1)) * float(settings.get("solver.iterations", 1))


def judge(found: Study, point: Point) -> None:
    """The error of a setting, and whether it can be told from that of the reference."""
    outcome = point.outcomes[0]
    if not outcome.sound:
        return
    if found.closed_form is not None:
        point.error = abs(outcome.final[found.closed_form.measure] - found.closed_form.value)
    elif found.reference is not None:
        point.error = distance(outcome, found.reference.outcome, found.until)
        point.hollow = point.error < HOLLOW * found.reference.bar


def mark_front(points: list[Point]) -> None:
    """The Pareto front: settings than which none is both cheaper and better."""
    best = float("inf")
    for point in sorted((point for point in points if point.sound), key=lambda point: (point.cost, point.error)):
        point.front = point.error < best
        best = min(best, point.error)


def leave_out(found: Study, loaded: Loaded, sets: Sequence[str], own: Trial, budget: Budget, say: Callable[[str], object]) -> None:
    """What each effect of the scene costs and changes: the scene's own settings without it, the two timed in turn."""
    for name, absent in EFFECTS.items():
        idle = name == "contact" and not own.touches
        if getattr(own.scene.effects, name) in (absent, None, False) or idle or budget.left() <= 0.0:
            continue
        try:
            trial = Trial(loaded, {f"effects.{name}": absent}, sets)
        except SceneError as error:
            found.refused.setdefault(error.problems[0].message, []).append(f"without {name}")
            continue
        point = found.effects[name] = Point({f"effects.{name}": absent})
        for seed in range(repeats(found.own)):
            if seed == 0 or budget.left() > 0.0:
                measure(point, trial, budget, seed, 0.0)
                measure(found.own, own, budget, seed, 0.0)
        point.error = distance(point.outcomes[0], found.own.outcomes[0])
        say(f"without {name}: {point.cost:.3g} s a second")


def words(settings: dict[str, Any]) -> str:
    """A setting in a few words; the path's last word names it."""
    return ", ".join(f"{path.rpartition('.')[2]} {value}" for path, value in settings.items()) or "as the scene"
