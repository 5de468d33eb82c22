"""Conversion of wide DMA tables, with columns for each temperature, to one row per point.

Two forms are known. Either each heading names its temperature, as in ``G' (MPa) at -20 °C``, or a
line above the header does, as in ``; -20 °C; ; 0 °C; ;``, where an empty cell repeats the cell
before it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from ..base.tables import Rows, is_number

__all__ = ["MISSING", "unfolded"]

_TEMPERATURE = re.compile(
    r"(?:@|\bat\b|\bbei\b|\bT\s*=)?\s*(?<![A-Za-z0-9.,])([-+\u2212]?\d+(?:[.,]\d+)?)\s*_?"
    r"(?:°\s*C|º\s*C|deg\s*C|°|C|K)(?![A-Za-z0-9])", re.IGNORECASE)
_LINES_ABOVE = 3        # number of lines above the header that may contain the temperatures

#: Words that instruments write instead of a missing value.
MISSING = {"", "-", "--", "---", "ovl", "ovld", "ovr", "over", "overload", "overflow", "n/a", "na",
           "n.a.", "#n/a", "#nv", "nan", "invalid", "*", "**", "***"}


class _Group(NamedTuple):
    """The columns of one temperature: indices of frequency, storage, and loss or loss factor."""

    temperature: str    # in C or K, as written
    frequency: int
    storage: int
    other: int


def unfolded(lines: Rows, role_of: Callable[[str], str | None]) -> Rows:
    """Return a wide table as a long one, and any other table unchanged.

    Parameters
    ----------
    lines : list of (int, list of str)
        Cells of each line with its number.
    role_of : callable
        Returns the role that a heading names, such as 'storage', or None.

    Returns
    -------
    list of (int, list of str)
        A header with a column of temperatures, and one row per frequency and temperature. Cells
        without a value are kept.
    """
    for at, (line, cells) in enumerate(lines):
        clean = [_TEMPERATURE.sub(" ", cell).strip() for cell in cells]
        roles = [role_of(cell) for cell in clean]
        if roles.count("storage") < 2 or "frequency" not in roles:
            continue
        named = [_temperature(cell) for cell in cells]
        if not _names_all(named, roles):
            named = _above(lines[max(0, at - _LINES_ABOVE) : at], len(cells))
        if not _names_all(named, roles):
            continue
        groups = _groups(roles, named)
        if len({group.temperature for group in groups}) < 2:
            continue
        return _long(line, clean, groups, lines[at + 1 :])
    return lines


def _temperature(cell: str) -> str | None:
    """Return the temperature that a cell names, such as '-20 C', or None.

    Examples
    --------
    >>> _temperature("G' (MPa) at -20 °C"), _temperature("G''_293.15K"), _temperature("f (Hz)")
    ('-20 C', '293.15 K', None)
    """
    found = _TEMPERATURE.search(cell)
    if found is None:
        return None
    unit = "K" if found[0].rstrip().upper().endswith("K") else "C"
    return f"{found[1].replace(chr(0x2212), '-').replace(',', '.')} {unit}"


def _names_all(named: list[str | None], roles: list[str | None]) -> bool:
    """Return whether every column of a modulus has a temperature."""
    return all(one is not None for one, role in zip(named, roles, strict=True)
               if role in ("storage", "loss", "tan_delta"))


def _above(lines: Rows, count: int) -> list[str | None]:
    """Return the temperature of each column from the nearest line above that names several."""
    for _, cells in reversed(lines):
        named = [_temperature(cell) or (f"{cell} C" if is_number(cell) else None) for cell in cells]
        if sum(one is not None for one in named) < 2:
            continue
        filled: list[str | None] = []
        for one in [*named, *[None] * count][:count]:
            filled.append(one if one is not None or not filled else filled[-1])
        return filled
    return [None] * count


def _groups(roles: list[str | None], named: list[str | None]) -> list[_Group]:
    """Return the columns of each temperature."""
    groups = []
    for storage, role in enumerate(roles):
        if role != "storage":
            continue
        temperature = named[storage]
        other = [i for i, one in enumerate(roles)
                 if one in ("loss", "tan_delta") and named[i] == temperature]
        other.sort(key=lambda i: (roles[i] != "loss", abs(i - storage)))
        frequencies = [i for i, one in enumerate(roles) if one == "frequency"]
        own = [i for i in frequencies if named[i] == temperature] or frequencies
        before = [i for i in own if i < storage]
        if other and temperature is not None:
            groups.append(_Group(temperature, before[-1] if before else own[0], storage, other[0]))
    return groups


def _long(line: int, heads: list[str], groups: list[_Group], body: Rows) -> Rows:
    """Return the header and the rows of the long table, temperature by temperature."""
    first = groups[0]
    units: list[str] = []
    if body and not any(is_number(cell) for cell in body[0][1]):
        units, body = body[0][1], body[1:]
    places = (first.frequency, first.storage, first.other)
    rows: Rows = [(line, [*(heads[i] for i in places), "T (C)"])]
    if units:
        rows.append((line, [*(units[i] if i < len(units) else "" for i in places), "C"]))
    for group in groups:
        value, unit = group.temperature.split()
        celsius = value if unit == "C" else f"{float(value) - 273.15:.6g}"
        for at, cells in body:
            kept = [cells[i] if i < len(cells) else "" for i in group[1:]]
            if is_number(kept[0]):
                rows.append((at, [*kept, celsius]))
    return rows
