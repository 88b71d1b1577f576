"""SIGINT and SIGTERM: the first stops a run as soon as its frames are safe, the second at once."""

import signal
import threading
from types import FrameType
from typing import Self

LISTENED = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """A context manager within which the first signal is noted, and the second acts as if nobody listened.

    Only the main thread can listen; in another one no signal is ever noted.
    """

    def __init__(self) -> None:
        self.number: int | None = None

    def __enter__(self) -> Self:
        listened = LISTENED if threading.current_thread() is threading.main_thread() else ()
        self.before = {number: signal.signal(number, self._note) for number in listened}
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self.before.items():
            signal.signal(number, handler)

    def stop(self) -> bool:
        """Whether a signal has come."""
        return self.number is not None

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.number = number
        for listened in LISTENED:
            signal.signal(listened, signal.SIG_DFL)
