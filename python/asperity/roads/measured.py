"""Measured topographies: reading, processing, and writing with a record of their origin.

The steps are always done in this order: crop, level, fill missing points, invert, scale, resample,
window. Every step is recorded. The written file contains these records, the name, size and checksum
of the source, and the metadata of the instrument.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, number
from ..base.files import MAP, check_output
from ..base.presenters import present
from .instrument_files import UNITS, channels, read_map, to_metres
from .map_work import MapWork, fit_terms, polynomial
from .map_writer import new_map_file, write_grid, write_height
from .outliers import find_outliers
from .statistics import statistics

__all__ = ["MeasuredSurface", "channels", "import_topography", "load"]

FloatArray = NDArray[np.float64]

LEVELS = ("none", "mean", "tilt", "curvature")
WINDOWS = ("hann", "tukey")
_AS_IS = "as-is"        # of `periodic`: opposite edges match already

# Opposite edges fit if the mean square of their steps is at most this multiple of that inside.
_SIMILAR = 4.0
_MOST_CHECKED, _LEAST_ROWS = 500_000, 5  # cells, and rows of them, in which outliers are sought
_STEEP = 3.0            # rms slope above which a unit is likely to be wrong


@dataclass(frozen=True)
class MeasuredSurface:
    """A measured height map, ready for a run.

    Attributes
    ----------
    height : ndarray, shape (ny, nx)
        Height, m; summits are maxima. Row j is at y = j ly/ny. A line scan has ny = 1.
    lx, ly : float
        Lengths, m.
    periodic : bool
        Whether opposite edges match: the file or the user says so, or a window has made the map
        periodic.
    unit : str
        Unit of the file, such as 'um'.
    steps : list of dict
        The processing steps in order: the key 'step' and the numbers of each.
    source : dict
        Name, format, channel, bytes, sha256 and metadata of the file.
    notes : list of str
        Notes for the user, for example about a tilt that has not been removed.
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
        """Rms slope from differences of neighbouring cells; across the edges of a periodic map."""
        boundary = "periodic" if self.periodic else "free"
        return statistics(self.height, self.lx, self.ly, boundary).rms_slope_differences

    def to_namelist(self, file: str | Path) -> str:
        """Return the `&grid` and `&surface` groups of an input that reads the map from a file.

        Parameters
        ----------
        file : str or Path
            Name of the file that `save` has written, as it should appear in the input.

        Returns
        -------
        str
            Two groups.
        """
        ny, nx = self.height.shape
        boundary = "periodic" if self.periodic or ny == 1 else "free"
        name = str(file).replace("'", "''")
        return (f"&grid nx = {nx}, ny = {ny}, lx = {self.lx!r}, ly = {self.ly!r},"
                f" boundary = '{boundary}' /\n"
                f"&surface shape = 'file', file = '{name}' /")

    def summary(self) -> str:
        """Return a few lines that describe the map and the processing steps."""
        ny, nx = self.height.shape
        scale = UNITS[self.unit]

        def both(value: float) -> str:
            if self.unit == "m":
                return f"{value:.6g} m"
            return f"{value:.6g} m ({value / scale:.6g} {self.unit})"

        lines = [
            f"source      {self.source.get('name', 'an array')}"
            f" ({self.source.get('format', 'no file')}), channel"
            f" {self.source.get('channel', 'Default')!r}, in {self.unit}",
            *(f"step        {step_in_words(step)}" for step in self.steps),
            f"nx, ny      {nx}, {ny}",
            f"lx          {both(self.lx)}",
            f"ly          {both(self.ly)}",
            f"rms height  {both(self.rms_height)}",
            f"rms slope   {self.rms_slope:.6g}",
            *(f"note        {note}" for note in self.notes),
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return present("road_html", self)

    def save(self, path: str | Path) -> Path:
        """Write the HDF5 file that ``&surface shape = 'file'`` takes.

        A height map of that name is replaced; any other file is refused.

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
            If a file of this name is no height map.
        """
        import h5py

        path = Path(path)
        with new_map_file(path, self.source.get("name", "an array"), "asperity import",
                          self.height.nbytes) as file:
            file.attrs.update({f"source_{name}": value for name, value in self.source.items()
                               if name != "metadata"})
            # The metadata are a dataset, because an attribute is limited to 64 kB.
            text = json.dumps(self.source.get("metadata", {}), default=str)
            metadata = file.create_dataset("source/metadata", data=text,
                                           dtype=h5py.string_dtype())
            metadata.attrs.update(units="1", long_name="what the file says of the measurement"
                                                       " (JSON)")
            file.attrs["source_unit"] = self.unit
            file.attrs["steps"] = json.dumps(self.steps)
            file.attrs["steps_text"] = "\n".join(map(step_in_words, self.steps))
            write_grid(file, self.height.shape, self.lx, self.ly, self.periodic)
            write_height(file, self.height, lx=self.lx, ly=self.ly, rms_height=self.rms_height,
                         rms_slope=self.rms_slope)
        return path


def load(
    path: str | Path,
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    size: float | Sequence[float] | None = None,
    transpose: bool = False,
    crop: Sequence[float] | None = None,
    level: str | None = "mean",
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
        The file of an instrument.
    channel : str or int, optional
        Id of the channel (see `channels`) or its number from 0. The default is the default channel
        of the file or, if that has no heights, the first channel with heights.
    unit : str, optional
        Unit of lengths, 'm', 'mm', 'um', 'nm', 'pm', 'A', 'km' or 'inch'. Only for files that name
        none.
    size : (float, float) or float, optional
        Lengths along x and y in the file's unit, one number for a line scan. Only for files that
        give none.
    transpose : bool
        The first index of the file's array runs along y, as in NumPy's images. In the arrays of
        SurfaceTopography it runs along x.
    crop : (x0, x1, y0, y1), optional
        Part to keep, in the file's unit, measured from the corner of the first cell; (x0, x1) for a
        line scan.
    level : str, optional
        'none', or what is subtracted: 'mean' the mean, 'tilt' the plane, 'curvature' the paraboloid
        that fits best (least squares over the points that are not missing). A periodic map is not
        periodic any more without its plane or paraboloid. None is 'mean' for a periodic map and
        'tilt' for any other.
    max_missing : float
        Largest share of missing points that is accepted, 0 to 1.
    invert : bool
        Turn the map upside down, for replicas and for instruments that measure depths.
    scale : float
        Factor by which the heights are multiplied.
    resample : (nx, ny), optional
        Number of cells to which the same lengths are divided: means over the new cells if there are
        fewer, cubic splines if there are more. Only nx for a line scan.
    periodic : str, optional
        Window that brings the edges to the mean height, 'hann' or 'tukey'; or 'as-is' for a map
        whose opposite edges match, if the file does not say so.
    taper : float, optional
        Share of each length that a 'tukey' window tapers, half of it at each edge: 0 to 1, 0.2 by
        default.
    restore_rms : bool
        Multiply the windowed heights so that the rms height is the same as before. The slopes
        inside the map become steeper than measured, so this is off by default.

    Returns
    -------
    MeasuredSurface
        Heights in m, shape (ny, nx).

    Raises
    ------
    OSError
        If the file is missing or damaged, or its format is not known.
    ValueError
        If an option is not allowed, or is needed and not given, or a run cannot use the map.
    ImportError
        If SurfaceTopography is not installed.

    Examples
    --------
    >>> import asperity                                                    # doctest: +SKIP
    >>> road = asperity.surface.load("plate.x3p", level="tilt", periodic="tukey")  # doctest: +SKIP
    >>> road.save("surface.h5")                                            # doctest: +SKIP
    """
    if level is not None:
        choice("level", level, LEVELS)
    number("max_missing", max_missing, 0.0, 1.0)
    number("scale", scale)
    if scale == 0.0:
        raise ValueError("scale = 0: must not be 0")
    _check_window(periodic, taper, restore_rms)
    path = Path(path)
    height, sizes, is_periodic, unit, source = read_map(path, channel, unit, size, transpose)
    turned = [] if size is None or transpose else _turned_note(height.shape, sizes, source)
    work = MapWork(height, sizes, is_periodic or periodic == _AS_IS)
    if periodic == _AS_IS:
        work.note("periodic")
    if transpose and height.shape[0] > 1:
        work.note("transpose")
    if crop is not None:
        work.crop(crop)
    level = level or ("mean" if work.periodic else "tilt")
    jump = work.level(level)
    work.fill(max_missing, path.name)
    if invert:
        work.height = -work.height
        work.note("invert")
    if scale != 1.0:
        work.height = scale * work.height
        jump = None if jump is None else abs(scale) * jump
        work.note("scale", factor=float(scale))
    if resample is not None:
        work.resample(resample)
    if periodic in WINDOWS:
        share = 0.2 if taper is None else float(taper)
        work.window(periodic, 1.0 if periodic == "hann" else share, restore_rms)
    if unit != "m":
        work.note("unit", unit=unit, metres=UNITS[unit])
    height = np.ascontiguousarray(to_metres(work.height, unit))
    lx, ly = (to_metres(length, unit) for length in work.sizes)
    if source["format"] != "asperity":
        # Lengths that a file sums over cells contain rounding errors: keep twelve digits.
        lx, ly = (float(f"{length:.12g}") for length in (lx, ly))
    return MeasuredSurface(height, lx, ly, work.periodic, unit, work.steps, source,
                           [*turned, *_jump_note(jump, level, unit, work.periodic),
                            *_advice(work, level),
                            *_outlier_note(height)])


def _check_window(periodic: str | None, taper: float | None, restore_rms: bool) -> None:
    """Refuse options of the window that are not allowed, or that need another one."""
    if periodic is not None:
        choice("periodic", periodic, (*WINDOWS, _AS_IS))
    if restore_rms and periodic not in WINDOWS:
        raise ValueError("restore_rms: needs periodic = 'tukey' or 'hann'")
    if taper is not None:
        number("taper", taper, 0.0, 1.0, low_open=True)
        if periodic != "tukey":
            raise ValueError("taper: needs periodic = 'tukey'")


def import_topography(
    path: str | Path, output: str | Path = "surface.h5", overwrite: bool = False, **options: Any
) -> MeasuredSurface:
    """Read a measured topography and write the height map for a run.

    Parameters
    ----------
    path : str or Path
        The file of an instrument.
    output : str or Path
        HDF5 file to write. An existing map of the same topography is replaced.
    overwrite : bool
        Replace the map of another topography, too.
    **options
        Options of `load`.

    Returns
    -------
    MeasuredSurface
        `print(surface.to_namelist(output))` shows the lines of the input.

    Raises
    ------
    FileExistsError
        If the output is the map of another topography, and `overwrite` is not given.
    OSError, ValueError, ImportError
        As in `load` and `MeasuredSurface.save`.
    """
    surface = load(path, **options)
    if Path(output).exists() and Path(output).samefile(path):
        raise ValueError(f"output = {str(output)!r}: is the topography itself")
    if not overwrite:
        _check_same_topography(Path(output), surface)
    surface.save(output)
    return surface


def _check_same_topography(output: Path, surface: MeasuredSurface) -> None:
    """Refuse to replace the map of another topography."""
    import h5py

    check_output(output, MAP)
    if not output.is_file() or output.stat().st_size == 0:
        return
    with h5py.File(output) as file:
        name = str(file.attrs.get("source_name", "of an unknown file"))
        checksum = str(file.attrs.get("source_sha256", ""))
    if checksum != surface.source.get("sha256"):
        raise FileExistsError(
            f"{output}: is the map of another topography, {name}: --overwrite (overwrite=True)"
            " replaces it, or choose another --output")


def step_in_words(step: dict[str, Any]) -> str:
    """Return the description of a step."""
    words: dict[str, Callable[[dict[str, Any]], str]] = {
        "periodic": lambda s: "declared periodic as it is",
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


def _turned_note(shape: tuple[int, ...], sizes: list[float], source: dict[str, Any]) -> list[str]:
    """Return a note if the cells are oblong, but would be square with x and y exchanged.

    Maps of this program have y first and cannot be turned.

    Examples
    --------
    >>> _turned_note((64, 48), [4e-4, 3e-4], {"format": "npy"})[0][:46]
    'the cells are 1.78 times as long as wide; with'
    >>> _turned_note((48, 64), [4e-4, 3e-4], {"format": "npy"})
    []
    """
    (ny, nx), (lx, ly) = shape, sizes
    ratio, other = lx / nx * ny / ly, lx / ny * nx / ly
    is_own = source["format"] == "asperity"
    if is_own or ny == 1 or abs(math.log(ratio)) < 0.01 or abs(math.log(other)) > 1e-3:
        return []
    return [f"the cells are {max(ratio, 1 / ratio):.3g} times as long as wide; with the first index"
            " of the file along y (transpose, --transpose) they would be square"]


def _jump_note(jump: float | None, level: str, unit: str, windowed: bool) -> list[str]:
    """Return a note on the jump that levelling has made at the edges of a periodic map."""
    if jump is None:
        return []
    what = "plane" if level == "tilt" else "paraboloid"
    return [f"the map is periodic as it was read, but without its {what} opposite edges differ"
            f" by up to {jump:.3g} {unit}"
            + ("" if windowed else ": it is not periodic any more")
            + "; level = 'mean' (--level mean) keeps it periodic"]


def _advice(work: MapWork, level: str) -> list[str]:
    """Return notes on the map for the user."""
    notes = []
    variance = float(np.var(work.height))
    if variance > 0.0 and level in ("none", "mean") and not work.periodic:
        basis, _ = polynomial(work.height.shape, "tilt")
        fit = fit_terms(work.height, np.ones(work.height.shape, dtype=bool), basis)
        plane = sum(c * a for c, a in zip(fit[1:], basis[1:], strict=True))
        share = float(np.var(plane)) / variance
        if share > 0.1:
            notes.append(f"{100 * share:.0f} % of the variance of the heights is a tilt:"
                         " level = 'tilt' (--level tilt) removes it")
    if variance == 0.0:
        notes.append("the map is flat")
    lx, ly = work.sizes
    slope = statistics(work.height, lx, ly, "free").rms_slope_differences
    if slope > _STEEP:
        notes.append(f"the rms slope is {slope:.2g}: no road is so steep; often the heights or the"
                     " lengths are in another unit (unit, scale, size)")
    if not work.periodic:
        notes.append(_edge_note(work.height))
    elif any(step["step"] == "periodic" for step in work.steps) and not _edges_fit(work.height):
        notes.append("the map is declared periodic, but opposite edges do not fit")
    return notes


def _outlier_note(height: FloatArray) -> list[str]:
    """Return a note on outliers in the first rows of a map, m, or in a profile."""
    rows = max(_LEAST_ROWS, _MOST_CHECKED // height.shape[1])
    found = find_outliers(height[:rows])
    if not found.count:
        return []
    where = f"in the first {rows} rows " if rows < height.shape[0] else ""
    return [f"{where}{found.summary()}: if they are errors of the measurement, the slopes are too"
            " large; `asperity friction --outliers remove` leaves them out"]


def _edge_note(height: FloatArray) -> str:
    """Return the note on the edges of a map whose file does not say that it is periodic."""
    line = height.shape[0] == 1
    if _edges_fit(height):
        return ("the file does not say that the line is periodic, but its ends fit"
                if line else
                "the file does not say that the map is periodic: the boundary is taken as free,"
                " although opposite edges fit; periodic = 'as-is' (--periodic as-is) declares it"
                " periodic")
    return ("the ends of the line do not fit, and a line needs a periodic boundary:"
            " periodic = 'tukey' (--periodic) makes them fit"
            if line else
            "opposite edges do not fit: the boundary is taken as free;"
            " periodic = 'tukey' (--periodic) makes the map periodic")


def _edges_fit(height: FloatArray) -> bool:
    """Tell whether the steps between opposite edges are about as high as those inside."""
    for axis in (axis for axis in (0, 1) if height.shape[axis] > 1):
        inside = np.diff(height, axis=axis)
        across = np.take(height, 0, axis) - np.take(height, -1, axis)
        if np.mean(across**2) > _SIMILAR * np.mean(inside**2):
            return False
    return True
