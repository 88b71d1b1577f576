"""The paper's figure 9c, relaxations a step against the number of icosahedra (E1): `python bench/figure_9c.py [--quick]`.

The paper counts about half as many relaxations by constraint-graph order as by sequential order, at 1 % tolerance, and does
not say what it counts, nor when a step is done. So every reading is drawn beside its curve:

- contacts separate once before the first pass, or before every pass;
- ten passes, or passes until all sticks are within tolerance (at most MOST_PASSES);
- relaxations done, or constraints visited: by fixed passes all of every list; until all are within tolerance the lists of
  all bodies in the first pass, then of those that still have a stick off.

Writes figure_9c.csv and figure_9c.png. What holds (throws of 3 s by 1 to 50 icosahedra):
- no reading has constraint-graph order relax half as much. With the paper's repeats it relaxes 0.96 to 1.09 times what
  sequential order does, and visits 1.5 to 2.0 times as many constraints; each stick once in order of distance, 0.93 to 0.95
  times, and 0.9 to 1 times as many visits;
- relaxations are a tenth of the paper's 750 a body and step: 45 to 105. Visits come near it. Those of ten passes are, for 25
  and 50 icosahedra, 9,000 and 18,000 in sequential order and 17,700 and 35,300 in graph order: near to the paper's two
  curves (9,500 and 22,500; 19,000 and 37,500), with the orders the other way round.

bench/relaxation_residual.py holds orders against each other at equal residual.
"""

import csv
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from itertools import product
from pathlib import Path
from typing import Any

import click
import numpy as np
import report
from experiments import RESULTS, Array, e1, started

from verlet_numba.buffers.world import NUMBER, World
from verlet_numba.effects.contact import find_contacts, separate
from verlet_numba.effects.features import begin_features, part_features, rub_features
from verlet_numba.effects.friction import rub
from verlet_numba.effects.gravity import fall
from verlet_numba.effects.meet import find_meetings, gather
from verlet_numba.effects.most_moved import choose_lists, note_places
from verlet_numba.effects.touch import HULLS
from verlet_numba.kernels.integrate import integrate
from verlet_numba.kernels.relax import relax_runs, relax_sticks
from verlet_numba.kernels.relax_graph import relax_graph
from verlet_numba.run.engine import grown
from verlet_numba.scene.build import Model

PAPER = {"sequential": {25: 19_000, 44: 36_000, 50: 37_500},        # relaxations a step, read off the chart
         "by_level": {25: 9_500, 44: 26_500, 50: 22_500}}
ORDERS = {"sequential": {"order": "sequential"}, "by_level": {"repeats": "by_level"}, "once": {"repeats": "once"}}
SEPARATIONS, PASSES, COUNTED = ("once", "every pass"), ("ten passes", "until within 1 %"), ("relaxations", "visits")
COUNTS, QUICK = (1, 5, 10, 20, 25, 30, 40, 44, 50), (1, 5, 10)
FIXED, MOST_PASSES = 10, 200
STEPS, QUICK_STEPS = 180, 30            # of 1/60 s


@dataclass(frozen=True)
class Row:
    """Means over the steps of a run."""

    separation: str
    passes: str
    order: str
    icosahedra: int
    relaxations: float
    visits: float
    passes_a_step: float
    cut_short: float        # part of the steps that were not done after MOST_PASSES


def list_lengths(model: Model) -> Array:
    """(K,) how many entries the list has by which each body is relaxed now."""
    graph, collided = model.world.graph, model.world.collided
    if graph is None or collided is None:
        return np.full(model.bodies[0].copies, len(model.bodies[0].shape.sticks))
    return np.diff(graph.listed, axis=0)[0][graph.family[graph.bucket + collided.moved + 1]]


def off(world: World, bodies: int) -> Array:
    """(K,) whether each body has a stick that is off tolerance."""
    ends, rest = world.particles.position[:, world.observed.pairs], world.observed.rest
    errors = np.abs(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0) / rest - 1)
    return np.asarray((errors.reshape(bodies, -1) > world.solver.tolerance).any(axis=1))


def fall_and_meet(model: Model) -> World:
    """A step up to its contacts, as in the frame loop."""
    position, previous, inverse_mass, acceleration = model.world.particles
    fall(acceleration, model.world.effects.gravity)
    integrate(position, previous, acceleration, model.world.solver.step)
    gather(position, model.world.effects.hulls)
    while not (find_contacts(position, previous, inverse_mass, model.world.effects.contact)
               and find_meetings(model.world.effects.hulls, model.world.effects.meet, None)):
        model.world = grown(model.world)
    effects = model.world.effects
    begin_features(inverse_mass, effects.meet, effects.hulls, effects.features)
    note_places(position, model.world.collided)
    return model.world


def step(model: Model, separation: str, passes: str) -> tuple[int, int, int, bool]:
    """A step of the paper's method. Returns relaxations, visits, passes, and whether it was cut short."""
    world, bodies = fall_and_meet(model), model.bodies[0].copies
    position, previous, inverse_mass, _ = world.particles
    effects, tolerance, approximate = world.effects, world.solver.tolerance, world.solver.approximate
    fixed = passes == PASSES[0]
    relaxations = visits = 0
    for k in range(FIXED if fixed else MOST_PASSES):
        if k == 0 or separation == "every pass":
            separate(position, effects.contact)
            part_features(position, inverse_mass, effects.meet, effects.hulls, effects.features, HULLS)
        if k == 0:
            choose_lists(position, world.collided, world.graph)
            lengths = list_lengths(model)
        visits += int(lengths.sum() if fixed or k == 0 else lengths[off(world, bodies)].sum())
        now = relax_graph(position, world.graph, tolerance, approximate)
        now += relax_runs(position, world.runs, None, tolerance, approximate)
        now += relax_sticks(position, world.sticks, None, tolerance, approximate)
        relaxations += now
        if not fixed and now == 0:
            break
    rub(position, effects.contact, effects.friction)
    rub_features(position, previous, inverse_mass, effects.meet, effects.hulls, effects.features, effects.friction, HULLS)
    world.clock[NUMBER] += 1
    return relaxations, visits, k + 1, not fixed and now > 0


def follow(count: int, separation: str, passes: str, order: str, steps: int) -> Row:
    """A throw by one reading and order."""
    model = started(e1(count, preset="paper", **ORDERS[order]), warmed=False)
    counts = np.array([step(model, separation, passes) for _ in range(steps)], float)
    if not np.isfinite(model.world.particles.position).all():
        raise ArithmeticError(f"diverged: {count} icosahedra, {separation}, {passes}, {order}")
    return Row(separation, passes, order, count, *(float(f"{mean:.5g}") for mean in counts.mean(axis=0)))


def rows(counts: tuple[int, ...], steps: int) -> Iterator[Row]:
    for count, separation, passes, order in product(counts, SEPARATIONS, PASSES, ORDERS):
        yield follow(count, separation, passes, order, steps)


def ratios(found: list[Row]) -> Iterator[str]:
    """What the orders take of what the sequential one takes, over the larger half of the counts; and the paper's."""
    counts = sorted({row.icosahedra for row in found})
    large = counts[len(counts) // 2:]
    for separation, passes, counted in product(SEPARATIONS, PASSES, COUNTED):
        totals = {order: sum(getattr(row, counted) for row in found if row.icosahedra in large
                             and (row.separation, row.passes, row.order) == (separation, passes, order)) for order in ORDERS}
        parts = ", ".join(f"{order} {totals[order] / totals['sequential']:.2f}" for order in ORDERS)
        yield f"{counted:<12}separated {separation:<11}{passes:<17}{parts}"
    yield "paper: " + ", ".join(f"{PAPER['by_level'][n] / PAPER['sequential'][n]:.2f} at {n}" for n in PAPER["by_level"])


def draw(found: list[Row], where: str, path: Path) -> None:
    """A panel for each reading, counted both ways, with the paper's curve."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(18, 9), layout="constrained")
    FigureCanvasAgg(canvas)
    panels = canvas.subplots(2, 4, sharex=True).T
    for column, (separation, passes) in zip(panels, product(SEPARATIONS, PASSES), strict=True):
        for axes, counted in zip(column, COUNTED, strict=True):
            draw_reading(axes, [row for row in found if (row.separation, row.passes) == (separation, passes)], counted)
            axes.set_title(f"separated {separation}, {passes}", fontsize=10)
    canvas.suptitle(where, fontsize=9)
    canvas.savefig(path, dpi=80)


def draw_reading(axes: Any, found: list[Row], counted: str) -> None:
    for order, colour in zip(ORDERS, ("tab:blue", "tab:orange", "tab:green"), strict=True):
        mine = [row for row in found if row.order == order]
        axes.plot([row.icosahedra for row in mine], [getattr(row, counted) for row in mine], "o-", color=colour, label=order)
        if order in PAPER:
            axes.plot(list(PAPER[order]), list(PAPER[order].values()), "s--", color=colour, label=f"{order}, read off figure 9c")
    axes.set(xlabel="icosahedra", ylabel=f"{counted} a step")
    axes.grid(linewidth=0.3)
    axes.legend(fontsize=8)


@click.command()
@click.option("--quick", is_flag=True, help="Few bodies and steps.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table and the picture.")
def main(quick: bool, results: Path) -> None:
    """Relaxations of E1 under every reading."""
    where, found = report.machine() + (", quick" if quick else ""), []
    for row in rows(QUICK if quick else COUNTS, QUICK_STEPS if quick else STEPS):
        click.echo("{:<11}{:<17}{:<11}{:>5}{:>10.5g}{:>10.5g}{:>8.3g}{:>8.2g}".format(*asdict(row).values()))
        found.append(row)
    click.echo("\n".join(ratios(found)))
    results.mkdir(parents=True, exist_ok=True)
    with (results / "figure_9c.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Row)] + ["machine"], lineterminator="\n")
        table.writeheader()
        table.writerows(asdict(row) | {"machine": where} for row in found)
    draw(found, where, results / "figure_9c.png")


if __name__ == "__main__":
    main()
