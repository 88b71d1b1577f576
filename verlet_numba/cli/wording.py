"""What commands say: on stdout what was asked for, on stderr everything else."""

import json
from collections.abc import Iterable
from typing import Any

import click


def say(text: str) -> None:
    click.echo(text, err=True)


def warn(warnings: Iterable[Any], quiet: bool) -> None:
    for warning in () if quiet else warnings:
        say(str(warning._replace(message=f"warning: {warning.message}")))


def print_json(document: Any) -> None:
    click.echo(json.dumps(document, indent=2, allow_nan=False))


def counted(number: int, noun: str) -> str:
    """`1 frame`, `2 frames`."""
    return f"{number:,} {noun}" + ("" if number == 1 else "s")


def describe(summary: Any) -> str:
    """A summary in lines of name and value."""
    seconds = ", ".join(f"{name} {value:.3f} s" for name, value in summary.seconds.items())
    status = f"{summary.status}{' but come apart' if summary.torn else ''}"
    return "\n".join([
        f"{summary.output}: {status}, {counted(summary.frames, 'frame')}, {summary.simulated_seconds:.6g} s simulated",
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
    sizes = ", ".join(counted(found[key], noun) for key, noun in (
        ("particles", "particle"), ("distance_constraints", "stick"), ("frames", "frame")))
    yield f"{sizes} of {counted(found['substeps_a_frame'], 'substep')} of {found['step_seconds']:.3g} s"
    yield "phases:"
    wide = max(len(phase["name"]) for phase in found["phases"]) + 2
    for phase in found["phases"]:
        yield f"  {'active' if phase['active'] else 'absent'}  {phase['name']:<{wide}}{phase['why']}"
    yield "groups:"
    for group in found["groups"]:
        yield (f"  {group['copies']} x {group['kind']} of {counted(group['particles_a_copy'], 'particle')}, "
               f"{group['copies_a_block']} a block: {group['lanes']}")
    yield "buffers:"
    for name, size in found["buffers"].items():
        yield f"  {size / 1e6:10.3f} MB  {name}"
    yield f"memory: about {found['memory_bytes'] / 1e6:.0f} MB"
    yield f"file: at most {found['file_bytes_at_most'] / 1e6:.2f} MB, less as it compresses"
