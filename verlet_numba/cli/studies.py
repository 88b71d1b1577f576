"""`accuracy` and `verify`: what a setting costs, and whether a scene holds what it states."""

from pathlib import Path
from typing import Any

import click

from verlet_numba.cli.options import AS_JSON, FAILED, QUIET, SCENE, SETS, Misuse, default_name
from verlet_numba.cli.wording import counted, print_json, say


@click.command()
@SCENE
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder of table and picture. [default: NAME.accuracy]")
@SETS
@click.option("--axis", "axes", multiple=True, metavar="PATH=VALUE,...",
              help="Compare these values, of several axes every combination. [default: the solver's settings one at a time]")
@click.option("--runs", type=click.IntRange(1), default=40, show_default=True, help="Settings to compare, at most.")
@click.option("--budget", type=click.FloatRange(0, min_open=True), default=80.0, show_default=True,
              help="Processor seconds to spend on running; compiling comes on top.")
@click.option("--target-error", type=click.FloatRange(0, min_open=True), help="Name the cheapest setting with no larger error.")
@click.option("--overwrite", is_flag=True, help="Replace existing files.")
@AS_JSON
@QUIET
def accuracy(scene: Path, output: Path | None, sets: tuple[str, ...], axes: tuple[str, ...], runs: int, budget: float,
             target_error: float | None, overwrite: bool, as_json: bool, quiet: bool) -> None:
    """Show what accuracy costs in time: SCENE under many settings, against what is true of it."""
    from verlet_numba.scene.prepare import prepare

    prepared = prepare(scene, sets)
    folder = output or Path(default_name(prepared.scene, scene)).with_suffix(".accuracy")
    if folder.exists() and not (folder.is_dir() and (overwrite or not any(folder.iterdir()))):
        raise Misuse(f"{folder} exists already; give another with -o, or --overwrite")

    from verlet_numba.study import accuracy_report as report
    from verlet_numba.study.accuracy import study
    from verlet_numba.study.axes import AxisError, parse

    try:
        chosen = parse(axes)
        folder.mkdir(parents=True, exist_ok=True)           # before the work, not after it
        found = study(prepared.loaded, sets, chosen, runs, budget, (lambda text: None) if quiet else say)
    except AxisError as error:
        raise Misuse(str(error)) from error
    report.write(found, folder)
    best = found.cheapest(target_error) if target_error is not None else None
    if as_json:
        print_json(report.as_dict(found) | {"cheapest": None if best is None else report.finite(report.of_point(best))})
    elif not quiet:
        click.echo("\n".join(report.table(found)))
        click.echo(f"written: {folder}/accuracy.csv, .json, .png")
    if best is not None and not as_json:
        click.echo(report.solver_yaml(best, prepared.scene.solver.model_dump(exclude_unset=True)))
    if target_error is not None and best is None:
        say(f"no setting of these is known to have an error of at most {target_error:g} {found.unit}")
        raise SystemExit(FAILED)


@click.command()
@click.argument("places", type=click.Path(path_type=Path), nargs=-1, metavar="[SCENE_OR_FOLDER]...")
@AS_JSON
@QUIET
def verify(places: tuple[Path, ...], as_json: bool, quiet: bool) -> None:
    """Run scenes that state what they `expect` (default: the installed ones) and hold them to it; exit 1 if one fails."""
    from verlet_numba.run.signals import StopSignals
    from verlet_numba.scene.installed import installed
    from verlet_numba.study.verify import prepare_all, run_case, scenes_in

    files = scenes_in(places or installed())
    if not files:
        raise Misuse(f"there is no scene in {', '.join(map(str, places))}")
    scenes = prepare_all(files)
    for scene in scenes:
        if not scene.scene.expect and Path(scene.loaded.source.name) in places:
            raise Misuse(f"{scene.loaded.source.name} states nothing under `expect`")
    judged = [scene for scene in scenes if scene.scene.expect]
    if not judged:
        raise Misuse(f"none of {counted(len(scenes), 'scene')} in {', '.join(map(str, places))} states anything under `expect`, "
                     "such as `expect: [{measure: penetration_max, max: 0.01}]`")
    cases: list[Any] = []
    stopped = None
    with StopSignals() as signals:
        while len(cases) < len(judged) and not stopped:
            cases.append(run_case(judged[len(cases)], quiet=quiet or as_json))
            if not as_json:
                click.echo("\n".join(cases[-1].lines()))
            stopped = cases[-1].signal or signals.number
    failed, skipped = [case.scene for case in cases if not case.held], len(scenes) - len(judged)
    left = len(judged) - len(cases)
    if as_json:
        print_json({"cases": [case.as_dict() for case in cases], "failed": len(failed), "skipped": skipped, "not_run": left})
    else:
        click.echo(f"{counted(len(cases), 'case')}, {len(cases) - len(failed)} held"
                   + (f", {skipped} skipped, which expect nothing" if skipped else "")
                   + (f", failed: {', '.join(failed)}" if failed else ""))
    if stopped:
        say(f"stopped by a signal; {counted(left, 'scene')} not run")
        raise SystemExit(128 + stopped)
    if failed:
        raise SystemExit(FAILED)
