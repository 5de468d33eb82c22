"""Files for height maps that are given as arrays, measured surfaces or SurfaceTopography objects.

The program reads heights from HDF5 files. A map that is given as an array is therefore written to a
temporary folder, which is removed when the process ends. The name of the file is a checksum of its
contents. Where an input or a result is written, the map is copied beside it (`keep_beside`).
"""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from numbers import Real
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import library
from ..base.check import positive
from ..base.files import new_file
from .instrument_files import to_metres
from .map_writer import new_map_file, write_grid, write_height

__all__ = ["HeldMap", "held_map", "is_map", "keep_beside", "map_of_file", "save"]


class HeldMap(NamedTuple):
    """A height map in memory."""

    height: NDArray[np.float64]  # (ny, nx), m
    lx: float | None             # m; None where unknown
    ly: float | None
    periodic: bool | None


_folder: tempfile.TemporaryDirectory[str] | None = None
_held: dict[Path, HeldMap] = {}


def is_map(value: object) -> bool:
    """Return whether a value is a height map, and not the variables of a group."""
    return (isinstance(value, np.ndarray) or _is_topography(value) or _is_measured(value)
            or _is_list_of_rows(value))


def _is_list_of_rows(value: object) -> bool:
    """Return whether a value is an array as nested lists of numbers."""
    return isinstance(value, list | tuple) and bool(value) and all(
        isinstance(row, list | tuple) and row and isinstance(row[0], Real) for row in value)


def _is_topography(value: object) -> bool:
    return callable(getattr(value, "heights", None)) and hasattr(value, "physical_sizes")


def _is_measured(value: object) -> bool:
    """Return whether a value is a `MeasuredSurface`, whose module is loaded on first use only."""
    return all(hasattr(value, name) for name in ("height", "lx", "ly", "periodic"))


def _map_of(value: Any, name: str = "surface") -> HeldMap:
    """Return a height map in metres, in which summits are maxima."""
    if _is_measured(value):
        height = _with_cells(library.height_map(value.height, name), name)
        return HeldMap(height, value.lx, value.ly, value.periodic)
    if not _is_topography(value):
        return HeldMap(_with_cells(library.height_map(value, name), name), None, None, None)
    if not getattr(value, "is_uniform", True):
        raise ValueError(f"{name}: is a line scan with points at uneven distances: a run needs a"
                         " regular grid; interpolate it first, as with topography.to_uniform")
    unit = getattr(value, "unit", None)
    if unit is None:
        raise ValueError(f"{name}: the topography has no unit: give it one, as"
                         " topography.to_unit('m') or by its constructor")
    sizes = to_metres(np.ravel(value.physical_sizes), unit)
    heights = np.asarray(to_metres(np.ma.filled(value.heights(), np.nan), unit), dtype=float)
    height = _with_cells(library.height_map(np.atleast_2d(heights.T), name), name)
    ly = float(sizes[1]) if len(sizes) > 1 else None
    return HeldMap(height, float(sizes[0]), ly, bool(getattr(value, "is_periodic", False)))


def _with_cells(height: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Return a map (ny, nx), or refuse one with a single cell along x."""
    if height.shape[1] < 2:
        raise ValueError(f"{name}: has shape {height.shape}, (ny, nx): nx must be at least 2; a"
                         " profile is a row along x")
    return height


def held_map(value: Any) -> Path:
    """Write a map to the temporary folder of this process, and return the file."""
    global _folder
    held = _map_of(value)
    if _folder is None:
        _folder = tempfile.TemporaryDirectory(prefix="asperity-maps-")
    digest = hashlib.sha256(np.ascontiguousarray(held.height).tobytes())
    digest.update(repr((held.height.shape, held.lx, held.ly, held.periodic)).encode())
    path = Path(_folder.name) / f"surface-{digest.hexdigest()[:16]}.h5"
    if path not in _held:
        _write(path, held, "a map that was given as an array")
        _held[path] = held
    return path


def map_of_file(file: str | None) -> HeldMap | None:
    """Return the map of a file that `held_map` has written, and None for any other file."""
    return _held.get(Path(file)) if file else None


def keep_beside(file: str, folder: Path) -> Path:
    """Copy the file of a held map into a folder, where it has the same name; return the copy."""
    source = Path(file)
    target = folder / source.name
    if not target.exists():
        with new_file(target) as new:
            shutil.copyfile(source, new)
    return target


def save(path: str | Path, height: ArrayLike, lx: float | None = None, ly: float | None = None, *,
         boundary: str | None = None, title: str = "") -> Path:
    """Write heights as the HDF5 file that ``&surface shape = 'file'`` takes.

    A height map of that name is replaced; any other file is refused.

    Parameters
    ----------
    path : str or Path
        The file.
    height : array_like, shape (ny, nx), or a topography of SurfaceTopography
        Heights, m; summits are maxima. A topography has its own unit, lengths and boundary.
    lx, ly : float, optional
        Lengths of an array, m; by default `ly` makes the cells square. Not for a topography.
    boundary : str, optional
        'periodic' or 'free'. The default is 'periodic' for an array.
    title : str
        Title, which is stored in the file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        If heights or lengths are not allowed, or the file exists and is no height map.
    OSError
        If it cannot be written.

    Examples
    --------
    >>> import asperity, pathlib, tempfile
    >>> height = asperity.surface.self_affine(32, lx=1e-3, wavelength_short=1e-4,
    ...                                       rms_slope=0.1)
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> asperity.surface.save(folder / "road.h5", height, 1e-3).name
    'road.h5'
    >>> asperity.surface.load(folder / "road.h5").lx
    0.001
    """
    held = _map_of(height, "height")
    if held.lx is None:
        if lx is None:
            raise ValueError("lx: must be given with an array of heights")
        lx, ly = library.lengths(held.height.shape, lx, ly)
        held = HeldMap(held.height, lx, ly, boundary != "free")
    elif lx is not None or ly is not None:
        raise ValueError("lx, ly: a topography has its own lengths")
    if boundary is not None:
        held = held._replace(periodic=not library.flag_of_boundary(boundary))
    return _write(Path(path), held, title)


def _write(path: Path, held: HeldMap, title: str) -> Path:
    """Write the file; it gets its name only when it is complete."""
    with new_map_file(path, title, "asperity", held.height.nbytes) as file:
        lengths = {}
        if held.lx is not None:
            ny, nx = held.height.shape
            lx = positive("lx", held.lx)
            ly = lx * ny / nx if held.ly is None else positive("ly", held.ly)
            write_grid(file, held.height.shape, lx, ly, bool(held.periodic))
            lengths = {"lx": lx, "ly": ly}
        write_height(file, held.height, **lengths)
    return path
