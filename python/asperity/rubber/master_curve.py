"""Time-temperature superposition: sweeps at several temperatures are combined into one curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares, minimize_scalar

from ..base.check import array_of, number, shown
from .wlf import WLF

__all__ = ["MasterCurve", "master_curve"]

FloatArray = NDArray[np.float64]


class MasterCurve(NamedTuple):
    """Measurements at several temperatures, shifted to one reference temperature.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Reduced frequencies omega a_T, rad/s, ascending.
    storage, loss : ndarray, shape (n,)
        G' and G'', Pa.
    temperatures : ndarray, shape (m,)
        Temperatures, ascending.
    log_shift : ndarray, shape (m,)
        log10 a_T of each temperature.
    wlf : WLF or None
        Law fitted to the shifts; None with fewer than three temperatures, or if no law with
        c1, c2 > 0 fits.
    overlap_error : float
        Rms distance of neighbouring curves in log10 of the modulus, within their overlap.
    log_vertical : ndarray, shape (m,)
        log10 b_T of each temperature, G(omega, T) = b_T G(omega a_T, reference); zeros without
        vertical shifts.
    """

    omega: FloatArray
    storage: FloatArray
    loss: FloatArray
    temperatures: FloatArray
    log_shift: FloatArray
    wlf: WLF | None
    overlap_error: float
    log_vertical: FloatArray


def master_curve(
    temperatures: ArrayLike,
    omega: Sequence[ArrayLike],
    storage: Sequence[ArrayLike],
    loss: Sequence[ArrayLike],
    reference: float,
    *,
    vertical: bool = False,
) -> MasterCurve:
    """Shift DMA sweeps at several temperatures along the frequency axis onto one curve.

    Each sweep is shifted onto the neighbour that is closer to the reference. The shift minimises
    the mean squared distance of log G' and log G'' within the overlap.

    Parameters
    ----------
    temperatures : array_like, shape (m,)
        Temperature of each sweep, C or K; all must differ.
    omega, storage, loss : sequence of m array_like
        Angular frequencies (rad/s), G' and G'' (Pa) of each sweep; all > 0, at least three points.
    reference : float
        Reference temperature, one of `temperatures`.
    vertical : bool
        Also shift storage and loss by a common factor along the axis of the modulus.

    Returns
    -------
    MasterCurve
        `Prony.fit(curve.omega, curve.storage, curve.loss)` fits a material to it.

    Raises
    ------
    ValueError
        If shapes differ, values are out of range, or `reference` is not one of the temperatures.

    Examples
    --------
    >>> from asperity.material import Prony
    >>> rubber, wlf = Prony(1e6, [2e6, 4e6, 2e6], [1e-3, 1e-2, 1e-1]), WLF(8.0, 120.0, 20.0)
    >>> t, w = [10.0, 20.0, 30.0, 40.0], np.logspace(-1, 3, 30)
    >>> cold = [rubber.shifted(x, wlf) for x in t]
    >>> curve = master_curve(t, [w] * 4, [m.storage_modulus(w) for m in cold],
    ...                      [m.loss_modulus(w) for m in cold], 20.0)
    >>> bool(np.allclose(curve.log_shift, np.log10(wlf.shift_factor(t)), atol=0.02))
    True
    """
    values = array_of("temperatures", temperatures, ndim=1)
    count = values.size
    for name, sweeps in (("omega", omega), ("storage", storage), ("loss", loss)):
        if not hasattr(sweeps, "__len__"):
            raise ValueError(f"{name} = {shown(sweeps)}: must be a list of {count} sweeps")
        if len(sweeps) != count:
            raise ValueError(f"{name}: has {len(sweeps)} sweeps, must have {count}")
    order = np.argsort(values)
    values = values[order]
    if np.any(np.diff(values) == 0.0):
        raise ValueError("temperatures: two are equal: must differ")
    match = np.flatnonzero(values == number("reference", reference))
    if not match.size:
        raise ValueError(
            f"reference = {reference!r}: must be one of the temperatures {values.tolist()}"
        )
    sweeps_log = [_logarithms(i, omega[i], storage[i], loss[i]) for i in order]
    start = int(match[0])
    shift, upward = np.zeros(count), np.zeros(count)
    squares: list[float] = []
    for direction, stop in ((1, count), (-1, -1)):
        for i in range(start + direction, stop, direction):
            step, rise, error = _overlay(sweeps_log[i - direction], sweeps_log[i], vertical)
            shift[i] = shift[i - direction] + step
            upward[i] = upward[i - direction] + rise
            squares.append(error)
    reduced = np.concatenate([x + s for (x, _), s in zip(sweeps_log, shift, strict=True)])
    moduli = 10.0 ** np.concatenate(
        [y - up for (_, y), up in zip(sweeps_log, upward, strict=True)], axis=1)
    sort = np.argsort(reduced, kind="stable")
    return MasterCurve(
        10.0 ** reduced[sort],
        moduli[0, sort],
        moduli[1, sort],
        values,
        shift,
        _fit_wlf(values, shift, float(reference)),
        float(np.sqrt(np.mean(squares))) if squares else 0.0,
        upward,
    )


def _logarithms(place: int, *sweep: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return log10 of the frequencies of a sweep, ascending, and of its moduli, shape (2, n)."""
    columns = [np.log10(array_of(f"{name}[{place}]", values, low=0.0, low_open=True, ndim=1))
               for name, values in zip(("omega", "storage", "loss"), sweep, strict=True)]
    if len({column.size for column in columns}) != 1 or columns[0].size < 3:
        raise ValueError(
            f"sweep {place}: omega, storage, loss have {[c.size for c in columns]} values:"
            " must have the same number, at least 3")
    sort = np.argsort(columns[0])
    return columns[0][sort], np.array(columns[1:])[:, sort]


def _overlay(
    fixed: tuple[FloatArray, FloatArray], moving: tuple[FloatArray, FloatArray], vertical: bool
) -> tuple[float, float, float]:
    """Return the shifts that make `moving` overlap `fixed`, and the mean square that remains.

    The shifts are those of log10 of the frequency and of log10 of the modulus. With a vertical
    shift even curves that do not belong together can be brought close in a short overlap, closer
    than the noise of the measurement leaves the right ones. Of all minima, the one with the least
    mean square over the length of its overlap is therefore chosen.
    """
    x_fixed, y_fixed = fixed
    x_moving, y_moving = moving

    def apart(shift: float) -> FloatArray:
        low = max(x_fixed[0], x_moving[0] + shift)
        high = min(x_fixed[-1], x_moving[-1] + shift)
        x = np.linspace(low, high, 200)
        return np.array([np.interp(x, x_fixed, a) - np.interp(x - shift, x_moving, b)
                         for a, b in zip(y_fixed, y_moving, strict=True)])

    def distance(shift: float) -> float:
        found = apart(shift)
        if vertical:
            found = found - found.mean()
        return 0.5 * float(np.sum(np.mean(found**2, axis=1)))

    # Consider only shifts with an overlap of at least a tenth of the shorter sweep.
    margin = 0.1 * min(np.ptp(x_fixed), np.ptp(x_moving))
    lowest = x_fixed[0] - x_moving[-1] + margin
    highest = x_fixed[-1] - x_moving[0] - margin
    trial = np.linspace(lowest, highest, 401)
    apart_at = np.array([distance(s) for s in trial])
    if vertical:
        overlap = (np.minimum(x_fixed[-1], x_moving[-1] + trial)
                   - np.maximum(x_fixed[0], x_moving[0] + trial))
        around = np.pad(apart_at, 1, constant_values=np.inf)
        is_minimum = (apart_at <= around[:-2]) & (apart_at <= around[2:])
        apart_at = np.where(is_minimum, apart_at / overlap, np.inf)
    near = int(np.argmin(apart_at))
    bounds = (trial[max(near - 1, 0)], trial[min(near + 1, trial.size - 1)])
    found = minimize_scalar(distance, bounds=bounds, method="bounded", options={"xatol": 1e-8})
    rise = -float(apart(float(found.x)).mean()) if vertical else 0.0
    return float(found.x), rise, float(found.fun)


def _fit_wlf(temperatures: FloatArray, log_shift: FloatArray, reference: float) -> WLF | None:
    """Return the WLF constants that fit the shifts best, or None."""
    difference = temperatures - reference
    if difference.size < 3:
        return None
    lowest = max(0.0, -float(difference.min()))

    def residual(unknowns: FloatArray) -> FloatArray:
        c1, c2 = np.exp(unknowns)
        return c1 * difference / (c2 + lowest + difference) + log_shift

    found = least_squares(residual, np.log([10.0, 100.0]), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    c1, c2 = np.exp(found.x)
    if not found.success or c1 > 1e4 or c1 < 1e-6:
        return None
    return WLF(float(c1), float(c2 + lowest), reference)
