"""The paper's figure 9a, frames a second against the number of icosahedra (E1): `python bench/figure_9a.py [--quick]`.

Writes figure_9a.csv and figure_9a.png: the paper's method, the same with grids in place of all pairs, and the program's
default; then bars. Icosahedra fill a tenth of the room whatever their number; a figure is of 5 s from the throw on. Times
are of the processor in one thread.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import report
from cases import prepared
from experiments import RESULTS, Array, advanced, beyond, bodies_of, deepest_pair, e1, inside, mirrored, started
from report import Figure, figure

from verlet_numba.run.engine import run_chunk, spread_over, start, warm
from verlet_numba.scene.build import Model, build, frames

STUDY = "figure 9a"
PAPER = {1: 575.0, 50: 20.0}            # frames/s, read off the chart; Pentium IV, 1.8 GHz
SETTINGS: dict[str, dict[str, Any]] = {"paper": {"preset": "paper"}, "default": {"preset": "default"},
                                       "paper, sweep": {"preset": "paper", "broad_phase": "sweep"}}
COUNTS, LARGE, QUICK = (1, 2, 5, 10, 20, 30, 40, 50), (1000, 10_000), (1, 5, 20)
RATE = 60                               # frames a second of the scene
DEEPEST, SECONDS = 0.016, 1.8           # m, s: bars of 1,000 icosahedra
Curves = dict[str, dict[int, float]]


def room_of(model: Model) -> float:
    """Side of the room, m."""
    return float(model.scene.colliders[0].size[0])


def thrown(count: int, solver: dict[str, Any], seconds: float, samples: int = 1) -> tuple[float, Array, Model]:
    """Processor seconds that so much simulated time takes, the bodies (samples, K, P, 3) at equal intervals, the model."""
    model = started(e1(count, **solver))
    chunks = [advanced(model, round(seconds * RATE / samples)) for _ in range(samples)]
    return sum(took for _, took in chunks), np.stack([bodies_of(model, position[-1]) for position, _ in chunks]), model


def sound(case: str, bodies: Array, side: float) -> Iterator[Figure]:
    """Nothing leaves the room. bodies: (T, K, P, 3)."""
    yield figure(STUDY, case, "bodies in the room", "1", [inside(each, side) for each in bodies], at_least=bodies.shape[1])
    yield figure(STUDY, case, "farthest out of the room", "m", beyond(bodies, side))


def frame_rates(counts: tuple[int, ...], seconds: float, repetitions: int, curves: Curves) -> Iterator[Figure]:
    """Frames a second of every setting; the medians also go into `curves`."""
    for count in counts:
        for setting, solver in SETTINGS.items():
            runs = [thrown(count, solver, seconds) for _ in range(repetitions if count < 1000 else 1)]
            case, (_, bodies, model) = f"{count:,} icosahedra, {setting}", runs[0]
            found = figure(STUDY, case, "frames a second", "1/s", [seconds * RATE / took for took, _, _ in runs],
                           at_least=3500 if (count, setting) == (50, "paper") else None)
            curves.setdefault(setting, {})[count] = found.median
            yield found
            yield from sound(case, bodies, room_of(model))


def growth(curves: Curves, small: int, large: int) -> Iterator[Figure]:
    """The exponents with which time grows from one count to the other."""
    for setting, rates in curves.items():
        exponent = np.log(rates[small] / rates[large]) / np.log(large / small)
        yield figure(STUDY, f"{small:,} to {large:,}, {setting}", "exponent of time", "1", exponent)


def on_threads(count: int, seconds: float, threads: tuple[int, ...]) -> Iterator[Figure]:
    """Frames a second of the paper's step by the clock, whose result does not depend on the threads."""
    for number in threads:
        ready = prepared(e1(count, **SETTINGS["paper, sweep"]))
        model = spread_over(start(build(ready.scene, ready.bodies)), number)
        warm(model)
        chunk = frames(model, round(seconds * RATE))
        clock = time.perf_counter()
        run_chunk(model, chunk)
        rate = len(chunk.measures) / (time.perf_counter() - clock)
        case = f"{count:,} icosahedra, paper, sweep, {number} thread{'s' * (number > 1)}"
        yield figure(STUDY, case, "frames a second by the clock", "1/s", rate, at_least=20 if number == 2 else None)


def depths(count: int, seconds: float, substeps: range, barred: bool) -> Iterator[Figure]:
    """Deepest pair, sampled every half second, and time by substeps of the default; bars are on the fewest that are enough."""
    found = {}
    for k in substeps:
        took, bodies, model = thrown(count, {"substeps": k}, seconds, samples=round(2 * seconds))
        triangles = model.bodies[0].shape.triangles
        found[k] = took, max(deepest_pair(each, triangles) for each in bodies), bodies, room_of(model)
    enough = [k for k in substeps if found[k][1] <= DEEPEST]
    chosen = enough[0] if enough else min(substeps, key=lambda k: found[k][1])
    for k, (took, deepest, bodies, side) in found.items():
        bars = {"at_most": DEEPEST}, {"at_most": SECONDS}
        depth_bar, time_bar = bars if barred and k == chosen else ({}, {})
        case = f"{count:,} icosahedra, default x {k}"
        yield figure(STUDY, case, "deepest pair", "m", deepest, **depth_bar)
        yield figure(STUDY, case, f"time of {seconds:g} s", "s", took, **time_bar)
        yield from sound(case, bodies, side)


def at_rest(count: int, settle: float, watch: float, barred: bool, rest: bool) -> Iterator[Figure]:
    """What still moves after a while, in which no icosahedron should, and how far it gets in another.

    rest: bodies are put to rest (`effects.rest`); else contacts alone must hold them.
    """
    scene = e1(count)
    if rest:
        scene["effects"]["rest"] = {}
    model = started(scene)
    before = bodies_of(model, advanced(model, round(settle * RATE))[0][-1])
    after = bodies_of(model, advanced(model, round(watch * RATE))[0])
    trail = np.concatenate([before[None], after])
    speeds = np.linalg.norm(np.diff(trail, axis=0), axis=-1).max(axis=(1, 2)) * RATE
    drift = np.linalg.norm(trail - before, axis=-1).max()
    upright = count - max(mirrored(each, model.bodies[0].shape.triangles) for each in (before, trail[-1]))
    case = f"{count:,} icosahedra at rest" + (", put to rest" if rest else "")
    yield figure(STUDY, case, f"fastest particle after {settle:g} s", "m/s", speeds.max(), at_most=0.01 if barred else None)
    yield figure(STUDY, case, f"farthest in the next {watch:g} s", "m", drift, at_most=1e-3 if barred else None)
    yield figure(STUDY, case, "bodies not mirrored", "1", upright, at_least=count)
    yield from sound(case, trail[[0, -1]], room_of(model))


def draw(curves: Curves, where: str, path: Path) -> None:
    """Frames a second against the number of icosahedra."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(8, 6), layout="constrained")
    FigureCanvasAgg(canvas)
    axes = canvas.subplots()
    axes.loglog(list(PAPER), list(PAPER.values()), "ks--", label="Ponce Atencio et al. 2005, read off figure 9a")
    for setting, rates in curves.items():
        axes.loglog(list(rates), list(rates.values()), "o-", label=setting)
    axes.axhline(RATE, color="grey", linewidth=0.8)
    axes.text(1, RATE, " real time", va="bottom", color="grey")
    axes.set(xlabel="icosahedra", ylabel="frames/s", title=f"E1: icosahedra thrown into a room\n{where}")
    axes.title.set_fontsize(9)
    axes.grid(True, which="both", linewidth=0.3)
    axes.legend()
    canvas.savefig(path, dpi=100)


def studies(curves: Curves) -> Iterator[Figure]:
    yield from frame_rates(COUNTS + LARGE, 5.0, 3, curves)
    yield from growth(curves, *LARGE)
    yield from on_threads(LARGE[-1], 5.0, (1, 2))
    yield from depths(1000, 5.0, range(2, 9), True)
    yield from at_rest(200, 15.0, 5.0, False, rest=False)
    yield from at_rest(200, 15.0, 5.0, True, rest=True)


def short_studies(curves: Curves) -> Iterator[Figure]:
    yield from frame_rates(QUICK, 1.0, 1, curves)
    yield from depths(20, 1.0, range(4, 9, 4), False)
    yield from at_rest(5, 3.0, 1.0, False, rest=True)


@click.command()
@click.option("--quick", is_flag=True, help="Few bodies and short runs, without the bars.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table and the picture.")
def main(quick: bool, results: Path) -> None:
    """Frame rates of E1 and the bars on it. Exit code 1 if a bar is missed."""
    where, curves, figures = report.machine() + (", quick" if quick else ""), Curves(), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in short_studies(curves) if quick else studies(curves):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "figure_9a.csv")
    draw(curves, where, results / "figure_9a.png")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
