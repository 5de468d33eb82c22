"""Fit of the moduli of a Prony series to measured storage and loss moduli.

The relaxation times are given and evenly spaced on a log scale. The moduli minimise the relative
misfit (non-negative least squares); of all series that fit nearly as well, the smoothest is chosen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from ..base.check import array_of, listed, number, positive
from ..base.errors import NotConverged

__all__ = ["MOST_ARMS", "FittedModuli", "fit_moduli"]

FloatArray = NDArray[np.float64]

MOST_ARMS = 200  # limit for a fit; two per decade leave a ripple of 0.1 %, so more are not useful


class FittedModuli(NamedTuple):
    """A fitted series and its data.

    Attributes
    ----------
    g_inf : float
        Plateau, Pa.
    g, tau : ndarray, shape (arms,)
        Moduli, Pa, and relaxation times, s.
    omega, storage, loss : ndarray, shape (n,)
        The data, rad/s and Pa.
    """

    g_inf: float
    g: FloatArray
    tau: FloatArray
    omega: FloatArray
    storage: FloatArray
    loss: FloatArray


def fit_moduli(
    omega: ArrayLike,
    storage: ArrayLike,
    loss: ArrayLike,
    *,
    arms_per_decade: float,
    tau_range: tuple[float, float] | None,
    slack: float,
    least_plateau: float,
) -> FittedModuli:
    """Fit a series; `asperity.material.Prony.fit` documents the arguments.

    Returns
    -------
    FittedModuli

    Raises
    ------
    ValueError
        If values are out of range or shapes differ.
    NotConverged
        If the least squares find no solution.
    """
    frequency = array_of("omega", omega, low=0.0, low_open=True, ndim=1)
    real = array_of("storage", storage, low=0.0, low_open=True, ndim=1)
    imaginary = array_of("loss", loss, low=0.0, low_open=True, ndim=1)
    density = positive("arms_per_decade", arms_per_decade)
    slack = number("slack", slack, 0.0)
    floor = number("least_plateau", least_plateau, 0.0, 1.0)
    for name, values in (("storage", real), ("loss", imaginary)):
        if values.size != frequency.size:
            raise ValueError(
                f"{name}: has {values.size} values, must have as many as omega, {frequency.size}")
    if frequency.size < 2:
        raise ValueError(f"omega: has {frequency.size} values, must have at least 2")
    tau = _relaxation_times(frequency, density, tau_range)
    order = np.argsort(frequency)
    scale = np.exp(np.interp(-np.log(tau), np.log(frequency[order]), np.log(imaginary[order])))
    unknowns = _smoothest(_system(frequency, real, imaginary, tau, scale), floor, slack)
    g = unknowns[1:] * scale
    keep = g > 0.0
    return FittedModuli(float((floor + unknowns[0]) * real.min()), g[keep], tau[keep], frequency,
                        real, imaginary)


def _relaxation_times(
    frequency: FloatArray, density: float, tau_range: tuple[float, float] | None
) -> FloatArray:
    """Return the relaxation times, evenly spaced on a log scale."""
    if tau_range is None:
        tau_range = (0.1 / float(frequency.max()), 10.0 / float(frequency.min()))
    listed("tau_range", tau_range, "shortest", "longest")
    shortest = positive("tau_range[0]", tau_range[0])
    longest = number("tau_range[1]", tau_range[1], shortest)
    count = max(1, round(density * math.log10(longest / shortest)) + 1)
    if count > MOST_ARMS:
        raise ValueError(f"arms_per_decade = {density:g}: gives {count} relaxation times from"
                         f" {shortest:.3g} to {longest:.3g} s: must be at most {MOST_ARMS}")
    return np.geomspace(shortest, longest, count) if count > 1 else np.array([shortest])


def _system(frequency: FloatArray, real: FloatArray, imaginary: FloatArray, tau: FloatArray,
            scale: FloatArray) -> FloatArray:
    """Return the matrix that maps scaled moduli to fit/data, with storage above loss."""
    x = frequency[:, None] * tau
    blocks = scale * x / (1.0 + x * x)
    return np.vstack([
        np.column_stack([np.full(frequency.size, real.min()), x * blocks]) / real[:, None],
        np.column_stack([np.zeros(frequency.size), blocks]) / imaginary[:, None],
    ])


def _smoothest(columns: FloatArray, floor: float, slack: float) -> FloatArray:
    """Return the smoothest unknowns >= 0 whose misfit is nearly the smallest one."""
    count = columns.shape[1] - 1
    target = np.ones(len(columns)) - floor * columns[:, 0]
    penalty = np.zeros((max(count - 2, 0), count + 1))
    for row in range(count - 2):
        penalty[row, row + 1 : row + 4] = 1.0, -2.0, 1.0

    def solve(weight: float) -> tuple[FloatArray, float]:
        system = np.vstack([columns, weight * penalty])
        right = np.concatenate([target, np.zeros(len(penalty))])
        try:
            unknowns, _ = nnls(system, right, maxiter=50 * (count + 1))
        except RuntimeError as error:
            raise NotConverged(f"the fit of {count} moduli has found no solution: {error}"
                               " try fewer relaxation times") from None
        misfit = float(np.sqrt(np.mean((columns @ unknowns - target) ** 2)))
        return unknowns, misfit

    best, least = solve(0.0)
    allowed = (1.0 + slack) * least + (1e-4 if slack > 0.0 else 0.0)
    if len(penalty):
        for weight in np.geomspace(1e3, 1e-6, 46):
            candidate, misfit = solve(weight)
            if misfit <= allowed:
                return candidate
    return best
