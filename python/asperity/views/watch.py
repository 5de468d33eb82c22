"""A live view of a run in the terminal: friction and contact area as lines of text.

The view opens the result again for each update, as `asperity.open` does, and so sees the new rows.
"""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np

from ..base.durations import duration, short_time
from ..results import Run
from ..results.standing import held, how_to_continue, rows_of, seems_dead, silence, time_of_row
from ..results.steady import steady_rows
from .style import si_scale

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["sparkline", "watch"]

BARS = "▁▂▃▄▅▆▇█"
LEAST_BARS = 12  # number of bars of a narrow terminal, which shows no smallest and largest value


def sparkline(values: ArrayLike, width: int = 40, bars: str = BARS) -> str:
    """Return values as a line of bars, from the smallest to the largest.

    Parameters
    ----------
    values : array_like
        Values, shape (n,). A nan is left blank. More than `width` values are averaged in groups.
    width : int
        Largest number of characters.
    bars : str
        Characters from low to high.

    Returns
    -------
    str
        One character per value or per group, at most `width`.

    Examples
    --------
    >>> sparkline([0, 1, 2, 3])
    '▁▃▆█'
    >>> sparkline(np.arange(100.0), 4)
    '▁▃▆█'
    >>> sparkline([2.0, 2.0])
    '▄▄'
    """
    values = np.asarray(values, dtype=float)
    if len(values) > width:
        parts = np.array_split(values, width)
        values = np.array([np.nan if np.all(np.isnan(part)) else np.nanmean(part)
                           for part in parts])
    good = values[np.isfinite(values)]
    if not len(good):
        return " " * len(values)
    low, high = float(good.min()), float(good.max())
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return "".join(bars[(len(bars) - 1) // 2] if np.isfinite(value) else " "
                       for value in values)
    places = np.nan_to_num((values - low) / (high - low) * (len(bars) - 1))
    return "".join(bars[round(place)] if np.isfinite(value) else " "
                   for place, value in zip(places, values, strict=True))


class Pace:
    """Estimate of how fast a run writes rows, from repeated readings of its file.

    Parameters
    ----------
    memory : float
        Readings older than this many seconds are dropped.
    """

    def __init__(self, memory: float = 60.0) -> None:
        self.memory = memory
        self.looks: list[tuple[float, int]] = []

    def look(self, now: float, rows: int) -> None:
        """Add the number of rows at a time in seconds; start again if it fell."""
        if self.looks and rows < self.looks[-1][1]:
            self.looks.clear()
        self.looks.append((now, rows))
        # Of the readings without a new row, the first and the last are enough.
        if len(self.looks) > 2 and self.looks[-3][1] == self.looks[-2][1] == rows:
            self.looks.pop(-2)
        while len(self.looks) > 2 and now - self.looks[1][0] > self.memory:
            self.looks.pop(0)

    @property
    def still(self) -> float:
        """Seconds since the number of rows last changed."""
        last, rows = self.looks[-1]
        return last - min(when for when, count in self.looks if count == rows)

    @property
    def rate(self) -> float | None:
        """Rows per second; None as long as it is unknown."""
        (first, start), (last, rows) = self.looks[0], self.looks[-1]
        return (rows - start) / (last - first) if last > first and rows > start else None


def state_of(run: Run, pace: Pace) -> str:
    """Return the progress of a run in words."""
    rows, expected = run.history.rows, int(run.attributes.get("expected_rows", 0) or 0)
    of = f" of {expected}" if expected else ""
    words = [f"finished, {rows}{of} rows" if run.finished else rows_of(run)]
    if run.finished:
        return words[0]
    if expected:
        words[0] += f" ({100 * rows // expected} %)"
    if run.outcome != "running":
        return f"{words[0]}, {run.outcome}"
    rate = pace.rate
    if rate:
        words.append(f"{rate:.3g} rows/s")
        if expected > rows:
            words.append(f"{duration((expected - rows) / rate)} left")
    quiet = max(pace.still, silence(run) or 0.0)
    if quiet >= 10.0:
        words.append(f"no new row for {duration(quiet)}")
    if held(run) is False:
        words.append(f"its process has ended ({how_to_continue(run)})")
    elif seems_dead(run):
        words[-1] += (f" where a row takes up to {short_time(time_of_row(run) or 0.0)}: perhaps no"
                     f" longer running ({how_to_continue(run)})")
    return ", ".join(words)


def last_row(run: Run) -> str:
    """Return the last row of the history in words."""
    history = run.history
    if not history.rows:
        return "no row yet"
    words = []
    moment = (("sliding_speed", "sliding speed") if steady_rows(run)[-1] else ("time", "t ="))
    for name, short in (("step", "step"), moment, ("contact_area", "contact area"),
                        ("stick_area", "stick area"), ("friction", "friction"),
                        ("iterations_normal", "iterations"), ("residual_normal", "residual")):
        if name not in history or (name == "stick_area" and not np.any(history[name])):
            continue
        factor, unit = si_scale(history[name][-1], history.units(name))
        words.append(f"{short} {history[name][-1] * factor:.4g}{' ' + unit if unit else ''}")
    return ", ".join(words)


def picture(run: Run, pace: Pace, width: int, unicode: bool = True) -> list[str]:
    """Return the lines of the view, none longer than `width`."""
    history = run.history
    lines = [f"{run.title or run.path.name} ({run.path})", state_of(run, pace)]
    names = [("contact_area", "contact area")]
    if "friction" in history and np.any(history["friction"]):
        names.insert(0, ("friction", "friction"))
    if "stick_area" in history and np.any(history["stick_area"]):
        names.append(("stick_area", "stick area"))
    columns = [(label, history[name]) for name, label in names if name in history and history.rows]
    ends = [(f" {values[-1]:<9.4g}", f" ({values.min():.3g} to {values.max():.3g})")
            for _, values in columns]
    # All bars have one width, so that they show the same rows above each other.
    room = width - 14 - max((len(last + most) for last, most in ends), default=0)
    if room < LEAST_BARS:
        ends = [(last, "") for last, _ in ends]
        room = max(width - 14 - max((len(last) for last, _ in ends), default=0), LEAST_BARS)
    for (label, values), (last, most) in zip(columns, ends, strict=True):
        bars = sparkline(values, room, BARS if unicode else "_.-=oO#@")
        lines.append(f"{label:>12}  {bars}{last}{most}")
    lines.append(last_row(run))
    for line in run.warnings:
        lines.append(f"warning: {line}")
    return [part for line in lines for part in
            ([line] if len(line) <= width else textwrap.wrap(line, width))]


def watch(path: str | os.PathLike[str], *, every: float = 1.0, once: bool = False,
          stream: TextIO | None = None) -> int:
    """Follow a run until it ends: it finishes, is stopped, fails to converge, or is killed.

    A killed run does not record its end. It is noticed on the machine of the run only, where the
    lock beside the result is free; elsewhere the view goes on.

    Parameters
    ----------
    path : str or path
        The result, RESULT.h5.
    every : float
        Seconds between two updates.
    once : bool
        Show the present state and return.
    stream : text file, optional
        Where to write; stdout by default. On a terminal the view is redrawn in place; any other
        stream receives a plain line for each change.

    Returns
    -------
    int
        0 when the run has ended, or was shown once; 130 after Ctrl-C.

    Raises
    ------
    OSError
        If there is no such file, or it is not a result.
    """
    out = sys.stdout if stream is None else stream
    live = not once and out.isatty() and os.environ.get("TERM", "") != "dumb"
    encoding = (getattr(out, "encoding", None) or "ascii").lower().replace("-", "")
    unicode = encoding.startswith("utf") and not _posix_locale()
    pace = Pace()
    drawn: list[str] = []
    words: Any = None
    try:
        run = Run(Path(path))
        while True:
            pace.look(time.monotonic(), run.history.rows)
            if live or once:
                size = shutil.get_terminal_size((100, 24))
                lines = picture(run, pace, max(size.columns - 1, 40), unicode)[: size.lines - 1]
                if not unicode:
                    lines = [_ascii(line) for line in lines]
                if live:
                    _over(out, drawn, lines)
                else:
                    out.write("\n".join(lines) + "\n")
                drawn = lines
            elif (now := _news(run)) != words:
                line = f"{state_of(run, pace)}: {last_row(run)}\n"
                out.write(line if unicode else _ascii(line))
                words = now
            out.flush()
            if run.finished or once or run.outcome != "running":
                return 0
            process_has_ended = held(run) is False
            if not process_has_ended:
                time.sleep(every)
            run.refresh()
            if process_has_ended and not run.finished and run.outcome == "running":
                return 0  # it was killed, as the view says
    except KeyboardInterrupt:
        # Only the view ends. The run is another process and continues.
        out.write("\n" if live else "")
        out.flush()
        return 130
    except BrokenPipeError:
        # The reader, such as `head`, has closed the pipe, so nothing may be written at exit either.
        if stream is None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _posix_locale() -> bool:
    """Return whether the user has asked for the POSIX locale, whose terminals show ASCII only.

    Python itself writes UTF-8 there.
    """
    given = {name: os.environ[name] for name in ("LC_ALL", "LC_CTYPE", "LANG")
             if os.environ.get(name)}
    if "LANG" in given and given.get("LC_CTYPE") in ("C.UTF-8", "C.utf8", "UTF-8"):
        del given["LC_CTYPE"]  # Python itself sets it where LANG is POSIX
    return next(iter(given.values()), "") in ("C", "POSIX")


def _ascii(text: str) -> str:
    """Return a text in ASCII.

    Examples
    --------
    >>> _ascii("t = 5 \u00b5s, Stra\u00dfe")
    't = 5 us, Stra?e'
    """
    return text.replace("\u00b5", "u").encode("ascii", "replace").decode()


def _news(run: Run) -> tuple[Any, ...]:
    """Return the content of a plain line; a new line is written when it changes."""
    return run.history.rows, run.finished, run.outcome, seems_dead(run)


def _over(out: TextIO, before: list[str], lines: list[str]) -> None:
    """Redraw the view in place of the lines drawn before."""
    up = f"\x1b[{len(before)}A" if before else ""
    out.write(up + "".join(f"\r\x1b[2K{line}\n" for line in lines) + "\x1b[J")
