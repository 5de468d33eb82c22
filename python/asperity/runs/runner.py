"""Runs in process: the loop over the steps is Python's, so that Ctrl-C stops between two steps."""

from __future__ import annotations

import os
import signal
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

import numpy as np

from ..base import library
from ..base.check import whole
from ..base.errors import NotConverged
from ..results import Run
from . import namelists
from .row import Row
from .run_progress import Progress
from .simulation import RunView

__all__ = ["run"]

_open = library.call("run_open")
_step = library.call("run_step")
_interrupt = library.call("run_interrupt")
_close = library.call("run_close")


class _CaseLike(Protocol):
    """What is needed of an `asperity.Case`: its text is ``str(case)``."""

    path: Path | None
    result: Path

    def kept_in(self, folder: Path) -> _CaseLike:
        """Return the case with its height maps kept in files of a folder."""
        ...


def run(
    case: str | os.PathLike[str] | _CaseLike,
    *,
    output: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    restart: bool = False,
    overwrite: bool = False,
    quiet: bool = True,
    callback: Callable[[Row, RunView], Any] | None = None,
) -> Run:
    """Run a case in this process, as the command ``asperity run`` does, and open its result.

    Ctrl-C finishes the step in hand, writes a checkpoint and raises KeyboardInterrupt;
    ``restart=True`` goes on from there to the same numbers. A step with friction that takes much
    longer than two seconds is given up instead. SIGTERM, SIGHUP and SIGXCPU do the same
    in the main thread, unless the script handles them itself, and then end the process as they
    would have without the run.

    Parameters
    ----------
    case : str, path or Case
        The input, CASE.nml; or its text, or an `asperity.Case`.
    output : str or path, optional
        The result; what the case says if left out, which is the input's name with .h5 unless
        ``output.file`` names another. A case without a file counts as ``case.nml`` in the
        current folder.
    threads : int, optional
        Number of threads; what the case says if left out.
    restart : bool
        Go on from the checkpoint of an interrupted run.
    overwrite : bool
        Replace an unfinished run and its checkpoint, which is refused otherwise.
    quiet : bool
        Do not show the progress: a bar in a notebook, elsewhere a line on stderr every two
        seconds.
    callback : callable, optional
        Called after each row as ``callback(row, sim)``, with the row (its columns are attributes)
        and a view of the run with ``row``, ``rows`` and ``fields``. Where it returns False, the run
        ends cleanly with a checkpoint, from which ``restart=True`` goes on. To change the load
        between rows use `asperity.Simulation`.

    Returns
    -------
    Run
        The opened result.

    Raises
    ------
    ValueError
        If the input is wrong; all faults are named.
    OSError
        If a file cannot be read or written, if another run is writing the result, or if the result
        holds an unfinished run and neither `restart` nor `overwrite` is given.
    MemoryError
        If the case needs more memory than there is.
    NotConverged
        If a solver fails; its ``result`` is the opened result, with all steps up to that one.

    Examples
    --------
    >>> import asperity
    >>> asperity.run("nowhere.nml")
    Traceback (most recent call last):
    ...
    OSError: nowhere.nml: there is no such file
    """
    if threads is not None:
        threads = whole("threads", threads)
    target = b"" if output is None else os.fsencode(output)
    if output is not None and not 0 < len(target) <= 1024:
        raise ValueError(f"output: has {len(target)} characters: must have 1 to 1024")
    if not isinstance(case, str | os.PathLike):
        # A result outlives this process: height maps that are arrays are kept beside it.
        case = case.kept_in((Path(output) if output else case.result).parent)
    path, text = namelists.source(case)
    handle, rows, first, result, told = _open(os.fsencode(path), namelists.encode(text), target,
                                              threads or 0, int(restart), int(overwrite))
    failure: NotConverged | None = None
    view: RunView | None = None
    stops = _Stops()
    progress = None if quiet else Progress(rows)
    try:
        _warn(told)
        finished = first >= rows
        while not finished and not stops.asked:
            finished, step, time, area, friction, told = _step(handle, stops.numbers)
            _warn(told)
            if step < 0:  # given up
                break
            if callback is not None:
                view = view or RunView(handle, rows, _shape(result))
                if callback(view.row, view) is False and not finished:
                    break
            if progress is not None:
                progress.show(step, time, area, friction)
        if not finished:
            _interrupt(handle)
    except KeyboardInterrupt:
        _interrupt(handle)
        raise
    except NotConverged as error:
        failure = error
    finally:
        _close(handle)
        stops.end()
    opened = Run(os.fsdecode(result.rstrip()))
    if failure is not None:
        raise NotConverged(str(failure), opened) from None
    return opened


def _shape(result: bytes) -> tuple[int, int]:
    """Return the shape of the fields of a result."""
    grid = Run(os.fsdecode(result.rstrip())).grid
    return grid.ny, grid.nx


class _Stops:
    """Signals that ask to stop, as a number to look at between two steps.

    Only those whose action is still that of the system are taken: a script that handles them itself
    keeps its handlers. `end` puts the system's action back and lets a signal that came take it.
    `numbers` are the signals, with that of Ctrl-C, that a step in hand may be given up for.
    """

    def __init__(self) -> None:
        self.asked = 0
        self.numbers = np.zeros(0, dtype=np.int32)
        self._taken: list[int] = []
        if threading.current_thread() is not threading.main_thread():
            return
        for name in ("SIGTERM", "SIGHUP", "SIGXCPU"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) == signal.SIG_DFL:
                signal.signal(number, self._note)
                self._taken.append(number)
        default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        self.numbers = np.array([*self._taken, *[signal.SIGINT] * default], dtype=np.int32)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.asked = number

    def end(self) -> None:
        for number in self._taken:
            signal.signal(number, signal.SIG_DFL)
        if self.asked:
            signal.raise_signal(self.asked)


def _warn(told: bytes) -> None:
    """Raise the warnings of the library as those of Python."""
    for line in told.decode(errors="replace").strip().splitlines():
        warnings.warn(line, UserWarning, stacklevel=3)
