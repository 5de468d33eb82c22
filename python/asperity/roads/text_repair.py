"""Repair of text matrices of which SurfaceTopography would silently leave lines out.

Its reader of the format `asc` takes every line that is not all numbers for a part of a header. A
line with a mark of a missing value that the reader does not know would therefore be lost, and so
would the first line behind a byte order mark. The repaired text has `nan` at missing values. Its
header is unchanged, so that lengths, units and channels are read from it as before.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from ..base.tables import decimals, is_comment, is_number, text_of
from .map_files import is_value, refuse_garbled, row_of_numbers

__all__ = ["repaired_matrix", "with_height"]

_KNOWN = {"bad", "nan", "inf", "infinite"}  # marks of missing values that the reader knows
_SETTING = re.compile(r"\s*[^\W\d][^:=\uff1a]*[:=\uff1a]")  # a line of a header, as "Unit: um"


class _Line(NamedTuple):
    """A line with numbers: its index, from 0, and its cells."""

    at: int
    cells: list[str]


def repaired_matrix(path: Path, channels: int) -> str | None:
    """Return the text of a file of the format `asc` so that no line of its matrix is lost.

    Parameters
    ----------
    path : Path
        The file.
    channels : int
        Number of channels that SurfaceTopography has found in it.

    Returns
    -------
    str or None
        The repaired text, or None if the reader reads every line, or none.

    Raises
    ------
    ValueError
        If a line can be neither a part of the matrix nor of a header. The message contains the line
        and the word.
    """
    text = text_of(path)
    if text.startswith("Wyko ASCII"):  # its blocks have headers of their own kind between them
        return None
    lines = text.splitlines()
    first, last, some = _Line(0, []), 0, False
    above: list[_Line] = []
    unread: list[_Line] = []
    settings: list[int] = []
    for at, line in enumerate(lines):
        cells = line.split()
        if not cells or is_comment(line):
            continue
        if not first.cells:
            if not (any(map(is_number, cells)) and all(map(is_value, cells))):
                above.append(_Line(at, cells))
                continue
            first = _Line(at, cells)
        if _is_read(cells):
            last, some = at, True
        elif _SETTING.match(line):
            settings.append(at)
        else:
            unread.append(_Line(at, cells))
            last = at
    for at, cells in above:
        refuse_garbled(path, at + 1, decimals([(at + 1, cells)])[0][1], len(first.cells))
    if not some:
        return None
    if channels < 2:  # a header between two maps would join them, one behind a map is harmless
        unread += [_Line(at, lines[at].split()) for at in settings if at < last]
    if not unread:
        return text if path.read_bytes().startswith(b"\xef\xbb\xbf") else None
    _repair(path, lines, first, sorted(unread))
    return "\n".join(lines) + "\n"


def _is_read(cells: list[str]) -> bool:
    """Return whether SurfaceTopography reads a line as numbers."""
    try:
        for cell in cells:
            float(cell)
    except ValueError:
        return all(cell.lower() in _KNOWN or (is_number(cell) and "," not in cell)
                   for cell in cells)
    return True


def _repair(path: Path, lines: list[str], first: _Line, unread: list[_Line]) -> None:
    """Replace lines that are not read by lines of numbers."""
    # Whether a comma is a decimal sign depends on whether other cells have a decimal point.
    pointed = next((line for line in lines[first.at :] if "." in line and not is_comment(line)), "")
    rows = decimals([(0, pointed.split()), *((line.at + 1, line.cells) for line in unread)])[1:]
    for number, cells in rows:
        values = row_of_numbers(path, number, cells, len(first.cells), first.at + 1)
        lines[number - 1] = " ".join(map(repr, values))


def with_height(text: str, height: float) -> str:
    """Return the text of a matrix with a header that gives its length along y.

    Parameters
    ----------
    text : str
        Text whose header gives only the length along x.
    height : float
        Length along y, in the same unit.
    """
    return f"# Height: {height!r}\n{text}"
