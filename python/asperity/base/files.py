"""The files that the package writes: what they may replace, and how they are written."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import h5py

__all__ = ["INPUT", "MAP", "MATERIAL", "PICTURE", "RESULT", "SHIFTS", "SHIFTS_HEAD",
           "STATE", "WEB_PAGE", "check_folder", "check_output", "kind_of", "make_folder",
           "new_file", "sealed", "size_text", "write_text"]

#: Kinds of file that the package and the program write, in the words of messages.
INPUT = "an input"
MAP = "a height map of Asperity"
MATERIAL = "a material that `asperity fit` writes"
PICTURE = "a picture or a film"
RESULT = "the result of a run"
SHIFTS = "a table of shifts"
STATE = "the state of a simulation"
WEB_PAGE = "a page of Asperity"

#: First line of a table of shifts.
SHIFTS_HEAD = "temperature,log10_a_t,a_t,b_t"

_HEAD = 65_536  # bytes of a text from which its kind is found
_SEAL = "! asperity fit wrote the lines below; checksum "
_GENERATOR = b'<meta name="generator" content="asperity '  # in the first lines of a page
#: First bytes of pictures and films that matplotlib writes.
_PICTURES = re.compile(
    rb"\x89PNG|%PDF|%!PS|GIF8|\xff\xd8\xff|II\*\0|MM\0\*|RIFF....WEBP|....ftyp|\x1f\x8b"
    rb"|(?:<\?xml.{0,500})?(?:<!DOCTYPE svg|<svg)|%% Creator: Matplotlib", re.DOTALL)
#: Everything that a file of a height map may contain. A part of the user's would be lost.
_MAP_PARTS = {"grid", "grid/x", "grid/y", "source", "source/metadata", "surface", "surface/height"}
_MAP_ATTRIBUTES = re.compile("title|program|version|created|source_\\w+|steps|steps_text|n[xy]"
                             "|l[xy]|boundary|units|long_name|rms_height|rms_slope")


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
                         MAP: _is_map(file)}
        except OSError:  # the file is damaged
            return ""
        return next((kind for kind, holds in found.items() if holds), "")
    with path.open("rb") as text:
        head = text.read(_HEAD)
    if head.startswith(SHIFTS_HEAD.encode()):
        return SHIFTS
    if _PICTURES.match(head):
        return PICTURE
    if _GENERATOR in head[:2000]:
        return WEB_PAGE
    groups = {name.lower() for name in re.findall(rb"(?m)^[ \t]*&([A-Za-z]\w*)", head)}
    if not groups or b"\0" in head:
        return ""
    return MATERIAL if groups == {b"material"} and _is_sealed(path) else INPUT


def _is_map(file: h5py.File) -> bool:
    """Return whether the package wrote a file of a height map, and nothing was added to it."""
    import h5py

    def only_ours(group: h5py.Group, at: str) -> bool:
        for name in group:
            if (at + name not in _MAP_PARTS
                    or not isinstance(group.get(name, getlink=True), h5py.HardLink)):
                return False
            part = group[name]
            if not all(map(_MAP_ATTRIBUTES.fullmatch, part.attrs)):
                return False
            if isinstance(part, h5py.Group) and not only_ours(part, f"{at}{name}/"):
                return False
        return True

    return (str(file.attrs.get("program", "")) in ("asperity", "asperity import")
            and {"version", "created"} <= set(file.attrs) and "surface/height" in file
            and all(map(_MAP_ATTRIBUTES.fullmatch, file.attrs)) and only_ours(file, ""))


def sealed(text: str) -> str:
    r"""Return the text of a material with a first line by which a later change is seen.

    Examples
    --------
    >>> sealed("&material shear_modulus = 1e6 /\n").splitlines()[0]
    '! asperity fit wrote the lines below; checksum 69f50688322b3ed6'
    """
    return f"{_SEAL}{_checksum(text)}\n{text}"


def _is_sealed(path: Path) -> bool:
    """Return whether a text is as `sealed` gave it, apart from the ends of lines."""
    first, _, text = path.read_text(encoding="utf-8", errors="replace").partition("\n")
    return first == _SEAL + _checksum(text)


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()[:16]


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

    An empty file may be replaced, and devices and pipes may be written to.

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
    mark = f"{os.getpid()}-{secrets.token_hex(4)}"  # two machines may have the same process numbers
    new = target.with_name(f".{target.stem}.{mark}.new{target.suffix}")
    try:
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError("its permissions do not allow it")
        yield new if temporary else path
        if temporary:
            new.replace(target)
    except OSError as error:
        # What is written may itself be given its name by this function.
        reason = error.strerror or str(error).removeprefix(f"{new}: ").removeprefix(
            "cannot be written: ")
        raise OSError(f"{path}: cannot be written: {reason}") from None
    finally:
        if temporary:
            with suppress(OSError):  # where nothing can be written, nothing can be removed
                new.unlink(missing_ok=True)


def size_text(path: Path) -> str:
    """Return the size of a file in kB or MB."""
    size = path.stat().st_size
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


def write_text(path: Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file, whose lines end in the way of Unix, by `new_file`."""
    with new_file(path) as new:
        new.write_text(text, encoding=encoding, newline="\n")
