"""The state of a run: finished, stopped, still running, or perhaps killed.

The file of a killed run looks like that of a run that continues. The lock beside the result tells
them apart: the system releases it when the process that holds it ends. If the lock cannot be seen,
because the run is on another machine, the time since the file was last written is compared with the
time that a row takes.
"""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.durations import short_time
from ..base.names import counted

if TYPE_CHECKING:
    from .result_file import ResultFile

__all__ = ["held", "how_to_continue", "note_of", "rows_of", "seems_dead", "silence", "standing",
           "time_of_row"]

LAST = 20  # number of last rows from which the time of the next one is estimated
PATIENCE = 20.0  # factor on the longest of them before a run counts as killed
LEAST = 15.0  # shortest waiting time, s, because writing a large snapshot may take as long


def rows_of(run: ResultFile) -> str:
    """Return the number of rows in words.

    For an unfinished run the text contains the expected number, if the file has it: '220 of 229
    rows'. Otherwise it is, for example, '1 row'.
    """
    rows, expected = run.history.rows, int(run.attributes.get("expected_rows", 0) or 0)
    if expected and not run.finished:
        return f"{rows} of {expected} rows"
    return counted(rows, "row")


def silence(run: ResultFile) -> float | None:
    """Return the time since the file was last written, s, or None if the file is gone."""
    try:
        return max(0.0, time.time() - run.path.stat().st_mtime)
    except OSError:
        return None


def time_of_row(run: ResultFile) -> float | None:
    """Return the time that the slowest of the last rows took, s, or None if it is not known."""
    if "seconds" not in run.history or not run.history.rows:
        return None
    last = np.asarray(run.history["seconds"][-LAST:], dtype=float)
    last = last[np.isfinite(last)]
    return float(last.max()) if len(last) else None


def _beside(path: Path, ending: str) -> Path:
    """Return the name of a file that a run keeps beside its result: only a last .h5 is replaced."""
    return path.with_suffix(ending) if path.suffix == ".h5" else Path(f"{path}{ending}")


def held(run: ResultFile) -> bool | None:
    """Return whether a process holds the lock of a result; None if this cannot be determined.

    An attempt to take the lock could prevent a run from starting at that moment. Linux's list of
    all locks is read instead, as by `state_of_lock` of the program (file_lock.f90): a file is known
    by its inode, because on some file systems the list has another number of the device than
    `stat`.
    """
    path = Path(os.path.realpath(run.path))
    lock = _beside(path, ".lock")
    try:
        words = lock.read_text(errors="replace").split()
        if words[3:5] != ["on", platform.node()]:  # asperity process NUMBER on HOST since ...
            return None
        inode = str(lock.stat().st_ino)
        locks = (line.split() for line in Path("/proc/locks").read_text().splitlines())
        return any("FLOCK" in words and any(word.split(":")[2:] == [inode] for word in words)
                   for words in locks)
    except OSError:
        return None


def seems_dead(run: ResultFile) -> bool:
    """Return whether a run that has not recorded its end seems to have been killed."""
    if run.finished or run.outcome != "running":
        return False
    alive = held(run)
    if alive is not None:
        return not alive
    quiet, row = silence(run), time_of_row(run)
    return quiet is not None and row is not None and quiet > max(LEAST, PATIENCE * row)


def note_of(run: ResultFile) -> str:
    """Return a note on an unfinished run: why it ended, or whether it continues; '' otherwise."""
    if run.finished:
        return ""
    if run.outcome != "running":
        return run.outcome
    quiet, row = silence(run), time_of_row(run)
    if quiet is None:
        return ""
    text = f"last written {short_time(quiet)} ago"
    if held(run) is False:
        text += ", and its process has ended"
    elif seems_dead(run):
        text += f", and a row takes up to {short_time(row or 0.0)}: perhaps no longer running"
    return text


def standing(run: ResultFile) -> str:
    """Return the state of the run in words."""
    note = note_of(run)
    return "finished" if run.finished else f"not finished{', ' if note else ''}{note}"


def how_to_continue(run: ResultFile) -> str:
    """Return how a run that ended too early is continued. Without a checkpoint it cannot be."""
    if _beside(run.path, ".checkpoint.h5").exists():
        return "--restart continues from the last checkpoint"
    return "there is no checkpoint: --overwrite starts again"
