"""`analyze`, `compare`, `render`, `view`, `export`: trajectories from their files alone."""

from pathlib import Path

import click

from verlet_numba.cli.options import (
    AS_JSON,
    EXISTING,
    FAILED,
    FRAMES,
    OVERWRITE,
    QUIET,
    TRAJECTORY,
    Misuse,
    chosen,
    refuse_existing,
    refuse_format,
)
from verlet_numba.cli.wording import counted, print_json, say


@click.command()
@click.argument("places", type=EXISTING, nargs=-1, required=True, metavar="FILE_OR_FOLDER...")
@click.option("--measure", "names", multiple=True, metavar="NAME",
              help="A measure to take; may be repeated. [default: all but self_intersections]")
@click.option("--body", metavar="NAME", help="Measure this body alone, all copies, or the copy NAME.K.")
@click.option("--recompute", is_flag=True, help="From positions alone, not what the run recorded.")
@AS_JSON
@click.option("--csv", "csv_file", type=click.Path(path_type=Path), help="Write every frame's measures to this file.")
@click.option("--plot", "picture", type=click.Path(path_type=Path), help="Draw their course to this .png, .svg or .pdf.")
@OVERWRITE
def analyze(places: tuple[Path, ...], names: tuple[str, ...], body: str | None, recompute: bool, as_json: bool,
            csv_file: Path | None, picture: Path | None, overwrite: bool) -> None:
    """Measure trajectories, side by side, from their files alone: energies, momenta, errors, penetration, rest ..."""
    from verlet_numba.study import analyze as study
    from verlet_numba.study.sweep_folder import is_sweep

    for output in (csv_file, picture):
        if output is not None:
            refuse_existing(output, overwrite)
    if picture is not None:
        refuse_format(picture, study.PICTURES)
    if any(map(is_sweep, places)):
        analyze_sweeps(places, names, body, recompute, as_json, csv_file, picture)
        return
    try:
        found = [study.analyze(file, names, body, recorded=not recompute) for file in study.trajectories(places)]
    except study.MeasureError as error:
        raise Misuse(str(error)) from error
    if csv_file is not None:
        study.write_csv(found, csv_file)
    if picture is not None:
        study.plot(found, picture)
    if as_json:
        print_json({"files": [each.as_dict() for each in found]})
    else:
        click.echo("\n".join(study.table(found)))


def analyze_sweeps(folders: tuple[Path, ...], names: tuple[str, ...], body: str | None, recompute: bool, as_json: bool,
                   csv_file: Path | None, picture: Path | None) -> None:
    """Tables of sweeps; measures are taken of the trajectories anew where any are named."""
    from verlet_numba.study import sweep_folder, sweep_picture
    from verlet_numba.study.measures import MeasureError

    if not all(map(sweep_folder.is_sweep, folders)):
        raise Misuse("folders of sweeps and trajectory files cannot be told side by side; name one kind")
    if len(folders) > 1 and (csv_file or picture):
        raise Misuse("--csv and --plot take one sweep")
    found = [sweep_folder.table(folder) for folder in folders]
    if names or body or recompute:
        try:
            found = [sweep_folder.measured(each, names or sweep_folder.read_plan(each.folder)["measures"], body, not recompute)
                     for each in found]
        except MeasureError as error:
            raise Misuse(str(error)) from error
    if csv_file is not None:
        sweep_folder.write_table(found[0], csv_file)
    if picture is not None:
        sweep_picture.draw(found[0], picture)
    if as_json:
        print_json({"sweeps": [each.as_dict() for each in found]})
    else:
        click.echo("\n".join(line for each in found for line in sweep_folder.lines(each)))


@click.command()
@click.argument("a", type=EXISTING)
@click.argument("b", type=EXISTING)
@click.option("--tolerance", type=click.FloatRange(0), default=0.0, show_default=True, help="Differences up to this are none, m.")
def compare(a: Path, b: Path, tolerance: float) -> None:
    """Find the first frame, body and particle where trajectories A and B differ; exit 0 if there is none, 1 if there is one."""
    from verlet_numba.study import reader
    from verlet_numba.study.compare import compare as differ

    with reader.open(a) as one, reader.open(b) as other:
        difference = differ(one, other, tolerance)
        frames = one.frames
    if difference is not None:
        click.echo(str(difference))
        raise SystemExit(FAILED)
    click.echo(f"no difference in {counted(frames, 'frame')}" + (f" by more than {tolerance:g} m" if tolerance else ""))


@click.command()
@TRAJECTORY
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="A .png contact sheet, a .gif or a .mp4.")
@FRAMES
@OVERWRITE
def render(trajectory: Path, output: Path, frames: str | None, overwrite: bool) -> None:
    """Draw TRAJECTORY without a display: a sheet of pictures or an animation."""
    refuse_existing(output, overwrite)
    from verlet_numba.study.render import RenderError
    from verlet_numba.study.render import render as draw

    try:
        draw(trajectory, output, frames=chosen(frames))
    except RenderError as error:
        raise Misuse(str(error)) from error


@click.command()
@TRAJECTORY
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="The page, a .html.")
@FRAMES
@click.option("--budget", type=click.FloatRange(0, min_open=True), default=24.0, show_default=True,
              help="MB of positions before compression, at most: frames are thinned evenly to fit.")
@OVERWRITE
@QUIET
def view(trajectory: Path, output: Path, frames: str | None, budget: float, overwrite: bool, quiet: bool) -> None:
    """Make one page that plays TRAJECTORY in a browser, by itself and offline."""
    refuse_existing(output, overwrite)
    from verlet_numba.study.render import RenderError
    from verlet_numba.study.view import view as make_page

    try:
        page = make_page(trajectory, output, chosen(frames), 1e6 * budget)
    except RenderError as error:
        raise Misuse(str(error)) from error
    if page.every > 1 and not quiet:
        say(f"{output}: {page.of} frames are more than {budget:g} MB of positions, so one in {page.every} is shown; "
            "choose others with --frames, or allow more with --budget")
    if not quiet:
        click.echo(f"{output}: {counted(page.frames, 'frame')}, {page.size / 1e6:.2f} MB, positions within {page.error:.2g} m")


@click.command()
@TRAJECTORY
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True,
              help="A .usdc, .usda or .pc2 with all frames; a .obj or .ply is one of a numbered sequence.")
@FRAMES
@OVERWRITE
@QUIET
def export(trajectory: Path, output: Path, frames: str | None, overwrite: bool, quiet: bool) -> None:
    """Write TRAJECTORY, or frames of it, in another format: USD, PC2, or a sequence of OBJ or PLY files."""
    from verlet_numba.study.export import SEQUENCES, ExportError
    from verlet_numba.study.export import export as write

    refuse_existing(output, overwrite or output.suffix.lower() in SEQUENCES)
    try:
        written = write(trajectory, output, chosen(frames), overwrite)
    except ExportError as error:
        raise Misuse(str(error)) from error
    if not quiet:
        click.echo(f"{written[0]}: written" if len(written) == 1 else f"{written[0]} to {written[-1]}: {len(written)} files")
