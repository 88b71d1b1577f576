"""Cloth hung by two corners in `order: lines`: processor time against strain: `python bench/hung_cloth.py [--quick]`.

A square metre of particles of equal mass with both diagonals hangs from two corners of one side, two seconds. Strain is
|length / rest - 1| at the end, of rows and columns (structural) and of all sticks; what is left of it swings, so its
median over starts that differ by a micrometre is what counts. Against it `order: sequential` and a rope with a heavy weight.
"""

from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import report
from cases import FALL, prepared, scene_of
from numpy.typing import NDArray
from report import Figure, figure
from timing import computed

from verlet_numba.buffers.world import ERROR_MAX, FALLBACKS, Frames
from verlet_numba.run.engine import run_chunk, start, warm
from verlet_numba.scene.body import Shape
from verlet_numba.scene.build import Model, build, frames
from verlet_numba.scene.plan import frame_count
from verlet_numba.scene.shapes import stick_lengths

STUDY, RESULTS = "hung_cloth", Path(__file__).parent / "results"
SECONDS, JITTER = 2.0, 1e-6
REPETITIONS = {True: 3, False: 5}
CASES = [(20, "lines", 8), (40, "lines", 6), (40, "lines", 8), (40, "lines", 12), (40, "lines", 20), (40, "lines", 24),
         (40, "sequential", 24), (40, "sequential", 100), (100, "lines", 8), (100, "lines", 16), (100, "lines", 18)]
BARS = {(40, 8): {"structural": 6.5e-4, "s": 0.1}, (40, 24): {"all": 6.2e-4, "s": 0.2}, (100, 18): {"structural": 1e-3, "s": 1.2}}
"""Mean strains and the seconds in which they are due: what the implicit solver of mujoco reaches in 1.4 s, and 8.9 s at 100x100."""
STRETCH = 1e-3


def measure(quick: bool) -> Iterator[Figure]:
    for precision in ("float64", "float32"):
        for side, order, substeps in CASES:
            bars = BARS.get((side, substeps), {}) if (order, precision) == ("lines", "float64") else {}
            yield from hang(side, order, substeps, precision, quick, bars)
    yield from weighted(quick)


def hang(side: int, order: str, substeps: int, precision: str, quick: bool, bars: dict[str, float]) -> Iterator[Figure]:
    """Seconds, strains and chains that fell back of a cloth of side x side particles."""
    body = {"kind": "cloth", "name": "sheet", "size": [1, 1], "resolution": [side, side], "mass": 1, "pinned": [0, side - 1]}
    scene = prepared(scene_of(body, effects=FALL | {"contact": "none"}, duration=SECONDS,
                              solver={"order": order, "substeps": substeps, "precision": precision})
                     | {"output": {"precision": "float64"}})
    sticks = scene.bodies[0].shape.sticks
    straight = (np.diff(np.stack(np.divmod(sticks, side)), axis=2) == 0).any(axis=0).ravel()
    runs = [run(build(scene.scene, scene.bodies), seed) for seed in range(REPETITIONS[quick])]
    seconds, strains = np.array([found[0] for found in runs]), np.array([strain(found[1], scene.bodies[0].shape) for found in runs])
    case = f"{side}x{side}, {order} {substeps}x1"
    yield figure(STUDY, case, f"processor time, {precision}", "s", seconds, at_most=bars.get("s"))
    yield figure(STUDY, case, f"a stick, {precision}", "ns", seconds * 1e9 / (len(sticks) * SECONDS * 60 * substeps))
    yield figure(STUDY, case, f"mean structural, {precision}", "1", strains[:, straight].mean(1), at_most=bars.get("structural"))
    yield figure(STUDY, case, f"largest structural, {precision}", "1", strains[:, straight].max(1))
    yield figure(STUDY, case, f"mean of all, {precision}", "1", strains.mean(1), at_most=bars.get("all"))
    yield figure(STUDY, case, f"fallbacks, {precision}", "1", [found[1].measures[:, FALLBACKS].sum() for found in runs])


def weighted(quick: bool) -> Iterator[Figure]:
    """A rope of 20 sticks with an end weight of 1000 of its particles: largest stretch over two seconds."""
    positions = [[0.01 * k, 0, -0.05 * np.sqrt(1 - 0.04) * k] for k in range(21)]
    body = {"kind": "particles", "name": "rope", "positions": positions, "masses": [1.0] * 20 + [1000.0], "pinned": [0],
            "sticks": [[k, k + 1] for k in range(20)]}
    for order in ("lines", "sequential"):
        scene = prepared(scene_of(body, effects=FALL | {"contact": "none"}, duration=SECONDS,
                                  solver={"order": order, "substeps": 8})
                         | {"output": {"precision": "float64"}})
        worst = [run(build(scene.scene, scene.bodies), seed)[1].measures[:, ERROR_MAX].max() for seed in range(REPETITIONS[quick])]
        yield figure(STUDY, "rope with a weight of 1:1000", f"largest stretch, {order} 8x1", "1", worst,
                     at_most=STRETCH if order == "lines" else None)


def run(model: Model, seed: int) -> tuple[float, Frames]:
    """Seconds of processor time, and the frames of a run that starts JITTER off."""
    start(model)
    particles = model.world.particles
    off = np.random.default_rng(seed).normal(0, JITTER, particles.position.shape) * (particles.inverse_mass > 0)
    off = off.astype(particles.position.dtype)
    particles.position[:] += off
    particles.previous[:] += off
    warm(model)
    chunk = frames(model, frame_count(model.scene))
    return computed(lambda: run_chunk(model, chunk)), chunk


def strain(chunk: Frames, shape: Shape) -> NDArray[np.float64]:
    """|length / rest - 1| of every stick at the end."""
    strains: NDArray[np.float64] = np.abs(stick_lengths(chunk.position[-1], shape.sticks) / shape.lengths - 1)
    return strains


@click.command()
@click.option("--quick", is_flag=True, help="Fewer repetitions.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, results: Path) -> None:
    """Measure whole chains of sticks against single ones."""
    where, figures = report.machine() + (", quick" if quick else ""), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in measure(quick):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "hung_cloth.csv")


if __name__ == "__main__":
    main()
