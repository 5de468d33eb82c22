"""The charts of the HTML page of a run, and the columns that they show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..results.derived import closure, column_of, energy_terms, load_name, road_speed
from ..results.road_slopes import friction_outside
from ..results.settings import has_adhesion, has_friction, solver_setting
from ..results.steady import steady_speeds
from .style import LABELS

if TYPE_CHECKING:
    from ..results import Run

__all__ = ["LOADS", "MOST_SNAPSHOTS", "charts_of"]

FloatArray = NDArray[np.float64]

MOST_SNAPSHOTS = 40
LOADS = {"force": "Normal force", "pressure": "Mean pressure"}


def charts_of(run: Run) -> tuple[dict[str, FloatArray], list[dict[str, Any]]]:
    """Return the columns that the charts need, including derived ones, and the charts.

    Parameters
    ----------
    run : Run
        The result.

    Returns
    -------
    dict of ndarray, list of dict
        Columns by name, shape (rows,), in SI units; each chart with the names of its columns.
    """
    charts = _Charts(run)
    if run.history.rows >= 2:  # a single row appears in the tables only
        charts.add_friction()
        charts.add_contact()
        charts.add_energy()
        charts.add_convergence()
    return charts.columns, charts.charts


class _Charts:
    """Collects the charts of a run and their columns."""

    def __init__(self, run: Run) -> None:
        self.run = run
        self.history = history = run.history
        self.rubbing = has_friction(run)
        self.charts: list[dict[str, Any]] = []
        self.columns: dict[str, FloatArray] = {name: np.asarray(history[name]) for name in (
            "step", "phase", "time", "pressure", "displacement", "contact_area", "friction")
            if name in history}
        self.load = load_name(run)
        self.columns.pop("pressure", None)
        self.columns[self.load], self.units_of_load = column_of(run, self.load)
        self.speeds = steady_speeds(run)
        if self.speeds is not None:  # the road has no travel in steady states
            self.columns["speed"] = self.speeds
        elif history.rows >= 2 and "road_x" in history and "road_y" in history:
            moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
            self.columns["travel"] = np.concatenate([[0.0], np.cumsum(moved)])

    def series(self, name: str, label: str, colour: int, dash: str = "",
               values: NDArray[Any] | None = None) -> list[dict[str, Any]]:
        """Return a list with the line of a column or of given values; it may be empty."""
        if values is None and name not in self.history:
            return []
        self.columns[name] = np.asarray(self.history[name] if values is None else values)
        return [{"column": name, "label": label, "colour": colour, "dash": dash}]

    def chart(self, section: str, key: str, title: str, label: str, unit: str,
              lines: list[dict[str, Any]], **more: Any) -> None:
        """Add a chart if it has lines."""
        if lines:
            self.charts.append({"section": section, "id": key, "title": title, "label": label,
                                "unit": unit, "series": lines, **more})

    def add_friction(self) -> None:
        """Add friction and its parts."""
        history = self.history
        if "friction" not in history or not (self.rubbing or np.any(history["friction"])):
            return
        lines = self.series("friction", "whole" if self.rubbing else "friction", 0)
        if self.rubbing and "friction_viscous" in history:
            lines += self.series("friction_viscous", "pressure on slopes", 1, "6 3")
            lines += self.series("friction_interface", "interface", 2, "8 3 2 3",
                                 history["friction"] - history["friction_viscous"])
        if has_adhesion(self.run) and len(self.run.snapshots) <= MOST_SNAPSHOTS:
            at, outside = friction_outside(self.run)
            values = np.full(history.rows, np.nan)
            values[at] = outside
            lines += [{**line, "marks": True} for line in self.series(
                "friction_outside", "attraction outside contact", 3, "", values)]
        self.chart("time", "friction", "Friction", LABELS["friction"], "1", lines)

    def add_contact(self) -> None:
        """Add contact area, sliding speed, pressure and approach."""
        lines = self.series("contact_area", "in contact", 0)
        if self.rubbing:
            lines += self.series("stick_area", "sticking", 4, "6 3")
        self.chart("time", "contact_area", "Contact area", "Fraction of the grid", "1", lines)
        if self.rubbing and self.speeds is None:
            lines = self.series("sliding_speed", "mean of the interface", 0)
            if "road_x" in self.history:
                lines += self.series("road_speed", "road against the block's top", 6, "2 3",
                                     road_speed(self.run))
            self.chart("time", "sliding_speed", "Sliding speed", "Speed", "m/s", lines)
        self.add_load()
        self.chart("time", "displacement", "Approach and mean gap", "Length", "m",
                   [*self.series("displacement", "approach", 0),
                    *self.series("mean_gap", "mean gap", 1, "6 3")])

    def add_load(self) -> None:
        """Add a load that varies."""
        name, load = self.load, self.columns[self.load]
        if len(load) and np.ptp(load) > 1e-6 * np.abs(load).max():
            words = LOADS[name]
            self.chart("time", name, words, words.split()[-1].capitalize(), self.units_of_load,
                       self.series(name, words[:1].lower() + words[1:], 0, values=load))

    def add_energy(self) -> None:
        """Add work, energies stored and lost, and the error of the balance."""
        terms = energy_terms(self.run)
        names = {"work": ("work put in", 6, ""), "stored": ("stored", 0, ""),
                 "viscous": ("lost in the rubber", 1, "6 3"),
                 "friction": ("lost by friction", 2, "8 3 2 3")}
        lines = []
        for name, values in terms.items():
            if name in ("work", "stored") or np.any(values):
                label, colour, dash = names[name]
                lines += self.series(f"energy_{name}", label, colour, dash, values)
        self.chart("energy", "energy", "Work, stored and lost", "Energy", "J", lines)
        missing = closure(self.run)
        if missing is not None and np.any(missing > 0.0):
            self.chart("energy", "closure", "Error of the energy balance",
                       "Over the largest energy", "1",
                       self.series("closure", "work minus stored minus lost", 0, "", missing),
                       log=True)

    def add_convergence(self) -> None:
        """Add iterations, residuals and the time of the solvers."""
        history = self.history
        lines = self.series("iterations_normal", "normal", 0)
        if "iterations_tangential" in history and np.any(history["iterations_tangential"]):
            lines += self.series("iterations_tangential", "tangential", 1, "6 3")
        self.chart("convergence", "iterations", "Iterations", "Iterations a row", "1", lines,
                   zero=True)
        lines = self.series("residual_normal", "normal", 0)
        if "residual_tangential" in history and np.any(history["residual_tangential"]):
            lines += self.series("residual_tangential", "tangential", 1, "6 3")
        if "residual_coupling" in history and np.any(history["residual_coupling"]):
            lines += self.series("residual_coupling", "coupling", 2, "2 3")
        tolerance = solver_setting(self.run, "tolerance")
        self.chart("convergence", "residuals", "Residuals, recomputed", "Residual", "1", lines,
                   log=True, levels=[] if tolerance is None else
                   [{"value": tolerance, "label": "tolerance"}])
        self.chart("convergence", "seconds", "Time of the solvers", "Wall time a row", "s",
                   self.series("seconds", "wall time", 0), zero=True)
