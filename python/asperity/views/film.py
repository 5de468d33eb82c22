"""Films of a run: a field in all snapshots with one colour scale, and a curve of the history."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL.Image import Dither, Image, Quantize

from ..base.files import PICTURE, check_output, new_file
from ..results.settings import has_friction
from ..results.steady import steady_speeds
from .colour_scales import (
    field_style,
    mark_scale,
    state_style,
    without_open_cells,
    without_round_off,
)
from .plot_fields import frame_of, stretch_of, write_lengths
from .plot_history import horizontal, steady_words
from .style import (
    COLOURS,
    DOUBLE_COLUMN,
    LABELS,
    NO_CONTACT,
    SLIP,
    STICK,
    axis_text,
    fitted,
    label_of,
    print_style,
    si_scale,
    when,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from ..results import Run, Snapshot

__all__ = ["film"]

_ENDINGS = {".gif", ".mp4"}
SHORTEST = 5.0  # seconds of a film, unless its frames are very few


def film(run: Run, path: Path, field: str | None = None, *,
         frames_per_second: float | None = None) -> Path:
    """Write a film of a field: one frame per snapshot, with friction or contact area beside it.

    Parameters
    ----------
    run : Run
        A result with two or more snapshots (``&output snapshot_every``), and ny above 1.
    path : Path
        The film: .gif, or .mp4 if ffmpeg is installed.
    field : str, optional
        The field. The default is 'contact' with friction, and 'pressure' without.
    frames_per_second : float, optional
        Number of frames per second. The default is 12, and less for a film of few frames, which
        would otherwise be over too soon.

    Returns
    -------
    Path
        The film.

    Raises
    ------
    ValueError
        If the file has another ending, or exists and is no film, or there are too few snapshots.
    OSError
        If ffmpeg is missing for an .mp4.
    """
    path = Path(path)
    if path.suffix.lower() not in _ENDINGS:
        raise ValueError(f"{path}: the ending of a film must be .gif or .mp4")
    check_output(path, PICTURE)
    if len(run.snapshots) < 2:
        raise ValueError(f"{run.path}: a film needs two snapshots or more:"
                         " `&output snapshot_every = 1 /` stores one for each row")
    if run.grid.ny == 1:
        raise ValueError(f"{run.path}: a film needs a map: this is a line contact, ny = 1")
    if field is None:
        field = "contact" if has_friction(run) and "contact" in run.snapshots[0] else "pressure"
    if frames_per_second is None:
        frames_per_second = float(np.clip(len(run.snapshots) / SHORTEST, 2.0, 12.0))
    # Matplotlib's types ask for a whole number, but its writers take any.
    speed: dict[str, Any] = {"fps": frames_per_second}
    if path.suffix.lower() == ".mp4":
        if not FFMpegWriter.isAvailable():
            raise OSError(f"{path}: ffmpeg is not installed: write a .gif")
        writer: Any = FFMpegWriter(**speed)
    else:
        writer = _GifWriter(64 if field == "contact" else 256, **speed)
    with print_style():
        animation, figure = _animation(run, field)
        with new_file(path) as new:
            animation.save(new, writer=writer, dpi=110)
        plt.close(figure)
    return path


class _GifWriter(PillowWriter):
    """Writes frames whose colours cover all that occur, as the ends of a colour scale.

    Pillow's own choice favours frequent colours, and shows a small mark in that of its neighbours.

    Parameters
    ----------
    colours : int
        Number of colours, up to 256.
    fps : int
        Number of frames per second.
    """

    _frames: list[Image]

    def __init__(self, colours: int, fps: int) -> None:
        super().__init__(fps=fps)
        self.colours = colours

    def finish(self) -> None:
        """Write the file."""
        self._frames = [frame.convert("RGB").quantize(self.colours, method=Quantize.MAXCOVERAGE,
                                                      dither=Dither.NONE)
                        for frame in self._frames]
        super().finish()


def _animation(run: Run, field: str) -> tuple[FuncAnimation, Any]:
    """Return the frames and their figure."""
    grid, snapshots = run.grid, list(run.snapshots)
    ratio = float(np.clip(grid.ly / grid.lx, 0.4, 1.2))
    figure, (panel, curve) = plt.subplots(
        1, 2, figsize=(DOUBLE_COLUMN, 1.1 + 2.9 * ratio), layout="constrained",
        width_ratios=(1.25, 1.0))
    _, unit, edges = frame_of(grid)
    stretch = stretch_of(grid.lx, grid.ly)
    if field == "contact":
        image = panel.imshow(snapshots[0][field], origin="lower", extent=edges,
                             aspect=stretch, interpolation="nearest", **state_style(run))
        names = (((NO_CONTACT, "open"), (STICK, "stick"), (SLIP, "slip")) if has_friction(run)
                 else ((NO_CONTACT, "open"), (STICK, "contact")))
        figure.legend(handles=[Patch(facecolor=colour, edgecolor="#888888", linewidth=0.5,
                                     label=name) for colour, name in names],
                      loc="outside lower center", ncols=3, frameon=False)
    else:
        sample = _sample(snapshots, field)
        factor, scale_unit, style = field_style(sample, field, snapshots[0].units(field))
        image = panel.imshow(without_open_cells(without_round_off(snapshots[0], field) * factor,
                                                field),
                             origin="lower", extent=edges, aspect=stretch, **style)
        tall = float(np.clip(grid.ly / grid.lx, 0.1, 2.5))  # the bar is as tall as the map
        bar = figure.colorbar(image, ax=panel, fraction=0.046 * tall, pad=0.03)
        mark_scale(bar, axis_text(label_of(field, snapshots[0]), scale_unit), sample)
    write_lengths(panel, unit, stretch)

    along, column, mark = _curve(run, curve)
    curve.set_box_aspect(max(ratio, 0.6))
    if run.title:
        figure.suptitle(fitted(run.title, figure.get_figwidth()), parse_math=False)
    title = panel.set_title(_moment(snapshots[0], snapshots[-1]))
    # The layout is computed once, because in every frame it would take most of the time.
    figure.canvas.draw()
    figure.set_layout_engine("none")

    def draw(number: int) -> Any:
        snapshot = snapshots[number]
        values = without_round_off(snapshot, field)
        image.set_data(values if field == "contact"
                       else without_open_cells(values * factor, field))
        row = int(np.searchsorted(run.history["step"], snapshot.step))
        mark.set_data([along[row]], [column[row]])
        title.set_text(_moment(snapshot, snapshots[-1]))
        return image, mark, title

    return FuncAnimation(figure, draw, frames=len(snapshots), blit=False), figure


def _curve(run: Run, curve: Axes) -> tuple[NDArray[Any], NDArray[Any], Line2D]:
    """Draw friction or contact area; return the values of both axes, and the mark of a moment."""
    history = run.history
    column = "friction" if np.any(history["friction"]) else "contact_area"
    if steady_speeds(run) is not None:
        along, label, log = horizontal(run)
    else:
        name = "time" if np.ptp(history["time"]) > 0.0 else "step"
        scale, along_unit = si_scale(history[name], history.units(name))
        along, label, log = history[name] * scale, axis_text(LABELS[name], along_unit), False
        if name == "step":
            curve.xaxis.set_major_locator(MaxNLocator(integer=True))
    curve.plot(along, history[column], color=COLOURS[0])
    (mark,) = curve.plot([], [], "o", color=COLOURS[1])
    curve.set_xlabel(label)
    if log:
        curve.set_xscale("log")
    curve.set_ylabel(axis_text(LABELS[column], ""))
    curve.grid(alpha=0.3)
    return along, history[column], mark


def _sample(snapshots: list[Snapshot], field: str) -> NDArray[Any]:
    """Return values that stand for a field in all snapshots, without holding all of it.

    They are the quantiles of each snapshot, which include its extremes.
    """
    shares = np.linspace(0.0, 1.0, 1001)
    return np.array([np.quantile(without_round_off(snapshot, field), shares)
                     for snapshot in snapshots])


def _moment(snapshot: Snapshot, last: Snapshot) -> str:
    """Return step and time of a snapshot, with the unit and the decimals of all frames."""
    if last.time == 0.0:
        return when(snapshot) + steady_words(snapshot.run, snapshot.step)
    factor, unit = si_scale(last.time, "s")
    decimals = max(0, 2 - math.floor(math.log10(last.time * factor)))
    return f"step {snapshot.step}, t = {snapshot.time * factor:.{decimals}f} {unit}"
