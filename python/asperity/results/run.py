"""The result of a run: its file, its snapshots, and how it shows itself."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from ..base.presenters import present
from .result_file import ResultFile
from .snapshot import Snapshots
from .standing import note_of, rows_of, standing
from .steady import SteadyMean, steady_mean

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Run", "open_result"]


class Run(ResultFile):
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
    material : Material
        The properties of the material.
    attributes : OpenValues
        All attributes of the file.
    history : History
        One value a row: ``run.history["friction"]``.
    losses : dict[int, Losses]
        Where each row of steady sliding loses its energy, by the row's number.
    snapshots : Snapshots
        The stored fields: ``run.snapshots[-1].pressure``.
    """

    snapshots: Snapshots

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path)
        self.snapshots = Snapshots(self, self._snapshot_keys)

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
        self._read()
        self.snapshots = Snapshots(self, self._snapshot_keys)
        return self

    @property
    def state(self) -> str:
        """How the run stands, in words.

        'finished', or 'not finished' with why it ended, or else with the time since the file was
        last written: where that is much longer than a row takes, the run was perhaps killed.
        """
        return standing(self)

    def steady(self, column: str = "friction") -> SteadyMean:
        """Return the mean of a column over whole laps at the end of the slide, with its error.

        A mean over part of a lap depends on which part it is: a warning tells.

        Parameters
        ----------
        column : str
            Name of a column of the history.

        Returns
        -------
        SteadyMean
            `mean`, `error` (standard error, NaN of fewer than two laps) and `laps`.

        Raises
        ------
        KeyError
            If there is no such column.
        ValueError
            If the history has no rows.
        """
        found = steady_mean(self, column)
        if found.note:
            warnings.warn(f"{self.path}: {column}: {found.note}", UserWarning, stacklevel=2)
        return found

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
        if name is None:
            if x is not None or ax is not None or style:
                raise ValueError("plot: x, ax and style need the name of a column, such as"
                                 " 'friction'")
            return present("plot_overview", self)
        return present("plot_history", self, name, x, ax, **style)

    def overview(self) -> Figure:
        """Draw what tells most of the run, as `plot` does without a name.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return present("plot_overview", self)

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
        return present("write_report", self, path)

    def to_xarray(self) -> xarray.Dataset:
        """Return the history and all snapshots as one data set of xarray, which must be installed.

        Returns
        -------
        xarray.Dataset
            The columns of the history along `step`; the fields with the dimensions
            (snapshot, y, x); see `asperity.export.run_to_xarray`.
        """
        return present("run_to_xarray", self)

    def _repr_html_(self) -> str:
        return present("run_html", self)

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
