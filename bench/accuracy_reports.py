"""What accuracy costs in six scenes: `python bench/accuracy_reports.py [NAME...] [--budget S]`.

Writes bench/accuracy/NAME/accuracy.csv, .json and .png, what `verlet-numba accuracy` finds out about each, and prints its
table. docs/accuracy.md reads them.
"""

from pathlib import Path

import click
from report import machine

from verlet_numba.scene.load import load
from verlet_numba.study import accuracy_report
from verlet_numba.study.accuracy import study

SCENES = Path(__file__).parents[1] / "scenes"
FOLDER = Path(__file__).parent / "accuracy"
STUDIES: dict[str, tuple[str, tuple[str, ...]]] = {
    "pendulum": ("validation/pendulum.yaml", ()),
    "rope_with_a_weight": ("hard/b01_rope_with_a_weight.yaml", ("time.duration=2", "expect=[]")),
    "cloth_on_cube": ("paper/cloth_on_cube.yaml", ()),
    "icosahedra": ("paper/icosahedra_room.yaml", ("time.duration=2", "expect=[]")),
    "stack_of_boxes": ("hard/b27_stack.yaml", ("time.duration=2", "expect=[]")),
    "incline": ("validation/incline_slides.yaml", ())}


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(list(STUDIES)))
@click.option("--budget", type=float, default=80.0, show_default=True, help="Seconds of running for each scene.")
@click.option("--runs", type=int, default=40, show_default=True, help="Settings of each scene, at most.")
@click.option("--results", type=click.Path(path_type=Path), default=FOLDER, help="Folder of the reports.")
def main(names: tuple[str, ...], budget: float, runs: int, results: Path) -> None:
    """Reports of the scenes NAMES, of all if none is named."""
    click.echo(machine())
    for name in names or STUDIES:
        file, sets = STUDIES[name]
        found = study(load(SCENES / file, sets), sets, {}, runs, budget, lambda text: None)
        accuracy_report.write(found, results / name)
        click.echo("\n".join(accuracy_report.table(found)) + "\n")


if __name__ == "__main__":
    main()
