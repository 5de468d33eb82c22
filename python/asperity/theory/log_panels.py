"""The power spectral density of a rough surface at points for integrals over the wave number.

The power spectral density Phi(k) = |h_hat(k)|^2/A (thesis, eq. 1.5; m^4) is that of an isotropic
surface: mean(h^2) = int Phi k dk/(2 pi), mean(|grad h|^2) = int Phi k^3 dk/(2 pi). Persson's
C(q) is Phi/(4 pi^2). It is given at knots and is a power law between them, a straight line in
log-log. If it is zero at one of two neighbouring knots, it has the value of the other knot in the
half of the interval next to that knot, and is zero in the other half.

The intervals are divided into panels of log k with Gauss points in each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of

__all__ = ["Panels", "panels_of"]

FloatArray = NDArray[np.float64]

_ORDER = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)
_GRADED = 41             # parts of the first panel
_PHASE = 8.0             # rad, largest change of a phase in a panel that resolves it
_MOST_PARTS = 800        # in which panels may be divided in order to resolve a phase


def _running_weights() -> FloatArray:
    """Return B with int_{-1}^{x_i} f = sum_j B_ij f(x_j) for polynomials through the nodes."""
    legendre = np.polynomial.legendre
    primitive = np.empty((_ORDER, _ORDER))
    for n in range(_ORDER):
        unit = np.zeros(n + 1)
        unit[n] = 1.0
        primitive[:, n] = legendre.legval(_NODES, legendre.legint(unit, lbnd=-1.0))
    return primitive @ np.linalg.inv(legendre.legvander(_NODES, _ORDER - 1))


_RUNNING = _running_weights()


@dataclass(frozen=True)
class Panels:
    """Panels of log k, in each of which the power spectral density is a power law.

    Attributes
    ----------
    low, half : ndarray, shape (panels,)
        Lower ends, and half lengths, of log k, with k in rad/m.
    level, slope : ndarray, shape (panels,)
        Logarithm of the density (m^4) at the lower end, and its derivative with log k.
    """

    low: FloatArray
    half: FloatArray
    level: FloatArray
    slope: FloatArray

    @cached_property
    def _offset(self) -> FloatArray:
        """Distances of the Gauss points from the lower ends."""
        return self.half[:, None] * (1.0 + _NODES)

    @cached_property
    def k(self) -> FloatArray:
        """Wave numbers of the Gauss points, rad/m, shape (panels, points)."""
        return np.exp(self.low[:, None] + self._offset)

    @cached_property
    def psd(self) -> FloatArray:
        """Density at the Gauss points, m^4, shape (panels, points)."""
        return np.exp(self.level[:, None] + self.slope[:, None] * self._offset)

    @property
    def end(self) -> float:
        """The largest wave number, rad/m."""
        return math.exp(self.low[-1] + 2.0 * self.half[-1])

    def parts(self, f: FloatArray) -> FloatArray:
        """Return int f dk over each panel; leading axes of f are kept."""
        return self.half * np.sum(_WEIGHTS * self.k * f, axis=-1)

    def total(self, f: FloatArray) -> float:
        """Return int f dk."""
        return float(np.sum(self.parts(f)))

    def running(self, f: FloatArray) -> FloatArray:
        """Return int_{k_0}^{k} f dk at all the points; leading axes of f are kept."""
        panels = self.parts(f)
        before = np.cumsum(panels, axis=-1) - panels
        return before[..., None] + self.half[:, None] * ((f * self.k) @ _RUNNING.T)

    def divided(self, parts: NDArray[np.intp]) -> Panels:
        """Return panels of which each is divided into the given number of parts."""
        index = np.repeat(np.arange(parts.size), parts)
        place = np.arange(index.size) - np.repeat(np.cumsum(parts) - parts, parts)
        half = (self.half / parts)[index]
        offset = 2.0 * half * place
        return Panels(self.low[index] + offset, half,
                      self.level[index] + self.slope[index] * offset, self.slope[index])

    def resolving(self, path: float) -> tuple[Panels, NDArray[np.bool_]]:
        """Return panels that resolve a function of the phase k path, as far as possible.

        Panels of large wave numbers are not divided if this would take more than `_MOST_PARTS`
        parts altogether.

        Parameters
        ----------
        path : float
            Length, m.

        Returns
        -------
        panels : Panels
            The divided panels.
        resolved : ndarray of bool, shape (panels,)
            Whether the phase changes little enough in a panel.
        """
        wanted = np.maximum(np.ceil(self._turns(path) / _PHASE), 1.0)
        parts = np.where(np.cumsum(wanted - 1.0) <= _MOST_PARTS, wanted, 1.0).astype(np.intp)
        panels = self.divided(parts)
        return panels, panels._turns(path) <= 1.2 * _PHASE

    def _turns(self, path: float) -> FloatArray:
        """Return the change of the phase k path in each panel, rad."""
        return path * np.exp(self.low) * np.expm1(2.0 * self.half)


def panels_of(wavenumber: ArrayLike, psd: ArrayLike) -> Panels:
    """Return the panels of a spectrum.

    Parameters
    ----------
    wavenumber, psd : array_like, shape (m,)
        Knots, rad/m, ascending, and the density at the knots, m^4.

    Returns
    -------
    Panels
        They are so short that integrals over k which grow as its powers are computed accurately.

    Raises
    ------
    ValueError
        If a value is out of range, or the density is zero everywhere.
    """
    k = array_of("wavenumber", wavenumber, low=0.0, low_open=True, ndim=1, increasing=True)
    phi = array_of("psd", psd, low=0.0, ndim=1)
    if k.size < 2 or phi.size != k.size:
        raise ValueError(
            f"wavenumber, psd: have {k.size} and {phi.size} values:"
            " must have the same number, at least 2"
        )
    # Values far below all others are round-off of a Fourier transform.
    moment = phi * k**3
    present = moment > 1e-20 * moment.max()
    if not np.any(present):
        raise ValueError("psd: all values are 0.0: must have one > 0")
    intervals = _intervals(np.log(k), np.log(np.where(present, phi, 1.0)), present)
    # Growth by a factor of e in a panel is a smooth function.
    panels = intervals.divided(np.maximum(1, np.ceil(
        2.0 * intervals.half * np.maximum(4.0, np.abs(intervals.slope) + 2.0))).astype(np.intp))
    # If E* is far above p, the area falls from 1 close to the first wave number: refine there.
    parts = 2.0 * panels.half[0] * np.append(0.0, 0.5 ** np.arange(_GRADED - 1, -1, -1))
    return Panels(np.append(panels.low[0] + parts[:-1], panels.low[1:]),
                  np.append(0.5 * np.diff(parts), panels.half[1:]),
                  np.append(panels.level[0] + panels.slope[0] * parts[:-1], panels.level[1:]),
                  np.append(np.full(_GRADED, panels.slope[0]), panels.slope[1:]))


def _intervals(knots: FloatArray, level: FloatArray, present: NDArray[np.bool_]) -> Panels:
    """Return the intervals between the knots where the density is not zero, as panels."""
    found: list[tuple[float, float, float, float]] = []
    for i in range(knots.size - 1):
        a, b = knots[i], knots[i + 1]
        middle = 0.5 * (a + b)
        if present[i] and present[i + 1]:
            found.append((a, b, level[i], (level[i + 1] - level[i]) / (b - a)))
        elif present[i]:
            found.append((a, middle, level[i], 0.0))
        elif present[i + 1]:
            found.append((middle, b, level[i + 1], 0.0))
    low, high, start, slope = (np.array(column) for column in zip(*found, strict=True))
    return Panels(low, 0.5 * (high - low), start, slope)
