"""The command line: parse, call, print. Every error ends in a message and the exit code of its kind."""

import signal
import sys
import traceback
from typing import NoReturn

import click

from verlet_numba._version import __version__
from verlet_numba.cli import scenes, simulate, studies, trajectories
from verlet_numba.cli.options import FAILED, INTERRUPTED, TERMINATED, WRONG
from verlet_numba.cli.wording import print_json, say


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


for command in (simulate.run, simulate.sweep, scenes.check, scenes.plan, scenes.schema, scenes.warm, studies.accuracy,
                studies.verify, trajectories.analyze, trajectories.compare, trajectories.render, trajectories.view,
                trajectories.export):
    cli.add_command(command)


def fail(error: BaseException, code: int, text: str) -> NoReturn:
    """End with one message; with --debug after the traceback, with --json as a document too."""
    if "--debug" in sys.argv:
        traceback.print_exception(error)
    if isinstance(error, click.UsageError):
        error.show()
    else:
        say(text)
    if "--json" in sys.argv:
        problems = [problem._asdict() for problem in getattr(error, "problems", ())]
        print_json({"status": "failed", "exit_code": code, "error": text} | ({"problems": problems} if problems else {}))
    sys.exit(code)


def main() -> None:
    """Run the command line; every error ends in a message and the contract's exit code."""
    from verlet_numba.scene.problems import SceneError, one_line

    arguments = [word for word in sys.argv[1:] if word != "--debug"]
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(TERMINATED))       # else Python would run no `finally`
    try:
        cli.main(arguments, prog_name="verlet-numba", standalone_mode=False)
    except SceneError as error:
        fail(error, WRONG, str(error))
    except click.UsageError as error:
        fail(error, WRONG, error.format_message())
    except click.ClickException as error:
        fail(error, error.exit_code, f"verlet-numba: {error.format_message()}")
    except (click.Abort, KeyboardInterrupt) as error:
        fail(error, INTERRUPTED, "verlet-numba: interrupted")
    except MemoryError as error:
        fail(error, FAILED, "verlet-numba: out of memory; `verlet-numba plan` tells how much a scene needs")
    except Exception as error:
        fail(error, FAILED, f"verlet-numba: {one_line(error)}")
