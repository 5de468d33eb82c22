"""Sweeps: many runs of a case with different values, side by side, and one table of results."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from ..base.check import choice, shown
from ..base.files import make_folder, write_text
from ..base.notices import warn_user
from ..results import Run, open_result
from ..results.column_types import HistoryColumns
from ..results.steady import steady_mean
from . import namelists
from .case import Case
from .jobs import Job, is_done
from .means import means_of, run_jobs
from .progress import SweepProgress
from .sweep_table import Failure, Sweep, SweepError, column

__all__ = ["sweep"]

# A parameter: group, number of the group, variable.
_PARAMETER = re.compile(r"\s*(\w+)\s*(?:\[\s*(-?\d+)\s*\])?\s*\.\s*(\w+)\s*")
_LONGEST_NAME = 120     # largest number of characters of a file's name


def sweep(
    base: str | os.PathLike[str] | Case,
    parameters: Mapping[str | tuple[str, ...], Sequence[Any]],
    *,
    zip: bool = False,
    folder: str | os.PathLike[str] | None = None,
    jobs: int | None = 1,
    threads: int = 1,
    resume: bool = True,
    measure: Callable[[Run], Mapping[str, Any]] | str | None = None,
    errors: str = "raise",
    quiet: bool = False,
    executor: Executor | None = None,
    slurm: str | None = None,
) -> Sweep:
    """Run a case with every combination of some values, side by side, and return a table.

    Each case is run in a process of the program. Its input and its result are in `folder`, under a
    name made of the values, such as ``velocity_x=0.1.nml`` and ``velocity_x=0.1.h5``;
    ``sweep.json`` lists them. An interrupted sweep resumes where it stopped: complete results of
    the same input, version and height maps are reused, and other cases continue from their
    checkpoint or are run again. You can add values later.

    Parameters
    ----------
    base : str, Path or Case
        The case: an input file, the text of an input, or an `asperity.Case`.
    parameters : dict
        Lists of values by names of the form ``"group.variable"``. If a group is repeated,
        ``"phase[2].velocity_x"`` is that of the second one (counted from 1, as in the program's
        messages). Without a number there must be just one such group, or, for ``phase``, all phases
        that give the variable are changed. Variables that change together have a tuple of names:
        ``{("grid.nx", "grid.ny"): [(64, 32), (128, 64)]}``. The value None removes the variable.
    zip : bool
        Go through the lists in parallel instead of forming all combinations. They must have the
        same length.
    folder : str or Path, optional
        Folder of the results. The default is ``NAME_sweep`` beside the input NAME.nml, or ``sweep``
        in the current folder for a case without a file.
    jobs : int or None
        Largest number of runs at a time. On this machine there are never more than the processors
        allow with `threads` each, and None means as many as they allow. With `executor` and
        `slurm`, None means as many as these start.
    threads : int
        Number of threads of each run. On this machine at most the number of processors.
    resume : bool
        Reuse complete results of the same input. With False all cases are run again.
    measure : callable or 'steady', optional
        Function that takes an opened result and returns a dict of values, with the same names for
        each case. By default these are all columns of the history in the last row. The function is
        called at the end, so that an error in it loses no run: the next call reuses the results.
        The word 'steady' stands for the means of `asperity.Run.steady` of the columns for which
        they make sense, with ``friction_error`` and ``laps``.
    errors : {'raise', 'keep'}
        If cases fail, 'raise' raises `SweepError` with the table once all others are done, and
        'keep' returns the table, which lists them in ``failed``. With 'raise', faults in the inputs
        raise ValueError before anything is run.
    quiet : bool
        Show no progress. Otherwise stderr shows one line that is rewritten (in a terminal) or one
        line per case.
    executor : concurrent.futures.Executor, optional
        Executor that runs the cases instead of processes of this machine, with one call each:
        Dask's ``client.get_executor()``, mpi4py's ``MPICommExecutor`` or any other. Its workers
        must have access to `folder`. After Ctrl-C waiting cases are cancelled, and running ones
        are completed.
    slurm : str, optional
        Options of ``sbatch``, such as "--time=1:00:00 --partition=short". The cases are submitted
        as one job array that fills `folder`. Until they are complete, the table lists them as
        failed. The same call later gathers them; while they are in the queue it submits nothing.

    Returns
    -------
    Sweep
        One row per case; the last parameter varies fastest.

    Raises
    ------
    ValueError
        If a name, a list of values or an input is wrong.
    OSError
        If a file cannot be read or written, or the program is not found.
    SweepError
        If cases fail.
    KeyboardInterrupt
        After Ctrl-C, when all runs have finished the current step and written their checkpoints. A
        second Ctrl-C ends them at once.

    Examples
    --------
    >>> import asperity, tempfile
    >>> wave = asperity.Case(
    ...     grid=dict(nx=64, ny=1, lx=1e-3),
    ...     surface=dict(shape="sine", amplitude=1e-6, wavelength=1e-3),
    ...     material=dict(shear_modulus=1e6), phase=[dict(pressure=1e3)])
    >>> table = asperity.sweep(wave, {"phase.pressure": [1e3, 4e3, 1e5]}, quiet=True,
    ...                        folder=tempfile.mkdtemp())
    >>> table["contact_area"].tolist()
    [0.203125, 0.390625, 1.0]
    """
    choice("errors", errors, ("raise", "keep"))
    if not (measure is None or callable(measure) or measure == "steady"):
        raise ValueError(f"measure = {shown(measure)}: must be a function of a run, or 'steady'")
    means = means_of(jobs, threads, resume, executor, slurm)
    case = base.copy() if isinstance(base, Case) else Case.read(base)
    points, shape = _points(parameters, zip)
    for names in parameters:
        for name in _names(names):
            _targets(case, name)
    folder = _folder(case) if folder is None else Path(folder)
    work = _jobs(case, points, folder, keep=errors == "keep")
    make_folder(folder)
    _write_index(folder, work)
    waiting = []
    for job in work:
        if job.case is None:
            continue
        if resume and is_done(job):
            job.status = 0
        else:
            waiting.append(job)
    run_jobs(waiting, folder, SweepProgress("sweep", len(work), len(waiting), quiet), means)
    table = _table(work, shape, measure)
    if table.failed and errors == "raise" and slurm is None:
        lines = "\n".join(f"  {failure}" for failure in table.failed)
        raise SweepError(f"{len(table.failed)} of {len(work)} cases failed:\n{lines}", table)
    return table


def _folder(case: Case) -> Path:
    """Return the default folder of the results."""
    return Path("sweep") if case.path is None else case.path.with_name(f"{case.path.stem}_sweep")


def _names(names: str | tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of a key as a tuple."""
    return names if isinstance(names, tuple) else (names,)


def _points(parameters: Mapping[str | tuple[str, ...], Sequence[Any]], parallel: bool,
            ) -> tuple[list[dict[str, Any]], tuple[int, ...]]:
    """Return the values of each case, and the number of values along each axis."""
    if not isinstance(parameters, Mapping) or not parameters:
        raise ValueError(f"parameters = {parameters!r}: must be a dict with a list of values for"
                         " each name")
    axes: list[list[dict[str, Any]]] = []
    seen: set[str] = set()
    for key, values in parameters.items():
        names = _names(key)
        for name in names:
            if name in seen:
                raise ValueError(f"parameters: {name} is given twice")
            seen.add(name)
        if isinstance(values, str | Mapping) or not np.iterable(values):
            raise ValueError(f"{key} = {values!r}: must be a list of values")
        axis = []
        for value in values:
            value = _plain(value)
            if isinstance(key, tuple) and not (
                    isinstance(value, list) and len(value) == len(names)):
                raise ValueError(f"{key}: {value!r}: must be {len(names)} values, one for each"
                                 " name")
            axis.append(dict(zip(names, value if isinstance(key, tuple) else [value],
                                 strict=True)))
        if not axis:
            raise ValueError(f"{key}: has no values")
        axes.append(axis)
    lengths = [len(axis) for axis in axes]
    if parallel:
        if len(set(lengths)) > 1:
            counted = ", ".join(f"{key}: {n}" for key, n in zip(parameters, lengths, strict=True))
            raise ValueError(f"zip: all lists must have one length, but {counted}")
        groups: Iterator[tuple[dict[str, Any], ...]] = iter(zip(*axes, strict=True))
        shape: tuple[int, ...] = (lengths[0],)
    else:
        groups, shape = itertools.product(*axes), tuple(lengths)
    return [{name: value for part in group for name, value in part.items()}
            for group in groups], shape


def _plain(value: Any) -> Any:
    """Return a value with NumPy's numbers and arrays converted to those of Python."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value


def _targets(case: Case, name: str) -> tuple[list[Any], str]:
    """Return the groups in which a parameter is set, and its variable.

    Examples
    --------
    >>> case = Case(phase=[dict(pressure=1e5), dict(velocity_x=1.0)])
    >>> groups, variable = _targets(case, "phase.velocity_x")
    >>> groups[0] is case.phase[1], variable
    (True, 'velocity_x')
    >>> _targets(case, "phase.velocity_y")
    Traceback (most recent call last):
    ...
    ValueError: phase.velocity_y: there are 2 &phase and none names velocity_y: which one? \
Say phase[1].velocity_y to phase[2].velocity_y
    """
    found = _PARAMETER.fullmatch(name) if isinstance(name, str) else None
    if found is None:
        raise ValueError(f"{name!r}: must be a name such as 'solver.tolerance' or"
                         " 'phase[2].velocity_x'")
    group, number, variable = found.groups()
    if (group, variable) == ("output", "file"):
        raise ValueError("output.file: the results of a sweep are named after its values; `folder`"
                         " chooses their place")
    groups = case[group]  # the error for an unknown name suggests the nearest one
    entry = namelists.table()[group]
    Case.help(f"{group}.{variable}")
    if not entry.is_repeatable:
        if number is not None:
            raise ValueError(f"{name}: there is only one &{group}: leave the number out")
        return [groups], variable
    many = f"there {'is' if len(groups) == 1 else 'are'} {len(groups)} &{group}"
    if number is not None:
        if not 1 <= int(number) <= len(groups):
            raise ValueError(f"{name}: {many}, counted from 1")
        return [groups[int(number) - 1]], variable
    if len(groups) == 1:
        return [groups[0]], variable
    naming = [one for one in groups if variable in one]
    if group == "phase" and naming:
        return naming, variable
    if not groups:
        raise ValueError(f"{name}: there is no &{group}")
    reason = f"{many} and none names {variable}" if group == "phase" else many
    raise ValueError(f"{name}: {reason}: which one? Say {group}[1].{variable} to"
                     f" {group}[{len(groups)}].{variable}")


def _jobs(base: Case, points: list[dict[str, Any]], folder: Path, keep: bool) -> list[Job]:
    """Return the jobs of a sweep. A wrong input raises, or with `keep` becomes a failed job."""
    work = []
    names: dict[str, dict[str, Any]] = {}
    for values in points:
        job = Job(values, name=_file_name(values))
        if job.name in names:
            raise ValueError(f"parameters: {_described(values)} is given twice")
        names[job.name] = values
        job.path = folder / f"{job.name}.h5"
        work.append(job)
        case = base.copy()
        try:
            # Find all groups before setting any, because a value may affect which groups match.
            places = {name: _targets(case, name) for name in values}
            for name, value in values.items():
                groups, variable = places[name]
                for group in groups:
                    group[variable] = value
            case.check(files=False)
        except (ValueError, OSError) as error:
            if not keep:
                raise type(error)(f"{_described(values)}: {error}") from None
            job.status, job.message = 2, str(error)
        else:
            job.case = case
    return work


def _described(values: dict[str, Any]) -> str:
    """Return the values of a case for a message."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _file_name(values: dict[str, Any]) -> str:
    """Return the name of a case's files, which depends only on the values of the case.

    Examples
    --------
    >>> _file_name({"phase[2].velocity_x": 0.1, "friction.law": "coulomb"})
    'phase2.velocity_x=0.1,friction.law=coulomb'
    """
    parts = []
    for name, value in values.items():
        text = str(value) if np.ndim(value) == 0 else "-".join(map(str, value))
        parts.append(f"{re.sub(r'[^A-Za-z0-9_.]', '', name)}={text}")
    whole = ",".join(parts)
    plain = re.sub(r"[^A-Za-z0-9_.,=+-]", "_", whole)
    if plain == whole and len(plain) <= _LONGEST_NAME:
        return plain
    code = hashlib.sha256(namelists.encode(repr(list(values.items())))).hexdigest()[:12]
    return f"{plain[:_LONGEST_NAME - 13]}-{code}"


def _write_index(folder: Path, work: list[Job]) -> None:
    """Write the values of each file to sweep.json, and keep the entries of earlier sweeps."""
    path = folder / "sweep.json"
    index: dict[str, Any] = {}
    if path.exists():
        with contextlib.suppress(ValueError):
            found = json.loads(path.read_text())
            index = found if isinstance(found, dict) else {}
    index.update({f"{job.name}.h5": job.values for job in work})
    write_text(path, json.dumps(index, indent=1, default=str) + "\n")


def _table(work: list[Job], shape: tuple[int, ...],
           measure: Callable[[Run], Mapping[str, Any]] | str | None) -> Sweep:
    """Return the table of all cases."""
    failed = []
    found: list[dict[str, Any] | None] = []
    warned: dict[str, str] = {}
    units = {name: _units_of(name) for name in work[0].values}
    for index, job in enumerate(work):
        if job.status != 0:
            failed.append(Failure(index, job.values, job.message, job.status))
            found.append(None)
            continue
        for line in job.message.splitlines():
            warned.setdefault(line.removeprefix(f"{job.path.stem}.nml: "), job.name)
        run = open_result(job.path)
        found.append({name: column[-1] for name, column in run.history.items()}
                     if measure is None else _measured(measure, run))
        if measure is None or isinstance(measure, str):
            units |= {name: run.history.units(name) if name in run.history else "1"
                      for name in found[-1] or ()}
    for line, name in warned.items():
        warn_user(f"{name}: {line}")
    parameters = list(work[0].values)
    columns = {name: column([job.values[name] for job in work]) for name in parameters}
    results = dict.fromkeys(name for row in found if row is not None for name in row)
    if len(failed) == len(work) and measure is None:
        results = dict.fromkeys(_columns_of_failed(work))
    for name in results:
        if name in columns:
            raise ValueError(f"measure: {name} is the name of a parameter")
        columns[name] = column([None if row is None else row.get(name) for row in found])
    return Sweep(columns, parameters, shape, [job.path for job in work], failed, units)


def _columns_of_failed(work: list[Job]) -> list[str]:
    """Return the columns that the table of a sweep has even if all its cases failed.

    They are those of the first result that was begun, or if there is none, of all histories.
    """
    for job in work:
        with contextlib.suppress(OSError):
            return list(open_result(job.path).history)
    return list(HistoryColumns.__annotations__)


def _units_of(parameter: str) -> str:
    """Return the units of a parameter, such as 'm/s' for "phase[2].velocity_x".

    Examples
    --------
    >>> _units_of("phase[2].velocity_x"), _units_of("friction.coefficient")
    ('m/s', '1')
    >>> _units_of("friction.law")
    ''
    """
    found = _PARAMETER.fullmatch(parameter)
    entry = found and namelists.table()[found[1]].variables.get(found[3])
    if not entry:
        return ""
    return entry.units or ("1" if entry.kind in ("integer", "real", "reals") else "")


_MEANS = ("friction", "friction_viscous", "contact_area", "mean_gap", "displacement", "stick_area",
          "sliding_speed", "traction_x", "traction_y", "power_viscous", "power_friction")


def _steady(run: Run) -> dict[str, Any]:
    """Return the means over complete laps, the error of the friction, and the number of laps."""
    values: dict[str, Any] = {name: steady_mean(run, name).mean for name in _MEANS
                              if name in run.history}
    found = run.steady("friction")  # warns if there is no complete lap
    return values | {"friction_error": found.error, "laps": found.laps}


def _measured(measure: Callable[[Run], Mapping[str, Any]] | str, run: Run) -> dict[str, Any]:
    """Return the values that a measure gives for a run, by name."""
    if isinstance(measure, str):
        choice("measure", measure, ("steady",))
        return _steady(run)
    try:
        values = measure(run)
    except Exception as error:
        if hasattr(error, "add_note"):  # from Python 3.11 on
            error.add_note(f"measure: was called for {run.path}")
        raise
    if not isinstance(values, Mapping) or not all(isinstance(name, str) for name in values):
        raise ValueError(f"measure: returned {values!r} for {run.path.name}: must return a dict"
                         " with a value for each name, such as {'friction': 0.5}")
    return dict(values)
