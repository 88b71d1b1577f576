"""Sweeps on a Dask cluster: the same batches as for the processes of `pool`, the same files on the disk that all share.

Dask tries a batch again when its worker dies, on another one, and gives up after a few deaths (its `allowed-failures`). What a
batch had done by then stands on the disk. The runs that have no result are tried once more at the end, one at a time, and those
that kill workers even then are set aside. See https://distributed.dask.org/en/stable/resilience.html.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self, TypeVar

from verlet_numba.batch.pool import Batch, Undone, Work

LOOK_SECONDS = 0.2
B = TypeVar("B", bound=Batch)


class ClusterError(Exception):
    """There is no such cluster, or the package that talks to it is not installed."""


class Cluster:
    """The workers of a Dask scheduler at an address `tcp://...`, or `jobs` processes here for `local`. A context manager."""

    def __init__(self, address: str, jobs: int, stop: Callable[[], bool]) -> None:
        try:
            import distributed
        except ImportError:
            raise ClusterError("--cluster needs Dask: pip install 'verlet-numba[cluster]'") from None
        self.stop = stop
        self._own = None
        if address == "local":
            self._own = distributed.LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address=None,
                                                 silence_logs=logging.CRITICAL)
        try:
            self._client = distributed.Client(self._own or address, timeout="10s")
        except (OSError, ValueError) as error:
            raise ClusterError(f"no Dask scheduler answers at {address} ({error})") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._client.close()
        if self._own is not None:
            self._own.close()

    def work_through(self, work: Work[B], batches: Sequence[B], at_once: int | None = None) -> Iterator[tuple[str, Any]]:
        """As `Pool.work_through`. Batches that run when `stop` is heeded end on the cluster, and their results stay."""
        suspects: list[B] = []
        yield from self._rounds(work, batches, at_once or len(batches), suspects)
        again, suspects = [batch.only([key]) for batch in suspects for key in batch.keys], []
        yield from self._rounds(work, again, 1, suspects)
        for batch in suspects:
            yield batch.keys[0], Undone("its worker process died again and again", True)

    def _rounds(self, work: Work[B], batches: Sequence[B], at_once: int, suspects: list[B]) -> Iterator[tuple[str, Any]]:
        """Batches, so many at once; those whose workers died go to the suspects."""
        from distributed import wait

        todo = list(reversed(batches))
        running: dict[Any, B] = {}
        try:
            while (todo or running) and not self.stop():
                while todo and len(running) < at_once:
                    batch = todo.pop()
                    running[self._client.submit(perform, work, batch, pure=False)] = batch
                try:
                    finished = wait(list(running), timeout=LOOK_SECONDS, return_when="FIRST_COMPLETED").done
                except TimeoutError:
                    continue
                for future in finished:
                    yield from self._outcomes(future, running.pop(future), suspects)
        finally:
            self._client.cancel(list(running))

    def _outcomes(self, future: Any, batch: B, suspects: list[B]) -> Iterator[tuple[str, Any]]:
        from distributed import KilledWorker

        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            suspects.append(batch)
        elif error is not None or future.status != "finished":
            for key in batch.keys:
                yield key, Undone(f"{type(error).__name__}: {error}" if error else f"the cluster has {future.status} it", False)
        else:
            yield from future.result()


def perform(work: Work[B], batch: B) -> list[tuple[str, Any]]:
    """On a worker of the cluster: all of a batch at once."""
    found: list[tuple[str, Any]] = []
    work(batch, lambda key: None, lambda key, outcome: found.append((key, outcome)))
    return found
