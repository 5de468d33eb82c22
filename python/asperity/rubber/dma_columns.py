"""The header of a DMA table: its columns, their units, and the kind of the moduli."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

from ..base.check import choice, shown
from ..base.tables import Rows, decimals, is_number

__all__ = ["ABSOLUTE_ZERO", "FREQUENCY_UNITS", "KINDS", "MODULUS_UNITS", "ROLES",
           "TEMPERATURE_UNITS", "asked_columns", "find_columns", "role_of", "split_header"]

FREQUENCY_UNITS = {"Hz": 2.0 * math.pi, "kHz": 2e3 * math.pi, "mHz": 2e-3 * math.pi,
                   "rad/s": 1.0, "krad/s": 1e3}
MODULUS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
ABSOLUTE_ZERO = -273.15  # C
TEMPERATURE_UNITS = {"C": 0.0, "K": ABSOLUTE_ZERO}
ROLES = ("frequency", "storage", "loss", "temperature", "tan_delta")
KINDS = ("shear", "tension")

_ANGULAR = {"omega", "w", "ω", "angular", "angularfrequency", "angfreq", "angularfreq",
            "angfrequency", "radfreq", "radianfrequency", "kreisfrequenz"}
_NAMES = {
    "frequency": {"f", "freq", "frequency", "frequenz", "frequence", "fréquence", "nu",
                  "reducedfrequency", "messfrequenz", *_ANGULAR},
    "storage": {"storage", "storagemodulus", "g'", "g1", "gp", "gprime", "gstorage", "gstor", "e'",
                "e1", "ep", "eprime", "estorage", "estor", "storageg", "storagee",
                "storagemodulusg'", "storagemoduluse'", "g'storage", "e'storage", "storagemod",
                "shearstoragemodulus", "tensilestoragemodulus", "speichermodul",
                "speichermodulg'", "speichermodule'", "moduledeconservation"},
    "loss": {"loss", "lossmodulus", "g''", "g2", "gpp", "gdoubleprime", "gloss", "e''", "e2",
             "epp", "edoubleprime", "eloss", "lossg", "losse", "lossmodulusg''",
             "lossmoduluse''", "g''loss", "e''loss", "lossmod", "shearlossmodulus",
             "tensilelossmodulus", "verlustmodul", "verlustmodulg''", "verlustmodule''",
             "moduledeperte"},
    "temperature": {"t", "temp", "temperature", "temperatur", "température", "sampletemperature",
                    "probentemperatur"},
    "tan_delta": {"tandelta", "tand", "tanδ", "tan", "lossfactor", "dampingfactor", "verlustfaktor",
                  "tan(δ)", "tan(delta)", "tan(d)"},
}
_UNIT_SPELLINGS = {
    "hz": "Hz", "khz": "kHz", "mhz": "mHz", "1/s": "1/s", "s-1": "1/s", "s^-1": "1/s",
    "rad/s": "rad/s", "rads-1": "rad/s", "rads^-1": "rad/s", "rad/sec": "rad/s", "rads": "rad/s",
    "rad.s-1": "rad/s", "rad·s-1": "rad/s", "radps": "rad/s", "rad/per/s": "rad/s",
    "krad/s": "krad/s",
    "pa": "Pa", "kpa": "kPa", "mpa": "MPa", "gpa": "GPa", "n/mm2": "MPa", "n/mm^2": "MPa",
    "n/m2": "Pa", "c": "C", "°c": "C", "ºc": "C", "degc": "C", "celsius": "C", "k": "K",
    "kelvin": "K", "-": "", "1": "",
}
_MOST_PREAMBLE = 200  # lines above the header


def split_header(
    path: Path, lines: Rows, given: Mapping[str, str | int]
) -> tuple[tuple[int, list[str]], list[str], Rows]:
    """Return the header with its line number, the line of units, and the rows of numbers.

    Metadata of the sample may precede the header. If several sweeps follow each other, the header
    may be repeated.

    Raises
    ------
    ValueError
        If there are no numbers below the header.
    """
    at = next((i for i, (_, cells) in enumerate(lines[:_MOST_PREAMBLE])
               if _is_header(cells, given)), None)
    if at is None:
        if any(is_number(cell) for cell in lines[0][1]):
            return (0, []), [], decimals(lines)
        first_numbers = next((i for i, (_, cells) in enumerate(lines)
                              if sum(map(is_number, cells)) > 1), len(lines))
        at = max(range(max(first_numbers, 1)), key=lambda i: (len(lines[i][1]), -i))
    first, body = lines[at], lines[at + 1 :]
    units: list[str] = []
    if body and not any(is_number(cell) for cell in body[0][1]):
        known = [_unit(cell) for cell in body[0][1]]
        if any(unit is not None for unit in known):
            units, body = body[0][1], body[1:]
    body = _without_headings(body, first[1], units)
    if not body:
        raise ValueError(f"{path}: has a header and no numbers")
    return first, units, decimals(body)


def _without_headings(body: Rows, header: list[str], units: list[str]) -> Rows:
    """Return the rows without repeated headers and the text lines directly above them."""
    kept: Rows = []
    for row in body:
        if row[1] == header:
            while kept and sum(map(is_number, kept[-1][1])) < 2:
                kept.pop()
        elif row[1] != units:
            kept.append(row)
    return kept


def _is_header(cells: list[str], given: Mapping[str, str | int]) -> bool:
    """Return whether a line names the frequency and a modulus, or the requested columns."""
    if any(is_number(cell) for cell in cells):
        return False
    names = [_name_and_unit(cell)[0] for cell in cells]
    asked = [wanted for wanted in given.values()
             if isinstance(wanted, str) and not wanted.isdigit()]
    if asked and all(wanted.strip() in cells or _plain(wanted) in names for wanted in asked):
        return True
    return all(any(name in _NAMES[role] for name in names) for role in ("frequency", "storage"))


def _unit(text: str) -> str | None:
    """Return the unit that a text names: '' for a pure number, None if the text is not a unit."""
    plain = re.sub(r"[\s\[\]()*]", "", text).replace("_", "/")
    if plain == "mPa":
        return "mPa"  # much too small for the modulus of a rubber: the caller refuses it
    if plain in ("MHz", "MHZ"):
        return "MHz"
    return _UNIT_SPELLINGS.get(plain.lower())


def _name_and_unit(text: str) -> tuple[str, str | None]:
    """Split the head of a column into its name and its unit.

    Examples
    --------
    >>> _name_and_unit("Storage modulus (MPa)")
    ('storagemodulus', 'MPa')
    >>> _name_and_unit("freq_Hz"), _name_and_unit("omega / rad/s"), _name_and_unit("G''")
    (('freq', 'Hz'), ('omega', 'rad/s'), ("g''", None))
    """
    text = re.sub(r"[′’‘`´]", "'", text).replace("″", "''").replace('"', "''").strip()
    unit: str | None = None
    found = re.search(r"[\[(]([^\[\]()]*)[\])]\s*$", text)
    if found and found.start() > 0 and found.group(1).strip().lower() not in ("δ", "delta"):
        unit = _unit(found.group(1))
        if unit is None and found.group(1).strip():
            # The parentheses may contain a symbol instead of a unit: "storage modulus (G')".
            # "T (F)" is no symbol: F would be a frequency.
            inner, outer = _role_of_name(found.group(1)), _role_of_name(text[: found.start()])
            unit = None if inner and outer in (None, inner) else found.group(1)
        text = text[: found.start()].strip()
        symbol = re.search(r"[\[(]([^\[\]()]*)[\])]$", text)
        if symbol and any(_plain(symbol.group(1)) in names for names in _NAMES.values()):
            text = text[: symbol.start()]  # as in "storage modulus (G') (MPa)"
    else:
        for gap in re.finditer(r"\s*[/,_]\s*|\s+", text):
            unit = _unit(text[gap.end() :])
            if unit is not None and _plain(text[: gap.start()]):
                text = text[: gap.start()]
                break
        else:
            unit = None
    return _plain(text), unit


def _plain(text: str) -> str:
    """Return a name without blanks, underscores and capitals."""
    return re.sub(r"[\s_.\-*]", "", text).lower()


def _role_of_name(text: str) -> str | None:
    """Return the role that a name without a unit stands for, or None."""
    return next((role for role, names in _NAMES.items() if _plain(text) in names), None)


def role_of(head: str) -> str | None:
    """Return the role that the head of a column names, such as 'storage', or None.

    Examples
    --------
    >>> role_of("G' (MPa)"), role_of("f (Hz)"), role_of("sample")
    ('storage', 'frequency', None)
    """
    name = _name_and_unit(head)[0]
    return next((role for role, names in _NAMES.items() if name in names), None)


def asked_columns(columns: Mapping[str, str | int] | None) -> Mapping[str, str | int]:
    """Return the requested columns by role, or raise ValueError if they are no mapping."""
    if columns is not None and not isinstance(columns, Mapping):
        raise ValueError(f"columns = {shown(columns)}: must be a dict of names or numbers by role")
    return columns or {}


def find_columns(
    path: Path, header: tuple[int, list[str]], units: list[str],
    given: Mapping[str, str | int], kind: str | None = None,
) -> tuple[dict[str, int], dict[str, str | None], str | None]:
    """Return the index and the unit of each column by role, and the kind of the moduli.

    The kind is `kind` if it is given. Otherwise the names of the columns say it, or None.
    """
    heads = header[1]
    parts = [_name_and_unit(head) for head in heads]
    places = _places(path, header, parts, units, given)
    found: dict[str, str | None] = {}
    for role, at in places.items():
        unit = parts[at][1] if at < len(parts) else None
        if unit is None and at < len(units):
            unit = _unit(units[at])
            if unit is None and units[at].strip():
                unit = units[at]
        found[role] = unit or None
    at = places["frequency"]
    if found["frequency"] == "1/s":  # means rad/s for an angular frequency, otherwise Hz
        found["frequency"] = "rad/s" if at < len(parts) and parts[at][0] in _ANGULAR else "Hz"
    found["angular"] = "yes" if at < len(parts) and parts[at][0] in _ANGULAR else None
    if kind is not None:
        return places, found, kind
    kinds = {role: _kind(heads[places[role]], parts[places[role]][0])
             for role in ("storage", "loss") if places.get(role, len(parts)) < len(parts)}
    if set(kinds.values()) == {"shear", "tension"}:
        raise ValueError(f"{path}: line {header[0]}: {heads[places['storage']]!r} and"
                         f" {heads[places['loss']]!r} are moduli of shear and of tension: both must"
                         " be of the same kind; if a name is wrong, say which kind both are"
                         " (kind, --kind)")
    return places, found, kinds.get("storage") or kinds.get("loss")


def _kind(head: str, name: str) -> str | None:
    """Return the kind of a modulus that the heading of its column names, if any.

    Examples
    --------
    >>> _kind("G'' (MPa)", "g''"), _kind("E' (MPa)", "e'"), _kind("Loss modulus", "lossmodulus")
    ('shear', 'tension', None)
    """
    tensile = name.startswith("tensile") or re.match(r"e('|\d|p|storage|loss)", name)
    if tensile or re.search(r"\bE\s*['′’]", head):
        return "tension"
    return "shear" if name.startswith(("shear", "g")) or re.search(r"\bG\s*['′’]", head) else None


def _like_temperatures(parts: list[tuple[str, str | None]], units: list[str]) -> list[int]:
    """Return the columns whose name and unit can mean a temperature, such as "T set (°C)"."""
    found = []
    for i, (name, unit) in enumerate(parts):
        if unit is None and i < len(units):
            unit = _unit(units[i]) or units[i].strip() or None
        if (unit in TEMPERATURE_UNITS and name.startswith("t")) or (
                "temp" in name and unit in (None, *TEMPERATURE_UNITS)):
            found.append(i)
    return found


def _places(path: Path, header: tuple[int, list[str]], parts: list[tuple[str, str | None]],
            units: list[str], given: Mapping[str, str | int]) -> dict[str, int]:
    """Return the index of each column by role: first the requested columns, then known names."""
    line, heads = header
    places = _asked(path, heads, parts, given)
    for role, names in _NAMES.items():
        match = [i for i, (name, _) in enumerate(parts)
                 if name in names and i not in places.values()]
        if role == "temperature" and not match:
            match = _like_temperatures(parts, units)
        if role in places or not match:
            continue
        if len(match) > 1:
            raise ValueError(f"{path}: line {line}: the columns"
                             f" {' and '.join(repr(heads[i]) for i in match)} may both be the"
                             f" {role}: say which (columns, --column {role}=NAME)")
        places[role] = match[0]
    if "tan_delta" in given and "loss" not in given:
        places.pop("loss", None)
    missing = [role for role in ("frequency", "storage") if role not in places]
    if "loss" not in places and "tan_delta" not in places:
        missing.append("loss (or tan_delta)")
    if missing:
        where = (f"line {line}: the columns {', '.join(map(repr, heads))} have no"
                 if heads else "has no header: say the number of")
        raise ValueError(f"{path}: {where} {', '.join(missing)}"
                         " (columns, --column ROLE=NAME or ROLE=NUMBER)")
    return places


def _asked(path: Path, heads: list[str], parts: list[tuple[str, str | None]],
           given: Mapping[str, str | int]) -> dict[str, int]:
    """Return the index of each column that was requested by name or number."""
    for role in given:
        choice("columns", role, ROLES)
    places: dict[str, int] = {}
    for role, wanted in given.items():
        if not isinstance(wanted, int | str) or isinstance(wanted, bool):
            raise ValueError(f"columns: {role} = {shown(wanted)}: must be the name of a column or"
                             " its number, from 1")
        if isinstance(wanted, int) or wanted.isdigit():
            if int(wanted) < 1 or (heads and int(wanted) > len(heads)):
                raise ValueError(f"columns: {role} = {wanted}: must be a number from 1"
                                 + (f" to {len(heads)}" if heads else ""))
            places[role] = int(wanted) - 1
            continue
        match = [i for i, head in enumerate(heads)
                 if wanted.strip() == head.strip() or _plain(wanted) == parts[i][0]]
        if not match:
            raise ValueError(f"columns: {role} = {wanted!r}: {path} has the columns"
                             f" {', '.join(map(repr, heads)) or 'without names'}")
        places[role] = match[0]
    for role, at in places.items():
        twin = next((other for other in places if other != role and places[other] == at), None)
        if twin is not None:
            raise ValueError(f"columns: {role} and {twin} are the same column, {given[role]!r}:"
                             " each needs its own")
    return places
