"""Pictures of a snapshot: maps, maps of stick and slip with traction arrows, profiles, sections."""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from ..results.settings import has_friction
from .colour_scales import (
    field_style,
    mark_scale,
    scale_limit,
    state_style,
    typical_value,
    without_open_cells,
    without_round_off,
)
from .style import (
    COLOURS,
    NO_CONTACT,
    SINGLE_COLUMN,
    SLIP,
    STICK,
    axis_text,
    label_of,
    print_style,
    si_scale,
    when,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..results import Grid, Snapshot

__all__ = ["draw_map", "draw_profile", "frame_of", "plot_field", "plot_section", "stretch_of",
           "write_lengths"]

ARROWS = 22  # along the longer side
_MOST_UPRIGHT = 3.0  # ratio of the height of a map to its width up to which labels lie below it
_MOST_OBLONG = 8.0  # ratio of the sides of a map up to which both have the same scale


def plot_field(snapshot: Snapshot, name: str = "pressure", ax: Axes | None = None,
               arrows: bool | None = None) -> Axes:
    """Draw a field of a snapshot: a map with a colour bar, or a profile if ny is 1.

    ``contact`` shows which cells are open, stick or slip, with a legend and, in a case with
    friction, with arrows of the traction on the rubber.

    Parameters
    ----------
    snapshot : Snapshot
        The snapshot.
    name : str
        Name of the field.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into; by default a new figure that fits one column of a journal.
    arrows : bool, optional
        Whether to draw the tractions; by default only on the map of ``contact``.

    Returns
    -------
    matplotlib.axes.Axes
        The axes; the figure is ``axes.figure``.
    """
    grid = snapshot.run.grid
    field = without_round_off(snapshot, name)
    with print_style() if ax is None else nullcontext():
        if ax is None:
            ratio = 0.55 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.25, 2.0))
            height = 0.75 + (SINGLE_COLUMN - 0.9) * ratio
            label = axis_text(label_of(name, snapshot), "kPa")
            if grid.ny > 1 and name != "contact" and _bar_lies(label, ratio, 0.775 * SINGLE_COLUMN):
                height += 0.5
            ax = _new_axes((SINGLE_COLUMN, height))
        label = label_of(name, snapshot)
        if grid.ny == 1 and name == "contact":
            _contact_profile(snapshot, ax)
        elif grid.ny == 1:
            draw_profile(grid, field[0], label, snapshot.units(name), ax)
        elif name == "contact":
            _contact_map(snapshot, field, ax)
        else:
            draw_map(grid, field, name, label, snapshot.units(name), ax)
        wanted = arrows if arrows is not None else name == "contact"
        drawn = (wanted and grid.ny > 1 and "traction_x" in snapshot and "traction_y" in snapshot
                 and _arrows(snapshot, ax))
        head = "Stick and slip" if name == "contact" and has_friction(snapshot.run) else label
        # There is a key of arrows, or a legend of tractions, between map and title.
        pad = 19.0 if name == "contact" and grid.ny == 1 else 15.0 if drawn else None
        ax.set_title(f"{head}, {when(snapshot)}", pad=pad)
    return ax


def plot_section(snapshot: Snapshot, ax: Axes | None = None) -> Axes:
    """Draw pressure and gap along x through the cell of the largest pressure.

    Parameters
    ----------
    snapshot : Snapshot
        A snapshot with pressure and gap.
    ax : matplotlib.axes.Axes, optional
        Axes for the pressure; the gap has an axis on the right.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the pressure.
    """
    grid = snapshot.run.grid
    pressure, gap = snapshot["pressure"], without_round_off(snapshot, "gap")
    row = int(np.unravel_index(np.argmax(pressure), pressure.shape)[0])
    axes = ax if ax is not None else _new_axes((SINGLE_COLUMN, 2.4))
    draw_profile(grid, pressure[row], "Pressure", snapshot.units("pressure"), axes)
    other = axes.twinx()
    draw_profile(grid, gap[row], "Gap", snapshot.units("gap"), other, COLOURS[1], "--")
    if not gap[row].any():
        other.set_yticks([0.0])
    other.grid(visible=False)
    for panel, colour in ((axes, COLOURS[0]), (other, COLOURS[1])):
        panel.yaxis.label.set_color(colour)
    # Both zeros are at the same height.
    if np.any(gap[row] > 0.0) and pressure[row].min() >= 0.0:
        axes.set_ylim(bottom=0.0)
        other.set_ylim(bottom=0.0)
    length, unit = si_scale(max(grid.lx, grid.ly), "m")
    axes.set_title(f"Section at y = {grid.y[row] * length:.4g} {unit}")
    return axes


def frame_of(grid: Grid) -> tuple[float, str, tuple[float, float, float, float]]:
    """Return the unit of lengths of a map, and the map's edges.

    Parameters
    ----------
    grid : Grid
        Grid of the map.

    Returns
    -------
    factor : float
        Lengths in m times this factor are in the unit.
    unit : str
        The unit, such as ``"mm"``.
    edges : tuple of float
        Edges of the outer cells in this unit: left, right, bottom, top.
    """
    length, unit = si_scale([grid.lx, grid.ly], "m")
    edges = (length * -0.5 * grid.dx, length * (grid.lx - 0.5 * grid.dx),
             length * -0.5 * grid.dy, length * (grid.ly - 0.5 * grid.dy))
    return length, unit, edges


def stretch_of(width: float, height: float) -> float:
    """Return the scale of y over that of x with which a map is drawn: 1, unless it is very oblong.

    Parameters
    ----------
    width, height : float
        Sides of the part that is shown, in the same unit.

    Returns
    -------
    float
        The argument `aspect` of `imshow`.

    Examples
    --------
    >>> stretch_of(2.0, 1.0), stretch_of(1024.0, 4.0), stretch_of(4.0, 1024.0)
    (1.0, 32.0, 0.03125)
    """
    ratio = height / width
    return float(np.clip(ratio, 1.0 / _MOST_OBLONG, _MOST_OBLONG)) / ratio


def write_lengths(axes: Axes, unit: str, stretch: float) -> None:
    """Label the axes of a map, and say which one is stretched.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes of the map.
    unit : str
        Unit of both lengths.
    stretch : float
        The value of `stretch_of`.
    """
    more = ""
    if stretch > 1.0:
        more = f"; y is stretched {stretch:.3g} times"
    elif stretch < 1.0:
        more = f", stretched {1.0 / stretch:.3g} times"
    if _is_narrow(axes, stretch):
        axes.tick_params(axis="x", labelrotation=90)  # the axis is too short for labels in a row
    axes.set_xlabel(f"x ({unit}){more}")
    axes.set_ylabel(f"y ({unit})")


def _is_narrow(axes: Axes, stretch: float) -> bool:
    """Return whether a map is so narrow that the labels of its x axis must stand upright."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    return stretch * (high - low) > _MOST_UPRIGHT * (right - left)


def _bar_lies(text: str, ratio: float, width: float) -> bool:
    """Return whether the colour bar should be below a map of this width, in inches."""
    needed = 0.6 * len(text) * plt.rcParams["axes.labelsize"] / 72.0
    return ratio < 0.45 or needed > 0.85 * width * ratio


def draw_map(grid: Grid, field: NDArray[Any], name: str, label: str, units: str,
             axes: Axes) -> None:
    """Draw a map with its colour bar."""
    factor, unit, style = field_style(field, name, units)
    shown = without_open_cells(field * factor, name)
    scaled = (float(field.min()) * factor, float(field.max()) * factor)
    low, high = style["norm"].vmin, style["norm"].vmax
    slack = 1e-9 * (high - low)
    above, below = scaled[1] > high + slack, low < 0.0 and scaled[0] < low - slack
    extend = {(False, False): "neither", (True, False): "max", (False, True): "min",
              (True, True): "both"}[above, below]
    _, length_unit, edges = frame_of(grid)
    stretch = stretch_of(grid.lx, grid.ly)
    image = axes.imshow(shown, origin="lower", extent=edges, aspect=stretch, **style)
    ratio = float(np.clip(grid.ly / grid.lx, 0.25, 2.5))
    text = axis_text(label, unit)
    # A bar beside the map is as tall as the map, which limits the length of its label.
    width = axes.get_position(original=True).width * axes.figure.bbox.width / axes.figure.dpi
    lies = _bar_lies(text, ratio, width)
    bar = axes.figure.colorbar(image, ax=axes, extend=extend,
                               **({"orientation": "horizontal", "pad": 0.12} if lies
                                  else {"fraction": 0.046 * ratio, "pad": 0.03}))
    mark_scale(bar, text, field)
    write_lengths(axes, length_unit, stretch)


def _states(snapshot: Snapshot, contact: NDArray[Any]) -> tuple[list[str], list[str]]:
    """Return colours and names, with their share of the grid, of the states of contact."""
    shares = [float(np.mean(contact == state)) for state in range(3)]
    if has_friction(snapshot.run):
        named = list(zip((NO_CONTACT, STICK, SLIP), ("open", "stick", "slip"), shares,
                         strict=True))
    else:
        named = [(NO_CONTACT, "open", shares[0]), (STICK, "contact", shares[1] + shares[2])]
    return ([colour for colour, _, _ in named],
            [f"{state} {100 * share:.3g} %" for _, state, share in named])


def _contact_map(snapshot: Snapshot, contact: NDArray[Any], axes: Axes) -> None:
    """Draw the map of open, sticking and slipping cells."""
    colours, names = _states(snapshot, contact)
    _, unit, edges = frame_of(snapshot.run.grid)
    length, _, _ = frame_of(snapshot.run.grid)
    left, right, low, high = (length * end for end in window(snapshot))
    stretch = stretch_of(right - left, high - low)
    axes.imshow(contact, origin="lower", extent=edges, aspect=stretch,
                interpolation="nearest", **state_style(snapshot.run))
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    write_lengths(axes, unit, stretch)
    # Labels of ticks that stand upright are about three times as tall.
    _state_legend(axes, colours, names, 2.0 * plt.rcParams["font.size"] if _is_narrow(axes, stretch)
                  else 0.0)


def _state_legend(axes: Axes, colours: list[str], names: list[str], more: float = 0.0) -> None:
    """Draw the legend of the states under the axes, by some more points if labels are tall."""
    patches = [Patch(facecolor=colour, edgecolor="#888888", linewidth=0.5, label=name)
               for colour, name in zip(colours, names, strict=True)]
    # The legend is below the tick labels and the axis label, whatever the height of the axes.
    drop = (2.2 * (plt.rcParams["font.size"] + 5.0) + more) / 72.0
    under = axes.transAxes + ScaledTranslation(0.0, -drop, axes.figure.dpi_scale_trans)
    axes.legend(handles=patches, loc="upper center", bbox_to_anchor=(0.5, 0.0),
                bbox_transform=under, frameon=False, ncols=len(patches), handlelength=1.0,
                handleheight=1.0, columnspacing=1.2, borderaxespad=0.0)


def window(snapshot: Snapshot) -> tuple[float, float, float, float]:
    """Return the part of the map to show: left, right, lower and upper edge, m.

    It is the whole map or, if the contact takes less than half of a free map (a sphere, for
    example), the surroundings of the contact.
    """
    grid = snapshot.run.grid
    whole = (-0.5 * grid.dx, grid.lx - 0.5 * grid.dx, -0.5 * grid.dy, grid.ly - 0.5 * grid.dy)
    if grid.boundary != "free" or "contact" not in snapshot:
        return whole
    j, i = np.nonzero(snapshot["contact"])
    if not len(i):
        return whole
    ends = ((i.min() - 0.5) * grid.dx, (i.max() + 0.5) * grid.dx,
            (j.min() - 0.5) * grid.dy, (j.max() + 0.5) * grid.dy)
    side = 1.5 * max(ends[1] - ends[0], ends[3] - ends[2])
    if side > 0.5 * min(grid.lx, grid.ly):
        return whole
    middle_x, middle_y = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[2] + ends[3])
    return (middle_x - side / 2, middle_x + side / 2, middle_y - side / 2, middle_y + side / 2)


def traction_samples(snapshot: Snapshot, side: float | None = None) -> tuple[NDArray[Any], ...]:
    """Return cells in contact that are spread over the map, and their tractions.

    The map is divided into squares. Each square contributes the cell in contact that is nearest to
    its middle.

    Parameters
    ----------
    snapshot : Snapshot
        A snapshot with tractions.
    side : float, optional
        Side of the squares, m; by default the longer side of the map over `ARROWS`.

    Returns
    -------
    tuple of ndarray
        Indices i along x and j along y, tractions along x and y in Pa.
    """
    grid = snapshot.run.grid
    in_contact = (snapshot["contact"] > 0 if "contact" in snapshot
                  else snapshot["pressure"] > 0.0)
    side = max(grid.lx, grid.ly) / ARROWS if side is None else side
    j, i = np.nonzero(in_contact)
    x, y = (i + 0.5) * grid.dx / side, (j + 0.5) * grid.dy / side
    distance = np.hypot(x % 1.0 - 0.5, y % 1.0 - 0.5)
    order = np.argsort(distance, kind="stable")
    columns = int(grid.lx / side) + 2
    squares = np.floor(y[order]).astype(int) * columns + np.floor(x[order]).astype(int)
    chosen = order[np.unique(squares, return_index=True)[1]]
    i, j = i[chosen], j[chosen]
    return i, j, snapshot["traction_x"][j, i], snapshot["traction_y"][j, i]


def _arrows(snapshot: Snapshot, axes: Axes) -> bool:
    """Draw arrows of the traction on the rubber with a key; return whether there are any."""
    grid = snapshot.run.grid
    length, _, _ = frame_of(grid)
    # The visible part is the whole map, or the surroundings of a small contact.
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    seen = max(right - left, high - low) / length
    i, j, along_x, along_y = traction_samples(snapshot, seen / ARROWS)
    sizes = np.hypot(along_x, along_y)
    if not np.any(sizes):
        return False
    largest = scale_limit(sizes)
    longest = 1.5 * length * max(seen / ARROWS, grid.dx, grid.dy)
    # On a stretched map, too, the arrows have the directions of the tractions. Lengths and widths
    # are in parts of its longer side.
    flat = right - left >= high - low
    arrows = axes.quiver(grid.x[i] * length, grid.y[j] * length, along_x, along_y, angles="uv",
                         scale_units="x" if flat else "y", scale=largest / longest,
                         units="width" if flat else "height", width=0.0045, headwidth=3.6,
                         headlength=4.2, headaxislength=3.8, minlength=0.6, color="black",
                         edgecolor="white", linewidth=0.35, zorder=3, clip_on=True)
    shown = 10.0 ** np.floor(np.log10(largest))
    shown *= max(step for step in (1.0, 2.0, 5.0) if step * shown <= largest * (1.0 + 1e-12))
    factor, unit = si_scale(shown, "Pa")
    # A tenth of an inch above the map, which takes the width or the height of its place.
    place, figure = axes.get_position(), axes.figure
    ratio = (high - low) / (right - left) * stretch_of(right - left, high - low)
    tall = min(place.height * figure.bbox.height,
               place.width * figure.bbox.width * ratio) / figure.dpi
    # The arrow of the key ends at the right edge of the map, beside which there may be no room.
    reach = shown / largest * longest / (right - left if flat else (high - low) / ratio)
    axes.quiverkey(arrows, 1.0 - reach, 1.0 + 0.09 / max(tall, 0.1), shown,
                   f"traction {shown * factor:.3g} {unit}",
                   labelpos="W", coordinates="axes", labelsep=0.05,
                   fontproperties={"size": plt.rcParams["legend.fontsize"]})
    return True


def draw_profile(grid: Grid, field: NDArray[Any], label: str, units: str, axes: Axes,
             colour: str = COLOURS[0], dashes: str = "-") -> None:
    """Draw values over x for a line contact."""
    length, length_unit = si_scale(grid.lx, "m")
    factor, unit = si_scale(typical_value(field), units)
    axes.plot(grid.x * length, field * factor, color=colour, linestyle=dashes)
    axes.set_xlim(grid.x[0] * length, grid.x[-1] * length)
    axes.set_xlabel(f"x ({length_unit})")
    axes.set_ylabel(axis_text(label, unit))
    axes.grid(alpha=0.3)


def _contact_profile(snapshot: Snapshot, axes: Axes) -> None:
    """Draw the tractions of a line contact over shades for open, sticking and slipping cells."""
    grid, contact = snapshot.run.grid, snapshot["contact"][0]
    colours, names = _states(snapshot, contact[None])
    length, length_unit = si_scale(grid.lx, "m")
    edges = np.flatnonzero(np.diff(contact)) + 1
    for first, behind in zip([0, *edges], [*edges, grid.nx], strict=True):
        state = int(contact[first])
        axes.axvspan((first - 0.5) * grid.dx * length, (behind - 0.5) * grid.dx * length,
                     color=colours[min(state, len(colours) - 1)], linewidth=0.0,
                     alpha=0.35 if state else 0.6, zorder=0)
    fields = [name for name in ("pressure", "traction_x", "traction_y")
              if name in snapshot and (name == "pressure" or np.any(snapshot[name]))]
    factor, unit = si_scale(max((typical_value(snapshot[name]) for name in fields), default=0.0),
                            "Pa")
    styles = (("-", "black"), ("--", COLOURS[1]), (":", COLOURS[3]))
    for name, (dashes, colour) in zip(fields, styles, strict=False):
        axes.plot(grid.x * length, snapshot[name][0] * factor, dashes, color=colour,
                  label=label_of(name, snapshot))
    axes.set_xlim((-0.5) * grid.dx * length, (grid.nx - 0.5) * grid.dx * length)
    axes.set_xlabel(f"x ({length_unit})")
    axes.set_ylabel(axis_text("Traction", unit))
    if fields:
        axes.add_artist(axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False,
                                    ncols=len(fields), columnspacing=1.2, borderaxespad=0.3))
    _state_legend(axes, colours, names)


def _new_axes(size: tuple[float, float]) -> Axes:
    """Make a figure of one panel."""
    return plt.subplots(figsize=size, layout="constrained")[1]
