"""`run` and `sweep`: one run, many runs. Heavy imports stand in the commands that need them, so that --help is quick."""

import shlex
import sys
import time
from pathlib import Path
from typing import Any

import click

from verlet_numba.cli.options import (
    AS_JSON,
    DIVERGED,
    OUT_OF_TIME,
    OVERWRITE,
    QUIET,
    RUNS_FAILED,
    SCENE,
    SETS,
    VERBOSE,
    Misuse,
    default_name,
    parse_shard,
    refuse_existing,
    refuse_format,
)
from verlet_numba.cli.wording import counted, describe, print_json, say, warn


@click.command()
@SCENE
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Trajectory file. [default: NAME.vtkhdf]")
@SETS
@click.option("--frames", "count", type=click.IntRange(0), help="Frames after frame 0, instead of the scene's duration.")
@click.option("--threads", type=click.IntRange(1), default=2, show_default=True,
              help="Threads: the results are the same. From 2 on, frames are written beside, and many bodies meet on several.")
@click.option("--resume", is_flag=True, help="Go on with a trajectory that was begun; start if there is none.")
@click.option("--max-time", type=click.FloatRange(0, min_open=True), metavar="S",
              help="Stop after S seconds of wall time, for --resume to go on; exit code 5.")
@OVERWRITE
@AS_JSON
@QUIET
@VERBOSE
def run(scene: Path, output: Path | None, sets: tuple[str, ...], count: int | None, threads: int, resume: bool,
        max_time: float | None, overwrite: bool, as_json: bool, quiet: bool, verbose: bool) -> None:
    """Simulate SCENE and write its trajectory."""
    clock = time.perf_counter()
    if resume and overwrite:
        raise Misuse("--resume goes on with a file and --overwrite replaces it; give one of them")
    from verlet_numba.scene.prepare import prepare

    prepared = prepare(scene, sets)
    output = output or Path(default_name(prepared.scene, scene))
    refuse_existing(output, overwrite or resume, "give another with -o, go on with it by --resume, or --overwrite")
    warn(prepared.warnings, quiet)

    from verlet_numba.run.resume import ResumeError
    from verlet_numba.run.simulate import simulate

    if verbose:
        say(f"{scene}: {len(prepared.bodies)} bodies, writing {output}")
    command = shlex.join(["verlet-numba", *sys.argv[1:]])
    left = None if max_time is None else max_time - (time.perf_counter() - clock)
    try:
        summary = simulate(prepared, output, count=count, command=command, overwrite=overwrite, resume=resume, threads=threads,
                           max_time=left, quiet=quiet)
    except ResumeError as error:
        raise Misuse(str(error)) from error
    if as_json:
        print_json(summary.as_dict())
    elif not quiet:
        click.echo(describe(summary))
    finish(summary, scene, quiet)


def finish(summary: Any, scene: Path, quiet: bool) -> None:
    """Tell why a run has not come to its end, and leave with the exit code that says so."""
    kept = f"{counted(summary.frames, 'frame')} kept in {summary.output}"
    if summary.torn and not quiet:
        say(f"{scene}: warning: a stick ends {summary.constraint_error_end:.3g} of its length off it: what it belongs to has come "
            "apart and its frames mean nothing, unless it is compliant or cannot have its length; use more substeps")
    if summary.status == "diverged":
        again = f"diverged in an earlier run of {summary.output}; change the scene, then --overwrite"
        good = f"{counted(summary.frames, 'good frame')} kept in {summary.output}" if summary.frames else "no file was written"
        say(f"{scene}: {summary.divergence or again}. {good[0].upper() + good[1:]}")
        raise SystemExit(DIVERGED)
    if summary.status == "stopped":
        cause = "by a signal" if summary.signal else "by --max-time"
        say(f"{scene}: stopped {cause}" + (f"; {kept}, and --resume goes on" if summary.frames else " before the first frame"))
        raise SystemExit(128 + summary.signal if summary.signal else OUT_OF_TIME)
    if summary.resumed_at == summary.frames:
        say(f"{scene}: {summary.output} is complete already")


@click.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="SWEEP_OR_SCENE")
@click.option("--vary", multiple=True, metavar="PATH=SPEC", help="A key to vary: values 1,2,3, a range 0.1:0.9, or 0.1:10:log.")
@SETS
@click.option("--method", type=click.Choice(["grid", "zip", "random", "lhs", "sobol"]),
              help="How values come together. [default: lhs where there is a range, else grid]")
@click.option("--samples", type=click.IntRange(1), help="Runs of random, lhs, sobol; steps of a range in grid and zip.")
@click.option("--seed", type=click.IntRange(0), help="Of random, lhs and sobol. [default: 0]")
@click.option("--measure", "measures", multiple=True, metavar="NAME", help="A column of the table, as speed_max or speed_max.last.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder of the sweep. [default: NAME.sweep]")
@click.option("--jobs", type=click.IntRange(1), help="Processes that simulate. [default: one a core]")
@click.option("--cluster", metavar="ADDRESS", help="Run on a Dask cluster, tcp://..., or on one made here: local.")
@click.option("--resume", is_flag=True, help="Run what is missing in the folder; what it has is kept.")
@click.option("--dry-run", is_flag=True, help="Show the runs, and run nothing.")
@click.option("--shard", default="1/1", metavar="I/N", callback=parse_shard, help="The I-th of N parts, counted from 1.")
@click.option("--plot", "picture", type=click.Path(path_type=Path), help="Draw effects and measures to this .png, .svg or .pdf.")
@AS_JSON
@QUIET
def sweep(file: Path, vary: tuple[str, ...], sets: tuple[str, ...], method: str | None, samples: int | None, seed: int | None,
          measures: tuple[str, ...], output: Path | None, jobs: int | None, cluster: str | None, resume: bool, dry_run: bool,
          shard: tuple[int, int], picture: Path | None, as_json: bool, quiet: bool) -> None:
    """Run SWEEP.yaml, or SCENE.yaml with what --vary names: many runs, one table."""
    from verlet_numba.batch.document import read_document
    from verlet_numba.batch.outlook import Outlook
    from verlet_numba.batch.planning import plan as make_plan
    from verlet_numba.batch.sweep import Engine, RefusedError, run_sweep
    from verlet_numba.study import sweep_picture

    if picture is not None:
        refuse_existing(picture, resume)
        refuse_format(picture, sweep_picture.PICTURES)
    options = {"method": method, "samples": samples, "seed": seed, "measures": list(measures)}
    plan = make_plan(read_document(file, vary, sets, options))
    folder = output or Path(f"{file.stem}.sweep")
    if dry_run:
        outlook = Outlook(plan, folder, shard)
        if as_json:
            print_json(outlook.as_dict())
        else:
            click.echo("\n".join(outlook.lines()))
        return
    try:
        ended = run_sweep(plan, folder, Engine(jobs, cluster or ""), shard, resume, quiet)
    except RefusedError as error:
        raise Misuse(str(error)) from error
    if picture is not None and ended.table is not None:
        sweep_picture.draw(ended.table, picture)
    if as_json:
        print_json(ended.as_dict())
    elif not quiet:
        click.echo("\n".join(ended.lines()))
    for line in ended.troubles():
        say(line)
    if ended.signal is not None:
        raise SystemExit(128 + ended.signal)
    if ended.failed:
        raise SystemExit(RUNS_FAILED)
