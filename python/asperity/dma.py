"""Dynamic mechanical analysis: tables of storage and loss moduli, brought to a Prony series.

A table is a CSV file with a header that names its columns and their units; what the header leaves
open can be said in the call. Several temperatures become one master curve by time-temperature
superposition: with WLF constants that are given, or with shifts found from the overlap.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._check import choice, number, poisson_ratio, positive
from ._tables import Rows, cells_of, decimals, is_number, text_lines
from .material import WLF, MasterCurve, Prony, master_curve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DmaFit", "DmaTable", "fit_dma", "read_dma"]

FloatArray = NDArray[np.float64]

FREQUENCY_UNITS = {"Hz": 2.0 * math.pi, "kHz": 2e3 * math.pi, "mHz": 2e-3 * math.pi,
                   "rad/s": 1.0, "krad/s": 1e3}
MODULUS_UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
TEMPERATURE_UNITS = {"C": 0.0, "K": -273.15}
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
_MOST_FAULTS = 10
_MOST_PREAMBLE = 200  # lines above the header


@dataclass(frozen=True)
class DmaTable:
    """Moduli at frequencies, and temperatures where the table has them.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Angular frequency, rad/s.
    storage, loss : ndarray, shape (n,)
        Shear moduli G' and G'', Pa.
    temperature : ndarray, shape (n,), or None
        C.
    name : str
        Name of the file.
    notes : list of str
        What was taken for granted, such as a unit that the header does not name.
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

    Columns are separated by commas, semicolons, tabs or blanks; decimal commas are read where
    commas do not separate (with decimal points elsewhere they stand between thousands). Lines that
    start with ``#``, empty ones and those above the header are skipped. Units stand in
    the header, such as ``f (Hz)``, ``G' [MPa]``, ``T_C``, or in a line of their own below it.
    Without any, frequencies are in Hz (in rad/s where the column is named omega), moduli in Pa and
    temperatures in C, and `notes` says so.

    Parameters
    ----------
    path : str or Path
        The file.
    columns : mapping, optional
        Name or number (from 1) of the column of 'frequency', 'storage', 'loss', 'temperature' or
        'tan_delta', for those that the header's words do not give. A file without a header needs
        the numbers.
    frequency_unit : str, optional
        'Hz', 'kHz', 'mHz', 'rad/s' or 'krad/s'; goes before the header's.
    modulus_unit : str, optional
        'Pa', 'kPa', 'MPa' or 'GPa'; goes before the header's.
    temperature_unit : str, optional
        'C' or 'K'; goes before the header's.
    kind : str, optional
        'shear', or 'tension' for moduli E: G = E/(2 (1 + poisson)). By default what the names of
        the columns say (E' and E'' or 'tensile': tension), else 'shear'.
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
        With the number of the line of each fault, or what the header lacks.

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
    for word, value, allowed in (("frequency_unit", frequency_unit, FREQUENCY_UNITS),
                                 ("modulus_unit", modulus_unit, MODULUS_UNITS),
                                 ("temperature_unit", temperature_unit, TEMPERATURE_UNITS)):
        if value is not None:
            choice(word, value, tuple(allowed))
    if kind is not None:
        choice("kind", kind, KINDS)
    header, units, body = _split_header(path, cells_of(text_lines(path)), columns or {})
    places, found_units, found_kind = _find_columns(path, header, units, columns or {})
    notes: list[str] = []

    def unit(role: str, given: str | None, allowed: Mapping[str, float], default: str) -> float:
        told = found_units.get(role)
        if given is None and told is not None and told not in allowed:
            raise ValueError(f"{path}: line {header[0]}: column {role}: has the unit {told!r}: must"
                             f" be one of {', '.join(allowed)}")
        if given is None and told is None:
            notes.append(f"{role}: the header names no unit: taken as {default}")
        return allowed[given or told or default]

    angular = found_units.get("angular") == "yes"
    to_omega = unit("frequency", frequency_unit, FREQUENCY_UNITS, "rad/s" if angular else "Hz")
    if found_units.get("storage") is None and "loss" in places:  # one unit counts for both
        found_units["storage"] = found_units.get("loss")
    to_pascal = unit("storage", modulus_unit, MODULUS_UNITS, "Pa")
    to_celsius = 0.0
    if "temperature" in places:
        to_celsius = unit("temperature", temperature_unit, TEMPERATURE_UNITS, "C")
    values = _numbers(path, body, places)
    storage = to_pascal * values["storage"]
    if "loss" in places:
        to_loss = to_pascal
        if modulus_unit is None and found_units.get("loss") is not None:
            to_loss = unit("loss", None, MODULUS_UNITS, "Pa")
        loss = to_loss * values["loss"]
    else:
        percent = found_units.get("tan_delta") == "%"
        loss = storage * values["tan_delta"] * (0.01 if percent else 1.0)
    if kind == "tension" or (kind is None and found_kind == "tension"):
        factor = 0.5 / (1.0 + poisson)
        storage, loss = factor * storage, factor * loss
        notes.append(f"moduli in tension: G = E/(2 (1 + poisson)) = {factor:.6g} E")
    temperature = None
    if "temperature" in places:
        temperature = values["temperature"] + to_celsius
    return DmaTable(to_omega * values["frequency"], storage, loss, temperature, path.name, notes)


# ---- the file ------------------------------------------------------------------------------


def _split_header(
    path: Path, lines: Rows, given: Mapping[str, str | int]
) -> tuple[tuple[int, list[str]], list[str], Rows]:
    """Return the header with its line, the units' line, and the rows of numbers.

    What an instrument says of the sample may stand above the header; where several sweeps follow
    each other, the header may be repeated.
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
    """Return the rows without repeated headers and what stands above those."""
    kept: Rows = []
    for row in body:
        if row[1] == header:
            while kept and sum(map(is_number, kept[-1][1])) < 2:
                kept.pop()
        elif row[1] != units:
            kept.append(row)
    return kept


def _is_header(cells: list[str], given: Mapping[str, str | int]) -> bool:
    """Whether a line names the frequency and a modulus, or the columns that were asked for."""
    if any(is_number(cell) for cell in cells):
        return False
    names = [_name_and_unit(cell)[0] for cell in cells]
    asked = [wanted for wanted in given.values()
             if isinstance(wanted, str) and not wanted.isdigit()]
    if asked and all(wanted.strip() in cells or _plain(wanted) in names for wanted in asked):
        return True
    return all(any(name in _NAMES[role] for name in names) for role in ("frequency", "storage"))


def _unit(text: str) -> str | None:
    """Return the unit that a text names, '' for a pure number, None if it names none."""
    plain = re.sub(r"[\s\[\]()*]", "", text).replace("_", "/")
    if plain == "mPa":
        return "mPa"  # no modulus of a rubber: refused later
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
            # letters of the quantity, as in "storage modulus (G')"
            inner = _plain(found.group(1))
            unit = None if any(inner in names for names in _NAMES.values()) else found.group(1)
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


def _find_columns(
    path: Path, header: tuple[int, list[str]], units: list[str],
    given: Mapping[str, str | int],
) -> tuple[dict[str, int], dict[str, str | None], str | None]:
    """Return the place of each column, the units found, and whether the moduli are tensile."""
    line, heads = header
    for role in given:
        choice("columns", role, ROLES)
    parts = [_name_and_unit(head) for head in heads]
    places: dict[str, int] = {}
    for role, wanted in given.items():
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
    for role, names in _NAMES.items():
        match = [i for i, (name, _) in enumerate(parts)
                 if name in names and i not in places.values()]
        if role in places or not match:
            continue
        if len(match) > 1:
            raise ValueError(f"{path}: line {line}: the columns"
                             f" {' and '.join(repr(heads[i]) for i in match)} may both be the"
                             f" {role}: say which (columns, --column {role}=NAME)")
        places[role] = match[0]
    if "loss" in places:
        asked = "tan_delta" in given and "loss" not in given
        places.pop("loss" if asked else "tan_delta", None)
    missing = [role for role in ("frequency", "storage") if role not in places]
    if "loss" not in places and "tan_delta" not in places:
        missing.append("loss (or tan_delta)")
    if missing:
        where = (f"line {line}: the columns {', '.join(map(repr, heads))} have no"
                 if heads else "has no header: say the number of")
        raise ValueError(f"{path}: {where} {', '.join(missing)}"
                         " (columns, --column ROLE=NAME or ROLE=NUMBER)")
    found: dict[str, str | None] = {}
    for role, at in places.items():
        unit = parts[at][1] if at < len(parts) else None
        if unit is None and at < len(units):
            unit = _unit(units[at])
            if unit is None and units[at].strip():
                unit = units[at]
        found[role] = unit or None
    at = places["frequency"]
    if found["frequency"] == "1/s":  # of an angular frequency radians, else turns
        found["frequency"] = "rad/s" if at < len(parts) and parts[at][0] in _ANGULAR else "Hz"
    found["angular"] = "yes" if at < len(parts) and parts[at][0] in _ANGULAR else None
    kind = None
    if places["storage"] < len(parts):
        name = parts[places["storage"]][0]
        head = heads[places["storage"]]
        tensile = name.startswith("tensile") or re.match(r"e('|\d|p|storage)", name)
        if tensile or re.search(r"\bE\s*['′’]", head):
            kind = "tension"
    return places, found, kind


def _numbers(
    path: Path, body: list[tuple[int, list[str]]], places: Mapping[str, int]
) -> dict[str, FloatArray]:
    """Return the columns as numbers; all faults are told with their lines."""
    faults: list[str] = []
    values: dict[str, list[float]] = {role: [] for role in places}
    most = max(places.values()) + 1
    for line, cells in body:
        if len(cells) < most:
            faults.append(f"{path}: line {line}: has {len(cells)} columns, must have {most}")
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
        raise ValueError(f"{path}: has {len(body)} rows of numbers: must have at least 3")
    return {role: np.array(column) for role, column in values.items()}


# ---- the fit ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class DmaFit:
    """A Prony series fitted to measurements, with what it was fitted to.

    Attributes
    ----------
    material : Prony
        The series at the reference temperature.
    omega, storage, loss : ndarray, shape (n,)
        The data, rad/s and Pa, at the reference temperature, ascending.
    temperature : ndarray, shape (n,), or None
        Temperature at which each point was measured, C.
    reference : float or None
        Reference temperature, C.
    wlf : WLF or None
        Constants, given or fitted to the shifts.
    shifts : list of (float, float)
        Temperature and log10 of its shift factor.
    overlap_error : float or None
        Rms distance of neighbouring sweeps, log10, where shifts were found from them.
    error_storage, error_loss, error_tan_delta : float
        Rms of log10(fit/data).
    largest_error : float
        Largest absolute of log10(fit/data) in storage and loss.
    plateau_bounded : bool
        Whether the data leave the plateau open and `least_plateau` holds it.
    name : str
        Name of the data.
    notes : list of str
        What was taken for granted, or looks doubtful.
    """

    material: Prony
    omega: FloatArray
    storage: FloatArray
    loss: FloatArray
    temperature: FloatArray | None
    reference: float | None
    wlf: WLF | None
    shifts: list[tuple[float, float]]
    overlap_error: float | None
    error_storage: float
    error_loss: float
    error_tan_delta: float
    largest_error: float
    plateau_bounded: bool
    name: str
    notes: list[str]

    @property
    def valid_range(self) -> tuple[float, float]:
        """Lowest and highest angular frequency of the data at the reference temperature, rad/s."""
        return float(self.omega[0]), float(self.omega[-1])

    def summary(self) -> str:
        """Return a few lines on the fit, its error and its range."""
        low, high = self.valid_range
        at = "" if self.reference is None else f" at {self.reference:g} C"
        lines = [
            f"{self.name}: {self.omega.size} points",
            f"arms: {self.material.g.size}, plateau {self.material.g_inf:.4g} Pa, instantaneous"
            f" modulus {self.material.instantaneous_modulus:.4g} Pa",
            f"error (rms of log10 fit/data): storage {self.error_storage:.4f}, loss"
            f" {self.error_loss:.4f}, tan delta {self.error_tan_delta:.4f}; largest"
            f" {self.largest_error:.4f}",
            f"valid range: {low:.4g} to {high:.4g} rad/s ({low / (2 * math.pi):.4g} to"
            f" {high / (2 * math.pi):.4g} Hz){at}",
        ]
        if self.shifts and len(self.shifts) > 1:
            lines.append("shifts (log10 a_T): " + ", ".join(
                f"{t:g} C {shift:+.3f}" for t, shift in self.shifts))
        if self.overlap_error is not None:
            lines.append(f"overlap error (rms of log10): {self.overlap_error:.4f}")
        if self.wlf is not None:
            lines.append(f"WLF: c1 = {self.wlf.c1:.6g}, c2 = {self.wlf.c2:.6g} K at"
                         f" {self.wlf.t_ref:g} C")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def to_namelist(self, *, poisson: float = 0.5, temperature: float | None = None) -> str:
        """Return the `&material` group, with the errors and the range as comments.

        Parameters
        ----------
        poisson : float
            Poisson ratio.
        temperature : float, optional
            Temperature of the simulation, C; the reference temperature if left out. Another one
            needs WLF constants.

        Raises
        ------
        ValueError
            If a temperature is asked for and the shift is not known.
        """
        comment = "".join(f"! {line}\n" for line in self.summary().splitlines())
        if self.wlf is None:
            if temperature is not None and temperature != self.reference:
                raise ValueError(
                    f"temperature = {temperature:g}: the data give no WLF constants: give them"
                    " (wlf, --wlf C1 C2)")
            return comment + self.material.to_namelist(poisson=poisson)
        return comment + self.material.to_namelist(
            poisson=poisson, wlf=self.wlf,
            temperature=self.wlf.t_ref if temperature is None else temperature)

    def plot(self) -> Figure:
        """Draw data and fit, tan delta, and the error of both.

        Returns
        -------
        matplotlib Figure
        """
        return _draw(self)


def fit_dma(
    table: DmaTable,
    *,
    arms_per_decade: float = 1.0,
    reference: float | None = None,
    wlf: Sequence[float] | None = None,
    temperature_tolerance: float = 0.5,
    least_plateau: float = 0.01,
    slack: float = 0.05,
) -> DmaFit:
    """Fit a Prony series to a table.

    Parameters
    ----------
    table : DmaTable
        The measurements; rows in any order.
    arms_per_decade : float
        Density of the relaxation times.
    reference : float, optional
        Reference temperature, C. With `wlf` any, by default its own; without `wlf` the nearest one
        of the table, by default the middle one.
    wlf : (c1, c2) or (c1, c2, t_ref), optional
        Constants of the shift, -, K, C; t_ref is `reference` if left out. Without them several
        temperatures are shifted by `asperity.material.master_curve`.
    temperature_tolerance : float
        Temperatures closer than this (K) belong to one sweep.
    least_plateau : float
        The plateau g_inf is at least this share of the lowest storage modulus: positive also where
        the data do not reach it. 0 to 1.
    slack : float
        Relative increase of the misfit allowed for smoothness; see `asperity.material.Prony.fit`.

    Returns
    -------
    DmaFit

    Raises
    ------
    ValueError
        If an option is wrong, or the temperatures cannot be brought to one.
    """
    number("least_plateau", least_plateau, 0.0, 1.0)
    positive("temperature_tolerance", temperature_tolerance)
    notes = list(table.notes)
    constants = _constants(wlf, reference)
    sweeps: list[tuple[float, NDArray[np.intp]]] = []
    if table.temperature is not None:
        sweeps = _sweeps(table.temperature, temperature_tolerance)
    curve: MasterCurve | None = None
    shift = np.zeros(table.omega.size)  # log10 a_T of each point
    if len(sweeps) > 1:
        temperatures = [t for t, _ in sweeps]
        if constants is not None:
            for t, rows in sweeps:
                shift[rows] = math.log10(float(constants.shift_factor(t)))
        else:
            place = len(sweeps) // 2 if reference is None else int(
                np.argmin([abs(t - reference) for t in temperatures]))
            near = temperatures[place]
            if reference is not None and abs(near - reference) > temperature_tolerance:
                raise ValueError(
                    f"reference = {reference:g}: must be one of the temperatures"
                    f" {', '.join(f'{t:g}' for t in temperatures)}, or give WLF constants")
            _enough(table, sweeps)
            curve = master_curve(
                temperatures, [table.omega[r] for _, r in sweeps],
                [table.storage[r] for _, r in sweeps], [table.loss[r] for _, r in sweeps], near)
            for (_, rows), log_shift in zip(sweeps, curve.log_shift, strict=True):
                shift[rows] = log_shift
            reference, constants = near, curve.wlf
            if constants is None:
                notes.append("the shifts give no WLF constants: the material is known at"
                             f" {near:g} C only")
            notes += _doubts(table, sweeps, curve)
    elif len(sweeps) == 1:
        measured = sweeps[0][0]
        if constants is None:
            if reference is not None and abs(measured - reference) > temperature_tolerance:
                raise ValueError(f"reference = {reference:g}: the data are at {measured:g} C:"
                                 " give WLF constants (wlf, --wlf C1 C2)")
            reference = measured
        else:
            shift[:] = math.log10(float(constants.shift_factor(measured)))
    if constants is not None:
        reference = constants.t_ref
    reduced = table.omega * 10.0**shift
    order = np.argsort(reduced, kind="stable")
    omega, storage, loss = reduced[order], table.storage[order], table.loss[order]
    decades = math.log10(float(omega[-1] / omega[0]))
    if decades < 1e-3:
        raise ValueError(f"{table.name}: all {omega.size} points are at one frequency,"
                         f" {omega[0]:.4g} rad/s: a series needs a range of them, or several"
                         " temperatures with WLF constants (wlf, --wlf C1 C2)")
    if decades < 1.0:
        notes.append(f"the data cover {decades:.2g} decades of frequency: beyond them the series is"
                     " a guess")
    material = Prony.fit(omega, storage, loss, arms_per_decade=arms_per_decade, slack=slack,
                         least_plateau=least_plateau)
    if omega.size < material.g.size:
        notes.append(f"{omega.size} points for {material.g.size} arms: the series between them is a"
                     " guess")
    floor = least_plateau * float(storage.min())
    bounded = material.g_inf <= floor * (1.0 + 1e-9)
    if bounded:
        notes.append("the data do not show the plateau: it is held at"
                     f" {100 * least_plateau:g} % of the lowest storage modulus")
    found = material.complex_modulus(omega)
    errors = [np.log10(found.real / storage), np.log10(found.imag / loss)]
    errors.append(errors[1] - errors[0])
    rms = [float(np.sqrt(np.mean(error**2))) for error in errors]
    shifts = [(t, float(shift[rows[0]])) for t, rows in sweeps]
    return DmaFit(
        material, omega, storage, loss,
        None if table.temperature is None else table.temperature[order], reference, constants,
        shifts, None if curve is None else curve.overlap_error, *rms,
        float(max(np.abs(errors[0]).max(), np.abs(errors[1]).max())), bounded, table.name, notes)


def _constants(wlf: Sequence[float] | None, reference: float | None) -> WLF | None:
    """Return the constants, at the reference temperature that was asked for."""
    if reference is not None:
        number("reference", reference)
    if wlf is None:
        return None
    if len(wlf) == 2:
        if reference is None:
            raise ValueError("wlf: has 2 numbers: give its reference temperature, too"
                             " (reference, --reference T)")
        wlf = (*wlf, reference)
    if len(wlf) != 3:
        raise ValueError(f"wlf: has {len(wlf)} numbers: must be (c1, c2) or (c1, c2, t_ref)")
    c1, c2, t_ref = (number("wlf", value) for value in wlf)
    number("wlf c1", c1, 0.0)
    positive("wlf c2", c2)
    if reference is None or reference == t_ref:
        return WLF(c1, c2, t_ref)
    # The same shifts seen from another temperature (Williams, Landel and Ferry 1955).
    moved = c2 + reference - t_ref
    if moved <= 0.0:
        raise ValueError(f"reference = {reference:g}: must be > t_ref - c2 = {t_ref - c2:g}")
    return WLF(c1 * c2 / moved, moved, reference)


def _sweeps(temperature: FloatArray, tolerance: float) -> list[tuple[float, NDArray[np.intp]]]:
    """Return the temperatures, ascending, with their rows."""
    order = np.argsort(temperature, kind="stable")
    cuts = np.flatnonzero(np.diff(temperature[order]) > tolerance) + 1
    sweeps = []
    for rows in np.split(order, cuts):
        values = temperature[rows]
        if np.ptp(values) > 4.0 * tolerance:
            raise ValueError(
                f"temperatures from {values.min():g} to {values.max():g} C lie closer than"
                f" {tolerance:g} K to their neighbours: a ramp? Sweeps of the frequency at"
                " temperatures further apart are needed, or a smaller temperature_tolerance"
                " (--temperature-tolerance)")
        mean = float(values[0]) if np.ptp(values) == 0.0 else round(float(np.mean(values)), 6)
        sweeps.append((mean, rows))
    return sweeps


def _enough(table: DmaTable, sweeps: list[tuple[float, NDArray[np.intp]]]) -> None:
    """See that every sweep can be laid over its neighbour."""
    for t, rows in sweeps:
        if np.unique(table.omega[rows]).size < 3:
            count = int(np.unique(table.omega[rows]).size)
            raise ValueError(f"{table.name}: {count} frequenc{'y' if count == 1 else 'ies'} at"
                             f" {t:g} C: shifting needs at least 3, or WLF constants (wlf,"
                             " --wlf C1 C2)")


def _doubts(
    table: DmaTable, sweeps: list[tuple[float, NDArray[np.intp]]], curve: MasterCurve
) -> list[str]:
    """Say which sweeps hardly reach each other, or do not lie on one curve."""
    doubts = []
    ends = []
    for (t, rows), shift in zip(sweeps, curve.log_shift, strict=True):
        logs = np.log10(table.omega[rows]) + shift
        ends.append((t, float(logs.min()), float(logs.max())))
    for (t1, low1, high1), (t2, low2, high2) in zip(ends[:-1], ends[1:], strict=True):
        overlap = min(high1, high2) - max(low1, low2)
        if overlap < 0.15 * min(high1 - low1, high2 - low2):
            doubts.append(f"the sweeps at {t1:g} and {t2:g} C hardly overlap: their shift is"
                          " doubtful; leave one out or give WLF constants")
    if curve.overlap_error > 0.05:
        doubts.append("neighbouring sweeps do not lie on one curve: the shifts are doubtful")
    return doubts


def _draw(fit: DmaFit) -> Figure:
    """Draw a fit: moduli, tan delta, errors."""
    import matplotlib.pyplot as plt

    from .plot import COLOURS

    figure, (top, middle, bottom) = plt.subplots(
        3, 1, figsize=(6.4, 7.6), sharex=True, layout="constrained",
        gridspec_kw={"height_ratios": [3, 2, 1.6]})
    low, high = fit.valid_range
    fine = np.geomspace(low / 10.0, high * 10.0, 600)
    modulus = fit.material.complex_modulus(fine)
    inside = (fine >= low) & (fine <= high)
    found = fit.material.complex_modulus(fit.omega)
    names = ("storage modulus $G'$", "loss modulus $G''$", r"loss factor $\tan\delta$")
    curves = (modulus.real, modulus.imag, modulus.imag / modulus.real)
    data = (fit.storage, fit.loss, fit.loss / fit.storage)
    fitted = (found.real, found.imag, found.imag / found.real)
    for k, (name, curve, points, values) in enumerate(
            zip(names, curves, data, fitted, strict=True)):
        axes, colour, marker = (top, top, middle)[k], COLOURS[k], "os^"[k]
        axes.loglog(fit.omega, points, marker, color=colour, markersize=4, alpha=0.6,
                    markeredgewidth=0, label=f"{name}: data")
        axes.loglog(fine, curve, "--", color=colour, linewidth=0.8)
        axes.loglog(fine[inside], curve[inside], "-", color=colour, label="fit")
        bottom.semilogx(fit.omega, np.log10(values / points), marker, color=colour, markersize=3.5,
                        alpha=0.8, markeredgewidth=0)
    material = fit.material
    top.loglog(1.0 / material.tau, material.g, "x", color=COLOURS[6], markersize=5,
               label=r"arms $(1/\tau_k, g_k)$")
    visible = material.g[(1.0 / material.tau >= fine[0]) & (1.0 / material.tau <= fine[-1])]
    least = min(float(fit.loss.min()), float(visible.min(initial=np.inf)))
    top.set_ylim(max(0.4 * least, 1e-3 * float(fit.loss.min())),
                 2.5 * max(float(modulus.real.max()), float(visible.max(initial=0.0))))
    top.set_xlim(fine[0], fine[-1])
    for axes in (top, middle):
        axes.axvspan(fine[0], low, color="0.93", zorder=0)
        axes.axvspan(high, fine[-1], color="0.93", zorder=0)
    bottom.axvspan(fine[0], low, color="0.93", zorder=0)
    bottom.axvspan(high, fine[-1], color="0.93", zorder=0)
    bottom.axhline(0.0, color="0.5", linewidth=0.8)
    reach = max(1.2 * fit.largest_error, 1e-3)
    spread = float(np.abs(np.log10(fitted[2] / data[2])).max())
    bottom.set_ylim(-max(reach, 1.2 * spread), max(reach, 1.2 * spread))
    top.set_ylabel("shear modulus (Pa)")
    middle.set_ylabel(r"$\tan\delta$ (-)")
    bottom.set_ylabel(r"$\log_{10}$(fit/data)")
    at = "" if fit.reference is None else f" at {fit.reference:g} °C"
    bottom.set_xlabel(rf"angular frequency $\omega${at} (rad/s)")
    bottom.set_title(
        f"rms: $G'$ {fit.error_storage:.3f}, $G''$ {fit.error_loss:.3f},"
        rf" $\tan\delta$ {fit.error_tan_delta:.3f} (grey: beyond the data)", fontsize=9)
    top.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=8)
    middle.legend(frameon=False, fontsize=8)
    return figure
