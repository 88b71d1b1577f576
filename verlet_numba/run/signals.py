"""SIGINT and SIGTERM: the first stops a run as soon as its frames are safe, the second at once."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Self

LISTENED = (signal.SIGINT, signal.SIGTERM)


class Interrupted(BaseException):
    """A signal came while there was nothing to lose."""


class StopSignals:
    """A context manager within which the first signal is noted, and the second acts as if nobody listened.

    Python gives signals to the main thread alone; in another one, as a cluster's workers have it, none is noted.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.at_once = False
        self.before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self.before = {number: signal.signal(number, self._note) for number in LISTENED}
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self.before.items():
            signal.signal(number, handler)

    def stop(self) -> bool:
        """Whether a signal has come."""
        return self.number is not None

    @contextmanager
    def prompt(self) -> Iterator[None]:
        """A context in which the first signal raises Interrupted, also if it has come before."""
        self.at_once = True
        try:
            if self.stop():
                raise Interrupted
            yield
        finally:
            self.at_once = False

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.number = number
        for listened in LISTENED:
            signal.signal(listened, signal.SIG_DFL)
        if self.at_once:
            raise Interrupted
