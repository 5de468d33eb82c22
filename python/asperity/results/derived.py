"""Quantities derived from the history of a result: travel and speed of the road, energies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.names import UnknownNameError, unknown_name
from .steady import steady_rows

if TYPE_CHECKING:
    from .history import Grid
    from .result_file import ResultFile

__all__ = ["closure", "column_of", "energy_terms", "headline_columns", "load_name",
           "missing_work", "normal_force", "rms_slope", "road_speed", "travel"]

FloatArray = NDArray[np.float64]


def rms_slope(grid: Grid, height: FloatArray) -> float:
    """Return the rms slope of a periodic height map of shape (ny, nx), in m, by Fourier modes."""
    kx = 2.0 * np.pi * np.fft.rfftfreq(grid.nx, grid.dx)
    ky = 2.0 * np.pi * np.fft.fftfreq(grid.ny, grid.dy)
    modes = np.abs(np.fft.rfft2(height) / height.size) ** 2
    modes[:, 1 : (grid.nx + 1) // 2] *= 2.0
    return float(np.sqrt(np.sum((kx**2 + ky[:, None] ** 2) * modes)))


def normal_force(run: ResultFile) -> FloatArray:
    """Return the normal force on the whole grid, N, one value per row."""
    return np.asarray(run.history["pressure"], dtype=float) * run.grid.lx * run.grid.ly


def load_name(run: ResultFile) -> str:
    """Return the name by which `column_of` gives the load: 'force' in free mode, or 'pressure'.

    In free mode the area of the grid is arbitrary, and so is the mean pressure.
    """
    return "force" if run.grid.boundary == "free" else "pressure"


def column_of(run: ResultFile, name: str) -> tuple[NDArray[Any], str]:
    """Return the values and the units of a column of the history, or of the normal force, 'force'.

    Raises
    ------
    KeyError
        If there is no such column.
    """
    if name == "force":
        return normal_force(run), "N"
    if name not in run.history:
        names = list(dict.fromkeys([*run.history, "energy", "force"]))
        raise UnknownNameError(unknown_name("column of the history", name, names))
    return run.history[name], run.history.units(name)


def headline_columns(run: ResultFile) -> list[tuple[str, FloatArray, str]]:
    """Return name, values and units of the columns that describe a run in a few numbers."""
    names = [name for name in ("time", "pressure", "contact_area", "friction")
             if name in run.history]
    return [(name, *column_of(run, name))
            for name in (load_name(run) if name == "pressure" else name for name in names)]


def travel(run: ResultFile) -> FloatArray | None:
    """Return the travel of the road if it suits an axis better than time; otherwise None.

    A phase that covers a tenth of the travel in less than a twentieth of the time would be a
    vertical line in a picture over time.

    Parameters
    ----------
    run : ResultFile
        The result.

    Returns
    -------
    ndarray, shape (rows,), or None
        Travel, m.
    """
    history = run.history
    if "road_x" not in history or "road_y" not in history:
        return None
    moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
    passed = np.diff(history["time"])
    phases = history["phase"][1:]
    if not np.any(moved):
        return None
    hidden = any(moved[phases == phase].sum() > 0.1 * moved.sum()
                 and passed[phases == phase].sum() < 0.05 * passed.sum()
                 for phase in np.unique(phases))
    return np.concatenate([[0.0], np.cumsum(moved)]) if hidden else None


def energy_terms(run: ResultFile) -> dict[str, FloatArray]:
    """Return the work put in, the energy stored and the energies lost, J, one value per row.

    Parameters
    ----------
    run : ResultFile
        The result.

    Returns
    -------
    dict of ndarray, shape (rows,)
        'work' of the normal and the tangential tractions; 'stored', the sum of the elastic,
        adhesive and kinetic energy; 'viscous' and 'friction', the losses. A term whose columns are
        not in the history is left out.
    """
    history = run.history

    def total(*names: str) -> FloatArray | None:
        found = [np.asarray(history[name], dtype=float) for name in names if name in history]
        return np.sum(found, axis=0) if found else None

    terms = {
        "work": total("work_normal", "work_tangential"),
        "stored": total("energy_elastic", "energy_adhesive", "energy_kinetic"),
        "viscous": total("dissipated_viscous"),
        "friction": total("dissipated_friction"),
    }
    return {name: values for name, values in terms.items() if values is not None}


def missing_work(run: ResultFile) -> float | None:
    """Return the largest `work_missing` over the largest work of load and drive.

    It measures the error of the steps: the work of load and drive agrees with that of the fields
    only as far as the steps resolve the motion. The result is None if a column of the history is
    missing or if no work is done.
    """
    names = ("work_missing", "work_load", "work_drive")
    if any(name not in run.history for name in names) or not run.history.rows:
        return None
    missing, load, drive = (np.asarray(run.history[name], dtype=float) for name in names)
    rows = min(len(missing), len(load), len(drive))
    scale = np.abs(load[:rows] + drive[:rows]).max()
    return float(np.abs(missing[:rows]).max() / scale) if scale > 0 else None


def closure(run: ResultFile) -> FloatArray | None:
    """Return the error of the energy balance in each row, over the largest energy so far.

    The error is the work minus the stored energy minus the losses. The result is None if a term is
    missing in the history.
    """
    terms = energy_terms(run)
    if set(terms) != {"work", "stored", "viscous", "friction"} or not run.history.rows:
        return None
    missing = np.abs(terms["work"] - terms["stored"] - terms["viscous"] - terms["friction"])
    largest = np.maximum.accumulate(np.max(np.abs(list(terms.values())), axis=0))
    return np.divide(missing, largest, out=np.zeros_like(missing), where=largest > 0.0)


def road_speed(run: ResultFile) -> FloatArray:
    """Return the speed of the road in each row, m/s.

    In a row in which no time passes it is 0, or the speed of a state of steady sliding.
    """
    history = run.history
    passed = np.diff(history["time"])
    moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
    speed = np.divide(moved, passed, out=np.zeros_like(moved), where=passed > 0.0)
    speed = np.concatenate([[0.0], speed])
    if "sliding_speed" not in history:
        return speed
    return np.where(steady_rows(run), history["sliding_speed"], speed)
