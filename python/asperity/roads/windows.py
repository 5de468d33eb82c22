"""Windows that bring a map to zero at its edges."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["cosine_window", "map_window"]

FloatArray = NDArray[np.float64]


def cosine_window(count: int, taper: float = 1.0) -> FloatArray:
    """Return a window with cosine flanks at the centres of cells (Tukey's window).

    Parameters
    ----------
    count : int
        Number of cells.
    taper : float
        Share of the length that the two flanks take, above 0. With 1 it is Hann's window.

    Returns
    -------
    ndarray, shape (count,)
        Weights, 0 to 1.

    Examples
    --------
    >>> cosine_window(4, 0.5).round(2).tolist()
    [0.5, 1.0, 1.0, 0.5]
    """
    place = (np.arange(count) + 0.5) / count
    near = np.minimum(place, 1.0 - place)  # distance from the nearer edge
    ramp = np.clip(2.0 * near / taper, 0.0, 1.0)
    return 0.5 * (1.0 - np.cos(math.pi * ramp))


def map_window(shape: tuple[int, int], taper: float = 1.0) -> FloatArray:
    """Return the product of the windows along both axes of a map; a profile has one along x.

    Parameters
    ----------
    shape : (int, int)
        Cells (ny, nx) of the map.
    taper : float
        As in `cosine_window`.

    Returns
    -------
    ndarray, shape (ny, nx)
        Weights, 0 to 1.

    Examples
    --------
    >>> map_window((1, 2)).round(2).tolist()
    [[0.5, 0.5]]
    """
    ny, nx = shape
    rows = np.ones(1) if ny == 1 else cosine_window(ny, taper)
    return np.asarray(rows[:, None] * cosine_window(nx, taper))
