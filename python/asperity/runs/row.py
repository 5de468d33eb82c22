"""One row of the history as an object, with the columns of the Fortran library."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import library
from ..base.names import NamedValues
from ..results.column_types import RowColumns

__all__ = ["Column", "Row", "columns"]

_columns = library.bare("row_columns")


class Column(NamedTuple):
    """Description of a column of the history."""

    name: str
    units: str
    is_whole: bool
    long_name: str


@functools.cache
def columns() -> tuple[Column, ...]:
    """Return the columns of the history, in the order of the library."""
    buffer = np.zeros(100000, dtype=np.intc)
    length = int(_columns(buffer))
    found = []
    for line in bytes(buffer[:length].astype(np.uint8)).decode().splitlines():
        name, units, is_whole, long_name = line.split(" ", 3)
        found.append(Column(name, units, is_whole == "1", long_name))
    return tuple(found)


class Row(NamedValues, RowColumns):
    """A row of the history, whose columns are items and attributes, in SI units.

    Examples
    --------
    >>> row = Row(range(len(columns())))
    >>> row.step, row["time"]
    (0, 2.0)
    """

    def __init__(self, values: NDArray[Any] | range) -> None:
        super().__init__({column.name: int(value) if column.is_whole else float(value)
                          for column, value in zip(columns(), values, strict=True)},
                         "column of the history")
