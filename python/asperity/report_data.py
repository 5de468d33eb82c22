"""What the report page shows of a result: columns, charts, downsampled maps, spectra.

All values stay in SI units; the page gives them their prefixes.
"""

from __future__ import annotations

import base64
import re
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import surface
from ._derived import (
    closure,
    energy_terms,
    friction_outside,
    has_adhesion,
    has_friction,
    road_speed,
    solver_setting,
    travel,
)
from ._style import LABELS, label_of
from .plot_fields import traction_samples

if TYPE_CHECKING:
    from .result import Run, Snapshot

__all__ = ["page_data"]

MOST_ROWS = 2000  # of the history on the page
MOST_SNAPSHOTS = 40
MOST_CELLS = 8.0e7  # read from the file
SIDES = (256, 192, 128, 96, 64, 48)  # cells along the longer side of the maps
BUDGET = 4.0e6  # bytes of all maps
SPECTRUM_POINTS = 160

FloatArray = NDArray[np.float64]


def page_data(run: Run) -> dict[str, Any]:
    """Return all that the page's script draws, ready for JSON.

    Parameters
    ----------
    run : Run
        Finished or not, with or without snapshots.

    Returns
    -------
    dict
        'columns' (the rows kept of the history), 'axes' (what charts may be drawn against),
        'charts', 'grid', 'snapshots', 'spectrum' (of the road), 'maps' (names of the fields).
    """
    rows = kept_rows(run)
    columns, charts = _charts(run)
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
        "spectrum_units": "m3" if run.grid.ny == 1 else "m4",
        "modulus": _modulus(run),
    }


def kept_rows(run: Run) -> NDArray[np.intp]:
    """Return the rows of the history that the page holds.

    All of them up to `MOST_ROWS`. Of more, of each stretch the rows of the smallest and largest
    friction and contact area, so that no peak is lost, with the first and the last row and those
    of snapshots.
    """
    rows = run.history.rows
    if rows <= MOST_ROWS:
        return np.arange(rows)
    kept = {0, rows - 1}
    edges = np.linspace(0, rows, MOST_ROWS // 4 + 1).astype(int)
    for first, behind in zip(edges[:-1], edges[1:], strict=True):
        for name in ("friction", "contact_area"):
            part = run.history[name][first:behind]
            kept.update((first + int(np.argmin(part)), first + int(np.argmax(part))))
    return np.array(sorted(kept))


def _numbers(values: NDArray[Any]) -> list[float | int | None]:
    """Return values for JSON, which knows neither nan nor infinity, to ten digits."""
    if np.issubdtype(values.dtype, np.integer):
        return [int(value) for value in values]
    return [float(f"{value:.10g}") if np.isfinite(value) else None for value in values.tolist()]


def _axes(run: Run, columns: dict[str, FloatArray]) -> list[dict[str, str]]:
    """Return what the charts may be drawn against, the default first."""
    named = {"time": ("Time", "s"), "travel": ("Travel of the road", "m"),
             "pressure": ("Mean pressure", "Pa"), "displacement": ("Approach", "m"),
             "step": ("Step", "1")}
    order = ["time", "travel", "pressure", "displacement", "step"]
    if travel(run) is not None:
        order.insert(0, "travel")
    found = []
    for name in dict.fromkeys(order):
        if name in columns and run.history.rows and (
                name == "step" or np.ptp(columns[name]) > 0.0):
            found.append({"name": name, "label": named[name][0], "unit": named[name][1]})
    return found


def _charts(run: Run) -> tuple[dict[str, FloatArray], list[dict[str, Any]]]:
    """Return the columns that charts need, derived ones included, and the charts."""
    history = run.history
    rows = history.rows
    columns: dict[str, FloatArray] = {name: np.asarray(history[name]) for name in (
        "step", "phase", "time", "pressure", "displacement", "contact_area", "friction")
        if name in history}
    if rows < 2:
        return columns, []  # the tables tell a single row
    if "road_x" in history and "road_y" in history:
        moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
        columns["travel"] = np.concatenate([[0.0], np.cumsum(moved)])
    charts: list[dict[str, Any]] = []
    rubbing = has_friction(run)

    def series(name: str, label: str, colour: int, dash: str = "",
               values: NDArray[Any] | None = None) -> list[dict[str, Any]]:
        if values is None and name not in history:
            return []
        columns[name] = np.asarray(history[name] if values is None else values)
        return [{"column": name, "label": label, "colour": colour, "dash": dash}]

    def chart(section: str, key: str, title: str, label: str, unit: str,
              lines: list[dict[str, Any]], **more: Any) -> None:
        if lines:
            charts.append({"section": section, "id": key, "title": title, "label": label,
                           "unit": unit, "series": lines, **more})

    moving = rubbing or np.any(history["friction"]) if "friction" in history else False
    if moving:
        lines = series("friction", "whole" if rubbing else "friction", 0)
        if rubbing and "friction_viscous" in history:
            lines += series("friction_viscous", "loss in the rubber", 1, "6 3")
            lines += series("friction_interface", "interface", 2, "8 3 2 3",
                            history["friction"] - history["friction_viscous"])
        if has_adhesion(run) and len(run.snapshots) <= MOST_SNAPSHOTS:
            at, outside = friction_outside(run)
            values = np.full(rows, np.nan)
            values[at] = outside
            lines += [{**line, "marks": True} for line in series(
                "friction_outside", "attraction outside contact", 3, "", values)]
        chart("time", "friction", "Friction", LABELS["friction"], "1", lines)
    lines = series("contact_area", "in contact", 0)
    if rubbing:
        lines += series("stick_area", "sticking", 4, "6 3")
    chart("time", "contact_area", "Contact area", "Fraction of the grid", "1", lines)
    if rubbing:
        lines = series("sliding_speed", "mean of the interface", 0)
        if "road_x" in history:
            lines += series("road_speed", "road against the block's top", 6, "2 3",
                            road_speed(run))
        chart("time", "sliding_speed", "Sliding speed", "Speed", "m/s", lines)
    if "pressure" in history and np.ptp(history["pressure"]) > 1e-6 * np.abs(
            history["pressure"]).max():
        chart("time", "pressure", "Mean pressure", "Pressure", "Pa",
              series("pressure", "mean pressure", 0))
    chart("time", "displacement", "Approach and mean gap", "Length", "m",
          series("displacement", "approach", 0) + series("mean_gap", "mean gap", 1, "6 3"))

    terms = energy_terms(run)
    names = {"work": ("work put in", 6, ""), "stored": ("stored", 0, ""),
             "viscous": ("lost in the rubber", 1, "6 3"),
             "friction": ("lost by friction", 2, "8 3 2 3")}
    lines = []
    for name, values in terms.items():
        if name in ("work", "stored") or np.any(values):
            label, colour, dash = names[name]
            lines += series(f"energy_{name}", label, colour, dash, values)
    chart("energy", "energy", "Work, stored and lost", "Energy", "J", lines)
    missing = closure(run)
    if missing is not None and np.any(missing > 0.0):
        chart("energy", "closure", "What the books miss", "Over the largest energy", "1",
              series("closure", "work less stored less lost", 0, "", missing), log=True)

    lines = series("iterations_normal", "normal", 0)
    if "iterations_tangential" in history and np.any(history["iterations_tangential"]):
        lines += series("iterations_tangential", "tangential", 1, "6 3")
    chart("convergence", "iterations", "Iterations", "Iterations a row", "1", lines, zero=True)
    lines = series("residual_normal", "normal", 0)
    if "residual_tangential" in history and np.any(history["residual_tangential"]):
        lines += series("residual_tangential", "tangential", 1, "6 3")
    tolerance = solver_setting(run, "tolerance")
    chart("convergence", "residuals", "Residuals, recomputed", "Residual", "1", lines, log=True,
          levels=[] if tolerance is None else [{"value": tolerance, "label": "tolerance"}])
    chart("convergence", "seconds", "Time of the solvers", "Wall time a row", "s",
          series("seconds", "wall time", 0), zero=True)
    return columns, charts


def _has_height(run: Run) -> bool:
    """Whether the file holds the road."""
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
        if len(chosen) * shape[0] * shape[1] * 5 * 4 / 3 <= BUDGET:
            break
    return [_snapshot(run.snapshots[int(at)], block) for at in chosen], shape, block


def _snapshot(snapshot: Snapshot, block: int) -> dict[str, Any]:
    """Return a snapshot for the page."""
    run = snapshot.run
    steps = np.asarray(run.history["step"]) if "step" in run.history else np.zeros(0)
    rows = np.flatnonzero(steps == snapshot.step)
    found: dict[str, Any] = {
        "step": snapshot.step, "time": snapshot.time, "phase": snapshot.phase,
        "travel": None, "pressure": None, "displacement": None, "fields": {}}
    if len(rows):
        row = int(rows[0])
        for name in ("pressure", "displacement", "contact_area", "friction"):
            if name in run.history:
                value = float(run.history[name][row])
                found[name] = value if np.isfinite(value) else None
        if "road_x" in run.history and "road_y" in run.history:
            moved = np.hypot(np.diff(run.history["road_x"][:row + 1]),
                             np.diff(run.history["road_y"][:row + 1]))
            found["travel"] = float(moved.sum())
    names = ["pressure", "gap"]
    if run.grid.ny == 1:
        names += ["traction_x", "traction_y"]
    for name in names:
        if name in snapshot:
            field = snapshot[name]
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
    """Return the least and the largest of the values that are finite; 0 where none is."""
    good = field[np.isfinite(field)]
    return [float(good.min()), float(good.max())] if good.size else [0.0, 0.0]


def faulty(run: Run) -> list[str]:
    """Return which columns of the history and which fields hold what is no number."""
    told = []
    for name, column in run.history.items():
        count = int(np.sum(~np.isfinite(column)))
        if count:
            told.append(f"{name} is not finite in {count} of {len(column)} rows")
    if len(run.snapshots):
        snapshot = run.snapshots[-1]
        for name in ("pressure", "gap"):
            if name not in snapshot:
                continue
            count = int(np.sum(~np.isfinite(snapshot[name])))
            if count:
                told.append(f"{name} of the last snapshot is not finite in {count} cells")
    return told


def blocks(field: NDArray[Any], block: int) -> FloatArray:
    """Return the means over square blocks of cells; those at the upper edges may be cut.

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
    """Return the most frequent state of each block of cells; of equals the higher one."""
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
    """Return a field as 16-bit integers between its extremes, in base 64.

    Cells that are not finite are given the least value; `faulty` tells of them.
    """
    finite = np.isfinite(field)
    if not finite.all():
        field = np.where(finite, field, field[finite].min() if finite.any() else 0.0)
    low, high = float(field.min()), float(field.max())
    step = (high - low) / 65535.0
    whole = np.zeros(field.shape) if step == 0.0 else np.rint((field - low) / step)
    top = float(np.percentile(np.abs(field[field != 0.0]), 99.5)) if np.any(field) else 0.0
    return {"low": low, "high": high, "top": top, "data": _encoded(whole.astype("<u2"))}


def _encoded(values: NDArray[Any]) -> str:
    """Return the bytes of an array in base 64."""
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _spectrum(run: Run, field: FloatArray) -> dict[str, Any] | None:
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
    # What round-off leaves where there are no waves would stretch the axis over twenty decades.
    floor = 1e-16 * means[1].max()
    shown = means[1] > floor
    return {"k": _numbers(means[0][shown]), "psd": _numbers(means[1][shown])}


def _modulus(run: Run) -> dict[str, Any] | None:
    """Return storage and loss modulus against frequency, where the material has arms."""
    arms = np.atleast_1d(run.material.get("prony_g", np.zeros(0)))
    times = np.atleast_1d(run.material.get("prony_tau", np.zeros(0)))
    if not len(arms) or len(arms) != len(times) or not np.any(arms):
        return None
    spring = float(run.material.get("shear_modulus", 0.0))
    omega = np.geomspace(0.01 / times.max(), 100.0 / times.min(), 200)
    product = omega[:, None] * times
    storage = spring + np.sum(arms * product**2 / (1.0 + product**2), axis=1)
    loss = np.sum(arms * product / (1.0 + product**2), axis=1)
    return {"omega": _numbers(omega), "storage": _numbers(storage), "loss": _numbers(loss)}


def phase_names(run: Run) -> list[str]:
    """Return the names of the phases as the resolved settings tell them."""
    text = str(run.attributes.get("settings", ""))
    return [(re.search(r"(?m)^\s*name = '(.*)'", body) or ["", ""])[1]
            for body in re.findall(r"(?ms)^&phase\b(.*?)^/", text)]


def now() -> str:
    """Return the time, ISO 8601, UTC."""
    return datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
