"""Tables of a spectrum: wave numbers and densities, in the units of their headings."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.tables import (
    Rows,
    cells_of,
    decimals,
    heads_of_comment,
    is_number,
    text_lines,
)
from ..roads.spectra import Spectrum, isotropic_of_profile

__all__ = ["spectrum_of_file"]

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
_LENGTH = "(?P<length>[cmun]?m)"
_WAVE_UNIT = re.compile(rf"(?:rad|1)/{_LENGTH}|(?:rad[ .*]?)?{_LENGTH.replace('length', 'other')}"
                        r"\^?\(?-1\)?")
_PSD_UNIT = re.compile(rf"{_LENGTH}(?:\^|\*\*)?(?P<power>[34])")
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")


def spectrum_of_file(path: Path) -> Spectrum:
    """Return the spectrum of a table: wave numbers (rad/m) and densities.

    The second column is Phi (m4). If its heading begins with C, it is Persson's C = Phi/(4 pi^2);
    if it contains m3, it is the density of a profile, Phi1, or C = Phi1/(2 pi). Headings may name
    other units of length. They may be in a comment.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Spectrum

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, or is not such a table.
    """
    rows = cells_of(text_lines(path))
    heads = [] if is_number(rows[0][1][0]) else rows[0][1]
    values = _numbers(path, rows[1:] if heads else rows)
    heads = heads or heads_of_comment(path, len(rows[0][1]))
    first, second = heads[:2] if len(heads) > 1 else ("", "")
    if re.search(r"wavelength|lambda|λ|freq|^\W*f\b(?!.*rad)", first, re.IGNORECASE):
        raise ValueError(f"{path}: column 1 is {first!r}: must be the wave number, in rad/m")
    found = _unit(path, 1, first, _WAVE_UNIT, "rad/m, 1/m, rad/mm, 1/mm, rad/um or 1/um")
    length = "m" if found is None else found["length"] or found["other"]
    values[:, 0] /= _METRES[length]
    read_as = f"{path.name}: the wave number is read in rad/{length}"
    found = _unit(path, 2, second, _PSD_UNIT, "m4, mm4 or um4, or m3, mm3 or um3 of a profile")
    length, power = ("m", 4) if found is None else (found["length"], int(found["power"]))
    values[:, 1] *= _METRES[length] ** power
    symbol = "Phi" if power == 4 else "Phi1 of a profile"
    if re.match(r"\s*C[12]?(\b|_|D|iso)", second):
        values[:, 1] *= (2.0 * math.pi) ** (power - 2)
        symbol = symbol.replace("Phi", "C")
    read_as += f", the density as {symbol} in {length}{power}"
    wave, psd = values[np.argsort(values[:, 0])].T
    try:
        spectrum = (isotropic_of_profile(wave, psd, name=path.name) if power == 3
                    else Spectrum(wave, psd, path.name))
    except ValueError as error:
        raise ValueError(f"{path}: sorted by wave number, {error}") from None
    return replace(spectrum, notes=[read_as, *spectrum.notes])


def _numbers(path: Path, rows: Rows) -> np.ndarray:
    """Return the first two columns of a table."""
    try:
        values = np.array([[float(cell) for cell in cells[:2]] for _, cells in decimals(rows)])
    except ValueError as error:
        raise ValueError(f"{path}: {error}: must have two columns of numbers, wave number (rad/m)"
                         " and density (m4)") from None
    if values.ndim != 2 or values.shape[0] < 2 or values.shape[1] < 2:
        raise ValueError(f"{path}: must have two columns of numbers, at least two rows")
    return values


def _unit(path: Path, column: int, head: str, known: re.Pattern[str], allowed: str
          ) -> re.Match[str] | None:
    """Return the unit of a heading; None if it names none."""
    words = re.sub("[µμ]", "u", head).replace("⁻¹", "^-1").replace("⁴", "4").replace("³", "3")
    words = words.replace("−", "-")
    bracket = _BRACKETS.search(words)
    inside = bracket[1].replace(" ", "") if bracket else ""
    is_symbol = re.fullmatch("[a-z]{1,3}", inside) and inside not in _METRES  # as in "C(q) um4"
    if bracket is None or not inside or is_symbol:
        return re.search(rf"(?<![\w/])(?:{known.pattern})(?!\w)", words)
    found = known.fullmatch(inside)
    if found is None:
        raise ValueError(f"{path}: column {column}: has the unit {bracket[1]!r}: must be one of"
                         f" {allowed}")
    return found
