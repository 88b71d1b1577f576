"""The folder of a sweep: its plan, the result of every run, and the table made of them.

    sweep.json                      the plan: scene, parameters, the runs in order
    runs/ID/trajectory.vtkhdf       a run's trajectory
    runs/ID/result.json             how it ended, its measures; written last
    results.csv (.parquet)          one row a run, made of the above

The files of the runs are the truth: a run is done when its result says so and its trajectory is there. Everything is written
under another name and then renamed, so that a kill leaves nothing half-written.
"""

import csv
import json
import os
import secrets
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from verlet_numba.study import figures, reader

PLAN, RESULT, TRAJECTORY, TABLE = "sweep.json", "result.json", "trajectory.vtkhdf", "results.csv"
COMPLETE, DIVERGED, FAILED, KILLED = "complete", "diverged", "failed", "killed"
LASTING = (COMPLETE, DIVERGED)          # what another try would not change
FORMAT = 1
Plan = Mapping[str, Any]


class SweepError(Exception):
    """A folder that cannot be read as a sweep, or is another one; one line says which and why."""


class Result(NamedTuple):
    """How a run ended."""

    id: str
    status: str                             # complete, diverged, failed (an error), killed (with its worker, again and again)
    seconds: float                          # wall time
    measures: dict[str, float | None]       # by column
    frames: int = 0
    reason: str = ""                        # why it is not complete
    program: str = ""                       # that made it


class Row(NamedTuple):
    """A run of the plan and how it ended."""

    values: list[Any]                       # of the parameters
    result: Result


class Table(NamedTuple):
    """What is known of a sweep: rows in the order of the plan, of runs that ended."""

    folder: Path
    parameters: list[str]
    columns: list[str]                      # of measures
    rows: list[Row]
    planned: int                            # runs

    def failed(self) -> list[Row]:
        return [row for row in self.rows if row.result.status != COMPLETE]

    def as_dict(self) -> dict[str, Any]:
        """Everything, as plain data."""
        rows = [{"id": row.result.id, "parameters": dict(zip(self.parameters, row.values, strict=True)),
                 **{key: value for key, value in row.result._asdict().items() if key != "id"}} for row in self.rows]
        return {"sweep": str(self.folder), "planned": self.planned, "ended": len(self.rows), "failed": len(self.failed()),
                "runs": rows}


def is_sweep(folder: Path) -> bool:
    return (folder / PLAN).is_file()


def read_plan(folder: Path) -> Plan:
    """Raises SweepError."""
    try:
        plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
        known = isinstance(plan, dict) and plan["format"] == FORMAT
        ids = [run["id"] for run in plan["runs"]] if known else []
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise SweepError(f"{folder / PLAN}: cannot be read as the plan of a sweep ({error})") from error
    if not known or len(ids) != len(set(ids)):
        raise SweepError(f"{folder / PLAN}: is no plan of a sweep that this version knows")
    return dict(plan)


def run_folder(folder: Path, run: str) -> Path:
    return folder / "runs" / run


def read_result(folder: Path, run: str) -> Result | None:
    """How a run ended; None if it has not, or its files are damaged or gone."""
    place = run_folder(folder, run)
    try:
        result = Result(**json.loads((place / RESULT).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    if not (isinstance(result.measures, dict) and isinstance(result.seconds, int | float) and isinstance(result.frames, int)):
        return None
    lost = result.status in LASTING and result.frames and not (place / TRAJECTORY).exists()
    return None if lost or result.id != run else result


def write_result(folder: Path, result: Result) -> None:
    """Raises OSError."""
    place = run_folder(folder, result.id)
    place.mkdir(parents=True, exist_ok=True)
    write_atomically(place / RESULT, json.dumps(result._asdict(), allow_nan=False))


def write_atomically(path: Path, text: str) -> None:
    """A file that is there as a whole or not at all. Raises OSError."""
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="")
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def table(folder: Path, plan: Plan | None = None) -> Table:
    """What is known of a sweep. Raises SweepError."""
    plan = plan or read_plan(folder)
    found = ((run, read_result(folder, run["id"])) for run in plan["runs"])
    return Table(folder, list(plan["parameters"]), figures.columns(plan["measures"]),
                 [Row(run["values"], result) for run, result in found if result is not None], len(plan["runs"]))


def measured(known: Table, names: Sequence[str], body: str | None = None, recorded: bool = True) -> Table:
    """The same with other measures, taken of the trajectories anew. Raises MeasureError, TrajectoryError."""
    rows = []
    for row in known.rows:
        path = run_folder(known.folder, row.result.id) / TRAJECTORY
        found = {}
        if path.exists():
            with reader.open(path) as trajectory:
                found = figures.figures(trajectory, names, body, recorded)
        rows.append(Row(row.values, row.result._replace(measures=found)))
    return known._replace(columns=figures.columns(names), rows=rows)


def write_table(known: Table, path: Path) -> None:
    """CSV: id, parameters, status, seconds, measures; empty where there is none. Raises OSError."""
    import io

    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(["id", *known.parameters, "status", "seconds", *known.columns])
    writer.writerows([row.result.id, *map(cell, row.values), row.result.status, row.result.seconds,
                      *(cell(row.result.measures.get(name)) for name in known.columns)] for row in known.rows)
    write_atomically(path, text.getvalue())


def cell(value: Any) -> Any:
    """A value as it stands in a table: numbers and words as they are, all else as JSON."""
    if value is None:
        return ""
    return value if isinstance(value, int | float | str) and not isinstance(value, bool) else json.dumps(value)


def write_parquet(known: Table, path: Path) -> bool:
    """The same table as Parquet, where pyarrow is installed; whether it is. Raises OSError."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        return False
    data: dict[str, list[Any]] = {"id": [row.result.id for row in known.rows]}
    for k, name in enumerate(known.parameters):
        data[name] = alike([row.values[k] for row in known.rows])
    data |= {"status": [row.result.status for row in known.rows], "seconds": [row.result.seconds for row in known.rows]}
    columns = {name: pyarrow.array(values) for name, values in data.items()}
    columns |= {name: pyarrow.array([row.result.measures.get(name) for row in known.rows], pyarrow.float64())
                for name in known.columns}
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        parquet.write_table(pyarrow.table(columns), part)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return True


def alike(values: list[Any]) -> list[Any]:
    """A column of one type: numbers, or else text."""
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    return [float(value) for value in values] if numbers else [str(cell(value)) for value in values]


def write_tables(folder: Path, plan: Plan) -> Table:
    """results.csv, and results.parquet where that is possible, of what is on the disk; written again while others add to it.

    Shards share a folder: the last to write has seen what was there after it wrote, so nothing is left out in the end.
    Raises OSError.
    """
    known = table(folder, plan)
    while True:
        write_table(known, folder / TABLE)
        write_parquet(known, (folder / TABLE).with_suffix(".parquet"))
        now = table(folder, plan)
        if [row.result for row in now.rows] == [row.result for row in known.rows]:
            return known
        known = now


SHOWN, WIDTH = 40, 13           # rows of a table on a terminal; columns a figure


def lines(known: Table) -> Iterator[str]:
    """A sweep as text: how far it is, its rows, the range of every measure, what failed and why."""
    ended = f"{len(known.rows)} of {known.planned} runs ended" + (f", {len(known.failed())} failed" if known.failed() else "")
    yield f"{known.folder}: {ended}"
    heads = [*known.parameters, "seconds", *known.columns]
    cells = [[*(short(value) for value in row.values), short(row.result.seconds),
              *(short(row.result.measures.get(name)) for name in known.columns)] for row in known.rows[:SHOWN]]
    wide = [max([len(head), *(len(line[k]) for line in cells)]) for k, head in enumerate(heads)]
    yield "  ".join([f"{'id':16}", *(f"{head:>{width}}" for head, width in zip(heads, wide, strict=True)), "status"])
    for row, line in zip(known.rows, cells, strict=False):
        yield "  ".join([row.result.id, *(f"{text:>{width}}" for text, width in zip(line, wide, strict=True)), row.result.status])
    if len(known.rows) > SHOWN:
        yield f"... and {len(known.rows) - SHOWN} more: --csv or --json has all of them"
    yield from ranges(known)
    yield from failures(known.failed(), known.parameters)


def ranges(known: Table) -> Iterator[str]:
    """Least, middle and most of every measure."""
    import numpy as np

    wide = max(map(len, known.columns), default=0)
    yield " " * wide + "".join(f"{word:>{WIDTH}}" for word in ("least", "median", "most", "runs"))
    for name in known.columns:
        values = [value for row in known.rows if (value := row.result.measures.get(name)) is not None]
        told = [f"{value:{WIDTH}.5g}" for value in (np.quantile(values, (0, 0.5, 1)) if values else ())]
        yield f"{name:<{wide}}" + ("".join(told) or " " * 3 * WIDTH) + f"{len(values):{WIDTH}}"


def failures(rows: Sequence[Row], parameters: Sequence[str]) -> Iterator[str]:
    """Runs that are not complete, and why; many of one reason in few lines."""
    reasons: dict[str, list[Row]] = {}
    for row in rows:
        reasons.setdefault(row.result.reason, []).append(row)
    for reason, alike in reasons.items():
        yield f"{len(alike)} {'' if reason.startswith(alike[0].result.status) else alike[0].result.status + ': '}{reason}"
        for row in alike[:10]:
            values = (f"{name}={short(value)}" for name, value in zip(parameters, row.values, strict=True))
            yield f"  {row.result.id}  {' '.join(values)}"
        if len(alike) > 10:
            yield f"  ... and {len(alike) - 10} more"


def short(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        value = [float(f"{part:.4g}") if isinstance(part, float) else part for part in value]
    text = str(cell(value))
    return text if len(text) <= 24 else text[:21] + "..."
