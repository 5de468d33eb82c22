"""The files that the package writes: what they may replace, and how they are written."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["INPUT", "MAP", "MATERIAL", "RESULT", "SHIFTS", "SHIFTS_HEAD", "STATE", "check_folder",
           "check_output", "kind_of", "make_folder", "new_file", "write_text"]

#: Kinds of file that the package and the program write, in the words of messages.
INPUT = "an input"
MAP = "a height map"
MATERIAL = "a material that `asperity fit` writes"
RESULT = "the result of a run"
SHIFTS = "a table of shifts"
STATE = "the state of a simulation"

#: First line of a table of shifts.
SHIFTS_HEAD = "temperature,log10_a_t,a_t,b_t"

_HEAD = 65_536  # bytes of a text from which its kind is found


def kind_of(path: Path) -> str:
    """Return the kind of a file: one of those above, or '' if it is none of them.

    Parameters
    ----------
    path : Path
        A file that exists.

    Returns
    -------
    str
        The kind.
    """
    import h5py

    if h5py.is_hdf5(path):
        try:
            with h5py.File(path, "r", locking=False) as file:
                found = {RESULT: "history" in file, STATE: "steered" in file.attrs,
                         MAP: "surface" in file}
        except OSError:  # the file is damaged
            return ""
        return next((kind for kind, holds in found.items() if holds), "")
    with path.open("rb") as text:
        head = text.read(_HEAD)
    if head.startswith(SHIFTS_HEAD.encode()):
        return SHIFTS
    groups = {name.lower() for name in re.findall(rb"(?m)^[ \t]*&([A-Za-z]\w*)", head)}
    if not groups or b"\0" in head:
        return ""
    return MATERIAL if groups == {b"material"} else INPUT


def check_folder(path: Path) -> None:
    """Raise OSError if the folder of a file that is to be written does not exist."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: cannot be written: there is no folder"
                                f" {str(path.parent)!r}")


def make_folder(folder: Path) -> None:
    """Make the folder of some runs, unless it exists; raise OSError if that is not possible."""
    place = next(place for place in (folder, *folder.parents) if place.exists())
    if not place.is_dir():
        raise NotADirectoryError(f"{place}: is a file: the runs need a folder")
    folder.mkdir(parents=True, exist_ok=True)


def check_output(path: Path, kind: str, *others: str) -> None:
    """Refuse a file that cannot be written, or would replace a file of another kind.

    An empty file may be replaced, and so may a device or a pipe be written to.

    Parameters
    ----------
    path : Path
        The file that is to be written.
    kind : str
        What it will be. A file of this kind may be replaced.
    *others : str
        Other kinds that may be replaced.

    Raises
    ------
    OSError
        If its folder does not exist, or it is a folder.
    ValueError
        If it is a file of another kind.
    """
    check_folder(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path}: is a folder, not a file")
    if not path.is_file() or path.stat().st_size == 0:
        return
    found = kind_of(path)
    if found not in (kind, *others):
        raise ValueError(f"{path}: {f'is {found}' if found else f'exists and is not {kind}'}:"
                         " name another file")


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Give a file its name when it is complete, so that a full disk leaves the file of before.

    Links are followed. A device or a pipe is written to directly.

    Parameters
    ----------
    path : Path
        The file.

    Yields
    ------
    Path
        Name of a temporary file in the same folder, with the same ending, to be written.

    Raises
    ------
    OSError
        If it cannot be written. The message names the file.
    """
    check_folder(path)
    target = Path(os.path.realpath(path))
    temporary = target.is_file() or not path.exists()
    new = target.with_name(f".{target.stem}.{os.getpid()}.new{target.suffix}")
    try:
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError("its permissions do not allow it")
        yield new if temporary else path
        if temporary:
            new.replace(target)
    except OSError as error:
        # What is written may itself be given its name by this function.
        reason = error.strerror or str(error).removeprefix(f"{new}: cannot be written: ")
        raise OSError(f"{path}: cannot be written: {reason}") from None
    finally:
        if temporary:
            new.unlink(missing_ok=True)


def write_text(path: Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file, whose lines end in the way of Unix, by `new_file`."""
    with new_file(path) as new:
        new.write_text(text, encoding=encoding, newline="\n")
