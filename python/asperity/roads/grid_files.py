"""Reader of ESRI ASCII grids, the text format of height maps in geographic information systems.

The header has one word and one number per line: ``ncols``, ``nrows``, the position of the corner or
of the centre of the first cell, ``cellsize`` (or ``dx`` and ``dy``) and ``NODATA_value``, the
number in place of missing heights. The rows follow from north to south, that is from the largest y
to the smallest (https://desktop.arcgis.com, "Esri ASCII raster format").
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..base.tables import is_number, text_of
from .map_files import PlainMap, PlainReader

__all__ = ["esri_grid"]

_NAMES = {"ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx",
          "dy", "nodata_value"}
_LONGEST = 12           # lines of a header
_START = 200            # characters of a file in which its header must begin


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
        If the header lacks a number, or the number of heights does not fit it.
    """
    with path.open("rb") as file:
        if not file.read(_START).lstrip().lower().startswith((b"ncols", b"nrows")):
            return None
    lines = text_of(path).splitlines()
    header = {}
    for line in lines[:_LONGEST]:
        words = line.replace(",", ".").split()
        if len(words) != 2 or words[0].lower() not in _NAMES or not is_number(words[1]):
            break
        header[words[0].lower()] = float(words[1])
    dx, dy = (header.get(name, header.get("cellsize", 0.0)) for name in ("dx", "dy"))
    nx, ny = (int(header.get(name, 0)) for name in ("ncols", "nrows"))
    if min(nx, ny) < 1 or not min(dx, dy) > 0.0:
        raise ValueError(f"{path}: the header of an ESRI ASCII grid must give ncols, nrows and"
                         " cellsize, all positive")
    height = _numbers(path, " ".join(lines[len(header):]).replace(",", "."))
    if height.size != nx * ny:
        raise ValueError(f"{path}: has {height.size} heights: must have {nx * ny}, because ncols"
                         f" = {nx} and nrows = {ny}")
    height[height == header.get("nodata_value", -9999.0)] = np.nan
    array = height.reshape(ny, nx)[::-1].T.copy()
    return PlainReader("esri ascii grid", PlainMap(array, "Default", (nx * dx, ny * dy)))


def _numbers(path: Path, text: str) -> np.ndarray:
    """Return the heights, with NaN where they are written as such."""
    try:
        return np.array(text.split(), dtype=float)
    except ValueError as error:
        raise ValueError(f"{path}: a height is no number ({error})") from None
