"""The data of the HTML page of a run: columns, charts, downsampled maps, spectra.

All values are in SI units; the page adds the prefixes.
"""

from __future__ import annotations

import base64
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.names import counted
from ..results.derived import travel
from ..results.settings import has_friction
from ..roads import surface
from ..rubber.prony import Prony
from .colour_scales import scale_ends, without_round_off
from .plot_fields import traction_samples
from .report_charts import MOST_SNAPSHOTS, charts_of
from .style import label_of

if TYPE_CHECKING:
    from ..results import Run, Snapshot
    from ..results.result_file import ResultFile

__all__ = ["page_data"]

MOST_ROWS = 2000  # of the history on the page
MOST_CELLS = 8.0e7  # read from the file
SIDES = (256, 192, 128, 96, 64, 48)  # cells along the longer side of the maps
BUDGET = 4.0e6  # bytes of all maps
SPECTRUM_POINTS = 160

FloatArray = NDArray[np.float64]


def page_data(run: Run) -> dict[str, Any]:
    """Return all data that the script of the page draws, ready for JSON.

    Parameters
    ----------
    run : Run
        The result, which may be unfinished and may have no snapshots.

    Returns
    -------
    dict
        'title'; 'axes', the choices of the horizontal axis; 'columns', the rows of the history
        that are kept; 'rows', their number and that of all rows; 'charts'; 'grid', also of the
        reduced maps; 'friction', whether there is a friction law; 'snapshots', and 'stored', the
        number of those in the result; 'spectrum' of the road and 'spectrum_units'; 'modulus' of
        the rubber against frequency.
    """
    rows = kept_rows(run)
    columns, charts = charts_of(run)
    snapshots, shape, block = _snapshots(run)
    return {
        "title": run.title or run.path.name,
        "axes": _axes(run, columns),
        "columns": {name: _numbers(values[rows]) for name, values in columns.items()},
        "rows": {"shown": len(rows), "all": run.history.rows},
        "charts": charts,
        "grid": {"nx": run.grid.nx, "ny": run.grid.ny, "lx": run.grid.lx, "ly": run.grid.ly,
                 "mx": shape[1], "my": shape[0], "block": block},
        "friction": has_friction(run),
        "snapshots": snapshots,
        "stored": len(run.snapshots),
        "spectrum": _spectrum(run, run.height) if _has_height(run) else None,
        "spectrum_units": "m³" if run.grid.ny == 1 else "m⁴",
        "modulus": _modulus(run),
    }


def kept_rows(run: Run) -> NDArray[np.intp]:
    """Return the rows of the history that the page contains.

    Up to `MOST_ROWS` these are all rows. A longer history is divided into intervals, and the rows
    with the smallest and the largest friction and contact area of each interval are kept, so that
    no peak is lost. The first and the last row are also kept.
    """
    rows = run.history.rows
    if rows <= MOST_ROWS:
        return np.arange(rows)
    kept = {0, rows - 1}
    edges = np.linspace(0, rows, MOST_ROWS // 4 + 1).astype(int)
    for first, behind in zip(edges[:-1], edges[1:], strict=True):
        for name in (name for name in ("friction", "contact_area") if name in run.history):
            part = run.history[name][first:behind]
            kept.update((first + int(np.argmin(part)), first + int(np.argmax(part))))
    return np.array(sorted(kept))


def _numbers(values: NDArray[Any]) -> list[float | int | None]:
    """Return values for JSON with ten digits; NaN and infinity become None, as JSON has neither."""
    if np.issubdtype(values.dtype, np.integer):
        return [int(value) for value in values]
    return [float(f"{value:.10g}") if np.isfinite(value) else None for value in values.tolist()]


def _axes(run: Run, columns: dict[str, FloatArray]) -> list[dict[str, Any]]:
    """Return the choices of the horizontal axis of the charts; the default is first."""
    named = {"speed": ("Sliding speed", "m/s"), "time": ("Time", "s"),
             "travel": ("Travel of the road", "m"), "force": ("Normal force", "N"),
             "pressure": ("Mean pressure", "Pa"),
             "displacement": ("Approach", "m"), "step": ("Step", "1")}
    order = list(named)
    if travel(run) is not None:
        order.insert(0, "travel")
    found = []
    for name in dict.fromkeys(order):
        if name not in columns or not run.history.rows:
            continue
        values = columns[name][np.isfinite(columns[name])]
        if name == "step" or (values.size and np.ptp(values) > 0.0):
            found.append({"name": name, "label": named[name][0], "unit": named[name][1],
                          "log": name == "speed" and bool(values.max() >= 10.0 * values.min())})
    return found


def _has_height(run: Run) -> bool:
    """Return whether the file contains the road."""
    try:
        return run.height.size > 0
    except OSError:
        return False


def _snapshots(run: Run) -> tuple[list[dict[str, Any]], tuple[int, int], int]:
    """Return the snapshots of the page, the shape of their maps and the cells of a block."""
    grid = run.grid
    stored = len(run.snapshots)
    most = int(min(MOST_SNAPSHOTS, max(2.0, MOST_CELLS / (grid.nx * grid.ny))))
    chosen = (range(stored) if stored <= most
              else np.unique(np.linspace(0, stored - 1, most).round().astype(int)))
    sides = (4096, 2048, 1024, 512) if grid.ny == 1 else SIDES
    for side in sides:
        block = -(-max(grid.nx, grid.ny) // side)
        shape = (-(-grid.ny // block), -(-grid.nx // block))
        if len(chosen) * shape[0] * shape[1] * 7 * 4 / 3 <= BUDGET:
            break
    found = [_snapshot(run.snapshots[int(at)], block) for at in chosen]
    for each in found[1:]:  # a road that does not move is stored once
        if each["fields"].get("road_height") == found[0]["fields"].get("road_height", {}):
            del each["fields"]["road_height"]
    return found, shape, block


def _snapshot(snapshot: Snapshot, block: int) -> dict[str, Any]:
    """Return a snapshot for the page."""
    run = snapshot.run
    steps = np.asarray(run.history["step"]) if "step" in run.history else np.zeros(0)
    rows = np.flatnonzero(steps == snapshot.step)
    found: dict[str, Any] = {
        "step": snapshot.step, "time": snapshot.time, "phase": snapshot.phase,
        "travel": None, "speed": None, "pressure": None, "displacement": None, "fields": {}}
    if len(rows):
        row = int(rows[0])
        for name in ("pressure", "displacement", "contact_area", "friction"):
            if name in run.history:
                value = float(run.history[name][row])
                found[name] = value if np.isfinite(value) else None
        if "sliding_speed" in run.history:
            found["speed"] = float(run.history["sliding_speed"][row]) or None
        if "road_x" in run.history and "road_y" in run.history:
            moved = np.hypot(np.diff(run.history["road_x"][:row + 1]),
                             np.diff(run.history["road_y"][:row + 1]))
            found["travel"] = float(moved.sum())
    names = ["pressure", "gap", "road_height"]
    if run.grid.ny == 1:
        names += ["traction_x", "traction_y"]
    for name in names:
        if name in snapshot:
            field = without_round_off(snapshot, name)
            if name.startswith("traction") and not np.any(field):
                continue
            found["fields"][name] = {
                "label": label_of(name, snapshot), "units": snapshot.units(name),
                **packed(blocks(field, block)), "exact": extremes(field)}
    if "contact" in snapshot:
        contact = snapshot["contact"]
        found["contact"] = _encoded(states(contact, block))
        found["shares"] = [float(np.mean(contact == state)) for state in range(3)]
    if {"contact", "traction_x", "traction_y"} <= set(snapshot) and run.grid.ny > 1:
        i, j, along_x, along_y = traction_samples(snapshot)
        found["arrows"] = [_numbers(values) for values in (
            run.grid.x[i], run.grid.y[j], along_x, along_y)]
    if "displacement_z" in snapshot:
        found["spectrum"] = _spectrum(run, snapshot["displacement_z"])
    return found


def extremes(field: NDArray[Any]) -> list[float]:
    """Return the smallest and the largest finite value, or zeros if there is none."""
    good = field[np.isfinite(field)]
    return [float(good.min()), float(good.max())] if good.size else [0.0, 0.0]


def faulty(run: Run) -> list[str]:
    """Return messages about columns of the history and fields that contain NaN or infinity."""
    notes = []
    for name, column in run.history.items():
        count = int(np.sum(~np.isfinite(column)))
        if count:
            notes.append(f"{name} is not finite in {count} of {len(column)} rows")
    if len(run.snapshots):
        snapshot = run.snapshots[-1]
        for name in ("pressure", "gap"):
            if name not in snapshot:
                continue
            count = int(np.sum(~np.isfinite(snapshot[name])))
            if count:
                notes.append(f"{name} of the last snapshot is not finite in"
                             f" {counted(count, 'cell')}")
    return notes


def blocks(field: NDArray[Any], block: int) -> FloatArray:
    """Return the means over square blocks of cells; blocks at the upper edges may be smaller.

    Examples
    --------
    >>> import numpy as np
    >>> blocks(np.array([[1.0, 3.0, 5.0]]), 2)
    array([[2., 5.]])
    """
    if block == 1:
        return np.asarray(field, dtype=float)
    sums = _sums(np.asarray(field, dtype=float), block)
    return sums / _sums(np.ones(field.shape), block)


def states(contact: NDArray[Any], block: int) -> NDArray[np.uint8]:
    """Return the most frequent state of each block of cells; the higher one in a tie."""
    if block == 1:
        return np.asarray(contact, dtype=np.uint8)
    counts = np.array([_sums((contact == state).astype(float), block) for state in range(3)])
    return (2 - np.argmax(counts[::-1], axis=0)).astype(np.uint8)


def _sums(field: FloatArray, block: int) -> FloatArray:
    """Return the sums over blocks."""
    ny, nx = field.shape
    rows = np.add.reduceat(field, np.arange(0, ny, block), axis=0)
    return np.add.reduceat(rows, np.arange(0, nx, block), axis=1)


def packed(field: FloatArray) -> dict[str, Any]:
    """Return a field as 16-bit integers between its extremes, in base 64, and its colour scale.

    Cells that are not finite get the smallest value; `faulty` reports them.
    """
    finite = np.isfinite(field)
    if not finite.all():
        field = np.where(finite, field, field[finite].min() if finite.any() else 0.0)
    low, high = float(field.min()), float(field.max())
    step = (high - low) / 65535.0
    whole = np.zeros(field.shape) if step == 0.0 else np.rint((field - low) / step)
    bottom, top = scale_ends(field)
    return {"low": low, "high": high, "bottom": bottom, "top": top,
            "data": _encoded(whole.astype("<u2"))}


def _encoded(values: NDArray[Any]) -> str:
    """Return the bytes of an array in base 64."""
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _spectrum(run: ResultFile, field: FloatArray) -> dict[str, Any] | None:
    """Return the radially averaged power spectral density, in bins of equal ratio."""
    if not np.all(np.isfinite(field)) or np.ptp(field) == 0.0:
        return None
    found = surface.psd(field, run.grid.lx, run.grid.ly)
    wave, density, modes = found.wavenumber, found.psd, found.modes.astype(float)
    good = (wave > 0.0) & (modes > 0)
    wave, density, modes = wave[good], density[good], modes[good]
    if not len(wave) or not np.any(density > 0.0):
        return None
    edges = np.geomspace(wave[0], wave[-1] * (1.0 + 1e-9), SPECTRUM_POINTS + 1)
    number = np.clip(np.searchsorted(edges, wave, side="right") - 1, 0, SPECTRUM_POINTS - 1)
    total = np.bincount(number, modes, SPECTRUM_POINTS)
    kept = total > 0
    means = [np.bincount(number, modes * values, SPECTRUM_POINTS)[kept] / total[kept]
             for values in (wave, density)]
    # Round-off at wave numbers without waves would stretch the axis over twenty decades.
    floor = 1e-16 * means[1].max()
    shown = means[1] > floor
    return {"k": _numbers(means[0][shown]), "psd": _numbers(means[1][shown])}


def _modulus(run: Run) -> dict[str, Any] | None:
    """Return storage and loss modulus against frequency, or None if the material has no arms."""
    arms = np.atleast_1d(run.material.get("prony_g", np.zeros(0)))
    times = np.atleast_1d(run.material.get("prony_tau", np.zeros(0)))
    if not len(arms) or len(arms) != len(times) or not np.any(arms):
        return None
    material = Prony(float(run.material.get("shear_modulus", 0.0)), arms, times)
    omega = np.geomspace(0.01 / times.max(), 100.0 / times.min(), 200)
    modulus = material.complex_modulus(omega)
    return {"omega": _numbers(omega), "storage": _numbers(modulus.real),
            "loss": _numbers(modulus.imag)}


def now() -> str:
    """Return the time, ISO 8601, UTC."""
    return datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
