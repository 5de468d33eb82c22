"""The law of Williams, Landel and Ferry for the shift of relaxation times with the temperature."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of, number, positive

__all__ = ["WLF"]

FloatArray = NDArray[np.float64]


class WLF(NamedTuple):
    """Constants of the Williams-Landel-Ferry shift, log10 a_T = -c1 (T - T_ref)/(c2 + T - T_ref).

    Parameters
    ----------
    c1 : float
        First constant, dimensionless.
    c2 : float
        Second constant, K.
    t_ref : float
        Reference temperature, in the scale of the temperatures given later (C or K).

    References
    ----------
    M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701.

    Examples
    --------
    >>> float(WLF(17.44, 51.6, -60.0).shift_factor(-60.0))
    1.0
    """

    c1: float
    c2: float
    t_ref: float

    def shift_factor(self, temperature: ArrayLike) -> FloatArray:
        """Return a_T = tau(T)/tau(T_ref).

        Parameters
        ----------
        temperature : array_like
            Temperatures, any shape; T - t_ref > -c2.

        Returns
        -------
        ndarray
            a_T, dimensionless, shape of `temperature`.

        Raises
        ------
        ValueError
            If a temperature is at or below t_ref - c2, where the law diverges.
        """
        c2 = positive("wlf c2", self.c2)
        c1 = number("wlf c1", self.c1, 0.0)
        t_ref = number("wlf t_ref", self.t_ref)
        values = array_of("temperature", temperature)
        if np.any(values - t_ref <= -c2):
            raise ValueError(
                f"temperature = {float(np.min(values))!r}: must be > t_ref - c2 = {t_ref - c2:g}"
            )
        return 10.0 ** (-c1 * (values - t_ref) / (c2 + values - t_ref))
