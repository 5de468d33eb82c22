"""Export of results to other programs: xarray data sets, and VTK image data for ParaView."""

from __future__ import annotations

import base64
import os
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ..base.files import write_text
from ..base.optional import needed

if TYPE_CHECKING:
    import xarray

    from ..results import Run, Snapshot

__all__ = ["run_to_xarray", "to_vtk", "to_xarray"]

KINDS = {"f8": "Float64", "f4": "Float32", "i1": "Int8", "i4": "Int32", "i8": "Int64"}
VECTORS = ("displacement", "traction", "slip")


def to_xarray(snapshot: Snapshot) -> xarray.Dataset:
    """Return a snapshot as a data set of xarray, which must be installed.

    Parameters
    ----------
    snapshot : Snapshot
        The snapshot, of which all fields are read.

    Returns
    -------
    xarray.Dataset
        Fields with the dimensions (y, x), coordinates `x` and `y` in m, and scalar coordinates
        `time` and `step`. The attributes `units` and `long_name` are those that xarray's plots use.

    Raises
    ------
    ImportError
        If xarray is not installed.
    """
    xarray = needed("xarray", "to_xarray")
    run, grid = snapshot.run, snapshot.run.grid

    def along(name: str, values: NDArray[np.float64]) -> Any:
        return (name, values, {"units": "m", "long_name": f"centres of the cells along {name}"})

    fields = {name: (("y", "x"), snapshot[name],
                     {"units": snapshot.units(name), "long_name": snapshot.long_name(name)})
              for name in snapshot.fields}
    return xarray.Dataset(
        fields,
        coords={"x": along("x", grid.x), "y": along("y", grid.y),
                "time": ((), snapshot.time, {"units": "s", "long_name": "time"}),
                "step": ((), snapshot.step, {"long_name": "number of the row"})},
        attrs={"title": run.title, "phase": snapshot.phase, "boundary": grid.boundary,
               "lx": grid.lx, "ly": grid.ly, "source": f"{run.program} {run.version}",
               "file": str(run.path)})


def run_to_xarray(run: Run) -> xarray.Dataset:
    """Return the history and all snapshots of a run as one data set of xarray.

    Parameters
    ----------
    run : Run
        The result, of which all fields are read into memory.

    Returns
    -------
    xarray.Dataset
        The columns of the history have the dimension `step` and the coordinates `time` and `phase`.
        The fields have the dimensions (snapshot, y, x), where `snapshot` is the number of the row
        and `snapshot_time` its time. The road before any sliding is `height` (y, x). Columns with
        the name of a field are called `mean_pressure`, `mean_traction_x` and `mean_traction_y`.

    Raises
    ------
    ImportError
        If xarray is not installed.
    """
    xarray = needed("xarray", "to_xarray")
    grid, history = run.grid, run.history
    stored = list(run.snapshots)
    names = [name for name in (stored[0].fields if stored else ())
             if all(name in snapshot for snapshot in stored)]
    columns = {(f"mean_{name}" if name in names else name): (
        "step", history[name], {"units": history.units(name), "long_name": history.long_name(name)})
        for name in history if name not in ("step", "time", "phase")}
    fields = {name: (("snapshot", "y", "x"), np.stack([snapshot[name] for snapshot in stored]),
                     {"units": stored[0].units(name), "long_name": stored[0].long_name(name)})
              for name in names}
    metres = {"units": "m"}
    coordinates: dict[str, Any] = {
        "step": ("step", history["step"].astype(int), {"long_name": "number of the row"}),
        "time": ("step", history["time"], {"units": "s", "long_name": "time"}),
        "phase": ("step", history["phase"].astype(int), {"long_name": "number of the phase"}),
        "x": ("x", grid.x, metres | {"long_name": "centres of the cells along x"}),
        "y": ("y", grid.y, metres | {"long_name": "centres of the cells along y"}),
        "snapshot": ("snapshot", np.array([snapshot.step for snapshot in stored], dtype=int),
                     {"long_name": "step of the snapshot"}),
        "snapshot_time": ("snapshot", np.array([snapshot.time for snapshot in stored]),
                          {"units": "s", "long_name": "time of the snapshot"})}
    road = {"height": (("y", "x"), run.height, metres | {"long_name": "height of the road"})}
    return xarray.Dataset(
        columns | fields | road, coords=coordinates,
        attrs={"title": run.title, "boundary": grid.boundary, "lx": grid.lx, "ly": grid.ly,
               "source": f"{run.program} {run.version}", "file": str(run.path)})


def to_vtk(snapshot: Snapshot, path: str | os.PathLike[str]) -> Path:
    """Write a snapshot as VTK image data (.vti), which ParaView and VisIt open.

    There is one value per cell. Displacements, tractions and slips are also stored as the vectors
    `displacement`, `traction` and `slip`, which glyphs and warps can use. The file includes the
    time of the snapshot. All values are in SI units.

    Parameters
    ----------
    snapshot : Snapshot
        The snapshot, of which all fields are read.
    path : str or Path
        The file to write; '.vti' is added if the name has no ending.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        If the name has another ending.
    OSError
        If the file cannot be written.
    """
    target = Path(path)
    if not target.suffix:
        target = target.with_name(target.name + ".vti")
    if target.suffix != ".vti":
        raise ValueError(f"{target}: VTK image data has the ending .vti")
    grid = snapshot.run.grid
    arrays = [_array(name, snapshot[name][..., None]) for name in snapshot.fields]
    for name in VECTORS:
        if f"{name}_x" in snapshot and f"{name}_y" in snapshot:
            last = f"{name}_z"
            parts = [snapshot[f"{name}_x"], snapshot[f"{name}_y"],
                     snapshot[last] if last in snapshot else np.zeros((grid.ny, grid.nx))]
            arrays.append(_array(name, np.stack(parts, axis=-1)))
    extent = f"0 {grid.nx} 0 {grid.ny} 0 0"
    # The coordinates are those of the centres of cells, so the image begins half a cell earlier.
    origin = f"{-0.5 * grid.dx!r} {-0.5 * grid.dy!r} 0"
    field = [_array("TimeValue", np.array([snapshot.time]), tuples=1),
             _array("step", np.array([snapshot.step], dtype=np.int64), tuples=1)]
    shown = "pressure" if "pressure" in snapshot else snapshot.fields[0] if snapshot.fields else ""
    text = "\n".join([
        '<?xml version="1.0"?>',
        '<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
        ' compressor="vtkZLibDataCompressor">',
        f'<ImageData WholeExtent="{extent}" Origin="{origin}"'
        f' Spacing="{grid.dx!r} {grid.dy!r} 1">',
        "<FieldData>", *field, "</FieldData>",
        f'<Piece Extent="{extent}">',
        f"<CellData Scalars={quoteattr(shown)}>", *arrays, "</CellData>",
        "</Piece>", "</ImageData>", "</VTKFile>", ""])
    write_text(target, text, "ascii")
    return target


def _array(name: str, values: NDArray[Any], tuples: int | None = None) -> str:
    """Return an array as an element: one compressed block, in base 64.

    Parameters
    ----------
    name : str
        Its name.
    values : ndarray
        Shape (ny, nx, components); any shape with `tuples`.
    tuples : int, optional
        Number of tuples, which an array of the field data states.
    """
    values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    data = values.tobytes()
    packed = zlib.compress(data, 6)
    # Number of blocks, size of each, size of a last one that is cut (none), compressed sizes.
    head = np.array([1, len(data), 0, len(packed)], dtype="<u8").tobytes()
    kind = KINDS[values.dtype.str[1:]]
    count = (f' NumberOfTuples="{tuples}"' if tuples is not None else
             f' NumberOfComponents="{values.shape[-1]}"')
    body = (base64.b64encode(head) + base64.b64encode(packed)).decode("ascii")
    return (f'<DataArray type="{kind}" Name={quoteattr(name)}{count} format="binary">'
            f"{body}</DataArray>")
