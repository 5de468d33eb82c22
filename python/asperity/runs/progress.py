"""The display of the progress of many runs: a bar in a notebook, elsewhere text on stderr."""

from __future__ import annotations

import sys
import time
from typing import TextIO

from ..base.durations import duration, short_time
from .notebook_bar import notebook_bar

__all__ = ["SweepProgress"]


class SweepProgress:
    """The progress of many cases: one line that is rewritten in a terminal, else one per case.

    In a notebook a bar takes the place of the lines, except for those about failed cases.
    """

    def __init__(self, what: str, total: int, waiting: int, quiet: bool,
                 stream: TextIO | None = None) -> None:
        self._what = what
        self._stream = sys.stderr if stream is None else stream
        self._quiet = quiet
        self._terminal = self._stream.isatty()
        self._bar = notebook_bar() if stream is None and not quiet else None
        self._total = total
        self._kept = total - waiting
        self._waiting = waiting
        self._done = self._failed = 0
        self._start = time.monotonic()
        self._width = 0
        if self._kept and not quiet:
            self._line(f"{self._what}: {self._kept} of {total} results are there already")

    def _line(self, text: str) -> None:
        """Write a line that stays."""
        if self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._width = 0
        self._stream.write(text + "\n")
        self._stream.flush()

    def note(self, text: str) -> None:
        """Write a remark in a line of its own."""
        if not self._quiet:
            self._line(f"{self._what}: {text}")

    def show(self, running: int) -> None:
        """Rewrite the line of a terminal."""
        if self._quiet or not self._terminal:
            return
        text = f"{self._what}: {self._state()}, {running} running{self._left()}"
        self._stream.write("\r" + text.ljust(self._width))
        self._stream.flush()
        self._width = len(text)

    def _state(self) -> str:
        """Return how many cases are done."""
        failed = f", {self._failed} failed" if self._failed else ""
        return f"{self._kept + self._done} of {self._total} done{failed}"

    def _left(self) -> str:
        """Return the time left, estimated from the mean time of the cases that are done."""
        left = self._waiting - self._done
        if not self._done or not left:
            return ""
        seconds = (time.monotonic() - self._start) / self._done * left
        return f", about {duration(seconds)} left"

    def done(self, name: str, fault: str | None, seconds: float | None, running: int) -> None:
        """Count a case. `fault` is None unless it failed; `seconds` if another process ran it."""
        self._done += 1
        self._failed += fault is not None
        if self._quiet:
            return
        if self._bar is not None:
            self._bar.show(self._kept + self._done, self._total,
                           f"{self._what}: {self._state()}{self._left()}")
        if fault is not None or not (self._terminal or self._bar):
            by = "by another process" if seconds is None else f"in {short_time(seconds)}"
            how = f"done {by}" if fault is None else f"FAILED: {fault}"
            self._line(f"{self._what}: {self._state()}{self._left()}: {name}: {how}")
        self.show(running)

    def end(self) -> None:
        """End the line in a terminal."""
        if self._width:
            self._stream.write("\n")
            self._stream.flush()
            self._width = 0
