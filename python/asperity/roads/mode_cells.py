"""Mean densities of a spectrum over the cells of the Fourier modes of a map.

The cell of a mode is the rectangle of the wave-vector plane that is nearest to it. The cells fill
the plane, so that modes with the mean density of their cells have the variance of the spectrum.
With the density at the modes themselves, modes on the edge of the spectrum would count in full,
although half of their cells has no waves: the rms height would be 12 % too large on a side of two
longest waves, and 32 % on a side of one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["mean_densities"]

FloatArray = NDArray[np.float64]

# Within this many steps of the origin the density is too curved for its value at the mode: at 16
# steps the mean over the cell of a power law differs by 0.2 %.
_NEAR = 16.0
_PARTS = 32             # of a cell, along the longer step, if it is near or across an edge
_MOST_POINTS = 1 << 20  # that are evaluated at once


def mean_densities(density: Callable[[FloatArray], FloatArray], edges: tuple[float, float],
                   kx: NDArray[np.floating], ky: NDArray[np.floating]) -> FloatArray:
    """Return the mean density over the cell of each mode.

    Parameters
    ----------
    density : callable
        Returns the density, m4, at wave numbers, rad/m; zero outside the edges.
    edges : (float, float)
        First and last wave number of the spectrum, rad/m.
    kx : ndarray, shape (mx,)
        Wave numbers of the modes along x, rad/m, from 0 in equal steps.
    ky : ndarray, shape (my,)
        Those along y in the order of `numpy.fft.fftfreq`.

    Returns
    -------
    ndarray, shape (my, mx)
        Mean densities, m4; that of the mode without waves is zero.
    """
    steps = [float(k[1] - k[0]) if k.size > 1 else 0.0 for k in (kx, ky)]
    radius = np.hypot(kx, ky[:, None])
    found = density(radius)
    reach = 0.5 * math.hypot(*steps)
    # Most of the time goes into the whole plane, so that its tests are few and cheap.
    uneven = radius <= max(_NEAR * max(steps), edges[0] + reach)
    uneven &= radius >= edges[0] - reach
    uneven |= np.abs(radius - edges[1]) <= reach
    rows, columns = np.nonzero(uneven)
    parts = [max(1, math.ceil(_PARTS * step / max(steps))) if step > 0.0 else 1 for step in steps]
    x, y = (step * ((np.arange(count) + 0.5) / count - 0.5)
            for step, count in zip(steps, parts, strict=True))
    most = max(1, _MOST_POINTS // (parts[0] * parts[1]))
    for first in range(0, rows.size, most):
        row, column = rows[first : first + most], columns[first : first + most]
        inner = np.hypot(kx[column, None, None] + x, ky[row, None, None] + y[:, None])
        found[row, column] = density(inner).mean(axis=(1, 2))
    found[0, 0] = 0.0
    return found
