"""Simulations that Python drives row by row, with changes of the load in between, without files."""

from __future__ import annotations

import json
import os
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn, Protocol, SupportsIndex

import h5py
import numpy as np
from numpy.typing import NDArray

from ..base import library
from ..base.check import number, number_of_threads
from ..base.errors import NotConverged
from ..base.files import STATE, check_output, new_file
from ..base.names import NamedFields, UnknownNameError, unknown_name
from ..base.notices import warn_user
from ..results.field_types import NORMAL_FIELDS, TANGENTIAL_FIELDS
from . import namelists
from .row import Row, columns

__all__ = ["FIELDS", "RunView", "Simulation"]

_open = library.call("simulation_open")
_step = library.call("simulation_step", interruptible=True)
_progress = library.call("simulation_progress")
_steer = library.call("simulation_steer")
_save = library.call("simulation_save")
_load = library.call("simulation_load")
_row = library.call("run_row")
_field = library.call("run_field")

#: The fields of a simulation are those of a snapshot, and `height`, which is `road_height`.
FIELDS = (*NORMAL_FIELDS, *TANGENTIAL_FIELDS, "height")

_LOADS = ("pressure", "force", "displacement")
_FOLLOWED = 1.5         # cells per step, as `most_cells_per_step` of case_phases.f90


class _CaseLike(Protocol):
    """The part of `asperity.Case` that is needed here; its text is ``str(case)``."""

    @property
    def path(self) -> Path | None:
        """The file of the case."""
        ...


class _Fields(NamedFields, Mapping[str, NDArray[Any]]):
    """The present fields. Each access returns a new array of shape (ny, nx)."""

    def __init__(self, handle: int, shape: tuple[int, int], owner: object = None) -> None:
        self._handle, self._shape = handle, shape
        self._owner = owner  # kept alive, because the fields exist as long as the simulation does

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
    """The view of a run that a callback of `asperity.run` receives: the last row and the fields.

    Attributes
    ----------
    row : Row
        The last row, with the columns of the history as attributes and items.
    fields : Mapping
        The present fields by their names in a snapshot (``height`` is the same as ``road_height``),
        arrays of shape (ny, nx).
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
    """A run that Python advances row by row, with changes of load and velocity in between.

    It writes no result. If nothing is changed, the numbers are those of ``asperity run`` to the
    last bit. A height map that is given as an array is stored in a temporary file.

    Parameters
    ----------
    case : str, Path or Case
        The input file, CASE.nml, the text of an input, or an `asperity.Case`.
    threads : int, optional
        Number of threads; by default that of the case.

    Attributes
    ----------
    finished : bool
        Whether all rows have been computed.
    row : Row or None
        The last row, with the columns of the history as attributes and items; None before the first
        row.
    fields : Mapping
        The present fields by their names in a snapshot (``height`` is the same as ``road_height``),
        arrays of shape (ny, nx).
    rows : int
        Number of rows of the case if nothing is changed.
    shape : tuple of int
        Shape of the fields, (ny, nx).

    Raises
    ------
    ValueError
        If the input is wrong. The message lists all faults.
    OSError
        If a height map cannot be read.
    MemoryError
        If there is not enough memory.

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

    def __init__(self, case: str | os.PathLike[str] | _CaseLike, *,
                 threads: int | None = None) -> None:
        if threads is not None:
            threads = number_of_threads("threads", threads)
        path, text = namelists.source(case)
        handle, rows, nx, ny, lx, ly, notes = _open(os.fsencode(path), namelists.encode(text),
                                                    threads or 0)
        self._path, self._text = path, text or namelists.decode(Path(path).read_bytes())
        self._handle = int(handle)
        self._release = weakref.finalize(self, library.close_soon, "simulation_close", self._handle)
        self._steered: dict[str, Any] = {}
        self._rows, self._shape, self._finished = int(rows), (int(ny), int(nx)), False
        self._lengths = float(lx), float(ly)
        self._started = self._failed = self._watches_speed = False
        warn_of(notes)

    @property
    def finished(self) -> bool:
        """Whether all rows have been computed."""
        return self._finished

    @property
    def rows(self) -> int:
        """Number of rows of the case if nothing is changed."""
        return self._rows

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the fields, (ny, nx)."""
        return self._shape

    @property
    def fields(self) -> Mapping[str, NDArray[Any]]:
        """The present fields by their names in a snapshot, arrays of shape (ny, nx)."""
        # They are not an attribute, because they refer to the simulation: the memory of a circle
        # of references would be freed late.
        return _Fields(self._handle, self.shape, self)

    # --- rows -------------------------------------------------------------------------------

    def advance(self) -> Row:
        """Compute the next row.

        Returns
        -------
        Row
            The new row, which is also the attribute `row`.

        Raises
        ------
        ValueError
            If the simulation is finished or closed.
        NotConverged
            If a solver does not converge. Its ``result`` is this simulation in the state that was
            reached. The simulation is finished then: its row and fields can be read, but it can
            neither be continued nor saved.
        KeyboardInterrupt
            If Ctrl-C interrupts the row. The simulation is then where it was before the row, or
            after it if the row was just complete: `row` is the last complete one.
        """
        if not self._release.alive:
            raise ValueError("the simulation is closed")
        if self.finished:
            raise ValueError("the simulation is finished: no row is left")
        before = self._last() if self._watches_speed else None
        try:
            finished, notes = _step(self._handle)
        except NotConverged as error:
            self._started = self._failed = self._finished = True
            raise NotConverged(str(error), self) from None
        except KeyboardInterrupt:
            self._started, self._finished = map(bool, _progress(self._handle))
            raise
        self._started = True
        self._finished = bool(finished)
        warn_of(notes)
        row = self._last()
        if before is not None:
            self._watch_speed(before, row)
        return row

    def _watch_speed(self, before: Row, row: Row) -> None:
        """Warn once if a velocity that was set moves the road too far in a step.

        For the velocities of the input, the program checks this before the run.
        """
        (ny, nx), (lx, ly) = self._shape, self._lengths
        cells = max(abs(row.road_x - before.road_x) * nx / lx,
                    abs(row.road_y - before.road_y) * ny / ly if ny > 1 else 0.0)
        if cells <= _FOLLOWED:
            return
        self._watches_speed = False
        warn_user(f"the velocity that was set moves the road by {cells:.3g} cells in a step; the"
                  " contact is well followed up to one cell per step:"
                  f" dt = {(row.time - before.time) / cells:.3g} s")

    def _last(self) -> Row:
        """Return the last row, as the library has it."""
        values = np.zeros(len(columns()))
        _row(self._handle, values)
        return Row(values)

    @property
    def row(self) -> Row | None:
        """The last row; None before the first one."""
        return self._last() if self._started else None

    def __iter__(self) -> Iterator[Row]:
        """Compute the remaining rows one after another."""
        while not self.finished:
            yield self.advance()

    # --- steering ---------------------------------------------------------------------------

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a quantity that can be set: others would be ignored silently."""
        known = hasattr(type(self), name) or any(
            name in vars(kind).get("__annotations__", {}) for kind in type(self).__mro__)
        held = getattr(getattr(type(self), name, None), "fset", self) is None
        if held or not (known or name.startswith("_")):
            raise AttributeError(unknown_name("quantity that can be set", name,
                                              (*_LOADS, "velocity", "temperature")))
        super().__setattr__(name, value)

    def _set(self, what: str, first: float, second: float = 0.0) -> None:
        """Change a value for the next rows, and record it for a saved state."""
        pair = [number(what, first), number(what, second)]
        _steer(self._handle, what, *pair)
        if what in _LOADS:
            for other in _LOADS:
                self._steered.pop(other, None)
        self._steered[what] = pair

    @property
    def pressure(self) -> float:
        """Mean normal pressure of the last row, Pa. Setting it applies to all later rows."""
        return self._last().pressure

    @pressure.setter
    def pressure(self, value: float) -> None:
        self._set("pressure", value)

    @property
    def force(self) -> float:
        """Normal force of the last row, N. Setting it applies to all later rows."""
        return self._last().force

    @force.setter
    def force(self, value: float) -> None:
        self._set("force", value)

    @property
    def displacement(self) -> float:
        """Approach in the last row, m. Setting it applies to all later rows."""
        return self._last().displacement

    @displacement.setter
    def displacement(self, value: float) -> None:
        self._set("displacement", value)

    @property
    def velocity(self) -> tuple[float, float] | None:
        """Velocity of the road along x and y that was set, m/s; None if the phases decide."""
        found = self._steered.get("velocity")
        return None if found is None else (found[0], found[1])

    @velocity.setter
    def velocity(self, value: tuple[float, float]) -> None:
        try:
            along_x, along_y = (number("velocity", one) for one in value)
        except (TypeError, ValueError):
            raise ValueError(f"velocity = {value!r}: must be two finite numbers, along x and y,"
                             " in m/s") from None
        self._watches_speed = True
        self._set("velocity", along_x, along_y)

    @property
    def temperature(self) -> float | None:
        """Temperature that was set, C; None if that of the case applies."""
        found = self._steered.get("temperature")
        return None if found is None else found[0]

    @temperature.setter
    def temperature(self, value: float) -> None:
        self._set("temperature", value)

    # --- saved states -----------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the state to an HDF5 file, from which `resume` continues with the same numbers.

        The file also contains the input, the road and the values that were set. An older state is
        replaced when the new one is complete; any other file is refused.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            If no row has been computed yet, the last row has not converged, or the file exists and
            is no saved state.
        OSError
            If the file cannot be written.
        """
        if not self._started:
            raise ValueError("there is no state to save before the first row: call advance()")
        if self._failed:
            raise ValueError("the last row has not converged, and its state cannot be continued: "
                             "save a simulation before the row that fails")
        path = Path(path)
        check_output(path, STATE)
        with tempfile.TemporaryDirectory(prefix="asperity-") as folder:
            _save(self._handle, os.fsencode(Path(folder) / "state.h5"))
            state = np.fromfile(Path(folder) / "state.checkpoint.h5", dtype=np.uint8)
        with new_file(path) as new, h5py.File(new, "w") as file:
            file.attrs["kind"] = "state of an asperity.Simulation"
            file.attrs["version"] = library.version()
            file.attrs["input"] = self._text
            file.attrs["input_path"] = str(Path(self._path).absolute())
            file.attrs["steered"] = json.dumps(self._steered)
            file["state"] = state
        return path

    @classmethod
    def resume(cls, path: str | os.PathLike[str], *, threads: int | None = None) -> Simulation:
        """Return a simulation that continues from a saved state.

        Parameters
        ----------
        path : str or Path
            A file that `save` has written.
        threads : int, optional
            Number of threads; by default that of the case.

        Returns
        -------
        Simulation

        Raises
        ------
        OSError
            If the file is missing, damaged or not a saved state, or if a height map is missing.
        ValueError
            If a height map has changed.
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
            # The values that were set change the phases, so they come before the state, which
            # contains the position within the phases.
            for what, (first, second) in steered.items():
                self._set(what, first, second)
            try:
                (finished,) = _load(self._handle, os.fsencode(Path(folder) / "state.h5"))
            except (OSError, ValueError) as error:
                message = str(error).replace(str(Path(folder) / "state.checkpoint.h5"), str(path))
                raise type(error)(message) from None
        self._started, self._finished = True, bool(finished)
        return self

    @classmethod
    def _of_text(cls, text: str, source: str, threads: int | None) -> Simulation:
        """Return a new simulation of a text, whose paths are relative to the folder of a file."""
        return cls(_Input(text, Path(source)), threads=threads)

    def close(self) -> None:
        """Free the memory. Later calls raise ValueError, because the simulation is closed."""
        self._finished = True
        self._release()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        """Refuse to copy or pickle: the state is in the library, and both would advance it."""
        raise TypeError("a simulation cannot be copied or pickled: write it with save(path), and "
                        "continue as often as you like with asperity.Simulation.resume(path)")

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
    """An input with its text and the name of its file."""

    def __init__(self, text: str, path: Path) -> None:
        self._text, self.path = text, path

    def __str__(self) -> str:
        return self._text


def warn_of(notes: bytes) -> None:
    """Issue the warnings of the library, one per line."""
    for line in notes.decode(errors="replace").strip().splitlines():
        warn_user(line)
