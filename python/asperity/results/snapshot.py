"""The stored fields of a run, which are read from its file on access."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import h5py
from numpy.typing import NDArray

from ..base.names import NamedFields, UnknownNameError, counted, unknown_name
from ..base.presenters import present
from .field_types import NORMAL_FIELDS, TANGENTIAL_FIELDS
from .reading import read_file, scalar_of, text_of
from .result_file import ResultFile

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

__all__ = ["Snapshot", "Snapshots"]


class Snapshot(NamedFields):
    """The fields of one row of the history, which are read from the file on access.

    ``snapshot.pressure`` and ``snapshot["pressure"]`` are the same array of shape (ny, nx).

    Attributes
    ----------
    step : int
        Number of the row of the history.
    time : float
        Time, s.
    phase : int
        Number of the phase, from 1.
    fields : tuple of str
        Names of the stored fields.
    """

    def __init__(self, run: ResultFile, key: str) -> None:
        def read(file: h5py.File) -> tuple[int, float, int, dict[str, tuple[str, str]]]:
            group = file["snapshots"][key]
            meanings = {
                name: (text_of(dataset.attrs.get("units", "1")),
                       text_of(dataset.attrs.get("long_name", name.replace("_", " "))))
                for name, dataset in group.items()
                if isinstance(dataset, h5py.Dataset) and not dataset.is_scale
            }
            step, when, phase = (scalar_of(group.attrs[name]) for name in ("step", "time", "phase"))
            return int(step), float(when), int(phase), meanings

        self._run = run
        self._key = key
        self.step, self.time, self.phase, self._meanings = read_file(run.path, read)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the stored fields."""
        return tuple(self._meanings)

    @property
    def run(self) -> ResultFile:
        """The result that contains the snapshot."""
        return self._run

    def __getitem__(self, name: str) -> NDArray[Any]:
        self._check(name)
        return read_file(self._run.path, lambda file: file["snapshots"][self._key][name][()])

    def _check(self, name: str) -> None:
        """Raise `UnknownNameError` with advice if there is no such field."""
        if name in self._meanings:
            return
        text = unknown_name("field of the snapshot", name, self._meanings)
        if name in TANGENTIAL_FIELDS:
            text = (f"the snapshot holds no {name}: there are {', '.join(self._meanings)};"
                    " tangential fields are stored with `&friction`, unless `&output"
                    " snapshot_fields` leaves them out")
        elif name in NORMAL_FIELDS:
            text = (f"the snapshot holds no {name}: there are {', '.join(self._meanings)};"
                    " `&output snapshot_fields` chooses what is stored")
        raise UnknownNameError(text)

    def __contains__(self, name: object) -> bool:
        return name in self._meanings

    def __iter__(self) -> Iterator[str]:
        return iter(self._meanings)

    def units(self, name: str) -> str:
        """Return the units of a field.

        Parameters
        ----------
        name : str
            Name of the field.

        Returns
        -------
        str
            The units, such as 'Pa', or '1' for a pure number.

        Raises
        ------
        KeyError
            If there is no such field.
        """
        self._check(name)
        return self._meanings[name][0]

    def long_name(self, name: str) -> str:
        """Return the meaning of a field.

        Parameters
        ----------
        name : str
            Name of the field.

        Returns
        -------
        str
            The meaning in words.

        Raises
        ------
        KeyError
            If there is no such field.
        """
        self._check(name)
        return self._meanings[name][1]

    def plot(self, name: str = "pressure", ax: Axes | None = None,
             arrows: bool | None = None) -> Axes:
        """Draw a field: a map, or a profile if ny is 1.

        Parameters
        ----------
        name : str
            Name of the field. 'contact' shows which cells are open, stick or slip.
        ax : matplotlib.axes.Axes, optional
            Axes to draw into; by default a new figure that fits one column of a journal.
        arrows : bool, optional
            Whether to draw the tractions as arrows; by default only on 'contact'.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        KeyError
            If the snapshot has no such field. The message suggests the nearest name.
        """
        return present("plot_field", self, name, ax, arrows)

    def to_xarray(self) -> xarray.Dataset:
        """Return the fields as a data set of xarray, which must be installed.

        Returns
        -------
        xarray.Dataset
            The dimensions are (y, x), with coordinates in m. Units and meanings are attributes.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        return present("to_xarray", self)

    def to_vtk(self, path: str | os.PathLike[str]) -> Path:
        """Write the fields as VTK image data, which ParaView opens.

        Parameters
        ----------
        path : str or Path
            The file, NAME.vti.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        return present("to_vtk", self, path)

    def _repr_html_(self) -> str:
        return present("snapshot_html", self)

    def __repr__(self) -> str:
        return (f"snapshot of step {self.step}, t = {self.time:g} s, phase {self.phase}:"
                f" {', '.join(self.fields)}")


class Snapshots(Sequence[Snapshot]):
    """The stored snapshots in the order of their rows; the last one is ``snapshots[-1]``."""

    def __init__(self, run: ResultFile, keys: list[str]) -> None:
        self._run = run
        self._keys = keys

    @property
    def steps(self) -> tuple[int, ...]:
        """Numbers of the rows of the snapshots."""
        return tuple(int(key) for key in self._keys)

    def at_step(self, step: int) -> Snapshot:
        """Return the snapshot of a row.

        Parameters
        ----------
        step : int
            Number of a row that has a snapshot, one of `steps`.

        Returns
        -------
        Snapshot

        Raises
        ------
        KeyError
            If there is none. The message lists the rows that have snapshots.
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
        return f"{counted(len(self), 'snapshot')} (steps {steps})"
