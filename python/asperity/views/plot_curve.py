"""Pictures of friction curves for print."""

from __future__ import annotations

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

from .style import DOUBLE_COLUMN, distinct_colours, print_style, shown_once, si_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ..results.friction_curve import FrictionCurve

__all__ = ["plot_friction_curve"]

_MARKERS = "o", "x"  # of points with warnings, and of those with states that are left out
_LEGEND_COLUMNS = 4
_MOST_KEYS = 4          # interval, theory and the two markers
_LEGEND_ROW = 0.16      # height of a row of the legend, inches
_FEW_DECADES = 1000.0   # ratio of the ends of an axis up to which 1, 2 and 5 are labelled


def plot_friction_curve(curve: FrictionCurve) -> Figure:
    """Draw friction and contact area with their 95 % intervals; Persson's theory is dashed.

    They are drawn against the speed or, for a single speed, against the pressure or the
    temperature. Each combination of the other two has its own colour. Rings mark points with
    warnings, crosses those at which states are left out because the solver did not converge.

    Parameters
    ----------
    curve : FrictionCurve
        The curve.

    Returns
    -------
    matplotlib.figure.Figure
    """
    axes = {"speed": curve.speed, "pressure": curve.pressure, "temperature": curve.temperature}
    along = next((name for name, values in axes.items() if values.size > 1), "speed")
    order = ("pressure", "temperature", "speed")
    place = order.index(along)
    # A single point has neither a ribbon nor a line: its interval is a bar, the theory a dash.
    alone = axes[along].size == 1
    dashes = "_" if alone else "--"
    with print_style():
        panels = [("friction", "", "friction coefficient"),
                  ("friction_loss", "friction_persson", "friction by loss in the rubber"),
                  ("contact_area", "area_persson", "contact area fraction")]
        if not float(curve.settings.get("coefficient", 0.0)):
            panels = panels[1:]  # without friction in the interface all of it is loss in the rubber
        others = [name for name in order if name != along]
        combinations = list(np.ndindex(*(axes[name].size for name in others)))
        rows = -(-(len(combinations) + _MOST_KEYS) // _LEGEND_COLUMNS)
        figure, places = plt.subplots(1, len(panels), layout="constrained",
                                      figsize=(DOUBLE_COLUMN, 2.5 + _LEGEND_ROW * rows))
        floor = _floor(curve)
        flagged = [np.asarray(curve.states_with(lost=lost).any(axis=-1)) for lost in (False, True)]
        for at, colour in zip(combinations, distinct_colours(len(combinations)), strict=True):
            where = list(at)
            where.insert(place, slice(None))
            label = ", ".join(_words(name, float(axes[name][i]))
                              for name, i in zip(others, at, strict=True) if axes[name].size > 1)
            for panel, (name, theory, _) in zip(places, panels, strict=True):
                mean, low, high = (part[tuple(where)] for part in curve.mean(name))
                if panel is places[-1]:
                    low = np.where(low <= 0.0, floor, low)
                if alone:
                    panel.vlines(axes[along], low, high, color=colour, alpha=0.4, linewidth=3.0)
                else:
                    panel.fill_between(axes[along], low, high, color=colour, alpha=0.2, linewidth=0)
                panel.plot(axes[along], mean, "o-", color=colour, label=label or "runs")
                _mark(panel, axes[along], mean, [one[tuple(where)] for one in flagged], colour)
                if theory:
                    panel.plot(axes[along], curve.theory[theory][tuple(where)], dashes,
                               color=colour, linewidth=0.9, markersize=7)
        for panel, (_, _, text) in zip(places, panels, strict=True):
            if along != "temperature":
                panel.set_xscale("log")
            panel.set_xlabel({"speed": "speed (m/s)", "pressure": "pressure (Pa)",
                              "temperature": "temperature (°C)"}[along])
            panel.set_ylabel(text)
            panel.grid(alpha=0.3)
        for panel in places[:-1]:
            low, high = panel.get_ylim()
            low = min(0.0, low)
            panel.set_ylim(low, high + 0.05 * (high - low))
        places[-1].set_yscale("log")
        if (curve.mean("contact_area")[1] <= 0.0).any():
            places[-1].set_ylim(bottom=floor)
        _mark_decades(places[-1])
        _legend(figure, places[0], flagged, dashes,
                any(np.isfinite(curve.mean(name)[1]).any() for name, *_ in panels))
        figure.suptitle(str(curve.settings.get("title", "")), parse_math=False)
    return shown_once(figure)


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


def _legend(figure: Figure, panel: Axes, flagged: list[NDArray[np.bool_]], dashes: str,
            intervals: bool) -> None:
    """Draw the legend beside the panels, because the intervals may fill them.

    With a marker in place of dashes, the intervals are bars.
    """
    if intervals and dashes == "--":
        panel.fill_between([], [], [], color="k", alpha=0.2, linewidth=0, label="95 % interval")
    elif intervals:
        panel.plot([], [], "|", color="k", alpha=0.4, markersize=9, markeredgewidth=3.0,
                   label="95 % interval")
    panel.plot([], [], f"k{dashes}", linewidth=0.9, markersize=7, label="Persson's theory")
    for some, marker, text in zip(flagged, _MARKERS, ("with warnings", "not converged"),
                                  strict=True):
        if some.any():
            panel.plot([], [], marker, color="k", fillstyle="none", markersize=7, label=text)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", frameon=False,
                  ncols=_LEGEND_COLUMNS)


def _floor(curve: FrictionCurve) -> float:
    """Return the lower edge of the contact area: half of the least value that is drawn.

    The logarithmic axis has no place for intervals that end at 0 or below. They reach this edge.
    """
    mean, low, _ = curve.mean("contact_area")
    drawn = np.concatenate([mean.ravel(), low.ravel(), curve.theory["area_persson"].ravel()])
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
        return f"{value:g} °C"
    unit = "Pa" if name == "pressure" else "m/s"
    factor, prefixed = si_scale(value, unit)
    return f"{value * factor:.3g} {prefixed}"
