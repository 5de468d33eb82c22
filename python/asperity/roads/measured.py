"""Measured topographies: read by SurfaceTopography, made ready for a run, kept with their story.

What is done to the heights comes in this order: crop, level, fill missing points, invert, scale,
resample, window. Every step is noted, and written into the file with the source's name, size and
checksum and what the instrument said.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.check import choice, number
from ..base.presenters import present
from .instrument_files import UNITS, channels, read_map, to_metres
from .map_work import MapWork, fit_terms, polynomial
from .map_writer import new_map_file, write_grid, write_height
from .statistics import statistics

__all__ = ["MeasuredSurface", "channels", "import_topography", "load"]

FloatArray = NDArray[np.float64]

LEVELS = ("none", "mean", "tilt", "curvature")
WINDOWS = ("hann", "tukey")


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
        with new_map_file(path, self.source["name"], "asperity import") as file:
            file.attrs.update({f"source_{name}": value for name, value in self.source.items()
                               if name != "metadata"})
            # a dataset, for attributes hold 64 kB only
            told = json.dumps(self.source["metadata"], default=str)
            metadata = file.create_dataset("source/metadata", data=told,
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
    height, sizes, told_periodic, unit, source = read_map(path, channel, unit, size, transpose)
    work = MapWork(height, sizes, told_periodic)
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
    height = np.ascontiguousarray(to_metres(work.height, unit))
    # cell by cell, as some files have them, lengths gather rounding: twelve digits are theirs
    lx, ly = (float(f"{to_metres(length, unit):.12g}") for length in work.sizes)
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


def step_in_words(step: dict[str, Any]) -> str:
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


def _advice(work: MapWork, level: str) -> list[str]:
    """Return what the user should know of the map."""
    notes = []
    variance = float(np.var(work.height))
    if variance > 0.0 and level in ("none", "mean") and not work.periodic:
        basis, _ = polynomial(work.height.shape, "tilt")
        fit = fit_terms(work.height, np.ones(work.height.shape, dtype=bool), basis)
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
