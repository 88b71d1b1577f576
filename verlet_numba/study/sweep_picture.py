"""A sweep as a picture: what each parameter does to each measure, and the measures against each other."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verlet_numba.study import figures
from verlet_numba.study.sweep_folder import Table, cell, short

PICTURES = (".png", ".svg", ".pdf")
MOST = 8                # parameters, and measures, that are drawn
BINS = 8                # of a parameter that has many values
Numbers = NDArray[np.float64]


class Axis:
    """A parameter along an axis: its numbers, or the places of its words and lists."""

    def __init__(self, name: str, values: Sequence[Any]) -> None:
        self.name = name
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
        others = {} if numbers else {str(cell(value)): short(value) for value in values}
        self.words = [others[word] for word in sorted(others)]
        self.at: Numbers = np.array(values if numbers else [sorted(others).index(str(cell(value))) for value in values], float)
        levels = np.unique(self.at)
        self.few = len(levels) <= BINS
        positive = bool(len(levels)) and levels[0] > 0
        self.logarithmic = not self.words and positive and skewed(levels)

    def bins(self) -> list[NDArray[np.bool_]]:
        """Runs of equal value, or parts of about as many runs each."""
        if self.few:
            return [self.at == level for level in np.unique(self.at)]
        order = np.argsort(self.at, kind="stable")
        masks = []
        for part in np.array_split(order, BINS):
            mask = np.zeros(len(self.at), bool)
            mask[part] = True
            masks.append(mask)
        return masks


def skewed(levels: Numbers) -> bool:
    """Whether positive values span more than a decade and lie more evenly as ratios than as differences."""
    middle = float(np.median(levels))
    half, ratio = (levels[0] + levels[-1]) / 2, float(np.sqrt(levels[0] * levels[-1]))
    return bool(levels[-1] > 10 * levels[0] and abs(middle - ratio) / ratio < abs(middle - half) / ratio)


def draw(known: Table, path: Path) -> None:
    """Left: a row a measure and a column a parameter, every run a dot, the mean over the others a line (the main effect); the share
    of the measure's variance that the parameter explains stands in the corner. Right: the measures in pairs, coloured by the
    parameter that explains most. Measures that are the same in all runs are left out. Raises OSError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    parameters = [Axis(name, [row.values[k] for row in known.rows]) for k, name in enumerate(known.parameters)][:MOST]
    measures = varying(known)
    rows, columns, pairs = max(1, len(measures)), max(1, len(parameters)), max(0, len(measures) - 1)
    left, right = 2.6 * columns + 0.6, max(3.4, 2.1 * pairs + 1.2) if pairs else 0.0
    figure = Figure(figsize=(max(5.0, left + right), 2.0 * rows + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    told = f"{len(known.rows)} runs" + (f", {len(known.failed())} of them failed" if known.failed() else "")
    figure.suptitle(f"{known.folder.name}: {told}", fontsize=11)
    parts = figure.subfigures(1, 2 if pairs else 1, width_ratios=[left, right] if pairs else None, squeeze=False)[0]
    if not measures:
        parts[0].text(0.5, 0.5, "no measure differs between runs", ha="center")
    else:
        shares = np.array([[explained(axis, values) for axis in parameters] for values in measures.values()])
        draw_effects(parts[0], parameters, measures, shares)
        if pairs:
            draw_pairs(parts[1], parameters[int(np.argmax(np.nansum(shares, axis=0)))], measures)
    figure.savefig(path, dpi=120)


def varying(known: Table) -> dict[str, Numbers]:
    """Measures that differ between runs, by name, NaN where a run has none."""
    found = {}
    for name in known.columns:
        values = np.array([np.nan if (value := row.result.measures.get(name)) is None else value for row in known.rows], float)
        there = values[np.isfinite(values)]
        if len(there) > 1 and np.ptp(there) > 1e-12 * np.abs(there).max():
            found[name] = values
    return dict(list(found.items())[:MOST])


def explained(axis: Axis, values: Numbers) -> float:
    """The share of a measure's variance that the means over a parameter's bins have: 1 if it depends on nothing else.

    What chance alone would explain is taken off (adjusted R squared of the analysis of variance). NaN where it cannot be told:
    with a single run in each bin, or values that are all the same.
    """
    there = np.isfinite(values)
    bins = [values[mask & there] for mask in axis.bins()]
    bins = [part for part in bins if len(part)]
    count, total = there.sum(), float(((values[there] - values[there].mean()) ** 2).sum())
    if count <= len(bins) or total == 0.0:
        return math.nan
    within = sum(float(((part - part.mean()) ** 2).sum()) for part in bins)
    return max(0.0, 1.0 - float(within / (count - len(bins)) * (count - 1)) / total)


def draw_effects(part: Any, parameters: Sequence[Axis], measures: dict[str, Numbers], shares: Numbers) -> None:
    """A row a measure, a column a parameter."""
    panels = part.subplots(len(measures), len(parameters), sharex="col", sharey="row", squeeze=False)
    for row, (name, values) in enumerate(measures.items()):
        for column, axis in enumerate(parameters):
            panel = panels[row, column]
            panel.plot(axis.at, values, "o", color="C0", markersize=3.2, markeredgewidth=0,
                       alpha=0.7 if len(values) < 200 else 0.35)
            panel.plot(*means(axis, values), "-o", color="C3", linewidth=1.6, markersize=3.5)
            if math.isfinite(shares[row, column]):
                panel.set_title(f"{shares[row, column]:.0%}", loc="right", fontsize=8, color="C3", pad=2)
            dress(panel, axis if row == 0 else None, values)
            if column == 0:
                panel.set_ylabel(label(name), fontsize=8)
            if row == len(measures) - 1:
                panel.set_xlabel(shortened(axis.name), fontsize=8)
    part.suptitle("main effects: dots are runs, the line their mean,\n% the share of the variance explained", fontsize=9)


def means(axis: Axis, values: Numbers) -> tuple[Numbers, Numbers]:
    """Where each bin of a parameter lies, and the mean of a measure in it."""
    masks = [mask & np.isfinite(values) for mask in axis.bins()]
    masks = [mask for mask in masks if mask.any()]
    return np.array([axis.at[mask].mean() for mask in masks]), np.array([values[mask].mean() for mask in masks])


def draw_pairs(part: Any, colour: Axis, measures: dict[str, Numbers]) -> None:
    """Every measure against every other, coloured by a parameter."""
    names = list(measures)
    size = len(names) - 1
    panels = part.subplots(size, size, sharex="col", sharey="row", squeeze=False)
    dots = None
    for row in range(size):
        for column in range(size):
            panel = panels[row, column]
            if column > row:
                panel.remove()
                continue
            across, up = measures[names[column]], measures[names[row + 1]]
            dots = panel.scatter(across, up, c=colour.at, s=9, cmap="viridis", linewidths=0,
                                 norm="log" if colour.logarithmic else None)
            dress(panel, None, up)
            if logarithmic(across):
                panel.set_xscale("log")
            if column == 0:
                panel.set_ylabel(label(names[row + 1]), fontsize=8)
            if row == size - 1:
                panel.set_xlabel(label(names[column]), fontsize=8)
    bar = part.colorbar(dots, ax=panels.ravel().tolist() if size == 1 else [panel for panel in panels.ravel() if panel.figure],
                        shrink=0.6, aspect=30)
    bar.set_label(shortened(colour.name), fontsize=8)
    bar.ax.tick_params(labelsize=7)
    if colour.words:
        bar.set_ticks(range(len(colour.words)), labels=colour.words)
    part.suptitle("measures in pairs", fontsize=9)


def dress(panel: Any, axis: Axis | None, values: Numbers) -> None:
    """Scales, ticks and grid of a panel; `axis` where its horizontal one is a parameter that is not dressed yet."""
    if axis is not None and axis.logarithmic:
        panel.set_xscale("log")
    if axis is not None and axis.words:
        panel.set_xticks(range(len(axis.words)), labels=axis.words)
        panel.set_xlim(-0.5, len(axis.words) - 0.5)
    elif axis is not None and axis.few:
        levels = np.unique(axis.at)
        panel.set_xticks(levels, labels=[short(level) for level in levels.tolist()])
        panel.set_xticks([], minor=True)
    if logarithmic(values):
        panel.set_yscale("log")
    panel.tick_params(labelsize=7)
    for scale in (panel.xaxis, panel.yaxis):
        scale.get_offset_text().set_fontsize(6)
    panel.grid(alpha=0.25, linewidth=0.5)


def logarithmic(values: Numbers) -> bool:
    """Whether a measure is positive and spans more than a factor of 30. What spans all digits has rounding errors for zeros."""
    there = values[np.isfinite(values)]
    return bool(len(there)) and bool(there.min() > 0) and bool(30 * there.min() < there.max() < 1e9 * there.min())


def label(column: str) -> str:
    """A column in words, its unit below."""
    unit = figures.unit(column)
    return column.replace("_", " ").replace(".", ", ") + (f"\n[{unit}]" if unit else "")


def shortened(path: str) -> str:
    """The last words of a dotted path."""
    return path if len(path) <= 30 else "..." + path[-27:]
