"""The paper's figure 9b, frames a second against the resolution of a falling cloth (E2): `python bench/figure_9b.py [--quick]`.

Writes figure_9b.csv and figure_9b.png: a cloth falls on a cube and on a rope, by the paper's method, the same in eight
smaller steps, by the program's default, with 24 substeps, and by the scene's own solver. Height, strain and penetration
stand beside: a cloth that is quick but stretches, or falls through, is no result. By the paper's method at one step a frame
it does fall through the rope, as the paper warns of thin objects. Penetration is that of the spheres around particles, from
the positions of all frames. Times are of the processor in one thread.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import report
from experiments import (
    RESULTS,
    Array,
    Scene,
    advanced,
    bodies_of,
    depth_in_box,
    depth_in_itself,
    depth_in_spheres,
    e2,
    started,
    strain,
)
from report import Figure, figure

STUDY = "figure 9b"
RESOLUTIONS, QUICK = (20, 25, 30, 35, 40), (10, 15)
PAPER = {"cube": (14, 11, 8, 5, 2), "rope": (12, 9, 6, 3, 1)}       # frames/s at RESOLUTIONS, read off the chart
SETTINGS: dict[str, dict[str, Any]] = {"paper": {"preset": "paper"}, "paper x 8": {"preset": "paper", "substeps": 8},
                                       "default": {"preset": "default"}, "default x 24": {"substeps": 24}, "scene": {}}
BARRED, FRAMES_A_SECOND, STRAIN = (40, "default x 24"), 500, 0.01       # bars: at least so many frames/s, at most so much strain
HELD = 0.5              # of the mean height that the cloth ends at by the scene's own solver; lower, and it fell through
FRAMES = 120
Curves = dict[tuple[str, str], dict[int, tuple[float, float]]]      # by obstacle and setting: frames/s and height at the end


def depth(scene: Scene, cloth: Array, others: Array) -> float:
    """How deeply the cloth's particles (N, 3), each a ball, are in the obstacle [m]; others (M, 3): those of the first body."""
    sheet = scene["bodies"][-1]
    cubes = [collider for collider in scene["colliders"] if collider["kind"] == "box"]
    if cubes:
        return depth_in_box(cloth, sheet["thickness"] / 2, cubes[0]["position"], cubes[0]["size"])
    return depth_in_spheres(cloth, others, (sheet["thickness"] + scene["bodies"][0]["thickness"]) / 2)


def fall(obstacle: str, side: int, setting: str, count: int, repetitions: int, curves: Curves) -> Iterator[Figure]:
    """One cloth: frames a second, strain at the end, deepest penetration. The median rate also goes into `curves`."""
    case, scene = f"{side}x{side} on the {obstacle}, {setting}", e2(obstacle, side, **SETTINGS[setting])
    rates = []
    for _ in range(repetitions):
        model = started(scene)
        positions, seconds = advanced(model, count)
        rates.append(count / seconds)
    cloth = bodies_of(model, positions, len(model.bodies) - 1)[:, 0]
    others, thickness = bodies_of(model, positions, 0)[:, 0], scene["bodies"][-1]["thickness"]
    barred = (side, setting) == BARRED
    found = figure(STUDY, case, "frames a second", "1/s", rates, at_least=FRAMES_A_SECOND if barred else None)
    height = float(cloth[-1, :, 2].mean())
    curves.setdefault((obstacle, setting), {})[side] = found.median, height
    yield found
    yield figure(STUDY, case, "mean height, end", "m", height)
    yield figure(STUDY, case, "mean structural strain, end", "1", strain(cloth[-1].reshape(side, side, 3), 1 / (side - 1)),
                 at_most=STRAIN if barred else None)
    yield figure(STUDY, case, "deepest in the obstacle", "m", max(depth(scene, *each) for each in zip(cloth, others, strict=True)))
    yield figure(STUDY, case, "deepest in itself", "m", max(depth_in_itself(each, cloth[0], thickness) for each in cloth))


def draw(curves: Curves, where: str, path: Path) -> None:
    """Frames a second against resolution, a panel for each obstacle."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(12, 5), layout="constrained")
    FigureCanvasAgg(canvas)
    for axes, obstacle in zip(canvas.subplots(1, 2, sharey=True), PAPER, strict=True):
        axes.loglog(RESOLUTIONS, PAPER[obstacle], "ks--", label="Ponce Atencio et al. 2005, read off figure 9b")
        for (on, setting), found in curves.items():
            if on == obstacle:
                (drawn,) = axes.loglog(list(found), [rate for rate, _ in found.values()], "o-", label=setting)
                fell = [side for side, (_, height) in found.items() if height < HELD * curves[on, "scene"][side][1]]
                axes.loglog(fell, [found[side][0] for side in fell], "X", color=drawn.get_color(), markersize=12)
        axes.set(xlabel="particles a side", ylabel="frames/s", title=f"E2: cloth on the {obstacle} (crosses: it fell through)")
        axes.set_xticks(RESOLUTIONS, [str(side) for side in RESOLUTIONS])
        axes.grid(True, which="both", linewidth=0.3)
        axes.legend(fontsize=8, loc="lower left")
    canvas.suptitle(where, fontsize=9)
    canvas.savefig(path, dpi=100)


@click.command()
@click.option("--quick", is_flag=True, help="Small cloths and short runs.")
@click.option("--only", type=click.Choice(list(PAPER)), multiple=True, help="This obstacle alone.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table and the picture.")
def main(quick: bool, only: tuple[str, ...], results: Path) -> None:
    """Frame rates of E2."""
    where, curves, figures = report.machine() + (", quick" if quick else ""), Curves(), []
    click.echo(f"{where}\n{report.HEADER}")
    for obstacle in only or PAPER:
        for side in QUICK if quick else RESOLUTIONS:
            for setting in SETTINGS:
                for found in fall(obstacle, side, setting, 40 if quick else FRAMES, 1 if quick else 3, curves):
                    click.echo(report.line(found))
                    figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "figure_9b.csv")
    draw(curves, where, results / "figure_9b.png")


if __name__ == "__main__":
    main()
