"""How fast the simulator is, held to bars: `python bench/throughput.py [--quick] [--only STUDY]`.

Prints a table and writes throughput.csv and throughput.png. Exit code 1 if a bar is missed.
"""

from pathlib import Path

import click
import memory
import projections
import report
import rope
import start_up
import sweep
import writing

RESULTS = Path(__file__).parent / "results"
STUDIES = {module.STUDY: module.measure for module in (projections, rope, start_up, sweep, writing, memory)}


@click.command()
@click.option("--quick", is_flag=True, help="Fewer and shorter repetitions: good for ratios, little for single figures.")
@click.option("--only", type=click.Choice(list(STUDIES)), multiple=True, help="This study alone; may be repeated.")
@click.option("--results", type=click.Path(path_type=Path), default=RESULTS, help="Folder of the table and the picture.")
def main(quick: bool, only: tuple[str, ...], results: Path) -> None:
    """Measure throughput, start-up, writing and memory."""
    where = report.machine() + (", quick" if quick else "")
    click.echo(f"{where}\n{report.HEADER}")
    figures = []
    for study in only or STUDIES:
        for found in STUDIES[study](quick):
            click.echo(report.line(found))
            figures.append(found)
    results.mkdir(parents=True, exist_ok=True)
    report.write_csv(figures, where, results / "throughput.csv")
    report.draw(figures, where, results / "throughput.png")
    raise SystemExit(any(found.verdict not in ("", report.MET) for found in figures))


if __name__ == "__main__":
    main()
