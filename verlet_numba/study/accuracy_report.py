"""A study of accuracy as a table on the terminal, CSV, JSON and a picture."""

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from verlet_numba.study.accuracy import HOLLOW, Point, Study, words

REAL_TIME = 1.0         # s a simulated second
MEANINGS = {"constraint_error_rms": "strain, rms over sticks and time", "penetration_max": "deepest penetration [m]"}


def table(study: Study) -> Iterator[str]:
    """Settings from the cheapest to the dearest, then effects; lines of text."""
    yield from preface(study)
    error = "error" if study.closed_form else "error [m]"
    yield f"{'':2}{'s/s':>10} {'±':>9} {error:>11}  {'strain rms':>10} {'deepest [m]':>11}  setting"
    for point in sorted(study.points, key=lambda point: point.cost):
        mark = ("*" if point.front else "") + ("?" if point.hollow else "")
        yield f"{mark:2}{row(point)}  {words(point.settings)}"
    yield f"* on the Pareto front  ? within {HOLLOW:g} error bars of the reference  s/s: processor seconds a simulated second"
    if study.effects:
        yield "without an effect (change: distance of the particles from the scene as it is):"
        for name, point in study.effects.items():
            saved = 1.0 - point.cost / study.own.cost if study.own.cost else 0.0
            yield f"  {name:<20} saves {saved:+7.1%} of the time, changes {point.error:.3g} m"
    if study.phases:
        total = sum(study.phases.values())
        yield f"time by phase, in all {total:.3g} s of a run of {study.whole:.3g} s:"
        for name, seconds in sorted(study.phases.items(), key=lambda phase: -phase[1]):
            yield f"  {name:<24}{seconds / total:6.1%}  {seconds:.3g} s"
    yield from (f"left out, {'; '.join(names)}: {reason}" for reason, names in study.refused.items())
    if study.unfinished:
        yield f"no time was left for {study.unfinished} settings: give more with --budget"


def preface(study: Study) -> Iterator[str]:
    """What the errors are held against."""
    if study.closed_form is not None:
        yield f"{study.name}: {study.closed_form.measure} at the end is {study.closed_form.value:g} ({study.closed_form.source})"
    elif study.reference is not None:
        yield (f"{study.name}: reference of {study.reference.substeps} substeps, order {study.reference.order:.2f}, "
               f"error bar {study.reference.bar:.2g} m")
    if np.isfinite(study.horizon):
        yield f"twin runs part after {study.horizon:.3g} s: positions are compared up to {study.until:.3g} s"


def row(point: Point) -> str:
    """Cost, its interval, error, strain and penetration of a setting."""
    if not point.sound:
        return f"{point.cost:10.4g} {'':>9} {'diverged':>11}  {'':>10} {'':>11}"
    found = point.statistics()
    spread = point.interval(point.seconds)
    return (f"{point.cost:10.4g} {spread if np.isfinite(spread) else 0:9.2g} {point.error:11.4g}  "
            f"{found['constraint_error_rms'][0]:10.3g} {found['penetration_max'][0]:11.3g}")


def as_dict(study: Study) -> dict[str, Any]:
    """Everything, as plain data; what is infinite or not a number is null."""
    reference = study.reference
    document = {
        "scene": study.name, "duration": study.duration, "horizon": study.horizon, "compared_until": study.until,
        "error_unit": study.unit, "error_bar": study.bar,
        "reference": None if reference is None else {"substeps": reference.substeps, "order": reference.order},
        "closed_form": None if study.closed_form is None else study.closed_form.model_dump(),
        "own": of_point(study.own), "points": [of_point(point) for point in study.points],
        "effects": {name: of_point(point) for name, point in study.effects.items()},
        "phases": study.phases, "phases_of_seconds": study.whole, "refused": study.refused, "unfinished": study.unfinished}
    plain: dict[str, Any] = finite(document)
    return plain


def of_point(point: Point) -> dict[str, Any]:
    return {"settings": point.settings, "sound": point.sound, "seconds_per_simulated_second": point.cost,
            "repeats": point.seconds, "compile_seconds": point.compile_seconds, "error": point.error, "hollow": point.hollow,
            "front": point.front,
            "measures": {name: {"mean": mean, "half_interval": half} for name, (mean, half) in point.statistics().items()}}


def finite(node: Any) -> Any:
    """The same without numbers that JSON has not."""
    if isinstance(node, dict):
        return {key: finite(value) for key, value in node.items()}
    if isinstance(node, list | tuple):
        return [finite(value) for value in node]
    return None if isinstance(node, float) and not np.isfinite(node) else node


def solver_yaml(point: Point, solver: dict[str, Any]) -> str:
    """A setting as YAML to paste into a scene: the scene's own keys of `solver`, and the point's over them."""
    chosen = {path.removeprefix("solver."): value for path, value in point.settings.items() if path.startswith("solver.")}
    return yaml.safe_dump({"solver": {**solver, **chosen}}, default_flow_style=None, sort_keys=False, width=120).rstrip()


def write(study: Study, folder: Path) -> None:
    """accuracy.csv, accuracy.json and accuracy.png in a folder, which is made. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "accuracy.json").write_text(json.dumps(as_dict(study), indent=2, allow_nan=False), encoding="utf-8")
    write_csv(study, folder / "accuracy.csv")
    draw(study, folder / "accuracy.png")


def write_csv(study: Study, path: Path) -> None:
    """A row a setting, then a row for each effect left out."""
    rows = [("setting", point) for point in study.points] + [(f"without {name}", point) for name, point in study.effects.items()]
    keys = sorted({key for _, point in rows for key in point.settings})
    measures = sorted({name for _, point in rows for name in point.statistics()})
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["what", *keys, "sound", "repeats", "seconds_per_simulated_second", "half_interval", "error", "hollow",
                         "front", "compile_seconds", *measures])
        for what, point in rows:
            found = point.statistics()
            writer.writerow([what, *(point.settings.get(key, "") for key in keys), point.sound, len(point.seconds), point.cost,
                             point.interval(point.seconds), point.error, point.hollow, point.front, point.compile_seconds,
                             *(found[name][0] if name in found else "" for name in measures)])


def draw(study: Study, path: Path) -> None:
    """Error against cost, what else a setting buys, residual against passes, and the price of each effect."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(16, 10), layout="constrained")
    FigureCanvasAgg(canvas)
    panels = canvas.subplot_mosaic([["work", "work", "strain"], ["passes", "effects", "phases"]], height_ratios=[3, 2])
    canvas.suptitle(f"{study.name}: what accuracy costs")
    draw_work(study, panels["work"])
    draw_strain(study, panels["strain"])
    draw_passes(study, panels["passes"])
    draw_effects(study, panels["effects"])
    draw_phases(study, panels["phases"])
    canvas.savefig(path, dpi=100)


def kind(point: Point) -> str:
    """What a setting is about besides its substeps."""
    return words({path: value for path, value in point.settings.items() if path != "solver.substeps"})


def families(study: Study) -> dict[str, list[Point]]:
    """Sound settings that differ in their substeps alone."""
    found: dict[str, list[Point]] = {}
    for point in study.points:
        if point.sound:
            found.setdefault(kind(point), []).append(point)
    return {name: sorted(points, key=lambda point: point.cost) for name, points in found.items()}


def draw_work(study: Study, axes: Any) -> None:
    """Error against seconds a simulated second; hollow where the reference is not known well enough; slopes 1 and 2."""
    told: list[tuple[str, tuple[float, float]]] = []
    for number, (name, points) in enumerate(families(study).items()):
        costs, errors = [point.cost for point in points], [max(point.error, 1e-16) for point in points]
        colour = f"C{number % 10}"
        axes.loglog(costs, errors, "-", color=colour, linewidth=0.8)
        axes.loglog([], [], "o-", color=colour, label=name)
        for point, cost, error in zip(points, costs, errors, strict=True):
            axes.loglog([cost], [error], "o", color=colour, fillstyle="none" if point.hollow else "full")
            told.append((str(point.settings.get("solver.substeps", "")), (cost, error)))
    front = sorted((point for point in study.points if point.front), key=lambda point: point.cost)
    axes.step([point.cost for point in front], [max(point.error, 1e-16) for point in front], where="post", color="black",
              linewidth=2.5, alpha=0.3, label="Pareto front")
    if front:
        guides(axes, front[0].cost, max(front[0].error, 1e-16), max(point.cost for point in study.points if point.sound))
    if study.bar:
        axes.axhline(study.bar, color="grey", linestyle=":", label="error bar of the reference")
    dearest = max((point.cost for point in study.points if point.sound), default=REAL_TIME)
    if dearest > 0.1 * REAL_TIME:                   # further away it would leave the rest no room
        axes.axvline(REAL_TIME, color="grey", linewidth=0.8, label="real time")
    axes.set(xlabel="processor seconds a simulated second", ylabel=f"error [{study.unit}]",
             title="error; numbers are substeps a frame" + ("" if dearest > 0.1 * REAL_TIME else ", all far below real time"))
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.grid(True, which="both", linewidth=0.2)
    annotate(axes, told)


def annotate(axes: Any, told: list[tuple[str, tuple[float, float]]]) -> None:
    """Words at places, but for those that would stand on another."""
    taken: list[Any] = []
    for word, place in told:
        spot = axes.transData.transform(place)
        if all(abs(spot[0] - other[0]) > 14 or abs(spot[1] - other[1]) > 9 for other in taken):       # pixels
            axes.annotate(word, place, fontsize=6, xytext=(3, 3), textcoords="offset points")
            taken.append(spot)


def guides(axes: Any, cost: float, error: float, dearest: float) -> None:
    """Lines of first and second order from a point on."""
    reach = np.array([cost, max(dearest, 2 * cost)])
    for order in (1, 2):
        axes.loglog(reach, error * (cost / reach) ** order, "k--", linewidth=0.5)
        axes.annotate(f"order {order}", (reach[-1], error * (cost / reach[-1]) ** order), fontsize=7)


def draw_strain(study: Study, axes: Any) -> None:
    """Strain and penetration against cost: what holds of the scene as a whole, past its horizon too."""
    drawn: dict[str, str] = {}
    for number, points in enumerate(families(study).values()):
        costs = [point.cost for point in points]
        for measure, style in (("constraint_error_rms", "o-"), ("penetration_max", "s:")):
            values = [point.statistics()[measure][0] for point in points]
            if max(values) > 0.0:
                axes.loglog(costs, values, style, color=f"C{number % 10}", markersize=4, linewidth=0.8)
                drawn[style] = measure
    for style, measure in drawn.items():
        axes.loglog([], [], f"k{style}", label=MEANINGS[measure])
    axes.set(xlabel="processor seconds a simulated second", title="constraints and contacts")
    if drawn:
        axes.legend(fontsize=7)
    axes.grid(True, which="both", linewidth=0.2)


def draw_passes(study: Study, axes: Any) -> None:
    """Residual against passes a substep, at equal substeps, for each order."""
    found: dict[tuple[Any, Any], list[tuple[int, float]]] = {}
    for point in study.points:
        settings: dict[str, Any] = {"solver.iterations": 1, "solver.order": "", "solver.substeps": ""} | point.settings
        if point.sound and not set(point.settings) - {"solver.iterations", "solver.order", "solver.substeps"}:
            place = settings["solver.order"], settings["solver.substeps"]
            found.setdefault(place, []).append((int(settings["solver.iterations"]), point.statistics()["constraint_error_rms"][0]))
    for (order, substeps), values in found.items():
        if len(values) > 1:
            axes.loglog(*zip(*sorted(values), strict=True), "o-", label=f"{order or 'order of the scene'}, {substeps} substeps")
    axes.set(xlabel="passes a substep", ylabel="strain, rms", title="residual against passes")
    if axes.lines:
        axes.legend(fontsize=7)
        passes = sorted({count for values in found.values() if len(values) > 1 for count, _ in values})
        axes.set_xticks(passes, [str(count) for count in passes])
        axes.set_xticks([], minor=True)
    axes.grid(True, which="both", linewidth=0.2)


def draw_effects(study: Study, axes: Any) -> None:
    """The part of the time that each effect takes."""
    names = list(study.effects)
    saved = [100 * (1 - point.cost / study.own.cost) for point in study.effects.values()]
    axes.barh(names, saved)
    for place, point in enumerate(study.effects.values()):
        axes.annotate(f" changes {point.error:.2g} m", (max(saved[place], 0), place), va="center", fontsize=8)
    low, high = min([0.0, *saved]), max([0.0, *saved])
    axes.set_xlim(low - 0.05 * (high - low), high + 0.5 * (high - low) + 1e-3)         # room for the words
    axes.axvline(0, color="grey", linewidth=0.8)
    axes.set(xlabel="saved by leaving it out [% of the time]", title="what each effect costs and changes")


def draw_phases(study: Study, axes: Any) -> None:
    """Where the time of a run under the scene's own settings goes."""
    phases = sorted(study.phases.items(), key=lambda phase: phase[1])
    axes.barh([name for name, _ in phases], [100 * seconds / sum(study.phases.values()) for _, seconds in phases])
    axes.set(xlabel="% of the time", title="time by phase")
