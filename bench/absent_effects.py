"""What an effect costs that a scene does not call for, or that has nothing to do: `python bench/absent_effects.py [--quick]`.

Absent: the frame as it is against one from whose source the effect's calls were deleted, the same bits and the same time.
Idle: a scene that declares an effect which does nothing in it, against the scene without it. Ratios of processor times of
interleaved runs in one process, median and the interval that holds the middle nine tenths; writes absent_effects.csv.
"""

import ast
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
import numba
import numpy as np
import report
from cases import cloth, prepared, scene_of
from experiments import RESULTS, e1
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba import _jit, frame
from verlet_numba.buffers.world import NUMBER
from verlet_numba.run import engine
from verlet_numba.run.engine import State, start, warm
from verlet_numba.scene.build import Model, build, frames

STUDY = "absent"
CALLS = {"wind": {"blow"}, "drag": {"resist"}, "damping": {"damp"}, "carried": {"carry"}, "moving": {"move", "move_hulls"},
         "restitution": {"foresee", "bounce"}, "friction": {"rub", "rub_features", "rub_spheres"},
         "features": {"begin_features", "part_features"}, "spheres": {"begin_spheres", "part_spheres", "strike_spheres"},
         "rest": {"settle", "hold"}}
"""Statements of the frame that are an effect's alone."""
HANGING = scene_of(cloth(60, pinned="corners"), solver={"substeps": 4})
IDLE: dict[str, tuple[str, Any]] = {
    "drag of 0": ("drag", {"linear": 0.0, "quadratic": 0.0}), "damping of 0": ("damping", 0.0),
    "restitution of 0": ("restitution", 0.0), "friction without contact": ("friction", 0.5)}


def without(effects: set[str]) -> Callable[..., int]:
    """`frame.advance` compiled from a source in which these effects are not called."""
    deleted = set().union(*(CALLS[effect] for effect in effects))

    class Delete(ast.NodeTransformer):
        def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
            call = node.value
            gone = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in deleted
            return None if gone else node

    tree = Delete().visit(ast.parse(inspect.getsource(frame)))
    space: dict[str, Any] = {"__name__": "frame_without"}       # its kernel is never compiled, so never kept on disk
    exec(compile(ast.fix_missing_locations(tree), frame.__file__, "exec"), space)
    return numba.njit(**_jit.FLAGS)(space["advance"].py_func)  # type: ignore[no-any-return]  # Numba has no types


def timed(model: Model, advance: Callable[..., int], count: int, before: State) -> float:
    """Processor seconds of so many frames from a state on by this form of the frame."""
    before.restore(model)
    chunk = frames(model, count)
    engine.advance = advance
    seconds = computed(lambda: engine.run_chunk(model, chunk))
    engine.advance = frame.advance
    return seconds


def started(scene: dict[str, Any]) -> tuple[Model, State]:
    """A scene compiled and at its start."""
    ready = prepared(scene)
    model = start(build(ready.scene, ready.bodies))
    warm(model)
    return model, State.of(model)


def absent(name: str, scene: dict[str, Any], count: int, repetitions: int) -> Iterator[Figure]:
    """The frame against itself without the calls of all that the scene does not call for."""
    model, before = started(scene)
    gone = {effect for effect in CALLS if getattr(model.world.effects, effect) is None}
    short = without(gone)
    timed(model, short, 1, before)
    ends = []
    for advance in (frame.advance, short):
        timed(model, advance, count, before)
        ends.append(model.world.particles.position.copy())
    assert np.array_equal(*ends), f"{name}: absent effects change bits"
    substeps = int(model.world.clock[NUMBER])
    whole, deleted = interleaved(repetitions, lambda: timed(model, frame.advance, count, before),
                                 lambda: timed(model, short, count, before))
    yield figure(STUDY, name, "substep", "us", 1e6 * whole / substeps)
    yield figure(STUDY, f"{name}, without {len(gone)} effects", "excess of the frame as it is", "%", middle(whole / deleted),
                 at_most=2.0)


def idle(name: str, effect: str, value: Any, count: int, repetitions: int) -> Iterator[Figure]:
    """A hung cloth with an effect that does nothing in it, against the same without."""
    with_it, before = started(HANGING | {"effects": {**HANGING["effects"], effect: value}})
    bare, start_of_bare = started(HANGING)
    one, other = interleaved(repetitions, lambda: timed(with_it, frame.advance, count, before),
                             lambda: timed(bare, frame.advance, count, start_of_bare))
    yield figure(STUDY, name, "excess of the scene that declares it", "%", middle(one / other), at_most=3.0)


def middle(ratios: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Excess [%] of the middle nine tenths of ratios."""
    return 100 * (np.sort(ratios)[round(0.05 * len(ratios)):round(0.95 * len(ratios)) or None] - 1)


def studies(quick: bool) -> Iterator[Figure]:
    count, repetitions = (5, 9) if quick else (30, 41)
    yield from absent("cloth 60x60 hung", HANGING, count, repetitions)
    yield from absent("200 icosahedra", e1(200), count, repetitions)
    for name, (effect, value) in IDLE.items():
        yield from idle(name, effect, value, count, repetitions)


@click.command()
@click.option("--quick", is_flag=True, help="Fewer and shorter runs.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, results: Path) -> None:
    """Cost of absent and of idle effects."""
    where, figures = report.machine() + (", quick" if quick else ""), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in studies(quick):
        click.echo(report.line(found))
        figures.append(found)
    report.write_csv(figures, where, results / "absent_effects.csv")


if __name__ == "__main__":
    main()
