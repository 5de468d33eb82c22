"""Pictures of histories: a column with its parts, energies; axes that other pictures share."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..results.derived import closure, column_of, energy_terms, load_name, road_speed, travel
from ..results.road_slopes import friction_outside
from ..results.settings import has_adhesion, has_friction
from ..results.steady import steady_mean, steady_rows, steady_speeds
from .style import (
    COLOURS,
    LABELS,
    SINGLE_COLUMN,
    axis_text,
    fitted,
    label_of,
    print_style,
    si_scale,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Run
    from ..results.result_file import ResultFile

__all__ = ["draw_column", "horizontal", "legend_above", "plot_history", "steady_words"]

# Colours and line styles of the parts of friction and of energy.
PARTS = {"slopes": (COLOURS[1], "--"), "interface": (COLOURS[2], "-."),
         "viscous": (COLOURS[1], "--"), "stored": (COLOURS[0], "-"),
         "friction": (COLOURS[2], "-."), "work": (COLOURS[6], "-")}


def plot_history(run: Run, name: str = "contact_area", x: str | None = None,
                 ax: Axes | None = None, **style: Any) -> Axes:
    """Draw a column of the history against another one.

    In a run with friction, 'friction' is drawn with its parts (pressure on the slopes of the road,
    traction in the interface, and with adhesion the attraction outside the contact),
    'contact_area' with the stick area, and 'sliding_speed' with the speed of the road. 'energy'
    draws the work put in and the energies that are stored and lost, and 'force' the normal force on
    the whole grid.

    Parameters
    ----------
    run : Run
        The result.
    name : str
        Column to draw, 'energy' or 'force'.
    x : str, optional
        Column along the horizontal axis, or 'force'. The default is time. If no time passes, it is
        the sliding speed of a curve of steady states, otherwise the load (the force in free mode,
        the pressure in periodic mode) or the step.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into; by default a new figure that fits one column of a journal.
    **style
        Options of `matplotlib.axes.Axes.plot` for the line of the column.

    Returns
    -------
    matplotlib.axes.Axes
        The axes; the figure is ``axes.figure``.

    Raises
    ------
    KeyError
        If there is no such column.
    """
    history = run.history
    if name != "energy":
        column_of(run, name)
    if x is None and name != "sliding_speed" and steady_speeds(run) is not None:
        along, label, log = horizontal(run)
    else:
        if x is None:
            x = next((column for column in ("time", load_name(run), "step")
                      if column != name and np.ptp(column_of(run, column)[0]) > 0.0),
                     "step") if history.rows else "step"
        values, units = column_of(run, x)
        factor, unit = si_scale(values, units)
        along, label, log = values * factor, axis_text(label_of(x, history), unit), False
    with print_style() if ax is None else nullcontext():
        axes = ax if ax is not None else _new_axes()
        draw_column(run, name, along, axes, style)
        axes.set_xlabel(label)
        if log:
            axes.set_xscale("log")
        if x == "step":
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        if run.title and ax is None:
            above = axes.get_legend()
            count = 0 if above is None else len(above.get_texts())
            rows = -(-count // _legend_columns(count)) if count else 0
            title = fitted(run.title, SINGLE_COLUMN)
            axes.set_title(title, parse_math=False,
                           pad=6.0 + 1.5 * rows * plt.rcParams["legend.fontsize"])
    return axes


def draw_column(run: Run, name: str, along: NDArray[Any], axes: Axes,
                style: dict[str, Any]) -> None:
    """Draw a column, with related columns, over given values of the horizontal axis."""
    history = run.history
    marked = {"marker": "o" if len(along) <= 40 else ""}
    axes.grid(alpha=0.3)
    if name == "energy":
        _draw_energy(run, along, axes, {**marked, **style})
        return
    values, units = column_of(run, name)
    factor, unit = si_scale(values, units)
    parts: list[tuple[str, NDArray[Any], str, str]] = []
    label = ""
    if name == "friction" and "friction_viscous" in history and has_friction(run):
        label = "whole"
        slopes = history["friction_viscous"]
        parts = [("pressure on slopes", slopes, *PARTS["slopes"]),
                 ("interface", values - slopes, *PARTS["interface"])]
    elif name == "contact_area" and "stick_area" in history and has_friction(run):
        label = "in contact"
        parts = [("sticking", history["stick_area"], COLOURS[4], "--")]
    elif name == "sliding_speed" and "road_x" in history and has_friction(run):
        label = "mean of the interface"
        speed = road_speed(run)
        factor, unit = si_scale([values.max(initial=0.0), speed.max(initial=0.0)],
                                units)
        parts = [("road against the block's top", speed, COLOURS[6], ":")]
    axes.plot(along, values * factor, **{"color": COLOURS[0], "label": label or None, **marked,
                                         **style})
    for part, of_it, colour, dashes in parts:
        axes.plot(along, of_it * factor, color=colour, linestyle=dashes, label=part)
    if name == "friction" and has_adhesion(run) and len(run.snapshots):
        rows, outside = friction_outside(run)
        if len(rows):
            axes.plot(along[rows], outside, color=COLOURS[3], marker="s", linestyle="",
                      label="attraction outside contact", clip_on=False)
            parts = parts or [("outside", outside, "", "")]
    with_mean = name == "friction" and _draw_mean(run, axes)
    axes.set_ylabel(axis_text(label_of(name, history), unit))
    if not parts:
        _sane_limits(axes, values * factor)
    if parts or with_mean:
        legend_above(axes)


def _draw_mean(run: Run, axes: Axes) -> bool:
    """Draw the mean friction over complete laps; the label says if there is no complete lap.

    Return whether there is a label.
    """
    if run.history.rows < 2 or not np.any(run.history["friction"]):
        return False
    found = steady_mean(run, "friction")
    if 1.0 <= found.laps < np.inf:
        laps = "last lap" if found.laps == 1.0 else f"last {found.laps:.0f} laps"
        axes.axhline(found.mean, color=COLOURS[6], linestyle=":", linewidth=0.9,
                     label=f"mean of the {laps}")
    elif 0.0 < found.laps < 1.0:
        # In the legend, where it hides no data.
        axes.plot([], [], " ", label=f"{2.0 * found.laps:.2g} of a lap: no mean")
    return 0.0 < found.laps < np.inf


def _draw_energy(run: Run, along: NDArray[Any], axes: Axes, style: dict[str, Any]) -> None:
    """Draw work, stored and lost energies, with the error of the balance."""
    terms = energy_terms(run)
    if not terms:
        raise ValueError(f"{run.path}: its history holds no energies")
    factor, unit = si_scale([np.abs(values).max(initial=0.0) for values in terms.values()], "J")
    names = {"work": "work put in", "stored": "stored", "viscous": "lost in the rubber",
             "friction": "lost by friction"}
    for part, values in terms.items():
        if part in ("work", "stored") or np.any(values):
            colour, dashes = PARTS[part]
            axes.plot(along, values * factor, **{"color": colour, "linestyle": dashes,
                                                 "label": names[part], **style})
    axes.set_ylabel(axis_text("Energy", unit))
    missing = closure(run)
    if missing is not None:  # without a line of its own, so that the words stand off the data
        axes.plot([], [], " ", label=f"balance closes to {missing.max(initial=0.0):.1g}")
    legend_above(axes)


def legend_above(axes: Axes) -> None:
    """Draw the legend above the axes, so that it hides no data."""
    count = len(axes.get_legend_handles_labels()[1])
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False,
                ncols=_legend_columns(count), columnspacing=1.2, handlelength=1.8,
                borderaxespad=0.3)


def _legend_columns(count: int) -> int:
    """Return the number of columns of a legend above the axes."""
    return count if count <= 3 else 2


def _sane_limits(axes: Axes, values: NDArray[Any]) -> None:
    """Set limits with which a column that is constant up to round-off is a level line."""
    values = values[np.isfinite(values)]
    largest = float(np.abs(values).max(initial=0.0))
    if not len(values) or float(np.ptp(values)) > 1e-6 * largest:
        return
    level = float(values.mean())
    axes.set_ylim(*((0.0, 1.25 * level) if level > 0.0 else (1.25 * level, 0.0) if level < 0.0
                    else (-1.0, 1.0)))


def steady_words(run: ResultFile, step: int) -> str:
    """Return the speed and the friction if a step is a state of steady sliding, or else ''."""
    history = run.history
    row = int(np.searchsorted(history["step"], step))
    if not steady_rows(run)[row] or "sliding_speed" not in history:
        return ""
    factor, unit = si_scale(history["sliding_speed"][row], "m/s")
    return (f", steady at {history['sliding_speed'][row] * factor:.4g} {unit}, friction"
            f" {history['friction'][row]:.3g}")


def horizontal(run: Run) -> tuple[NDArray[Any], str, bool]:
    """Return values and label of the horizontal axis, and whether the axis is logarithmic.

    It is the speed for a curve of steady states, otherwise the time or, if that suits better, the
    travel of the road.
    """
    speed, way = steady_speeds(run), travel(run)
    values, what, unit = (
        (speed, LABELS["sliding_speed"], "m/s") if speed is not None
        else (run.history["time"], "Time", "s") if way is None
        else (way, "Travel of the road", "m"))
    log = speed is not None and bool(np.nanmax(speed) >= 10.0 * np.nanmin(speed))
    factor, unit = (1.0, unit) if log else si_scale(values, unit)
    return values * factor, axis_text(what, unit), log


def _new_axes() -> Axes:
    """Return the axes of a new figure that fits one column."""
    return plt.subplots(figsize=(SINGLE_COLUMN, 2.5), layout="constrained")[1]
