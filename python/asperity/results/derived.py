"""Quantities derived from a result: causes of friction, energy balance, slopes of the road."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .steady import steady_rows

if TYPE_CHECKING:
    from .history import Grid
    from .run import Run
    from .snapshot import Snapshot

__all__ = ["RoadSlopes", "closure", "energy_terms", "friction_outside", "has_adhesion",
           "has_friction", "has_rough_road", "is_elastic", "missing_work", "moved_slopes",
           "rms_slope", "road_speed", "setting", "solver_setting", "travel"]

FloatArray = NDArray[np.float64]


def setting(run: Run, group: str, name: str) -> str | None:
    """Return a setting of the run as text, without quotes.

    Parameters
    ----------
    run : Run
        The result.
    group, name : str
        Group and variable of the input. Of several groups of this name the first counts.

    Returns
    -------
    str or None
        The value among the resolved settings (in older files, the input). None if it is missing.
    """
    text = str(run.attributes.get("settings", "") or run.input)
    for body in re.findall(rf"(?is)&{group}\b(.*?)(?:\n\s*/|/\s*(?:\n|$))", text):
        found = re.search(rf"(?im)(?:^|[\s,]){name}\s*=\s*('[^']*'|\"[^\"]*\"|[^\s,!]+)", body)
        if found:
            return found[1].strip("'\"")
    return None


def solver_setting(run: Run, name: str) -> float | None:
    """Return a number of the group `&solver`, such as its tolerance, or None if it is missing."""
    text = setting(run, "solver", name)
    try:
        return None if text is None else float(text.lower().replace("d", "e"))
    except ValueError:
        return None


def has_friction(run: Run) -> bool:
    """Return whether the interface of the run has friction."""
    law = setting(run, "friction", "law")
    if law is not None:
        return law.lower() != "none"
    columns = [run.history[name] for name in ("stick_area", "dissipated_friction", "traction_x")
               if name in run.history]
    return any(bool(np.any(column)) for column in columns)


def has_adhesion(run: Run) -> bool:
    """Return whether the run has adhesion."""
    potential = setting(run, "adhesion", "potential")
    if potential is not None:
        return potential.lower() != "none"
    return bool("energy_adhesive" in run.history and np.any(run.history["energy_adhesive"]))


def has_rough_road(run: Run) -> bool:
    """Return whether the road is self-affine or a height map from a file."""
    return bool(re.search(r"(?i)shape *= *['\"](self_affine|file)['\"]", run.input))


def is_elastic(run: Run) -> bool:
    """Return whether the material is elastic, that is, has no arms."""
    arms = run.material.get("prony_g")
    return ("shear_modulus" in run.material and "poisson" in run.material
            and (arms is None or not np.any(arms)))


def rms_slope(grid: Grid, height: FloatArray) -> float:
    """Return the rms slope of a periodic height map of shape (ny, nx), in m, by Fourier modes."""
    kx = 2.0 * np.pi * np.fft.rfftfreq(grid.nx, grid.dx)
    ky = 2.0 * np.pi * np.fft.fftfreq(grid.ny, grid.dy)
    modes = np.abs(np.fft.rfft2(height) / height.size) ** 2
    modes[:, 1 : (grid.nx + 1) // 2] *= 2.0
    return float(np.sqrt(np.sum((kx**2 + ky[:, None] ** 2) * modes)))


def travel(run: Run) -> FloatArray | None:
    """Return the travel of the road if it suits an axis better than time; otherwise None.

    A phase that covers a tenth of the travel in less than a twentieth of the time would be a
    vertical line in a picture over time.

    Parameters
    ----------
    run : Run
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


def energy_terms(run: Run) -> dict[str, FloatArray]:
    """Return the work put in, the energy stored and the energies lost, J, one value per row.

    Parameters
    ----------
    run : Run
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


def missing_work(run: Run) -> float | None:
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


def closure(run: Run) -> FloatArray | None:
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


def road_speed(run: Run) -> FloatArray:
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


def direction(run: Run, row: int) -> tuple[float, float] | None:
    """Return the unit vector of the road's last motion up to a row, or None if it has not moved."""
    history = run.history
    for last in range(row, 0, -1):
        moved = [float(history[name][last] - history[name][last - 1])
                 for name in ("road_x", "road_y")]
        way = float(np.hypot(*moved))
        if way > 0.0:
            return moved[0] / way, moved[1] / way
    return None


def spline_coefficients(height: FloatArray, axis: int, periodic: bool) -> FloatArray:
    """Return the coefficients of the cubic B-splines through a map, along one axis.

    On a free map the second derivatives at the ends come from one-sided differences, as in the
    program (Fortran module `cubic_spline`).

    Parameters
    ----------
    height : ndarray
        The map, or the coefficients along the other axis.
    axis : int
        Axis along which the coefficients are computed.
    periodic : bool
        Whether the map is periodic.

    Returns
    -------
    ndarray
        Coefficients. Along the axis there is one more before the first cell, and there are two more
        behind the last cell.
    """
    from scipy.linalg import solve_banded
    from scipy.ndimage import spline_filter1d

    lines = np.moveaxis(height, axis, 0)
    n = len(lines)
    if n == 1:
        inner = lines[[0, 0, 0, 0]]
    elif periodic:
        inner = spline_filter1d(lines, order=3, axis=0, mode="grid-wrap")
        inner = inner[np.arange(-1, n + 2) % n]
    else:
        rule = {2: [0.0, 0.0], 3: [1.0, -2.0, 1.0]}.get(n, [2.0, -5.0, 4.0, -1.0])
        bends = [np.tensordot(rule, part[:len(rule)], 1) for part in (lines, lines[::-1])]
        right = 6.0 * lines
        right[0], right[-1] = 6.0 * lines[0] - bends[0], 6.0 * lines[-1] - bends[1]
        bands = np.ones((3, n))
        bands[1] = 4.0
        bands[1, [0, -1]] = 6.0
        bands[0, 1] = bands[2, -2] = 0.0
        inner = solve_banded((1, 1), bands, right.reshape(n, -1)).reshape(lines.shape)
        ends = [2.0 * inner[0] - inner[1] + bends[0], 2.0 * inner[-1] - inner[-2] + bends[1]]
        inner = np.concatenate([ends[:1], inner, [ends[1], ends[1]]])
    return np.moveaxis(inner, 0, axis)


class RoadSlopes:
    """The slopes of the road of a run, computed by the `interpolation` of the run.

    Parameters
    ----------
    run : Run
        A result with the height of its road.
    """

    def __init__(self, run: Run) -> None:
        self.grid, self.height = run.grid, run.height
        self.periodic = self.grid.boundary == "periodic"
        # A file without this setting is older than the default of cubic splines.
        self.cubic = (setting(run, "solver", "interpolation") or "linear") == "cubic"
        if self.cubic:
            along_y = spline_coefficients(self.height, 0, self.periodic)
            self.coefficients = spline_coefficients(along_y, 1, self.periodic)
        else:
            self.central = [self.differences(1, self.grid.dx), self.differences(0, self.grid.dy)]

    def differences(self, axis: int, spacing: float) -> FloatArray:
        """Return central differences of the heights, one-sided ones at the edge of a free map."""
        height = self.height
        if height.shape[axis] < 2:
            return np.zeros_like(height)
        if self.periodic:
            return (np.roll(height, -1, axis) - np.roll(height, 1, axis)) / (2 * spacing)
        return np.gradient(height, spacing, axis=axis)

    def at(self, y: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return dH/dx and dH/dy at positions that are given in cells.

        More than one cell outside a free map they are 0.
        """
        from scipy.ndimage import map_coordinates

        if not self.cubic:
            mode = "grid-wrap" if self.periodic else "grid-constant"
            along_x, along_y = (map_coordinates(slope, [y, x], order=1, mode=mode)
                                for slope in self.central)
            return along_x, along_y
        inside = np.ones_like(x)
        places = []
        for place, n in ((y, self.height.shape[0]), (x, self.height.shape[1])):
            if self.periodic:
                places.append(place % n)
            else:
                within = np.clip(place, 0.0, n - 1.0)
                inside = inside * np.maximum(0.0, 1.0 - np.abs(place - within))
                places.append(within)
        cells = [np.minimum(np.floor(place).astype(int), n - 1)
                 for place, n in zip(places, self.height.shape, strict=True)]
        weights_y, slopes_y = spline_weights(places[0] - cells[0])
        weights_x, slopes_x = spline_weights(places[1] - cells[1])
        along_x, along_y = np.zeros_like(x), np.zeros_like(x)
        for m in range(4):
            for k in range(4):
                value = inside * self.coefficients[cells[0] + m, cells[1] + k]
                along_x += weights_y[m] * slopes_x[k] * value / self.grid.dx
                along_y += slopes_y[m] * weights_x[k] * value / self.grid.dy
        return along_x, along_y


def spline_weights(u: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the four cubic B-splines and their slopes at a position `u` in a cell, 0 to 1."""
    w = 1.0 - u
    weights = [w**3 / 6, (4 - 6 * u**2 + 3 * u**3) / 6, (4 - 6 * w**2 + 3 * w**3) / 6, u**3 / 6]
    slopes = [-w**2 / 2, 1.5 * u**2 - 2 * u, 2 * w - 1.5 * w**2, u**2 / 2]
    return weights, slopes


def moved_slopes(snapshot: Snapshot, road: tuple[float, float],
                 slopes: RoadSlopes | None = None) -> tuple[FloatArray, FloatArray]:
    """Return the slopes of the moved road under the points of the rubber, as the program does.

    They are those of the cubic spline through the map or, with `interpolation = 'linear'`, central
    differences that are interpolated bilinearly. They are taken at the displaced points of the
    rubber's surface.

    Parameters
    ----------
    snapshot : Snapshot
        The snapshot. Its displacements along x and y are used if it has them.
    road : tuple of float
        Displacement of the road along x and y, m.
    slopes : RoadSlopes, optional
        The slopes of the run's road; passing them saves time for many snapshots.

    Returns
    -------
    tuple of ndarray
        dH/dx and dH/dy, shape (ny, nx).
    """
    grid = snapshot.run.grid
    slopes = RoadSlopes(snapshot.run) if slopes is None else slopes
    at = list(np.indices(snapshot.run.height.shape).astype(float))
    for axis, (name, spacing, moved) in enumerate((("displacement_y", grid.dy, road[1]),
                                                   ("displacement_x", grid.dx, road[0]))):
        at[axis] -= moved / spacing
        if name in snapshot:
            at[axis] += snapshot[name] / spacing
    return slopes.at(*at)


def friction_outside(run: Run) -> tuple[FloatArray, FloatArray]:
    """Return the part of the friction coefficient that is due to attraction outside the contact.

    It is -mean(P dH/ds)/mean(P), with the first mean over the open cells only. It is a part of the
    viscous friction, and known at the snapshots only.

    Parameters
    ----------
    run : Run
        A result with adhesion, and with snapshots of pressure and contact.

    Returns
    -------
    rows : ndarray of int
        Rows of the history that have a value.
    values : ndarray
        The coefficients in these rows.
    """
    rows, values = [], []
    slopes = None
    steps = list(run.history["step"]) if "step" in run.history else []
    for snapshot in run.snapshots:
        if ("pressure" not in snapshot or "contact" not in snapshot
                or snapshot.step not in steps):
            continue
        row = steps.index(snapshot.step)
        along = direction(run, row)
        pressure = snapshot["pressure"]
        if along is None or pressure.mean() == 0.0:
            continue
        slopes = RoadSlopes(run) if slopes is None else slopes
        slope_x, slope_y = moved_slopes(snapshot, (float(run.history["road_x"][row]),
                                                   float(run.history["road_y"][row])), slopes)
        slope = along[0] * slope_x + along[1] * slope_y
        open_cells = snapshot["contact"] == 0
        rows.append(row)
        values.append(-float(np.mean(pressure * slope * open_cells) / pressure.mean()))
    return np.array(rows, dtype=int), np.array(values)


