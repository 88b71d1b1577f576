"""Progress on stderr: a bar with steps/s and time left on a terminal, and one word about the first compilation."""

import sys
import threading
import time
from typing import Self, TextIO

WIDTH, EVERY, COMPILING_AFTER = 30, 0.1, 1.0        # columns; s; s


class Progress:
    """A context manager that tells how far a run is. Quiet where `quiet`, and without a bar where stderr is no terminal."""

    def __init__(self, frames: int, substeps: int, quiet: bool, stream: TextIO | None = None) -> None:
        self.frames, self.substeps, self.quiet = frames, substeps, quiet
        self.stream = stream or sys.stderr
        self.bar = not quiet and self.stream.isatty()
        self.started = self.shown = time.perf_counter()
        self.first = 0
        self.compiling: threading.Timer | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.compiled()
        if self.bar:
            self.stream.write("\r\033[K")
            self.stream.flush()

    def may_compile(self) -> None:
        """The next thing may be compilation: say so if it takes longer than a second."""
        if not self.quiet:
            self.compiling = threading.Timer(COMPILING_AFTER, self._announce)
            self.compiling.daemon = True
            self.compiling.start()

    def tell(self, text: str) -> None:
        """A line of its own."""
        if not self.quiet:
            self.stream.write(f"{text}\n")
            self.stream.flush()

    def compiled(self, first: int = 0) -> None:
        """Machine code is there: time runs from here, where so many frames are simulated already."""
        if self.compiling is not None:
            self.compiling.cancel()
        self.started, self.first = time.perf_counter(), first

    def _announce(self) -> None:
        self.tell("compiling the effects of this scene for this machine, once (kept for later runs) ...")

    def update(self, done: int) -> None:
        """`done` frames of the file are simulated."""
        now = time.perf_counter()
        if not self.bar or (now - self.shown < EVERY and done < self.frames):
            return
        self.shown = now
        spent, new, part = max(now - self.started, 1e-9), done - self.first, done / max(self.frames, 1)
        rate, left = new / spent, (self.frames - done) * spent / max(new, 1)
        full = int(WIDTH * part)
        self.stream.write(f"\r[{'#' * full}{'.' * (WIDTH - full)}] {done}/{self.frames} frames  "
                          f"{rate * self.substeps:,.0f} steps/s  {left:.0f} s left\033[K")
        self.stream.flush()
