"""The result of a run: its file, its snapshots, and calls that draw or export it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from ..base.notices import warn_user
from ..base.presenters import present
from .derived import headline_columns
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
    path : str or Path
        The file, RESULT.h5.

    Attributes
    ----------
    path : Path
        The file.
    title, program, version, created : str
        Title of the case; name and version of the program; time of creation.
    input : str
        The text of the input file.
    finished : bool
        Whether the run is complete.
    grid : Grid
        The grid of cells.
    material : Material
        The properties of the material.
    attributes : OpenValues
        All attributes of the file.
    history : History
        Columns with one value per row: ``run.history["friction"]``.
    losses : dict[int, Losses]
        Losses of each row of steady sliding, by the number of the row.
    snapshots : Snapshots
        The stored fields: ``run.snapshots[-1].pressure``.

    Raises
    ------
    OSError
        If the file is missing, cannot be read, or is not a result.
    """

    snapshots: Snapshots

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path)
        self.snapshots = Snapshots(self, self._snapshot_keys)

    def refresh(self) -> Run:
        """Read the file again, for what a run has written since.

        Returns
        -------
        Run
            The same object.

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
        """The state of the run in words: 'finished', or 'not finished' with more information.

        If the run has ended, the text says why. Otherwise it gives the time since the file was last
        written, and says if the run seems to have been killed.
        """
        return standing(self)

    def steady(self, column: str = "friction") -> SteadyMean:
        """Return the mean of a column over the last complete laps of the road, with its error.

        Parameters
        ----------
        column : str
            Name of a column of the history.

        Returns
        -------
        SteadyMean
            `mean`, `error` (standard error, NaN for fewer than two laps) and `laps`.

        Raises
        ------
        KeyError
            If there is no such column.
        ValueError
            If the history has no rows.

        Warns
        -----
        UserWarning
            If the run slides for less than two laps. The mean over a part of a lap depends on which
            part it is.
        """
        found = steady_mean(self, column)
        if found.note:
            warn_user(f"{self.path}: {column}: {found.note}")
        return found

    @overload
    def plot(self) -> Figure: ...

    @overload
    def plot(self, name: str, x: str | None = None, ax: Axes | None = None,
             **style: Any) -> Axes: ...

    def plot(self, name: str | None = None, x: str | None = None, ax: Axes | None = None,
             **style: Any) -> Axes | Figure:
        """Draw a column of the history, or without a name an overview of the run.

        In a run with friction, 'friction' is drawn with its parts, 'contact_area' with the stick
        area, and 'sliding_speed' with the speed of the road. 'energy' draws the energy balance,
        and 'force' the normal force on the whole grid.

        Parameters
        ----------
        name : str, optional
            Column to draw, 'energy' or 'force'; by default the overview.
        x : str, optional
            Column along the horizontal axis, or 'force'. The default is time or, if no time passes,
            the load or the step.
        ax : matplotlib.axes.Axes, optional
            Axes to draw into; by default a new figure that fits one column of a journal.
        **style
            Options of `matplotlib.axes.Axes.plot` for the line of the column.

        Returns
        -------
        matplotlib.axes.Axes or matplotlib.figure.Figure
            The axes of a column; the figure of the overview.

        Raises
        ------
        KeyError
            If there is no such column.
        ValueError
            If `x`, `ax` or a style is given without a name.
        """
        if name is None:
            if x is not None or ax is not None or style:
                raise ValueError("plot: x, ax and style need the name of a column, such as"
                                 " 'friction'")
            return present("plot_overview", self)
        return present("plot_history", self, name, x, ax, **style)

    def overview(self) -> Figure:
        """Draw the most informative quantities of the run, as `plot` does without a name.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return present("plot_overview", self)

    def report(self, path: str | os.PathLike[str] | None = None) -> Path:
        """Write a page about the run, one HTML file for any browser.

        Parameters
        ----------
        path : str or Path, optional
            The file to write; by default RESULT.html beside the result.

        Returns
        -------
        Path
            The file.

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
            The columns of the history have the dimension `step`, the fields the dimensions
            (snapshot, y, x); see `asperity.export.run_to_xarray`.

        Raises
        ------
        ImportError
            If xarray is not installed.
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
            lines.append("  last row: " + ", ".join(
                f"{name} {values[-1]:.6g}{'' if units == '1' else ' ' + units}"
                for name, values, units in headline_columns(self)))
        return "\n".join(lines)


def open_result(path: str | os.PathLike[str]) -> Run:
    """Open the result of a run, which may be complete or still running.

    Parameters
    ----------
    path : str or Path
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
