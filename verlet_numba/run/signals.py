"""SIGINT and SIGTERM: the first stops a run after its current chunk, the second at once."""

import signal
from types import FrameType
from typing import Self

LISTENED = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """A context manager within which the first signal is noted, and the second acts as if nobody listened.

    While `at_once` is set, as it is at first, there is nothing to finish: the first signal, too, ends the program, by
    SystemExit with the shell's exit code for it.
    """

    def __init__(self) -> None:
        self.received: int | None = None
        self.at_once = True

    def __enter__(self) -> Self:
        self.before = {number: signal.signal(number, self._note) for number in LISTENED}
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self.before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        for listened in LISTENED:
            signal.signal(listened, signal.SIG_DFL)
        if self.at_once:
            raise SystemExit(128 + number)
        self.received = number
