"""The ways to run jobs: on this machine, by an executor, or by Slurm."""

from __future__ import annotations

import concurrent.futures
import hashlib
import json
import os
import shlex
import shutil
import subprocess
import time
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import NamedTuple

from ..base.check import number_of_threads, shown, whole
from ..base.files import write_text
from .case import Case
from .jobs import (
    PAUSE,
    UNSUITABLE,
    Job,
    Stops,
    begins_again,
    environment,
    is_done,
    is_used,
    may_continue,
    new_ends,
    record_end,
    run_here,
    write_input,
)
from .program import program
from .progress import SweepProgress

__all__ = ["Means", "means_of", "run_file", "run_jobs", "share_of_processors", "submit"]

_POLL = 0.2             # time between two checks of an executor, s
_QUEUE = "slurm.json"   # record of the job that was submitted from a folder


class Means(NamedTuple):
    """The way in which jobs are run.

    Attributes
    ----------
    side_by_side : int or None
        Largest number of runs at a time. None means all that the executor or Slurm starts.
    threads : int
        Number of threads of each run.
    resume : bool
        Whether to continue from checkpoints.
    executor : concurrent.futures.Executor or None
        Executor that runs the jobs instead.
    slurm : str or None
        Options of ``sbatch``, if Slurm runs the jobs instead.
    """

    side_by_side: int | None
    threads: int = 1
    resume: bool = True
    executor: Executor | None = None
    slurm: str | None = None


def share_of_processors(jobs: int | None, threads: int) -> tuple[int, int]:
    """Return the number of runs at a time and the number of threads of each.

    Parameters
    ----------
    jobs : int or None
        Largest number of runs at a time; None means as many as the processors allow.
    threads : int
        Number of threads of each run.

    Returns
    -------
    (int, int)
        Runs at a time, and threads of each.

    Raises
    ------
    ValueError
        If a number is not positive, or there are fewer processors than `threads`.
    """
    cores = (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity")
             else os.cpu_count() or 1)
    if jobs is not None:
        jobs = whole("jobs", jobs)
    threads = whole("threads", threads)
    if threads > cores:
        raise ValueError(f"threads = {threads}: must be at most the {cores} processors")
    return min(jobs or cores, max(1, cores // threads)), threads


def means_of(jobs: int | None, threads: int, resume: bool, executor: Executor | None,
             slurm: str | None) -> Means:
    """Return the way in which jobs are run, from the arguments of a call.

    Raises
    ------
    ValueError
        If a number is not positive, there are fewer processors than `threads` for runs on this
        machine, the executor is none, both an executor and Slurm are given, or Slurm without
        `resume`.
    """
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ValueError(f"executor = {shown(executor)}: must be a concurrent.futures.Executor")
    if executor is None and slurm is None:
        return Means(*share_of_processors(jobs, threads), resume)
    if executor is not None and slurm is not None:
        raise ValueError("executor and slurm: give only one of them")
    if slurm is not None and not resume:
        raise ValueError("resume = False (--no-resume): not with slurm (--slurm): the same call"
                         " must find the results of the jobs")
    most = whole("jobs", jobs) if jobs is not None else None
    return Means(most, number_of_threads("threads", threads), resume, executor, slurm)


def run_jobs(waiting: list[Job], folder: Path, progress: SweepProgress, means: Means) -> None:
    """Run jobs in the chosen way.

    Parameters
    ----------
    waiting : list of Job
        The jobs. Their status and message are set.
    folder : Path
        Folder of their files.
    progress : SweepProgress
        The display of the progress.
    means : Means
        The way in which they are run.
    """
    if not waiting:
        progress.end()
    elif means.slurm is not None:
        said = submit(waiting, folder, means.slurm, means.threads, means.side_by_side)
        for job in waiting:
            job.message = said
    elif means.executor is not None:
        _run_by_executor(waiting, means, progress)
    else:
        run_here(waiting, program(), means.side_by_side or 1, means.threads, means.resume,
                 progress)


# ---- executors -------------------------------------------------------------------------------


def run_file(path: str, threads: int, restart: bool) -> tuple[int, str]:
    """Run an input file. The workers of an executor call this function.

    Between the order and the start of the work, another process may complete the same case. Its
    result is then kept.

    Parameters
    ----------
    path : str
        The input, NAME.nml; the result is NAME.h5 beside it.
    threads : int
        Number of threads.
    restart : bool
        Whether to continue from a checkpoint. If there is no suitable one, the case is run from its
        beginning.

    Returns
    -------
    (int, str)
        Exit status of the program, and its output on stderr.
    """
    file = Path(path)
    result = file.with_suffix(".h5")
    words = [program(), "run", file.name, "--output", result.name, "--threads", str(threads),
             "--quiet"]
    for more in ["--restart", "--overwrite"] if restart else ["--overwrite"]:
        done = subprocess.run([*words, more], cwd=file.parent, stdin=subprocess.DEVNULL,
                              capture_output=True, start_new_session=True, env=environment(),
                              check=False)
        printed = done.stderr.decode(errors="replace").strip()
        if not begins_again(done.returncode, printed):
            break
        if restart and is_done(Job({}, Case.read(file), file.stem, result)):
            return 0, ""
    return done.returncode, printed


def _run_by_executor(waiting: list[Job], means: Means, progress: SweepProgress) -> None:
    """Submit the jobs to the executor, as many at a time as allowed, and wait for all of them.

    A case that another process is running is submitted again later.
    """
    ready = list(waiting)
    take_new_end = new_ends(waiting, means.resume)
    running: dict[Future[tuple[int, str]], Job] = {}
    most = means.side_by_side or len(ready)
    with Stops() as stops:
        try:
            while (ready or running) and not stops.asked:
                due = [job for job in ready if job.due <= time.monotonic()]
                for job in due[:most - len(running)]:
                    ready.remove(job)
                    if take_new_end(job):
                        progress.done(job.name, job.message if job.status else None, job.seconds,
                                      len(ready) + len(running))
                    else:
                        running[_submit_to_executor(job, means)] = job
                for future in _ended(running):
                    job = running.pop(future)
                    _take(job, future)
                    if is_used(job):
                        if not job.due:
                            progress.note(f"{job.name} waits for another process that runs it")
                        job.due = time.monotonic() + PAUSE
                        ready.append(job)
                        continue
                    progress.done(job.name, job.message if job.status else None,
                                  job.seconds, len(ready) + len(running))
        finally:
            for future in running:
                future.cancel()
            progress.end()


def _ended(running: dict[Future[tuple[int, str]], Job]) -> set[Future[tuple[int, str]]]:
    """Wait for a short time, and return the runs that have ended."""
    if not running:
        time.sleep(_POLL)
        return set()
    return concurrent.futures.wait(running, timeout=_POLL,
                                   return_when=concurrent.futures.FIRST_COMPLETED).done


def _submit_to_executor(job: Job, means: Means) -> Future[tuple[int, str]]:
    """Write the input of a job, and let the executor run it."""
    assert means.executor is not None
    restart = means.resume and may_continue(job)
    path = write_input(job).resolve()
    job.started = time.monotonic()
    return means.executor.submit(run_file, str(path), means.threads, restart)


def _take(job: Job, future: Future[tuple[int, str]]) -> None:
    """Record what a worker returned, or the exception that ended it."""
    error = future.exception()
    if error is not None:
        job.status, job.message = 1, f"the worker failed: {type(error).__name__}: {error}"
        return
    record_end(job, *future.result())


# ---- Slurm -----------------------------------------------------------------------------------

_SCRIPT = """#!/bin/sh
# This task runs one case of the list in {names}: the number of the task is its line, from 0.
cd {folder} || exit 1
name=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" {names})
run() {{ {program} run "$name.nml" --output "$name.h5" --threads {threads} --quiet "$@"; }}

# A task that is started again after its case was completed has nothing to do.
if [ "$name.h5" -nt "$name.nml" ] && {program} info "$name.h5" | grep -q '^finished *yes'; then
  exit 0
fi
if [ -f "$name.h5" ]; then
  said=$(run --restart 2>&1)
  status=$?
  [ -z "$said" ] || printf '%s\\n' "$said" >&2
  # Without a suitable checkpoint the case is run from its beginning. After any other failure, such
  # as a full disk, the checkpoint stays as it is.
  case $status:$said in
    2:* | {unsuitable}) ;;
    *) exit $status ;;
  esac
fi
run --overwrite
"""


def submit(waiting: list[Job], folder: Path, options: str, threads: int, most: int | None) -> str:
    """Submit jobs to Slurm as one job array, unless earlier ones are still in the queue.

    Parameters
    ----------
    waiting : list of Job
        The jobs.
    folder : Path
        Folder of their files, which the nodes must see.
    options : str
        Further options of ``sbatch``.
    threads : int
        Number of threads of each run.
    most : int or None
        Largest number of runs at a time; None means as many as Slurm starts.

    Returns
    -------
    str
        A sentence about what was done.

    Raises
    ------
    OSError
        If ``sbatch`` is not found or fails.
    """
    known = _queued(folder)
    if known is not None:
        return f"in the queue of Slurm as job {known}"
    command = shutil.which("sbatch")
    if command is None:
        raise FileNotFoundError("sbatch is not found: `slurm` needs a machine that submits to"
                                " Slurm")
    for job in waiting:
        write_input(job)
    # Each array has its own list, because an earlier array may still be reading its own.
    listed = "".join(f"{job.name}\n" for job in waiting)
    names = f"waiting-{hashlib.sha256(listed.encode()).hexdigest()[:8]}.txt"
    write_text(folder / names, listed)
    script = folder / "job.sh"
    write_text(script, _SCRIPT.format(
        names=names, folder=shlex.quote(str(folder.resolve())), threads=threads,
        program=shlex.quote(program()),
        unsuitable=" | ".join(f'3:*"{words}"*' for words in UNSUITABLE)))
    tasks = f"0-{len(waiting) - 1}" + ("" if most is None else f"%{most}")
    words = [command, "--parsable", f"--array={tasks}", f"--cpus-per-task={threads}",
             f"--chdir={folder.resolve()}", *shlex.split(options), str(script.resolve())]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError(f"sbatch ended with status {done.returncode}: {done.stderr.strip()}")
    number = done.stdout.strip().split(";")[0]
    write_text(folder / _QUEUE, json.dumps({"job": number, "cases": len(waiting)}) + "\n")
    return f"submitted to Slurm as job {number}"


def _queued(folder: Path) -> str | None:
    """Return the job that was submitted from a folder, if it is still in the queue."""
    try:
        number = str(json.loads((folder / _QUEUE).read_text())["job"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    command = shutil.which("squeue")
    if command is None:
        return None
    done = subprocess.run([command, "--noheader", f"--jobs={number}"], capture_output=True,
                          text=True, check=False)
    return number if done.returncode == 0 and done.stdout.strip() else None
