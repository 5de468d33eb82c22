"""Simulations that Python drives: one row after another, steered between them, without files."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np
from numpy.typing import NDArray

from ..base import library
from ..base.check import whole
from ..base.errors import NotConverged
from ..base.names import NamedFields, UnknownNameError, unknown_name
from . import namelists
from .row import Row, columns

__all__ = ["FIELDS", "RunView", "Simulation"]

_open = library.call("simulation_open")
_step = library.call("simulation_step", interruptible=True)
_steer = library.call("simulation_steer")
_save = library.call("simulation_save")
_load = library.call("simulation_load")
_close = library.call("simulation_close")
_row = library.call("run_row")
_field = library.call("run_field")

#: The fields of a simulation: those of a snapshot; `height` is short for `road_height`.
FIELDS = ("pressure", "gap", "displacement_z", "traction_x", "traction_y", "displacement_x",
          "displacement_y", "slip_x", "slip_y", "contact", "road_height", "height")

_LOADS = ("pressure", "force", "displacement")


class _CaseLike(Protocol):
    """What is needed of an `asperity.Case`: its text is ``str(case)``."""

    path: Path | None


class _Fields(NamedFields, Mapping[str, NDArray[Any]]):
    """The fields as they are now: arrays of shape (ny, nx) of their own."""

    def __init__(self, handle: int, shape: tuple[int, int]) -> None:
        self._handle, self._shape = handle, shape

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in FIELDS:
            raise UnknownNameError(unknown_name("field", name, FIELDS))
        ny, nx = self._shape
        values = np.zeros((ny, nx))
        _field(self._handle, name, values.T)
        return values.astype(np.int8) if name == "contact" else values

    def __iter__(self) -> Iterator[str]:
        return iter(FIELDS)

    def __len__(self) -> int:
        return len(FIELDS)

    def __repr__(self) -> str:
        return f"fields of {self._shape[0]} x {self._shape[1]} cells: {', '.join(FIELDS)}"


class RunView:
    """What a callback of `asperity.run` sees of the run: its last row and its fields.

    Attributes
    ----------
    row : Row
        The last row, with the columns of the history as attributes and items.
    fields : Mapping
        The fields as they are now, by the names of a snapshot (``height`` is short for
        ``road_height``): arrays of shape (ny, nx).
    rows : int
        Number of rows of the whole run.
    """

    def __init__(self, handle: int, rows: int, shape: tuple[int, int]) -> None:
        self._handle = handle
        self.rows = rows
        self.fields = _Fields(handle, shape)

    @property
    def row(self) -> Row:
        """The last row."""
        values = np.zeros(len(columns()))
        _row(self._handle, values)
        return Row(values)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in (*_LOADS, "velocity", "temperature"):
            raise AttributeError(
                f"{name} cannot be set in a callback of asperity.run: a run that writes a result"
                " follows its input. Use asperity.Simulation")
        super().__setattr__(name, value)


class Simulation:
    """A run that Python drives row by row and may steer; it writes no files.

    A simulation that nobody steers gives the numbers of ``asperity run`` to the last bit. A height
    map that the case holds as an array passes through a temporary file.

    Parameters
    ----------
    case : str, path or Case
        The input, CASE.nml; or its text, or an `asperity.Case`.
    threads : int, optional
        Number of threads; what the case says if left out.

    Attributes
    ----------
    finished : bool
        No row is left.
    row : Row or None
        The last row, with the columns of the history as attributes and items; None before the
        first one.
    fields : Mapping
        The fields as they are now, by the names of a snapshot (``height`` is short for
        ``road_height``): arrays of shape (ny, nx).
    rows : int
        Number of rows that the case has if nobody steers.
    shape : tuple of int
        Shape of the fields, (ny, nx).

    Raises
    ------
    ValueError
        If the input is wrong; all faults are named.
    OSError
        If a height map cannot be read.

    Examples
    --------
    >>> import asperity
    >>> sim = asperity.Simulation('''
    ... &grid nx = 64, ny = 1, lx = 1e-3 /
    ... &surface shape = 'sine', amplitude = 1e-6, wavelength = 1e-3 /
    ... &material shear_modulus = 1e6, prony_g = 1e6, prony_tau = 1e-3 /
    ... &phase pressure = 8e3, duration = 1e-2, steps = 10 /
    ... ''')
    >>> while not sim.finished:
    ...     row = sim.advance()
    ...     if row.contact_area > 0.5:
    ...         sim.pressure = 0.5 * row.pressure
    >>> sim.row.step, sim.row.pressure < 8e3
    (10, True)
    """

    rows: int
    shape: tuple[int, int]
    finished: bool
    fields: Mapping[str, NDArray[Any]]

    def __init__(self, case: str | os.PathLike[str] | _CaseLike, *,
                 threads: int | None = None) -> None:
        if threads is not None:
            threads = whole("threads", threads)
        path, text = namelists.source(case)
        handle, rows, nx, ny, lx, ly, told = _open(os.fsencode(path), namelists.encode(text),
                                                   threads or 0)
        self._path, self._text = path, text or namelists.decode(Path(path).read_bytes())
        self._handle = int(handle)
        self._release = weakref.finalize(self, _close, self._handle)
        self._steered: dict[str, Any] = {}
        self.rows, self.shape, self.finished = int(rows), (int(ny), int(nx)), False
        self._lengths = float(lx), float(ly)
        self._started = False
        self.fields = _Fields(self._handle, self.shape)
        _warn(told)

    # --- rows -------------------------------------------------------------------------------

    def advance(self) -> Row:
        """Do the next row.

        Returns
        -------
        Row
            The row that was done, also `row`.

        Raises
        ------
        ValueError
            If the simulation is finished or closed.
        NotConverged
            If a solver fails; its ``result`` is this simulation, with the state reached.
        KeyboardInterrupt
            At Ctrl-C. The row is given up; the simulation is where it was before.
        """
        if self.finished:
            raise ValueError("the simulation is finished: no row is left")
        try:
            finished, told = _step(self._handle)
        except NotConverged as error:
            self._started = self.finished = True
            raise NotConverged(str(error), self) from None
        self._started = True
        self.finished = bool(finished)
        _warn(told)
        return self._last()

    def _last(self) -> Row:
        """Return the last row of the library."""
        values = np.zeros(len(columns()))
        _row(self._handle, values)
        return Row(values)

    @property
    def row(self) -> Row | None:
        """The last row; None before the first one."""
        return self._last() if self._started else None

    def __iter__(self) -> Iterator[Row]:
        """Do the rows that are left, one after another."""
        while not self.finished:
            yield self.advance()

    # --- steering ---------------------------------------------------------------------------

    def _set(self, what: str, first: float, second: float = 0.0) -> None:
        """Change what the next rows are done with, and keep it for a saved state."""
        _steer(self._handle, what, float(first), float(second))
        if what in _LOADS:
            for other in _LOADS:
                self._steered.pop(other, None)
        self._steered[what] = [float(first), float(second)]

    @property
    def pressure(self) -> float:
        """Mean normal pressure, Pa: of the last row; set it for the rows to come."""
        return self._last().pressure

    @pressure.setter
    def pressure(self, value: float) -> None:
        self._set("pressure", value)

    @property
    def force(self) -> float:
        """Normal force, N: of the last row; set it for the rows to come."""
        return self._last().force

    @force.setter
    def force(self, value: float) -> None:
        self._set("force", value)

    @property
    def displacement(self) -> float:
        """Approach of the far rubber, m: of the last row; set it for the rows to come."""
        return self._last().displacement

    @displacement.setter
    def displacement(self, value: float) -> None:
        self._set("displacement", value)

    @property
    def velocity(self) -> tuple[float, float] | None:
        """Velocity of the road that was set, m/s, along x and y; None where the phases hold."""
        found = self._steered.get("velocity")
        return None if found is None else (found[0], found[1])

    @velocity.setter
    def velocity(self, value: tuple[float, float]) -> None:
        pair = np.asarray(value, dtype=float)
        if pair.shape != (2,):
            raise ValueError(f"velocity = {value!r}: must be two numbers, along x and y, in m/s")
        self._set("velocity", pair[0], pair[1])

    @property
    def temperature(self) -> float | None:
        """Temperature that was set, C; None where that of the case holds."""
        found = self._steered.get("temperature")
        return None if found is None else found[0]

    @temperature.setter
    def temperature(self, value: float) -> None:
        self._set("temperature", value)

    # --- saved states -----------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the state to an HDF5 file from which `resume` goes on to the same numbers.

        The file holds the input, the road and what was set, too: nothing else is needed. It
        takes the place of an older one when it is complete.

        Parameters
        ----------
        path : str or path
            The file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            Before the first row.
        OSError
            If the file cannot be written.
        """
        if not self._started:
            raise ValueError("there is no state to save before the first row: call advance()")
        path = Path(path)
        if not path.parent.is_dir():
            raise FileNotFoundError(f"{path}: cannot be written: there is no folder"
                                    f" {str(path.parent)!r}")
        with tempfile.TemporaryDirectory(prefix="asperity-") as folder:
            _save(self._handle, os.fsencode(Path(folder) / "state.h5"))
            state = np.fromfile(Path(folder) / "state.checkpoint.h5", dtype=np.uint8)
        new = path.with_name(f".{path.name}.{os.getpid()}.new")
        try:
            with h5py.File(new, "w") as file:
                file.attrs["kind"] = "state of an asperity.Simulation"
                file.attrs["version"] = library.version()
                file.attrs["input"] = self._text
                file.attrs["input_path"] = str(Path(self._path).absolute())
                file.attrs["steered"] = json.dumps(self._steered)
                file["state"] = state
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)
        return path

    @classmethod
    def resume(cls, path: str | os.PathLike[str], *, threads: int | None = None) -> Simulation:
        """Return the simulation of a saved state, ready for its next row.

        Parameters
        ----------
        path : str or path
            A file that `save` has written.
        threads : int, optional
            Number of threads; what the case says if left out.

        Raises
        ------
        OSError
            If the file is missing, damaged or no saved state, or a height map is missing.
        ValueError
            If a height map is not the one that it was.
        """
        path = Path(path)
        if not path.exists():
            raise FileNotFoundError(f"{path}: there is no such file")
        try:
            with h5py.File(path, "r") as file:
                text, source = str(file.attrs["input"]), str(file.attrs["input_path"])
                steered = json.loads(file.attrs["steered"])
                state = file["state"][()]
        except (OSError, KeyError, ValueError) as error:
            raise OSError(f"{path}: is no saved state of a simulation") from error
        self = cls._of_text(text, source, threads)
        with tempfile.TemporaryDirectory(prefix="asperity-") as folder:
            state.tofile(Path(folder) / "state.checkpoint.h5")
            # First what was set, which changes the phases; the state then says where they stand.
            for what, (first, second) in steered.items():
                self._set(what, first, second)
            try:
                (finished,) = _load(self._handle, os.fsencode(Path(folder) / "state.h5"))
            except (OSError, ValueError) as error:
                message = str(error).replace(str(Path(folder) / "state.checkpoint.h5"), str(path))
                raise type(error)(message) from None
        self._started, self.finished = True, bool(finished)
        return self

    @classmethod
    def _of_text(cls, text: str, source: str, threads: int | None) -> Simulation:
        """Return a new simulation of a text whose paths start where a file lies."""
        return cls(_Input(text, Path(source)), threads=threads)

    def close(self) -> None:
        """Free the memory now; later calls say that the simulation is closed."""
        self.finished = True
        self._release()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        where = "before its first row"
        if not self._release.alive:
            return "simulation that is closed"
        if self._started:
            row = self._last()
            where = f"after row {row.step}, t = {row.time:.6g} s"
        return (f"simulation of {self.shape[1]} x {self.shape[0]} cells, {where}"
                f"{', finished' if self.finished else ''}")


class _Input:
    """An input of which the text and the name are known."""

    def __init__(self, text: str, path: Path) -> None:
        self._text, self.path = text, path

    def __str__(self) -> str:
        return self._text


def _warn(told: bytes) -> None:
    """Raise the warnings of the library as those of Python."""
    for line in told.decode(errors="replace").strip().splitlines():
        warnings.warn(line, UserWarning, stacklevel=3)
