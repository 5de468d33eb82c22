"""Conversion of a friction law that is a Python function into a table for the program.

The solvers need the bound of the traction in parallel loops, in which Python cannot be called. The
function is therefore sampled here, and the points of ``law = 'table'`` replace it. The law is then
part of the input, of checkpoints, of sweeps and of runs in several processes like any other law.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import stresses_of

__all__ = ["sampled_law"]

LOWEST, HIGHEST = 1e-3, 1e11  # range of pressures, Pa, in which the lines follow the function
PER_DECADE = 8                # smallest number of samples per decade
ERROR = 5e-5                  # relative error of the straight lines
NARROWEST = 1e-4              # relative width of intervals that are not divided further (jumps)
MOST = 4000                   # largest number of points

Law = Callable[[NDArray[np.float64]], ArrayLike]


def sampled_law(function: Law) -> tuple[list[float], list[float]]:
    """Return the points of a table whose straight lines follow a function.

    Parameters
    ----------
    function : callable
        Takes an array of pressures, Pa, from 0 to 1e11, and returns the largest tractions,
        Pa, as an array of the same shape: finite and 0 or more.

    Returns
    -------
    pressures, strengths : list of float
        Points, Pa. Between 1e-3 Pa and 1e11 Pa the lines differ from the function by less than
        1e-4 of its value. A function of straight lines is exact to round-off, and jumps become
        steep ramps.

    Raises
    ------
    ValueError
        If the function returns anything else, or changes too often.

    Examples
    --------
    >>> sampled_law(lambda pressure: 2.0e4 + 0.25 * pressure)
    ([0.0, 100000000000.0], [20000.0, 25000020000.0])
    >>> len(sampled_law(lambda pressure: 1e5 * np.tanh(pressure / 1e6))[0])
    198
    """
    decades = round(np.log10(HIGHEST / LOWEST))
    points = np.concatenate([[0.0], _rounded(np.geomspace(LOWEST, HIGHEST,
                                                          PER_DECADE * decades + 1))])
    bounds = _called(function, points)
    while True:
        wide = points[2:] > (1 + NARROWEST) * points[1:-1]
        middle = _rounded(np.sqrt(points[1:-1] * points[2:]))[wide]
        if middle.size == 0:
            break
        found = _called(function, middle)
        off = np.abs(found - np.interp(middle, points, bounds)) > ERROR * found
        if not off.any():
            break
        at = np.searchsorted(points, middle[off])
        points = np.insert(points, at, middle[off])
        bounds = np.insert(bounds, at, found[off])
        if points.size > MOST:
            raise ValueError("the friction law changes too often: straight lines between"
                             f" {MOST} pressures do not follow the function")
    points, bounds = _thinned(points, bounds)
    return points.tolist(), bounds.tolist()


def _rounded(pressures: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return pressures with six digits, so that inputs stay short."""
    return np.array([float(f"{pressure:.6g}") for pressure in pressures])


def _called(function: Law, pressures: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the bounds at some pressures, and check them."""
    return stresses_of("the friction law", function, pressures, "pressure", "Pa")


def _thinned(points: NDArray[np.float64], bounds: NDArray[np.float64]
             ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points without those that are on the line between their neighbours."""
    first = 1
    while True:
        inner = np.arange(first, points.size - 1, 2)  # no two neighbours at once
        part = (points[inner] - points[inner - 1]) / (points[inner + 1] - points[inner - 1])
        line = bounds[inner - 1] + part * (bounds[inner + 1] - bounds[inner - 1])
        gone = inner[np.abs(line - bounds[inner]) <= 1e-14 * bounds[inner]]
        if gone.size == 0 and first == 2:
            return points, bounds
        first = 2 if gone.size == 0 else 1
        points, bounds = np.delete(points, gone), np.delete(bounds, gone)
