"""Points of a DMA table that do not fit their neighbours, usually because of a typing error."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .dma_sweeps import Sweep
from .dma_table import DmaTable

__all__ = ["outlier_notes"]

FloatArray = NDArray[np.float64]
Indices = NDArray[np.intp]

_LEAST_POINTS = 6       # of a sweep, below which its course is not known
_FACTOR = 1.4           # least ratio of the value to the one that its neighbours suggest
_SMOOTHER = 0.05        # roughness of the sweep without the point, over that with it
_MOST = 3               # outliers of a sweep that are sought; more are its true course
_WIDEST = 1.1           # decades of a point and its two neighbours, beyond which the curve may bend
_NAMED = 3              # outliers that the note names


def outlier_notes(table: DmaTable, sweeps: list[Sweep]) -> list[str]:
    """Return a note on the moduli that differ strongly from those at neighbouring frequencies.

    Parameters
    ----------
    table : DmaTable
        The measurements.
    sweeps : list of (float, ndarray of int)
        Temperature and points of each sweep. Without sweeps, a table without temperatures counts as
        one sweep; in one with temperatures there are no neighbours.

    Returns
    -------
    list of str
        The note, or nothing.
    """
    parts = list(sweeps)
    if table.temperature is None:
        parts = [(math.nan, np.arange(table.omega.size))]
    found: list[tuple[float, str]] = []
    for temperature, rows in parts:
        at = f" at {temperature:.4g} C" if math.isfinite(temperature) else ""
        rows = rows[np.argsort(table.omega[rows], kind="stable")]
        for name, values in (("storage", table.storage), ("loss", table.loss)):
            for k, distance in _outliers(np.log10(table.omega[rows]), np.log10(values[rows])):
                value, omega = float(values[rows[k]]), float(table.omega[rows[k]])
                found.append((abs(distance), f"the {name} modulus {value:.4g} Pa{at} and"
                              f" {omega:.4g} rad/s ({omega / (2.0 * math.pi):.4g} Hz) is"
                              f" {10.0**distance:.3g} times what its neighbours suggest"))
    if not found:
        return []
    found.sort(key=lambda one: -one[0])
    more = len(found) - _NAMED
    return ["; ".join(text for _, text in found[:_NAMED])
            + (f"; and {more} more" if more > 0 else "")
            + ": correct such points or leave them out, because each moves the curve"]


def _outliers(x: FloatArray, y: FloatArray) -> list[tuple[int, float]]:
    """Return the points without which a curve is far smoother, and how far they are from it.

    The roughness is the sum of squares of the distances of all points from the line between their
    neighbours. A kink or a jump of the curve remains when a point is taken out, an outlier does
    not.
    """
    kept = np.flatnonzero(np.diff(x, prepend=-math.inf) > 0.0)
    found: list[tuple[int, float]] = []
    while kept.size >= _LEAST_POINTS and len(found) <= _MOST:
        without = np.array([_roughness(np.delete(x[kept], k), np.delete(y[kept], k))
                            for k in range(kept.size)])
        k = int(without.argmin())
        expected, width = _expected(x[kept], y[kept], k)
        distance = float(y[kept[k]]) - expected
        if (without[k] > _SMOOTHER * _roughness(x[kept], y[kept]) or width > _WIDEST
                or abs(distance) < math.log10(_FACTOR)):
            break
        found.append((int(kept[k]), distance))
        kept = np.delete(kept, k)
    return found if len(found) <= _MOST else []


def _roughness(x: FloatArray, y: FloatArray) -> float:
    """Return the sum of squares of the distances from the line between the neighbours."""
    part = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    return float(np.sum((y[1:-1] - (1.0 - part) * y[:-2] - part * y[2:])**2))


def _expected(x: FloatArray, y: FloatArray, k: int) -> tuple[float, float]:
    """Return the value at a point on the line through two neighbours, and the width of the three.

    The neighbours of the first and of the last point are on one side.
    """
    first = min(max(k - 1, 0), x.size - 3)
    i, j = (place for place in range(first, first + 3) if place != k)
    value = y[i] + (y[j] - y[i]) * (x[k] - x[i]) / (x[j] - x[i])
    return float(value), float(x[first + 2] - x[first])
