"""The sources of roads and rubbers: files of several kinds, or specifications in words."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.check import poisson_ratio, shown
from ..base.tables import is_number, text_lines, text_of
from ..roads.measured import MeasuredSurface, load
from ..roads.patches import DrawnRoad, MeasuredRoad, cleaned, have_equal_heights
from ..roads.spectra import Spectrum, join_spectra, spectrum_of_map
from ..rubber.compound import Compound
from ..rubber.dma_fit import fit_dma, wlf_constants
from ..rubber.dma_table import read_dma
from ..rubber.material import Prony
from ..rubber.wlf import WLF
from ..runs.case import Case
from ..theory.rough import self_affine_psd
from .spectrum_files import spectrum_of_file

__all__ = ["compound_of", "file_of_road", "road_of"]

Road = DrawnRoad | MeasuredRoad

_OWN = ("unit", "size", "channel", "transpose", "periodic")  # they may follow the name of a road
_SELF_AFFINE = ("hurst", "wavelength_long", "wavelength_rolloff", "wavelength_short", "rms_height",
                "rms_slope")


def road_of(
    sources: Sequence[str | Path | MeasuredSurface | Spectrum],
    *,
    cells: int = 512,
    side: float | None = None,
    join: str | None = None,
    short: float | None = None,
    outliers: str = "report",
    draw: bool = False,
    seed: int = 1,
    **options: Any,
) -> Road:
    """Return the road that files or words describe.

    Parameters
    ----------
    sources : sequence of str, Path, MeasuredSurface or Spectrum
        Each source is one of these. A measured map in any format that `asperity.surface.load`
        reads: patches are cut from it. Options of this file alone may follow its name, as in
        ``"plate.csv:unit=um,size=4000x3000,channel=Height,transpose=yes,periodic=as-is"``. A
        profile: it stands for the isotropic road with such profiles. ``"spectrum:FILE"``: a table
        of wave numbers (rad/m) and densities.
        ``"self_affine:hurst=0.8,wavelength_long=1e-3,wavelength_short=1e-5,rms_slope=0.2"``.
        Spectra and profiles are combined into one spectrum.
    cells : int
        Number of cells along a side of each patch.
    side : float, optional
        Length of a side of drawn patches, m.
    join, short, outliers, seed
        As in `asperity.roads.patches.MeasuredRoad`.
    draw : bool
        Draw random maps from the combined spectrum of the maps, instead of cutting patches.
    **options
        Options of `asperity.surface.load`, which count for all files; the options of a single file
        take precedence. By default maps that are not periodic lose their mean plane (`level`).

    Returns
    -------
    DrawnRoad or MeasuredRoad

    Raises
    ------
    OSError, ValueError
        If a file cannot be read, or does not describe a road.
    """
    if not sources:
        raise ValueError("roads: none given: must be at least one")
    _check_twice(sources)
    seed = _seed(seed)
    maps: list[MeasuredSurface] = []
    spectra: list[Spectrum] = []
    measured: list[MeasuredSurface] = []  # maps and profiles of which only the spectrum counts
    if options and not any(map(_is_file_of_map, sources)):
        raise ValueError(f"{', '.join(options)}: only for roads that are files of maps or profiles")
    several = sum(map(_is_file_of_map, sources)) > 1
    for source in sources:
        try:
            found = _road_source(source, options)
        except ValueError as error:
            if several and re.search(r"^(unit|size)\b|names no unit|gives no lengths", str(error)):
                raise ValueError(f"{error}; unit and size (--unit, --size) count for all roads:"
                                 " give a road its own, as ROAD:unit=um,size=4000x3000") from None
            raise
        if isinstance(found, Spectrum):
            spectra.append(found)
        elif found.height.shape[0] == 1 or draw:
            clean, notes = cleaned(found, outliers)
            if any(have_equal_heights(clean, other) for other in measured):
                raise ValueError(f"{clean.source.get('name', 'map')}: has the heights of another"
                                 " road: its spectrum would count twice")
            measured.append(clean)
            spectrum = spectrum_of_map(clean.height, clean.lx, clean.ly, periodic=clean.periodic,
                                       name=str(clean.source.get("name", "map")))
            spectra.append(replace(spectrum, notes=[*notes, *spectrum.notes]))
        else:
            maps.append(found)
    if maps and spectra:
        raise ValueError("roads: maps and spectra together: give one kind, or draw = True (--draw)"
                         " for maps from the joined spectrum of all")
    if maps:
        if side is not None:
            raise ValueError("side: is for drawn roads only: patches of maps have the maps' cells")
        return MeasuredRoad(maps, cells, join, short, outliers, seed)
    if join is not None:
        raise ValueError("join: is for patches of measured maps only")
    if outliers != "report" and not measured:
        raise ValueError("outliers: is for measured maps and profiles only")
    return DrawnRoad(join_spectra(spectra), cells, side, short, seed)


def _check_twice(sources: Sequence[Any]) -> None:
    """Refuse a source that is given twice: its patches would count twice in the intervals."""
    seen = set()
    for source in sources:
        if not isinstance(source, str | Path):
            continue
        words = str(source)
        kind, colon, file = words.rpartition("spectrum:")
        known = words
        if not words.startswith("self_affine:"):
            path, own = (file, {}) if colon else _own_options(words)
            known = f"{kind}{colon}{Path(path).resolve()} {own.get('channel', '')}"
        if known in seen:
            raise ValueError(f"roads: {words} is given twice: its patches would count as"
                             " independent ones")
        seen.add(known)


def _is_file_of_map(source: Any) -> bool:
    """Return whether a source is a file that `asperity.surface.load` reads."""
    return isinstance(source, str | Path) and not str(source).startswith(
        ("self_affine:", "spectrum:"))


def file_of_road(source: str | Path) -> Path | None:
    """Return the file that a source names, or None if it names none.

    Examples
    --------
    >>> file_of_road("spectrum:psd.csv").name, file_of_road("plate.csv:unit=um").name
    ('psd.csv', 'plate.csv')
    """
    words = str(source)
    if words.startswith("self_affine:"):
        return None
    if words.startswith("spectrum:"):
        return Path(words.partition(":")[2])
    return Path(_own_options(words)[0])


def _own_options(words: str) -> tuple[str, dict[str, Any]]:
    """Return the name of a file, and the options that follow it.

    Examples
    --------
    >>> _own_options("plate.csv:unit=um,size=4000x3000")
    ('plate.csv', {'unit': 'um', 'size': [4000.0, 3000.0]})
    """
    file, colon, rest = words.rpartition(":")
    if not colon or "=" not in rest or Path(words).exists():
        return words, {}
    kind = words.partition(":")[0]
    near = difflib.get_close_matches(kind, ["self_affine", "spectrum"], n=1)
    if near and not Path(file).exists():
        raise ValueError(f"{words}: {kind!r} is no kind of road: did you mean {near[0]}:?")
    options: dict[str, Any] = {}
    for part in rest.split(","):
        name, _, text = (one.strip() for one in part.partition("="))
        if name not in _OWN or not text or name in options:
            raise ValueError(f"{words}: {part!r}: must be NAME=VALUE, NAME one of"
                             f" {', '.join(_OWN)}, each once")
        options[name] = text
    if "size" in options:
        lengths = re.split("[x×]", options["size"])
        if len(lengths) > 2 or not all(map(is_number, lengths)):
            raise ValueError(f"{words}: size = {options['size']!r}: must be two lengths, as"
                             " 4000x3000, or one for a profile")
        options["size"] = [float(length) for length in lengths]
    if "transpose" in options:
        if options["transpose"] not in ("yes", "no"):
            raise ValueError(f"{words}: transpose = {options['transpose']!r}: must be yes or no")
        options["transpose"] = options["transpose"] == "yes"
    if options.get("periodic", "as-is") != "as-is":
        raise ValueError(f"{words}: periodic = {options['periodic']!r}: must be as-is, for a map"
                         " whose opposite edges match")
    return file, options


def _seed(value: Any) -> int:
    """Return a seed as an int."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not (
            0 <= value < 2**32):
        raise ValueError(f"seed = {value!r}: must be an integer from 0 to {2**32 - 1}")
    return int(value)


def _road_source(source: str | Path | MeasuredSurface | Spectrum, options: dict[str, Any]
                 ) -> MeasuredSurface | Spectrum:
    """Return the map or the spectrum of one source."""
    if isinstance(source, MeasuredSurface | Spectrum):
        return source
    words = str(source)
    if words.startswith("self_affine:"):
        return _self_affine(words.partition(":")[2])
    if words.startswith("spectrum:"):
        if words == "spectrum:":
            raise ValueError("spectrum: names no file: must be spectrum:FILE")
        return spectrum_of_file(Path(words.partition(":")[2]))
    if not isinstance(source, str | Path):
        raise ValueError(f"roads: is of the type {type(source).__name__}: must be the name of a"
                         " file, words such as 'self_affine:...', a MeasuredSurface or a Spectrum;"
                         " an array becomes a file with asperity.surface.save")
    file, own = _own_options(words)
    # Without its mean plane a periodic map would jump at its edges: only the others lose the plane.
    return load(file, **{"level": None, **options, **own})


def _self_affine(words: str) -> Spectrum:
    """Return the spectrum of the words ``hurst=0.8,...``."""
    values: dict[str, float] = {}
    for part in filter(None, words.split(",")):
        name, equals, text = part.partition("=")
        name = name.strip()
        if not equals or name not in _SELF_AFFINE or not is_number(text.strip()):
            raise ValueError(f"self_affine: {part!r}: must be NAME=NUMBER, NAME one of"
                             f" {', '.join(_SELF_AFFINE)}")
        if name in values:
            raise ValueError(f"self_affine: {name} is given twice")
        values[name] = float(text)
    lacks = [name for name in ("hurst", "wavelength_long", "wavelength_short")
             if name not in values]
    if lacks:
        raise ValueError(f"self_affine: lacks {', '.join(lacks)}")
    long, short = values["wavelength_long"], values["wavelength_short"]
    rolloff = values.get("wavelength_rolloff", long)
    if short > 0.0 and not short < long:
        raise ValueError(f"self_affine: wavelength_long = {long:g}: must be > wavelength_short ="
                         f" {short:g}")
    if short > 0.0 and not short < rolloff <= long:
        raise ValueError(f"self_affine: wavelength_rolloff = {rolloff:g}: must be from"
                         f" wavelength_short = {short:g} to wavelength_long = {long:g}")
    try:
        wave, psd = self_affine_psd(values["hurst"], long, rolloff, short,
                                    rms_height=values.get("rms_height"),
                                    rms_slope=values.get("rms_slope"))
    except ValueError as error:
        raise ValueError(f"self_affine: {error}") from None
    return Spectrum(wave, psd, "self-affine road")


def compound_of(
    source: str | Path | Prony | Compound,
    *,
    wlf: Sequence[float] | None = None,
    reference: float | None = None,
    vertical: bool = False,
    arms_per_decade: float = 1.0,
    temperature_tolerance: float | None = None,
    columns: Mapping[str, str | int] | None = None,
    **reading: Any,
) -> Compound:
    """Return the rubber of a namelist with ``&material``, of a DMA table, or of a Prony series.

    Parameters
    ----------
    source : str, Path, Prony or Compound
        A file whose first word is a group, such as ``&material``, is a namelist. Any other file is
        a table for `asperity.dma.read_dma`.
    wlf, reference, vertical, arms_per_decade, temperature_tolerance
        As in `asperity.dma.fit_dma`, for tables.
    columns : mapping, optional
        Columns of a table by role, as in `asperity.dma.read_dma`.
    **reading
        Units and kind of the moduli of a table, as in `asperity.dma.read_dma`.

    Returns
    -------
    Compound

    Raises
    ------
    OSError, ValueError
        If the file cannot be read, or does not describe a rubber.
    """
    shift = {"wlf": wlf, "reference": reference}
    of_table = {"vertical": vertical or None,
                "arms_per_decade": None if arms_per_decade == 1.0 else arms_per_decade,
                "temperature_tolerance": temperature_tolerance, "columns": columns or None,
                **reading}
    if isinstance(source, Compound):
        _refuse(shift | of_table, "the material is a Compound, which is complete")
        return source
    if isinstance(source, Prony):
        _refuse(of_table, "the material is a Prony series")
        constants = wlf_constants(wlf, reference)
        usual = reference if constants is None else constants.t_ref
        return Compound(source, None if usual is None else float(usual), constants)
    if not isinstance(source, str | Path):
        raise ValueError(f"material = {shown(source)}: must be the name of a file, a Prony or a"
                         " Compound")
    path = Path(source)
    lines = text_lines(path)
    words = next((line.strip() for _, line in lines if not line.strip().startswith("!")), "")
    if words.startswith(("&", "$")):
        _refuse(shift | of_table, f"{path} is a namelist, which has its own wlf_c1, wlf_c2 and"
                " reference_temperature")
        return _of_namelist(path)
    table = read_dma(path, columns=columns, **reading)
    fit = fit_dma(table, wlf=wlf, reference=reference, vertical=vertical,
                  arms_per_decade=arms_per_decade, **(
                      {} if temperature_tolerance is None
                      else {"temperature_tolerance": temperature_tolerance}))
    return fit.compound()


def _refuse(options: Mapping[str, Any], reason: str) -> None:
    """Refuse options of DMA tables that were given for another source of a rubber."""
    for name, value in options.items():
        if value is not None:
            option = "column" if name == "columns" else name.replace("_", "-")
            raise ValueError(f"{name} (--{option}): is for DMA tables only: {reason}")


def _of_namelist(path: Path) -> Compound:
    """Return the rubber of the group `&material` of an input."""
    group = Case.read(path).material
    spring = float(group.shear_modulus or 0.0)
    if not (spring or group.zener_g0 or group.prony_g):
        raise ValueError(f"{path}: has no moduli: must have a group &material with shear_modulus"
                         " and Prony arms or Zener branches")
    try:
        if group.zener_g0:
            series = Prony.from_zener(spring, group.zener_g0, group.zener_g1 or (),
                                      group.zener_eta or ())
        else:
            series = Prony(spring, group.prony_g or (), group.prony_tau or ())
    except ValueError as error:
        raise ValueError(f"{path}: &material: {error}") from None
    reference = float(group.reference_temperature)
    wlf = None
    if group.wlf_c1 and group.wlf_c2:
        wlf = WLF(float(group.wlf_c1), float(group.wlf_c2), reference)
    given = reference if group.temperature is None else float(group.temperature)
    poisson = poisson_ratio(float(group.poisson or 0.0))
    valid_range, shifts, vertical, rise = _of_comments(path)
    series = Prony(series.g_inf / rise, series.g / rise, series.tau)
    return Compound(series, reference, wlf, shifts if wlf else {}, vertical if wlf else {},
                    valid_range=valid_range, name=path.name, poisson=poisson, usual=given)


def _of_comments(path: Path) -> tuple[tuple[float, float] | None, dict[float, float],
                                      dict[float, float], float]:
    """Return what `asperity fit` writes as comments.

    These are the range of the measured frequencies, the horizontal and the vertical shifts, and
    b_T if the moduli of the group are multiplied by it.
    """
    found: tuple[float, float] | None = None
    rise = 1.0
    shifts: dict[str, dict[float, float]] = {"a_T": {}, "b_T": {}}
    for line in text_of(path).splitlines():
        range_ = re.match(r"! valid range: (\S+) to (\S+) rad/s", line)
        if range_ and is_number(range_[1]) and is_number(range_[2]):
            found = float(range_[1]), float(range_[2])
        factor = re.match(r"! moduli of the group: times b_T = (\S+) at ", line)
        if factor and is_number(factor[1]) and float(factor[1]) > 0.0:
            rise = float(factor[1])
        kind = re.match(r"! (?:vertical )?shifts \(log10 ([ab]_T)\): ", line)
        if kind:
            shifts[kind[1]] = {float(celsius): float(shift) for celsius, shift
                               in re.findall(r"(-?[\d.]+(?:e[-+]?\d+)?) C ([-+][\d.]+)", line)}
    return found, shifts["a_T"], shifts["b_T"], rise
