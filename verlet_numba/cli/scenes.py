"""`check`, `plan`, `schema`, `warm`: scenes without simulating them."""

from pathlib import Path

import click

from verlet_numba.cli.options import AS_JSON, QUIET, SCENE, SETS, WRONG
from verlet_numba.cli.wording import counted, describe_plan, print_json, say, warn


@click.command()
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
                click.echo(f"{scene}: good" + (f", {counted(len(prepared.warnings), 'warning')}" if prepared.warnings else ""))
    if wrong:
        raise SystemExit(WRONG)


@click.command()
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


@click.command()
def schema() -> None:
    """Print the JSON Schema of scene files, with every default."""
    from verlet_numba.scene.load import json_schema

    print_json(json_schema())


@click.command()
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
