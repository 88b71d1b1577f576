"""Scenes side by side against scenes one after another, in one thread: `python bench/ensemble.py [--quick] [--only ropes]`.

Both are simulated by the same blocks (run/ensemble.py), of many instances and of one, in turn and in the same process.
Building the worlds, machine code and writing stand apart. Writes ensemble.csv; exit code 1 if a bar is missed.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
import report
from cases import FALL, ROPE, cloth, prepared, scene_of
from report import Figure, figure
from timing import computed, interleaved

from verlet_numba.run.engine import State, start, warm
from verlet_numba.run.ensemble import Instance, advance_all, blocks, model_of
from verlet_numba.run.simulate import Summary
from verlet_numba.run.trajectory import TrajectoryFile
from verlet_numba.scene.build import build
from verlet_numba.scene.prepare import Prepared

STUDY, RESULTS = "ensemble", Path(__file__).parent / "results"
REPETITIONS = {True: 3, False: 11}
FLOAT32 = {"substeps": 10, "iterations": 1, "precision": "float32"}
ALONE = FALL | {"contact": "none"}
BARS = {"ropes": (0.4, 5.0), "cloths": (4.0, 1.7), "rooms": (None, 1.0)}
"""Milliseconds an instance, and times the throughput of single runs; rooms are one a block."""


class Nowhere(TrajectoryFile):
    """A trajectory file that is none and keeps nothing."""

    def __init__(self) -> None:
        self.frames = 0

    def append(self, *frames: Any) -> None:
        pass


def ropes(k: int) -> dict[str, Any]:
    return scene_of(ROPE | {"end": [1 + 0.001 * k, 0, 0], "mass": 0.1 + 0.01 * k}, solver=FLOAT32, effects=ALONE, duration=5)


def cloths(k: int) -> dict[str, Any]:
    return scene_of(cloth(20, size=[1, 1 + 0.01 * k], pinned=[0, 19]), solver=FLOAT32, effects=ALONE, duration=2)


def rooms(k: int) -> dict[str, Any]:
    dice = {"kind": "icosahedron", "name": "dice", "radius": 0.2, "mass": 1 + 0.1 * k, "count": 50,
            "scatter": {"inside": [[-2, -2, 0.3], [2, 2, 3]], "speed": [0, 4]}}
    return scene_of(dice, duration=5, colliders=({"kind": "room", "size": [4, 4, 4], "position": [0, 0, 2]},)) | {"seed": k}


CASES: dict[str, tuple[Callable[[int], dict[str, Any]], int, str]] = {
    "ropes": (ropes, 64, "64 ropes of 50 sticks, 5 s"),
    "cloths": (cloths, 32, "32 cloths 20x20, 2 s"),
    "rooms": (rooms, 8, "8 rooms of 50 icosahedra, 5 s")}


def compared(name: str, quick: bool) -> Iterator[Figure]:
    scene, count, case = CASES[name]
    scenes = [prepared(scene(k)) for k in range(count)]
    planned, single = blocks(instances(scenes)), [Ready([each]) for each in instances(scenes)]
    ready = [Ready(members) for members in planned]
    beside, alone = interleaved(REPETITIONS[quick], lambda: sum(block.seconds() for block in ready),
                                lambda: sum(block.seconds() for block in single)) * 1e3 / count
    each, times = BARS[name]
    yield figure(STUDY, case, f"side by side, {len(planned)} blocks", "ms", beside, at_most=each)
    yield figure(STUDY, case, "one after another", "ms", alone)
    yield figure(STUDY, case, "throughput", "x", alone / beside, at_least=times)


def instances(scenes: list[Prepared]) -> list[Instance]:
    return [Instance(k, each, Path("nowhere"), "", build(each.scene, each.bodies)) for k, each in enumerate(scenes)]


class Ready:
    """A block at its start, again and again."""

    def __init__(self, members: list[Instance]) -> None:
        self.members = members
        self.model = start(model_of(members))
        self.begin = State.of(self.model)
        warm(self.model)

    def seconds(self) -> float:
        """Processor time from the start to the last frame."""
        self.begin.restore(self.model)
        for member in self.members:
            member.summary, member.file = Summary(""), Nowhere()
        return computed(lambda: advance_all(self.model, self.members, bool))


@click.command()
@click.option("--quick", is_flag=True, help="Fewer repetitions.")
@click.option("--only", type=click.Choice(list(CASES)), multiple=True, help="These scenes alone; rooms take minutes to compile.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table.")
def main(quick: bool, only: tuple[str, ...], results: Path) -> None:
    """Measure ensembles against single runs."""
    where, figures = report.machine() + (", quick" if quick else ""), []
    click.echo(f"{where}\n{report.HEADER}")
    for found in (found for name in only or CASES for found in compared(name, quick)):
        click.echo(report.line(found))
        figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "ensemble.csv")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
