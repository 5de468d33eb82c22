"""Mappings whose names are also attributes. Tab completes a name, and errors suggest near names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

__all__ = ["NamedFields", "NamedValues", "OpenValues", "UnknownNameError", "counted",
           "unknown_name"]


class UnknownNameError(KeyError):
    """A KeyError whose message is shown without quotation marks."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


def unknown_name(what: str, name: object, names: Iterable[str]) -> str:
    """Return a message that names the nearest of the known names.

    Examples
    --------
    >>> unknown_name("column of the history", "fricton", ["friction", "time"])
    "no column of the history is named 'fricton': did you mean 'friction'?"
    >>> unknown_name("column of the history", "q", ["friction", "time"])
    "no column of the history is named 'q': there are friction, time"
    """
    known = list(names)
    near = difflib.get_close_matches(str(name), known, n=3, cutoff=0.6)
    if near:
        hint = f"did you mean {' or '.join(map(repr, near))}?"
    else:
        hint = f"there are {', '.join(known)}" if known else "there is none"
    return f"no {what} is named {name!r}: {hint}"


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun, whose plural takes an s if it is not given.

    Examples
    --------
    >>> counted(1, "row"), counted(0, "row"), counted(2, "patch", "patches")
    ('1 row', '0 rows', '2 patches')
    """
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


class NamedValues(Mapping[str, Any]):
    """Read-only mapping of names to values; each value is also an attribute.

    For type checkers, only the names that a subclass declares exist. Use `OpenValues` if the names
    are not known in advance.

    Parameters
    ----------
    values : Mapping
        The values.
    what : str
        What a value is, for messages.

    Examples
    --------
    >>> material = NamedValues({"poisson": 0.5}, "property of the material")
    >>> material["poisson"], material.poisson
    (0.5, 0.5)
    """

    def __init__(self, values: Mapping[str, Any], what: str = "value") -> None:
        self._values = dict(values)
        self._what = what

    def __getitem__(self, name: str) -> Any:
        try:
            return self._values[name]
        except (KeyError, TypeError):
            raise UnknownNameError(unknown_name(self._what, name, self._values)) from None

    if not TYPE_CHECKING:
        def __getattr__(self, name):
            if name.startswith("_"):
                raise AttributeError(name)
            try:
                return self._values[name]
            except KeyError:
                raise AttributeError(unknown_name(self._what, name, self._values)) from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._values})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._values)

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {value}" for name, value in self._values.items()) or "(empty)"


class NamedFields:
    """Fields by name, each read or computed when it is accessed, as an item or as an attribute."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        raise NotImplementedError

    def __iter__(self) -> Iterator[str]:
        raise NotImplementedError

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except UnknownNameError as error:
            raise AttributeError(str(error)) from None

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)


class OpenValues(NamedValues):
    """Named values with arbitrary names, such as the attributes of a file."""

    if TYPE_CHECKING:
        def __getattr__(self, name: str) -> Any: ...
