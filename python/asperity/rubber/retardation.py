"""The retardation spectrum of a Prony series, which describes its creep under a constant stress."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

__all__ = ["retardation_spectrum"]

FloatArray = NDArray[np.float64]


def retardation_spectrum(
    g_inf: float, g: FloatArray, tau: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return retardation times, compliances and fluidity of a Prony series.

    From the relation s J~(s) s G~(s) = 1 of the Laplace transforms, the retardation rates x are the
    roots of g_inf + sum g x/(x - 1/tau) = 0. There is one root below each relaxation rate and above
    the next smaller one. The unknown of the search is the logarithm of its distance from the nearer
    relaxation rate, which avoids cancellation for times that are far apart or close together.

    Parameters
    ----------
    g_inf : float
        Long-term modulus, Pa.
    g, tau : ndarray, shape (n,)
        Moduli, Pa, and relaxation times, s.

    Returns
    -------
    theta, compliance : ndarray
        Retardation times, s, descending, and their compliances, 1/Pa.
    fluidity : float
        Rate of steady flow, 1/(Pa s); 0 for a solid.
    """
    used = g > 0.0
    rates, inverse = np.unique(1.0 / tau[used], return_inverse=True)
    moduli = np.bincount(inverse, weights=g[used], minlength=rates.size)
    solid = g_inf > 0.0
    fluidity = 0.0 if solid else 1.0 / float(np.sum(moduli / rates))
    theta: list[float] = []
    compliance: list[float] = []
    for j in range(0 if solid else 1, rates.size):
        below = rates[j - 1] if j else 0.0
        half = 0.5 * (rates[j] - below)
        from_rates = np.array([below - rates, rates[j] - rates])

        def balance(offset: float, side: int, below=below, j=j, from_rates=from_rates) -> float:
            x = (rates[j] if side else below) + offset
            return g_inf + float(np.sum(moduli * (x / (from_rates[side] + offset))))

        side = 1 if balance(half, 0) > 0.0 else 0
        sign = -1.0 if side else 1.0

        def logarithmic(y: float, side=side, sign=sign, balance=balance) -> float:
            return balance(sign * math.exp(y), side)

        top = math.log(half)
        bottom = top - 160.0
        if logarithmic(bottom) * logarithmic(top) >= 0.0:
            root = bottom if abs(logarithmic(bottom)) < abs(logarithmic(top)) else top
        else:
            root = brentq(logarithmic, bottom, top, xtol=1e-15, rtol=1e-15, maxiter=500)
        offset = sign * math.exp(root)
        x = (rates[j] if side else below) + offset
        slope = float(np.sum(moduli * rates / (from_rates[side] + offset) ** 2))
        theta.append(1.0 / x)
        compliance.append(1.0 / (x * slope))
    return np.array(theta), np.array(compliance), fluidity
