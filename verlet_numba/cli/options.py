"""What commands share: exit codes, options, and what is refused before any work."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

FAILED, WRONG, DIVERGED, RUNS_FAILED, OUT_OF_TIME, INTERRUPTED, TERMINATED = 1, 2, 3, 4, 5, 130, 143
SCENE = click.argument("scene", type=click.Path(path_type=Path))
EXISTING = click.Path(exists=True, path_type=Path)
SETS = click.option("--set", "sets", multiple=True, metavar="PATH=VALUE", help="Override a key, e.g. solver.substeps=16.")
AS_JSON = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")
TRAJECTORY = click.argument("trajectory", type=EXISTING)
FRAMES = click.option("--frames", help="Frames to take: numbers and ranges, e.g. 0,10,20 or 0:120:10.")
OVERWRITE = click.option("--overwrite", is_flag=True, help="Replace an existing file.")
QUIET = click.option("-q", "--quiet", is_flag=True, help="No progress, no warnings, no summary.")
VERBOSE = click.option("-v", "--verbose", is_flag=True, help="Say more about what is done.")


class Misuse(click.ClickException):
    """Wrong usage that the words of the command line alone do not show."""

    exit_code = WRONG


def parse_shard(context: click.Context, parameter: click.Parameter, text: str) -> tuple[int, int]:
    """I/N as two numbers."""
    found = re.fullmatch(r"([1-9]\d{0,8})/([1-9]\d{0,8})", text)
    if not found or int(found[1]) > int(found[2]):
        raise click.BadParameter(f"{text!r}: write I/N, the I-th of N parts, such as 1/4", context, parameter)
    return int(found[1]), int(found[2])


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


def refuse_existing(output: Path, overwrite: bool, ways: str = "give another with -o, or --overwrite") -> None:
    """Before any work: nothing that exists is overwritten unasked, and the folder must be there."""
    if output.exists() and not overwrite:
        raise Misuse(f"{output} exists already; {ways}")
    if output.is_dir():
        raise Misuse(f"{output} is a folder; name a file with -o")
    if not output.parent.is_dir():
        raise Misuse(f"{output.parent} is no folder; make it first, or give another with -o")


def refuse_format(picture: Path, known: Iterable[str]) -> None:
    if picture.suffix.lower() not in known:
        raise Misuse(f"{picture}: cannot draw {picture.suffix or 'a file without suffix'}; use {', '.join(known)}")
