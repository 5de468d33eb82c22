"""Runs in this process. The loop over the steps is in Python, so that Ctrl-C can end it."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

import numpy as np

from ..base import library
from ..base.check import number_of_threads, shown
from ..base.errors import NotConverged
from ..base.files import check_folder
from ..results import Run
from . import namelists
from .row import Row
from .run_progress import RunProgress
from .simulation import RunView, warn_of

__all__ = ["run"]

_open = library.call("run_open")
_step = library.call("run_step")
_interrupt = library.call("run_interrupt")
_close = library.call("run_close")


class _CaseLike(Protocol):
    """The part of `asperity.Case` that is needed here; its text is ``str(case)``."""

    @property
    def path(self) -> Path | None:
        """The file of the case."""
        ...

    @property
    def result(self) -> Path:
        """The file of its result."""
        ...

    def kept_in(self, folder: Path) -> _CaseLike:
        """Return the case with its height maps in files of a folder."""
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

    Ctrl-C finishes the current step, writes a checkpoint and raises KeyboardInterrupt;
    ``restart=True`` continues from there with the same numbers. A step that takes much longer than
    two seconds is given up instead. SIGTERM, SIGHUP and SIGXCPU do the same in the main thread,
    unless the script handles them itself, and then have their usual effect on the process.

    Parameters
    ----------
    case : str, Path or Case
        The input file, CASE.nml, the text of an input, or an `asperity.Case`.
    output : str or Path, optional
        The file of the result. The default is ``output.file`` of the case or, if that is not set,
        the input's name with the ending .h5. A case without a file counts as ``case.nml`` in the
        current folder.
    threads : int, optional
        Number of threads; by default that of the case.
    restart : bool
        Continue from the checkpoint of an interrupted run.
    overwrite : bool
        Replace an unfinished result and its checkpoint. Otherwise this is refused.
    quiet : bool
        Do not show the progress. With False there is a bar in a notebook, and elsewhere a line on
        stderr every two seconds.
    callback : callable, optional
        Function ``callback(row, sim)`` that is called after each row. The columns of `row` are
        attributes, and `sim` is a view of the run with ``row``, ``rows`` and ``fields``. If the
        function returns False (of Python or NumPy) or raises an exception, the run ends with a
        checkpoint, from which ``restart=True`` continues. To change the load between rows use
        `asperity.Simulation`.

    Returns
    -------
    Run
        The opened result.

    Raises
    ------
    ValueError
        If the input is wrong, and the message lists all faults, or if both `restart` and
        `overwrite` are given.
    OSError
        If a file cannot be read or written, if another run is writing the result, or if the result
        is unfinished and neither `restart` nor `overwrite` is given.
    MemoryError
        If the case needs more memory than is available.
    NotConverged
        If a solver does not converge. Its ``result`` is the opened result with all rows up to that
        step.
    KeyboardInterrupt
        If Ctrl-C stops the run.

    Examples
    --------
    >>> import asperity
    >>> asperity.run("nowhere.nml")
    Traceback (most recent call last):
    ...
    FileNotFoundError: nowhere.nml: there is no such file
    """
    threads = _checked(case, output, threads, restart and overwrite, callback)
    if not isinstance(case, str | os.PathLike):
        # A result outlives this process, so height maps that are arrays are copied beside it.
        place = Path(output) if output else case.result
        check_folder(place)
        case = case.kept_in(place.parent)
    path, text = namelists.source(case)
    try:
        handle, rows, first, result, notes = _open(
            os.fsencode(path), namelists.encode(text), os.fsencode(output or b""), threads,
            int(restart), int(overwrite))
    except OSError as error:
        raise OSError(_with_arguments(str(error))) from None
    stops = _Stops()
    try:
        failure = _do_rows(handle, (first, rows), notes, result, stops, quiet, callback)
    finally:
        try:
            _close(handle)
        finally:
            stops.end()
    if failure is not None and not isinstance(failure, NotConverged):
        raise failure
    opened = Run(os.fsdecode(result.rstrip()))
    if failure is not None:
        raise NotConverged(str(failure), opened) from None
    return opened


def _do_rows(handle: int, span: tuple[int, int], notes: bytes, result: bytes, stops: _Stops,
             quiet: bool, callback: Callable[[Row, RunView], Any] | None) -> Exception | None:
    """Do the rows of a run that are left, and write a checkpoint if it stops before the last one.

    Returns
    -------
    Exception or None
        The failure of a row. Exceptions of other origin are raised after the checkpoint is written.
    """
    first, rows = span
    finished = first >= rows
    view: RunView | None = None
    progress = None if quiet else RunProgress(rows)
    try:
        warn_of(notes)
        while not finished and not stops.asked:
            try:
                finished, step, time, area, friction, notes = _step(handle, stops.numbers)
            except Exception as error:  # the row is incomplete, so that no checkpoint is written
                return error
            warn_of(notes)
            if step < 0:  # the step was given up
                break
            if callback is not None:
                view = view or RunView(handle, rows, _shape(result))
                answer = callback(view.row, view)
                if isinstance(answer, bool | np.bool_) and not answer:
                    break
            if progress is not None:
                progress.show(step, time, area, friction)
    except BaseException:  # of the callback, by Ctrl-C, or a warning that is an error
        if not finished:
            _interrupt(handle)
        raise
    if not finished:
        _interrupt(handle)
    return None


def _checked(case: Any, output: str | os.PathLike[str] | None, threads: int | None, both: bool,
             callback: object) -> int:
    """Check the arguments of `run`; return the number of threads, 0 for that of the case."""
    namelists.require_case(case)
    if callback is not None and not callable(callback):
        raise TypeError(f"callback = {shown(callback)}: must be a function of a row and the run")
    if both:
        raise ValueError("restart=True and overwrite=True are given together: give one of them")
    if output is not None and not 0 < (length := len(os.fsencode(output))) <= 1024:
        raise ValueError(f"output: has {length} characters: must have 1 to 1024")
    return 0 if threads is None else number_of_threads("threads", threads)


def _with_arguments(message: str) -> str:
    """Return a message of the library, which names options of the command, for callers of `run`."""
    for option, argument in (("--restart", "restart=True"), ("--overwrite", "overwrite=True"),
                             ("--output", "output")):
        message = message.replace(option, argument)
    return message


def _shape(result: bytes) -> tuple[int, int]:
    """Return the shape of the fields of a result."""
    grid = Run(os.fsdecode(result.rstrip())).grid
    return grid.ny, grid.nx


class _Stops:
    """Records signals that ask a run to stop, to be checked between two steps.

    Signals that the script handles itself are left alone. `end` restores the action of the system,
    and raises a signal that has arrived again. `numbers` are the signals, including that of Ctrl-C,
    for which a step may be given up.
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
