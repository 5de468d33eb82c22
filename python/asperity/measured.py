"""Measured topographies: read by SurfaceTopography, made ready for a run, kept with their story.

What is done to the heights comes in this order: crop, level, fill missing points, invert, scale,
resample, window. Every step is noted, and written into the file with the source's name, size and
checksum and what the instrument said.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._check import choice, number, positive, whole
from ._library import version
from ._map_files import own_map, text_map

__all__ = ["MeasuredSurface", "channels", "import_topography", "load"]

FloatArray = NDArray[np.float64]

LEVELS = ("none", "mean", "tilt", "curvature")
WINDOWS = ("hann", "tukey")
UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12, "A": 1e-10, "km": 1e3,
         "inch": 0.0254}
_MICRO = {"\u00b5m": "um", "\u03bcm": "um", "\u00c5": "A", "\u212b": "A", "in": "inch"}
_PARTS = {"mm": 1e3, "um": 1e6, "nm": 1e9, "pm": 1e12, "A": 1e10}  # exact, unlike 1e-6
_NEEDS = "pip install 'asperity[import]' (or SurfaceTopography)"


@dataclass(frozen=True)
class MeasuredSurface:
    """A measured height map, ready for a run.

    Attributes
    ----------
    height : ndarray, shape (ny, nx)
        Height, m, summits largest; row j lies at y = j ly/ny. A line scan has ny = 1.
    lx, ly : float
        Lengths, m.
    periodic : bool
        Whether opposite edges fit: the file says so, or a window made it so.
    unit : str
        Unit of the file, such as 'um'.
    steps : list of dict
        All that was done, in order: the key 'step' and the numbers that belong to it.
    source : dict
        Name, format, channel, bytes, sha256 and metadata of the file.
    notes : list of str
        What the user should know, as a tilt that is left.
    """

    height: FloatArray
    lx: float
    ly: float
    periodic: bool
    unit: str
    steps: list[dict[str, Any]] = field(default_factory=list)
    source: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def rms_height(self) -> float:
        """Rms height about the mean, m."""
        return float(np.std(self.height))

    @property
    def rms_slope(self) -> float:
        """Rms slope from differences of neighbours; across the edges where periodic."""
        from .surface import statistics

        boundary = "periodic" if self.periodic else "free"
        return statistics(self.height, self.lx, self.ly, boundary).rms_slope_differences

    def to_namelist(self, file: str | Path) -> str:
        """Return the `&grid` and `&surface` groups that take the map from a file.

        Parameters
        ----------
        file : str or Path
            Name of the file that `save` has written, as the input is to name it.
        """
        ny, nx = self.height.shape
        boundary = "periodic" if self.periodic or ny == 1 else "free"
        name = str(file).replace("'", "''")
        return (f"&grid nx = {nx}, ny = {ny}, lx = {self.lx!r}, ly = {self.ly!r},"
                f" boundary = '{boundary}' /\n"
                f"&surface shape = 'file', file = '{name}' /")

    def summary(self) -> str:
        """Return a few lines that say what the map is and what was done."""
        ny, nx = self.height.shape
        scale = UNITS[self.unit]

        def both(value: float) -> str:
            if self.unit == "m":
                return f"{value:.6g} m"
            return f"{value:.6g} m ({value / scale:.6g} {self.unit})"

        lines = [
            f"source      {self.source['name']} ({self.source['format']}), channel"
            f" {self.source['channel']!r}, in {self.unit}",
            *(f"step        {_told(step)}" for step in self.steps),
            f"nx, ny      {nx}, {ny}",
            f"lx          {both(self.lx)}",
            f"ly          {both(self.ly)}",
            f"rms height  {both(self.rms_height)}",
            f"rms slope   {self.rms_slope:.6g}",
            *(f"note        {note}" for note in self.notes),
        ]
        return "\n".join(lines)

    def save(self, path: str | Path) -> Path:
        """Write the HDF5 file that ``&surface shape = 'file'`` takes.

        A file of that name is replaced.

        Parameters
        ----------
        path : str or Path
            Name of the file.

        Returns
        -------
        Path
            The same.

        Raises
        ------
        OSError
            If it cannot be written.
        ValueError
            If it is there and the result of a run.
        """
        import h5py

        path = Path(path)
        if not path.parent.is_dir():
            raise OSError(f"{path}: cannot be written: there is no folder {str(path.parent)!r}")
        if path.is_dir():
            raise OSError(f"{path}: is a folder, not a file")
        if _is_result(path):
            raise ValueError(f"{path}: is the result of a run: name another file")
        ny, nx = self.height.shape
        temporary = path.with_name(path.name + ".new")
        try:
            with h5py.File(temporary, "w") as file:
                file.attrs["title"] = self.source["name"]
                file.attrs["program"] = "asperity import"
                file.attrs["version"] = version()
                file.attrs["created"] = f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}"
                for name, value in self.source.items():
                    if name != "metadata":
                        file.attrs[f"source_{name}"] = value
                # a dataset, for attributes hold 64 kB only
                told = json.dumps(self.source["metadata"], default=str)
                metadata = file.create_dataset("source/metadata", data=told,
                                               dtype=h5py.string_dtype())
                metadata.attrs.update(units="1", long_name="what the file says of the measurement"
                                                           " (JSON)")
                file.attrs["source_unit"] = self.unit
                file.attrs["steps"] = json.dumps(self.steps)
                file.attrs["steps_text"] = "\n".join(map(_told, self.steps))
                grid = file.create_group("grid")
                grid.attrs.update(nx=np.int32(nx), ny=np.int32(ny), lx=self.lx, ly=self.ly,
                                  boundary="periodic" if self.periodic else "free")
                for name, count, length in (("x", nx, self.lx), ("y", ny, self.ly)):
                    axis = grid.create_dataset(name, data=np.arange(count) * length / count)
                    axis.attrs.update(units="m", long_name=f"centres of the cells along {name}")
                data = file.create_dataset("surface/height", data=self.height)
                data.attrs.update(units="m", long_name="height of the road", lx=self.lx,
                                  ly=self.ly, rms_height=self.rms_height,
                                  rms_slope=self.rms_slope)
            temporary.replace(path)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise OSError(f"{path}: cannot be written: {error}") from None
        return path


def _is_result(path: Path) -> bool:
    """Whether a file is the result of a run, which is not to be replaced by a map."""
    import h5py

    if not path.is_file() or path.stat().st_size < 8 or not h5py.is_hdf5(path):
        return False
    with h5py.File(path, "r", locking=False) as file:
        return "history" in file


def channels(path: str | Path) -> list[str]:
    """Return a line for each channel of a file: its id, kind, size and unit.

    Parameters
    ----------
    path : str or Path
        A file that SurfaceTopography reads.

    Raises
    ------
    OSError
        If the file is missing, or of no known format.
    ImportError
        If SurfaceTopography is not installed.
    """
    with _quiet(), _open(Path(path)) as reader:
        return [_channel_line(channel) for channel in reader.channels]


def load(
    path: str | Path,
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    size: float | Sequence[float] | None = None,
    transpose: bool = False,
    crop: Sequence[float] | None = None,
    level: str = "mean",
    max_missing: float = 0.1,
    invert: bool = False,
    scale: float = 1.0,
    resample: Sequence[int] | None = None,
    periodic: str | None = None,
    taper: float | None = None,
    restore_rms: bool = False,
) -> MeasuredSurface:
    """Read a measured topography of any format that SurfaceTopography knows.

    Parameters
    ----------
    path : str or Path
        The instrument's file.
    channel : str or int, optional
        Id of the channel (see `channels`) or its number from 0; by default the file's own choice
        where that holds heights, else the first that does.
    unit : str, optional
        Unit of lengths, 'm', 'mm', 'um', 'nm', 'pm', 'A' or 'inch': for files that name none.
    size : (float, float) or float, optional
        Lengths along x and y in the file's unit: for files that give none. One number for a line.
    transpose : bool
        Let the first index of the file's array run along y, as NumPy's images have it;
        SurfaceTopography's own arrays have the first index along x.
    crop : (x0, x1, y0, y1), optional
        Part to keep, in the file's unit from the corner of the first cell; (x0, x1) of a line.
    level : str
        'none'; 'mean' takes off the mean, 'tilt' the plane, 'curvature' the paraboloid that fits
        best (least squares over the points that are not missing).
    max_missing : float
        Largest share of missing points that is filled, 0 to 1.
    invert : bool
        Turn the map upside down: for replicas, or instruments that count depths.
    scale : float
        Factor on the heights.
    resample : (nx, ny), optional
        Other numbers of cells over the same lengths: means over the new cells where there are
        fewer, cubic splines where there are more. nx alone of a line.
    periodic : str, optional
        Window that brings the edges to the mean height, 'hann' or 'tukey'.
    taper : float, optional
        Share of each length that a 'tukey' window tapers, half of it at each edge; 0 to 1; 0.2 by
        default.
    restore_rms : bool
        Scale the windowed heights to the rms height before. Slopes inside grow with it: off by
        default, as heights inside are then the measured ones.

    Returns
    -------
    MeasuredSurface
        Heights in m, shape (ny, nx).

    Raises
    ------
    OSError
        If the file is missing, damaged, or of no known format.
    ValueError
        If an option is wrong or needed and not given, or the file holds what no run can take.
    ImportError
        If SurfaceTopography is not installed.

    Examples
    --------
    >>> import asperity                                                    # doctest: +SKIP
    >>> road = asperity.surface.load("plate.x3p", level="tilt", periodic="tukey")  # doctest: +SKIP
    >>> road.save("surface.h5")                                            # doctest: +SKIP
    """
    choice("level", level, LEVELS)
    number("max_missing", max_missing, 0.0, 1.0)
    number("scale", scale)
    if scale == 0.0:
        raise ValueError("scale = 0: must not be 0")
    if taper is not None:
        number("taper", taper, 0.0, 1.0, low_open=True)
    if periodic is not None:
        choice("periodic", periodic, WINDOWS)
    elif restore_rms:
        raise ValueError("restore_rms: goes with periodic")
    if taper is not None and periodic != "tukey":
        raise ValueError("taper: goes with periodic = 'tukey'")
    path = Path(path)
    height, sizes, told_periodic, unit, source = _read(path, channel, unit, size, transpose)
    work = _Work(height, sizes, told_periodic)
    if transpose and height.shape[0] > 1:
        work.note("transpose")
    if crop is not None:
        work.crop(crop)
    work.level(level)
    work.fill(max_missing, path.name)
    if invert:
        work.height = -work.height
        work.note("invert")
    if scale != 1.0:
        work.height = scale * work.height
        work.note("scale", factor=float(scale))
    if resample is not None:
        work.resample(resample)
    if periodic is not None:
        share = 0.2 if taper is None else float(taper)
        work.window(periodic, 1.0 if periodic == "hann" else share, restore_rms)
    if unit != "m":
        work.note("unit", unit=unit, metres=UNITS[unit])
    height = np.ascontiguousarray(_to_metres(work.height, unit))
    # cell by cell, as some files have them, lengths gather rounding: twelve digits are theirs
    lx, ly = (float(f"{_to_metres(length, unit):.12g}") for length in work.sizes)
    return MeasuredSurface(height, lx, ly, work.periodic, unit, work.steps, source,
                           _advice(work, level))


def import_topography(
    path: str | Path, output: str | Path = "surface.h5", **options: Any
) -> MeasuredSurface:
    """Read a measured topography and write the file that a run takes.

    Parameters
    ----------
    path : str or Path
        The instrument's file.
    output : str or Path
        HDF5 file to write; one that is there is replaced.
    **options
        Those of `load`.

    Returns
    -------
    MeasuredSurface
        `print(surface.to_namelist(output))` shows the lines of the input.

    Raises
    ------
    OSError, ValueError, ImportError
        As `load` and `MeasuredSurface.save`.
    """
    surface = load(path, **options)
    if Path(output).exists() and Path(output).samefile(path):
        raise ValueError(f"output = {str(output)!r}: is the topography itself")
    surface.save(output)
    return surface


# ---- reading -------------------------------------------------------------------------------


def _open(path: Path) -> Any:
    """Open a file with SurfaceTopography."""
    try:
        from SurfaceTopography import open_topography
    except ImportError:
        raise ImportError(f"SurfaceTopography is not installed: {_NEEDS}") from None
    if not path.exists():
        raise OSError(f"{path}: there is no such file")
    if path.is_dir():
        raise OSError(f"{path}: is a folder, not a file")
    if not path.stat().st_size:
        raise OSError(f"{path}: is empty")
    if (own := own_map(path)) is not None:
        return own
    try:
        with _quiet():
            reader = open_topography(str(path))
    except Exception as error:  # readers of damaged files raise what they meet
        if type(error).__name__ != "CannotDetectFileFormat":
            raise OSError(f"{path}: cannot be read as a topography: {_reason(error)}") from None
        try:
            return text_map(path)
        except ValueError as fault:
            if re.search("is not a text file|no table of numbers", str(fault)):
                raise OSError(f"{path}: is of no format that SurfaceTopography knows") from None
            raise
    if _is_doubtful(reader, path):
        try:
            found = text_map(path)
        except ValueError as fault:
            if reader.format() != "hgt":
                raise
            raise OSError(f"{path}: is of no known format: {_reason(fault)}") from None
        finally:
            reader.close()
        return found
    return reader


def _is_doubtful(reader: Any, path: Path) -> bool:
    """Whether a table is the better reading of a file.

    The format HGT has no mark: any file of 2 n^2 bytes passes for it. And points whose grid has
    holes are taken for a matrix of two or three columns.
    """
    if reader.format() == "hgt":
        return path.suffix.lower() != ".hgt"
    return (reader.format() in ("asc", "matrix") and len(reader.channels) == 1
            and reader.channels[0].physical_sizes is None
            and reader.channels[0].dim == 2 and reader.channels[0].nb_grid_pts[0] in (2, 3))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what readers print or warn of while they try a file off the terminal."""
    nowhere = io.StringIO()
    with (contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere),
          warnings.catch_warnings()):
        warnings.simplefilter("ignore")
        yield


def _reason(error: Exception) -> str:
    """Return the first line of a message."""
    return str(error).strip().split("\n")[0] or type(error).__name__


def _to_metres(value: Any, unit: str) -> Any:
    """Return lengths in m; 60 um are 6e-5 m, to the last digit."""
    return value / _PARTS[unit] if unit in _PARTS else value * UNITS[unit]


def _channel_line(channel: Any) -> str:
    """Return what a channel is, in a line."""
    points = " x ".join(map(str, channel.nb_grid_pts or ())) or "?"
    kind = "map" if channel.dim == 2 else "line scan"
    data = "heights" if channel.is_height_channel else str(channel.data_kind.name).lower()
    return f"{channel.channel_id!r}: {kind} of {data}, {points} points, unit {channel.unit}"


def _choose(reader: Any, path: Path, wanted: str | int | None) -> Any:
    """Return the channel that was asked for."""
    known = list(reader.channels)
    listed = "; ".join(_channel_line(channel) for channel in known)
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


def _unit_of(name: str | None) -> str | None:
    """Return a unit's name in ASCII, None where there is none."""
    return None if name is None else _MICRO.get(str(name).strip(), str(name).strip()) or None


def _read(
    path: Path, channel: str | int | None, unit: str | None, size: Any, transpose: bool
) -> tuple[FloatArray, list[float], bool, str, dict[str, Any]]:
    """Return heights (ny, nx) with NaN where missing, lengths, periodicity, unit and source."""
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
        told = _unit_of(chosen.unit)
        if told is not None and told not in UNITS:
            raise ValueError(f"{path}: has the unit {told!r}: must be one of {', '.join(UNITS)}")
        if told is None and given is None:
            raise ValueError(f"{path}: names no unit of length: give one (unit = 'um', --unit um)")
        if told is not None and given is not None and told != given:
            raise ValueError(f"unit = {given!r}: {path} has its own unit, {told!r}; `scale` scales"
                             " the heights")
        arguments: dict[str, Any] = {}
        if chosen.physical_sizes is None:
            arguments["physical_sizes"] = _size_of(path, chosen.dim, size, transpose)
        elif size is not None:
            known = " x ".join(f"{float(length):g}" for length in chosen.physical_sizes)
            raise ValueError(f"size: {path} has its own, {known} {told or ''}".rstrip())
        if told is None:
            arguments["unit"] = given
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
    array = np.ma.filled(np.ma.asarray(heights, dtype=float), np.nan)
    array = np.where(np.isfinite(array), array, np.nan)
    if array.ndim == 1:
        return (array[None, :], [lengths[0], lengths[0] / array.size], periodic,
                told or str(given), source)
    if transpose:
        lengths.reverse()
    else:
        array = array.T
    return array, lengths, periodic, told or str(given), source


def _heights(
    path: Path, reader: Any, channel: Any, arguments: dict[str, Any]
) -> tuple[Any, list[float], bool, dict[str, Any]]:
    """Return a channel's heights with x first, lengths, periodicity and what the file tells."""
    if reader.format() == "npy":  # NumPy reads at once what takes the reader a minute
        heights = np.load(path, allow_pickle=False)
        return heights, [float(length) for length in arguments["physical_sizes"]], False, {}
    topography = channel.topography(**arguments)
    lengths = [float(length) for length in topography.physical_sizes]
    return topography.heights(), lengths, bool(topography.is_periodic), dict(topography.info or {})


def _size_of(path: Path, dim: int, size: Any, transpose: bool) -> tuple[float, ...]:
    """Return the lengths in the order of the file's indices."""
    if size is None:
        raise ValueError(f"{path}: gives no lengths: give them (size = (lx, ly), --size LX LY)")
    values = [positive("size", value) for value in np.atleast_1d(np.asarray(size, dtype=object))]
    if len(values) != dim:
        raise ValueError(f"size: has {len(values)} lengths, must have {dim}")
    return tuple(reversed(values)) if transpose else tuple(values)


# ---- what is done to the heights -------------------------------------------------------------


class _Work:
    """A map in hand, in the file's unit, with the steps done so far."""

    def __init__(self, height: FloatArray, sizes: list[float], periodic: bool) -> None:
        self.height = height
        self.sizes = sizes
        self.periodic = periodic
        self.steps: list[dict[str, Any]] = []

    def note(self, step: str, **numbers: Any) -> None:
        """Note a step."""
        self.steps.append({"step": step, **numbers})

    def crop(self, wanted: Sequence[float]) -> None:
        """Keep a part, of whole cells."""
        dims = 1 if self.height.shape[0] == 1 else 2
        if len(wanted) != 2 * dims:
            raise ValueError(f"crop: has {len(wanted)} numbers, must have {2 * dims}")
        parts = [slice(None), slice(None)]
        kept: list[float] = []
        for axis in range(dims):
            low, high = (number("crop", value) for value in wanted[2 * axis : 2 * axis + 2])
            name = "xy"[axis]
            count, length = self.height.shape[1 - axis], self.sizes[axis]
            cell = length / count
            if not -1e-9 * length <= low < high <= length * (1.0 + 1e-9):
                raise ValueError(f"crop = {low:g}, {high:g} along {name}: must rise, within"
                                 f" 0 to {length:g}")
            first, last = round(low / cell), round(high / cell)
            if last - first < (2 if dims == 2 else 3):
                raise ValueError(f"crop = {low:g}, {high:g} along {name}: keeps {last - first}"
                                 f" cells of {cell:g}: too few")
            parts[1 - axis] = slice(first, last)
            if last - first < count:
                self.periodic = False
            self.sizes[axis] = (last - first) * cell
            kept += [first * cell, last * cell]
        self.height = self.height[tuple(parts)]
        if dims == 1:
            self.sizes[1] = self.sizes[0] / self.height.shape[1]
        self.note("crop", kept=kept, nx=self.height.shape[1], ny=self.height.shape[0])

    def level(self, kind: str) -> None:
        """Take off the polynomial that fits the points best."""
        if kind == "none":
            return
        valid = np.isfinite(self.height)
        if not valid.any():
            raise ValueError("the map has no valid point")
        basis, names = _polynomial(self.height.shape, kind)
        fit = _fit(self.height, valid, basis)
        for coefficient, term in zip(fit, basis, strict=True):
            self.height = self.height - coefficient * term
        self.note("level", kind=kind, coefficients=dict(zip(names, map(float, fit), strict=True)))

    def fill(self, most: float, name: str) -> None:
        """Fill missing points by the smoothest surface through their neighbours."""
        missing = ~np.isfinite(self.height)
        count, total = int(missing.sum()), self.height.size
        if count == 0:
            return
        if count == total:
            raise ValueError(f"{name}: the map has no valid point")
        if count > most * total:
            raise ValueError(
                f"{name}: {count} of {total} points are missing ({100 * count / total:.3g} %):"
                f" more than the {100 * most:g} % that are filled (max_missing, --max-missing)")
        self.height = _harmonic(self.height, missing, self.periodic)
        self.note("fill", missing=count, points=total, share=count / total)

    def resample(self, wanted: Sequence[int]) -> None:
        """Change the numbers of cells."""
        ny, nx = self.height.shape
        counts = [whole("resample", one)
                  for one in np.atleast_1d(np.asarray(wanted, dtype=object))]
        if ny == 1 and len(counts) == 1:
            counts.append(1)
        if len(counts) != 2 or counts[0] < 2 or counts[1] < (1 if ny == 1 else 2):
            raise ValueError(f"resample = {wanted}: must be (nx, ny), at least 2 each")
        if ny == 1 and counts[1] != 1:
            raise ValueError(f"resample = {wanted}: a line scan keeps ny = 1")
        self.height = _along_rows(self.height, counts[0], self.periodic)
        self.height = _along_rows(self.height.T, counts[1], self.periodic).T
        if ny == 1:
            self.sizes[1] = self.sizes[0] / counts[0]
        self.note("resample", from_nx=nx, from_ny=ny, nx=counts[0], ny=counts[1])

    def window(self, kind: str, taper: float, restore: bool) -> None:
        """Bring the edges to the mean height."""
        ny, nx = self.height.shape
        mean = float(np.mean(self.height))
        before = float(np.std(self.height))
        shape = _tukey(nx, taper) * (np.ones(1) if ny == 1 else _tukey(ny, taper))[:, None]
        windowed = shape * (self.height - mean)
        after = float(np.std(windowed))
        factor = before / after if restore and after > 0.0 else 1.0
        self.height = mean + factor * windowed
        self.periodic = True
        self.note("window", kind=kind, taper=taper, rms_height_before=before,
                  rms_height_after=factor * after, restore_rms=restore, factor=factor)


def _polynomial(shape: tuple[int, int], kind: str) -> tuple[list[FloatArray], list[str]]:
    """Return the terms of a levelling, over coordinates of -1 to 1, and their names."""
    ny, nx = shape
    x = np.broadcast_to(np.linspace(-1.0, 1.0, nx) if nx > 1 else np.zeros(1), shape)
    y = np.broadcast_to((np.linspace(-1.0, 1.0, ny) if ny > 1 else np.zeros(1))[:, None], shape)
    terms, names = [np.ones(shape)], ["1"]
    if kind in ("tilt", "curvature"):
        terms, names = [*terms, x], [*names, "x"]
        if ny > 1:
            terms, names = [*terms, y], [*names, "y"]
    if kind == "curvature":
        terms, names = [*terms, x * x], [*names, "xx"]
        if ny > 1:
            terms, names = [*terms, x * y, y * y], [*names, "xy", "yy"]
    return terms, names


def _fit(height: FloatArray, valid: NDArray[np.bool_], basis: list[FloatArray]) -> FloatArray:
    """Return the least squares coefficients, by normal equations; the terms are well scaled."""
    values = np.where(valid, height, 0.0)
    matrix = np.array([[float(np.sum(a * b * valid)) for b in basis] for a in basis])
    total = np.zeros(len(basis))
    rest = values
    for _ in range(2):  # the second turn takes off the rounding of the first
        right = np.array([float(np.sum(a * rest)) for a in basis])
        part = np.linalg.lstsq(matrix, right, rcond=None)[0]
        total += part
        rest = rest - valid * sum(c * a for c, a in zip(part, basis, strict=True))
    return total


def _harmonic(height: FloatArray, missing: NDArray[np.bool_], periodic: bool) -> FloatArray:
    """Fill points so that each is the mean of its neighbours."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    ny, nx = height.shape
    unknown = np.full(height.shape, -1)
    rows, columns = np.nonzero(missing)
    unknown[rows, columns] = np.arange(rows.size)
    diagonal = np.zeros(rows.size)
    right = np.zeros(rows.size)
    entries: list[tuple[NDArray[Any], NDArray[Any]]] = []
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        j, i = rows + dy, columns + dx
        if periodic:
            j, i = j % ny, i % nx
        inside = (j >= 0) & (j < ny) & (i >= 0) & (i < nx)
        # a neighbour that is the point itself (one row, periodic) says nothing
        inside &= (np.where(inside, j, 0) != rows) | (np.where(inside, i, 0) != columns)
        at = np.flatnonzero(inside)
        j, i = j[at], i[at]
        diagonal[at] += 1.0
        known = ~missing[j, i]
        np.add.at(right, at[known], height[j[known], i[known]])
        entries.append((at[~known], unknown[j[~known], i[~known]]))
    own = np.arange(rows.size)
    row = np.concatenate([own, *(a for a, _ in entries)])
    column = np.concatenate([own, *(b for _, b in entries)])
    value = np.concatenate([diagonal, *(-np.ones(a.size) for a, _ in entries)])
    matrix = coo_matrix((value, (row, column)), shape=(rows.size, rows.size)).tocsc()
    filled = height.copy()
    filled[rows, columns] = spsolve(matrix, right)
    return filled


def _along_rows(height: FloatArray, count: int, periodic: bool) -> FloatArray:
    """Change the number of cells along the last axis, over the same length."""
    old = height.shape[1]
    if count == old:
        return height
    if count < old:
        edges = np.arange(old + 1) / old
        total = np.concatenate([np.zeros((height.shape[0], 1)), np.cumsum(height, axis=1)], axis=1)
        place = np.arange(count + 1) / count * old
        whole = np.minimum(place.astype(int), old - 1)
        # the integral up to each new edge, linear within a cell
        part = total[:, whole] + (place - edges[whole] * old) * height[:, whole]
        return np.diff(part, axis=1) * (count / old)
    from scipy.interpolate import CubicSpline

    centres = (np.arange(old) + 0.5) / old
    wanted = (np.arange(count) + 0.5) / count
    if periodic:
        closed = np.concatenate([height, height[:, :1]], axis=1)
        spline = CubicSpline(np.append(centres, centres[0] + 1.0), closed, axis=1,
                             bc_type="periodic")
    else:
        spline = CubicSpline(centres, height, axis=1)
    return np.asarray(spline(wanted))


def _tukey(count: int, taper: float) -> FloatArray:
    """Return a window at the centres of cells: cosine flanks over `taper` of the length."""
    place = (np.arange(count) + 0.5) / count
    near = np.minimum(place, 1.0 - place)  # from the nearer edge
    ramp = np.clip(2.0 * near / taper, 0.0, 1.0)
    return 0.5 * (1.0 - np.cos(math.pi * ramp))


# ---- words -----------------------------------------------------------------------------------


def _told(step: dict[str, Any]) -> str:
    """Return a step in words."""
    words: dict[str, Callable[[dict[str, Any]], str]] = {
        "transpose": lambda s: "transposed: the file's first index runs along y",
        "crop": lambda s: f"cropped to {s['nx']} x {s['ny']} cells: "
                          + ", ".join(f"{value:.6g}" for value in s["kept"]),
        "level": lambda s: f"levelled ({s['kind']})",
        "fill": lambda s: f"filled {s['missing']} of {s['points']} points"
                          f" ({100 * s['share']:.3g} %), which were missing",
        "invert": lambda s: "inverted",
        "scale": lambda s: f"heights times {s['factor']:.6g}",
        "resample": lambda s: f"resampled from {s['from_nx']} x {s['from_ny']} to"
                              f" {s['nx']} x {s['ny']} cells",
        "window": lambda s: f"made periodic by a {s['kind'].capitalize()} window over"
                            f" {100 * s['taper']:.3g} % of each length: rms height"
                            f" {s['rms_height_before']:.6g} -> {s['rms_height_after']:.6g}"
                            + (" (restored)" if s["restore_rms"] else ""),
        "unit": lambda s: f"lengths and heights from {s['unit']} to m",
    }
    return words[step["step"]](step)


def _advice(work: _Work, level: str) -> list[str]:
    """Return what the user should know of the map."""
    notes = []
    variance = float(np.var(work.height))
    if variance > 0.0 and level in ("none", "mean") and not work.periodic:
        basis, _ = _polynomial(work.height.shape, "tilt")
        fit = _fit(work.height, np.ones(work.height.shape, dtype=bool), basis)
        plane = sum(c * a for c, a in zip(fit[1:], basis[1:], strict=True))
        share = float(np.var(plane)) / variance
        if share > 0.1:
            notes.append(f"{100 * share:.0f} % of the variance of the heights is a tilt:"
                         " level = 'tilt' (--level tilt) takes it off")
    if variance == 0.0:
        notes.append("the map is flat")
    if not work.periodic:
        notes.append("opposite edges do not fit: the boundary is taken as free;"
                     " periodic = 'tukey' (--periodic) makes the map periodic"
                     if work.height.shape[0] > 1 else
                     "the ends of the line do not fit, and a line needs a periodic boundary:"
                     " periodic = 'tukey' (--periodic) makes them fit")
    return notes
