"""Cases built in Python: the input of the program as an object.

The names, types, defaults and checks come from the Fortran library.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.files import INPUT, MATERIAL, check_output, new_file
from ..base.presenters import present
from ..roads.held_maps import keep_beside, map_of_file
from . import namelists
from .groups import Group, Groups, UnknownVariableError, entry_of

if TYPE_CHECKING:
    from ..results import Run
    from .group_types import CaseGroups
else:
    CaseGroups = object

__all__ = ["Case", "Group", "Groups", "UnknownVariableError"]


class _Text(str):
    """A text that is displayed without quotation marks."""

    def __repr__(self) -> str:
        return str(self)


def _check_title(title: Any) -> None:
    """Refuse an input in the place of a title: the case would be empty but for its title."""
    if isinstance(title, os.PathLike) or (isinstance(title, str) and (
            title.endswith(".nml") or title.lstrip().startswith("&"))):
        raise ValueError(f"title = {str(title)[:60]!r}: must be a title;"
                         " asperity.Case.read reads an input")


class Case(CaseGroups):
    """An input of the program, which can be built, changed, checked, written and run from Python.

    The groups of the input are attributes and items: ``case.grid.nx = 128``,
    ``case["grid"]["nx"]``. ``case.surface`` and ``case.phase``, which may be repeated, are lists of
    groups. A name or a value that the program would refuse raises an error at once. `check` also
    checks whether the values fit together. ``str(case)`` is the text of the input.

    Parameters
    ----------
    title : str, optional
        Title of the case.
    **groups
        Values of the groups, by name: dicts of variables, or lists of dicts for ``surface`` and
        ``phase``. Values may be NumPy numbers and arrays.

        A surface may also be a height map: an array of shape (ny, nx) in m, or nested lists, in
        which summits are maxima, a `MeasuredSurface` of `asperity.surface.load`, or a topography of
        SurfaceTopography. The grid then gets its numbers of cells and, except from an array, its
        lengths, unless the grid has values of its own.
        The map is stored in a temporary file; `write` and `run` copy it beside the input or the
        result.

        The friction law may be a function that takes an array of pressures, Pa, and returns the
        largest tractions, Pa, in an array of the same shape. It becomes a table for
        pressures from 0 to 1e11 Pa.

    Attributes
    ----------
    path : Path or None
        The file from which the case was read or to which it was written. Relative paths in the case
        start from its folder or, without a file, from the current folder.

    Raises
    ------
    ValueError
        If a group or a variable does not exist (the message suggests the nearest name), or if a
        value is not allowed.

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

    # Type checkers know the groups by name, from CaseGroups.
    if not TYPE_CHECKING:
        def __init__(self, title: str | None = None, **groups: Any) -> None:
            _check_title(title)
            object.__setattr__(self, "_groups", {})
            object.__setattr__(self, "path", None)
            for name in namelists.table():
                self[name] = {} if not namelists.table()[name].is_repeatable else []
            for name, values in groups.items():
                self[name] = values
            self._take_grid()
            if title is not None:
                self["case"]["title"] = title

    @classmethod
    def read(cls, source: str | os.PathLike[str]) -> Case:
        """Return the case of an input file, or of the text of an input. Comments are not kept.

        Parameters
        ----------
        source : str or Path
            The path of a file, or the text itself, which starts with ``&`` or ``!`` or has several
            lines.

        Returns
        -------
        Case

        Raises
        ------
        ValueError
            If names, types or ranges are wrong. The message lists all faults.
        OSError
            If the file cannot be read.
        """
        if not os.fspath(source):
            raise ValueError("source = '': must be the path of a file, or the text of an input")
        case = cls()
        if namelists.is_text(source):
            name, text = "case.nml", str(source)
        else:
            name, text = os.fspath(source), _read(Path(source))
            case.path = Path(source)
        for group, values in namelists.listed(text, name):
            if entry_of(group).is_repeatable:
                new = Group(group)
                case[group].insert(len(case[group]), new)
                case[group][-1]._values.update(values)
            else:
                case[group]._values.update(values)
        return case

    @staticmethod
    def help(name: str | None = None) -> str:
        """Return the description of a group or a variable: type, default, units, meaning.

        Parameters
        ----------
        name : str, optional
            Name of a group or a variable, such as ``"grid"`` or ``"phase.velocity_x"``. By default
            all groups are listed.

        Returns
        -------
        str
            The description.

        Raises
        ------
        ValueError
            If there is no such name.

        Examples
        --------
        >>> import asperity
        >>> asperity.Case.help("solver.tolerance")
        solver.tolerance: real, default 1e-6; (0, 1)
            Largest allowed residual of every solve.
        """
        if name is None:
            return _Text("\n".join(f"&{entry.name}: {entry.meaning}"
                                   for entry in namelists.table().values()))
        group, _, variable = name.partition(".")
        if not variable:
            return _Text(entry_of(group))
        return _Text(Group(group)._variable(variable))

    def check(self, *, files: bool = True) -> str:
        """Check the case, as ``asperity check`` does.

        Parameters
        ----------
        files : bool
            Whether to check the height maps, too.

        Returns
        -------
        str
            The output of the command: every resolved setting, the time steps, the memory needed,
            and warnings.

        Raises
        ------
        ValueError
            With the messages of the command, one per line. Line numbers are those of ``str(case)``.
        OSError
            If a height map cannot be read.
        """
        return _Text(namelists.check_text(str(self), self._name, files))

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the input to a file, which becomes the `path` of the case.

        Relative paths of height maps are changed so that they still lead to the same files.

        Parameters
        ----------
        path : str or Path
            The file, NAME.nml. An older input is replaced; any other file is refused.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            If it cannot be written.
        ValueError
            If the file exists and is no input.
        """
        path = Path(path)
        check_output(path, INPUT, MATERIAL)
        new = self.kept_in(path.parent)
        new._follow(path.parent)
        for old, surface in zip(self["surface"], new["surface"], strict=True):
            if map_of_file(old.file) is not None:
                surface.file = Path(surface.file).name
        with new_file(path) as file:
            file.write_bytes(namelists.encode(str(new)))
        object.__setattr__(self, "_groups", new._groups)
        self.path = path
        return path

    def kept_in(self, folder: str | os.PathLike[str]) -> Case:
        """Return a case whose arrays of heights are stored as files in a folder.

        Parameters
        ----------
        folder : str or Path
            Folder to which the maps are copied.

        Returns
        -------
        Case
        """
        new = self.copy()
        for surface in new["surface"]:
            if map_of_file(surface.file) is not None:
                surface.file = str(keep_beside(surface.file, Path(folder)).resolve())
        return new

    def _take_grid(self) -> None:
        """Complete the grid with values of the first height map that is held in memory."""
        held = next((held for held in (map_of_file(one.file) for one in self["surface"])
                     if held is not None), None)
        if held is None:
            return
        ny, nx = held.height.shape
        known: dict[str, Any] = {"nx": nx, "ny": ny, "lx": held.lx, "ly": held.ly}
        if held.periodic is False and ny > 1:
            known["boundary"] = "free"
        for name, value in known.items():
            if value is not None and name not in self["grid"]:
                self["grid"][name] = value

    def _follow(self, folder: Path) -> None:
        """Change the relative paths of height maps so that they start from another folder."""
        old = self._name.parent
        if folder.resolve() == old.resolve():
            return
        for surface in self["surface"]:
            file = surface.file
            if file and not Path(file).is_absolute():
                surface.file = os.path.relpath((old / file).resolve(), folder.resolve())

    def run(self, **options: Any) -> Run:
        """Run the case in this process.

        The result is the file ``case.output.file``, by default the input's name with the ending
        .h5. A case without a file counts as ``case.nml`` in the current folder.

        Parameters
        ----------
        **options
            Options of `asperity.run`.

        Returns
        -------
        Run
            The opened result.

        Raises
        ------
        ValueError, OSError, MemoryError, NotConverged
            As in `asperity.run`.
        """
        from .runner import run

        return run(self, **options)

    def copy(self) -> Case:
        """Return an independent copy of the case."""
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
    def result(self) -> Path:
        """The file to which a run writes its result by default."""
        file = self["output"].file
        return self._name.parent / file if file else self._name.with_suffix(".h5")

    @property
    def _name(self) -> Path:
        """Name of the file, for messages and results."""
        return Path("case.nml") if self.path is None else self.path

    def __getitem__(self, name: str) -> Any:
        return self._groups[entry_of(name).name]

    def __setitem__(self, name: str, values: Any) -> None:
        entry = entry_of(name)
        if values is None:
            values = [] if entry.is_repeatable else {}
        self._groups[name] = Groups(name, values) if entry.is_repeatable else Group(name, values)

    if not TYPE_CHECKING:
        @property
        def title(self) -> str:
            """The title: the variable of the group ``case``."""
            return self["case"].title

        def __getattr__(self, name):
            if name.startswith("_"):
                raise AttributeError(name)
            return self[name]

        def __setattr__(self, name, value):
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
        blocks: list[str] = []
        for name, group in self._groups.items():
            if isinstance(group, Groups):
                blocks += map(str, group)
            elif group or entry_of(name).is_required:
                blocks.append(str(group))
        return "".join(f"{block}\n" for block in blocks)

    def _repr_html_(self) -> str:
        return present("case_html", self)

    def __repr__(self) -> str:
        return f"! {self._name if self.path else 'a case without a file'}\n{self}"


def _read(path: Path) -> str:
    """Return the text of a file."""
    if not path.exists():
        raise FileNotFoundError(f"{path}: there is no such file")
    try:
        return namelists.decode(path.read_bytes())
    except OSError as error:
        raise OSError(f"{path}: cannot be read: {error.strerror}") from None
