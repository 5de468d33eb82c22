"""The table of a sweep: one row per case, one column per parameter and per result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.names import OpenValues, counted
from ..base.optional import needed
from ..base.presenters import present
from ..results import Run, open_result

if TYPE_CHECKING:
    import pandas

__all__ = ["Failure", "Sweep", "SweepError", "column"]

_UNIT_SIGNS = {"C": "°C"}
_ROWS, _CELL = 30, 26   # largest numbers of rows and of characters per cell that are displayed


class SweepError(RuntimeError):
    """Some cases of a sweep failed; the others are complete.

    Attributes
    ----------
    result : Sweep
        The table. `Sweep.failed` lists the failed cases.
    """

    def __init__(self, message: str, result: Sweep) -> None:
        super().__init__(message)
        self.result = result


@dataclass(frozen=True)
class Failure:
    """A case that failed: its row in the table, its parameters, the message and the exit status."""

    index: int
    parameters: dict[str, Any]
    message: str
    status: int | None

    def __str__(self) -> str:
        values = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        return f"{values}: {self.message}"


class Sweep(OpenValues):
    """The table of a sweep, with one row per case and one column per parameter or result.

    ``table["friction"]`` and ``table.friction`` are the same NumPy array. A failed case has NaN, or
    None in a column that does not contain numbers.

    Attributes
    ----------
    parameters : tuple of str
        Names of the columns with parameters.
    results : tuple of str
        Names of the columns with results.
    shape : tuple of int
        Numbers of values: ``table["friction"].reshape(table.shape)`` has one axis per parameter.
    paths : list of Path
        The result files.
    runs : sequence of Run
        The results, which are opened on access. Those of failed cases end where the run ended.
    failed : list of Failure
        The cases that failed.
    """

    def __init__(self, columns: dict[str, NDArray[Any]], parameters: Sequence[str],
                 shape: tuple[int, ...], paths: list[Path], failed: list[Failure],
                 units: Mapping[str, str] | None = None) -> None:
        super().__init__(columns, "column of the sweep")
        self._units = dict(units or {})
        self.parameters = tuple(parameters)
        self.results = tuple(name for name in columns if name not in self.parameters)
        self.shape = shape
        self.paths = paths
        self.runs = _Runs(paths)
        self.failed = failed

    @property
    def rows(self) -> int:
        """Number of cases."""
        return len(self.paths)

    def units(self, name: str) -> str:
        """Return the units of a column.

        Parameters
        ----------
        name : str
            Name of the column.

        Returns
        -------
        str
            The units, such as 'm/s'; '1' for a pure number, and '' if they are not known, as for a
            result of your own function, or if the column does not contain numbers.

        Raises
        ------
        KeyError
            If there is no such column.
        """
        self[name]
        return self._units.get(name, "")

    def row(self, index: int) -> dict[str, Any]:
        """Return the parameters and results of one case.

        Parameters
        ----------
        index : int
            Number of the case, from 0; negative numbers count from the end.

        Returns
        -------
        dict
            Values by the names of the columns.

        Raises
        ------
        IndexError
            If there are fewer cases than that.
        """
        return {name: column[index] for name, column in self._values.items()}

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table as a data frame of pandas, which must be installed.

        Returns
        -------
        pandas.DataFrame
            One line per case.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        pandas = needed("pandas", "to_pandas")
        return pandas.DataFrame({name: list(column) if column.ndim > 1 else column
                                 for name, column in self._values.items()})

    def _cells(self) -> tuple[str, list[list[str]], str]:
        """Return a heading, the cells of a short table, and a remark on what it leaves out."""
        shown = [*self.parameters, *(name for name in ("contact_area", "friction", "mean_gap")
                                     if name in self.results)]
        if len(shown) == len(self.parameters):
            shown += self.results[:3]
        cells = [[_short(self._values[name][row]) for name in shown]
                 for row in range(min(self.rows, _ROWS))]
        head = f"sweep of {counted(self.rows, 'case')}"
        if self.failed:
            head += f", {len(self.failed)} failed"
        more = [f"{number} more {what}" for number, what in
                ((self.rows - len(cells), "rows"), (len(self._values) - len(shown), "columns"))
                if number > 0]
        return head, [shown, *cells], f"and {' and '.join(more)}" if more else ""

    def __repr__(self) -> str:
        head, cells, more = self._cells()
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
                 for row in cells]
        return "\n".join([head, *lines] + [more] * bool(more))

    def _repr_html_(self) -> str:
        head, (names, *rows), more = self._cells()
        units = [self._units.get(name, "") for name in names]
        heads = (escape(name) + (f"<br>({escape(unit)})" if unit not in ("", "1") else "")
                 for name, unit in zip(names, map(_UNIT_SIGNS.get, units, units), strict=True))
        caption = f"{head} ({more})" if more else head
        return present("table_html", tuple(heads),
                       [tuple(map(escape, row)) for row in rows], caption)


class _Runs(Sequence[Run]):
    """The results of a sweep, each of which is opened on access."""

    def __init__(self, paths: list[Path]) -> None:
        self._paths = paths

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [open_result(path) for path in self._paths[index]]
        return open_result(self._paths[index])

    def __len__(self) -> int:
        return len(self._paths)

    def __repr__(self) -> str:
        return f"{len(self)} results in {self._paths[0].parent if self._paths else '.'}"


def _short(value: Any) -> str:
    """Return a value as a short text for a table.

    Examples
    --------
    >>> _short(0.123456789), _short([1] * 50)
    ('0.123457', '[1, 1, 1, 1, 1, 1, 1, 1...')
    """
    text = f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
    return text if len(text) <= _CELL else f"{text[:_CELL - 3]}..."


def column(values: list[Any]) -> NDArray[Any]:
    """Return the values of a column as an array.

    Parameters
    ----------
    values : list
        One value per case; None for a case that failed.

    Returns
    -------
    ndarray
        Among numbers None becomes NaN. Values of different shapes become an array of objects.

    Examples
    --------
    >>> column([1.0, None]), column(["a", None]), column([[1, 2], [3]]).shape
    (array([ 1., nan]), array(['a', None], dtype=object), (2,))
    """
    filled = [value for value in values if value is not None]
    if all(np.ndim(value) == 0 and not isinstance(value, str) for value in filled):
        if len(filled) < len(values):
            values = [np.nan if value is None else value for value in values]
        array = np.array(values)
        if array.dtype != object:
            return array
    elif len(filled) == len(values) and len({np.shape(value) for value in values}) == 1 \
            and not isinstance(values[0], str):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column
