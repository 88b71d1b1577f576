"""A sweep from its plan to its table: what is missing is run, on this machine or on a cluster, and what is there is kept."""

import contextlib
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from verlet_numba.batch.planning import Plan, Run
from verlet_numba.batch.progress import Progress
from verlet_numba.run.lock import BusyError, Lock
from verlet_numba.run.signals import StopSignals
from verlet_numba.study import sweep_folder as disk
from verlet_numba.study.sweep_folder import COMPLETE, FAILED, KILLED, LASTING, PLAN, Result, SweepError

BATCH = 32              # runs given to a worker at once, at most
SUPPOSED = 16           # workers of a cluster
SHARE = 4               # batches of a group for each worker, at least, so that all end at about the same time


class RefusedError(SweepError):
    """A folder that a sweep may not write to."""


@dataclass
class Ended:
    """What became of a sweep, or of a shard of it."""

    plan: Plan
    runs: int                                       # of this sweep or shard
    kept: list[Result] = field(default_factory=list)        # were there already
    done: list[Result] = field(default_factory=list)
    seconds: float = 0.0
    signal: int | None = None
    table: disk.Table | None = None                 # of the whole sweep, as far as it is

    @property
    def failed(self) -> list[disk.Row]:
        values = {run.id: list(run.values) for run in self.plan.runs}
        return [disk.Row(values[result.id], result) for result in (*self.kept, *self.done) if result.status != COMPLETE]

    def as_dict(self) -> dict[str, Any]:
        assert self.table is not None
        return {"table": str(self.table.folder / disk.TABLE), "runs": self.runs, "kept": len(self.kept), "done": len(self.done),
                "failed": [{"id": row.result.id, "status": row.result.status, "reason": row.result.reason} for row in self.failed],
                "seconds": self.seconds, "signal": self.signal}

    def lines(self) -> Iterator[str]:
        """What was done, in words."""
        assert self.table is not None
        equal = self.plan.points - len(self.plan.runs)
        yield (f"{self.table.folder / disk.TABLE}: {len(self.table.rows)} of {self.table.planned} runs"
               + (f" ({equal} of {self.plan.points} points come to the same scene as others)" if equal > 0 else ""))
        kept = f", {len(self.kept)} were there already" if self.kept else ""
        yield f"  done {len(self.done)} in {self.seconds:.1f} s{kept}, failed {len(self.failed)}"
        yield from disk.ranges(self.table)

    def troubles(self) -> Iterator[str]:
        """What is not as it should be: runs that failed, results of another program, a signal."""
        yield from disk.failures(self.failed, self.plan.parameters)
        values = {run.id: list(run.values) for run in self.plan.runs}
        yield from disk.failures([disk.Row(values[result.id], result) for result in (*self.kept, *self.done)
                                  if result.status == COMPLETE and result.reason], self.plan.parameters)
        from verlet_numba.batch.work import program
        others = [result for result in self.kept if result.program != program()]
        if others:
            versions = ", ".join(sorted({result.program for result in others}))
            yield (f"{len(others)} results were made by another version of the program ({versions}) and are kept; "
                   f"remove their folders below runs/ to have them made anew by {program()}")
        if self.signal is not None:
            yield f"stopped by a signal; {self.runs - len(self.kept) - len(self.done)} runs are missing: --resume goes on"


@dataclass(frozen=True)
class Engine:
    """How runs are spread: processes here, or the workers of the Dask cluster at `address`."""

    wished: int | None = None       # processes
    address: str = ""

    @property
    def jobs(self) -> int:
        """Runs at a time; of a cluster elsewhere that many are supposed."""
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return self.wished or (SUPPOSED if "://" in self.address else cores)


def shard_of(plan: Plan, part: int, parts: int) -> list[Run]:
    """The runs of shard `part` of `parts`, counted from 1: every parts-th, so that all shards are about equally long."""
    return plan.runs[part - 1::parts]


def run_sweep(plan: Plan, folder: Path, engine: Engine, shard: tuple[int, int] = (1, 1), resume: bool = False,
              quiet: bool = False) -> Ended:
    """Run what is missing of a sweep or shard into its folder.

    Raises RefusedError for a folder that holds another sweep, or this one's runs without `resume`; SweepError if another
    process is at work in it; OSError if it cannot be written to.
    """
    runs = shard_of(plan, *shard)
    claim(plan, folder, runs, resume)
    clock = time.monotonic()
    with locked(folder, shard):
        kept = present(folder, runs)
        missing = [run for run in runs if run.id not in kept]
        ended = Ended(plan, len(runs), list(kept.values()))
        with StopSignals() as signals, Progress(len(runs), len(kept), quiet) as progress:
            for result in results(plan, folder, missing, engine, signals.stop, progress.say):
                ended.done.append(result)
                progress.add(result)
        ended.signal = signals.number if len(ended.done) < len(missing) else None
        ended.table = disk.write_tables(folder, plan.as_dict())
    ended.seconds = time.monotonic() - clock
    return ended


def present(folder: Path, runs: Sequence[Run]) -> dict[str, Result]:
    """Results that stay as they are, by id. What failed for another reason than its own motion is tried again."""
    found = {run.id: disk.read_result(folder, run.id) for run in runs}
    return {name: result for name, result in found.items() if result is not None and result.status in LASTING}


def results(plan: Plan, folder: Path, missing: Sequence[Run], engine: Engine, stop: Callable[[], bool],
            say: Callable[[str], None]) -> Iterator[Result]:
    """The missing runs' results as they come, each written to the disk before. Machine code is made first, by one worker alone."""
    if not missing:
        return
    from verlet_numba.batch import work

    groups = batches_of(plan, folder, missing, engine.jobs)
    batches = [batch for group in groups for batch in group]
    with opened(engine, len(batches), stop) as pool:
        say("compiling what the runs need for this machine, once (kept for later runs) ...")
        for _ in pool.work_through(work.warm_batch, [group[0] for group in groups], at_once=1):
            pass
        say("")
        for key, outcome in pool.work_through(work.simulate_batch, batches):
            if isinstance(outcome, Result):
                yield outcome
                continue
            undone = Result(key, KILLED if outcome.died else FAILED, 0.0, {}, reason=outcome.reason, program=work.program())
            with contextlib.suppress(OSError):      # it is told all the same
                disk.write_result(folder, undone)
            yield undone


def batches_of(plan: Plan, folder: Path, runs: Sequence[Run], jobs: int) -> list[list[Any]]:
    """The runs as batches, group by group: as many at once as a worker can be given without others waiting in the end."""
    from verlet_numba.batch.work import Batch, Named

    document = plan.document
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.group, []).append(run)
    found = []
    for group in groups.values():
        size = min(BATCH, max(1, len(group) // (SHARE * jobs)))
        pieces = [group[first:first + size] for first in range(0, len(group), size)]
        found.append([Batch(document.scene.text, str(Path(document.scene.name).resolve()), document.sets, folder.resolve(),
                            document.sweep.measures, tuple(Named(run.id, plan.overrides(run)) for run in piece))
                      for piece in pieces])
    return found


@contextlib.contextmanager
def opened(engine: Engine, most: int, stop: Callable[[], bool]) -> Iterator[Any]:
    """What works through batches: processes, no more than there are batches, or a cluster."""
    if engine.address:
        from verlet_numba.batch.cluster import Cluster
        with Cluster(engine.address, min(engine.jobs, most), stop) as cluster:
            yield cluster
    else:
        from verlet_numba.batch.pool import Pool
        from verlet_numba.batch.work import load
        with Pool(min(engine.jobs, most), stop, load) as pool:
            yield pool


def claim(plan: Plan, folder: Path, runs: Sequence[Run], resume: bool) -> None:
    """Make the folder this sweep's, or see that it is. Shards of one sweep share a folder. Raises RefusedError."""
    document = plan.as_dict()
    if disk.is_sweep(folder):
        known = disk.read_plan(folder)
        if any(known[key] != document[key] for key in ("parameters", "measures")) or ids(known) != ids(document):
            raise RefusedError(f"{folder} holds another sweep, {len(known['runs'])} runs of {known['scene']} over "
                             f"{', '.join(known['parameters'])}; give another folder with -o")
        if not resume and any(disk.run_folder(folder, run.id).exists() for run in runs):
            raise RefusedError(f"{folder} has runs of this sweep already; go on with --resume, or give another folder with -o")
        return
    if folder.exists() and (not folder.is_dir() or any(not entry.name.startswith(".") for entry in folder.iterdir())):
        raise RefusedError(f"{folder} exists already and is no sweep; give another folder with -o")
    folder.mkdir(parents=True, exist_ok=True)
    disk.write_atomically(folder / PLAN, json.dumps(document, indent=1))


def ids(document: disk.Plan) -> list[str]:
    return [run["id"] for run in document["runs"]]


@contextlib.contextmanager
def locked(folder: Path, shard: tuple[int, int]) -> Iterator[None]:
    """Nobody else runs this shard meanwhile. Raises SweepError if somebody does."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(Lock(folder / f"shard-{shard[0]}-of-{shard[1]}"))
        except BusyError:
            raise SweepError(f"{folder}: another process runs this sweep or shard; wait for it, or stop it") from None
        yield
