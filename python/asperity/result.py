"""Results of runs: one HDF5 file each, read while the run goes on or afterwards.

All quantities are in SI units. Fields have the shape (ny, nx): ``field[j, i]`` belongs to
``x[i]``, ``y[j]``.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

import h5py
import numpy as np
from numpy.typing import NDArray

from ._names import NamedValues, UnknownNameError, unknown_name
from ._standing import note_of, rows_of, standing

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Grid", "History", "Run", "Snapshot", "Snapshots", "open_result"]

T = TypeVar("T")
FloatArray = NDArray[np.float64]

_NORMAL = ("pressure", "gap", "displacement_z", "contact")
_TANGENTIAL = ("traction_x", "traction_y", "displacement_x", "displacement_y", "slip_x", "slip_y")
_SIGNATURE = b"\x89HDF\r\n\x1a\n"


class _NotAResultError(OSError):
    """The file lacks what every result holds."""


@dataclass(frozen=True)
class Grid:
    """The regular grid of cells.

    Attributes
    ----------
    nx, ny : int
        Number of cells; ``ny == 1`` is a plane-strain line contact.
    lx, ly : float
        Lengths of the cell, m.
    boundary : str
        'periodic' or 'free'.
    x, y : ndarray
        Centres of the cells, m; shapes (nx,) and (ny,).
    """

    nx: int
    ny: int
    lx: float
    ly: float
    boundary: str
    x: FloatArray = field(repr=False, compare=False)
    y: FloatArray = field(repr=False, compare=False)

    @property
    def dx(self) -> float:
        """Width of a cell along x, m."""
        return self.lx / self.nx

    @property
    def dy(self) -> float:
        """Width of a cell along y, m."""
        return self.ly / self.ny


class History(NamedValues):
    """The history of a run: a mapping from names to numpy arrays, one value a row.

    The row 0 is the initial state; a step adds a row. Of a run that is being written, the rows
    that every column has are shown.
    """

    def __init__(self, columns: dict[str, NDArray[Any]], units: dict[str, str],
                 long_names: dict[str, str]) -> None:
        rows = min((len(column) for column in columns.values()), default=0)
        super().__init__({name: column[:rows] for name, column in columns.items()},
                         "column of the history")
        self._units = units
        self._long_names = long_names

    @property
    def rows(self) -> int:
        """Number of rows."""
        return min((len(column) for column in self._values.values()), default=0)

    def units(self, name: str) -> str:
        """Return the units of a column, '1' for a pure number."""
        self[name]
        return self._units.get(name, "1")

    def long_name(self, name: str) -> str:
        """Return the meaning of a column."""
        self[name]
        return self._long_names.get(name, name.replace("_", " "))

    def to_pandas(self) -> pandas.DataFrame:
        """Return the history as a table of pandas, which must be installed.

        Returns
        -------
        pandas.DataFrame
            A column a quantity, a line a row of the history, in SI units.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_pandas needs pandas: python -m pip install pandas") from error
        return pandas.DataFrame(self._values)

    def _repr_html_(self) -> str:
        from ._html import history_html

        return history_html(self)

    def __repr__(self) -> str:
        lines = [f"history of {self.rows} row{'' if self.rows == 1 else 's'}"]
        for name, column in self._values.items():
            last = f"{column[-1]:.6g}" if self.rows else "-"
            units = self._units.get(name, "1")
            lines.append(f"  {name:<22} {last:>13} {'' if units == '1' else units:<4}"
                         f" {self._long_names.get(name, '')}".rstrip())
        if self.rows:
            lines[0] += "; the last values:"
        return "\n".join(lines)


class Snapshot:
    """The fields of one row of the history, read from the file when they are asked for.

    ``snapshot.pressure`` and ``snapshot["pressure"]`` are the same array of shape (ny, nx).

    Attributes
    ----------
    step : int
        The row of the history it belongs to.
    time : float
        Time, s.
    phase : int
        Number of the phase, from 1.
    fields : tuple of str
        Names of the stored fields.
    """

    def __init__(self, run: Run, key: str) -> None:
        def read(file: h5py.File) -> tuple[int, float, int, dict[str, tuple[str, str]]]:
            group = file["snapshots"][key]
            meanings = {
                name: (_text(dataset.attrs.get("units", "1")),
                       _text(dataset.attrs.get("long_name", name.replace("_", " "))))
                for name, dataset in group.items() if isinstance(dataset, h5py.Dataset)
            }
            step, when, phase = (_scalar(group.attrs[name]) for name in ("step", "time", "phase"))
            return int(step), float(when), int(phase), meanings

        self._run = run
        self._key = key
        self.step, self.time, self.phase, self._meanings = _read(run.path, read)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the stored fields."""
        return tuple(self._meanings)

    @property
    def run(self) -> Run:
        """The run it belongs to."""
        return self._run

    def __getitem__(self, name: str) -> NDArray[Any]:
        self._check(name)
        return _read(self._run.path, lambda file: file["snapshots"][self._key][name][()])

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except UnknownNameError as error:
            raise AttributeError(str(error)) from None

    def _check(self, name: str) -> None:
        """Raise a message that helps on if there is no such field."""
        if name in self._meanings:
            return
        text = unknown_name("field of the snapshot", name, self._meanings)
        if name in _TANGENTIAL:
            text = (f"the snapshot holds no {name}: there are {', '.join(self._meanings)};"
                    " tangential fields are stored with `&friction`, unless `&output"
                    " snapshot_fields` leaves them out")
        elif name in _NORMAL:
            text = (f"the snapshot holds no {name}: there are {', '.join(self._meanings)};"
                    " `&output snapshot_fields` chooses what is stored")
        raise UnknownNameError(text)

    def __contains__(self, name: object) -> bool:
        return name in self._meanings

    def __iter__(self) -> Iterator[str]:
        return iter(self._meanings)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._meanings})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._meanings)

    def units(self, name: str) -> str:
        """Return the units of a field, '1' for a pure number."""
        self._check(name)
        return self._meanings[name][0]

    def long_name(self, name: str) -> str:
        """Return the meaning of a field."""
        self._check(name)
        return self._meanings[name][1]

    def plot(self, name: str = "pressure", ax: Axes | None = None,
             arrows: bool | None = None) -> Axes:
        """Draw a field: a map, or a profile if ny is 1.

        Parameters
        ----------
        name : str
            Name of the field; 'contact' shows what is open, sticks and slips.
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure, one column wide, if left out.
        arrows : bool, optional
            Whether to draw the tractions as arrows; by default on 'contact' only.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        KeyError
            If the snapshot holds no such field; the message names the nearest.
        """
        from .plot import plot_field

        return plot_field(self, name, ax, arrows)

    def to_xarray(self) -> xarray.Dataset:
        """Return the fields as a data set of xarray, which must be installed.

        Returns
        -------
        xarray.Dataset
            Dimensions (y, x) with coordinates in m; units and meanings are attributes.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        from .export import to_xarray

        return to_xarray(self)

    def to_vtk(self, path: str | os.PathLike[str]) -> Path:
        """Write the fields as VTK image data, which ParaView opens; return the path.

        Parameters
        ----------
        path : str or path
            The file, NAME.vti.

        Returns
        -------
        Path

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        from .export import to_vtk

        return to_vtk(self, path)

    def _repr_html_(self) -> str:
        from ._html import snapshot_html

        return snapshot_html(self)

    def __repr__(self) -> str:
        return (f"snapshot of step {self.step}, t = {self.time:g} s, phase {self.phase}:"
                f" {', '.join(self.fields)}")


class Snapshots(Sequence[Snapshot]):
    """The stored snapshots in the order of the steps; the last is ``snapshots[-1]``."""

    def __init__(self, run: Run, keys: list[str]) -> None:
        self._run = run
        self._keys = keys

    @property
    def steps(self) -> tuple[int, ...]:
        """The steps of the snapshots."""
        return tuple(int(key) for key in self._keys)

    def at_step(self, step: int) -> Snapshot:
        """Return the snapshot of a step.

        Parameters
        ----------
        step : int
            A step that has a snapshot, one of `steps`.

        Returns
        -------
        Snapshot

        Raises
        ------
        KeyError
            If there is none of that step; the message names those there are.
        """
        if step not in self.steps:
            raise UnknownNameError(f"no snapshot of step {step}: there are those of"
                                   f" {', '.join(map(str, self.steps)) or 'no step'};"
                                   " `&output snapshot_every` and `snapshot_times` choose them")
        return self[self.steps.index(step)]

    @overload
    def __getitem__(self, index: int) -> Snapshot: ...

    @overload
    def __getitem__(self, index: slice) -> list[Snapshot]: ...

    def __getitem__(self, index: int | slice) -> Snapshot | list[Snapshot]:
        if isinstance(index, slice):
            return [Snapshot(self._run, key) for key in self._keys[index]]
        try:
            key = self._keys[index]
        except IndexError:
            there = (f"there {'is' if len(self) == 1 else 'are'} {len(self)}" if len(self) else
                     "it holds none; the last row of a finished run has one, `&output"
                     " snapshot_every` and `snapshot_times` ask for more")
            raise IndexError(f"snapshot {index} of {self._run.path}: {there}") from None
        return Snapshot(self._run, key)

    def __len__(self) -> int:
        return len(self._keys)

    def __repr__(self) -> str:
        known = self.steps
        shown = known if len(known) <= 12 else (*known[:5], "...", *known[-3:])
        steps = ", ".join(map(str, shown)) or "none"
        return f"{len(self)} snapshot{'' if len(self) == 1 else 's'} (steps {steps})"


class Run:
    """The result of a run.

    Parameters
    ----------
    path : str or path
        The file, RESULT.h5.

    Attributes
    ----------
    path : Path
        The file.
    title, program, version, created : str
        Title of the case; what wrote the file and when.
    input : str
        The namelist file of the case, verbatim.
    finished : bool
        Whether the run has come to its end.
    grid : Grid
        The grid of cells.
    material : NamedValues
        The properties of the material.
    attributes : NamedValues
        All attributes of the file.
    history : History
        One value a row: ``run.history["friction"]``.
    snapshots : Snapshots
        The stored fields: ``run.snapshots[-1].pressure``.
    """

    path: Path
    grid: Grid
    history: History
    snapshots: Snapshots
    material: NamedValues
    attributes: NamedValues

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.refresh()

    def refresh(self) -> Run:
        """Read again what a run that is still going has written since; return the run itself.

        Returns
        -------
        Run

        Raises
        ------
        OSError
            If the file is gone, or cannot be read.
        """
        def read(file: h5py.File) -> None:
            for group in ("grid", "history"):
                if group not in file:
                    raise _NotAResultError(f"{self.path}: holds no /{group}: it is not a result"
                                           " of `asperity run`")
            self.attributes = NamedValues(_attributes(file), "attribute of the file")
            self.grid = _grid(file["grid"])
            material = file.get("material")
            values = {}
            if material is not None:
                values = _attributes(material) | {
                    name: item[()] if name.startswith("prony") else _scalar(item[()])
                    for name, item in material.items() if isinstance(item, h5py.Dataset)}
            self.material = NamedValues(values, "property of the material")
            columns = {name: item for name, item in file["history"].items()
                       if isinstance(item, h5py.Dataset)}
            first = [name for name in ("step", "phase", "time") if name in columns]
            names = first + [name for name in columns if name not in first]
            self.history = History(
                {name: np.atleast_1d(columns[name][()]) for name in names},
                {name: _text(columns[name].attrs.get("units", "1")) for name in names},
                {name: _text(columns[name].attrs.get("long_name", name)) for name in names})
            keys = [key for key in file.get("snapshots", {}) if key.isdigit()]
            self.snapshots = Snapshots(self, sorted(keys, key=int))

        _read(self.path, read)
        return self

    @property
    def title(self) -> str:
        """Title of the case."""
        return str(self.attributes.get("title", ""))

    @property
    def program(self) -> str:
        """Name of the program that wrote the file."""
        return str(self.attributes.get("program", ""))

    @property
    def version(self) -> str:
        """Version of the program that wrote the file."""
        return str(self.attributes.get("version", ""))

    @property
    def created(self) -> str:
        """When the file was made, ISO 8601, UTC."""
        return str(self.attributes.get("created", ""))

    @property
    def input(self) -> str:
        """The namelist file of the case, verbatim."""
        return str(self.attributes.get("input", ""))

    @property
    def finished(self) -> bool:
        """Whether the run has come to its end."""
        return bool(int(self.attributes.get("finished", 0)))

    @property
    def outcome(self) -> str:
        """How the run ended: 'running' (or killed), 'finished', 'stopped after ...', or why not."""
        return str(self.attributes.get("outcome", "finished" if self.finished else "running"))

    @property
    def state(self) -> str:
        """How the run stands, in words.

        'finished', or 'not finished' with why it ended, or else with the time since the file was
        last written: where that is much longer than a row takes, the run was perhaps killed.
        """
        return standing(self)

    @property
    def warnings(self) -> list[str]:
        """The warnings of the input, then those of the run (once it has ended or stopped)."""
        return [line for name in ("warnings", "run_warnings")
                for line in str(self.attributes.get(name, "")).splitlines() if line.strip()]

    @property
    def height(self) -> FloatArray:
        """Height of the road before any sliding, m, shape (ny, nx)."""
        def read(file: h5py.File) -> FloatArray:
            if "surface/height" not in file:
                raise _NotAResultError(f"{self.path}: holds no /surface/height")
            return file["surface/height"][()]

        return _read(self.path, read)

    @overload
    def plot(self) -> Figure: ...

    @overload
    def plot(self, name: str, x: str | None = None, ax: Axes | None = None,
             **style: Any) -> Axes: ...

    def plot(self, name: str | None = None, x: str | None = None, ax: Axes | None = None,
             **style: Any) -> Axes | Figure:
        """Draw a column of the history, or without a name an overview of the run.

        With friction, 'friction' is drawn with its causes, 'contact_area' with the area that
        sticks and 'sliding_speed' with the road's; 'energy' draws the books of energy.

        Parameters
        ----------
        name : str, optional
            Column to draw, or 'energy'; the overview if left out.
        x : str, optional
            Column along the axis: time by default; where time stands still, pressure or step.
        ax : matplotlib.axes.Axes, optional
            Where to draw; a new figure, one column wide, if left out.
        **style
            Passed on to `matplotlib.axes.Axes.plot` for the column itself.

        Returns
        -------
        matplotlib.axes.Axes or matplotlib.figure.Figure
            The axes of a column; the figure of the overview.
        """
        from .plot import plot_history, plot_overview

        if name is None:
            if x is not None or ax is not None or style:
                raise ValueError("plot: x, ax and style need the name of a column, such as"
                                 " 'friction'")
            return plot_overview(self)
        return plot_history(self, name, x, ax, **style)

    def overview(self) -> Figure:
        """Draw what tells most of the run, as `plot` does without a name.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from .plot import plot_overview

        return plot_overview(self)

    def report(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Write a page about the run, one HTML file for any browser; return its path.

        Parameters
        ----------
        path : str or path, optional
            The file to write; RESULT.html beside the result if left out.

        Returns
        -------
        Path

        Raises
        ------
        OSError
            If the page cannot be written.
        ValueError
            If it would overwrite a result.
        """
        from .report import write_report

        return write_report(self, path)

    def _repr_html_(self) -> str:
        from ._html import run_html

        return run_html(self)

    def __repr__(self) -> str:
        state = "finished" if self.finished else "not finished"
        lines = [f"{self.title or 'untitled run'} ({self.path})",
                 f"  {state}, {rows_of(self)}, {self.snapshots!r}",
                 f"  grid {self.grid.nx} x {self.grid.ny}, {self.grid.lx:g} m x"
                 f" {self.grid.ly:g} m, {self.grid.boundary}"]
        note = note_of(self)
        if note:
            lines.insert(2, f"  {note}")
        if self.history.rows:
            shown = [(name, self.history[name][-1], self.history.units(name))
                     for name in ("time", "pressure", "contact_area", "friction")
                     if name in self.history]
            lines.append("  last row: " + ", ".join(
                f"{name} {value:.6g}{'' if units == '1' else ' ' + units}"
                for name, value, units in shown))
        return "\n".join(lines)


def open_result(path: str | os.PathLike[str]) -> Run:
    """Open the result of a run, finished or still going.

    Parameters
    ----------
    path : str or path
        The file, RESULT.h5.

    Returns
    -------
    Run
        History, snapshots, grid, material and input of the run.

    Raises
    ------
    OSError
        If the file is missing or cannot be read, or is not a result.

    Examples
    --------
    >>> import asperity
    >>> asperity.open("nowhere.h5")
    Traceback (most recent call last):
    ...
    FileNotFoundError: nowhere.h5: no such file: `asperity run CASE.nml` makes it
    """
    return Run(path)


def _read(path: Path, read: Callable[[h5py.File], T]) -> T:
    """Open the file, read, close it; a file caught in the middle of a write is tried again."""
    _check_file(path)
    reason: OSError
    options: dict[str, Any] = {"locking": False}  # the program may be writing
    for attempt in range(5):
        try:
            with h5py.File(path, "r", **options) as file:
                return read(file)
        except _NotAResultError as error:
            reason = error
        except (OSError, RuntimeError, KeyError) as error:
            detail = str(error.args[0] if error.args else error)
            if "locking flag" in detail:  # the caller has it open through h5py's defaults
                options = {}
            reason = OSError(f"{path}: cannot be read: {detail}; if its run was killed,"
                             " `asperity run CASE.nml --restart` goes on from the last checkpoint;"
                             " otherwise run the case again")
        time.sleep(0.02 * (attempt + 1))
    raise reason from None


def _check_file(path: Path) -> None:
    """Raise what is wrong with a file before HDF5 looks at it."""
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


def _text(value: Any) -> str:
    """Return a text attribute, of whatever string type it is."""
    value = _scalar(value)
    if isinstance(value, str):
        value = value.encode("utf-8", errors="surrogateescape")  # h5py's way with other bytes
    if isinstance(value, bytes):
        try:
            value = value.decode("utf-8")
        except UnicodeDecodeError:
            value = value.decode("latin-1")  # of an input that is not UTF-8
    return str(value).rstrip(" \0")


def _scalar(value: Any) -> Any:
    """Return the value of an array of one element, anything else as it is."""
    if isinstance(value, np.ndarray) and value.size == 1:
        return value.reshape(-1)[0]
    return value


def _attributes(item: h5py.Group) -> dict[str, Any]:
    """Return the attributes of an object as plain values."""
    values = {}
    for name, value in item.attrs.items():
        one = _scalar(value)
        if isinstance(one, bytes | str):
            values[name] = _text(one)
        elif isinstance(one, np.generic):
            values[name] = one.item()
        else:
            values[name] = one
    return values


def _grid(group: h5py.Group) -> Grid:
    """Read the grid."""
    found = _attributes(group)
    return Grid(int(found["nx"]), int(found["ny"]), float(found["lx"]), float(found["ly"]),
                str(found["boundary"]), group["x"][()], group["y"][()])
