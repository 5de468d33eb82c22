"""Access to the input language of the Fortran library: its table, reading of namelists, checks."""

from __future__ import annotations

import functools
import numbers
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..base import library
from ..base.check import shown

__all__ = ["GroupEntry", "Variable", "check_text", "decode", "encode", "fault_of", "format_value",
           "is_text", "listed", "source", "table"]

_SEPARATOR = "\x1f"

_groups = library.bare("input_groups")
_listed = library.call("input_listed")
_check = library.call("input_check")


@dataclass(frozen=True)
class Variable:
    """A variable of the input: type, default, units, allowed values and meaning.

    If the default is in parentheses, there is none, or it is derived from other values. The kind is
    'integer', 'real', 'logical', 'text', 'word' (one of several strings), or a list: 'reals' or
    'words'.
    """

    group: str
    name: str
    kind: str
    default: str
    units: str
    allowed: str
    meaning: str

    @property
    def is_list(self) -> bool:
        """Whether the variable takes several values."""
        return self.kind in ("reals", "words")

    @property
    def is_required(self) -> bool:
        """Whether the variable must be given if it applies."""
        return self.default.startswith("(required")

    def __str__(self) -> str:
        units = f" {self.units}" if self.units else ""
        allowed = "" if self.allowed == "any" else f"; {self.allowed}"
        return (f"{self.group}.{self.name}: {self.kind}, default {self.default}{units}{allowed}\n"
                f"    {self.meaning}")


@dataclass(frozen=True)
class GroupEntry:
    """A group of the input, with its variables by name."""

    name: str
    is_required: bool
    is_repeatable: bool
    meaning: str
    variables: dict[str, Variable] = field(default_factory=dict)

    def __str__(self) -> str:
        notes = ["required"] * self.is_required + ["may be repeated"] * self.is_repeatable
        head = f"&{self.name}{' (' + ', '.join(notes) + ')' if notes else ''}: {self.meaning}"
        return "\n".join([head, *map(str, self.variables.values())])


def encode(text: str) -> bytes:
    """Return the bytes of a text."""
    return text.encode("utf-8", "surrogateescape")


def decode(data: bytes) -> str:
    """Return the text of bytes; bytes that are not UTF-8 are kept as surrogates."""
    return data.decode("utf-8", "surrogateescape")


def is_text(source: object) -> bool:
    """Return whether a string is the text of an input, and not a path.

    Examples
    --------
    >>> is_text("road.nml"), is_text("&grid nx = 8 /"), is_text(" ! a comment"), is_text("")
    (False, True, True, False)
    """
    return isinstance(source, str) and ("\n" in source or source.lstrip()[:1] in tuple("&$!"))


def require_case(case: Any) -> None:
    """Raise TypeError for what is neither a path, nor a text, nor a case."""
    if not (isinstance(case, str | os.PathLike) or hasattr(case, "path")):
        raise TypeError(f"case = {shown(case)}: must be a path, the text of an input or a Case")


def source(case: Any) -> tuple[str, str]:
    """Return the name of a case's file, and its text, which is empty if it must be read from there.

    A case is a path, the text of an input, or an object with a ``path`` and the text ``str(case)``.

    Raises
    ------
    FileNotFoundError
        If there is no file at a path.
    """
    require_case(case)
    if is_text(case):
        return "case.nml", str(case)
    if isinstance(case, str | os.PathLike):
        path = os.fspath(case)
        if not Path(path).exists():
            raise FileNotFoundError(f"{path}: there is no such file")
        return path, ""
    return os.fspath(case.path or "case.nml"), str(case) or "\n"


@functools.cache
def table() -> dict[str, GroupEntry]:
    """Return the groups of the input by name."""
    groups: dict[str, GroupEntry] = {}
    for line in text_from(lambda buffer: (_groups(buffer),)).splitlines():
        kind, *cells = line.split(_SEPARATOR)
        if kind == "group":
            name, required, repeatable, meaning = cells
            groups[name] = GroupEntry(name, required == "yes", repeatable == "yes", meaning)
        else:
            variable = Variable(*cells)
            groups[variable.group].variables[variable.name] = variable
    return groups


def listed(text: str, path: str | os.PathLike[str] = "") -> list[tuple[str, dict[str, Any]]]:
    """Return the groups of an input in their order, with the values that it gives.

    Names, types and ranges are checked, but not whether the values fit together.

    Parameters
    ----------
    text : str
        The text of the input.
    path : str or Path
        Name of the file, for messages.

    Returns
    -------
    list of (str, dict)
        Name and values of each group.

    Raises
    ------
    ValueError
        If the text is wrong. The message lists all faults.
    """
    found: list[tuple[str, dict[str, Any]]] = []
    listing = text_from(functools.partial(_listed, encode(text), os.fsencode(path)), len(text))
    for line in listing.split("\n")[:-1]:
        name, *items = line.split(_SEPARATOR)
        if name.startswith("&"):
            found.append((name[1:], {}))
            continue
        group, values = found[-1]
        variable = table()[group].variables[name]
        converted = [_value(variable.kind, item) for item in items]
        values[name] = converted if variable.is_list else converted[0]
    return found


def check_text(text: str, path: str | os.PathLike[str], files: bool) -> str:
    """Return the output of `asperity check` for a text.

    Parameters
    ----------
    text : str
        The text of the input.
    path : str or Path
        Name of the file, for messages and relative paths.
    files : bool
        Whether to check the height maps, too.

    Returns
    -------
    str
        The output of the command.

    Raises
    ------
    ValueError
        If the input is wrong. The message lists all faults.
    OSError
        If a height map cannot be read.
    """
    return text_from(functools.partial(_check, encode(text), os.fsencode(path), int(files)))


def _value(kind: str, item: str) -> Any:
    """Return a value of the library's listing as a Python value."""
    if kind == "integer":
        return int(item)
    if kind in ("real", "reals"):
        return float(item)
    return item == "T" if kind == "logical" else item


def text_from(routine: Any, size: int = 0) -> str:
    """Return the text that a routine writes into a buffer, which is enlarged if necessary."""
    most = max(30000, 30 * size)
    while True:
        buffer = np.empty(most, np.intc)
        (length,) = routine(buffer)
        if length <= most:
            return decode(buffer[:length].astype(np.uint8).tobytes())
        most = int(length)


def fault_of(error: ValueError) -> str:
    """Return the message of a fault without path and line number, which a text in memory lacks.

    Examples
    --------
    >>> fault_of(ValueError(": &phase: dt = 0: must be a positive number (line 2)"))
    '&phase: dt = 0: must be a positive number'
    """
    return "\n".join(re.sub(r" \(line \d+\)$", "", line.removeprefix(": "))
                     for line in str(error).split("\n"))


def format_value(value: object) -> str:
    """Return a value, or an array of values, in the syntax of namelists.

    Reals have as many digits as needed to read back the same bits. Quotes in strings are doubled.

    Raises
    ------
    ValueError
        If the value has no such form.

    Examples
    --------
    >>> format_value(True), format_value(0.1), format_value("Persson's"), format_value([1, 2.5])
    ('.true.', '0.1', "'Persson''s'", '1, 2.5')
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, str | Path):
        if {"\n", "\r"} & set(str(value)):
            raise ValueError(f"{shown(value)}: must be a text without line breaks")
        return "'" + str(value).replace("'", "''") + "'"
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real | np.longdouble):
        return repr(float(value))
    if isinstance(value, Iterable):
        items = list(value)
        if not any(isinstance(item, list | tuple | dict | np.ndarray) for item in items):
            return ", ".join(map(format_value, items))
    raise ValueError(f"{shown(value)}: must be a number, a logical, a string, or a list of them")
