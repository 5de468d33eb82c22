"""Small HTML tables with which notebooks display results, cases and fits."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.names import counted
from ..results.derived import headline_columns
from ..results.standing import note_of, rows_of
from .style import si_scale, typeset

if TYPE_CHECKING:
    from ..results import History, Run, Snapshot

__all__ = ["case_html", "contact_html", "fit_html", "history_html", "road_html", "run_html",
           "snapshot_html", "table_html"]

CELL = "text-align:left;padding:0.1em 0.8em 0.1em 0"
NUMBER = f"{CELL};white-space:nowrap"
POINTS = 120  # largest number of points of a small curve


def table_html(head: tuple[str, ...], rows: Sequence[tuple[str, ...]], caption: str) -> str:
    """Return a table, whose cells are already HTML."""
    top = "".join(f'<th style="{CELL}">{name}</th>' for name in head)
    # Only the last column has texts that may be wrapped.
    lines = "".join("<tr>" + "".join(f'<td style="{NUMBER}">{cell}</td>' for cell in row[:-1])
                    + "".join(f'<td style="{CELL}">{cell}</td>' for cell in row[-1:]) + "</tr>"
                    for row in rows)
    first = f"<thead><tr>{top}</tr></thead>" if head else ""
    return (f'<div style="overflow-x:auto"><div>{caption}</div>'
            f"<table>{first}<tbody>{lines}</tbody></table></div>")


def shown(value: Any, units: str) -> str:
    """Return a value with its prefixed unit."""
    number = float(value)
    factor, unit = si_scale(number, units)
    return escape(f"{number * factor:.4g}{' ' + typeset(unit) if unit else ''}")


def curve(values: NDArray[Any]) -> str:
    """Return a small curve of values over their index as SVG, or '' for fewer than two values.

    Examples
    --------
    >>> curve(np.array([0.0, 1.0])).count("<polyline")
    1
    >>> curve(np.array([1.0]))
    ''
    >>> "1.0,8.0 50.0,8.0 99.0,8.0" in curve(np.array([5.0, 5.0 + 1e-12, 5.0]))
    True
    """
    values = np.asarray(values, dtype=float)
    if len(values) > POINTS:
        values = values[np.linspace(0, len(values) - 1, POINTS).round().astype(int)]
    good = np.isfinite(values)
    if good.sum() < 2:
        return ""
    low, high = float(values[good].min()), float(values[good].max())
    varies = high - low > 1e-6 * max(abs(low), abs(high))  # beyond round-off
    x = np.linspace(1, 99, len(values))[good]
    y = 15.0 - 14.0 * (values[good] - low) / (high - low) if varies else np.full(good.sum(), 8.0)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return ('<svg width="100" height="16" viewBox="0 0 100 16" aria-hidden="true">'
            f'<polyline points="{points}" fill="none" stroke="#0072B2" stroke-width="1.2"/></svg>')


def history_html(history: History) -> str:
    """Return the history as a table of its columns."""
    rows = []
    for name in history:
        column, units = history[name], history.units(name)
        numbers = (("", "", "") if not history.rows else
                   tuple(shown(value, units) for value in (column[-1], column.min(),
                                                           column.max())))
        rows.append((f"<code>{escape(name)}</code>", *numbers, curve(column),
                     escape(history.long_name(name))))
    return table_html(("column", "last", "smallest", "largest", "", "meaning"), rows,
                      f"<b>History</b> of {counted(history.rows, 'row')}")


def snapshot_html(snapshot: Snapshot) -> str:
    """Return the snapshot as a table of its fields."""
    grid = snapshot.run.grid
    rows = [(f"<code>{escape(name)}</code>",
             "" if snapshot.units(name) == "1" else escape(typeset(snapshot.units(name))),
             escape(snapshot.long_name(name))) for name in snapshot.fields]
    return table_html(("field", "unit", "meaning"), rows,
                      f"<b>Snapshot</b> of step {snapshot.step}, t = {shown(snapshot.time, 's')},"
                      f" phase {snapshot.phase}; fields of shape ({grid.ny}, {grid.nx})")


def run_html(run: Run) -> str:
    """Return the run as a table: state, grid, snapshots and the last row."""
    grid, history = run.grid, run.history
    steps = run.snapshots.steps
    listed = ", ".join(map(str, steps if len(steps) <= 12 else (*steps[:5], "…", *steps[-3:])))
    state = "finished" if run.finished else "not finished"
    rows = [("state", f"{state}, {rows_of(run)}"),
            ("grid", f"{grid.nx} × {grid.ny} cells, {shown(grid.lx, 'm')} ×"
                     f" {shown(grid.ly, 'm')}, {escape(grid.boundary)}"),
            ("snapshots", f"{len(steps)}{f' (steps {listed})' if steps else ''}")]
    if note_of(run):
        rows.insert(1, ("", escape(note_of(run))))
    rows += [(escape(name.replace("_", " ")), f"{shown(values[-1], units)} {curve(values)}")
             for name, values, units in headline_columns(run) if history.rows]
    if run.warnings:
        rows.append(("warnings", "<br>".join(escape(typeset(line)) for line in run.warnings)))
    return table_html((), rows, f"<b>{escape(run.title or 'untitled run')}</b>"
                                f" <code>{escape(str(run.path))}</code>")


_CONTACT = {"mean_pressure": "Pa", "force": "N", "displacement": "m", "contact_area": "1",
            "iterations": "1", "ffts": "1", "residual": "1", "energy_adhesive": "J"}


def contact_html(contact: Any) -> str:
    """Return a solved contact as a table of its numbers."""
    rows = [(f"<code>{name}</code>", shown(getattr(contact, name), units))
            for name, units in _CONTACT.items() if hasattr(contact, name)]
    ny, nx = (1, *contact.pressure.shape)[-2:]
    rows.append(("largest pressure", shown(contact.pressure.max(), "Pa")))
    state = "converged" if contact.converged else f"not converged: {contact.reason}"
    return table_html((), rows, f"<b>Contact</b> of {nx} × {ny} cells, {escape(state)}")


def road_html(road: Any) -> str:
    """Return a measured road as a table of its properties and processing steps."""
    lines = [line.partition("  ") for line in road.summary().splitlines()]
    rows = [(escape(name), escape(typeset(rest.strip()))) for name, _, rest in lines]
    return table_html((), rows, "<b>Road</b>")


def fit_html(fit: Any) -> str:
    """Return a fit of a Prony series as its errors and a table of its arms."""
    material = fit.material
    rows = [(str(number), shown(g, "Pa"), escape(f"{tau:.4g} s"))
            for number, (g, tau) in enumerate(zip(material.g, material.tau, strict=True), 1)]
    summary = "<br>".join(escape(typeset(line)) for line in fit.summary().splitlines())
    return table_html(("arm", "modulus", "relaxation time"), rows, f"<b>Fit</b><br>{summary}")


def case_html(case: Any) -> str:
    """Return a case as a table of the variables that are given."""
    rows = []
    for name in case._groups:
        found = case[name]
        groups = list(found) if not hasattr(found, "items") else [found]
        for number, group in enumerate(groups, 1):
            head = f"&{name}" if len(groups) == 1 else f"&{name} {number}"
            given = ", ".join(f"{variable} = {value!r}" for variable, value in group.items())
            if given:
                rows.append((f"<code>{escape(head)}</code>", f"<code>{escape(given)}</code>"))
    where = f" <code>{escape(str(case.path))}</code>" if case.path else ""
    return table_html((), rows, f"<b>Case</b>{where}")
