"""Readers of text tables and of this package's own files, which SurfaceTopography does not read.

They have the same interface as the readers and channels of SurfaceTopography, so that
`asperity.measured` treats all files alike. A text table is a matrix of heights, in which a row of
the file runs along x, or has columns of points x, z or x, y, z on a regular grid, of which some may
be missing.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base.names import counted
from ..base.tables import (
    Rows,
    cells_of,
    decimals,
    doubtful_number,
    has_quoted_cells,
    heads_of_comment,
    is_missing,
    is_number,
    text_lines,
    text_of,
)

__all__ = ["PlainReader", "is_value", "own_map", "refuse_garbled", "row_of_numbers", "text_map",
           "text_table", "unit_of_dataset"]

FloatArray = NDArray[np.float64]

_METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
_OFF_GRID = 0.1  # largest distance of a point from a regular grid, cells
_ROUNDING = 0.75  # the same of coordinates that are rounded, in units of their last digit ...
_OFF_ROUNDED = 0.3  # ... and in cells
_DIGITS = 9  # most decimal digits that a rounded coordinate has
_NEIGHBOURS = 0.4  # least part of the gaps between coordinates that are one step
_SPARSE = 20.0  # most cells per point that still count as a grid
_UNEVEN = ("is a line scan with points at uneven distances: a run needs a regular grid; interpolate"
           " it first, as with numpy.interp")
_NO_GRID = ("lie on no regular grid: interpolate them first, as with scipy.interpolate.griddata,"
            " and write the matrix of heights")


class _Kind(NamedTuple):
    """The kind of data of a channel."""

    name: str


_HEIGHTS = _Kind("HEIGHT")


@dataclass
class PlainMap:
    """A map with the interface of a channel and of a topography of SurfaceTopography.

    Attributes
    ----------
    array : ndarray, shape (nx, ny) or (nx,)
        Heights, NaN where missing; x is the first index.
    channel_id : str
        Name.
    physical_sizes : tuple of float, or None
        Lengths along x and y, if the file gives them.
    unit : str or None
        Unit of all lengths and heights, if the file names it.
    is_periodic : bool
        Whether opposite edges match.
    info : dict
        Further metadata of the file.
    """

    array: FloatArray
    channel_id: str
    physical_sizes: tuple[float, ...] | None = None
    unit: str | None = None
    is_periodic: bool = False
    info: dict[str, Any] = field(default_factory=dict)
    is_uniform: bool = True
    is_height_channel: bool = True
    data_kind: _Kind = _HEIGHTS

    @property
    def name(self) -> str:
        """The same as `channel_id`."""
        return self.channel_id

    @property
    def dim(self) -> int:
        """1 for a line scan, 2 for a map."""
        return self.array.ndim

    @property
    def nb_grid_pts(self) -> tuple[int, ...]:
        """Number of points along x and y."""
        return self.array.shape

    def topography(self, physical_sizes: tuple[float, ...] | None = None,
                   unit: str | None = None) -> PlainMap:
        """Return the map, completed with lengths and unit that the file does not give."""
        self.physical_sizes = self.physical_sizes or physical_sizes
        self.unit = self.unit or unit
        return self

    def heights(self) -> FloatArray:
        """Return the heights."""
        return self.array


class PlainReader:
    """A file with one map, with the interface of the readers of SurfaceTopography."""

    def __init__(self, kind: str, channel: PlainMap) -> None:
        self._kind = kind
        self.channels = [channel]
        self.default_channel = channel

    def format(self) -> str:
        """Return the name of the format."""
        return self._kind

    def __enter__(self) -> PlainReader:
        return self

    def __exit__(self, *_: object) -> None:
        return None


def own_map(path: Path) -> PlainReader | None:
    """Return the road of a result or of a file with the dataset ``surface/height``.

    For any other file, None is returned. In contrast to SurfaceTopography's HDF5 files, the
    datasets of this package have the shape (ny, nx).
    """
    import h5py

    if path.stat().st_size < 8 or not h5py.is_hdf5(path):
        return None
    try:
        file = h5py.File(path, "r", locking=False)
    except OSError as error:
        raise OSError(f"{path}: cannot be read as HDF5: {error}") from None
    with file:
        height, grid = file.get("surface/height"), file.get("grid")
        if not isinstance(height, h5py.Dataset) or height.ndim != 2:
            return None
        array = np.asarray(height[()], dtype=float).T
        if grid is None or not {"lx", "ly"} <= set(grid.attrs):
            # A bare dataset, as `&surface file` takes it: heights in metres, unless its attribute
            # `units` says otherwise; lengths unknown.
            unit = unit_of_dataset(height) or "m"
            if array.shape[1] == 1:
                array = array[:, 0]
            return PlainReader("asperity", PlainMap(array, "surface/height", None, unit))
        unit = unit_of_dataset(height) or "m"
        if unit not in _METRES:
            raise ValueError(f"{path}: surface/height has the unit {unit!r}: must be one of"
                             f" {', '.join(_METRES)}, beside lengths in m")
        array *= _METRES[unit]
        lx, ly = (float(np.ravel(grid.attrs[name])[0]) for name in ("lx", "ly"))
        boundary = np.ravel(grid.attrs.get("boundary", "free"))[0]
        boundary = boundary.decode() if isinstance(boundary, bytes) else str(boundary)
        info = {name: str(value) for name, value in file.attrs.items()
                if name in ("title", "program", "created") or name.startswith(("source", "steps"))}
    periodic = boundary.strip() == "periodic"
    if array.shape[1] == 1:
        return PlainReader("asperity", PlainMap(array[:, 0], "surface/height", (lx,), "m",
                                                periodic, info))
    return PlainReader("asperity", PlainMap(array, "surface/height", (lx, ly), "m", periodic, info))


def unit_of_dataset(dataset: Any) -> str | None:
    """Return the attribute `units` of a dataset of HDF5, or None if there is none."""
    value = dataset.attrs.get("units", "")
    text = value.decode(errors="replace") if isinstance(value, bytes) else str(value)
    unit = re.sub("[\u00b5\u03bc]", "u", text.strip())
    return None if unit in ("", "1") else unit


def text_map(path: Path, kind: str = "text") -> PlainReader:
    """Return the map of a text file: a matrix of heights, or columns x, z or x, y, z.

    A column of x, y, z that counts the points is left out, if the other two are a line scan.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Name of its format.

    Raises
    ------
    ValueError
        If the file is not such a table, or the points are not on a regular grid.
    """
    table, head = text_table(path)
    columns = table.shape[1]
    if columns > 3:
        return PlainReader(kind, PlainMap(table.T.copy(), "Default"))
    if columns == 1:
        return PlainReader(kind, PlainMap(table[:, 0], "Default"))
    head = head or heads_of_comment(path, columns)
    if len(head) == columns:
        order = _order(head)
        table, head = table[:, order], [head[i] for i in order]
    units = _units(head) or _units_of_comments(path, columns)
    unit = None
    if len(units) == columns:
        table[:, :-1] *= [_METRES[one] / _METRES[units[-1]] for one in units[:-1]]
        unit = units[-1]
    if columns == 3 and len(table) > 1 and _is_a_count(table):
        table = table[:, 1:]
    return PlainReader(kind, _on_grid(path, table, unit))


def text_table(path: Path) -> tuple[FloatArray, list[str]]:
    """Return the numbers of a text file, NaN where missing, and the heading of the columns.

    Raises
    ------
    ValueError
        If the file holds no table, or a word that is no number and no mark of a missing value, or
        lines of different lengths. The message contains the line. A line above the table may be a
        heading, but not a line of numbers with a typing error.
    """
    lines = text_lines(path)
    quoted = has_quoted_cells(lines)
    doubtful = doubtful_number(lines) if quoted else ""
    if doubtful:
        raise ValueError(f"{path}: {doubtful} may be a decimal number or one with a comma between"
                         " thousands: write the numbers with decimal points and without other"
                         " commas")
    rows = decimals(cells_of(lines), 1) if quoted else decimals(cells_of(lines))
    first = next((i for i, (_, cells) in enumerate(rows)
                  if any(map(is_number, cells)) and all(map(is_value, cells))), None)
    if first is None:
        raise ValueError(f"{path}: holds no table of numbers")
    body = rows[first:]
    for line, cells in rows[:first]:
        refuse_garbled(path, line, cells, len(body[0][1]))
    while all(len(cells) > 1 and cells[-1] == "" for _, cells in body):
        body = [(line, cells[:-1]) for line, cells in body]  # all lines end with a separator
    return _numbers(path, body), _heading(rows[:first])


def _heading(above: Rows) -> list[str]:
    """Return the heading of a table from the lines above it. It may have a second line of units.

    Examples
    --------
    >>> _heading([(1, ["x", "z"]), (2, ["mm", "um"])])
    ['x (mm)', 'z (um)']
    """
    if not above:
        return []
    last = above[-1][1]
    units = [re.fullmatch(r"[\[(]?\s*([mnuµμ]?m)\s*[\])]?", cell) for cell in last]
    if len(above) < 2 or len(above[-2][1]) != len(last) or not all(units):
        return last
    return [f"{name} ({unit[1]})" for name, unit in zip(above[-2][1], units, strict=True) if unit]


def refuse_garbled(path: Path, line: int, cells: list[str], width: int) -> None:
    """Refuse a line above a table that is no heading, but a line of numbers with a typing error.

    Parameters
    ----------
    path : Path
        The file, for messages.
    line : int
        Number of the line.
    cells : list of str
        Its cells, with decimal points.
    width : int
        Number of columns of the table.

    Raises
    ------
    ValueError
        If the line has as many columns as the table, at least half of them are numbers, and another
        begins like a number; or if three quarters are numbers, and another has a digit. (The first
        cell may be the name of a row.) The message contains the line and this word.
    """
    words = [cell for cell in cells if not is_value(cell)]
    later = [cell for cell in cells[1:] if not is_value(cell)]
    if len(cells) == width and (
            (2 * len(words) <= width and any(re.match(r"[-+]?[.,]?\d", word) for word in words))
            or (4 * len(words) <= width and any(re.search(r"\d", word) for word in later))):
        row_of_numbers(path, line, cells, width, line)


def _is_a_count(table: FloatArray) -> bool:
    """Return whether the first of three columns counts the points of a line scan."""
    return bool(np.all(np.diff(table[:, 0]) == 1.0) and np.all(np.diff(table[:, 1]) != 0.0))


def _units_of_comments(path: Path, columns: int) -> list[str]:
    """Return the units of the columns that Gwyddion writes into comments, or an empty list."""
    text = text_of(path)
    found = [re.search(rf"(?m)^#\s*{name} units:\s*(\S+)", text) for name in ("Lateral", "Value")]
    units = [re.sub("[µμ]", "u", one[1]) for one in found if one]
    if len(units) != 2 or not set(units) <= set(_METRES):
        return []
    return units[:1] * (columns - 1) + units[1:]


def _order(head: list[str]) -> list[int]:
    """Return the columns of x, y and z, if the heading names them; otherwise those of the file.

    Examples
    --------
    >>> _order(["z (um)", "x (mm)", "y (mm)"]), _order(["a", "b", "c"])
    ([1, 2, 0], [0, 1, 2])
    """
    names = [re.match(r"([xyz])(?![a-z])", cell.strip().lower()) for cell in head]
    found = [name[1] if name else "" for name in names]
    wanted = ["x", "y", "z"] if len(head) == 3 else ["x", "z"]
    return [found.index(name) for name in wanted if sorted(found) == wanted] or [*range(len(head))]


def _units(head: list[str]) -> list[str]:
    """Return the units that a header names in parentheses, in brackets or behind a slash or `_`.

    Examples
    --------
    >>> _units(["x (mm)", "y [mm]", "z / µm"]), _units(["x", "y", "z"])
    (['mm', 'mm', 'um'], [])
    """
    found = [re.search(r"(?:[\[(]\s*|/\s*|_)([mnuµμ]?m)\s*[\])]?\s*$", cell) for cell in head]
    units = [re.sub("[µμ]", "u", one[1]) for one in found if one]
    return [unit for unit in units if unit in _METRES]


def is_value(cell: str) -> bool:
    """Return whether a cell is a number or a mark of a missing value."""
    return is_missing(cell) or is_number(cell)


def _numbers(path: Path, rows: Rows) -> FloatArray:
    """Return a table as an array, NaN where a value is missing."""
    width = len(rows[0][1])
    values = np.full((len(rows), width), np.nan)
    for row, (line, cells) in enumerate(rows):
        values[row] = row_of_numbers(path, line, cells, width, rows[0][0])
    return values


def row_of_numbers(path: Path, line: int, cells: list[str], width: int, first: int
                   ) -> list[float]:
    """Return the numbers of a line of a table, NaN where a value is missing.

    Parameters
    ----------
    path : Path
        The file, for messages.
    line : int
        Number of the line.
    cells : list of str
        Its cells, with decimal points.
    width : int
        Number of columns of the table.
    first : int
        Number of the first line of the table.

    Raises
    ------
    ValueError
        If the line has another number of columns, or a cell is neither a number nor a mark of a
        missing value.
    """
    if len(cells) != width:
        raise ValueError(f"{path}: line {line}: has {counted(len(cells), 'column')}, must have"
                         f" {width} as line {first}")
    values = []
    for column, cell in enumerate(cells):
        try:
            values.append(float(cell))
        except ValueError:
            if not is_missing(cell):
                raise ValueError(f"{path}: line {line}: column {column + 1} = {cell!r}: must be a"
                                 " number") from None
            values.append(math.nan)
    return values


def _on_grid(path: Path, table: FloatArray, unit: str | None) -> PlainMap:
    """Return the map of points that are given by their coordinates."""
    known = np.isfinite(table[:, :-1]).all(axis=1)
    points, heights = table[known, :-1], table[known, -1]
    places, counts, sizes = [], [], []
    for axis, name in enumerate("xy"[: points.shape[1]]):
        index, step = _steps(points[:, axis])
        if index is None:
            raise ValueError(f"{path}: has no point with {name}" if not len(points) else
                             f"{path}: {_UNEVEN}" if points.shape[1] == 1 else
                             f"{path}: the points {_NO_GRID}")
        places.append(index)
        counts.append(int(index.max()) + 1)
        sizes.append(counts[-1] * step)
    cells = float(np.prod(counts))
    if cells > _SPARSE * max(len(heights), 50):
        raise ValueError(f"{path}: the points {_NO_GRID}")
    array = np.full(counts, np.nan)
    at = tuple(places)
    taken = np.zeros(counts, dtype=int)
    np.add.at(taken, at, 1)
    if taken.max() > 1:
        twice = int((taken > 1).sum())
        raise ValueError(f"{path}: {twice} point{'s' if twice > 1 else ''} of the grid"
                         f" {'are' if twice > 1 else 'is'} given more than once")
    array[at] = heights
    return PlainMap(array, "Default", tuple(sizes), unit)


def _steps(values: FloatArray) -> tuple[NDArray[np.intp] | None, float]:
    """Return the index of each value on an evenly spaced scale, and its step.

    The index is None if no such scale fits. Coordinates that are rounded to a few decimals may
    differ from the scale by about half of their last digit.

    Examples
    --------
    >>> _steps(np.array([0.0, 0.33, 0.67, 1.33]))[0].tolist()
    [0, 1, 2, 4]
    >>> _steps(np.array([0.0, 0.2, 0.5, 0.8, 1.0]))[0].tolist()
    [0, 1, 2, 3, 4]
    """
    if not len(values):
        return None, 0.0
    distinct, which = np.unique(values, return_inverse=True)
    gaps = np.diff(distinct)
    wide = gaps[gaps > 1e-6 * np.ptp(values)]
    if not len(wide):
        return None, 0.0
    # Where points are missing, a gap is a multiple of the step. Coordinates in files are rounded,
    # so that the whole span determines the step more accurately than the gaps.
    step = float(np.mean(wide[wide < 1.6 * np.quantile(wide, 0.1)]))
    for _ in range(3):
        number = np.concatenate([[0.0], np.cumsum(np.rint(gaps / step))])
        centred = number - number.mean()
        step = float(np.sum(centred * (distinct - distinct[0])) / max(np.sum(centred**2), 1.0))
    if np.mean(np.rint(wide / step) == 1.0) < _NEIGHBOURS:
        return None, 0.0
    off = distinct - number * step
    most = max(_OFF_GRID * step, min(_ROUNDING * _last_digit(distinct), _OFF_ROUNDED * step))
    if np.ptp(off) > 2.0 * most:
        return None, 0.0
    return number.astype(np.intp)[which], step


def _last_digit(values: FloatArray) -> float:
    """Return the value of the last decimal digit that some numbers have, or 0 if they have many.

    Examples
    --------
    >>> _last_digit(np.array([0.0, 0.25, 1.5])), _last_digit(np.array([1.0 / 3.0]))
    (0.01, 0.0)
    """
    largest = math.ceil(math.log10(np.abs(values).max()))
    for power in range(largest, largest - _DIGITS, -1):
        digits = values / 10.0**power
        if np.abs(digits - np.rint(digits)).max() < 1e-4:
            return 10.0**power
    return 0.0
