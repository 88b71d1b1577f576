"""Processes that work through batches and may die at any time: a death costs what was begun there, and is tried again.

`concurrent.futures` breaks every pending future when one process dies. Here each worker has a pipe of its own and says what it
begins and what it has done, so it is known whom a death concerns. Workers are spawned, not forked: threads of Numba, HDF5 and
BLAS do not survive a fork.

- What a dead worker had not begun is given to others at once.
- What it had begun is a *suspect*: it is tried again at the end of the queue, alone; after two deaths when all else is done;
  after three it is set aside. So a run that kills its workers takes nothing with it, and one that was hit by chance is not
  taken for a killer while there is other work to be hit.
- A death all of whose suspects are then done was an accident. Where there are many, something else kills, and a death is weak
  evidence: 50 random kills among 200 runs hit one of them three times every other time. So accidents earn further tries.
- A worker whose parent dies ends itself.
"""

import contextlib
import multiprocessing
import os
import queue
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple, Protocol, Self, TypeVar

MOST_TRIES = 3
ACCIDENTS = 5                   # deaths of which all that was begun then succeeded: for so many everyone has one more try
MOST_FAILED_STARTS = 3          # in a row, by errors of their own
LOOK_SECONDS = 0.2              # between two looks at signals
GRACE_SECONDS = 1.2             # between asking a worker to end and ending it


class Batch(Protocol):
    """Something to be done, in parts that each have a key."""

    @property
    def keys(self) -> tuple[str, ...]: ...

    def only(self, keys: Sequence[str]) -> Any: ...


B = TypeVar("B", bound=Batch)
Work = Callable[[B, Callable[[str], None], Callable[[str, Any], None]], None]
"""work(batch, begin, done): calls begin(key) before each part and done(key, outcome) after it."""


class Undone(NamedTuple):
    """The outcome of a part that has none: why. `died`: it is set aside, since workers died of it; else an error ended the work."""

    reason: str
    died: bool


class PoolError(Exception):
    """Workers cannot be started."""


class _Worker:
    """A process, as its parent sees it."""

    def __init__(self, context: Any, prepare: Callable[[], object]) -> None:
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(theirs, prepare), daemon=True)
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)       # inherited: Ctrl-C while it starts is for its parent
        self.process.start()
        signal.signal(signal.SIGINT, before)
        theirs.close()
        self.ready = False
        self.batch: Any = None
        self.left: list[str] = []           # keys of the batch that are not done
        self.begun: list[str] = []          # and those of them that are begun

    def give(self, work: Any, batch: Any) -> None:
        self.batch, self.left, self.begun = batch, list(batch.keys), []
        with contextlib.suppress(OSError):      # it has died: its sentinel tells
            self.connection.send((work, batch))

    def messages(self) -> Iterator[tuple[Any, ...]]:
        """What has come from it; also what it could say before it died."""
        try:
            while self.connection.poll():
                yield self.connection.recv()
        except (EOFError, OSError):
            return


class Pool:
    """Workers that are kept from one kind of work to the next. A context manager, which ends them."""

    def __init__(self, jobs: int, stop: Callable[[], bool] = bool, prepare: Callable[[], object] = bool) -> None:
        """`prepare` is what every worker does first, all at the same time."""
        self.stop, self._prepare = stop, prepare
        self._context = multiprocessing.get_context("spawn")
        self._jobs = jobs
        self._failed_starts = 0
        self._workers = [_Worker(self._context, prepare) for _ in range(jobs)]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        """Ask every worker to end, which a run does with its frames in the file, then make it."""
        for worker in self._workers:
            worker.process.terminate()
        deadline = time.monotonic() + GRACE_SECONDS
        for worker in self._workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            worker.process.kill()
            worker.process.join()

    def work_through(self, work: Work[B], batches: Sequence[B], at_once: int | None = None) -> Iterator[tuple[str, Any]]:
        """Yields key and outcome of every part, as they are done; Undone for what is set aside. Ends early where `stop` says so.

        `at_once`: so many batches at the same time, at most. Raises PoolError.
        """
        todo = _Queue(batches)
        while not self.stop():
            self._assign(work, todo, at_once or self._jobs)
            busy = [worker for worker in self._workers if worker.batch is not None]
            if not busy and not todo:
                return
            wait([waited for worker in self._workers for waited in (worker.connection, worker.process.sentinel)], LOOK_SECONDS)
            for worker in list(self._workers):
                alive = worker.process.exitcode is None
                for kind, *told in worker.messages():
                    yield from self._told(worker, kind, told, todo)
                if not alive:
                    yield from self._bury(worker, todo)

    def _assign(self, work: Any, todo: "_Queue", at_once: int) -> None:
        idle = [worker for worker in self._workers if worker.ready and worker.batch is None]
        busy = sum(worker.batch is not None for worker in self._workers)
        while idle and busy < at_once and (batch := todo.next(busy == 0)) is not None:
            idle.pop().give(work, batch)
            busy += 1

    def _told(self, worker: _Worker, kind: str, told: list[Any], todo: "_Queue") -> Iterator[tuple[str, Any]]:
        if kind == "begin":
            worker.begun += told
        elif kind == "done":
            key, outcome = told
            worker.left.remove(key)
            todo.done(key)
            worker.begun = [other for other in worker.begun if other != key]
            yield key, outcome
        else:
            for key in worker.left:
                yield key, Undone(told[0], False)
            worker.ready, worker.batch, worker.left, self._failed_starts = True, None, [], 0

    def _bury(self, worker: _Worker, todo: "_Queue") -> Iterator[tuple[str, Any]]:
        """A worker has died: share out what it had, and put another in its place."""
        self._workers.remove(worker)
        worker.connection.close()
        code = worker.process.exitcode or 0
        if not worker.ready and code > 0:
            self._failed_starts += 1
            if self._failed_starts == MOST_FAILED_STARTS:
                raise PoolError(f"worker processes end with code {code} before they can begin")
        if worker.batch is not None:
            blamed = worker.begun or worker.left[:1]
            for key in todo.returned(worker.batch, worker.left, blamed):
                yield key, Undone(f"its worker process died {todo.deaths[key]} times, at last {manner(code)}", True)
        self._workers.append(_Worker(self._context, self._prepare))


class _Queue:
    """What is to be done, and whom deaths have made suspect."""

    def __init__(self, batches: Sequence[Any]) -> None:
        self.batches = deque(batches)
        self.last: deque[Any] = deque()         # to be tried when all else is done
        self.deaths: dict[str, int] = {}
        self.unexplained: list[set[str]] = []   # of each death: the parts begun then that are not done since
        self.accidents = 0                      # deaths that none of these parts can have caused

    def __bool__(self) -> bool:
        return bool(self.batches or self.last)

    def next(self, alone: bool) -> Any:
        """The next batch; None if there is none for now. `alone`: nobody else is at work."""
        if self.batches:
            return self.batches.popleft()
        return self.last.popleft() if self.last and alone else None

    def done(self, key: str) -> None:
        """A part is done: whatever its workers died of was not its fault."""
        if self.deaths.pop(key, 0):
            for parts in self.unexplained:
                parts.discard(key)
            self.accidents += self.unexplained.count(set())
            self.unexplained = [parts for parts in self.unexplained if parts]

    def returned(self, batch: Any, left: Sequence[str], blamed: Sequence[str]) -> list[str]:
        """Take back what a dead worker has left undone. Returns the keys that are set aside."""
        if rest := [key for key in left if key not in blamed]:
            self.batches.appendleft(batch.only(rest))
        self.unexplained.append(set(blamed))
        aside, most = [], MOST_TRIES + self.accidents // ACCIDENTS
        for key in blamed:
            self.deaths[key] = self.deaths.get(key, 0) + 1
            if self.deaths[key] >= most:
                aside.append(key)
            else:
                (self.last if self.deaths[key] >= MOST_TRIES - 1 else self.batches).append(batch.only([key]))
        return aside


def manner(code: int) -> str:
    """How a process ended, by its exit code."""
    if code >= 0:
        return f"with exit code {code}"
    try:
        return f"by {signal.Signals(-code).name}" + (" (out of memory?)" if code == -signal.SIGKILL else "")
    except ValueError:
        return f"by signal {-code}"


def _serve(connection: Connection, prepare: Callable[[], object]) -> None:
    """A worker's life: batches come in through the pipe, what becomes of them goes out. It has no part in its parent's terminal."""
    os.setpgid(0, 0)
    batches: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(connection, batches), daemon=True).start()
    prepare()
    connection.send(("ready", ""))
    while True:
        work, batch = batches.get()
        trouble = ""
        try:
            work(batch, lambda key: connection.send(("begin", key)), lambda key, outcome: connection.send(("done", key, outcome)))
        except Exception as error:
            trouble = f"{type(error).__name__}: {error}"
        connection.send(("ready", trouble))


def _receive(connection: Connection, batches: "queue.SimpleQueue[Any]") -> None:
    """Hand on what comes; the end of the pipe is the parent's death, and so this process's."""
    while True:
        try:
            batches.put(connection.recv())
        except (EOFError, OSError):
            os._exit(1)
