"""Finds numbers in a height map that are no heights: coordinates, and marks of missing points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.names import counted

__all__ = ["refuse_other_numbers"]

FloatArray = NDArray[np.float64]

# Numbers that instruments and geographic information systems write for missing points.
_MARKS = tuple(sign * mark for mark in (999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0)
               for sign in (-1.0, 1.0))
_FAR = 20.0         # least distance of a mark from the heights, over their range
_LEAST = 8          # fewest coordinates that are recognised
_EVEN = 0.02        # largest difference of two steps between coordinates, over the step
_UNEVEN = 0.5       # the least difference of two steps between heights beside them, over their mean


def refuse_other_numbers(path: Path, array: FloatArray) -> None:
    """Refuse a map with coordinates in its first row or column, or with marks of missing points.

    Parameters
    ----------
    path : Path
        The file, for messages.
    array : ndarray, shape (ny, nx)
        Heights in the unit of the file, NaN where missing.

    Raises
    ------
    ValueError
        If numbers of the map are no heights. The message says which.
    """
    _refuse_marks(path, array[np.isfinite(array)])
    if min(array.shape) < 2:
        return
    for name, lines in (("column", array.T), ("row", array)):
        if _are_coordinates(lines[0], lines[1]):
            first, last = lines[0, 1], lines[0, -1]
            raise ValueError(f"{path}: its first {name} rises evenly from {first:g} to {last:g},"
                             " and the next one does not: coordinates are no heights; delete them,"
                             " and give the lengths (size = (lx, ly), --size LX LY)")


def _refuse_marks(path: Path, heights: FloatArray) -> None:
    """Refuse a number that often marks missing points, if it is far from all heights."""
    for mark in {float(heights.min()), float(heights.max())} if heights.size else ():
        others = heights[heights != mark]
        if mark not in _MARKS or not others.size:
            continue
        low, high = float(others.min()), float(others.max())
        if min(abs(mark - low), abs(mark - high)) > _FAR * (high - low):
            times = counted(heights.size - others.size, "time")
            raise ValueError(f"{path}: {mark:g} occurs {times}, far from all other heights, which"
                             f" are {low:g} to {high:g}: if it marks missing points, write nan")


def _are_coordinates(line: FloatArray, beside: FloatArray) -> bool:
    """Return whether a row or column is even and the one beside it is not.

    The first number belongs to both the first row and the first column, and may be anything.

    Examples
    --------
    >>> x = np.arange(20.0)
    >>> _are_coordinates(0.1 * x, np.sin(x)), _are_coordinates(1e3 * x, np.sin(x))
    (True, True)
    >>> _are_coordinates(0.1 * x, 0.1 * x + 1.0)
    False
    """
    steps, others = np.diff(line[1:]), np.diff(beside[1:])
    if steps.size < _LEAST - 1 or not np.all(np.isfinite(steps)) or steps[0] == 0.0:
        return False
    step = float(np.mean(steps))
    if np.ptp(steps) > _EVEN * abs(step):
        return False
    known = others[np.isfinite(others)]
    return bool(known.size and np.ptp(known) > _UNEVEN * abs(float(np.mean(known))))
