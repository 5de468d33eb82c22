"""Reading of files from instruments, by SurfaceTopography or as tables of numbers."""

from __future__ import annotations

import contextlib
import hashlib
import io
import math
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, positive
from ..base.names import counted
from ..base.tables import text_of
from .grid_files import esri_grid
from .height_checks import refuse_other_numbers
from .map_files import own_map, text_map, text_table, unit_of_dataset
from .text_repair import repaired_matrix, with_height

__all__ = ["UNITS", "channels", "read_map", "to_metres"]

FloatArray = NDArray[np.float64]

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12, "A": 1e-10, "km": 1e3,
         "inch": 0.0254}
_MICRO = {"\u00b5m": "um", "\u03bcm": "um", "\u00c5": "A", "\u212b": "A", "in": "inch"}
_PARTS = {"mm": 1e3, "um": 1e6, "nm": 1e9, "pm": 1e12, "A": 1e10}  # exact, unlike 1e-6
_HDF5 = "h5"            # format of HDF5 files of others, as SurfaceTopography calls it
_SURFACE = "surface"    # dataset that `&surface file` reads by default, beside surface/height
_LARGEST = 1e100        # heights above this would overflow in the statistics, in any unit
_NEEDS = "pip install SurfaceTopography"


def channels(path: str | Path) -> list[str]:
    """Return one line per channel of a file, with its id, kind, size and unit.

    Parameters
    ----------
    path : str or Path
        A file in a format that SurfaceTopography knows.

    Returns
    -------
    list of str
        Descriptions of the channels.

    Raises
    ------
    OSError
        If the file is missing, or its format is not known.
    ImportError
        If SurfaceTopography is not installed.
    """
    with _quiet(), _open(Path(path)) as reader:
        return [_channel_line(channel) for channel in reader.channels]


def _unknown(path: Path) -> str:
    """Say why a file has no format that is known."""
    if path.suffix == ".npy":
        try:
            array = np.load(path, mmap_mode="r", allow_pickle=False)
        except (OSError, ValueError):
            pass
        else:
            return (f"holds numbers of the type {array.dtype} and the shape {array.shape}:"
                    " heights must be real numbers in two dimensions")
    return "is of no format that SurfaceTopography knows"


def _open(path: Path) -> Any:
    """Open a file with SurfaceTopography."""
    try:
        from SurfaceTopography import open_topography
    except ImportError:
        raise ImportError(f"SurfaceTopography is not installed: {_NEEDS}") from None
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such file")
    if path.is_dir():
        raise OSError(f"{path}: is a folder, not a file")
    if not path.stat().st_size:
        raise OSError(f"{path}: is empty")
    for reader_of in (own_map, esri_grid):
        if (reader := reader_of(path)) is not None:
            return reader
    try:
        with _quiet():
            reader = open_topography(_readable(path))
    except Exception as error:  # readers of damaged files raise what they meet
        if type(error).__name__ != "CannotDetectFileFormat":
            raise OSError(f"{path}: cannot be read as a topography: {_reason(error)}") from None
        try:
            return text_map(path)
        except ValueError as fault:
            if re.search("is not a text file|no table of numbers", str(fault)):
                raise OSError(f"{path}: {_unknown(path)}") from None
            raise
    try:
        empty = not reader.channels
    except Exception as error:  # readers of damaged files raise what they meet
        raise OSError(f"{path}: cannot be read as a topography: {_reason(error)}") from None
    if empty:
        raise OSError(f"{path}: was read as the format {reader.format()!r} and holds no heights:"
                      " an instrument's own file is needed, or a table of numbers; the grey values"
                      " of a picture have no unit")
    if reader.format() in ("asc", "xyz"):
        reader = _complete_text(reader, path)
    if _is_doubtful(reader, path):
        try:
            found = text_map(path)
        except ValueError as fault:
            if reader.format() != "hgt":
                raise
            reason = _reason(fault).removeprefix(f"{path}: ")
            if reason == "holds only comments":  # the file is text without any heights
                raise
            raise OSError(f"{path}: is of no known format: {reason}") from None
        finally:
            reader.close()
        return found
    return reader


def _readable(path: Path) -> Any:
    """Return the name of a file, or its text, if words in a matrix had to be replaced.

    SurfaceTopography reads the lines above a word again for each of them, which takes minutes for
    large matrices.
    """
    with path.open("rb") as file:
        start = file.read(4096)
    if b"\0" in start or start[1:4] == b"ISO":  # binary, or a text with a format of its own
        return str(path)
    try:
        text = repaired_matrix(path, 1)
    except ValueError:
        return str(path)
    return str(path) if text is None else io.BytesIO(text.encode())


def _complete_text(reader: Any, path: Path) -> Any:
    """Return a reader that reads every line of a text file.

    SurfaceTopography takes lines with words for headers, and all lines above them, if the file has
    columns of points. It also takes heights in the unit of x where a heading names two units.
    """
    if reader.format() == "xyz":
        with path.open("rb") as file:
            special = file.read(20).startswith((b"X;Y;valid", b"Scan Parameters"))
        if not special:
            reader.close()
            return text_map(path, "xyz")
        lines, points = len(text_table(path)[0]), int(np.prod(reader.channels[0].nb_grid_pts))
        if lines != points:
            raise ValueError(f"{path}: has {lines} lines of numbers, but only {points} could be"
                             " read: write nan for missing values")
        return reader
    text = repaired_matrix(path, len(reader.channels))
    return reader if text is None else _reopened(reader, text)


def _reopened(reader: Any, text: str) -> Any:
    """Return a reader of the same format for another text, in place of a reader."""
    from SurfaceTopography import open_topography

    reader.close()
    with _quiet():
        return open_topography(io.BytesIO(text.encode()), format=reader.format())


def _with_length_y(path: Path, reader: Any, chosen: Any, size: Any, y_first: bool) -> Any:
    """Return a reader of a text matrix whose header gives only its length along x.

    The length along y is that of `size`, if it is given, otherwise it makes the pixels square.
    """
    length = float(chosen.physical_sizes[0])
    nx, ny = chosen.nb_grid_pts
    other = length * ny / nx
    if size is not None:
        given, other = _size_of(path, chosen.dim, size, y_first)
        if not math.isclose(given, length, rel_tol=1e-6):
            raise ValueError(f"size: {path} has its own length along {'xy'[y_first]},"
                             f" {length:g} {_unit_of(chosen.unit) or ''}".rstrip())
    # The header may have another unit than the heights, in which lengths are given here.
    factor = float(chosen.info["raw_metadata"]["physical_size_x"]) / length
    text = repaired_matrix(path, len(reader.channels)) or text_of(path)
    return _reopened(reader, with_height(text, other * factor))


def _is_doubtful(reader: Any, path: Path) -> bool:
    """Return whether to try reading a file as a table instead.

    The format HGT has no signature: any file of 2 n^2 bytes could be one. Furthermore,
    SurfaceTopography reads points on a grid with holes as a matrix of two or three columns.
    """
    if reader.format() == "hgt":
        return path.suffix.lower() != ".hgt"
    return (reader.format() in ("asc", "matrix") and len(reader.channels) == 1
            and reader.channels[0].physical_sizes is None
            and reader.channels[0].dim == 2 and reader.channels[0].nb_grid_pts[0] in (2, 3))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress output and warnings of the readers that try a file."""
    nowhere = io.StringIO()
    with (contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere),
          warnings.catch_warnings()):
        warnings.simplefilter("ignore")
        yield


def _reason(error: Exception) -> str:
    """Return the first line of a message."""
    return str(error).strip().split("\n")[0] or type(error).__name__


def to_metres(value: Any, unit: str) -> Any:
    """Return lengths in m, rounded correctly: 60 um are 6e-5 m to the last digit.

    Raises
    ------
    ValueError
        If the unit is not known.
    """
    unit = choice("unit", _unit_of(unit) or "", tuple(UNITS))
    return value / _PARTS[unit] if unit in _PARTS else value * UNITS[unit]


def _channel_line(channel: Any) -> str:
    """Return a description of a channel in one line."""
    points = " x ".join(map(str, channel.nb_grid_pts or ())) or "?"
    kind = "map" if channel.dim == 2 else "line scan"
    data = "heights" if channel.is_height_channel else str(channel.data_kind.name).lower()
    unit = f"unit {channel.unit}" if channel.unit else "no unit"
    return f"{channel.channel_id!r}: {kind} of {data}, {points} points, {unit}"


def _choose(reader: Any, path: Path, wanted: str | int | None) -> Any:
    """Return the channel that was asked for."""
    known = list(reader.channels)
    listed = "; ".join(_channel_line(channel) for channel in known)
    if wanted is None and reader.format() == _HDF5:
        return _choose_dataset(path, known, listed)
    if wanted is None:
        first = reader.default_channel
        if not first.is_height_channel:
            first = next((item for item in known if item.is_height_channel), None)
        if first is None:
            raise ValueError(f"{path}: holds no heights: {listed}")
        return first
    ids = [channel.channel_id for channel in known]
    if str(wanted) not in ids and str(wanted).lstrip("-").isdigit():
        index = int(wanted)
        if not 0 <= index < len(known):
            raise ValueError(f"channel = {wanted}: {path} has the channels 0 to"
                             f" {len(known) - 1}: {listed}")
        wanted = ids[index]
    found = [item for item in known if wanted in (item.channel_id, item.name)]
    if not found:
        raise ValueError(f"channel = {wanted!r}: {path} has {listed}")
    if not found[0].is_height_channel:
        raise ValueError(f"channel = {wanted!r}: holds no heights: {_channel_line(found[0])}")
    return found[0]


def _choose_dataset(path: Path, known: list[Any], listed: str) -> Any:
    """Return the dataset of an HDF5 file of others: `surface`, as the program, or the only one."""
    found = [channel for channel in known if channel.name == _SURFACE] or known
    if len(found) > 1:
        raise ValueError(f"{path}: holds several datasets: say which (channel, --channel):"
                         f" {listed}")
    return found[0]


def _unit_of(name: str | None) -> str | None:
    """Return the name of a unit in ASCII, or None if there is no unit."""
    return None if name is None else _MICRO.get(str(name).strip(), str(name).strip()) or None


def read_map(
    path: Path, channel: str | int | None, unit: str | None, size: Any, transpose: bool
) -> tuple[FloatArray, list[float], bool, str, dict[str, Any]]:
    """Return heights, lengths, periodicity, unit and source of a file.

    The heights have the shape (ny, nx), with NaN at missing points. Heights and lengths are in the
    unit of the file.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If an argument is not allowed, or contradicts the file, or is missing in both.
    """
    given = _unit_of(unit)
    if given is not None:
        choice("unit", given, tuple(UNITS))
    with _quiet(), _open(path) as reader:
        chosen = _choose(reader, path, channel)
        if not chosen.is_uniform:
            raise ValueError(
                f"{path}: channel {chosen.channel_id!r} is a line scan with points at uneven"
                " distances: a run needs a regular grid; interpolate it first, as with"
                " SurfaceTopography's to_uniform")
        used = _used_unit(path, _unit_of(chosen.unit) or _dataset_unit(path, reader, chosen), given,
                          lengths=chosen.physical_sizes is not None or size is not None)
        # The program reads the dataset `surface` with the shape (ny, nx), so that it has no other
        # meaning here. SurfaceTopography reads all datasets with x first.
        rows_first = reader.format() == _HDF5 and chosen.name == _SURFACE
        if transpose and rows_first:
            raise ValueError(f"transpose: the dataset {_SURFACE!r} of {path} has y first already,"
                             " as `&surface file` reads it: leave transpose (--transpose) out; if"
                             " its first index runs along x, store it under another name")
        y_first = transpose or rows_first
        if chosen.physical_sizes is not None and len(chosen.physical_sizes) < chosen.dim:
            reader = _with_length_y(path, reader, chosen, size, y_first)
            chosen, size = _choose(reader, path, channel), None
        arguments: dict[str, Any] = {}
        if chosen.physical_sizes is None:
            arguments["physical_sizes"] = _size_of(path, chosen.dim, size, y_first)
        elif size is not None:
            known = " x ".join(f"{float(length):g}" for length in chosen.physical_sizes)
            named = _unit_of(chosen.unit) or ""
            raise ValueError(f"size: {path} has its own, {known} {named}".rstrip())
        if chosen.unit is None:
            arguments["unit"] = used
        try:
            heights, lengths, periodic, metadata = _heights(path, reader, chosen, arguments)
        except Exception as error:
            raise OSError(f"{path}: cannot be read: {_reason(error)}") from None
        source = {
            "name": path.name,
            "format": reader.format(),
            "channel": str(chosen.channel_id),
            "bytes": path.stat().st_size,
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
            "metadata": metadata,
        }
    array: FloatArray = np.ma.filled(np.ma.asarray(heights, dtype=float), np.nan)
    array = np.where(np.isfinite(array), array, np.nan)
    if array.ndim == 1:
        array, lengths = array[None, :], [lengths[0], lengths[0] / array.size]
    elif y_first:
        lengths.reverse()
    else:
        array = array.T
    _check_heights(path, array, transpose)
    refuse_other_numbers(path, array)
    return array, lengths, periodic, used, source


def _dataset_unit(path: Path, reader: Any, chosen: Any) -> str | None:
    """Return the unit in the attribute `units` of an HDF5 dataset, if it is one of length."""
    if reader.format() != _HDF5:
        return None
    import h5py

    with h5py.File(path, "r") as file:  # with locks, as the reader has opened it
        found = unit_of_dataset(file[chosen.name])
    return found if found in UNITS else None


def _used_unit(path: Path, named: str | None, given: str | None, lengths: bool) -> str:
    """Return the unit that a file names, or the given one if it names none.

    If there is none, the message also says whether the `lengths` are missing, so that the user can
    give both at once.
    """
    if named is not None and named not in UNITS:
        raise ValueError(f"{path}: has the unit {named!r}: must be one of {', '.join(UNITS)}")
    if named is not None and given is not None and named != given:
        raise ValueError(f"unit = {given!r}: {path} has its own unit, {named!r}; `scale` scales"
                         " the heights")
    used = named or given
    if used is None and lengths:
        raise ValueError(f"{path}: names no unit of length: give one (unit = 'um', --unit um)")
    if used is None:
        raise ValueError(f"{path}: names no unit and gives no lengths: give both (unit = 'um' and"
                         " size = (lx, ly), --unit um --size LX LY)")
    return used


def _check_heights(path: Path, array: FloatArray, transpose: bool) -> None:
    """Refuse a map of one column, and heights whose squares overflow."""
    if array.shape[1] < 2:
        where = "" if transpose or array.size < 2 else "; transpose (--transpose) turns the map"
        raise ValueError(f"{path}: has one cell along x: a run needs at least 2{where}")
    impossible = np.abs(array) > _LARGEST
    if impossible.any():
        j, i = np.argwhere(impossible)[0]
        raise ValueError(f"{path}: height[{j}, {i}] = {array[j, i]:.6g} (row {j}, column {i}, from"
                         " 0): is too large for a height; if it marks a missing value, write nan")


def _heights(
    path: Path, reader: Any, channel: Any, arguments: dict[str, Any]
) -> tuple[Any, list[float], bool, dict[str, Any]]:
    """Return the heights of a channel with x first, its lengths, periodicity and metadata."""
    if reader.format() == "npy":  # NumPy is much faster than the reader of SurfaceTopography
        heights = np.load(path, allow_pickle=False)
        return heights, [float(length) for length in arguments["physical_sizes"]], False, {}
    topography = channel.topography(**arguments)
    lengths = [float(length) for length in topography.physical_sizes]
    return topography.heights(), lengths, bool(topography.is_periodic), dict(topography.info or {})


def _size_of(path: Path, dim: int, size: Any, transpose: bool) -> tuple[float, ...]:
    """Return the given lengths in the order of the file's indices."""
    if size is None:
        raise ValueError(f"{path}: gives no lengths: give them (size = (lx, ly), --size LX LY)")
    values = [positive("size", value) for value in np.atleast_1d(np.asarray(size, dtype=object))]
    if len(values) != dim:
        raise ValueError(f"size: has {counted(len(values), 'length')}, must have {dim}")
    return tuple(reversed(values)) if transpose else tuple(values)
