"""A rubber at any temperature: its Prony series, its temperature shift, and its measured range."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base.check import number
from .prony import Prony
from .wlf import WLF

__all__ = ["Compound"]


@dataclass(frozen=True)
class Compound:
    """A rubber.

    Attributes
    ----------
    series : Prony
        Prony series at the reference temperature.
    reference : float or None
        Reference temperature, C; None if the rubber is known at a single, unnamed temperature.
    wlf : WLF or None
        Law of the shift.
    shifts : dict
        log10 a_T by measured temperature (C), for a rubber without such a law.
    vertical_shifts : dict
        log10 b_T by measured temperature (C); if it is empty, b_T = 1.
    valid_range : (float, float) or None
        Lowest and highest measured angular frequency at the reference temperature, rad/s.
    name : str
        Origin of the data.
    notes : list of str
        Notes for the user.
    poisson : float
        Poisson ratio.
    usual : float or None
        Default temperature, C; None means the reference temperature.
    """

    series: Prony
    reference: float | None = None
    wlf: WLF | None = None
    shifts: dict[float, float] = field(default_factory=dict)
    vertical_shifts: dict[float, float] = field(default_factory=dict)
    valid_range: tuple[float, float] | None = None
    name: str = "rubber"
    notes: list[str] = field(default_factory=list)
    poisson: float = 0.5
    usual: float | None = None

    @property
    def temperature(self) -> float:
        """The default temperature, C; NaN if no temperature is known."""
        found = self.reference if self.usual is None else self.usual
        return math.nan if found is None else found

    def a_t(self, temperature: float) -> float:
        """Return a_T, the ratio of the relaxation times to those at the reference temperature.

        Parameters
        ----------
        temperature : float
            Temperature, C; NaN means the reference temperature.

        Returns
        -------
        float
            a_T, dimensionless.

        Raises
        ------
        ValueError
            If the shift at that temperature is not known.

        Examples
        --------
        >>> rubber = Compound(Prony(1e6, [1e6], [1.0]), 20.0, WLF(8.0, 100.0, 20.0))
        >>> rubber.a_t(20.0), rubber.a_t(40.0) < 0.1
        (1.0, True)
        """
        if math.isnan(temperature) or temperature == self.reference:
            return 1.0
        number("temperature", temperature)
        if self.wlf is not None:
            with np.errstate(over="ignore"):
                found = float(self.wlf.shift_factor(temperature))
            if not 1e-200 < found < 1e200:
                raise ValueError(f"temperature = {temperature:g}: a_T = {found:.3g} by the WLF law:"
                                 " must be between 1e-200 and 1e200; the law diverges at"
                                 f" {self.wlf.t_ref - self.wlf.c2:g} C")
            return found
        return 10.0 ** self._interpolated(temperature, self.shifts, "a_T")

    def b_t(self, temperature: float) -> float:
        """Return b_T, the ratio of the moduli to those at the reference temperature.

        Parameters
        ----------
        temperature : float
            Temperature, C.

        Returns
        -------
        float
            b_T, dimensionless; 1 without vertical shifts.

        Raises
        ------
        ValueError
            If the temperature is outside the measured ones.
        """
        if not self.vertical_shifts or math.isnan(temperature) or temperature == self.reference:
            return 1.0
        return 10.0 ** self._interpolated(temperature, self.vertical_shifts, "b_T")

    def at(self, temperature: float) -> Prony:
        """Return the Prony series at another temperature.

        Parameters
        ----------
        temperature : float
            Temperature, C.

        Returns
        -------
        Prony
            Every relaxation time multiplied by a_T, every modulus by b_T.

        Raises
        ------
        ValueError
            If the shift at that temperature is not known.
        """
        along, upward = self.a_t(temperature), self.b_t(temperature)
        return Prony(upward * self.series.g_inf, upward * self.series.g, along * self.series.tau)

    def speeds_within(self, temperature: float, short: float, long: float
                      ) -> tuple[float, float] | None:
        """Return the speeds at which all waves of a road excite measured frequencies only.

        Parameters
        ----------
        temperature : float
            Temperature, C.
        short, long : float
            Shortest and longest wavelength, m.

        Returns
        -------
        (float, float) or None
            Lowest and highest speed, m/s. At the lowest speed the longest wave has the lowest
            measured frequency, at the highest speed the shortest wave the highest one; the first
            may exceed the second. None if the measured range is not known.
        """
        if self.valid_range is None:
            return None
        low, high = (omega / self.a_t(temperature) for omega in self.valid_range)
        return low * long / (2.0 * math.pi), high * short / (2.0 * math.pi)

    def _interpolated(self, temperature: float, shifts: dict[float, float], what: str) -> float:
        """Return a shift that is interpolated between measured temperatures."""
        known = np.array(sorted(shifts))
        if len(known) < 2:
            raise ValueError(f"temperature = {temperature:g}: {self.name} gives no {what}: give WLF"
                             " constants (wlf_c1 and wlf_c2 in &material; wlf, --wlf C1 C2 with a"
                             " table)")
        if not known[0] <= temperature <= known[-1]:
            raise ValueError(f"temperature = {temperature:g}: {self.name} gives {what} from"
                             f" {known[0]:g} to {known[-1]:g} C only")
        return float(np.interp(temperature, known, [shifts[t] for t in known]))
