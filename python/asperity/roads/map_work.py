"""The processing steps of a measured map: crop, level, fill, resample, window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.check import number, whole
from .windows import map_window

__all__ = ["MapWork", "fit_terms", "polynomial"]

FloatArray = NDArray[np.float64]


class MapWork:
    """A map that is being processed, with a record of the steps so far.

    Attributes
    ----------
    height : ndarray, shape (ny, nx)
        Heights in the unit of the file, NaN at missing points.
    sizes : list of float
        Lengths along x and y in the unit of the file.
    periodic : bool
        Whether opposite edges match.
    steps : list of dict
        The steps: the key 'step' and the numbers of each.
    """

    def __init__(self, height: FloatArray, sizes: list[float], periodic: bool) -> None:
        self.height = height
        self.sizes = sizes
        self.periodic = periodic
        self.steps: list[dict[str, Any]] = []

    def note(self, step: str, **numbers: Any) -> None:
        """Record a step with its numbers."""
        self.steps.append({"step": step, **numbers})

    def crop(self, wanted: Sequence[float]) -> None:
        """Keep the part between two lengths along each axis, rounded to whole cells."""
        dims = 1 if self.height.shape[0] == 1 else 2
        if len(wanted) != 2 * dims:
            raise ValueError(f"crop: has {len(wanted)} numbers, must have {2 * dims}")
        parts = [slice(None), slice(None)]
        kept: list[float] = []
        for axis in range(dims):
            low, high = (number("crop", value) for value in wanted[2 * axis : 2 * axis + 2])
            name = "xy"[axis]
            count, length = self.height.shape[1 - axis], self.sizes[axis]
            cell = length / count
            if not low < high:
                raise ValueError(f"crop = {low:g}, {high:g} along {name}: the second number must"
                                 " be larger than the first")
            if not -1e-9 * length <= low < high <= length * (1.0 + 1e-9):
                raise ValueError(f"crop = {low:g}, {high:g} along {name}: must lie within"
                                 f" 0 to {length:g}, in the unit of the lengths of the map")
            first, last = round(low / cell), round(high / cell)
            if last - first < (2 if dims == 2 else 3):
                raise ValueError(f"crop = {low:g}, {high:g} along {name}: keeps {last - first}"
                                 f" cells of {cell:g}: too few")
            parts[1 - axis] = slice(first, last)
            if last - first < count:
                self.periodic = False
            self.sizes[axis] = (last - first) * cell
            kept += [first * cell, last * cell]
        self.height = self.height[tuple(parts)]
        if dims == 1:
            self.sizes[1] = self.sizes[0] / self.height.shape[1]
        self.note("crop", kept=kept, nx=self.height.shape[1], ny=self.height.shape[0])

    def level(self, kind: str) -> float | None:
        """Subtract the polynomial that fits the points best.

        A periodic map is not periodic any more without a plane or a paraboloid. The largest
        difference that this makes between opposite edges is returned, and None otherwise.
        """
        if kind == "none":
            return None
        valid = np.isfinite(self.height)
        if not valid.any():
            raise ValueError("the map has no valid point")
        basis, names = polynomial(self.height.shape, kind)
        fit = fit_terms(self.height, valid, basis)
        for coefficient, term in zip(fit, basis, strict=True):
            self.height = self.height - coefficient * term
        self.note("level", kind=kind, coefficients=dict(zip(names, map(float, fit), strict=True)))
        if kind == "mean" or not self.periodic:
            return None
        taken = np.asarray(sum(c * term for c, term in zip(fit, basis, strict=True)))
        self.periodic = False
        return float(max(np.abs(taken[:, -1] - taken[:, 0]).max(),
                         np.abs(taken[-1] - taken[0]).max()))

    def fill(self, most: float, name: str) -> None:
        """Replace missing points by a harmonic surface: each is the mean of its neighbours."""
        missing = ~np.isfinite(self.height)
        count, total = int(missing.sum()), self.height.size
        if count == 0:
            return
        if count == total:
            raise ValueError(f"{name}: the map has no valid point")
        if count > most * total:
            raise ValueError(
                f"{name}: {count} of {total} points are missing ({100 * count / total:.3g} %):"
                f" more than the {100 * most:g} % that are filled (max_missing, --max-missing)")
        self.height = _harmonic(self.height, missing, self.periodic)
        self.note("fill", missing=count, points=total, share=count / total)

    def resample(self, wanted: Sequence[int]) -> None:
        """Change the numbers of cells; the lengths stay the same."""
        ny, nx = self.height.shape
        counts = [whole("resample", one)
                  for one in np.atleast_1d(np.asarray(wanted, dtype=object))]
        if ny == 1 and len(counts) == 1:
            counts.append(1)
        if len(counts) != 2 or counts[0] < 2 or counts[1] < (1 if ny == 1 else 2):
            raise ValueError(f"resample = {wanted}: must be (nx, ny), at least 2 each")
        if ny == 1 and counts[1] != 1:
            raise ValueError(f"resample = {wanted}: a line scan keeps ny = 1")
        self.height = _along_rows(self.height, counts[0], self.periodic)
        self.height = _along_rows(self.height.T, counts[1], self.periodic).T
        if ny == 1:
            self.sizes[1] = self.sizes[0] / counts[0]
        self.note("resample", from_nx=nx, from_ny=ny, nx=counts[0], ny=counts[1])

    def window(self, kind: str, taper: float, restore: bool) -> None:
        """Bring the edges to the mean height by a window, which makes the map periodic."""
        mean = float(np.mean(self.height))
        before = float(np.std(self.height))
        windowed = map_window(self.height.shape, taper) * (self.height - mean)
        after = float(np.std(windowed))
        factor = before / after if restore and after > 0.0 else 1.0
        self.height = mean + factor * windowed
        self.periodic = True
        self.note("window", kind=kind, taper=taper, rms_height_before=before,
                  rms_height_after=factor * after, restore_rms=restore, factor=factor)


def polynomial(shape: tuple[int, int], kind: str) -> tuple[list[FloatArray], list[str]]:
    """Return the terms of a levelling polynomial, in coordinates from -1 to 1, and their names."""
    ny, nx = shape
    x = np.broadcast_to(np.linspace(-1.0, 1.0, nx) if nx > 1 else np.zeros(1), shape)
    y = np.broadcast_to((np.linspace(-1.0, 1.0, ny) if ny > 1 else np.zeros(1))[:, None], shape)
    terms, names = [np.ones(shape)], ["1"]
    if kind in ("tilt", "curvature"):
        terms, names = [*terms, x], [*names, "x"]
        if ny > 1:
            terms, names = [*terms, y], [*names, "y"]
    if kind == "curvature":
        terms, names = [*terms, x * x], [*names, "xx"]
        if ny > 1:
            terms, names = [*terms, x * y, y * y], [*names, "xy", "yy"]
    return terms, names


def fit_terms(height: FloatArray, valid: NDArray[np.bool_], basis: list[FloatArray]) -> FloatArray:
    """Return the least squares coefficients, by normal equations; the terms are well scaled."""
    values = np.where(valid, height, 0.0)
    matrix = np.array([[float(np.sum(a * b * valid)) for b in basis] for a in basis])
    total = np.zeros(len(basis))
    rest = values
    for _ in range(2):  # the second round removes the rounding error of the first
        right = np.array([float(np.sum(a * rest)) for a in basis])
        part = np.linalg.lstsq(matrix, right, rcond=None)[0]
        total += part
        rest = rest - valid * sum(c * a for c, a in zip(part, basis, strict=True))
    return total


def _harmonic(height: FloatArray, missing: NDArray[np.bool_], periodic: bool) -> FloatArray:
    """Fill missing points so that each is the mean of its neighbours (one sparse linear system)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    ny, nx = height.shape
    unknown = np.full(height.shape, -1)
    rows, columns = np.nonzero(missing)
    unknown[rows, columns] = np.arange(rows.size)
    diagonal = np.zeros(rows.size)
    right = np.zeros(rows.size)
    entries: list[tuple[NDArray[Any], NDArray[Any]]] = []
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        j, i = rows + dy, columns + dx
        if periodic:
            j, i = j % ny, i % nx
        inside = (j >= 0) & (j < ny) & (i >= 0) & (i < nx)
        # In a periodic map of one row a point is its own neighbour, which must not count.
        inside &= (np.where(inside, j, 0) != rows) | (np.where(inside, i, 0) != columns)
        at = np.flatnonzero(inside)
        j, i = j[at], i[at]
        diagonal[at] += 1.0
        known = ~missing[j, i]
        np.add.at(right, at[known], height[j[known], i[known]])
        entries.append((at[~known], unknown[j[~known], i[~known]]))
    own = np.arange(rows.size)
    row = np.concatenate([own, *(a for a, _ in entries)])
    column = np.concatenate([own, *(b for _, b in entries)])
    value = np.concatenate([diagonal, *(-np.ones(a.size) for a, _ in entries)])
    matrix = coo_matrix((value, (row, column)), shape=(rows.size, rows.size)).tocsc()
    filled = height.copy()
    filled[rows, columns] = spsolve(matrix, right)
    return filled


def _along_rows(height: FloatArray, count: int, periodic: bool) -> FloatArray:
    """Change the number of cells along the last axis, over the same length."""
    old = height.shape[1]
    if count == old:
        return height
    if count < old:
        edges = np.arange(old + 1) / old
        total = np.concatenate([np.zeros((height.shape[0], 1)), np.cumsum(height, axis=1)], axis=1)
        place = np.arange(count + 1) / count * old
        whole = np.minimum(place.astype(int), old - 1)
        # Interpolate the integral up to each new edge; it is linear within a cell.
        part = total[:, whole] + (place - edges[whole] * old) * height[:, whole]
        return np.diff(part, axis=1) * (count / old)
    from scipy.interpolate import CubicSpline

    centres = (np.arange(old) + 0.5) / old
    wanted = (np.arange(count) + 0.5) / count
    if periodic:
        closed = np.concatenate([height, height[:, :1]], axis=1)
        spline = CubicSpline(np.append(centres, centres[0] + 1.0), closed, axis=1,
                             bc_type="periodic")
    else:
        spline = CubicSpline(centres, height, axis=1)
    return np.asarray(spline(wanted))
