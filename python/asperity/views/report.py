"""The HTML page about a run: one file for any browser, which loads nothing else.

``asperity report`` and `Run.report` call `write_report`.
"""

from __future__ import annotations

import os
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.durations import short_time
from ..base.files import WEB_PAGE, check_output, write_text
from ..base.library import version
from ..base.names import counted
from ..results.derived import column_of, load_name
from ..results.settings import has_friction, solver_setting
from ..results.standing import held, how_to_continue, rows_of, seems_dead, silence, time_of_row
from ..results.steady import steady_mean, steady_rows
from .page_parts import PAGE, colour_scales, fill_page, page_file, page_json
from .report_charts import LOADS
from .report_data import faulty, now, page_data
from .report_sections import number_html, sections_of
from .style import sentence, typeset

if TYPE_CHECKING:
    from ..results import Run

__all__ = ["PAGE", "SCRIPTS", "report_page", "write_report"]

SCRIPTS = ("save.js", "theme.js", "chart.js", "map.js", "page.js")


def write_report(run: Run, path: str | os.PathLike[str] | None = None) -> Path:
    """Write the page of a run.

    Parameters
    ----------
    run : Run
        The result, which may be unfinished.
    path : str or Path, optional
        The file to write; by default RESULT.html beside the result.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If the result cannot be read or the page cannot be written.
    ValueError
        If the name does not end in .html, or the file exists and is no page of Asperity.
    """
    target = run.path.with_suffix(".html") if path is None else Path(path)
    if target.suffix.lower() in (".h5", ".hdf5"):
        raise ValueError(f"{target}: the page would overwrite a result: name a file .html")
    if target.suffix.lower() not in (".html", ".htm") and not target.is_dir():
        raise ValueError(f"{target}: the name of a page must end in .html")
    check_output(target, WEB_PAGE)
    text = report_page(run)
    write_text(target, text)
    return target


def report_page(run: Run) -> str:
    """Return the page of a run as text.

    Parameters
    ----------
    run : Run
        The result, which may be unfinished.

    Returns
    -------
    str
        The HTML text.
    """
    data = page_data(run)
    data["colours"] = colour_scales()
    sections = sections_of(run, data)
    title = run.title or run.path.name
    parts = {
        "version": escape(version()),
        "title": escape(title),
        "subtitle": _subtitle(run),
        "style": page_file("report.css"),
        "links": "\n".join(f'<a href="#{key}">{head}</a>' for key, head, _ in sections),
        "notes": _notes(run),
        "tiles": _tiles(run),
        "sections": "\n".join(f'<section id="{key}">\n<h2>{head}</h2>\n{body}\n</section>'
                              for key, head, body in sections),
        "footer": f"Page made by asperity {escape(version())} at {now()} from"
                  f" <code>{escape(run.path.name)}</code>.",
        "data": page_json(data),
        "script": "\n".join(page_file(name) for name in SCRIPTS),
    }
    return fill_page(parts)


def _subtitle(run: Run) -> str:
    """Return the line under the title."""
    grid = run.grid
    size = (f"{grid.nx} cells over {number_html(grid.lx, 'm')}, line contact" if grid.ny == 1 else
            f"{grid.nx} × {grid.ny} cells over {number_html(grid.lx, 'm')} ×"
            f" {number_html(grid.ly, 'm')}")
    rows = run.history.rows
    state = "finished" if run.finished else "not finished"
    return (f"{size}, {escape(grid.boundary)}; {state}, {rows} row{'' if rows == 1 else 's'};"
            f" made by {escape(run.program)} {escape(run.version)}, {escape(run.created)}")


def _notes(run: Run) -> str:
    """Return the notes: state of an unfinished run, and all warnings."""
    parts = []
    rows = run.history.rows
    if not run.finished:
        parts.append(f"<p><strong>This run is not finished.</strong> {escape(rows_of(run))} were"
                     f" written when this page was made. {_unfinished(run)}</p>")
    notes = run.warnings + faulty(run)
    tolerance = solver_setting(run, "tolerance")
    if tolerance is not None:
        for name in ("normal", "tangential"):
            column = f"residual_{name}"
            if column in run.history and rows:
                above = int(np.sum(run.history[column] > tolerance * (1.0 + 1e-9)))
                if above:
                    notes.append(f"the {name} residual of {above} of {rows} rows is above the"
                                f" tolerance of {tolerance:g}; the largest is"
                                f" {np.nanmax(run.history[column]):.3g}")
    if not len(run.snapshots):
        notes.append("the result holds no snapshots: there are no maps")
    if notes:
        lines = "".join(f"<li>{escape(typeset(line))}</li>" for line in notes)
        parts.append(f"<p><strong>Warnings</strong></p><ul>{lines}</ul>")
    return "\n".join(f'<div class="note">{part}</div>' for part in parts)


def _unfinished(run: Run) -> str:
    """Return why a run is not finished, if the file contains that, and what to do."""
    again = f"<code>asperity run CASE.nml</code>: {how_to_continue(run)}."
    if run.outcome != "running":
        return f"Outcome: {escape(run.outcome)}; {again}"
    quiet = silence(run)
    last = "" if quiet is None else f"The file was last written {short_time(quiet)} before"
    if held(run) is False:
        return f"Its process has ended before the run did: {again}"
    if seems_dead(run):
        return (f"{last}, and a row takes up to {short_time(time_of_row(run) or 0.0)}: the run"
                f" was perhaps killed. If so, {again}")
    return (f"{last}{'. ' if last else ''}Write the page again to update it. If the run was killed,"
            f" {again}")


def _tiles(run: Run) -> str:
    """Return the values of the last row."""
    history = run.history
    if not history.rows:
        return '<p class="note">The history has no rows yet.</p>'
    names = [("time", "Time")] if np.any(history["time"]) else []
    names.append((load_name(run), LOADS[load_name(run)]))
    names += [("displacement", "Approach"), ("contact_area", "Contact area"),
              ("mean_gap", "Mean gap")]
    moving = "friction" in history and np.any(history["friction"])
    if moving:
        names.append(("friction", "Friction"))
        if "friction_viscous" in history and has_friction(run):
            names.append(("friction_viscous", "of it by pressure on slopes"))
    if has_friction(run):
        names += [("stick_area", "Stick area"), ("sliding_speed", "Sliding speed")]
    elif steady_rows(run)[-1]:
        names.append(("sliding_speed", "Sliding speed"))
    tiles = "\n".join(f"<div><dt>{label}</dt><dd>{_last(run, name)}</dd></div>"
                      for name, label in names if name in history or name == "force")
    step = f", step {history['step'][-1]}" if "step" in history else ""
    return (f'<p class="soft">The last row{step}:</p>\n<dl class="tiles">\n{tiles}\n</dl>'
            + (_mean_friction(run) if moving and history.rows > 1 else ""))


def _last(run: Run, name: str) -> str:
    """Return the last value of a column with its unit.

    Round-off is zero. That of the gap in full contact is small beside the approach.
    """
    values, units = column_of(run, name)
    size = float(np.abs(values).max())
    if name == "mean_gap" and "displacement" in run.history:
        size = max(size, float(np.abs(run.history["displacement"]).max()))
    last = float(values[-1])
    return number_html(last if abs(last) >= 1e-9 * size else 0.0, units)


def _mean_friction(run: Run) -> str:
    """Return the mean friction over complete laps, or a remark if there is none."""
    found = steady_mean(run, "friction")
    if not found.laps:
        return f'\n<p class="soft">{escape(sentence(found.note))}.</p>'
    if np.isinf(found.laps):
        return '\n<p class="soft">The last row is steady sliding: the state after all laps.</p>'
    mean = escape(f"{found.mean:.4g}".replace("-", "−"))
    if found.laps < 1.0:
        return f'\n<p class="soft">Mean friction {mean}: {escape(found.note)}.</p>'
    error = "" if np.isnan(found.error) else f" ± {found.error:.2g}"
    note = f"; {escape(found.note)}" if found.note else ""
    laps = "lap" if found.laps == 1.0 else counted(round(found.laps), "lap")
    return (f'\n<p class="soft">Mean friction over the last {laps} of the road:'
            f" {mean}{error}{note}.</p>")
