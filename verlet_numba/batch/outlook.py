"""What a sweep would do, for --dry-run: nothing is written."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from verlet_numba.batch.planning import Plan
from verlet_numba.batch.sweep import present, shard_of
from verlet_numba.study.sweep_folder import SHOWN, short


class Outlook:
    """The runs of a sweep or shard, and those of them that its folder has."""

    def __init__(self, plan: Plan, folder: Path, shard: tuple[int, int]) -> None:
        self.plan, self.folder = plan, folder
        self.runs = shard_of(plan, *shard)
        self.kept = present(folder, self.runs)

    def as_dict(self) -> dict[str, Any]:
        names = self.plan.parameters
        return {"folder": str(self.folder), "points": self.plan.points, "runs": len(self.runs), "there": len(self.kept),
                "missing": [{"id": run.id, "group": run.group, "parameters": dict(zip(names, run.values, strict=True))}
                            for run in self.runs if run.id not in self.kept]}

    def lines(self) -> Iterator[str]:
        sweep, runs = self.plan.document.sweep, self.runs
        groups = len({run.group for run in runs})
        yield (f"{self.folder}: {self.plan.points} points by method {sweep.way}, {len(self.plan.runs)} different runs, "
               f"{len(runs)} here, {len(self.kept)} there already, {len(runs) - len(self.kept)} to run")
        yield f"{groups} {'group' if groups == 1 else 'groups'} of equal topology and solver settings; {os.cpu_count()} cores"
        names = self.plan.parameters
        cells = [[run.id, *map(short, run.values), "there" if run.id in self.kept else "to run"] for run in runs[:SHOWN]]
        wide = [max(map(len, column)) for column in zip(["id", *names, ""], *cells, strict=True)]
        for row in (["id", *names, ""], *cells):
            yield "  ".join(f"{text:>{width}}" for text, width in zip(row, wide, strict=True)).rstrip()
        if len(runs) > SHOWN:
            yield f"... and {len(runs) - SHOWN} more"
