"""Reading of tables of storage and loss moduli that instruments write."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, poisson_ratio
from ..base.names import counted
from ..base.tables import Rows, cells_of, is_number, text_lines
from .dma_columns import (
    ABSOLUTE_ZERO,
    FREQUENCY_UNITS,
    KINDS,
    MODULUS_UNITS,
    TEMPERATURE_UNITS,
    asked_columns,
    find_columns,
    role_of,
    split_header,
)
from .dma_wide import MISSING, unfolded

__all__ = ["DmaTable", "read_dma"]

FloatArray = NDArray[np.float64]

_MOST_FAULTS = 10
_HOT = 150.0            # C; a sweep whose temperatures all lie above is probably in kelvin
_LARGEST_MISMATCH = 1.1  # median factor between the tan delta of a table and G''/G'
_LARGEST_SPREAD = 1.5   # of storage moduli that are measured at one frequency and temperature


@dataclass(frozen=True)
class DmaTable:
    """Moduli at frequencies, and temperatures if the table has them.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Angular frequency, rad/s.
    storage, loss : ndarray, shape (n,)
        Shear moduli G' and G'', Pa.
    temperature : ndarray, shape (n,), or None
        Temperature, C.
    name : str
        Name of the file.
    notes : list of str
        Assumptions that were made, for example about a unit that the header does not name.
    """

    omega: FloatArray
    storage: FloatArray
    loss: FloatArray
    temperature: FloatArray | None = None
    name: str = "data"
    notes: list[str] = field(default_factory=list)


def read_dma(
    path: str | Path,
    *,
    columns: Mapping[str, str | int] | None = None,
    frequency_unit: str | None = None,
    modulus_unit: str | None = None,
    temperature_unit: str | None = None,
    kind: str | None = None,
    poisson: float = 0.5,
) -> DmaTable:
    r"""Read a table of storage and loss moduli.

    Columns are separated by commas, semicolons, tabs or blanks. Decimal commas are understood
    unless commas separate the columns; in a table that also has decimal points, commas separate
    thousands. Empty lines, lines that start with ``#`` and those above the header are skipped.
    Points whose cells are empty or contain a word such as OVL are left out. A wide table has
    columns for each temperature, which are named in the header, as in ``G' (MPa) at -20 C``, or in
    a line above it.

    Units are given in the header, as in ``f (Hz)``, ``G' [MPa]`` or ``T_C``, or in a line below it.
    Otherwise frequencies are taken in Hz (in rad/s if the column is named omega), moduli in Pa and
    temperatures in C, and `notes` says so.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping, optional
        Name or number (from 1) of the column of 'frequency', 'storage', 'loss', 'temperature' or
        'tan_delta', if the header does not identify it. A file without a header needs numbers.
    frequency_unit : str, optional
        'Hz', 'kHz', 'mHz', 'rad/s' or 'krad/s'; overrides the header.
    modulus_unit : str, optional
        'Pa', 'kPa', 'MPa' or 'GPa'; overrides the header.
    temperature_unit : str, optional
        'C' or 'K'; overrides the header.
    kind : str, optional
        'shear', or 'tension' for moduli E with G = E/(2 (1 + poisson)). The default is 'tension' if
        the names of the columns say so (E', E'' or 'tensile'), otherwise 'shear'.
    poisson : float
        Poisson ratio, for moduli in tension.

    Returns
    -------
    DmaTable

    Raises
    ------
    OSError
        If the file is missing or cannot be read.
    ValueError
        If a value is not allowed (with the line number of each fault), or a column is missing.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "dma.csv"
    >>> _ = path.write_text("f (Hz),G' (MPa),G'' (MPa)\n1,2.0,0.5\n10,3.0,0.9\n99,4.0,2.0\n")
    >>> read_dma(path).storage.tolist()
    [2000000.0, 3000000.0, 4000000.0]
    """
    path = Path(path)
    poisson = poisson_ratio(poisson)
    for word, value, allowed in (("frequency_unit", frequency_unit, tuple(FREQUENCY_UNITS)),
                                 ("modulus_unit", modulus_unit, tuple(MODULUS_UNITS)),
                                 ("temperature_unit", temperature_unit, tuple(TEMPERATURE_UNITS)),
                                 ("kind", kind, KINDS)):
        if value is not None:
            choice(word, value, allowed)
    asked = asked_columns(columns)
    lines = unfolded(cells_of(text_lines(path)), role_of)
    header, units, body = split_header(path, lines, asked)
    places, found_units, kind = find_columns(path, header, units, asked, kind)
    own_tan_delta = places.pop("tan_delta") if {"loss", "tan_delta"} <= places.keys() else None
    body, notes = _measured(body, places)

    def unit(role: str, given: str | None, allowed: Mapping[str, float], default: str) -> float:
        named = found_units.get(role)
        if given is None and named is not None and named not in allowed:
            raise ValueError(f"{path}: line {header[0]}: column {role}: has the unit {named!r}:"
                             f" must be one of {', '.join(allowed)}")
        if given is None and named is None:
            notes.append(f"{role}: the header names no unit: taken as {default}")
        return allowed[given or named or default]

    angular = found_units.get("angular") == "yes"
    to_omega = unit("frequency", frequency_unit, FREQUENCY_UNITS, "rad/s" if angular else "Hz")
    if found_units.get("storage") is None and "loss" in places:  # one unit counts for both
        found_units["storage"] = found_units.get("loss")
    to_pascal = unit("storage", modulus_unit, MODULUS_UNITS, "Pa")
    to_celsius = (unit("temperature", temperature_unit, TEMPERATURE_UNITS, "C")
                  if "temperature" in places else 0.0)
    values = _numbers(path, body, places)
    percent = 100.0 if found_units.get("tan_delta") == "%" else 1.0
    storage = to_pascal * values["storage"]
    if "loss" in places:
        own = modulus_unit is None and found_units.get("loss") is not None
        loss = values["loss"] * (unit("loss", None, MODULUS_UNITS, "Pa") if own else to_pascal)
        notes += _contradiction(body, own_tan_delta, percent * loss / storage)
    else:
        loss = storage * values["tan_delta"] / percent
    factor, said = _to_shear(kind, poisson)
    notes += said
    temperature = values["temperature"] + to_celsius if "temperature" in places else None
    if temperature is None:
        notes += _repeated(values["frequency"], storage)
    else:
        has_unit = bool(temperature_unit or found_units.get("temperature"))
        notes += _check_temperatures(path, body, temperature, has_unit)
    return DmaTable(to_omega * values["frequency"], factor * storage, factor * loss, temperature,
                    path.name, notes)


def _contradiction(body: Rows, at: int | None, ratio: FloatArray) -> list[str]:
    """Return a note if the column of tan delta contradicts G''/G', which is used instead of it.

    Parameters
    ----------
    body : list of rows
        The rows of the table.
    at : int or None
        Index of the column of tan delta, if there is one. Cells that are not a positive number are
        not compared.
    ratio : ndarray, shape (n,)
        G''/G' of each row, in the unit of the column.
    """
    found = []
    for (line, cells), own in zip(body, ratio, strict=True):
        text = cells[at] if at is not None and at < len(cells) else ""
        if is_number(text) and float(text) > 0.0:
            found.append((abs(math.log(float(text) / own)), line, text, own))
    if not found or float(np.median([one[0] for one in found])) < math.log(_LARGEST_MISMATCH):
        return []
    _, line, text, own = max(found)
    return [f"tan delta contradicts the moduli, which are used (line {line}: tan delta = {text},"
            f" loss over storage modulus = {own:.4g})"]


def _to_shear(kind: str | None, poisson: float) -> tuple[float, list[str]]:
    """Return the shear modulus over a modulus of the table, and a note on its kind."""
    if kind == "tension":
        factor = 0.5 / (1.0 + poisson)
        return factor, [f"moduli in tension: G = E/(2 (1 + poisson)) = {factor:.6g} E"]
    return 1.0, [] if kind else [
        "the header does not say whether the moduli are of shear or of tension: taken as shear;"
        " for tension, where G = E/(2 (1 + poisson)), give kind = 'tension' (--kind tension)"]


def _check_temperatures(path: Path, body: Rows, temperature: FloatArray, has_unit: bool
                        ) -> list[str]:
    """Refuse temperatures that do not exist; return a note on those that are probably in kelvin."""
    at = int(np.argmin(temperature))
    if temperature[at] < ABSOLUTE_ZERO:
        raise ValueError(f"{path}: line {body[at][0]}: temperature = {temperature[at]:g} C: must"
                         f" be >= {ABSOLUTE_ZERO:g} C; look at the unit of the column"
                         " (temperature_unit, --temperature-unit)")
    if has_unit or temperature.min() <= _HOT:
        return []
    return [f"temperatures from {temperature.min():g} to {temperature.max():g} C are unusual: if"
            " they are in kelvin, say so (temperature_unit = 'K', --temperature-unit K)"]


def _repeated(frequency: FloatArray, storage: FloatArray) -> list[str]:
    """Return a note if the moduli at one frequency differ so much that a temperature is missing."""
    spread = max(float(np.ptp(np.log(storage[frequency == one]))) for one in np.unique(frequency))
    if spread < math.log(_LARGEST_SPREAD):
        return []
    return [f"moduli at the same frequency differ by a factor of {math.exp(spread):.3g}, and no"
            " column is known as the temperature: if there is one, name it (columns, --column"
            " temperature=NAME)"]


def _measured(body: Rows, places: Mapping[str, int]) -> tuple[Rows, list[str]]:
    """Return the rows that have all values, and a note on the others (overload, for example)."""
    most = max(places.values()) + 1
    kept = [(line, cells) for line, cells in body
            if len(cells) < most
            or not any(cells[at].strip().lower() in MISSING for at in places.values())]
    left_out = len(body) - len(kept)
    if not left_out:
        return body, []
    return kept, [f"{left_out} of {len(body)} points have no value (empty, or a word such as OVL):"
                  " left out"]


def _numbers(
    path: Path, body: list[tuple[int, list[str]]], places: Mapping[str, int]
) -> dict[str, FloatArray]:
    """Return the columns as numbers, or raise a ValueError that lists all faults by line."""
    faults: list[str] = []
    values: dict[str, list[float]] = {role: [] for role in places}
    most = max(places.values()) + 1
    for line, cells in body:
        if len(cells) < most:
            faults.append(f"{path}: line {line}: has {counted(len(cells), 'column')},"
                          f" must have {most}")
            continue
        for role, at in places.items():
            allowed = "a finite number" if role == "temperature" else "a number > 0"
            try:
                value = float(cells[at])
            except ValueError:
                value = math.nan
            if not math.isfinite(value) or (role != "temperature" and value <= 0.0):
                faults.append(f"{path}: line {line}: {role} = {cells[at]!r}: must be {allowed}")
            values[role].append(value)
    if faults:
        more = len(faults) - _MOST_FAULTS
        if more > 0:
            faults = [*faults[:_MOST_FAULTS], f"{path}: and {more} more"]
        raise ValueError("\n".join(faults))
    if len(body) < 3:
        raise ValueError(f"{path}: has {counted(len(body), 'row')} of numbers: must have"
                         " at least 3")
    return {role: np.array(column) for role, column in values.items()}
