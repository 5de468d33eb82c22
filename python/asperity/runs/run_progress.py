"""The display of the progress of a run: a bar in a notebook, elsewhere a line every two seconds."""

from __future__ import annotations

import sys
import time as clock
from typing import TextIO

from .notebook_bar import notebook_bar

__all__ = ["RunProgress"]

_EVERY = 2.0           # time between two lines, s
_EVERY_IN_NOTEBOOK = 0.2   # time between two updates of the bar, s


class RunProgress:
    """The progress of a run.

    Parameters
    ----------
    rows : int
        Number of rows of the whole run.
    stream : text file, optional
        Stream to which the lines are written; stderr by default.
    """

    def __init__(self, rows: int, stream: TextIO | None = None) -> None:
        self.rows = rows
        self._stream = stream
        self._bar = notebook_bar() if stream is None else None
        self._start = self._last = clock.monotonic()
        self._first_step: int | None = None

    def show(self, step: int, time: float, contact_area: float, friction: float) -> None:
        """Show a row if it is the first or the last one, or if enough time has passed."""
        now = clock.monotonic()
        every = _EVERY if self._bar is None else _EVERY_IN_NOTEBOOK
        is_first = self._first_step is None
        if is_first:
            self._first_step = step
        if not is_first and step < self.rows - 1 and now - self._last < every:
            return
        self._last = now
        left = ""
        done = step - (self._first_step or 0)
        if done > 0 and step < self.rows - 1:
            seconds = (now - self._start) / done * (self.rows - 1 - step)
            left = f", {seconds:.0f} s left"
        text = (f"step {step} of {self.rows - 1}, t = {time:.6g} s, contact area"
                f" {contact_area:.4g}, friction {friction:.4g}{left}")
        if self._bar is None:
            print(text, file=self._stream or sys.stderr)
        else:
            self._bar.show(step + 1, self.rows, text)
