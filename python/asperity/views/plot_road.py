"""The picture of a height map: the heights as a map, and a profile through the middle."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from ..results.history import Grid
from ..roads.map_files import own_map
from ..roads.statistics import statistics
from .plot_fields import draw_map, draw_profile
from .style import DOUBLE_COLUMN, SINGLE_COLUMN, fitted, print_style, shown_once, si_scale

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_road"]


def plot_road(path: str | os.PathLike[str]) -> Figure:
    """Draw a height map that `asperity import` or `asperity.surface.save` has written.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    matplotlib.figure.Figure
        A map of the heights and a profile through its middle, under a title with the rms height
        and the rms slope. A single line is drawn as a profile only.

    Raises
    ------
    ValueError
        If the file holds no height map with its lengths.
    """
    path = Path(path)
    reader = own_map(path)
    road = reader.channels[0] if reader is not None else None
    if road is None or road.physical_sizes is None:
        raise ValueError(f"{path}: holds no height map with its lengths")
    height = np.atleast_2d(road.array.T)
    ny, nx = height.shape
    lx, ly = (*road.physical_sizes, road.physical_sizes[0] / nx)[:2]
    grid = Grid(nx, ny, lx, ly, "periodic" if road.is_periodic else "free",
                np.arange(nx) * lx / nx, np.arange(ny) * ly / ny)

    with print_style():
        ratio = 0.0 if ny == 1 else float(np.clip(ly / lx, 0.3, 1.4))
        figure, panels = plt.subplots(
            1, 1 if ny == 1 else 2, layout="constrained", squeeze=False,
            figsize=(SINGLE_COLUMN if ny == 1 else DOUBLE_COLUMN, 1.2 + 2.4 * (ratio or 0.6)))
        row = ny // 2
        draw_profile(grid, height[row], "height", "m", panels[0, -1])
        if ny > 1:
            draw_map(grid, height, "height", "height", "m", panels[0, 0])
            factor, unit = si_scale(ly, "m")
            panels[0, 0].axhline(grid.y[row] * factor, color="white", linewidth=0.8, linestyle=":")
            panels[0, 1].set_title(f"Profile at y = {grid.y[row] * factor:.4g} {unit}")
            panels[0, 0].set_title("Heights")
        figure.suptitle(_headline(path, grid, height), parse_math=False)
        return shown_once(figure)


def _headline(path: Path, grid: Grid, height: np.ndarray) -> str:
    """Return the name of the file with the rms height and the rms slope."""
    found = statistics(height, grid.lx, grid.ly, grid.boundary)
    factor, unit = si_scale(found.rms_height, "m")
    rest = f": rms height {found.rms_height * factor:.3g} {unit}, rms slope {found.rms_slope:.3g}"
    return fitted(path.name, SINGLE_COLUMN if grid.ny == 1 else DOUBLE_COLUMN, rest) + rest
