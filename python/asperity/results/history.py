"""The grid of a run, and its history, which has one row per solve."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.names import NamedValues, counted
from ..base.optional import needed
from ..base.presenters import present
from .column_types import HistoryColumns

if TYPE_CHECKING:
    import pandas

__all__ = ["Grid", "History"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """The regular grid of cells.

    Attributes
    ----------
    nx, ny : int
        Number of cells; ``ny == 1`` is a plane-strain line contact.
    lx, ly : float
        Lengths of the grid, m.
    boundary : str
        'periodic' or 'free'.
    x, y : ndarray
        Centres of the cells, m; shapes (nx,) and (ny,).
    """

    nx: int
    ny: int
    lx: float
    ly: float
    boundary: str
    x: FloatArray = field(repr=False, compare=False)
    y: FloatArray = field(repr=False, compare=False)

    @property
    def dx(self) -> float:
        """Width of a cell along x, m."""
        return self.lx / self.nx

    @property
    def dy(self) -> float:
        """Width of a cell along y, m."""
        return self.ly / self.ny


class History(NamedValues, HistoryColumns):
    """The history of a run: a mapping from names to NumPy arrays with one value per row.

    Row 0 is the state after the first jump, or the unloaded state if the run begins with a ramp;
    every later jump or step adds a row. If the run is still writing, only the rows that are
    complete in all columns are included. This version writes the columns of `HistoryColumns`; older
    files may have fewer.
    """

    def __init__(self, columns: dict[str, NDArray[Any]], units: dict[str, str],
                 long_names: dict[str, str]) -> None:
        rows = min((len(column) for column in columns.values()), default=0)
        super().__init__({name: column[:rows] for name, column in columns.items()},
                         "column of the history")
        self._units = units
        self._long_names = long_names

    @property
    def rows(self) -> int:
        """Number of rows."""
        return min((len(column) for column in self._values.values()), default=0)

    def units(self, name: str) -> str:
        """Return the units of a column.

        Parameters
        ----------
        name : str
            Name of the column.

        Returns
        -------
        str
            The units, such as 'Pa', or '1' for a pure number.

        Raises
        ------
        KeyError
            If there is no such column.
        """
        self[name]
        return self._units.get(name, "1")

    def long_name(self, name: str) -> str:
        """Return the meaning of a column.

        Parameters
        ----------
        name : str
            Name of the column.

        Returns
        -------
        str
            The meaning in words.

        Raises
        ------
        KeyError
            If there is no such column.
        """
        self[name]
        return self._long_names.get(name, name.replace("_", " "))

    def to_pandas(self) -> pandas.DataFrame:
        """Return the history as a table of pandas, which must be installed.

        Returns
        -------
        pandas.DataFrame
            One column per quantity, one line per row of the history, in SI units.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        pandas = needed("pandas", "to_pandas")
        return pandas.DataFrame(self._values)

    def _repr_html_(self) -> str:
        return present("history_html", self)

    def __repr__(self) -> str:
        lines = [f"history of {counted(self.rows, 'row')}"]
        for name, column in self._values.items():
            last = f"{column[-1]:.6g}" if self.rows else "-"
            units = self._units.get(name, "1")
            lines.append(f"  {name:<22} {last:>13} {'' if units == '1' else units:<4}"
                         f" {self._long_names.get(name, '')}".rstrip())
        if self.rows:
            lines[0] += "; the last values:"
        return "\n".join(lines)
