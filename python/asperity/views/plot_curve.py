"""Pictures of friction curves for print."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from .style import COLOURS, DOUBLE_COLUMN, print_style, shown_once, si_scale

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..results.friction_curve import FrictionCurve

__all__ = ["plot_friction_curve"]


def plot_friction_curve(curve: FrictionCurve) -> Figure:
    """Draw friction and contact area with their 95 % intervals; Persson's theory is dashed.

    They are drawn against the speed or, for a single speed, against the pressure or the
    temperature. Each combination of the other two has its own colour.

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
    with print_style():
        panels = [("friction", "", "friction coefficient"),
                  ("friction_viscous", "friction_persson", "viscous friction coefficient"),
                  ("contact_area", "area_persson", "contact area fraction")]
        if not float(curve.settings.get("coefficient", 0.0)):
            panels = panels[1:]  # without friction in the interface all of it is viscous
        figure, places = plt.subplots(1, len(panels), figsize=(DOUBLE_COLUMN, 2.8),
                                      layout="constrained")
        others = [name for name in order if name != along]
        for number, at in enumerate(np.ndindex(*(axes[name].size for name in others))):
            where = list(at)
            where.insert(place, slice(None))
            label = ", ".join(_words(name, float(axes[name][i]))
                              for name, i in zip(others, at, strict=True) if axes[name].size > 1)
            colour = COLOURS[number % len(COLOURS)]
            for panel, (name, theory, _) in zip(places, panels, strict=True):
                mean, low, high = (part[tuple(where)] for part in curve.mean(name))
                panel.fill_between(axes[along], low, high, color=colour, alpha=0.2, linewidth=0)
                panel.plot(axes[along], mean, "o-", color=colour, label=label or "runs")
                if theory:
                    panel.plot(axes[along], curve.theory[theory][tuple(where)], "--",
                               color=colour, linewidth=0.9)
        for panel, (_, _, text) in zip(places, panels, strict=True):
            if along != "temperature":
                panel.set_xscale("log")
            panel.set_xlabel({"speed": "speed (m/s)", "pressure": "pressure (Pa)",
                              "temperature": "temperature (°C)"}[along])
            panel.set_ylabel(text)
            panel.grid(alpha=0.3)
        for panel in places[:-1]:
            panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]))
        places[-1].set_yscale("log")
        places[-1].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        places[-1].yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        places[-1].yaxis.set_minor_formatter(NullFormatter())
        places[0].plot([], [], "k--", linewidth=0.9, label="Persson's theory")
        # Beside the panels: the intervals may fill them.
        figure.legend(*places[0].get_legend_handles_labels(), loc="outside lower center",
                      frameon=False, ncols=4)
        figure.suptitle(str(curve.settings.get("title", "")), parse_math=False)
    return shown_once(figure)


def _words(name: str, value: float) -> str:
    """Return a value with its unit."""
    if name == "temperature":
        return f"{value:g} °C"
    unit = "Pa" if name == "pressure" else "m/s"
    factor, prefixed = si_scale(value, unit)
    return f"{value * factor:.3g} {prefixed}"
