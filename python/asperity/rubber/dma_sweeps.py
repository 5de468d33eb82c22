"""Grouping of the points of a DMA table into sweeps of the frequency at one temperature each.

The temperature of an instrument drifts a little while it measures a sweep. If the frequencies are
repeated at a temperature, another sweep begins; if they continue, the points belong to the same
sweep. The mean temperature of a sweep counts for all its points.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sweep", "drift_note", "sweeps_of"]

FloatArray = NDArray[np.float64]
Indices = NDArray[np.intp]
Sweep = tuple[float, Indices]  # a temperature, C, and the points measured at it

_DRIFT = 4.0            # largest drift within a sweep, in units of the tolerance
_APART = 2.0            # least ratio of the steps between sweeps to those within them
_SAME = 0.01            # largest distance of equal frequencies, natural logarithm
_LEAST = 3              # points of a sweep
_NOTED = 0.1            # smallest drift that is reported, K


def sweeps_of(temperature: FloatArray, omega: FloatArray, tolerance: float) -> list[Sweep]:
    """Return the sweeps of a table, by ascending temperature.

    Points whose temperatures differ by at most `tolerance` from their neighbours belong together.
    The parts of a sweep that are further apart are joined if they have no frequency in common and
    the whole drift is at most four times the tolerance. Sweeps whose temperatures are closer than
    the tolerance are separated where the steps between them are clearly larger than those within.

    Parameters
    ----------
    temperature, omega : ndarray, shape (n,)
        Temperature, C, and frequency of each point.
    tolerance : float
        Difference of temperatures, K.

    Returns
    -------
    list of (float, ndarray)
        Mean temperature of each sweep, and the indices of its points.

    Raises
    ------
    ValueError
        If steps of the temperature cannot be told from its drift, or it drifts too far.
    """
    order = np.argsort(temperature, kind="stable")
    parts = _split(temperature, order, tolerance)
    groups: list[Indices] = []
    for part in parts:
        if np.ptp(temperature[part]) <= _DRIFT * tolerance:
            groups.append(part)
        else:
            groups += _separated(temperature, omega, part, tolerance)
    sweeps = []
    for rows in _joined(temperature, omega, groups, tolerance):
        values = temperature[rows]
        mean = float(values[0]) if np.ptp(values) == 0.0 else round(float(np.mean(values)), 6)
        sweeps.append((mean, rows))
    return sweeps


def drift_note(temperature: FloatArray, sweeps: list[Sweep]) -> list[str]:
    """Return a note on the largest drift of the temperature within a sweep, if it is noticeable."""
    if not sweeps:
        return []
    drift, mean = max((float(np.ptp(temperature[rows])), mean) for mean, rows in sweeps)
    if drift < _NOTED:
        return []
    several = len(sweeps) > 1
    return [f"the temperature drifts within {'the sweeps' if several else 'the sweep'}, by up to"
            f" {drift:.3g} K at {mean:.4g} C: the mean of each sweep is used"]


def _split(temperature: FloatArray, order: Indices, step: float) -> list[Indices]:
    """Return sorted points in groups that are further apart than `step`."""
    return np.split(order, np.flatnonzero(np.diff(temperature[order]) > step) + 1)


def _repeats(omega: FloatArray, rows: Indices) -> bool:
    """Return whether a frequency occurs more than once."""
    return bool((np.diff(np.sort(np.log(omega[rows]))) < _SAME).any())


def _steps(temperature: FloatArray, groups: list[Indices]) -> tuple[float, float]:
    """Return the largest step within groups and the smallest between them."""
    inner = max((float(np.diff(temperature[rows]).max()) for rows in groups if rows.size > 1),
                default=0.0)
    between = min((float(temperature[after[0]] - temperature[before[-1]])
                   for before, after in zip(groups[:-1], groups[1:], strict=True)),
                  default=np.inf)
    return inner, between


def _separated(temperature: FloatArray, omega: FloatArray, rows: Indices, tolerance: float
               ) -> list[Indices]:
    """Return the sweeps in points that no step above the tolerance separates."""
    low, high = (float(value) for value in temperature[rows[[0, -1]]])
    if not _repeats(omega, rows):
        raise ValueError(
            f"the temperature drifts from {low:g} to {high:g} C within a sweep of the frequency:"
            f" must be within {_DRIFT * tolerance:g} K; temperature_tolerance ="
            f" {_up(np.ptp(temperature[rows]) / _DRIFT):g} (--temperature-tolerance) accepts it")
    for step in sorted(set(np.diff(temperature[rows]).tolist()), reverse=True):
        groups = _split(temperature, rows, step * (1.0 - 1e-9) - 1e-12)
        inner, between = _steps(temperature, groups)
        if len(groups) > 1 and between > _APART * inner and all(
                group.size >= _LEAST and np.ptp(temperature[group]) <= _DRIFT * tolerance
                and not _repeats(omega, group) for group in groups):
            return groups
    raise ValueError(
        f"temperatures from {low:g} to {high:g} C lie closer than {tolerance:g} K to their"
        " neighbours: steps of the temperature cannot be told from its drift (a ramp?): sweeps of"
        " the frequency at temperatures further apart are needed, another temperature_tolerance"
        " (--temperature-tolerance), or WLF constants (wlf, --wlf C1 C2)")


def _joined(temperature: FloatArray, omega: FloatArray, groups: list[Indices], tolerance: float
            ) -> list[Indices]:
    """Return groups, of which neighbours that are parts of one sweep are joined.

    If the steps between the joined groups were not clearly larger than those within, they could as
    well be parts of a ramp, and nothing is joined.
    """
    joined = list(_chained(temperature, omega, groups, tolerance))
    if len(joined) == len(groups):
        return groups
    inner, between = _steps(temperature, joined)
    return joined if between > _APART * inner else groups


def _chained(temperature: FloatArray, omega: FloatArray, groups: list[Indices], tolerance: float
             ) -> Iterator[Indices]:
    """Join neighbours as long as no frequency repeats and the drift is allowed."""
    last = groups[0]
    for group in groups[1:]:
        both = np.concatenate([last, group])
        if (np.ptp(temperature[both]) <= _DRIFT * tolerance * (1.0 + 1e-9)
                and not _repeats(omega, both)):
            last = both
            continue
        yield last
        last = group
    yield last


def _up(value: float) -> float:
    """Return a number rounded up to two digits."""
    step = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / step - 1e-9) * step:.2g}")
