"""Pictures of friction curves for print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import (
    LogFormatterSciNotation,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    StrMethodFormatter,
)

from .style import DOUBLE_COLUMN, distinct_colours, fitted, print_style, shown_once, si_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ..results.friction_curve import FrictionCurve

    FloatArray = NDArray[np.float64]

__all__ = ["plot_friction_curve"]

_MARKERS = "o", "x"  # of points with warnings, and of those with states that are left out
_LEGEND_COLUMNS = 4
_MOST_KEYS = 4          # interval, theory and the two markers
_LEGEND_ROW = 0.16      # height of a row of the legend, inches
_TITLE_ROW = 0.2        # height of a second line of the title, inches
_ONLY_ROW = 2.5         # height of the panels if there is a single row, inches
_ROW = 2.1              # and of each of several rows
_FEW_DECADES = 1000.0   # ratio of the ends of an axis up to which 1, 2 and 5 are labelled


def plot_friction_curve(curve: FrictionCurve) -> Figure:
    """Draw friction and contact area with their 95 % intervals; Persson's theory is dashed.

    They are drawn against the speed or, for a single speed, against the pressure or the
    temperature. If two other quantities have several values, the one with fewer values has a row of
    panels for each, and the other one has the colours. Rings mark points with warnings, crosses
    those at which states are left out because the solver did not converge.

    Parameters
    ----------
    curve : FrictionCurve
        The curve.

    Returns
    -------
    matplotlib.figure.Figure
    """
    plan = _plan_of(curve)
    colours = plan.values(plan.colours)
    keys = (colours.size if colours.size > 1 else 1) + _MOST_KEYS
    legend = -(-keys // _LEGEND_COLUMNS)
    count = plan.values(plan.rows).size
    with print_style():
        titles = [line for line in _titles(curve, plan) if line]
        height = (_ROW * count if count > 1 else _ONLY_ROW) + _TITLE_ROW * (len(titles) > 1)
        figure, grid = plt.subplots(
            count, len(plan.panels), layout="constrained", squeeze=False, sharex=True, sharey="col",
            figsize=(DOUBLE_COLUMN, height + _LEGEND_ROW * legend))
        for row, places in enumerate(grid):
            for index, colour in enumerate(distinct_colours(colours.size)):
                _draw_line(curve, plan, places, plan.where(row, index), colour)
            if count > 1:
                places[0].set_ylabel(_words(plan.rows, float(plan.values(plan.rows)[row])),
                                     fontweight="bold")
        _dress(curve, plan, grid)
        for index, colour in enumerate(distinct_colours(colours.size)):
            label = _words(plan.colours, float(colours[index])) if colours.size > 1 else "runs"
            grid[0, 0].plot([], [], "o-", color=colour, label=label)
        _legend(figure, grid[0, 0], plan)
        figure.suptitle("\n".join(fitted(line, DOUBLE_COLUMN) for line in titles), parse_math=False)
    return shown_once(figure)


@dataclass(frozen=True)
class _Plan:
    """What the panels of a picture show.

    Attributes
    ----------
    axes : dict
        The values of pressure, temperature and speed, in the order of the arrays of the curve.
    along, rows, colours : str
        The quantity along the horizontal axis, and those of the rows of panels and of the colours.
    panels : list of (str, str, str)
        Names of the variable and of its theory, and the label of the axis, from left to right.
    means : dict of (ndarray, ndarray, ndarray)
        Mean and interval of each variable.
    flags : (ndarray of bool, ndarray of bool)
        The points with warnings, and those with states that are left out.
    floor : float
        The least contact area that is drawn.
    """

    axes: dict[str, FloatArray]
    along: str
    rows: str
    colours: str
    panels: list[tuple[str, str, str]]
    means: dict[str, tuple[FloatArray, FloatArray, FloatArray]]
    flags: tuple[NDArray[np.bool_], NDArray[np.bool_]]
    floor: float

    def values(self, name: str) -> FloatArray:
        """Return the values of a quantity."""
        return self.axes[name]

    @property
    def dashes(self) -> str:
        """How the theory is drawn: a single point has no line, so that it is a marker."""
        return "_" if self.axes[self.along].size == 1 else "--"

    def where(self, row: int, colour: int) -> tuple[int | slice, ...]:
        """Return the place of a line in the arrays of the curve."""
        index: dict[str, int | slice] = {self.along: slice(None), self.rows: row,
                                         self.colours: colour}
        return tuple(index[name] for name in self.axes)


def _plan_of(curve: FrictionCurve) -> _Plan:
    """Choose what the panels show."""
    axes = {"pressure": curve.pressure, "temperature": curve.temperature, "speed": curve.speed}
    along = next((name for name in ("speed", "pressure", "temperature") if axes[name].size > 1),
                 "speed")
    rows, colours = sorted((name for name in axes if name != along),
                           key=lambda name: axes[name].size)
    panels = [("friction", "", "friction coefficient"),
              ("friction_loss", "friction_persson", "friction by loss in the rubber"),
              ("contact_area", "area_persson", "contact area fraction")]
    if not float(curve.settings.get("coefficient", 0.0)):
        panels = panels[1:]  # without friction in the interface all of it is loss in the rubber
    warned, lost = (np.asarray(curve.states_with(lost=lost).any(axis=-1)) for lost in (False, True))
    return _Plan(axes, along, rows, colours, panels,
                 {name: curve.mean(name) for name, *_ in panels}, (warned, lost), _floor(curve))


def _draw_line(curve: FrictionCurve, plan: _Plan, places: NDArray[Any],
               where: tuple[int | slice, ...], colour: str) -> None:
    """Draw one line in each panel of a row, with its interval, its marks and its theory."""
    x = plan.values(plan.along)
    flagged = [one[where] for one in plan.flags]
    for panel, (name, theory, _) in zip(places, plan.panels, strict=True):
        mean, low, high = (part[where] for part in plan.means[name])
        if name == "contact_area":
            low = np.where(low <= 0.0, plan.floor, low)
        if x.size == 1:
            panel.vlines(x, low, high, color=colour, alpha=0.4, linewidth=3.0)
        else:
            panel.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0)
        panel.plot(x, mean, "o-", color=colour)
        _mark(panel, x, mean, flagged, colour)
        if theory:
            panel.plot(x, curve.theory[theory][where], plan.dashes, color=colour, linewidth=0.9,
                       markersize=7)


def _titles(curve: FrictionCurve, plan: _Plan) -> tuple[str, str]:
    """Return the title of a picture, and the conditions that are the same at all its points."""
    same = [_words(name, float(values[0])) for name, values in plan.axes.items()
            if name != plan.along and values.size == 1 and np.isfinite(values[0])]
    coefficient = float(curve.settings.get("coefficient", 0.0))
    if coefficient:
        same.append(f"coefficient {coefficient:g} in the interface")
    return str(curve.settings.get("title", "")), ", ".join(same)


def _dress(curve: FrictionCurve, plan: _Plan, grid: NDArray[Any]) -> None:
    """Label and scale the axes.

    The panels of a column share their scale. If there are several, they share a title, too, because
    the text would be too long for the low panels.
    """
    for column, (_, _, text) in zip(grid.T, plan.panels, strict=True):
        if len(column) > 1:
            column[0].set_title(text)
        else:
            column[0].set_ylabel(text)
        for panel in column:
            if plan.along != "temperature":
                panel.set_xscale("log")
            panel.grid(alpha=0.3)
        column[-1].set_xlabel({"speed": "speed (m/s)", "pressure": "pressure (Pa)",
                               "temperature": "temperature (°C)"}[plan.along])
    for panel, (name, theory, _) in zip(grid[0], plan.panels, strict=True):
        _scale(panel, curve, plan, name, theory)
    for panel in grid[:, -1]:
        _mark_decades(panel)


def _scale(panel: Axes, curve: FrictionCurve, plan: _Plan, name: str, theory: str) -> None:
    """Scale a vertical axis by the means and the theory.

    The intervals of two patches are often many times as wide as the curve. They do not count beyond
    twice the largest mean, or below half of the least one on a logarithmic axis.
    """
    found = plan.means[name][0]
    if theory:
        found = np.concatenate([found.ravel(), curve.theory[theory].ravel()])
    found = found[np.isfinite(found)]
    if name == "contact_area":
        panel.set_yscale("log")
        if found.max(initial=0.0) > 0.0:
            low, high = panel.get_ylim()
            panel.set_ylim(max(low, plan.floor), min(high, 2.0 * float(found.max())))
    else:
        least, most = (float(end) for end in (found.min(initial=0.0), found.max(initial=0.0)))
        low, high = panel.get_ylim()
        low = max(min(0.0, low), 2.0 * least)
        high = min(high, 2.0 * most) if most > 0.0 else high
        panel.set_ylim(low, high + 0.05 * (high - low))


def _mark_decades(panel: Axes) -> None:
    """Label 1, 2 and 5 of each decade of the vertical axis, or over many decades some powers of 10.

    An axis that is much shorter than a decade has equally spaced ticks.
    LogLocator with `subs` gives no ticks at all if it has to leave out decades.
    """
    low, high = panel.get_ylim()
    if high <= 4.0 * low:
        panel.yaxis.set_major_locator(MaxNLocator(nbins=6))
        panel.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    elif high <= _FEW_DECADES * low:
        panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
        panel.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    else:
        panel.yaxis.set_major_locator(LogLocator(numticks=7))
        panel.yaxis.set_major_formatter(LogFormatterSciNotation())
    panel.yaxis.set_minor_formatter(NullFormatter())


def _legend(figure: Figure, panel: Axes, plan: _Plan) -> None:
    """Draw the legend beside the panels, because the intervals may fill them.

    With a marker in place of dashes, the intervals are bars.
    """
    intervals = any(np.isfinite(low).any() for _, low, _ in plan.means.values())
    if intervals and plan.dashes == "--":
        panel.fill_between([], [], [], color="k", alpha=0.2, linewidth=0, label="95 % interval")
    elif intervals:
        panel.plot([], [], "|", color="k", alpha=0.4, markersize=9, markeredgewidth=3.0,
                   label="95 % interval")
    panel.plot([], [], f"k{plan.dashes}", linewidth=0.9, markersize=7, label="Persson's theory")
    for some, marker, text in zip(plan.flags, _MARKERS, ("with warnings", "not converged"),
                                  strict=True):
        if some.any():
            panel.plot([], [], marker, color="k", fillstyle="none", markersize=7, label=text)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", frameon=False,
                  ncols=_LEGEND_COLUMNS)


def _floor(curve: FrictionCurve) -> float:
    """Return the least contact area that is drawn: half of the least mean, also of the theory.

    The logarithmic axis has no place for intervals that end at 0 or below. They reach this edge.
    """
    drawn = np.concatenate([curve.mean("contact_area")[0].ravel(),
                            curve.theory["area_persson"].ravel()])
    return 0.5 * float(np.min(drawn[drawn > 0.0], initial=1.0))


def _mark(panel: Axes, x: NDArray[Any], y: NDArray[Any], flagged: list[NDArray[np.bool_]],
          colour: str) -> None:
    """Draw rings around points with warnings, and crosses where states are left out.

    A cross is at the lower edge if no patch has a value.
    """
    warned, lost = flagged
    known = np.isfinite(y)
    edge, inside = panel.get_xaxis_transform(), panel.transData
    for some, marker, height, transform in (
            (warned, _MARKERS[0], y, inside), (lost & known, _MARKERS[1], y, inside),
            (lost & ~known, _MARKERS[1], np.full(y.shape, 0.03), edge)):
        if some.any():  # without points, a line that is not clipped upsets the layout
            panel.plot(x[some], height[some], marker, color=colour, fillstyle="none", markersize=7,
                       clip_on=False, transform=transform)


def _words(name: str, value: float) -> str:
    """Return a value with its unit."""
    if name == "temperature":
        return f"{value:.4g} °C"
    unit = "Pa" if name == "pressure" else "m/s"
    factor, prefixed = si_scale(value, unit)
    return f"{value * factor:.3g} {prefixed}"
