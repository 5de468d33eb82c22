"""Text tables from instruments and spreadsheets: encodings, separators and decimal signs."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from pathlib import Path

__all__ = ["Rows", "cells_of", "decimals", "doubtful_number", "has_quoted_cells",
           "heads_of_comment", "is_comment", "is_missing", "is_number", "text_lines", "text_of"]

Rows = list[tuple[int, list[str]]]

_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:,\d{3})+(?:\.\d*)?(?:[eE][-+]?\d+)?")
_PLAIN_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
_SMALL = re.compile(r"[-+]?\d{1,3}")
_THOUSANDS_BY_POINT = re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+,\d+(?:[eE][-+]?\d+)?")
_POINT = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_MANY = 100             # commas that show by their number that they separate thousands

#: Errors of a spreadsheet in English and German; the sign # does not make a line of them a comment.
_ERRORS = re.compile(r"#(?:n/?a|nv|null!|num!|zahl!|div/0!|value!|wert!|ref!|bezug!)", re.I)
#: Marks of missing values by instruments, spreadsheets and programs.
_MISSING = re.compile(r"-+|\*+|x|bad|n/?a|n\.a\.|null|none|invalid|undefined|infinite|[-+]?inf"
                      r"|ovld?|overflow|overload|[-+]?nan(?:\(\w*\))?|[-+]?\d\.#\w+", re.I)


def text_lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines of a text file with their line numbers, from 1.

    Empty lines and comments, which start with ``#``, are left out. The encoding may be UTF-8,
    UTF-16 with a byte order mark, or Latin-1.

    Raises
    ------
    OSError
        If the file is missing or is a folder.
    ValueError
        If it is not a text file, or has no lines left.
    """
    text = text_of(path)
    kept = [(at, line) for at, line in enumerate(text.splitlines(), 1)
            if line.strip() and not is_comment(line)]
    if not kept:
        raise ValueError(f"{path}: {'holds only comments' if text.strip() else 'is empty'}")
    return kept


def text_of(path: Path) -> str:
    """Return a text file as a string, without a byte order mark.

    Raises
    ------
    OSError
        If the file is missing or is a folder.
    ValueError
        If it is not a text file.
    """
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such file")
    if path.is_dir():
        raise OSError(f"{path}: is a folder, not a file")
    data = path.read_bytes()
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise ValueError(f"{path}: is not a text file")
    return text


def is_comment(line: str) -> bool:
    """Return whether a line is a comment. Errors of a spreadsheet start with ``#``, too.

    Examples
    --------
    >>> is_comment("# Width: 10 um"), is_comment("#N/A 2 3")
    (True, False)
    """
    start = line.lstrip()
    return start.startswith("#") and not _ERRORS.match(start)


def is_missing(cell: str) -> bool:
    """Return whether a cell marks a missing value.

    Examples
    --------
    >>> [is_missing(cell) for cell in ("", "***", "#N/A", "-1.#IND", "-nan(ind)", "0", "1o")]
    [True, True, True, True, True, False, False]
    """
    return not cell or bool(_MISSING.fullmatch(cell) or _ERRORS.fullmatch(cell))


def cells_of(lines: Sequence[tuple[int, str]]) -> Rows:
    """Return the cells of each line. The last line with a number decides on the separator."""
    separator = _separator([line for _, line in lines])
    rows = []
    for at, line in lines:
        cells = line.split() if separator is None else next(
            csv.reader(io.StringIO(line), delimiter=separator, skipinitialspace=True))
        rows.append((at, [cell.strip() for cell in cells]))
    return rows


def _separator(lines: Sequence[str]) -> str | None:
    """Return the separator of columns; None for blanks."""
    # A header may contain commas in its text, and a table may end with a line of text.
    last = next((line for line in reversed(lines) if re.match(r"\W*\d", line)), lines[-1])
    cells = last.split()
    if len(cells) > 1 and ";" not in last and "\t" not in last and all(
            re.fullmatch(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?", cell) for cell in cells):
        return None  # decimal commas
    for separator in ("\t", ";", ","):
        if separator in last:
            return separator
    return "," if len(lines) == 1 and "," in lines[0] else None


def heads_of_comment(path: Path, columns: int) -> list[str]:
    """Return the headings in the last comment above the numbers; none if they do not fit.

    Parameters
    ----------
    path : Path
        The file.
    columns : int
        Number of columns of the table.

    Returns
    -------
    list of str
        One heading per column, or an empty list.
    """
    above: list[str] = []
    for line in path.read_text(encoding="utf-8-sig", errors="replace").splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            break
        if line.strip(" \t#"):
            above = [line.strip(" \t#")]
    for separator in (";", "\t", ",", r"\s{2,}", r"\s+(?![\[(])"):
        for line in above:
            cells = [cell.strip() for cell in re.split(separator, line)]
            if len(cells) == columns:
                return cells
    return []


def is_number(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma.

    Examples
    --------
    >>> is_number("1.5e3"), is_number("1,5"), is_number("12.3.2026"), is_number("")
    (True, True, False, False)
    """
    try:
        float(cell)
    except ValueError:
        return bool(_COMMA.fullmatch(cell) or _THOUSANDS.fullmatch(cell))
    return True


def decimals(rows: Rows, least: int = _MANY) -> Rows:
    """Return the cells with decimal points, and without separators of thousands.

    A comma is the decimal sign, unless other cells have decimal points, or all of at least `least`
    commas stand before three digits and the same column has whole numbers below 1000: then it
    separates thousands. (Where decimal numbers lose their last zeros, some of many have fewer than
    three decimals.)

    Examples
    --------
    >>> decimals([(1, ["0,5", "943,120"])])
    [(1, ['0.5', '943.120'])]
    >>> decimals([(1, ["0.5", "943,120"])])
    [(1, ['0.5', '943120'])]
    >>> decimals([(1, ["0,5", "1.943,5"])])
    [(1, ['0.5', '1943.5'])]
    >>> decimals([(1, ["943,120"]), (2, ["87"])], least=1)
    [(1, ['943120']), (2, ['87'])]
    """
    points = _has_thousands(rows, least) or any(
        _POINT.fullmatch(cell) or (_THOUSANDS.fullmatch(cell) and "." in cell)
        for _, cells in rows for cell in cells)

    def plain(cell: str) -> str:
        if "," not in cell:
            return cell
        if points:
            if _THOUSANDS_BY_POINT.fullmatch(cell) or not _THOUSANDS.fullmatch(cell):
                return cell
            return cell.replace(",", "")
        if _THOUSANDS_BY_POINT.fullmatch(cell):
            return cell.replace(".", "").replace(",", ".")
        return cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell

    return [(at, [plain(cell) for cell in cells]) for at, cells in rows]


def _has_thousands(rows: Rows, least: int) -> bool:
    """Return whether all commas separate thousands, because of whole numbers below 1000 there."""
    if not any("," in cell for _, cells in rows for cell in cells):
        return False
    numbers = [(column, cell) for _, cells in rows for column, cell in enumerate(cells)
               if is_number(cell)]
    with_comma = [(column, cell) for column, cell in numbers if "," in cell]
    columns = {column for column, _ in with_comma}
    return (len(with_comma) >= least
            and all(_PLAIN_THOUSANDS.fullmatch(cell) for _, cell in with_comma)
            and any(_SMALL.fullmatch(cell) for column, cell in numbers if column in columns))


def has_quoted_cells(lines: Sequence[tuple[int, str]]) -> bool:
    r"""Return whether cells stand in quotation marks between commas, as in English spreadsheets.

    Examples
    --------
    >>> has_quoted_cells([(1, '"12,975","19"')]), has_quoted_cells([(1, '"12,975";"19"')])
    (True, False)
    """
    return any(re.search(r'"\s*,\s*"', line) for _, line in lines)


def doubtful_number(lines: Sequence[tuple[int, str]]) -> str:
    """Return a number of which the comma may be the decimal sign or separate thousands.

    Parameters
    ----------
    lines : sequence of (int, str)
        The lines of a table, with their numbers in the file. Its cells stand in quotation marks
        between commas (`has_quoted_cells`).

    Returns
    -------
    str
        The number, or an empty string if there is no doubt. Doubtful are tables in which all commas
        in cells stand before three digits, and no cell is a whole number below 1000.

    Examples
    --------
    >>> doubtful_number([(1, '"12,975","19,845"')]), doubtful_number([(1, '"12,975","0,845"')])
    ('12,975', '')
    """
    rows = cells_of(lines)
    numbers = [cell for _, cells in rows for cell in cells if is_number(cell)]
    with_comma = [cell for cell in numbers if "," in cell]
    clear = (_has_thousands(rows, 1) or any("." in cell for cell in numbers)
             or not all(_PLAIN_THOUSANDS.fullmatch(cell) for cell in with_comma))
    return "" if clear or not with_comma else with_comma[0]
