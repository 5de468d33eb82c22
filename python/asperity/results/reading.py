"""Reading of result files, to which the program may be writing at the same time."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

__all__ = ["NotAResultError", "attributes_of", "read_file", "scalar_of", "text_of"]

T = TypeVar("T")

_SIGNATURE = b"\x89HDF\r\n\x1a\n"


class NotAResultError(OSError):
    """The file is not a result, because parts that every result has are missing."""


def read_file(path: Path, read: Callable[[h5py.File], T]) -> T:
    """Open a file, call `read` with it, and close it.

    If this fails, for example because the program is writing at that moment, it is repeated a few
    times.
    """
    _check(path)
    reason: OSError
    options: dict[str, Any] = {"locking": False}  # because the program may be writing
    for attempt in range(5):
        try:
            with h5py.File(path, "r", **options) as file:
                return read(file)
        except NotAResultError as error:
            reason = error
        except (OSError, RuntimeError, KeyError) as error:
            detail = str(error.args[0] if error.args else error)
            if "locking flag" in detail:  # the caller has the file open with h5py's defaults
                options = {}
            reason = OSError(f"{path}: cannot be read: {_in_words(detail)}; if its run was killed,"
                             " `asperity run CASE.nml --restart` continues from the last"
                             " checkpoint; otherwise run the case again")
        time.sleep(0.02 * (attempt + 1))
    raise reason from None


def _in_words(detail: str) -> str:
    """Return the reason that HDF5 gives for a failure, in plain words where the file is cut off.

    Examples
    --------
    >>> _in_words("... (truncated file: eof = 10, sblock->base_addr = 0, stored_eof = 99)")
    'its end is missing: it has 10 of 99 bytes'
    """
    cut = re.search(r"truncated file: eof = (\d+), .*stored_eof = (\d+)", detail)
    return f"its end is missing: it has {cut[1]} of {cut[2]} bytes" if cut else detail


def _check(path: Path) -> None:
    """Raise OSError for faults that HDF5 would not explain well."""
    if path.is_dir():
        raise IsADirectoryError(f"{path}: is a folder: name the file RESULT.h5 in it")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file: `asperity run CASE.nml` makes it")
    with path.open("rb") as file:
        start = file.read(8)
    if not start:
        raise OSError(f"{path}: is empty: the run has written nothing; run the case again")
    if start != _SIGNATURE:
        raise OSError(f"{path}: is not an HDF5 file: name the result of `asperity run`")


def text_of(value: Any) -> str:
    """Return a text attribute as a string, whatever type of string it has in the file."""
    value = scalar_of(value)
    if isinstance(value, str):
        value = value.encode("utf-8", errors="surrogateescape")  # undoes h5py's treatment of bytes
    if isinstance(value, bytes):
        try:
            value = value.decode("utf-8")
        except UnicodeDecodeError:
            value = value.decode("latin-1")  # from an input that is not UTF-8
    return str(value).rstrip(" \0")


def scalar_of(value: Any) -> Any:
    """Return the element of an array of one element, and anything else unchanged."""
    if isinstance(value, np.ndarray) and value.size == 1:
        return value.reshape(-1)[0]
    return value


def attributes_of(item: h5py.Group) -> dict[str, Any]:
    """Return the attributes of an object as plain values."""
    values = {}
    for name, value in item.attrs.items():
        one = scalar_of(value)
        if isinstance(one, bytes | str):
            values[name] = text_of(one)
        elif isinstance(one, np.generic):
            values[name] = one.item()
        else:
            values[name] = one
    return values
