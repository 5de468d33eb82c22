"""The overview of a run: a figure of its most informative quantities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from ..results.derived import column_of, load_name, normal_force, rms_slope
from ..results.settings import (
    has_adhesion,
    has_friction,
    has_rough_road,
    is_elastic,
    load_of_phases,
)
from ..results.steady import steady_speeds
from .plot_fields import plot_field, plot_section
from .plot_history import draw_column, horizontal, legend_above, steady_words
from .style import (
    COLOURS,
    DOUBLE_COLUMN,
    LABELS,
    SINGLE_COLUMN,
    axis_text,
    fitted,
    print_style,
    shown_once,
    si_scale,
    when,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results import Run

__all__ = ["plot_overview"]


def plot_overview(run: Run) -> Figure:
    """Draw the most informative quantities of a run.

    With friction these are friction with its parts, contact area, stick area and sliding speed
    over time, and the last maps of pressure and of stick and slip. For a curve of steady states
    they are friction, contact area and mean gap over the sliding speed. Without friction they are
    the last maps of pressure and gap, and one of these: contact area and viscous friction over
    time; for a growing load, the contact area against the load, with Persson's theory if the road
    is rough and the material elastic; for an approach that is prescribed in free mode, such as a
    pull-off, the normal force against the approach; for a single solve, a section through the
    contact. A run whose snapshots have none of these fields, or that has no snapshots, shows its
    history.

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
        curve = steady_speeds(run) is not None
        moving = run.history.rows > 1 and (curve or np.ptp(run.history["time"]) > 0.0)
        if moving and (curve or has_friction(run)):
            return _sliding_overview(run)
        names = [name for name in ("pressure", "gap") if snapshot is not None and name in snapshot]
        grid = run.grid
        ratio = 0.8 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.4, 1.6))
        count = len(names) + 1
        below = 0.6 if grid.ny > 1 and grid.ly < 0.45 * grid.lx else 0.0  # inches, for colour bars
        figure, panels = plt.subplots(
            1, count, figsize=(DOUBLE_COLUMN if count > 1 else SINGLE_COLUMN,
                               1.0 + 1.75 * ratio + below if count > 1 else 2.7),
            layout="constrained", squeeze=False)
        if snapshot is not None:
            for name, panel in zip(names, panels[0], strict=False):
                plot_field(snapshot, name, panel)
                panel.set_title(LABELS[name])
        panel = panels[0, -1]
        if _is_approach(run):
            _force_panel(run, panel)
        elif moving:
            _time_panel(run, panel)
        elif (snapshot is not None and run.history.rows <= 1 and len(names) == 2
              and not _persson_applies(run)):
            plot_section(snapshot, panel)
        else:
            _load_panel(run, panel)
        for other in figure.axes:
            if other.get_subplotspec() == panel.get_subplotspec() and count > 1:
                other.set_box_aspect(max(ratio, 0.6))  # as tall as the maps
        _headline(run, figure)
        return shown_once(figure)


def _sliding_overview(run: Run) -> Figure:
    """Draw friction, areas and speed over time on the left, and the last maps on the right.

    A curve of steady states shows friction, areas and gap over the speed.
    """
    curve = steady_speeds(run) is not None
    snapshot = run.snapshots[-1] if len(run.snapshots) else None
    maps = [name for name in ("pressure", "contact" if has_friction(run) else "gap")
            if snapshot is not None and name in snapshot]
    columns = [name for name in ("friction", "contact_area", "mean_gap" if curve else
                                 "sliding_speed") if name in run.history]
    grid = run.grid
    ratio = 0.6 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.3, 1.3))
    figure = plt.figure(figsize=(DOUBLE_COLUMN if maps else SINGLE_COLUMN,
                                 max(5.0, 1.8 + 5.0 * ratio) if maps else 5.0),
                        layout="constrained")
    parts = figure.subfigures(1, 2, squeeze=False)[0] if maps else [figure]
    panels = parts[0].subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    along, head, log = horizontal(run)
    for name, panel in zip(columns, panels, strict=True):
        draw_column(run, name, along, panel, {})
        if log:
            panel.set_xscale("log")
    panels[-1].set_xlabel(head)
    if snapshot is not None and maps:
        for name, panel in zip(maps, parts[-1].subplots(len(maps), 1, squeeze=False)[:, 0],
                               strict=True):
            plot_field(snapshot, name, panel)
            panel.set_title("Stick and slip" if name == "contact" else LABELS[name],
                            pad={"contact": 19.0 if grid.ny == 1 else 15.0}.get(name))
    _headline(run, figure)
    return shown_once(figure)


def _headline(run: Run, figure: Figure) -> None:
    """Write title and time of the last snapshot, and whether the run is finished."""
    rest = ""
    if len(run.snapshots):
        rest = f": {when(run.snapshots[-1])}{steady_words(run, run.snapshots[-1].step)}"
    if not run.finished:
        rest += " (run not finished)"
    title = fitted(run.title or run.path.name, figure.get_figwidth(), rest)
    figure.suptitle(title + rest, parse_math=False)


def _persson_applies(run: Run) -> bool:
    """Return whether Persson's theory of elastic contact holds for the road and the material."""
    return (has_rough_road(run) and run.grid.boundary == "periodic" and run.grid.ny > 1
            and is_elastic(run) and not has_adhesion(run))


def _is_approach(run: Run) -> bool:
    """Return whether the last phases prescribe an approach that varies, in free mode."""
    loads = load_of_phases(run)
    others = [number for number, load in enumerate(loads, start=1) if load != "displacement"]
    last = run.history["phase"] > max(others, default=0)
    return (run.grid.boundary == "free" and bool(np.count_nonzero(last) > 1)
            and float(np.ptp(run.history["displacement"][last])) > 0.0)


def _force_panel(run: Run, axes: Axes) -> None:
    """Draw the normal force against the approach."""
    history = run.history
    force = normal_force(run)
    factor, unit = si_scale(force, "N")
    along, length = si_scale(history["displacement"], "m")
    axes.plot(history["displacement"] * along, force * factor, color=COLOURS[0],
              marker="o" if history.rows <= 40 else "")
    axes.set_xlabel(axis_text(LABELS["displacement"], length))
    axes.set_ylabel(axis_text(LABELS["force"], unit))
    axes.set_title("Force against approach")
    axes.grid(alpha=0.3)


def _load_panel(run: Run, axes: Axes) -> None:
    """Draw contact area against the load, with Persson's theory if it applies.

    The load is the force in free mode, and the mean pressure in periodic mode.
    """
    history = run.history
    load, units = column_of(run, load_name(run))
    factor, unit = si_scale(load, units)
    if _persson_applies(run):
        modulus = 2.0 * float(run.material.shear_modulus) / (1.0 - float(run.material.poisson))
        slope = rms_slope(run.grid, run.height)
        if slope > 0.0 and load.max(initial=0.0) > 0.0:
            from ..theory import persson_area  # SciPy takes long to load

            loads = np.linspace(0.0, 1.05 * load.max(), 200)
            areas = persson_area(loads, modulus, slope)
            axes.plot(loads * factor, areas, color=COLOURS[1], linestyle="--",
                      label="Persson (2001)")
    axes.plot(load * factor, history["contact_area"], color=COLOURS[0], marker="o",
              linestyle="-" if history.rows > 1 else "", label="this run")
    axes.set_xlabel(axis_text(LABELS[load_name(run)], unit))
    axes.set_ylabel(axis_text(LABELS["contact_area"], ""))
    axes.set_xlim(left=min(0.0, 1.05 * load.min(initial=0.0) * factor))
    axes.set_ylim(bottom=0.0)
    axes.set_title("Contact area against load",
                   pad=6.0 + 1.5 * plt.rcParams["legend.fontsize"])
    axes.grid(alpha=0.3)
    legend_above(axes)


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
