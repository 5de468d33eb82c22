"""Outliers of a map or a profile: single cells that differ strongly from their neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base.check import positive

__all__ = ["Outliers", "find_outliers"]

FloatArray = NDArray[np.float64]

_LIMIT = 12.0           # in units of the usual distance of a cell from its neighbours
_END = 6                # cells of a profile from which it is continued beyond its ends
_USUAL = 1.4826         # standard deviation over median deviation of a normal distribution


@dataclass(frozen=True, eq=False)
class Outliers:
    """The outliers of a map.

    Attributes
    ----------
    cells : ndarray of bool, shape (ny, nx)
        True for outliers.
    mended : ndarray, shape (ny, nx)
        The map, in which the median of the neighbours replaces each outlier, m.
    count : int
        Number of outliers.
    largest : float
        Largest distance of an outlier from the median of its neighbours, m; 0 without outliers.
    usual : float
        The usual distance of a cell from this median, as a standard deviation, m.
    """

    cells: NDArray[np.bool_]
    mended: FloatArray
    count: int
    largest: float
    usual: float

    def summary(self) -> str:
        """Return a sentence about what was found."""
        name = "cell" if self.cells.shape[0] > 1 else "point"
        if not self.count:
            return f"no {name} lies far off its neighbours"
        return (f"{self.count} of {self.cells.size} {name}s lie far off their neighbours, by up to"
                f" {self.largest:.3g} m where {self.usual:.3g} m is usual")


def find_outliers(height: FloatArray, limit: float = _LIMIT) -> Outliers:
    """Find cells that are much higher or lower than all their neighbours.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m; ny = 1 for a profile.
    limit : float
        How far an outlier is above or below its neighbours, in units of the usual distance of a
        cell from their median, > 0. Up to two outliers may be next to each other.

    Returns
    -------
    Outliers

    Raises
    ------
    ValueError
        If the limit is not positive.

    Examples
    --------
    >>> map_ = np.add.outer(np.sin(np.arange(64)), np.cos(0.3 * np.arange(64)))
    >>> map_[20, 30] = 50.0
    >>> find_outliers(map_).count
    1
    """
    positive("limit", limit)
    around, low, high = _neighbours(height)
    usual = _USUAL * float(np.median(np.abs(height - around)))
    # If most of the map is flat, the median distance is 0, and the mean distance replaces it.
    scale = usual if usual > 0.0 else float(np.abs(height - around).mean())
    excess = np.maximum(height - high, low - height)
    cells = excess > limit * scale if scale > 0.0 else np.zeros(height.shape, dtype=bool)
    mended = np.where(cells, around, height)
    return Outliers(cells, mended, int(cells.sum()),
                    float(np.abs(height - around)[cells].max()) if cells.any() else 0.0, usual)


def _neighbours(height: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the median, the third lowest and the third highest of the neighbours of each cell.

    The neighbours are the cells within two rows and columns. A cell at a steep edge is far from
    their median, but not beyond the third highest or lowest of them. With the third, two outliers
    side by side do not hide each other.
    """
    from scipy.ndimage import rank_filter

    if height.shape[0] == 1:
        height = _continued(height)
    shape = (5 if height.shape[0] > 1 else 1, 5 if height.shape[1] > 1 else 1)
    footprint = np.ones(shape, dtype=bool)
    footprint[shape[0] // 2, shape[1] // 2] = False
    count = int(footprint.sum())
    third = 2 if count > 8 else 1

    inside = slice(2, -2) if height.shape[0] == 1 else slice(None)

    def ranked(rank: int) -> FloatArray:
        return rank_filter(height, rank, footprint=footprint, mode="reflect")[:, inside]

    return 0.5 * (ranked(count // 2 - 1) + ranked(count // 2)), ranked(third), ranked(
        count - 1 - third)


def _continued(height: FloatArray) -> FloatArray:
    """Return a profile with two more points at each end, on the line of its last points.

    Reflected points would make the end of a slope an outlier. Medians give the line, so that an
    outlier at the end does not affect it.
    """
    def beyond(line: FloatArray) -> FloatArray:
        near = line[:_END]
        slope = float(np.median(np.diff(near)))
        level = float(np.median(near - slope * np.arange(near.size)))
        return level - slope * np.arange(1.0, 3.0)

    line = height[0]
    return np.concatenate([beyond(line)[::-1], line, beyond(line[::-1])])[None, :]
