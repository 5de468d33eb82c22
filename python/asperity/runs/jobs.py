"""Runs of many cases on this machine, each in a process of the program.

A job is a case with the names of its files. If the loop over the jobs ends early, for example by a
signal, all processes are stopped and write a checkpoint.
"""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FrameType
from typing import IO, Any

from ..base.files import new_file
from ..base.library import call, version
from ..results import Run, open_result
from . import namelists
from .case import Case
from .progress import SweepProgress

__all__ = ["PAUSE", "UNSUITABLE", "Job", "Stops", "begins_again", "environment", "found_result",
           "is_done", "is_used", "may_continue", "new_ends", "record_end", "run_here", "take_end",
           "text_of", "write_input"]

_map_checksum = call("map_checksum")

_POLL = 0.02            # time between two checks of the processes, s
_ECHO = 0.3             # two signals within this time, s, count as one (to us and to our group)
_PATIENCE = 60.0        # time that a stopped process has for its checkpoint, s
PAUSE = 1.0             # before a case that another process is running is looked at again, s
# Words of the program about a file from which it cannot continue, with status 3. Other causes of
# this status, such as a full disk, leave the checkpoint as it is for the next call. The words are
# such that the name of a file, which the message contains, hardly has them.
UNSUITABLE = (": is damaged", ": the file is damaged", ": the checkpoint is damaged", ": is empty:",
              ": its end is missing: ", " has no checkpoint from which to continue",
              ": there is nothing to continue", ": is not an HDF5 file")


@dataclass
class Job:
    """One case of a sweep or a curve, and the state of its run."""

    values: dict[str, Any]
    case: Case | None = None
    name: str = ""
    path: Path = field(default_factory=Path)        # the result
    status: int | None = None                       # exit status; None: the run has not ended
    message: str = ""
    process: subprocess.Popen[bytes] | None = None
    output: IO[bytes] | None = None
    restarted: bool = False
    started: float | None = None                    # on the monotonic clock, s
    due: float = 0.0                                # when to look again at a case in use

    @property
    def seconds(self) -> float | None:
        """Time since the start of the run, s; None if it was not started here."""
        return None if self.started is None else time.monotonic() - self.started


def is_done(job: Job) -> bool:
    """Return whether there is a complete result of the same input and version."""
    run = found_result(job)
    return run is not None and run.finished and run.version == version()


def take_end(job: Job) -> bool:
    """Record the end of a run of the same input, if there is one, and return whether there is.

    Its result is complete (status 0), or a solver did not converge (status 4).
    """
    run = found_result(job)
    if run is None:
        return False
    if run.finished and run.version == version():
        job.status, job.message = 0, ""
        return True
    if not run.finished and "converge" in run.outcome:
        job.status, job.message = 4, run.outcome
        return True
    return False


def new_ends(waiting: list[Job], resume: bool) -> Callable[[Job], bool]:
    """Return a function that takes the end of a job if another process makes it from now on.

    Results that are there already are not taken: they do not count, or the job would not wait.
    Without `resume` all jobs are run in any case.
    """
    old = {job.name for job in waiting if resume and take_end(replace(job))}
    return lambda job: resume and job.name not in old and take_end(job)


def found_result(job: Job) -> Run | None:
    """Return the result if its input and height maps are those of the job, otherwise None.

    A result with a damaged history does not count, because its numbers may be wrong.
    """
    if not job.path.exists():
        return None
    try:
        run = open_result(job.path)
    except OSError:
        return None
    if run.has_damaged_rows or run.input != text_of(job):
        return None
    return run if _has_the_same_maps(run, job) else None


def may_continue(job: Job) -> bool:
    """Return whether a run should try to continue before it begins anew.

    This is so where the result is of the same input, and where the file cannot be read: another
    process may be writing it, and may have completed it before our run looks at it.
    """
    try:
        open_result(job.path)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return found_result(job) is not None


def _has_the_same_maps(run: Run, job: Job) -> bool:
    """Return whether the files of height maps are still those of the result (by checksums)."""
    assert job.case is not None
    case = job.case.copy()
    case._follow(job.path.parent)
    found = []
    for term in case.surface:
        if str(term.shape or "").lower() != "file":
            continue
        path, dataset = job.path.parent / str(term.file), str(term.dataset or " ")
        try:
            (checksum,) = _map_checksum(os.fsencode(path), namelists.encode(dataset),
                                        run.grid.nx, run.grid.ny)
        except (OSError, ValueError):
            return False
        found.append(checksum.decode())
    return " ".join(found) == run.attributes.get("height_maps", "")


def text_of(job: Job) -> str:
    """Return the text of the input that is written beside the result."""
    assert job.case is not None
    case = job.case.copy()
    case.output.file = None
    case._follow(job.path.parent)
    return str(case)


def write_input(job: Job) -> Path:
    """Write the input of a job beside its result, and return its path."""
    path = job.path.with_suffix(".nml")
    with new_file(path) as new:  # which names the file in its message on a full disk
        new.write_bytes(namelists.encode(text_of(job)))
    return path


def begins_again(status: int, message: str) -> bool:
    """Return whether a case has to be run from its beginning, because a restart was not possible.

    Parameters
    ----------
    status : int
        Exit status of the restart.
    message : str
        What it printed.

    Returns
    -------
    bool
        Whether there is no checkpoint, or none from which the case can continue.
    """
    return status == 2 or (status == 3 and any(words in message for words in UNSUITABLE))


def environment() -> dict[str, str]:
    """Return the environment of a run that stops with a checkpoint when this process has ended."""
    return {**os.environ, "ASPERITY_PARENT": str(os.getpid())}


def run_here(waiting: list[Job], command: str, side_by_side: int, threads: int, resume: bool,
             progress: SweepProgress) -> None:
    """Run jobs, several at a time. If this function ends early, it stops the running processes.

    Parameters
    ----------
    waiting : list of Job
        The jobs, in this order. Their status and message are set.
    command : str
        Path of the program.
    side_by_side, threads : int
        Number of processes at a time, and number of threads of each.
    resume : bool
        Whether to continue from checkpoints, and to take results that another process completes
        while these jobs are waiting.
    progress : SweepProgress
        The display of the progress.
    """
    queue = list(waiting)
    running: list[Job] = []
    take_new_end = new_ends(waiting, resume)

    def count(job: Job) -> None:
        progress.done(job.name, job.message if job.status else None, job.seconds, len(running))

    with Stops() as stops:
        try:
            while (queue or running) and not stops.asked:
                ready = [job for job in queue if job.due <= time.monotonic()]
                for job in ready[:side_by_side - len(running)]:
                    queue.remove(job)
                    if take_new_end(job):
                        count(job)
                    elif not stops.asked:
                        running.append(job)
                        _start(job, command, threads, resume and may_continue(job))
                        progress.show(len(running))
                for job in list(running):
                    assert job.process is not None
                    if job.process.poll() is None:
                        continue
                    if _finish(job) and not take_new_end(job):
                        _start(job, command, threads, restart=False)
                        continue
                    running.remove(job)
                    if is_used(job):
                        if not job.due:
                            progress.note(f"{job.name} waits for another process that runs it")
                        job.due = time.monotonic() + PAUSE
                        queue.append(job)
                    else:
                        count(job)
                time.sleep(_POLL if running or queue else 0.0)
        finally:
            progress.end()
            _stop(running, stops)


_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stops:
    """Collects SIGINT, SIGTERM and SIGHUP, so that they cannot interrupt a call halfway.

    A signal handler that raises an exception may do so between any two instructions. If this
    happens while a process is being started, the process continues without our knowledge; if it
    happens while subprocess holds its lock, the lock is never released. Here the signals are only
    recorded. At the end they have their usual effect: SIGINT raises KeyboardInterrupt or calls the
    handler that was set before, SIGTERM ends the process with status 143, and SIGHUP (the terminal
    was closed) with status 129.
    """

    def __init__(self) -> None:
        self.asked: list[int] = []
        self._last = 0.0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stops:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, *_ENDING):
                # A signal that was ignored when we started, as in the background of a shell, stays
                # ignored.
                if signal.getsignal(number) != signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._note)
        return self

    def _note(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if not self.asked or now - self._last > _ECHO:
            self.asked.append(number)
        self._last = now

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            # None means that the handler was not set by Python, which therefore cannot restore it.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        if not self.asked:
            return
        first = self.asked[0]
        if first in _ENDING and self._before[first] == signal.SIG_DFL:
            raise SystemExit(128 + first)
        signal.raise_signal(first)


def _start(job: Job, command: str, threads: int, restart: bool) -> None:
    """Write the input and start the program in a new session, so that only we pass on Ctrl-C."""
    path = write_input(job)
    job.restarted = restart
    job.started = time.monotonic()
    job.process = None
    job.output = tempfile.TemporaryFile()  # noqa: SIM115 - closed after the process has ended
    words = [command, "run", path.name, "--output", job.path.name, "--threads", str(threads),
             "--quiet", "--restart" if restart else "--overwrite"]
    job.process = subprocess.Popen(words, cwd=path.parent, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=job.output,
                                   start_new_session=True, env=environment())


def _finish(job: Job) -> bool:
    """Record status and messages of a process that has ended; return whether to run it again."""
    assert job.process is not None and job.output is not None
    job.output.seek(0)
    printed = job.output.read().decode(errors="replace").strip()
    job.output.close()
    status = job.process.returncode
    if job.restarted and begins_again(status, printed):
        return True
    record_end(job, status, printed)
    return False


def record_end(job: Job, status: int, printed: str) -> None:
    """Set the status of a job, and its message: the reason of a failure, or the warnings.

    Parameters
    ----------
    job : Job
    status : int
        Exit status of the program; -N if signal N has killed it.
    printed : str
        What it has printed on stderr.
    """
    job.status = status
    if status < 0:
        job.message = f"killed by signal {-status}"
    elif status:
        job.message = _reason_first(printed) or f"the program ended with status {status}"
    else:
        job.message = "\n".join(line.removeprefix("warning: ") for line in printed.splitlines())


def _reason_first(printed: str) -> str:
    r"""Return what a failed program has printed, with the reason before the warnings.

    The program prints its warnings first.

    Examples
    --------
    >>> print(_reason_first("warning: &surface: short waves\nstep 0: the solver did not converge"))
    step 0: the solver did not converge
    warning: &surface: short waves
    """
    return "\n".join(sorted(printed.splitlines(), key=lambda line: line.startswith("warning: ")))


def is_used(job: Job) -> bool:
    """Return whether a run was refused because another process is writing its result."""
    return job.status == 3 and ": is in use by " in job.message


def _stop(running: list[Job], stops: Stops) -> None:
    """Stop processes after the current step, with a checkpoint; a second Ctrl-C kills them."""
    processes = [job.process for job in running if job.process is not None]
    for process in processes:
        process.send_signal(signal.SIGINT)
    end = time.monotonic() + _PATIENCE
    while (any(process.poll() is None for process in processes)
           and len(stops.asked) < 2 and time.monotonic() < end):
        time.sleep(_POLL)
    for process in processes:
        if process.poll() is None:
            process.kill()
            process.wait()
