"""One row of the history as an object, with the columns of the Fortran library."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..base import library
from ..base.names import NamedValues
from ..results.column_types import RowColumns
from . import namelists

__all__ = ["Column", "Field", "Row", "columns", "fields"]

_columns = library.bare("row_columns")
_fields = library.bare("snapshot_columns")


class Column(NamedTuple):
    """Description of a column of the history."""

    name: str
    units: str
    is_whole: bool
    long_name: str


class Field(NamedTuple):
    """What a field of a snapshot holds."""

    name: str
    units: str
    is_frictional: bool
    long_name: str


def _entries(write: Callable[[NDArray[np.intc]], int]) -> list[tuple[str, str, bool, str]]:
    """Return the lines of a table of the library: name, units, a truth, and the meaning."""
    text = namelists.text_from(lambda buffer: (write(buffer),))
    parts = (line.split(" ", 3) for line in text.splitlines())
    return [(name, units, truth == "1", long_name) for name, units, truth, long_name in parts]


@functools.cache
def columns() -> tuple[Column, ...]:
    """Return the columns of the history, in the order of the library."""
    return tuple(Column(*entry) for entry in _entries(_columns))


@functools.cache
def fields() -> tuple[Field, ...]:
    """Return the fields that a snapshot may contain, in the order of the library."""
    return tuple(Field(*entry) for entry in _entries(_fields))


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
