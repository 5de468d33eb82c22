"""Single cells of a measured map that lie far off their neighbours: found, counted, removed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.check import positive

__all__ = ["Outliers", "find_outliers"]

FloatArray = NDArray[np.float64]

_LIMIT = 12.0           # of the usual distance from the neighbours
_USUAL = 1.4826         # standard deviation of a normal distribution over its median deviation


class Outliers(NamedTuple):
    """Cells that lie far off.

    Attributes
    ----------
    cells : ndarray of bool, shape (ny, nx)
        Which cells.
    mended : ndarray, shape (ny, nx)
        The map with the median of the neighbours in these cells, m.
    count : int
        How many.
    largest : float
        The largest distance from the median of the neighbours, m; 0 without outliers.
    usual : float
        The usual distance, as a standard deviation, m.
    """

    cells: NDArray[np.bool_]
    mended: FloatArray
    count: int
    largest: float
    usual: float

    def told(self) -> str:
        """Return what was found, in words."""
        if not self.count:
            return "no cell lies far off its neighbours"
        return (f"{self.count} of {self.cells.size} cells lie far off their neighbours, by up to"
                f" {self.largest:.3g} m where {self.usual:.3g} m is usual")


def find_outliers(height: FloatArray, limit: float = _LIMIT) -> Outliers:
    """Find cells that lie further beyond their neighbours than is usual between neighbours.

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m.
    limit : float
        A cell lies far off where it lies beyond its neighbours by so many times the usual
        distance from their median, > 0. Up to two such cells may touch each other.

    Returns
    -------
    Outliers

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
    # of a map that is mostly flat the median says nothing: then the mean distance counts
    scale = usual if usual > 0.0 else float(np.abs(height - around).mean())
    excess = np.maximum(height - high, low - height)
    cells = excess > limit * scale if scale > 0.0 else np.zeros(height.shape, dtype=bool)
    mended = np.where(cells, around, height)
    return Outliers(cells, mended, int(cells.sum()),
                    float(np.abs(height - around)[cells].max()) if cells.any() else 0.0, usual)


def _neighbours(height: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the median, the third lowest and the third highest of the neighbours of each cell.

    The neighbours lie within two rows and columns. At a steep edge a cell lies far from their
    median, but not beyond them; and two outliers side by side do not hide each other.
    """
    from scipy.ndimage import rank_filter

    shape = (5 if height.shape[0] > 1 else 1, 5 if height.shape[1] > 1 else 1)
    footprint = np.ones(shape, dtype=bool)
    footprint[shape[0] // 2, shape[1] // 2] = False
    count = int(footprint.sum())
    third = 2 if count > 8 else 1

    def ranked(rank: int) -> FloatArray:
        return rank_filter(height, rank, footprint=footprint, mode="reflect")

    return 0.5 * (ranked(count // 2 - 1) + ranked(count // 2)), ranked(third), ranked(
        count - 1 - third)
