"""Measures of a run as single figures: a column a number, for tables of many runs.

`NAME` takes what is usually asked of a measure: the worst frame of errors, speeds and contacts, the sum of counts, the last
frame of all else. `NAME.last`, `NAME.least` and so on ask for one thing. Vectors have a column a component.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from verlet_numba.study.measures import UNITS, VECTORS, MeasureError, measurable, measure
from verlet_numba.study.reader import Array, Trajectory

HOW: dict[str, Callable[[Array], Any]] = {
    "first": lambda values: values[0], "last": lambda values: values[-1], "least": lambda values: values.min(axis=0),
    "most": lambda values: values.max(axis=0), "mean": lambda values: values.mean(axis=0),
    "total": lambda values: values.sum(axis=0)}
WORST = ("constraint_error_max", "constraint_error_rms", "penetration_max", "contacts", "speed_max", "orientation_flips",
         "self_intersections", "outside")
COUNTS = ("relaxations", "fallbacks")
USUAL = ("total_energy", "constraint_error_max", "penetration_max", "speed_max", "rest_time")
"""Columns of a sweep that names none."""


def wrong(name: str) -> str:
    """What is wrong with the name of a figure, NAME or NAME.HOW; empty if nothing is."""
    measure, dot, how = name.partition(".")
    if measure not in UNITS:
        return f"there is no measure {measure!r}"
    if dot and (how not in HOW or measure == "rest_time"):
        return f"{name}: a measure may be followed by .{', .'.join(HOW)}" + ("; rest_time is one value" if how in HOW else "")
    return ""


def columns(names: Sequence[str]) -> list[str]:
    """Names of the columns: of vectors NAME_x, NAME_y, NAME_z."""
    return [column for name in names for column in _columns(name)]


def _columns(name: str) -> list[str]:
    measure, dot, how = name.partition(".")
    return [f"{measure}_{axis}{dot}{how}" for axis in "xyz"] if measure in VECTORS else [name]


def unit(column: str) -> str:
    """The unit of a column; empty if it has none."""
    name = column.partition(".")[0]
    return UNITS.get(name) or UNITS.get(name[:-2], "")


def figures(trajectory: Trajectory, names: Sequence[str], body: str | None = None,
            recorded: bool = True) -> dict[str, float | None]:
    """Column -> figure over all committed frames; None for what is not finite (a run never at rest) or not in the file.

    `body`, `recorded`: as `measure` takes them. Raises MeasureError for a name that there is not.
    """
    for name in names:
        if reason := wrong(name):
            raise MeasureError(reason)
    series = list(dict.fromkeys(name.partition(".")[0] for name in names))
    found = measure(trajectory, measurable(trajectory, series, body, recorded), body, recorded) if trajectory.frames else {}
    return {column: value for name in names for column, value in _figure(name, found.get(name.partition(".")[0]))}


def _figure(name: str, values: Array | None) -> Iterator[tuple[str, float | None]]:
    measure, _, how = name.partition(".")
    if values is not None and values.ndim:
        values = np.asarray(HOW[how or usual(measure)](values))
    for k, column in enumerate(_columns(name)):
        value = np.nan if values is None else float(values.reshape(-1)[k])
        yield column, value if np.isfinite(value) else None


def usual(measure: str) -> str:
    """What is asked of a measure without a word."""
    return "most" if measure in WORST else "total" if measure in COUNTS else "last"
