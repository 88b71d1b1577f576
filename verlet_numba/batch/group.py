"""The seam between sweeps and the simulation: a group of runs of equal topology and solver settings is advanced here.

The planner promises that the scenes of a group differ in decimal numbers and the seed alone (`planning.group_of`), so they can
be laid side by side as one simulation. At present they are simulated one after the other and share compiled code and the blank
of their files. Whoever simulates them together changes `advance_group` and nothing else: it may begin all of its runs at once,
and hands each over when it ends.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from verlet_numba.run.simulate import Summary, simulate
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
    A trajectory that is there already is redone from its start. A job that fails takes no other with it. After a signal the
    summary at hand says so, and no more jobs are begun.
    """
    for job in jobs:
        begin(job.id)
        try:
            summary = simulate(prepared(job.loaded), job.output, command=job.command, overwrite=True, threads=1, quiet=True)
        except Exception as error:      # whatever is wrong with one run is that run's failure
            yield job, error
        else:
            yield job, summary
            if summary.signal is not None:
                return


def prepared(loaded: Loaded) -> Prepared:
    """A scene with its bodies in their places, without the doctor's warnings."""
    return Prepared(loaded, place(loaded.scene, loaded.folder, loaded.source), [])
