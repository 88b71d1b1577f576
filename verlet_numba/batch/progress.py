"""Progress of a sweep on stderr: runs done, rate, time left; a bar on a terminal, a line now and then in a log."""

import sys
import time
from typing import Self, TextIO

from verlet_numba.study.sweep_folder import COMPLETE, Result

WIDTH, BAR_SECONDS, LOG_SECONDS = 30, 0.1, 30.0     # columns; s between two looks of the bar, between two lines of a log


class Progress:
    """A context manager that tells how far a sweep is."""

    def __init__(self, runs: int, kept: int, quiet: bool, stream: TextIO | None = None) -> None:
        self.runs, self.kept, self.quiet = runs, kept, quiet
        self.stream = stream or sys.stderr
        self.bar = self.stream.isatty()
        self.done = self.failed = 0
        self.started = self.shown = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.say("")

    def say(self, text: str) -> None:
        """A word in the place of the bar; nothing takes it away."""
        if self.bar and not self.quiet:
            self.stream.write(f"\r{text}\033[K")
            self.stream.flush()

    def add(self, result: Result) -> None:
        """A run has ended."""
        self.done += 1
        self.failed += result.status != COMPLETE
        now = time.monotonic()
        if self.done == 1:
            self.first = now
        if self.quiet or now - self.shown < (BAR_SECONDS if self.bar else LOG_SECONDS):
            return
        self.shown = now
        if self.bar:
            ended = self.kept + self.done
            full = WIDTH * ended // max(self.runs, 1)
            self.say(f"[{'#' * full}{'.' * (WIDTH - full)}] {self.told(now)}")
        else:
            self.stream.write(self.told(now) + "\n")
            self.stream.flush()

    def told(self, now: float) -> str:
        """How far, how fast since the first run ended, how long to go."""
        ended = self.kept + self.done
        text = f"{ended}/{self.runs} runs"
        if self.done > 1 and now > self.first:
            rate = (self.done - 1) / (now - self.first)
            text += f"  {rate:.3g} runs/s  {(self.runs - ended) / rate:.0f} s left"
        return text + (f"  {self.failed} failed" if self.failed else "")
