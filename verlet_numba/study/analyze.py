"""Measures of trajectories as a table, JSON, CSV and a picture of their course."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verlet_numba.study import reader
from verlet_numba.study.measures import AXES, COLLIDERS, POSITIONS, UNITS, USUAL, VECTORS, MeasureError, measurable, measure, source
from verlet_numba.study.reader import Array, Trajectory, TrajectoryError

WIDTH = 12              # of a column of figures
__all__ = ["PICTURES", "Analysis", "MeasureError", "analyze", "plot", "table", "trajectories", "write_csv"]

LOGARITHMIC = ("constraint_error_max", "constraint_error_rms", "penetration_max", "speed_max")
PICTURES = (".png", ".svg", ".pdf")
STROKES: tuple[Any, ...] = ("-", "--", ":")     # of the axes
DECADES = 6                     # of a logarithmic axis, at most: errors of rounding alone are below
LISTED, LONGEST, WIDE = 12, 44, 150     # files in a legend, letters of a name and of the legend's lines, at most


class Analysis(NamedTuple):
    """The measures of one trajectory file, or of a body in it."""

    file: str
    status: str
    time: Array                     # (T,) s
    values: dict[str, Array]        # (T,), of vectors (T, 3); rest_time ()
    sources: dict[str, str]

    def columns(self) -> Iterator[tuple[str, str, Array]]:
        """Name, measure and values (T,) of every number: of vectors the components."""
        for name, values in self.values.items():
            if values.ndim == 2:
                yield from ((f"{name}_{axis}", name, values[:, k]) for k, axis in enumerate(AXES))
            else:
                yield name, name, np.broadcast_to(values, self.time.shape)

    def as_dict(self) -> dict[str, Any]:
        told = {name: {"unit": UNITS[name], "source": self.sources[name], **summary(values)}
                for name, values in self.values.items()}
        return {"file": self.file, "status": self.status, "frames": len(self.time),
                "first_time": number(self.time[:1]), "last_time": number(self.time[-1:]), "measures": told}


def summary(values: Array) -> dict[str, Any]:
    """First and last value, least, most and mean, of vectors by component; of one value a run that value."""
    if values.ndim == 0:
        return {"value": number(values)}
    if not len(values):
        return dict.fromkeys(("first", "last", "least", "most", "mean"))
    return {"first": number(values[0]), "last": number(values[-1]), "least": number(values.min(axis=0)),
            "most": number(values.max(axis=0)), "mean": number(values.mean(axis=0))}


def number(value: Any) -> Any:
    """A number, or a list of them, as JSON has them; None for what is not finite or not there."""
    array = np.asarray(value, float)
    if array.size == 1:
        return float(array.reshape(())) if np.isfinite(array).all() else None
    return [number(each) for each in array] or None


def analyze(path: Path, names: Sequence[str] = (), body: str | None = None, recorded: bool = True) -> Analysis:
    """The measures of a file: those named, or all the usual ones that it has.

    Raises MeasureError for a measure or body that it has not, TrajectoryError for a file that cannot be read.
    """
    with reader.open(path) as trajectory:
        try:
            wanted = list(names) or measurable(trajectory, USUAL, body, recorded)
            values = measure(trajectory, wanted, body, recorded)
        except (MeasureError, TrajectoryError):
            raise
        except (LookupError, AttributeError, TypeError, ValueError, ArithmeticError) as error:
            raise TrajectoryError(f"{path}: cannot be measured, its scene or its numbers are damaged ({error!r})") from error
        return Analysis(str(path), status_of(trajectory), trajectory.time, values,
                        {name: source(trajectory, name, body, recorded) for name in wanted})


def status_of(trajectory: Trajectory) -> str:
    return str(trajectory.provenance.get("status", "unknown")).rstrip("\0")


def trajectories(places: Sequence[Path]) -> list[Path]:
    """Files as named, and all trajectory files in folders, in alphabetical order. Raises TrajectoryError for a folder without."""
    found = []
    for place in places:
        files = sorted(place.rglob("*.vtkhdf")) if place.is_dir() else [place]
        if not files:
            raise TrajectoryError(f"{place}: there is no trajectory file in this folder")
        found += files
    return found


def table(analyses: Sequence[Analysis]) -> Iterator[str]:
    """Files side by side: last value, least and most of every number."""
    names = {column: measure for analysis in analyses for column, measure, _ in analysis.columns()}
    numbers = [{column: values for column, _, values in analysis.columns()} for analysis in analyses]
    wide = max(len(f"{name} [{UNITS[kind]}]") for name, kind in names.items()) if names else 0
    for place, analysis in enumerate(analyses, start=1):
        which = f"{place}: " if len(analyses) > 1 else ""
        end = f", {analysis.time[0]:.6g} to {analysis.time[-1]:.6g} s" if len(analysis.time) else ""
        status = "under way or killed" if analysis.status == "running" else analysis.status
        yield f"{which}{analysis.file}: {status}, {len(analysis.time)} frame{'' if len(analysis.time) == 1 else 's'}{end}"
    head = "".join(f"{text:>{WIDTH}}" for text in ("last", "least", "most"))
    yield " " * wide + "".join(f"{f'{place}:' if len(analyses) > 1 else '':>4}{head}" for place in range(1, len(analyses) + 1))
    for name, kind in names.items():
        label = f"{name} [{UNITS[kind]}]" if UNITS[kind] else name
        yield (f"{label:<{wide}}" + "".join(" " * 4 + cell(each.get(name), kind) for each in numbers)).rstrip()
    for where in (POSITIONS, COLLIDERS):
        if computed := [name for name, known in analyses[0].sources.items() if known == where]:
            yield f"from {where}: {', '.join(computed)}"


def cell(values: Array | None, kind: str) -> str:
    """Last, least and most of a column; one value if there is one a run; nothing where a file has no such measure."""
    if values is None or not len(values):
        return " " * (3 * WIDTH)
    if kind == "rest_time":
        told = f"{values[0]:.5g}" if np.isfinite(values[0]) else "never"
        return f"{told:>{WIDTH}}" + " " * (2 * WIDTH)
    return "".join(f"{value + 0.0:{WIDTH}.5g}" for value in (values[-1], values.min(), values.max()))     # -0 is 0


def write_csv(analyses: Sequence[Analysis], path: Path) -> None:
    """One row a frame of every file: file, frame, time, numbers; empty where there is none."""
    columns = list({column: None for analysis in analyses for column, _, _ in analysis.columns()})
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["file", "frame", "time", *columns])
        for analysis in analyses:
            found = {column: values for column, _, values in analysis.columns()}
            rows = [found.get(column) for column in columns]
            for frame, time in enumerate(analysis.time.tolist()):
                writer.writerow([analysis.file, frame, time, *(written(values, frame) for values in rows)])


def written(values: Array | None, frame: int) -> float | str:
    return "" if values is None or not np.isfinite(values[frame]) else float(values[frame])


def plot(analyses: Sequence[Analysis], path: Path) -> None:
    """The course of every measure that is not 0 throughout in a panel of its own, one colour a file; of vectors x full, y
    dashed, z dotted."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = list({name: None for analysis in analyses for name, values in analysis.values.items() if values.ndim and values.any()})
    columns = min(3, max(1, len(names)))
    rows = max(1, -(-len(names) // columns))
    figure = Figure(figsize=(4.2 * columns, 2.5 * rows + 1.0), layout="constrained")
    FigureCanvasAgg(figure)
    hues = colours(len(analyses))
    for place, name in enumerate(names):
        axes = figure.add_subplot(rows, columns, place + 1)
        course(axes, name, analyses, hues)
        if place >= len(names) - columns:
            axes.set_xlabel("time [s]", fontsize=8)
    if names:
        legend(figure, short_names([analysis.file for analysis in analyses]), hues, vectors=any(name in VECTORS for name in names))
    figure.savefig(path, dpi=110)


def course(axes: Any, name: str, analyses: Sequence[Analysis], hues: list[Any]) -> None:
    """One measure of all files. Where small values matter it is drawn by its logarithm, what is rounding alone at the floor."""
    found = [(analysis.time, analysis.values[name], hue) for analysis, hue in zip(analyses, hues, strict=True)
             if name in analysis.values]
    floor = log_floor([values for _, values, _ in found]) if name in LOGARITHMIC else 0.0
    for time, values, hue in found:
        for k, curve in enumerate(values.reshape(len(time), -1).T):
            axes.plot(time, np.maximum(curve, floor) if floor else curve, STROKES[k], color=hue, linewidth=1.2)
    if floor:
        axes.set_yscale("log")
        axes.set_ylim(bottom=floor)
    axes.set_title(name.replace("_", " ") + (f"  [{UNITS[name]}]" if UNITS[name] else ""), fontsize=9)
    axes.tick_params(which="both", labelsize=7)
    axes.yaxis.get_offset_text().set_fontsize(7)
    axes.grid(alpha=0.3)
    axes.margins(x=0)


def log_floor(courses: Sequence[Array]) -> float:
    """Where a logarithmic axis ends: the least that is not 0, but no less than DECADES below the largest; 0 where an axis without
    logarithm shows as much, all being within a decade."""
    numbers = np.concatenate([values[np.isfinite(values) & (values > 0)] for values in courses])
    if not numbers.size:
        return 0.0
    floor = max(float(numbers.min()), float(numbers.max()) * 10.0**-DECADES)
    return floor if numbers.max() > 10 * floor else 0.0


def legend(figure: Any, names: list[str], hues: list[Any], vectors: bool) -> None:
    """Colours of files above all panels, and below which stroke is which axis."""
    from matplotlib.lines import Line2D

    told = [(Line2D([], [], color=hue), name) for name, hue in zip(names[:LISTED], hues, strict=False)]
    if len(names) > LISTED:
        told.append((Line2D([], [], alpha=0), f"and {len(names) - LISTED} more"))
    wide = max(len(name) for _, name in told) + 8       # letters, with the stroke before the name
    figure.legend(*zip(*told, strict=True), loc="outside upper center", fontsize=8, ncols=max(1, min(len(told), WIDE // wide)))
    if vectors:
        strokes = [Line2D([], [], color="grey", linestyle=stroke) for stroke in STROKES]
        figure.legend(strokes, [f"{axis} of a vector" for axis in AXES], loc="outside lower center", fontsize=8, ncols=len(AXES))


def colours(count: int) -> list[Any]:
    """As many colours that differ: the usual ten, or of more a scale."""
    from matplotlib import colormaps

    return [f"C{k}" for k in range(count)] if count <= 10 else list(colormaps["viridis"](np.linspace(0, 0.95, count)))


def short_names(files: Sequence[str]) -> list[str]:
    """The shortest ends of paths that tell files apart, without suffix; what is still long is cut in its middle."""
    paths = [Path(file).with_suffix("").parts for file in files]
    found = []
    for own in paths:
        length = next((k for k in range(1, len(own)) if sum(other[-k:] == own[-k:] for other in paths) == 1), len(own))
        name = "/".join(own[-length:])
        found.append(name if len(name) <= LONGEST else f"{name[:LONGEST // 2 - 1]}…{name[-LONGEST // 2:]}")
    return found
