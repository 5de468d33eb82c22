"""The files that the package writes: what they may replace, and how they are written."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["INPUT", "MAP", "MATERIAL", "RESULT", "SHIFTS", "SHIFTS_HEAD", "STATE", "check_folder",
           "check_output", "kind_of", "make_folder"]

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
                         MAP: "surface/height" in file}
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
