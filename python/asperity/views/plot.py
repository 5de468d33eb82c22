"""Pictures of results, with matplotlib: histories, energies, an overview; fields of snapshots.

Colour-blind readers can distinguish the colours. Axes have units with SI prefixes (mm, MPa). The
sizes of new figures and of their text suit the columns of a journal.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from ..base.names import UnknownNameError, unknown_name
from ..results.derived import (
    closure,
    energy_terms,
    friction_outside,
    has_adhesion,
    has_friction,
    has_rough_road,
    is_elastic,
    rms_slope,
    road_speed,
    travel,
)
from ..results.steady import steady_mean, steady_rows, steady_speeds
from .plot_fields import plot_field, plot_section
from .style import (
    COLOURS,
    DOUBLE_COLUMN,
    LABELS,
    SINGLE_COLUMN,
    axis_text,
    label_of,
    print_style,
    shown_once,
    si_scale,
    when,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results import Run

__all__ = ["horizontal", "plot_field", "plot_history", "plot_overview", "plot_section", "si_scale",
           "steady_words"]

# Colours and line styles of the parts of friction and of energy.
PARTS = {"viscous": (COLOURS[1], "--"), "interface": (COLOURS[2], "-."),
         "stored": (COLOURS[0], "-"), "friction": (COLOURS[2], "-."), "work": (COLOURS[6], "-")}


def plot_history(run: Run, name: str = "contact_area", x: str | None = None,
                 ax: Axes | None = None, **style: Any) -> Axes:
    """Draw a column of the history against another one.

    In a run with friction, 'friction' is drawn with its causes (loss in the rubber, interface, and
    with adhesion the attraction outside the contact), 'contact_area' with the stick area, and
    'sliding_speed' with the speed of the road. 'energy' draws the work put in and the energies that
    are stored and lost.

    Parameters
    ----------
    run : Run
        The result.
    name : str
        Column to draw, or 'energy'.
    x : str, optional
        Column along the horizontal axis. The default is time. If no time passes, it is the sliding
        speed of a curve of steady states, otherwise pressure or step.
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
    if name != "energy" and name not in history:
        raise UnknownNameError(unknown_name("column of the history", name, [*history, "energy"]))
    if x is None and name != "sliding_speed" and steady_speeds(run) is not None:
        along, label, log = horizontal(run)
    else:
        if x is None:
            x = next((column for column in ("time", "pressure", "step")
                      if column != name and column in history and np.ptp(history[column]) > 0.0),
                     "step") if history.rows else "step"
        factor, unit = si_scale(history[x], history.units(x))
        along, label, log = history[x] * factor, axis_text(label_of(x, history), unit), False
    with print_style() if ax is None else nullcontext():
        axes = ax if ax is not None else _new_axes()
        _draw(run, name, along, axes, style)
        axes.set_xlabel(label)
        if log:
            axes.set_xscale("log")
        if run.title and ax is None:
            above = axes.get_legend()
            rows = 0 if above is None else -(-len(above.get_texts()) // above._ncols)
            axes.set_title(run.title, parse_math=False,
                           pad=6.0 + 1.5 * rows * plt.rcParams["legend.fontsize"])
    return axes


def plot_overview(run: Run) -> Figure:
    """Draw the most informative quantities of a run.

    With friction these are friction with its causes, contact area, stick area and sliding speed
    over time, and the last maps of pressure and of stick and slip. Without friction they are the
    last maps of pressure and gap, and one of these: contact area (and viscous friction) over time;
    for a growing load, the contact area against the load, with Persson's theory if the road is
    rough and the material elastic; for a single solve, a section through the contact. A curve of
    steady states is drawn over the sliding speed. A run without snapshots shows its history.

    Parameters
    ----------
    run : Run
        The result.

    Returns
    -------
    matplotlib.figure.Figure
        A figure that fits two columns of a journal.
    """
    with print_style():
        snapshot = run.snapshots[-1] if len(run.snapshots) else None
        moving = run.history.rows > 1 and (np.ptp(run.history["time"]) > 0.0
                                           or steady_speeds(run) is not None)
        if has_friction(run) and moving:
            return _frictional_overview(run)
        names = [name for name in ("pressure", "gap") if snapshot is not None and name in snapshot]
        grid = run.grid
        ratio = 0.8 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.4, 1.6))
        count = len(names) + 1
        figure, panels = plt.subplots(
            1, count, figsize=(DOUBLE_COLUMN if count > 1 else SINGLE_COLUMN,
                               1.0 + 1.75 * ratio if count > 1 else 2.7),
            layout="constrained", squeeze=False)
        for name, panel in zip(names, panels[0], strict=False):
            plot_field(snapshot, name, panel)
            panel.set_title(LABELS[name])
        panel = panels[0, -1]
        if moving:
            _time_panel(run, panel)
        elif run.history.rows <= 1 and len(names) == 2 and not _persson_applies(run):
            plot_section(snapshot, panel)
        else:
            _load_panel(run, panel)
        for other in figure.axes:
            if other.get_subplotspec() == panel.get_subplotspec() and count > 1:
                other.set_box_aspect(max(ratio, 0.6))  # as tall as the maps
        _headline(run, figure)
        return shown_once(figure)


def _frictional_overview(run: Run) -> Figure:
    """Draw friction, areas and speed over time on the left, and the last maps on the right.

    A curve of steady states shows friction, areas and gap over the speed.
    """
    curve = steady_speeds(run) is not None
    snapshot = run.snapshots[-1] if len(run.snapshots) else None
    maps = [name for name in ("pressure", "contact") if snapshot is not None and name in snapshot]
    columns = [name for name in ("friction", "contact_area", "mean_gap" if curve else
                                 "sliding_speed") if name in run.history]
    grid = run.grid
    ratio = 0.6 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.3, 1.3))
    figure = plt.figure(figsize=(DOUBLE_COLUMN if maps else SINGLE_COLUMN,
                                 max(5.0, 1.8 + 5.0 * ratio) if maps else 5.0),
                        layout="constrained")
    parts = figure.subfigures(1, 2, width_ratios=(1.0, 1.0)) if maps else [figure]
    panels = parts[0].subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    along, head, log = horizontal(run)
    for name, panel in zip(columns, panels, strict=True):
        _draw(run, name, along, panel, {})
        if log:
            panel.set_xscale("log")
    panels[-1].set_xlabel(head)
    if maps:
        for name, panel in zip(maps, parts[1].subplots(len(maps), 1, squeeze=False)[:, 0],
                               strict=True):
            plot_field(snapshot, name, panel)
            panel.set_title("Stick and slip" if name == "contact" else LABELS[name],
                            pad={"contact": 19.0 if grid.ny == 1 else 15.0}.get(name))
    _headline(run, figure)
    return shown_once(figure)


def _draw(run: Run, name: str, along: NDArray[Any], axes: Axes, style: dict[str, Any]) -> None:
    """Draw a column, with related columns, over given values of the horizontal axis."""
    history = run.history
    marked = {"marker": "o" if len(along) <= 40 else ""}
    axes.grid(alpha=0.3)
    if name == "energy":
        _draw_energy(run, along, axes, {**marked, **style})
        return
    values = history[name]
    factor, unit = si_scale(values, history.units(name))
    parts: list[tuple[str, NDArray[Any], str, str]] = []
    label = ""
    if name == "friction" and "friction_viscous" in history and has_friction(run):
        label = "whole"
        viscous = history["friction_viscous"]
        parts = [("loss in the rubber", viscous, *PARTS["viscous"]),
                 ("interface", values - viscous, *PARTS["interface"])]
    elif name == "contact_area" and "stick_area" in history and has_friction(run):
        label = "in contact"
        parts = [("sticking", history["stick_area"], COLOURS[4], "--")]
    elif name == "sliding_speed" and "road_x" in history and has_friction(run):
        label = "mean of the interface"
        speed = road_speed(run)
        factor, unit = si_scale([values.max(initial=0.0), speed.max(initial=0.0)],
                                history.units(name))
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
        _legend_above(axes)


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
    _legend_above(axes)


def _legend_above(axes: Axes) -> None:
    """Draw the legend above the axes, so that it hides no data."""
    count = len(axes.get_legend_handles_labels()[1])
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False,
                ncols=count if count <= 3 else 2, columnspacing=1.2, handlelength=1.8,
                borderaxespad=0.3)


def _sane_limits(axes: Axes, values: NDArray[Any]) -> None:
    """Set limits with which a column that is constant up to round-off is a level line."""
    values = values[np.isfinite(values)]
    largest = float(np.abs(values).max(initial=0.0))
    if not len(values) or float(np.ptp(values)) > 1e-6 * largest:
        return
    level = float(values.mean())
    axes.set_ylim(*((0.0, 1.25 * level) if level > 0.0 else (1.25 * level, 0.0) if level < 0.0
                    else (-1.0, 1.0)))


def _headline(run: Run, figure: Figure) -> None:
    """Write title and time of the last snapshot, and whether the run is finished."""
    words = [f"{run.title or run.path.name}"]
    if len(run.snapshots):
        words.append(when(run.snapshots[-1]))
        words[-1] += steady_words(run, run.snapshots[-1].step)
    figure.suptitle(": ".join(words) + ("" if run.finished else " (run not finished)"),
                    parse_math=False)


def steady_words(run: Run, step: int) -> str:
    """Return the speed and the friction if a step is a state of steady sliding, or else ''."""
    history = run.history
    row = int(np.searchsorted(history["step"], step))
    if not steady_rows(run)[row] or "sliding_speed" not in history:
        return ""
    factor, unit = si_scale(history["sliding_speed"][row], "m/s")
    return (f", steady at {history['sliding_speed'][row] * factor:.4g} {unit}, friction"
            f" {history['friction'][row]:.3g}")


def _persson_applies(run: Run) -> bool:
    """Return whether Persson's theory of elastic contact holds for the road and the material."""
    return (has_rough_road(run) and run.grid.boundary == "periodic" and run.grid.ny > 1
            and is_elastic(run) and not has_adhesion(run))


def _load_panel(run: Run, axes: Axes) -> None:
    """Draw contact area against pressure, with Persson's theory if it applies."""
    history = run.history
    pressure = history["pressure"]
    factor, unit = si_scale(pressure, "Pa")
    if _persson_applies(run):
        modulus = 2.0 * float(run.material.shear_modulus) / (1.0 - float(run.material.poisson))
        slope = rms_slope(run.grid, run.height)
        if slope > 0.0 and pressure.max(initial=0.0) > 0.0:
            from ..theory import persson_area  # SciPy takes long to load

            loads = np.linspace(0.0, 1.05 * pressure.max(), 200)
            areas = persson_area(loads, modulus, slope)
            axes.plot(loads * factor, areas, color=COLOURS[1], linestyle="--",
                      label="Persson (2001)")
    axes.plot(pressure * factor, history["contact_area"], color=COLOURS[0], marker="o",
              linestyle="-" if history.rows > 1 else "", label="this run")
    axes.set_xlabel(axis_text(LABELS["pressure"], unit))
    axes.set_ylabel(axis_text(LABELS["contact_area"], ""))
    axes.set_xlim(left=min(0.0, 1.05 * pressure.min(initial=0.0) * factor))
    axes.set_ylim(bottom=0.0)
    axes.set_title("Contact area against load",
                   pad=6.0 + 1.5 * plt.rcParams["legend.fontsize"])
    axes.grid(alpha=0.3)
    _legend_above(axes)


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


def _time_panel(run: Run, axes: Axes) -> None:
    """Draw contact area, and friction of a moving road, against time or travel."""
    names = ["contact_area", *(["friction"] if np.any(run.history["friction"]) else [])]
    along, head, log = horizontal(run)
    marker = "o" if len(along) <= 40 else ""
    for number, (name, panel) in enumerate(zip(names, (axes, None), strict=False)):
        panel = panel or axes.twinx()
        panel.plot(along, run.history[name], color=COLOURS[number], linestyle=("-", "--")[number],
                   marker=marker)
        panel.set_xlabel(head)
        if log:
            panel.set_xscale("log")
        panel.set_ylabel(axis_text(LABELS[name], ""))
        if len(names) == 2:
            panel.yaxis.label.set_color(COLOURS[number])
        panel.set_ylim(bottom=min(0.0, 1.05 * float(np.nanmin(run.history[name]))))
    axes.grid(alpha=0.3)
    axes.set_title("Contact area and friction" if len(names) == 2 else "Contact area")


def _new_axes() -> Axes:
    """Return the axes of a new figure that fits one column."""
    return plt.subplots(figsize=(SINGLE_COLUMN, 2.5), layout="constrained")[1]
