"""Cases on their way: each a process of the program, side by side on this machine.

A job is a case with the name of its files. What ends the loop, a signal too, ends the processes,
each with a checkpoint.
"""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import IO, Any

from ..base.library import call, version
from ..results import Run, open_result
from . import namelists
from .case import Case
from .progress import Progress

__all__ = ["Job", "Stops", "found_result", "is_done", "run_here", "text_of", "write_input"]

_map_checksum = call("map_checksum")

_POLL = 0.02            # s between two looks at the processes
_ECHO = 0.3             # s within which a signal to us and to our group is one
_PATIENCE = 60.0        # s that a stopped process may take for its checkpoint


@dataclass
class Job:
    """One case on its way."""

    values: dict[str, Any]
    case: Case | None = None
    name: str = ""
    path: Path = field(default_factory=Path)        # of the result
    status: int | None = None                       # None: not run to an end
    message: str = ""
    process: subprocess.Popen[bytes] | None = None
    output: IO[bytes] | None = None
    restarted: bool = False
    started: float = 0.0


def is_done(job: Job) -> bool:
    """Return whether a finished result of this very input and version is there."""
    run = found_result(job)
    return run is not None and run.finished and run.version == version()


def found_result(job: Job) -> Run | None:
    """Return a result of this very input, None where there is none."""
    if not job.path.exists():
        return None
    try:
        run = open_result(job.path)
    except OSError:
        return None
    return run if run.input == text_of(job) and _has_the_same_maps(run, job) else None


def _has_the_same_maps(run: Run, job: Job) -> bool:
    """Return whether the height maps that are files hold what the result was computed with."""
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
    """Return the input of a case as it is written beside its result."""
    assert job.case is not None
    case = job.case.copy()
    case.output.file = None
    case._follow(job.path.parent)
    return str(case)


def write_input(job: Job) -> Path:
    """Write the input of a job beside its result; return its path."""
    path = job.path.with_suffix(".nml")
    path.write_bytes(namelists.encode(text_of(job)))
    return path


def run_here(waiting: list[Job], command: str, side_by_side: int, threads: int, resume: bool,
             progress: Progress) -> None:
    """Run jobs, some at a time; whatever ends this ends them.

    Parameters
    ----------
    waiting : list of Job
        What is to be run, in this order; their status and message are set.
    command : str
        The program.
    side_by_side, threads : int
        Processes at a time, and the threads of each.
    resume : bool
        Whether to go on from a checkpoint that is there.
    progress : Progress
        What tells how far it is.
    """
    queue = list(reversed(waiting))
    running: list[Job] = []
    with Stops() as stops:
        try:
            while (queue or running) and not stops.asked:
                while queue and len(running) < side_by_side and not stops.asked:
                    job = queue.pop()
                    running.append(job)
                    _start(job, command, threads, restart=resume and found_result(job) is not None)
                    progress.show(len(running))
                for job in list(running):
                    assert job.process is not None
                    if job.process.poll() is None:
                        continue
                    if _finish(job):
                        _start(job, command, threads, restart=False)
                    else:
                        running.remove(job)
                        progress.done(job.name, job.message if job.status else None,
                                      time.monotonic() - job.started, len(running))
                time.sleep(_POLL if running else 0.0)
        finally:
            progress.end()
            _stop(running, stops)


class Stops:
    """SIGINT and SIGTERM as a number to look at, so that none of them cuts a call in two.

    An exception out of a handler may come between any two instructions: within the start of a
    process, which then goes on unknown to us, or while subprocess holds its lock, which then stays
    held. So the signals are counted here; at the end they are what they were before: SIGINT
    KeyboardInterrupt, or what another handler makes of it, SIGTERM the end with status 143.
    """

    def __init__(self) -> None:
        self.asked: list[int] = []
        self._last = 0.0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stops:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                # Who started us with a signal ignored, as a shell does in the background, keeps it.
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
            # None: not set by Python, and not to be set by it.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        if not self.asked:
            return
        if self.asked[0] == signal.SIGTERM and self._before[signal.SIGTERM] == signal.SIG_DFL:
            raise SystemExit(128 + signal.SIGTERM)
        signal.raise_signal(self.asked[0])


def _start(job: Job, command: str, threads: int, restart: bool) -> None:
    """Write the input and start the program, in a session of its own: Ctrl-C is passed on by us."""
    path = write_input(job)
    job.restarted = restart
    job.started = time.monotonic()
    job.process = None
    job.output = tempfile.TemporaryFile()  # noqa: SIM115 - closed where the process ends
    words = [command, "run", path.name, "--output", job.path.name, "--threads", str(threads),
             "--quiet", "--restart" if restart else "--overwrite"]
    job.process = subprocess.Popen(words, cwd=path.parent, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=job.output,
                                   start_new_session=True)


def _finish(job: Job) -> bool:
    """Take what an ended process leaves; return whether it has to be run anew."""
    assert job.process is not None and job.output is not None
    job.output.seek(0)
    told = job.output.read().decode(errors="replace").strip()
    job.output.close()
    status = job.process.returncode
    if job.restarted and status in (2, 3):
        return True  # no checkpoint that fits
    job.status = status
    if status:
        reason = told or f"the program ended with status {status}"
        job.message = f"killed by signal {-status}" if status < 0 else reason
    elif told:
        job.message = told
    return False


def _stop(running: list[Job], stops: Stops) -> None:
    """Let processes finish the step in hand and write a checkpoint; at a second Ctrl-C, kill."""
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
