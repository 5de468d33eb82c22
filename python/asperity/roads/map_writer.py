"""Writing of the HDF5 file of a height map, which ``&surface shape = 'file'`` reads."""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import MAP, check_output
from ..base.library import version

if TYPE_CHECKING:
    import h5py

__all__ = ["new_map_file", "write_grid", "write_height"]


_MORE = 20_000  # bytes that a file takes beside the heights


@contextmanager
def new_map_file(path: Path, title: str, program: str, size: int) -> Iterator[h5py.File]:
    """Open a new file, which gets its name when it is complete.

    Parameters
    ----------
    path : Path
        The file.
    title, program : str
        Attributes of the file.
    size : int
        Size of the heights, bytes. There must be room for them, because HDF5 may crash if there is
        none when it closes a file.

    Yields
    ------
    h5py.File
        The open file, under a temporary name.

    Raises
    ------
    ValueError
        If the path is that of a file that is no height map.
    OSError
        If it cannot be written.
    """
    import h5py

    check_output(path, MAP)
    new = path.with_name(f"{path.name}.{os.getpid()}-{secrets.token_hex(4)}.new")
    try:
        with new.open("wb") as empty:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(empty.fileno(), 0, size + _MORE)
        with h5py.File(new, "w") as file:
            file.attrs.update(title=title, program=program, version=version(),
                              created=f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}")
            yield file
        new.replace(path)
    except (OSError, RuntimeError) as error:  # h5py raises the latter where closing a file fails
        reason = re.search("error message = '(.*?)'", str(error))
        said = (reason and reason[1]) or (isinstance(error, OSError) and error.strerror) or error
        raise OSError(f"{path}: cannot be written: {said}") from None
    finally:
        new.unlink(missing_ok=True)


def write_height(file: h5py.File, height: NDArray[np.float64], **attributes: Any) -> None:
    """Write the heights (m), with attributes."""
    data = file.create_dataset("surface/height", data=height)
    data.attrs.update(units="m", long_name="height of the road", **attributes)


def write_grid(file: h5py.File, shape: tuple[int, ...], lx: float, ly: float,
               periodic: bool) -> None:
    """Write the grid of the heights: its lengths in m, and the centres of its cells."""
    ny, nx = shape
    grid = file.create_group("grid")
    grid.attrs.update(nx=np.int32(nx), ny=np.int32(ny), lx=lx, ly=ly,
                      boundary="periodic" if periodic else "free")
    for name, count, length in (("x", nx, lx), ("y", ny, ly)):
        axis = grid.create_dataset(name, data=np.arange(count) * length / count)
        axis.attrs.update(units="m", long_name=f"centres of the cells along {name}")
