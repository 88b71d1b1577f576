"""What is told of a sweep under way."""

import io
import re

from verlet_numba.batch.progress import Progress
from verlet_numba.study.sweep_folder import Result


class Terminal(io.StringIO):
    def isatty(self):
        return True


def told(stream, statuses, quiet=False, kept=2):
    with Progress(10, kept, quiet, stream) as progress:
        progress.say("compiling")
        for status in statuses:
            progress.shown = 0.0
            progress.add(Result("a", status, 1.0, {}))
    return stream.getvalue()


def test_a_terminal_has_a_bar_with_rate_and_time_left_which_goes_away():
    text = told(Terminal(), ["complete", "failed", "complete"])
    assert text.startswith("\rcompiling")
    assert re.search(r"\[#{15}\.{15}\] 5/10 runs  [\d.e+]+ runs/s  \d+ s left  1 failed", text)
    assert text.endswith("\r\033[K")


def test_a_log_has_lines():
    assert re.fullmatch(r"3/10 runs\n4/10 runs  [\d.e+]+ runs/s  \d+ s left\n", told(io.StringIO(), ["complete"] * 2))


def test_quiet_is_quiet():
    assert told(Terminal(), ["complete"], quiet=True) == told(io.StringIO(), ["complete"], quiet=True) == ""
