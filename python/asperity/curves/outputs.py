"""The files that `asperity friction` writes: what they may replace, and how they are written.

The folder of the runs contains ``outputs.json``: for each file that was written, the code of its
plan and a checksum of its contents. The same plan may replace its own file as long as nobody has
changed it. Any other file that exists is kept unless the user allows to replace it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from ..base.files import new_file, write_text
from .plan import CurvePlan

__all__ = ["check_outputs", "plan_code", "write_output"]

_RECORD = "outputs.json"


def plan_code(plan: CurvePlan, error: float | None = None, extend: float | None = None) -> str:
    """Return a code of everything that the numbers of a curve depend on.

    Parameters
    ----------
    plan : CurvePlan
        The plan.
    error, extend : float, optional
        See `asperity.friction_curve`.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    road, patch = plan.road, plan.road.patch(0)
    found = hashlib.sha256(repr((
        patch.code, road.name, road.join, road.short, road.cells, road.seed, plan.patches,
        plan.compound.name, error, extend)).encode())
    for values in (road.whole_spectrum.wavenumber, road.whole_spectrum.psd, plan.speed,
                   plan.pressure, plan.temperature):
        found.update(values.tobytes())
    for i in range(plan.pressure.size):
        for j in range(plan.temperature.size):
            found.update(str(plan.case(patch, "patch", i, j)).encode())
    return found.hexdigest()[:16]


def check_outputs(outputs: Sequence[Path], folder: Path, code: str, overwrite: bool) -> None:
    """Refuse outputs that cannot be written, or would replace files that are not ours.

    Parameters
    ----------
    outputs : sequence of Path
        The files that will be written.
    folder : Path
        Folder of the runs.
    code : str
        Code of the plan.
    overwrite : bool
        Whether the user allows to replace any file.

    Raises
    ------
    OSError
        With a message on the first file that is refused.
    """
    record = _record(folder)
    for output in outputs:
        if output.is_dir():
            raise IsADirectoryError(f"{output}: is a folder: name a file in it")
        if not os.access(_target(output).parent, os.W_OK):
            raise PermissionError(f"{output}: cannot be written: no files can be made in its"
                                  " folder")
        if not os.path.lexists(output):
            continue
        if not output.is_file():
            raise OSError(f"{output}: is not a file: name a file")
        if overwrite:
            continue
        known = record.get(_key(output, folder), {})
        if known.get("sha256") != _checksum(output):
            raise FileExistsError(
                f"{output}: exists, and {folder} has no record that `asperity friction` wrote it"
                " as it is now: --overwrite replaces it, or choose another --output")
        if known.get("plan") != code:
            raise FileExistsError(
                f"{output}: is the curve of another plan: --overwrite replaces it, or choose"
                " another --output (the same --folder shares the runs)")


def write_output(output: Path, folder: Path, code: str, write: Callable[[Path], object]) -> None:
    """Write a file under a temporary name, rename it, and record it.

    Parameters
    ----------
    output : Path
        The file.
    folder : Path
        Folder of the runs.
    code : str
        Code of the plan.
    write : callable
        Function that writes a file of the given name.

    Raises
    ------
    OSError
        If it cannot be written. A file that was there before is then as it was.
    """
    with new_file(output) as new:
        write(new)
    record = _record(folder) | {
        _key(output, folder): {"plan": code, "sha256": _checksum(_target(output))}}
    write_text(folder / _RECORD, json.dumps(record, indent=1) + "\n")


def _record(folder: Path) -> dict[str, dict[str, str]]:
    """Return the record of the files that were written; empty if it is missing or damaged."""
    with contextlib.suppress(OSError, ValueError):
        found = json.loads((folder / _RECORD).read_text())
        if isinstance(found, dict) and all(isinstance(one, dict) for one in found.values()):
            return found
    return {}


def _target(output: Path) -> Path:
    """Return the file that a name stands for; links are followed."""
    return Path(os.path.realpath(output))


def _key(output: Path, folder: Path) -> str:
    """Return the name of a file in the record, which is valid after both have been moved."""
    return os.path.relpath(_target(output), os.path.realpath(folder))


def _checksum(path: Path) -> str:
    """Return the checksum of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
