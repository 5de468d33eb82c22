"""Reader of ESRI ASCII grids, the text format of height maps in geographic information systems.

The header has one word and one number per line: ``ncols``, ``nrows``, the position of the corner or
of the centre of the first cell, ``cellsize`` (or ``dx`` and ``dy``) and ``NODATA_value``, the
number in place of missing heights. The rows follow from north to south, that is from the largest y
to the smallest (https://desktop.arcgis.com, "Esri ASCII raster format").
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..base.tables import is_number, text_lines
from .map_files import PlainMap, PlainReader, text_table

__all__ = ["esri_grid"]

_NAMES = {"ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx",
          "dy", "nodata_value"}
_START = 200            # characters of a file in which its header must begin
_NO_HEIGHT = -9999.0    # what marks a missing height if the header does not say


def esri_grid(path: Path) -> PlainReader | None:
    """Return the map of an ESRI ASCII grid, or None if the file is of another format.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    PlainReader or None
        The map has lengths, but no unit.

    Raises
    ------
    ValueError
        If the header lacks a number, the rows do not fit it, or a height is no number.
    """
    with path.open("rb") as file:
        if not file.read(_START).lstrip().lower().startswith((b"ncols", b"nrows")):
            return None
    header = _header(path)
    dx, dy = (header.get(name, header.get("cellsize", 0.0)) for name in ("dx", "dy"))
    nx, ny = (header.get(name, 0.0) for name in ("ncols", "nrows"))
    if not (min(nx, ny) >= 1.0 and min(dx, dy) > 0.0):
        raise ValueError(f"{path}: the header of an ESRI ASCII grid must give ncols, nrows and"
                         " cellsize, all positive")
    height, _ = text_table(path)
    if height.shape != (ny, nx):
        raise ValueError(f"{path}: has {height.shape[0]} rows of {height.shape[1]} heights: must"
                         f" have nrows = {ny:g} of ncols = {nx:g}")
    height[height == header.get("nodata_value", _NO_HEIGHT)] = np.nan
    return PlainReader("esri ascii grid",
                       PlainMap(height[::-1].T.copy(), "Default", (nx * dx, ny * dy)))


def _header(path: Path) -> dict[str, float]:
    """Return the numbers of the header by their names in small letters."""
    header = {}
    for _, line in text_lines(path)[:len(_NAMES)]:
        name, *values = line.replace(",", ".").split()
        if name.lower() not in _NAMES or len(values) != 1 or not is_number(values[0]):
            break
        header[name.lower()] = float(values[0])
    return header
