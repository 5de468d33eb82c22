"""Cases built in Python: the namelists of an input as an object.

Names, types, defaults and checks are those of the program: they come from the Fortran library.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, MutableMapping, MutableSequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from . import _input
from ._names import UnknownNameError, unknown_name

if TYPE_CHECKING:
    from .result import Run

__all__ = ["Case", "Group", "Groups", "UnknownVariableError"]

_WIDTH = 96  # columns of a written list


class UnknownVariableError(UnknownNameError, AttributeError, ValueError):
    """The input has no such group or variable; the message names the nearest one."""


class _Text(str):
    """A text that is shown as it is."""

    def __repr__(self) -> str:
        return str(self)


def _entry(group: str) -> _input.GroupEntry:
    """Return the entry of a group in the table of the input."""
    try:
        return _input.table()[group]
    except (KeyError, TypeError):
        raise UnknownVariableError(
            unknown_name("group of the input", group, _input.table())) from None


class Group(MutableMapping[str, Any]):
    """One group of an input: its variables are items and attributes.

    A variable that is not given has its default, or None where that is derived; iteration (in the
    order of the reference), ``in`` and ``len`` look at the given ones only. ``del`` takes a
    variable out again, and so does None. Each value is checked when it is set: its name, its type
    and its range.

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
    asperity.case.UnknownVariableError: &grid: no variable is named 'nxx': did you mean 'nx'?
    """

    _entry: _input.GroupEntry
    _values: dict[str, Any]

    def __init__(self, name: str, values: Mapping[str, Any] | None = None) -> None:
        object.__setattr__(self, "_entry", _entry(name))
        object.__setattr__(self, "_values", {})
        if values is not None and not isinstance(values, Mapping):
            raise ValueError(f"&{name}: {values!r}: must be a dict of variables")
        if isinstance(values, Group) and values._entry is self._entry:
            self._values.update({name: list(value) if isinstance(value, list) else value
                                 for name, value in values.items()})
        else:
            self.update(values or {})

    def _variable(self, name: object) -> _input.Variable:
        """Return what is known of a variable."""
        variable = self._entry.variables.get(name) if isinstance(name, str) else None
        if variable is None:
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
        try:
            text = _input.format_value(value)
        except ValueError as error:
            raise ValueError(f"&{self._entry.name}: {name} = {error}") from None
        self._values[name] = self._read(name, text)

    def _read(self, name: str, text: str) -> Any:
        """Return a written value as the program reads it."""
        try:
            ((_, values),) = _input.listed(f"&{self._entry.name} {name} = {text}\n/\n")
        except ValueError as error:
            raise ValueError(_input.fault_of(error)) from None
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

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value

    def __delattr__(self, name: str) -> None:
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
            lines += _wrapped(f"  {name} = ", _input.format_value(value), isinstance(value, list))
        return "\n".join([*lines, "/"])

    __repr__ = __str__


def _wrapped(head: str, text: str, is_list: bool) -> list[str]:
    """Return an assignment as lines; a list is broken between its values."""
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
    """The groups of a kind that may be repeated: a list, counted from 0.

    Examples
    --------
    >>> phases = Groups("phase", [{"pressure": 1e5}])
    >>> phases.append(duration=1e-3, velocity_x=1.0)
    >>> len(phases), phases[-1].velocity_x
    (2, 1.0)
    """

    def __init__(self, name: str, groups: Iterable[Mapping[str, Any]] = ()) -> None:
        self._name = _entry(name).name
        if isinstance(groups, Mapping):
            groups = [groups]
        self._groups = [self._group(values) for values in groups]

    def _group(self, values: Mapping[str, Any]) -> Group:
        """Return a new group with these values."""
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
            self[index]  # an index that is out of range has its message
            self._groups[index] = self._group(values)

    def __delitem__(self, index: int | slice) -> None:
        self[index]
        del self._groups[index]

    def __len__(self) -> int:
        return len(self._groups)

    def insert(self, index: int, values: Mapping[str, Any]) -> None:
        """Insert a group before an index."""
        self._groups.insert(index, self._group(values))

    def append(self, values: Mapping[str, Any] | None = None, **more: Any) -> None:
        """Append a group; its variables come as a mapping, as keywords, or both."""
        self.insert(len(self), {**(values or {}), **more})

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Groups | list) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return "\n".join(map(str, self._groups)) or f"(no &{self._name})"


def _are(number: int) -> str:
    """Return 'is 1' or 'are N'."""
    return "is 1" if number == 1 else f"are {number}"


class Case:
    """An input of the program, built, changed, checked, written and run from Python.

    The groups of the input are attributes and items: ``case.grid.nx = 128``,
    ``case["grid"]["nx"]``. ``case.surface`` and ``case.phase``, which may be repeated, are lists of
    groups. A name or a value that the program would refuse is refused at once; `check` tells how
    they fit together. ``str(case)`` is the text of the input.

    Parameters
    ----------
    title : str, optional
        The title, the variable of the group ``case``.
    **groups
        Values of the groups, by name: dicts of variables, or lists of dicts for ``surface`` and
        ``phase``. Numbers may be those of numpy, lists of numbers its arrays.

    Attributes
    ----------
    path : Path or None
        The file it was read from or written to. Paths within the case start from its folder;
        without a file from the current folder.

    Raises
    ------
    ValueError
        If there is no such group or variable, with the nearest name, or a value is not allowed.

    Examples
    --------
    >>> import asperity
    >>> case = asperity.Case(
    ...     title="Wave", grid=dict(nx=64, ny=1, lx=1e-3),
    ...     surface=dict(shape="sine", amplitude=1e-6, wavelength=1e-3),
    ...     material=dict(shear_modulus=1e6), phase=[dict(pressure=1e4)])
    >>> case.phase.append(pressure=2e4)
    >>> case.grid.nx = 128
    >>> print(case.check().splitlines()[4])
      nx = 128
    >>> case.grid.boundary = "open"
    Traceback (most recent call last):
    ...
    ValueError: &grid: boundary = 'open': must be one of 'periodic' | 'free'
    """

    path: Path | None
    _groups: dict[str, Group | Groups]

    def __init__(self, title: str | None = None, **groups: Any) -> None:
        object.__setattr__(self, "_groups", {})
        object.__setattr__(self, "path", None)
        for name in _input.table():
            self[name] = {} if not _input.table()[name].is_repeatable else []
        for name, values in groups.items():
            self[name] = values
        if title is not None:
            self["case"]["title"] = title

    @classmethod
    def read(cls, source: str | os.PathLike[str]) -> Case:
        """Return the case of an input, a file or its text.

        Comments are not kept.

        Parameters
        ----------
        source : str or path
            A path, or the namelists themselves: a text that starts with ``&`` or ``!`` or has
            several lines.

        Raises
        ------
        ValueError
            If names, types or ranges are wrong; all faults are named.
        OSError
            If the file cannot be read.
        """
        case = cls()
        if _input.is_text(source):
            name, text = "case.nml", str(source)
        else:
            name, text = os.fspath(source), _read(Path(source))
            case.path = Path(source)
        for group, values in _input.listed(text, name):
            if _entry(group).is_repeatable:
                new = Group(group)
                case[group].insert(len(case[group]), new)
                case[group][-1]._values.update(values)
            else:
                case[group]._values.update(values)
        return case

    @staticmethod
    def help(name: str | None = None) -> str:
        """Return what is known of a group or a variable: type, default, units, meaning.

        Parameters
        ----------
        name : str, optional
            Such as ``"grid"`` or ``"phase.velocity_x"``; the names of all groups if left out.

        Examples
        --------
        >>> import asperity
        >>> asperity.Case.help("solver.tolerance")
        solver.tolerance: real, default 1e-6; (0, 1)
            Residual of every solve.
        """
        if name is None:
            return _Text("\n".join(f"&{entry.name}: {entry.meaning}"
                                   for entry in _input.table().values()))
        group, _, variable = name.partition(".")
        if not variable:
            return _Text(_entry(group))
        return _Text(Group(group)._variable(variable))

    def check(self, *, files: bool = True) -> str:
        """Validate the whole, as ``asperity check`` does.

        Parameters
        ----------
        files : bool
            Look into the height maps, too.

        Returns
        -------
        str
            What the command prints: every resolved setting, the time steps, the memory needed,
            and warnings.

        Raises
        ------
        ValueError
            With the messages of the command, one a line; the lines are those of ``str(case)``.
        OSError
            If a height map cannot be read.
        """
        return _Text(_input.check_text(str(self), self._name, files))

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the input to a file, which becomes the case's `path`.

        Relative paths of height maps are changed so that they mean the same files from there.

        Returns
        -------
        Path
            The file.
        """
        path = Path(path)
        new = self.copy()
        new._follow(path.parent)
        path.write_bytes(_input.encode(str(new)))
        object.__setattr__(self, "_groups", new._groups)
        self.path = path
        return path

    def _follow(self, folder: Path) -> None:
        """Change the relative paths of height maps to those seen from another folder."""
        old = self._name.parent
        if folder.resolve() == old.resolve():
            return
        for surface in self["surface"]:
            file = surface.file
            if file and not Path(file).is_absolute():
                surface.file = os.path.relpath((old / file).resolve(), folder.resolve())

    def run(self, **options: Any) -> Run:
        """Run the case in this process; `asperity.run` tells the options.

        The result lies where ``case.output.file`` says, by default beside the input's file with
        the ending .h5; a case without a file counts as ``case.nml`` in the current folder.

        Returns
        -------
        Run
            The opened result.

        Raises
        ------
        ValueError, OSError, NotConverged
            As `asperity.run`.
        """
        from .runner import run

        return run(self, **options)

    def copy(self) -> Case:
        """Return a case of its own with the same values."""
        new = Case()
        for name, group in self._groups.items():
            new[name] = group
        new.path = self.path
        return new

    __copy__ = copy

    def __deepcopy__(self, memo: dict[int, Any]) -> Case:
        return self.copy()

    def __getstate__(self) -> dict[str, Any]:
        return {"text": str(self), "path": self.path}

    def __setstate__(self, state: dict[str, Any]) -> None:
        read = Case.read(state["text"] + "\n")
        object.__setattr__(self, "_groups", read._groups)
        object.__setattr__(self, "path", state["path"])

    @property
    def title(self) -> str:
        """The title: the variable of the group ``case``."""
        return self["case"].title

    @title.setter
    def title(self, title: str) -> None:
        self["case"]["title"] = title

    @property
    def _name(self) -> Path:
        """The file's name, for messages and results."""
        return Path("case.nml") if self.path is None else self.path

    def __getitem__(self, name: str) -> Any:
        return self._groups[_entry(name).name]

    def __setitem__(self, name: str, values: Any) -> None:
        entry = _entry(name)
        if values is None:
            values = [] if entry.is_repeatable else {}
        self._groups[name] = Groups(name, values) if entry.is_repeatable else Group(name, values)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "path":
            object.__setattr__(self, "path", None if value is None else Path(value))
        elif name == "title":
            self["case"]["title"] = value
        else:
            self[name] = value

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._groups})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._groups)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Case) and self._groups == other._groups

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        blocks = []
        for name, group in self._groups.items():
            if isinstance(group, Groups):
                blocks += map(str, group)
            elif group or _entry(name).is_required:
                blocks.append(str(group))
        return "".join(f"{block}\n" for block in blocks)

    def __repr__(self) -> str:
        return f"! {self._name if self.path else 'a case without a file'}\n{self}"


def _read(path: Path) -> str:
    """Return the text of a file."""
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such file")
    try:
        return _input.decode(path.read_bytes())
    except OSError as error:
        raise OSError(f"{path}: cannot be read: {error.strerror}") from None
