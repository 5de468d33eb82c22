"""Fit of a Prony series to a DMA table, with a shift to one reference temperature."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.check import instance, number, positive, shown
from ..base.files import SHIFTS, SHIFTS_HEAD, check_output, write_text
from ..base.names import counted
from ..base.presenters import present
from .compound import Compound
from .dma_outliers import outlier_notes
from .dma_sweeps import Sweep, drift_note, sweeps_of
from .dma_table import DmaTable
from .master_curve import MasterCurve, master_curve
from .prony import Prony
from .wlf import WLF

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DmaFit", "check_shifts", "fit_dma"]

FloatArray = NDArray[np.float64]

_POOR = 0.2         # rms of log10(fit/data) above which a fit is warned of


@dataclass(frozen=True)
class DmaFit:
    """A Prony series fitted to measurements, with the shifted data and the errors of the fit.

    Attributes
    ----------
    material : Prony
        The series at the reference temperature.
    omega, storage, loss : ndarray, shape (n,)
        The data shifted to the reference temperature, by ascending frequency, rad/s and Pa.
    temperature : ndarray, shape (n,), or None
        Temperature at which each point was measured, C.
    reference : float or None
        Reference temperature, C.
    wlf : WLF or None
        Constants, given or fitted to the shifts.
    shifts : list of (float, float)
        Temperature and log10 of its shift factor.
    overlap_error : float or None
        Rms of log10 of the ratio of neighbouring sweeps, if the shifts were found from the overlap.
    error_storage, error_loss, error_tan_delta : float
        Rms of log10(fit/data).
    largest_error : float
        Largest absolute value of log10(fit/data) in storage and loss.
    plateau_bounded : bool
        Whether the plateau is at its lower bound `least_plateau`, because the data do not show it.
    name : str
        Name of the data.
    notes : list of str
        Assumptions that were made, and doubts.
    vertical_shifts : list of (float, float)
        Temperature and log10 of its vertical factor b_T; empty unless asked for.
    """

    material: Prony
    omega: FloatArray
    storage: FloatArray
    loss: FloatArray
    temperature: FloatArray | None
    reference: float | None
    wlf: WLF | None
    shifts: list[tuple[float, float]]
    overlap_error: float | None
    error_storage: float
    error_loss: float
    error_tan_delta: float
    largest_error: float
    plateau_bounded: bool
    name: str
    notes: list[str]
    vertical_shifts: list[tuple[float, float]] = field(default_factory=list)

    @property
    def valid_range(self) -> tuple[float, float]:
        """Lowest and highest angular frequency of the data at the reference temperature, rad/s."""
        return float(self.omega[0]), float(self.omega[-1])

    def _repr_html_(self) -> str:
        return present("fit_html", self)

    def summary(self) -> str:
        """Return a few lines about the fit, its error and its range of frequencies."""
        low, high = self.valid_range
        at = "" if self.reference is None else f" at {self.reference:g} C"
        lines = [
            f"{self.name}: {self.omega.size} points",
            f"arms: {self.material.g.size}, plateau {self.material.g_inf:.4g} Pa, instantaneous"
            f" modulus {self.material.instantaneous_modulus:.4g} Pa",
            f"error (rms of log10 fit/data): storage {self.error_storage:.4f}, loss"
            f" {self.error_loss:.4f}, tan delta {self.error_tan_delta:.4f}",
            f"largest error of storage and loss: {self.largest_error:.4f}",
            f"valid range: {low:.4g} to {high:.4g} rad/s ({low / (2 * math.pi):.4g} to"
            f" {high / (2 * math.pi):.4g} Hz){at}",
        ]
        if self.shifts and len(self.shifts) > 1:
            lines.append("shifts (log10 a_T): " + ", ".join(
                f"{t:g} C {shift:+.3f}" for t, shift in self.shifts))
        if self.vertical_shifts:
            lines.append("vertical shifts (log10 b_T): " + ", ".join(
                f"{t:g} C {shift:+.3f}" for t, shift in self.vertical_shifts))
        if self.overlap_error is not None:
            lines.append(f"overlap error (rms of log10): {self.overlap_error:.4f}")
        if self.wlf is not None:
            lines.append(f"WLF: c1 = {self.wlf.c1:.6g}, c2 = {self.wlf.c2:.6g} K at"
                         f" {self.wlf.t_ref:g} C")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def to_namelist(self, *, poisson: float = 0.5, temperature: float | None = None) -> str:
        """Return the `&material` group, with the errors and the range as comments.

        Parameters
        ----------
        poisson : float
            Poisson ratio.
        temperature : float, optional
            Temperature of the simulation, C; by default the reference temperature. Any other needs
            WLF constants. With vertical shifts, the moduli of the group are those at this
            temperature, because a group has no place for b_T; a comment tells the factor.

        Returns
        -------
        str
            The group.

        Raises
        ------
        ValueError
            If the shift to the temperature is not known, or the temperature is outside the measured
            ones and there are vertical shifts.
        """
        comment = "".join(f"! {line}\n" for line in self.summary().splitlines())
        if self.wlf is None:
            if temperature is not None and temperature != self.reference:
                raise ValueError(
                    f"temperature = {temperature:g}: the data give no WLF constants: give them"
                    " (wlf, --wlf C1 C2)")
            return comment + self.material.to_namelist(poisson=poisson)

        celsius = self.wlf.t_ref if temperature is None else temperature
        material = self.material
        rise = self.compound().b_t(celsius)
        if rise != 1.0:
            material = Prony(rise * material.g_inf, rise * material.g, material.tau)
            comment += f"! moduli of the group: times b_T = {rise!r} at {celsius:g} C\n"
        return comment + material.to_namelist(
            poisson=poisson, wlf=self.wlf, temperature=celsius)

    def compound(self) -> Compound:
        """Return the rubber at all temperatures, with its shifts.

        Returns
        -------
        Compound
        """
        return Compound(self.material, self.reference, self.wlf, dict(self.shifts),
                        dict(self.vertical_shifts), self.valid_range, self.name, list(self.notes))

    def write_shifts(self, path: str | Path) -> Path:
        """Write the shifts as a table with the columns temperature (C), log10_a_t, a_t, b_t.

        Parameters
        ----------
        path : str or Path
            The file, NAME.csv. An older table of shifts is replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            If the data have a single temperature, the name has another ending, or it is that of
            another file.
        OSError
            If the file cannot be written.
        """
        self.check_sweeps()
        path = Path(path)
        check_shifts(path)
        upward = dict(self.vertical_shifts)
        lines = [SHIFTS_HEAD]
        lines += [f"{t!r},{shift!r},{10.0**shift!r},{10.0**upward.get(t, 0.0)!r}"
                  for t, shift in self.shifts]
        write_text(path, "\n".join(lines) + "\n", "ascii")
        return path

    def check_sweeps(self) -> None:
        """Raise ValueError if the data have a single temperature, and hence no shifts."""
        if len(self.shifts) < 2:
            raise ValueError(f"{self.name}: has no sweeps at several temperatures: there are no"
                             " shifts to write")

    def plot(self) -> Figure:
        """Draw the data and the fit, tan delta, and the errors of the fit.

        Returns
        -------
        matplotlib Figure
        """
        return present("plot_dma_fit", self)


def check_shifts(path: Path) -> None:
    """Refuse a file for the table of shifts that has another ending or would be replaced.

    Raises
    ------
    ValueError
        If the name does not end in .csv, or it is that of a file that is no table of shifts.
    OSError
        If the folder does not exist.
    """
    if path.suffix.lower() != ".csv":
        raise ValueError(f"{path}: the name of a table of shifts must end in .csv")
    check_output(path, SHIFTS)


def fit_dma(
    table: DmaTable,
    *,
    arms_per_decade: float = 1.0,
    reference: float | None = None,
    wlf: Sequence[float] | None = None,
    temperature_tolerance: float = 0.5,
    least_plateau: float = 0.01,
    slack: float = 0.05,
    vertical: bool = False,
) -> DmaFit:
    """Fit a Prony series to a table.

    Parameters
    ----------
    table : DmaTable
        The measurements, in any order.
    arms_per_decade : float
        Number of relaxation times per decade.
    reference : float, optional
        Reference temperature, C. With `wlf` it can be any temperature, by default that of the
        constants. Without `wlf` it is a temperature of the table, within the tolerance, by default
        the middle one.
    wlf : (c1, c2) or (c1, c2, t_ref), optional
        Constants of the shift: dimensionless, K, C. `t_ref` is `reference` by default. Without
        them, several temperatures are shifted by `asperity.material.master_curve`.
    temperature_tolerance : float
        Points whose temperatures differ by less than this (K) belong to one sweep. Within a sweep
        the temperature may drift by four times as much; the mean is used. A larger difference
        separates two sweeps, unless the frequencies continue from one to the other.
    least_plateau : float
        Lower bound of the plateau g_inf as a fraction of the lowest storage modulus, 0 to 1. It
        keeps the plateau positive if the data do not reach it.
    slack : float
        Relative increase of the misfit allowed for smoothness; see `asperity.material.Prony.fit`.
    vertical : bool
        If shifts are found from the overlap, also shift the moduli: G(omega, T) = b_T G(omega a_T).

    Returns
    -------
    DmaFit

    Raises
    ------
    ValueError
        If an option is not allowed, or the temperatures cannot be combined.
    NotConverged
        If the fit finds no solution.
    """
    instance("table", table, DmaTable)
    number("least_plateau", least_plateau, 0.0, 1.0)
    positive("temperature_tolerance", temperature_tolerance)
    notes = list(table.notes)
    sweeps: list[Sweep] = []
    constants = wlf_constants(wlf, reference)
    if table.temperature is not None:
        try:
            sweeps = sweeps_of(table.temperature, table.omega, temperature_tolerance)
        except ValueError:
            if constants is None:
                raise
            notes.append("the temperatures form no sweeps of the frequency: the constants shift"
                         " each point from its own temperature")
        notes += drift_note(table.temperature, sweeps)
    notes += outlier_notes(table, sweeps)
    found = _shifted(table, sweeps, constants, reference, temperature_tolerance, vertical)
    notes += found.notes
    reduced = table.omega * 10.0**found.log_shift
    order = np.argsort(reduced, kind="stable")
    omega = reduced[order]
    storage, loss = (values[order] * 10.0 ** -found.log_vertical[order]
                     for values in (table.storage, table.loss))
    notes += _range_notes(table, omega)
    material = Prony.fit(omega, storage, loss, arms_per_decade=arms_per_decade, slack=slack,
                         least_plateau=least_plateau)
    floor = least_plateau * float(storage.min())
    bounded = material.g_inf <= floor * (1.0 + 1e-9)
    modulus = material.complex_modulus(omega)
    errors = [np.log10(modulus.real / storage), np.log10(modulus.imag / loss)]
    errors.append(errors[1] - errors[0])
    rms = [float(np.sqrt(np.mean(error**2))) for error in errors]
    notes += _fit_notes(omega.size, material.g.size, max(rms[:2]),
                        least_plateau if bounded else None)
    return DmaFit(
        material, omega, storage, loss,
        temperature=None if table.temperature is None else table.temperature[order],
        reference=found.reference, wlf=found.wlf,
        shifts=[(t, float(found.log_shift[rows[0]])) for t, rows in sweeps],
        overlap_error=found.overlap_error,
        error_storage=rms[0], error_loss=rms[1], error_tan_delta=rms[2],
        largest_error=float(max(np.abs(errors[0]).max(), np.abs(errors[1]).max())),
        plateau_bounded=bounded, name=table.name, notes=notes,
        vertical_shifts=([(t, float(found.log_vertical[rows[0]])) for t, rows in sweeps]
                         if vertical and constants is None else []))


def _fit_notes(points: int, arms: int, rms: float, held_at: float | None) -> list[str]:
    """Return notes on a fit with an rms error of log10, and perhaps with its plateau held."""
    notes = []
    if points < arms:
        notes.append(f"{points} points for {arms} arms: the series between them is a guess")
    if held_at is not None:
        notes.append("the data do not show the plateau: it is held at"
                     f" {100 * held_at:g} % of the lowest storage modulus")
    if rms > _POOR:
        notes.append(f"the fit misses the data by a factor of {10.0**rms:.2g} (rms): look whether"
                     " storage and loss are in the right columns; if they are, more arms may help")
    return notes


class _Shifted(NamedTuple):
    """The shifts of the points of a table to the reference temperature."""

    log_shift: FloatArray  # log10 a_T of each point
    log_vertical: FloatArray  # log10 b_T of each point
    reference: float | None
    wlf: WLF | None
    overlap_error: float | None
    notes: list[str]


def _shifted(table: DmaTable, sweeps: list[Sweep], constants: WLF | None, reference: float | None,
             tolerance: float, vertical: bool) -> _Shifted:
    """Return the shifts, by the given constants or from the overlap of the sweeps."""
    shift, level = np.zeros(table.omega.size), np.zeros(table.omega.size)
    if constants is not None:
        if table.temperature is not None and not sweeps:
            shift[:] = np.log10(constants.shift_factor(table.temperature))
        for t, rows in sweeps:
            shift[rows] = math.log10(float(constants.shift_factor(t)))
        return _Shifted(shift, level, constants.t_ref, constants, None, [])
    if len(sweeps) > 1:
        return _overlaid(table, sweeps, reference, tolerance, vertical)
    if len(sweeps) == 1:
        measured = sweeps[0][0]
        if reference is not None and abs(measured - reference) > tolerance:
            raise ValueError(f"reference = {reference:g}: the data are at {measured:g} C:"
                             " give WLF constants (wlf, --wlf C1 C2)")
        reference = measured
    return _Shifted(shift, level, reference, None, None, [])


def _overlaid(table: DmaTable, sweeps: list[Sweep], reference: float | None, tolerance: float,
              vertical: bool) -> _Shifted:
    """Return the shifts that make each sweep overlap its neighbour."""
    temperatures = [t for t, _ in sweeps]
    place = len(sweeps) // 2 if reference is None else int(
        np.argmin([abs(t - reference) for t in temperatures]))
    near = temperatures[place]
    if reference is not None and abs(near - reference) > tolerance:
        raise ValueError(
            f"reference = {reference:g}: must be one of the temperatures"
            f" {', '.join(f'{t:g}' for t in temperatures)}, or give WLF constants")
    _enough(table, sweeps)
    curve = master_curve(
        temperatures, [table.omega[r] for _, r in sweeps],
        [table.storage[r] for _, r in sweeps], [table.loss[r] for _, r in sweeps], near,
        vertical=vertical)
    shift, level = np.zeros(table.omega.size), np.zeros(table.omega.size)
    for (_, rows), along, up in zip(sweeps, curve.log_shift, curve.log_vertical, strict=True):
        shift[rows], level[rows] = along, up
    notes = []
    if curve.wlf is None:
        notes.append(f"the shifts give no WLF constants: the material is known at {near:g} C only")
    notes += _doubts(table, sweeps, curve)
    return _Shifted(shift, level, near if curve.wlf is None else curve.wlf.t_ref, curve.wlf,
                    curve.overlap_error, notes)


def _range_notes(table: DmaTable, omega: FloatArray) -> list[str]:
    """Return a note if the range of frequencies is short; raise ValueError for one frequency."""
    decades = math.log10(float(omega[-1] / omega[0]))
    if decades < 1e-3:
        raise ValueError(f"{table.name}: all {omega.size} points are at one frequency,"
                         f" {omega[0]:.4g} rad/s: a series needs a range of them, or several"
                         " temperatures with WLF constants (wlf, --wlf C1 C2)")
    if decades < 1.0:
        return [f"the data cover {decades:.2g} decades of frequency: beyond them the series is a"
                " guess"]
    return []


def wlf_constants(wlf: Sequence[float] | None, reference: float | None) -> WLF | None:
    """Return the WLF constants, converted to a reference temperature.

    Parameters
    ----------
    wlf : (c1, c2) or (c1, c2, t_ref), optional
        Constants: dimensionless, K, C.
    reference : float, optional
        Reference temperature of the result, C.

    Returns
    -------
    WLF or None
        None without constants.

    Raises
    ------
    ValueError
        If a number is missing or not allowed.
    """
    if reference is not None:
        number("reference", reference)
    if wlf is None:
        return None
    if not isinstance(wlf, Sequence | np.ndarray) or isinstance(wlf, str):
        raise ValueError(f"wlf = {shown(wlf)}: must be (c1, c2) or (c1, c2, t_ref)")
    if len(wlf) == 2:
        if reference is None:
            raise ValueError("wlf: has 2 numbers: give its reference temperature, too"
                             " (reference, --reference T)")
        wlf = (*wlf, reference)
    if len(wlf) != 3:
        raise ValueError(f"wlf: has {len(wlf)} numbers: must be (c1, c2) or (c1, c2, t_ref)")
    c1, c2, t_ref = (number("wlf", value) for value in wlf)
    number("wlf c1", c1, 0.0)
    positive("wlf c2", c2)
    if reference is None or reference == t_ref:
        return WLF(c1, c2, t_ref)
    # Convert the constants to the other reference temperature; the shifts stay the same (Williams,
    # Landel and Ferry 1955).
    moved = c2 + reference - t_ref
    if moved <= 0.0:
        raise ValueError(f"reference = {reference:g}: must be > t_ref - c2 = {t_ref - c2:g}")
    return WLF(c1 * c2 / moved, moved, reference)


def _enough(table: DmaTable, sweeps: list[Sweep]) -> None:
    """Raise ValueError if a sweep has too few frequencies to be shifted."""
    for t, rows in sweeps:
        if np.unique(table.omega[rows]).size < 3:
            count = int(np.unique(table.omega[rows]).size)
            raise ValueError(f"{table.name}: {counted(count, 'frequency', 'frequencies')} at"
                             f" {t:g} C: shifting needs at least 3, or WLF constants (wlf,"
                             " --wlf C1 C2)")


def _doubts(
    table: DmaTable, sweeps: list[Sweep], curve: MasterCurve
) -> list[str]:
    """Return notes about sweeps that hardly overlap or do not lie on one curve."""
    doubts = []
    ends = []
    for (t, rows), shift in zip(sweeps, curve.log_shift, strict=True):
        logs = np.log10(table.omega[rows]) + shift
        ends.append((t, float(logs.min()), float(logs.max())))
    for (t1, low1, high1), (t2, low2, high2) in zip(ends[:-1], ends[1:], strict=True):
        overlap = min(high1, high2) - max(low1, low2)
        if overlap < 0.15 * min(high1 - low1, high2 - low2):
            doubts.append(f"the sweeps at {t1:g} and {t2:g} C hardly overlap: their shift is"
                          " doubtful; leave one out or give WLF constants")
    if curve.overlap_error > 0.05:
        doubts.append("neighbouring sweeps do not lie on one curve: the shifts are doubtful")
    return doubts
