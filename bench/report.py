"""Measured figures and their bars: as a table, as a file of comma-separated values and as a picture."""

import csv
import os
import platform
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike

MET = "met"


@dataclass(frozen=True)
class Figure:
    """Median and range of repeated measurements, and the bar that the median is held to."""

    study: str
    case: str
    quantity: str
    unit: str
    median: float
    low: float
    high: float
    at_most: float | None = None
    at_least: float | None = None

    @property
    def load(self) -> float | None:
        """How much of what the bar allows is used up: above 1 the bar is missed."""
        if self.at_most is not None:
            return self.median / self.at_most
        return None if self.at_least is None else self.at_least / self.median

    @property
    def bar(self) -> str:
        if self.at_most is not None:
            return f"<= {self.at_most:g}"
        return "" if self.at_least is None else f">= {self.at_least:g}"

    @property
    def verdict(self) -> str:
        if self.load is None:
            return ""
        if self.load <= 1:
            return MET
        bar = self.at_least if self.at_most is None else self.at_most
        return f"missed by {abs(self.median / bar - 1):.0%}"


def figure(study: str, case: str, quantity: str, unit: str, samples: ArrayLike, *, at_most: float | None = None,
           at_least: float | None = None) -> Figure:
    """The figure of some samples."""
    values = np.asarray(samples, float)
    middle, low, high = float(np.median(values)), float(values.min()), float(values.max())
    return Figure(study, case, quantity, unit, middle, low, high, at_most, at_least)


def machine() -> str:
    """What it was measured on, and when."""
    processor = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    name, cores = processor[1] if processor else platform.machine(), len(os.sched_getaffinity(0))
    return (f"{name}, {cores} cores, numba {numba.__version__}, load {os.getloadavg()[0]:.1f}, "
            f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC")


HEADER = f"{'study':<12}{'case':<34}{'quantity':<30}{'median':>9}{'low':>9}{'high':>9}  {'unit':<5}{'bar':<9}verdict"


def line(f: Figure) -> str:
    """A figure as a line under HEADER."""
    values = "".join(f"{value:>9.4g}" for value in (f.median, f.low, f.high))
    return f"{f.study:<12}{f.case:<34}{f.quantity:<30}{values}  {f.unit:<5}{f.bar:<9}{f.verdict}"


def write_csv(figures: Sequence[Figure], where: str, path: Path) -> None:
    """One row a figure, with its verdict and the machine."""
    with path.open("w", newline="") as file:
        rows = csv.DictWriter(file, [field.name for field in fields(Figure)] + ["verdict", "machine"], lineterminator="\n")
        rows.writeheader()
        for found in figures:
            numbers = {name: float(f"{value:.4g}") for name, value in asdict(found).items() if isinstance(value, float)}
            rows.writerow(asdict(found) | numbers | {"verdict": found.verdict, "machine": where})


def draw(figures: Sequence[Figure], where: str, path: Path) -> None:
    """Left, where measured: nanoseconds a projection, naive and as runs. Right: every figure as a part of its bar."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    projections = [f for f in figures if f.study == "projections" and f.unit == "ns"]
    barred = [f for f in figures if f.load is not None]
    canvas = Canvas(figsize=(16, 3 + 0.28 * max(len(barred), len(projections))), layout="constrained")
    FigureCanvasAgg(canvas)
    panels = [draw_projections] * bool(projections) + [draw_bars] * bool(barred)
    for axes, panel in zip(canvas.subplots(1, max(1, len(panels)), squeeze=False)[0], panels, strict=False):
        panel(axes, projections if panel is draw_projections else barred)
    canvas.suptitle(where, fontsize=9)
    canvas.savefig(path, dpi=100)


def draw_projections(axes: Any, figures: Sequence[Figure]) -> None:
    cases, quantities = (list(dict.fromkeys(values)) for values in ([f.case for f in figures], [f.quantity for f in figures]))
    height = 0.8 / len(quantities)
    for q, quantity in enumerate(quantities):
        mine = [f for f in figures if f.quantity == quantity]
        place = [cases.index(f.case) + q * height for f in mine]
        error = [[f.median - f.low for f in mine], [f.high - f.median for f in mine]]
        axes.barh(place, [f.median for f in mine], height, xerr=error, label=quantity, error_kw={"linewidth": 0.8})
        barred = [(y, f.at_most) for y, f in zip(place, mine, strict=True) if f.at_most is not None]
        axes.plot([x for _, x in barred], [y for y, _ in barred], "k|", markersize=14, label="bar" if q == 0 else None)
    axes.set_yticks(np.arange(len(cases)) + 0.4, cases)
    axes.invert_yaxis()
    axes.set_xlabel("ns a distance projection (median, range)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=5)


def draw_bars(axes: Any, figures: Sequence[Figure]) -> None:
    loads = [f.load or 0.0 for f in figures]
    axes.barh(range(len(figures)), loads, color=["tab:green" if f.verdict == MET else "tab:red" for f in figures])
    axes.axvline(1, color="black")
    axes.set_yticks(range(len(figures)), [f"{f.case}, {f.quantity}" for f in figures], fontsize=8)
    for y, f in enumerate(figures):
        axes.text(loads[y], y, f" {f.median:.3g} {f.unit} ({f.bar})", va="center", fontsize=8)
    axes.set_xlim(0, max(1.2, 1.35 * max(loads)))
    axes.invert_yaxis()
    axes.set_xlabel("part of what the bar allows (above 1: missed)")
