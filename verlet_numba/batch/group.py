"""The seam between sweeps and the simulation: a group of runs of equal topology and solver settings is advanced here.

The planner promises that the scenes of a group differ in decimal numbers and the seed alone (`planning.group_of`). Those that
may be are simulated side by side, as the instances of one world (run/ensemble.py); a run that has to be alone has checkpoints,
and goes on where a killed worker left it. Both write the same files.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from verlet_numba.run.engine import start, warm
from verlet_numba.run.ensemble import Instance, blocks, model_alone, model_of, simulate_block
from verlet_numba.run.resume import ResumeError, find
from verlet_numba.run.signals import StopSignals
from verlet_numba.run.simulate import Summary, simulate
from verlet_numba.run.summary import BROKEN, COMPLETE, STOPPED
from verlet_numba.run.trajectory import DifferenceError
from verlet_numba.scene.load import Loaded
from verlet_numba.scene.place import place
from verlet_numba.scene.prepare import Prepared


@dataclass(frozen=True, eq=False)
class Job:
    """A run to be simulated: its scene, the trajectory to write, and the command that would make it alone."""

    id: str
    loaded: Loaded
    output: Path
    command: str


def advance_group(jobs: Sequence[Job], begin: Callable[[str], None]) -> Iterator[tuple[Job, Summary | Exception]]:
    """Simulate every job to its end: yields each with its summary, or with what it raised, as soon as it has ended.

    `begin(id)` is called before anything is done for a job: if this process dies, those begun and not yielded are to blame.
    A job that fails takes no other with it. After a signal the summaries at hand say so, and no more are simulated.
    """
    instances = []
    for number, job in enumerate(jobs):
        begin(job.id)
        try:
            ready = prepared(job.loaded)
            instances.append(Instance(number, ready, job.output, job.command, model_alone(ready)))
        except Exception as error:      # whatever is wrong with one run is that run's failure
            yield job, error
    for block in blocks(instances):
        outcomes = [alone(block[0])] if len(block) == 1 else together(block)
        yield from ((jobs[member.number], outcome) for member, outcome in zip(block, outcomes, strict=True))
        if any(isinstance(outcome, Summary) and outcome.signal is not None for outcome in outcomes):
            return


def warm_group(jobs: Sequence[Job]) -> None:
    """Make or load the machine code of what `advance_group` will simulate: of a run alone, and of several side by side."""
    scenes = [prepared(job.loaded) for job in jobs]
    members = [Instance(k, scene, job.output, job.command, model_alone(scene))
               for k, (job, scene) in enumerate(zip(jobs, scenes, strict=True))]
    for block in {len(block) > 1: block for block in blocks(members)}.values():
        warm(start(model_of(block)))


def together(block: list[Instance]) -> list[Summary | Exception]:
    """Simulate the instances of one world, from their start; one by one if anything goes wrong with all of them."""
    with StopSignals() as signals:
        try:
            simulate_block(block, signals.stop, overwrite=True)
        except Exception:
            return [alone(member) for member in block]
    for member in block:
        if member.summary.status == STOPPED:
            member.summary.signal = signals.number
    return [member.failure or member.summary for member in block]


def alone(instance: Instance) -> Summary | Exception:
    """Simulate a run by itself, from where a worker before left it if there is such a place.

    A trajectory that is whole but has no result is made anew: who knows which program it is of.
    """
    ready, output, command = instance.prepared, instance.output, instance.command
    begun = unfinished(output)
    try:
        try:
            return simulate(ready, output, command=command, overwrite=not begun, resume=begun, threads=1, quiet=True)
        except (ResumeError, DifferenceError):          # the program has changed since
            return simulate(ready, output, command=command, overwrite=True, threads=1, quiet=True)
    except Exception as error:
        return error


def unfinished(output: Path) -> bool:
    """Whether a worker before has begun this trajectory and not ended it."""
    try:
        return output.exists() and find(output).status not in (COMPLETE, BROKEN)
    except ResumeError:
        return False


def prepared(loaded: Loaded) -> Prepared:
    """A scene with its bodies in their places, without the doctor's warnings."""
    return Prepared(loaded, place(loaded.scene, loaded.folder, loaded.source), [])
