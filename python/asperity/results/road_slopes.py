"""The slopes of the moving road under the rubber, and the friction outside the contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .settings import setting

if TYPE_CHECKING:
    from .result_file import ResultFile
    from .run import Run
    from .snapshot import Snapshot

__all__ = ["RoadSlopes", "friction_outside", "moved_slopes"]

FloatArray = NDArray[np.float64]


def direction(run: ResultFile, row: int) -> tuple[float, float] | None:
    """Return the unit vector of the road's last motion up to a row, or None if it has not moved."""
    history = run.history
    for last in range(row, 0, -1):
        moved = [float(history[name][last] - history[name][last - 1])
                 for name in ("road_x", "road_y")]
        way = float(np.hypot(moved[0], moved[1]))
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
    run : ResultFile
        A result with the height of its road.
    """

    def __init__(self, run: ResultFile) -> None:
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
