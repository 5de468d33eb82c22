"""The groups of an input as objects, whose variables are items and attributes.

The names, types, defaults and checks come from the Fortran library.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping, MutableSequence
from typing import TYPE_CHECKING, Any, overload

from ..base.check import shown
from ..base.names import UnknownNameError, unknown_name
from ..roads.held_maps import held_map, is_map
from . import namelists
from .sampled_law import Law, sampled_law

__all__ = ["Group", "Groups", "UnknownVariableError", "entry_of"]

_WIDTH = 96  # longest line of a written list
#: Other names of Young's modulus, as the program knows them (input_values.f90).
_NAMES_OF_TENSION = ("e", "e_modulus", "elastic_modulus", "young_modulus", "youngs_modulus")


class UnknownVariableError(UnknownNameError, AttributeError, ValueError):
    """The input has no such group or variable. The message suggests the nearest name."""


def entry_of(group: str) -> namelists.GroupEntry:
    """Return the entry of a group in the table of the input.

    Raises
    ------
    UnknownVariableError
        If there is no such group.
    """
    try:
        return namelists.table()[group]
    except (KeyError, TypeError):
        raise UnknownVariableError(
            unknown_name("group of the input", group, namelists.table())) from None


class Group(MutableMapping[str, Any]):
    """One group of an input, whose variables are items and attributes.

    A variable that is not given returns its default, or None if the default is derived from other
    values. Iteration (in the order of the reference), ``in`` and ``len`` cover only the variables
    that are given. ``del``, or the value None, removes a variable. When a value is set, its name,
    type and range are checked.

    Parameters
    ----------
    name : str
        Name of the group, such as 'grid'.
    values : Mapping, optional
        Values of its variables.

    Raises
    ------
    ValueError
        If there is no such variable or it cannot have this value.

    Examples
    --------
    >>> grid = Group("grid", {"nx": 64, "lx": 1e-3})
    >>> grid.ny = 32
    >>> print(grid)
    &grid
      nx = 64
      ny = 32
      lx = 0.001
    /
    >>> grid.boundary, "boundary" in grid
    ('periodic', False)
    >>> grid.nxx = 3
    Traceback (most recent call last):
    ...
    asperity.runs.groups.UnknownVariableError: &grid: no variable is named 'nxx': did you mean 'nx'?
    """

    _entry: namelists.GroupEntry
    _values: dict[str, Any]

    def __init__(self, name: str, values: Mapping[str, Any] | None = None) -> None:
        object.__setattr__(self, "_entry", entry_of(name))
        object.__setattr__(self, "_values", {})
        if values is not None and not isinstance(values, Mapping):
            map_too = (", or a height map: an array of shape (ny, nx), a MeasuredSurface or a"
                       " topography" * (name == "surface"))
            raise ValueError(f"&{name}: {shown(values)}: must be a dict of variables{map_too}")
        if isinstance(values, Group) and values._entry is self._entry:
            self._values.update({name: list(value) if isinstance(value, list) else value
                                 for name, value in values.items()})
        else:
            self.update(values or {})

    def _variable(self, name: object) -> namelists.Variable:
        """Return the description of a variable."""
        variable = self._entry.variables.get(name) if isinstance(name, str) else None
        if variable is None:
            if str(name).lower() in _NAMES_OF_TENSION and self._entry.name == "material":
                raise UnknownVariableError(f"&material: no variable is named {name!r}: give"
                                           " shear_modulus = E/(2 (1 + poisson))")
            raise UnknownVariableError(f"&{self._entry.name}: " + unknown_name(
                "variable", name, self._entry.variables))
        return variable

    def __getitem__(self, name: str) -> Any:
        variable = self._variable(name)
        if name in self._values:
            return self._values[name]
        if variable.default.startswith("("):
            return None
        return self._read(name, variable.default)

    def __setitem__(self, name: str, value: Any) -> None:
        self._variable(name)
        if value is None:
            self._values.pop(name, None)
            return
        if callable(value) and (self._entry.name, name) == ("friction", "law"):
            self._take_law(value)
            return
        try:
            text = namelists.format_value(value)
        except ValueError as error:
            raise ValueError(f"&{self._entry.name}: {name} = {error}") from None
        self._values[name] = self._read(name, text)

    def _take_law(self, function: Law) -> None:
        """Set the friction law to the table of a function."""
        pressures, strengths = sampled_law(function)
        self.update(law="table", table_pressure=pressures, table_strength=strengths)

    def _read(self, name: str, text: str) -> Any:
        """Return a written value as the program reads it."""
        try:
            ((_, values),) = namelists.listed(f"&{self._entry.name} {name} = {text}\n/\n")
        except ValueError as error:
            raise ValueError(namelists.fault_of(error)) from None
        return values[name]

    def __delitem__(self, name: str) -> None:
        self._variable(name)
        if name not in self._values:
            raise UnknownVariableError(f"&{self._entry.name}: {name} is not given")
        del self._values[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._entry.variables if name in self._values)

    def __len__(self) -> int:
        return len(self._values)

    # Type checkers know the variables of each group by name (module group_types). With the methods
    # below they would accept any other name, too.
    if not TYPE_CHECKING:
        def __getattr__(self, name):
            if name.startswith("_"):
                raise AttributeError(name)
            return self[name]

        def __setattr__(self, name, value):
            self[name] = value

        def __delattr__(self, name):
            del self[name]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._entry.variables})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._entry.variables)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mapping) and dict(self) == dict(other)

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> Group:
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Group:
        return Group(self._entry.name, self)

    def __reduce__(self) -> tuple[Any, ...]:
        return Group, (self._entry.name, dict(self._values))

    def __str__(self) -> str:
        lines = [f"&{self._entry.name}"]
        for name, value in self.items():
            text = namelists.format_value(value)
            lines += _wrapped(f"  {name} = ", text, isinstance(value, list))
        return "\n".join([*lines, "/"])

    __repr__ = __str__


def _wrapped(head: str, text: str, is_list: bool) -> list[str]:
    """Return an assignment as lines; a long list is broken between its values."""
    if not is_list or len(head) + len(text) <= _WIDTH:
        return [head + text]
    lines, line = [], head
    for piece in text.split(", "):
        if len(line) + len(piece) > _WIDTH and line.strip():
            lines.append(line.rstrip())
            line = " " * len(head)
        line += piece + ", "
    return [*lines, line.removesuffix(", ")]


class Groups(MutableSequence[Group]):
    """The groups of a kind that may be repeated, as a list that is counted from 0.

    Examples
    --------
    >>> phases = Groups("phase", [{"pressure": 1e5}])
    >>> phases.append(duration=1e-3, velocity_x=1.0)
    >>> len(phases), phases[-1].velocity_x
    (2, 1.0)
    """

    def __init__(self, name: str, groups: Iterable[Mapping[str, Any]] = ()) -> None:
        self._name = entry_of(name).name
        one = (isinstance(groups, Mapping | str) or not isinstance(groups, Iterable)
               or is_map(groups))
        listed: Iterable[Any] = [groups] if one else groups
        self._groups = [self._group(values) for values in listed]

    def _group(self, values: Mapping[str, Any]) -> Group:
        """Return a new group with these values; a height map is replaced by its temporary file."""
        if self._name == "surface" and is_map(values):
            values = {"shape": "file", "file": str(held_map(values))}
        return Group(self._name, values)

    @overload
    def __getitem__(self, index: int) -> Group: ...

    @overload
    def __getitem__(self, index: slice) -> list[Group]: ...

    def __getitem__(self, index: Any) -> Any:
        try:
            return self._groups[index]
        except IndexError:
            raise IndexError(f"{self._name}[{index}]: there {_are(len(self._groups))}, counted"
                             " from 0") from None

    def __setitem__(self, index: Any, values: Any) -> None:
        if isinstance(index, slice):
            self._groups[index] = [self._group(one) for one in values]
        else:
            self[index]  # raises IndexError with a message if the index is out of range
            self._groups[index] = self._group(values)

    def __delitem__(self, index: int | slice) -> None:
        self[index]
        del self._groups[index]

    def __len__(self) -> int:
        return len(self._groups)

    def insert(self, index: int, values: Mapping[str, Any]) -> None:
        """Insert a group before an index.

        Parameters
        ----------
        index : int
            Index in the list.
        values : Mapping
            Variables of the group; for ``surface`` also a height map.

        Raises
        ------
        ValueError
            If a variable does not exist or a value is not allowed.
        """
        self._groups.insert(index, self._group(values))

    def append(self, values: Any = None, **more: Any) -> None:
        """Append a group.

        Parameters
        ----------
        values : Mapping, optional
            Variables of the group; for a surface also a height map.
        **more
            Further variables as keywords.

        Raises
        ------
        ValueError
            If a variable does not exist or a value is not allowed.
        """
        self.insert(len(self), {**(values or {}), **more} if more or values is None else values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Groups | list) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "\n".join(map(str, self._groups)) or f"(no &{self._name})"


def _are(number: int) -> str:
    """Return 'is 1' or 'are N'."""
    return "is 1" if number == 1 else f"are {number}"
