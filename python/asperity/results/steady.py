"""Steady sliding: rows of steady phases, and means over complete laps of a sliding road.

On a periodic road the rubber meets the same road again after a lap. The mean over complete laps is
meaningful. The mean over a part of a lap depends on which part it is, and may have the wrong sign.
With friction the road can carry the surface of the rubber along. A lap is therefore counted by the
slip of the road over the rubber, and a contact that sticks makes no laps, however far the road
moves.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .result_file import ResultFile
from .settings import has_friction, steady_phases

# A slide that is shorter than this part of a lap is a contact that sticks.
STICKS = 0.01
# A slide with friction begins when the block has been sheared, which may take this part of a lap.
SHEARED = 0.05

__all__ = ["SteadyMean", "steady_mean", "steady_rows", "steady_speeds"]

FloatArray = NDArray[np.float64]


class SteadyMean(NamedTuple):
    """A mean while sliding.

    Attributes
    ----------
    mean : float
        Mean over the last complete laps; over the second half of the slide if it is shorter than a
        lap.
    error : float
        Standard error of the mean, from the scatter of the laps and their correlation. It is NaN
        for fewer than two laps, and 0 for a steady phase.
    laps : float
        Number of laps in the mean. It is infinite for a steady phase.
    note : str
        Note for the user; it may be empty.
    """

    mean: float
    error: float
    laps: float
    note: str = ""


def steady_mean(run: ResultFile, column: str = "friction") -> SteadyMean:
    """Return the mean of a column over complete laps at the end of a run.

    Only the last rows with the same velocity count. If they cover two laps or more, the first lap
    is left out, because it contains the start.

    Parameters
    ----------
    run : ResultFile
        The result.
    column : str
        Name of a column of the history.

    Returns
    -------
    SteadyMean

    Raises
    ------
    KeyError
        If there is no such column.
    ValueError
        If the history has no rows.
    """
    values = np.asarray(run.history[column], dtype=float)
    if not values.size:
        raise ValueError(f"{run.path}: has no rows")
    if steady_rows(run)[-1]:
        return SteadyMean(float(values[-1]), 0.0, math.inf)
    first, travel, slid, lap = _slide(run)
    if travel.size < 2:
        return SteadyMean(float(values[-1]), math.nan, 0.0,
                          "the road does not move at the end of the run: the last row stands for"
                          " the mean")
    values = values[first:]
    total = slid[-1] / lap
    if total < STICKS and slid[-1] < 0.5 * travel[-1]:
        return SteadyMean(float(values[-1]), math.nan, 0.0,
                          f"the contact sticks at the end of the run: it has slid by {total:.2g}"
                          " laps, and the last row stands for the mean")
    slack = 1e-9 if slid is travel else SHEARED
    if total < 1.0 - slack:
        mean = _mean_between(travel, values, 0.5 * travel[-1], travel[-1])
        return SteadyMean(mean, math.nan, float(0.5 * total),
                          f"the slide is {total:.2g} laps long, and the mean is over its second"
                          " half: over part of a lap it depends on which part that is, and may"
                          " even have the wrong sign")
    count = max(1, math.floor(total - 1.0 + slack))
    ends = slid[-1] - lap * np.arange(count, -1, -1.0)
    if slid is not travel:  # the road moves evenly, so that a mean over its travel is one over time
        ends = np.interp(ends, slid, travel)
    laps = np.array([_mean_between(travel, values, max(low, 0.0), high)
                     for low, high in zip(ends[:-1], ends[1:], strict=True)])
    note = "" if total >= 2.0 - slack else ("the slide is less than two laps long: the mean is over"
                                           " the last one, and may hold what is left of the start")
    return SteadyMean(float(laps.mean()), _error(laps), float(count), note)


def steady_rows(run: ResultFile) -> NDArray[np.bool_]:
    """Return for each row whether it is a state of steady sliding: the first row of its phase.

    Parameters
    ----------
    run : ResultFile
        The result.

    Returns
    -------
    ndarray of bool, shape (rows,)
    """
    if "phase" not in run.history:
        return np.zeros(run.history.rows, dtype=bool)
    number = np.asarray(run.history["phase"])
    return np.isin(number, steady_phases(run)) & (np.diff(number, prepend=0) != 0)


def steady_speeds(run: ResultFile) -> FloatArray | None:
    """Return the speeds of a curve of steady states, or None if the run is not such a curve.

    Parameters
    ----------
    run : ResultFile
        The result.

    Returns
    -------
    ndarray, shape (rows,), or None
        Speed of the road, m/s; NaN in rows that rest. It is None if time passes in the run, or if
        fewer than two speeds are found.
    """
    history = run.history
    if "sliding_speed" not in history or not history.rows or np.ptp(history["time"]) > 0.0:
        return None
    speed = np.asarray(history["sliding_speed"], dtype=float)
    speed = np.where(steady_rows(run) & (speed > 0.0), speed, np.nan)
    return speed if len(np.unique(speed[np.isfinite(speed)])) > 1 else None


def _slide(run: ResultFile) -> tuple[int, FloatArray, FloatArray, float]:
    """Return the first row of the last slide, its travel and slip, and the length of a lap.

    Travel and slip have one value per row. The slip is that of the road over the rubber's surface,
    without its returns; without friction it is the travel.
    """
    none = np.zeros(0)
    if "road_x" not in run.history or run.history.rows < 2:
        return 0, none, none, 1.0
    step = np.diff([run.history["road_x"], run.history["road_y"]], axis=1)
    time = np.diff(run.history["time"])
    moving = (time > 0.0) & (np.hypot(*step) > 0.0)
    if not moving[-1]:
        return 0, none, none, 1.0
    speed = step / np.where(time > 0.0, time, 1.0)
    size = float(np.hypot(*speed[:, -1]))
    same = moving & (np.hypot(*(speed - speed[:, -1:])) < 1e-6 * size)
    first = int(np.flatnonzero(~same)[-1]) + 1 if not same.all() else 0
    travel = np.concatenate([[0.0], np.cumsum(np.hypot(*step[:, first:]))])
    along = np.abs(speed[:, -1]) / size
    sides = (run.grid.lx, run.grid.ly)
    lap = min(side / part for side, part in zip(sides, along, strict=True) if part > 1e-9)
    if "sliding_speed" not in run.history or not has_friction(run):
        return first, travel, travel, lap
    slip = np.asarray(run.history["sliding_speed"], dtype=float)[first + 1:] * time[first:]
    slid = np.maximum.accumulate(np.concatenate([[0.0], np.cumsum(slip)]))
    return first, travel, slid, lap


def _mean_between(travel: FloatArray, values: FloatArray, low: float, high: float) -> float:
    """Return the mean over a section of the travel, by the trapezoidal rule."""
    inner = (travel > low) & (travel < high)
    places = np.concatenate([[low], travel[inner], [high]])
    return float(np.trapezoid(np.interp(places, travel, values), places) / (high - low))


def _error(laps: FloatArray) -> float:
    """Return the standard error of the mean of laps, whose neighbours are correlated."""
    if laps.size < 2:
        return math.nan
    scatter = laps - laps.mean()
    square = float(np.sum(scatter**2))
    if square == 0.0:
        return 0.0
    correlation = float(np.sum(scatter[1:] * scatter[:-1])) / square
    correlation = min(max(correlation, 0.0), 0.99)
    free = max(laps.size * (1.0 - correlation) / (1.0 + correlation), 1.0)
    return math.sqrt(square / (laps.size - 1) / free)
