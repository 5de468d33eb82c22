"""Friction against speed, pressure and temperature: values of all patches, means and intervals.

Arrays have the dimensions (pressure, temperature, speed, patch), or the first three of these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import new_file, write_text
from ..base.optional import needed
from ..base.presenters import present
from .curve_remarks import CurveRemark, marks_of

if TYPE_CHECKING:
    import xarray

__all__ = ["COLUMNS", "MEANINGS", "FrictionCurve", "interval"]

FloatArray = NDArray[np.float64]

_SMALL = 1e-3     # friction below which four decimals would show few digits or none

COLUMNS = ("pressure", "temperature", "speed", "friction", "friction_low", "friction_high",
           "friction_viscous", "contact_area", "mean_gap", "friction_persson", "patches",
           "not_converged", "with_warnings")

#: Units and meaning of each variable.
MEANINGS = {
    "pressure": ("Pa", "mean pressure"),
    "temperature": ("degC", "temperature of the rubber"),
    "speed": ("m/s", "speed of the road"),
    "friction": ("1", "friction coefficient"),
    "friction_viscous": ("1", "friction by the pressure on the slopes of the road"),
    "friction_loss": ("1", "friction by loss in the rubber"),
    "friction_interface": ("1", "friction by the traction in the interface"),
    "contact_area": ("1", "contact area over the apparent one"),
    "mean_gap": ("m", "mean gap"),
    "friction_persson": ("1", "friction by Persson's theory for the spectrum of the patches"),
    "area_persson": ("1", "contact area by Persson's theory"),
    "friction_left_out": ("1", "friction that the omitted waves would add by Persson's theory"),
    "loss_octave": ("W/m2", "loss in the rubber by octave of the wavelength, mean over patches"),
    "loss_arm": ("W/m2", "loss in the rubber by arm of the Prony series, mean over patches"),
    "converged": ("1", "1 if the solver has converged; 0 for a state that is left out"),
    "warned": ("1", "sum of 2^(n - 1) over the first 31 warnings n about the state, which are"
                    " numbered in the attribute `warnings`"),
    "octave": ("m", "longest wavelength of the octave"),
    "relaxation_time": ("s", "relaxation time of the arm at the reference temperature"),
    "a_t": ("1", "shift of the relaxation times"),
    "b_t": ("1", "factor of the moduli"),
}


def interval(values: FloatArray, confidence: float = 0.95) -> tuple[FloatArray, FloatArray,
                                                                    FloatArray, NDArray[np.intp]]:
    """Return mean and confidence interval over the last axis, by Student's t.

    Parameters
    ----------
    values : ndarray, shape (..., n)
        Values of the patches. NaN are left out.
    confidence : float
        Probability that the interval contains the true mean, 0 to 1.

    Returns
    -------
    mean, low, high : ndarray, shape (...)
        Mean, and ends of the interval; the ends are NaN if there are fewer than two values.
    count : ndarray of int, shape (...)
        Number of values that are not NaN.

    Examples
    --------
    >>> mean, low, high, count = interval(np.array([1.0, 2.0, 3.0]))
    >>> float(mean), round(float(high), 4), int(count)
    (2.0, 4.4841, 3)
    """
    from scipy.stats import t

    good = np.isfinite(values)
    count = good.sum(axis=-1)
    filled = np.where(good, values, 0.0)
    mean = np.where(count > 0, filled.sum(axis=-1) / np.maximum(count, 1), math.nan)
    square = np.where(good, (values - mean[..., None]) ** 2, 0.0).sum(axis=-1)
    free = np.maximum(count - 1, 1)
    half = t.ppf(0.5 + 0.5 * confidence, free) * np.sqrt(square / free / np.maximum(count, 1))
    half = np.where(count > 1, half, math.nan)
    return mean, mean - half, mean + half, count


@dataclass(frozen=True)
class FrictionCurve:
    """Friction of a rubber on a road.

    Attributes
    ----------
    pressure, temperature, speed : ndarray
        The axes: Pa, C, m/s.
    patches : list of str
        Origin of each patch.
    values : dict of ndarray, shape (pressure, temperature, speed, patch)
        'friction', its two parts 'friction_viscous' (pressure on the slopes of the road) and
        'friction_interface' (traction in the interface), 'friction_loss' (power lost in the rubber
        over load and speed), 'contact_area', 'mean_gap'; NaN where a solver did not converge.
    theory : dict of ndarray, shape (pressure, temperature, speed)
        'friction_persson', 'area_persson', 'friction_left_out'.
    losses : dict of ndarray, shape (pressure, temperature, speed, parts)
        'loss_octave' and 'loss_arm', W/m2, if the results contain them.
    octave, relaxation_time : ndarray
        Longest wavelength of each octave, m; relaxation time of each arm, s.
    a_t, b_t : ndarray, shape (temperature,)
        Shifts of the rubber.
    sources : dict
        Result file and row of a point of the first patch, by the indices of the point.
    settings : dict
        Settings of the computation.
    notes : list of str
        Notes for the user.
    remarks : list of CurveRemark
        Warnings of the runs, and the states at which the solver did not converge.
    """

    pressure: FloatArray
    temperature: FloatArray
    speed: FloatArray
    patches: list[str]
    values: dict[str, FloatArray]
    theory: dict[str, FloatArray]
    losses: dict[str, FloatArray]
    octave: FloatArray
    relaxation_time: FloatArray
    a_t: FloatArray
    b_t: FloatArray
    sources: dict[tuple[int, int, int], tuple[Path, int]] = field(default_factory=dict, repr=False)
    settings: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    remarks: list[CurveRemark] = field(default_factory=list)

    @property
    def axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Pressures, temperatures and speeds."""
        return self.pressure, self.temperature, self.speed

    @property
    def warnings(self) -> list[str]:
        """The remarks as text, each with its number and the points that it concerns."""
        return [f"[{number}] {remark.line(self.axes)}"
                for number, remark in enumerate(self.remarks, 1)]

    def states_with(self, *, lost: bool) -> NDArray[np.bool_]:
        """Return the states without a solution, or those with warnings.

        Parameters
        ----------
        lost : bool
            Whether the states at which the solver did not converge are wanted.

        Returns
        -------
        ndarray of bool, shape (pressure, temperature, speed, patch)
        """
        found = np.zeros(self.values["friction"].shape, dtype=bool)
        for remark in self.remarks:
            if remark.is_lost == lost:
                found |= remark.where
        return found

    def mean(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return mean and 95 % interval of a variable over the patches.

        Parameters
        ----------
        name : str
            One of the names in `values`.

        Returns
        -------
        mean, low, high : ndarray, shape (pressure, temperature, speed)
            In the unit of the variable.

        Raises
        ------
        KeyError
            If there is no such variable.
        """
        return interval(self.values[name])[:3]

    @property
    def largest_error(self) -> float:
        """Half of the widest 95 % interval of friction; infinite if no point has one.

        Points at which fewer than two patches converged have no interval and do not count.
        """
        _, low, high, _ = interval(self.values["friction"])
        half = 0.5 * (high - low)
        return float(np.nanmax(half)) if np.isfinite(half).any() else math.inf

    def rows(self) -> list[tuple[float, ...]]:
        """Return the rows of the table: one per point, with the columns of `COLUMNS`."""
        means = {name: self.mean(name) for name in ("friction", "friction_viscous", "contact_area",
                                                    "mean_gap")}
        count = interval(self.values["friction"])[3]
        lost, warned = (self.states_with(lost=lost).sum(axis=-1) for lost in (True, False))
        rows = []
        for i, j, k in np.ndindex(count.shape):
            at = (i, j, k)
            rows.append((
                float(self.pressure[i]), float(self.temperature[j]), float(self.speed[k]),
                *(float(part[at]) for part in means["friction"]),
                float(means["friction_viscous"][0][at]), float(means["contact_area"][0][at]),
                float(means["mean_gap"][0][at]), float(self.theory["friction_persson"][at]),
                int(count[at]), int(lost[at]), int(warned[at])))
        return rows

    def to_csv(self, path: str | Path) -> Path:
        """Write the table.

        Parameters
        ----------
        path : str or Path
            The file, NAME.csv.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        lines = [",".join(COLUMNS)]
        lines += [",".join(repr(value) for value in row) for row in self.rows()]
        path = Path(path)
        write_text(path, "\n".join(lines) + "\n", "ascii")
        return path

    def to_xarray(self) -> xarray.Dataset:
        """Return everything as a data set of xarray, which must be installed.

        Returns
        -------
        xarray.Dataset
            The dimensions are pressure, temperature, speed, patch, octave and arm. Every variable
            has the attributes `units` and `long_name`. Means and ends of the intervals have names
            such as ``friction_mean``, ``friction_low`` and ``friction_high``.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        xarray = needed("xarray", "to_xarray")
        axes = ("pressure", "temperature", "speed")

        def described(name: str, more: str = "") -> dict[str, str]:
            return {"units": MEANINGS[name][0], "long_name": MEANINGS[name][1] + more}

        variables: dict[str, Any] = {}
        for name, array in self.values.items():
            variables[name] = ((*axes, "patch"), array, described(name))
            ends = zip(("mean", "low", "high"), self.mean(name), strict=True)
            for end, values in ends:
                variables[f"{name}_{end}"] = (axes, values, described(name, {
                    "mean": ", mean over patches", "low": ", lower end of the 95 % interval",
                    "high": ", upper end of the 95 % interval"}[end]))
        for name, array in self.theory.items():
            variables[name] = (axes, array, described(name))
        for name, array in self.losses.items():
            part = name.removeprefix("loss_")
            variables[name] = ((*axes, part), array, described(name))
        for name in ("a_t", "b_t"):
            variables[name] = ("temperature", getattr(self, name), described(name))
        variables["relaxation_time"] = ("arm", self.relaxation_time, described("relaxation_time"))
        coordinates: dict[str, Any] = {name: (name, getattr(self, name), described(name))
                                       for name in axes}
        coordinates["patch"] = ("patch", np.arange(len(self.patches)))
        coordinates["octave"] = ("octave", self.octave, described("octave"))
        lost = self.states_with(lost=True)
        warned = sum((remark.where.astype(np.int32) << number
                      for number, remark in enumerate(self.remarks[:31])),
                     np.zeros(lost.shape, dtype=np.int32))
        variables["converged"] = ((*axes, "patch"), (~lost).astype(np.int8),
                                  described("converged"))
        variables["warned"] = ((*axes, "patch"), warned, described("warned"))
        settings = {name: str(value) for name, value in self.settings.items()}
        return xarray.Dataset(variables, coordinates,
                              {**settings, "patches": "\n".join(self.patches),
                               "notes": "\n".join(self.notes),
                               "warnings": "\n".join(self.warnings)})

    def to_netcdf(self, path: str | Path) -> Path:
        """Write all data as a netCDF file (classic format).

        Parameters
        ----------
        path : str or Path
            The file, NAME.nc.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ImportError
            If xarray is not installed.
        OSError
            If the file cannot be written.
        """
        path = Path(path)
        data = self.to_xarray()
        with new_file(path) as new:
            data.to_netcdf(new, engine="scipy")
        return path

    def plot(self) -> Any:
        """Draw friction and contact area against speed.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return present("plot_friction_curve", self)

    def to_html(self, path: str | Path) -> Path:
        """Write an HTML page for any browser.

        Parameters
        ----------
        path : str or Path
            The file, NAME.html.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        return present("write_curve_page", self, path)

    def summary(self, known_notes: Iterable[str] = ()) -> str:
        """Return the table, the notes and the warnings as text.

        A row of the table ends with the numbers of the warnings about its point.

        Parameters
        ----------
        known_notes : iterable of str
            Notes that are left out, because the user has read them before.

        Returns
        -------
        str
        """
        heads = ("p (Pa)", "T (C)", "v (m/s)", "friction", "95 % interval", "viscous", "area",
                 "Persson", "patches")
        lines = ["  ".join(head.rjust(max(9, len(head))) for head in heads)]
        points = np.ndindex(self.values["friction"].shape[:3])
        for at, row in zip(points, self.rows(), strict=True):
            low, high = row[4:6]
            known = f"{_rounded(low)}..{_rounded(high)}" if math.isfinite(low) else "-"
            temperature = f"{row[1]:g}" if math.isfinite(row[1]) else "-"
            cells = (f"{row[0]:.4g}", temperature, f"{row[2]:.4g}", _rounded(row[3]), known,
                     _rounded(row[6]), f"{row[7]:.4g}", _rounded(row[9]), str(row[10]))
            lines.append("  ".join(cell.rjust(max(9, len(head)))
                                   for cell, head in zip(cells, heads, strict=True))
                         + f"  {marks_of(self.remarks, at)}".rstrip())
        known_notes = set(known_notes)
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes
                                    if note not in known_notes),
                          *(f"warning {line}" for line in self.warnings)])

    def settings_text(self) -> Mapping[str, str]:
        """Return the settings of the computation as text."""
        return {name: f"{value:.10g}" if isinstance(value, float) else str(value)
                for name, value in self.settings.items()}


def _rounded(friction: float) -> str:
    """Return a friction coefficient with four decimals, or fewer digits of a very small one."""
    if 0.0 < abs(friction) < _SMALL:
        return f"{friction:.1e}"
    return f"{friction + 0.0:.4f}"  # adding 0 turns a negative zero into zero
