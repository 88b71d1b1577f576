"""The command line: parse, call, print. Heavy imports stand in the commands that need them, so that --help is quick."""

import json as json_module
import re
import shlex
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

import click

from verlet_numba import __version__

FAILED, WRONG, DIVERGED, INTERRUPTED = 1, 2, 3, 130
SCENE = click.argument("scene", type=click.Path(path_type=Path))
SETS = click.option("--set", "sets", multiple=True, metavar="PATH=VALUE", help="Override a key, e.g. solver.substeps=16.")
AS_JSON = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")
OVERWRITE = click.option("--overwrite", is_flag=True, help="Replace an existing file.")
QUIET = click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings, no summary.")
VERBOSE = click.option("-v", "--verbose", is_flag=True, help="Say more about what is done.")


class Misuse(click.ClickException):
    """Wrong usage that the words of the command line alone do not show."""

    exit_code = WRONG


def show_version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        from importlib.metadata import version

        from verlet_numba.run.layout import FORMAT
        click.echo(f"verlet-numba {__version__}, file format {FORMAT}, numba {version('numba')}")
        context.exit()


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--version", is_flag=True, callback=show_version, expose_value=False, is_eager=True,
              help="Versions of the program, of its files and of Numba.")
@click.option("--debug", is_flag=True, help="Show the traceback of an error; may also stand behind the command.")
def cli(debug: bool) -> None:
    """Position-based (Verlet) simulation of ropes, cloth and rigid bodies: YAML scenes in, HDF5 trajectories out."""


@cli.command()
@SCENE
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Trajectory file. [default: NAME.vtkhdf]")
@SETS
@click.option("--frames", "count", type=click.IntRange(0), help="Frames after frame 0, instead of the scene's duration.")
@click.option("--threads", type=click.IntRange(1), default=2, show_default=True,
              help="Threads: the results are the same. From 2 on, frames are written beside, and many bodies meet on several.")
@OVERWRITE
@AS_JSON
@QUIET
@VERBOSE
def run(scene: Path, output: Path | None, sets: tuple[str, ...], count: int | None, threads: int, overwrite: bool,
        as_json: bool, quiet: bool, verbose: bool) -> None:
    """Simulate SCENE and write its trajectory."""
    from verlet_numba.scene.prepare import prepare

    prepared = prepare(scene, sets)
    output = output or Path(default_name(prepared.scene, scene))
    refuse_existing(output, overwrite)
    warn(prepared.warnings, quiet)

    from verlet_numba.run.simulate import simulate

    if verbose:
        say(f"{scene}: {len(prepared.bodies)} bodies, writing {output}")
    command = shlex.join(["verlet-numba", *sys.argv[1:]])
    summary = simulate(prepared, output, count=count, command=command, overwrite=overwrite, threads=threads,
                       quiet=quiet)
    if as_json:
        print_json(summary.as_dict())
    elif not quiet:
        click.echo(describe(summary))
    if summary.divergence is not None:
        kept = f"{summary.frames} good frames are kept in {output}" if summary.frames else "No frame was good: no file was written"
        say(f"{scene}: {summary.divergence}. {kept}")
        raise SystemExit(DIVERGED)
    if summary.signal is not None:
        say(f"{scene}: stopped by a signal; {summary.frames} frames are kept in {output}")
        raise SystemExit(128 + summary.signal)


@cli.command()
@click.argument("scenes", type=click.Path(path_type=Path), nargs=-1, required=True)
@SETS
@QUIET
def check(scenes: tuple[Path, ...], sets: tuple[str, ...], quiet: bool) -> None:
    """Validate SCENES without simulating them; every error, and the scene doctor's warnings, with line and column."""
    from verlet_numba.scene.prepare import prepare
    from verlet_numba.scene.problems import SceneError

    wrong = False
    for scene in scenes:
        try:
            prepared = prepare(scene, sets)
        except SceneError as error:
            say(str(error))
            wrong = True
        else:
            warn(prepared.warnings, quiet)
            if not quiet:
                click.echo(f"{scene}: good" + (f", {len(prepared.warnings)} warnings" if prepared.warnings else ""))
    if wrong:
        raise SystemExit(WRONG)


@cli.command()
@SCENE
@SETS
@AS_JSON
def plan(scene: Path, sets: tuple[str, ...], as_json: bool) -> None:
    """Show which effects and phases SCENE has and why, its buffers, and the memory and file size to expect."""
    from verlet_numba.scene.build import build
    from verlet_numba.scene.plan import plan as make_plan
    from verlet_numba.scene.prepare import prepare

    prepared = prepare(scene, sets)
    found = make_plan(prepared, build(prepared.scene, prepared.bodies, prepared.loaded.folder))
    if as_json:
        print_json(found)
    else:
        click.echo("\n".join(describe_plan(found)))


@cli.command()
def schema() -> None:
    """Print the JSON Schema of scene files, with every default."""
    from verlet_numba.scene.load import json_schema

    print_json(json_schema())


@cli.command()
@click.argument("scenes", type=click.Path(path_type=Path), nargs=-1)
@QUIET
def warm(scenes: tuple[Path, ...], quiet: bool) -> None:
    """Compile what SCENES (default: those of the paper) need into the cache, without simulating."""
    from verlet_numba.run.warm import warm_up
    from verlet_numba.scene.installed import installed
    from verlet_numba.scene.prepare import prepare

    for scene in scenes or installed("paper"):
        seconds, cache = warm_up(prepare(scene))
        if not quiet:
            click.echo(f"{scene}: ready after {seconds:.1f} s, machine code in {cache}")


@cli.command()
@click.argument("trajectory", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="A .png contact sheet or a .gif.")
@click.option("--frames", help="Frames to show: numbers and ranges, e.g. 0,10,20 or 0:120:10.")
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


@cli.command()
@SCENE
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder of table and picture. [default: NAME.accuracy]")
@SETS
@click.option("--axis", "axes", multiple=True, metavar="PATH=VALUE,...",
              help="Compare these values, of several axes every combination. [default: the solver's settings one at a time]")
@click.option("--runs", type=click.IntRange(1), default=40, show_default=True, help="Settings to compare, at most.")
@click.option("--budget", type=click.FloatRange(0, min_open=True), default=80.0, show_default=True,
              help="Seconds to spend on running; compiling comes on top.")
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
    if folder.exists() and not overwrite:
        raise Misuse(f"{folder} exists already; give another with -o, or --overwrite")

    from verlet_numba.study import accuracy_report as report
    from verlet_numba.study.accuracy import study
    from verlet_numba.study.axes import AxisError, parse

    try:
        found = study(prepared.loaded, sets, parse(axes), runs, budget, (lambda text: None) if quiet else say)
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
        raise click.ClickException(f"no setting of these is known to have an error of at most {target_error:g} {found.unit}")


@cli.command()
@click.argument("places", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="FILE_OR_FOLDER...")
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

    for output in (csv_file, picture):
        if output is not None:
            refuse_existing(output, overwrite)
    if picture is not None and picture.suffix.lower() not in study.PICTURES:
        raise Misuse(f"{picture}: cannot draw {picture.suffix or 'a file without suffix'}; use {', '.join(study.PICTURES)}")
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


@cli.command()
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
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
    click.echo(f"no difference in {frames} frames" + (f" by more than {tolerance:g} m" if tolerance else ""))


@cli.command()
@click.argument("places", type=click.Path(path_type=Path), nargs=-1, metavar="[SCENE_OR_FOLDER]...")
@AS_JSON
@QUIET
def verify(places: tuple[Path, ...], as_json: bool, quiet: bool) -> None:
    """Run scenes that state what they `expect` (default: the installed ones) and hold them to it; exit 1 if one fails."""
    from verlet_numba.scene.installed import installed
    from verlet_numba.study.verify import prepare_all, run_case, scenes_in

    files = scenes_in(places or installed())
    if not files:
        raise Misuse(f"there is no scene in {', '.join(map(str, places))}")
    scenes = prepare_all(files)
    for scene in scenes:
        if not scene.scene.expect and Path(scene.loaded.source.name) in places:
            raise Misuse(f"{scene.loaded.source.name} states nothing under `expect`")
    cases = []
    for scene in scenes:
        if scene.scene.expect:
            cases.append(run_case(scene, quiet=quiet or as_json))
            if not as_json:
                click.echo("\n".join(cases[-1].lines()))
            if cases[-1].signal is not None:
                raise SystemExit(128 + cases[-1].signal)
    failed = [case.scene for case in cases if not case.held]
    if as_json:
        print_json({"cases": [case.as_dict() for case in cases], "failed": len(failed)})
    else:
        click.echo(f"{len(cases)} cases, {len(cases) - len(failed)} held" + (f", failed: {', '.join(failed)}" if failed else ""))
    if failed:
        raise SystemExit(FAILED)


def chosen(frames: str | None) -> list[int | slice] | None:
    """Numbers and ranges FIRST:END:STEP (END not included), separated by commas; negative ones count from the end."""
    if frames is None:
        return None
    numbers: list[int | slice] = []
    for part in frames.split(","):
        if not re.fullmatch(r"\s*(-?\d{1,18}|-?\d{0,18}:-?\d{0,18}(:[1-9]\d{0,17})?)\s*", part):
            raise click.BadParameter(f"{part!r} is neither a frame nor a range FIRST:END:STEP", param_hint="--frames")
        bounds = [int(word) if word.strip() else None for word in part.split(":")]
        numbers.append(int(part) if len(bounds) == 1 else slice(*bounds))
    return numbers


def default_name(scene: Any, path: Path) -> str:
    """NAME.vtkhdf in the working folder: the scene's name, or the file's where it has none."""
    name = re.sub(r"[^\w.+-]+", "_", scene.name).strip("._") if "name" in scene.model_fields_set else ""
    return f"{name or path.stem}.vtkhdf"


def refuse_existing(output: Path, overwrite: bool) -> None:
    """Before any work: nothing that exists is overwritten unasked, and the folder must be there."""
    if output.exists() and not overwrite:
        raise Misuse(f"{output} exists already; give another with -o, or --overwrite")
    if output.is_dir():
        raise Misuse(f"{output} is a folder; name a file with -o")
    if not output.parent.is_dir():
        raise Misuse(f"{output.parent} is no folder; make it first, or give another with -o")


def say(text: str) -> None:
    click.echo(text, err=True)


def warn(warnings: Iterable[Any], quiet: bool) -> None:
    for warning in () if quiet else warnings:
        say(str(warning._replace(message=f"warning: {warning.message}")))


def print_json(document: Any) -> None:
    click.echo(json_module.dumps(document, indent=2, allow_nan=False))


def describe(summary: Any) -> str:
    """A summary in lines of name and value."""
    seconds = ", ".join(f"{name} {value:.3f} s" for name, value in summary.seconds.items())
    return "\n".join([
        f"{summary.output}: {summary.status}, {summary.frames} frames, {summary.simulated_seconds:.6g} s simulated",
        f"  speed             {summary.steps_per_second:,.0f} steps/s, {summary.real_time_factor:,.1f} times real time",
        f"  relaxations       {summary.relaxations:,}",
        f"  contacts          {summary.contacts} at most",
        f"  constraint error  {summary.constraint_error_max:.3g} of a length at most" + stretched(summary.constraint_error_max),
        f"  penetration       {summary.penetration_max:.3g} m at most",
        f"  time              {seconds}"])


def stretched(error: float) -> str:
    """A word on sticks that are far off their lengths."""
    return ": sticks stretch; more substeps keep them stiffer, or they are compliant" if error > 0.05 else ""


def describe_plan(found: dict[str, Any]) -> Iterable[str]:
    """A plan in lines: phases, groups, buffers, sizes."""
    yield (f"{found['particles']} particles, {found['distance_constraints']} sticks, {found['frames']} frames of "
           f"{found['substeps_a_frame']} substeps of {found['step_seconds']:.3g} s")
    yield "phases:"
    for phase in found["phases"]:
        yield f"  {'active' if phase['active'] else 'absent'}  {phase['name']:<26}{phase['why']}"
    yield "groups:"
    for group in found["groups"]:
        yield (f"  {group['copies']} x {group['kind']} of {group['particles_a_copy']} particles, "
               f"{group['copies_a_block']} a block: {group['lanes']}")
    yield "buffers:"
    for name, size in found["buffers"].items():
        yield f"  {size / 1e6:10.3f} MB  {name}"
    yield f"memory: about {found['memory_bytes'] / 1e6:.0f} MB"
    yield f"file: at most {found['file_bytes_at_most'] / 1e6:.2f} MB, less as it compresses"


def fail(error: BaseException, code: int, text: str) -> NoReturn:
    """End with one message; with --debug, after the traceback."""
    if "--debug" in sys.argv:
        traceback.print_exception(error)
    say(text)
    sys.exit(code)


def main() -> None:
    """Run the command line; every error ends in a message and the contract's exit code."""
    from verlet_numba.scene.problems import SceneError

    arguments = [word for word in sys.argv[1:] if word != "--debug"]
    try:
        cli.main(arguments, prog_name="verlet-numba", standalone_mode=False)
    except SceneError as error:
        fail(error, WRONG, str(error))
    except click.UsageError as error:
        error.show()
        sys.exit(WRONG)
    except click.ClickException as error:
        fail(error, error.exit_code, f"verlet-numba: {error.format_message()}")
    except (click.Abort, KeyboardInterrupt) as error:
        fail(error, INTERRUPTED, "verlet-numba: interrupted")
    except MemoryError as error:
        fail(error, FAILED, "verlet-numba: out of memory; `verlet-numba plan` tells how much a scene needs")
    except Exception as error:
        fail(error, FAILED, f"verlet-numba: {one_line(error)}")


def one_line(error: Exception) -> str:
    """An error without its traceback, in one line. Those of the program and of the system need no name of their class."""
    words = " ".join(str(error).split())
    plain = isinstance(error, OSError | ValueError) or type(error).__module__.startswith("verlet_numba.")
    return words if plain and words else f"{type(error).__name__}: {words}"
