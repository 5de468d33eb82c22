"""The sections of the HTML page of a run, as HTML; the script of the page fills in the charts."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.durations import duration
from ..results.derived import closure, energy_terms, missing_work
from ..results.settings import parse_settings, phase_names, solver_setting
from .style import si_scale, typeset

if TYPE_CHECKING:
    from ..results import Run

__all__ = ["number_html", "sections_of", "settings_groups"]


def number_html(value: float, units: str) -> str:
    """Return a value in four digits with its prefixed unit."""
    factor, unit = si_scale(float(f"{value:.4g}"), units)
    return escape(f"{value * factor:.4g}{' ' + typeset(unit) if unit else ''}".replace("-", "−"))


def sections_of(run: Run, data: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return key, heading and content of the sections."""
    sections = []
    has = {chart["section"] for chart in data["charts"]}
    if "time" in has:
        head = ("Friction and contact area" if any(chart["id"] == "friction" for chart in
                                                   data["charts"]) else "Contact area and load")
        sections.append(("time", head, _history(run, data)))
    if data["snapshots"]:
        sections.append(("maps", "Profiles" if run.grid.ny == 1 else "Maps", _maps(run, data)))
    sections.append(("case", "Case and material", _case(run, data)))
    if data["spectrum"] or any(each.get("spectrum") for each in data["snapshots"]):
        text = ("Radial averages of the road at rest and of the rubber's normal displacement at"
                " the step chosen above.")
        sections.append(("spectra", "Spectra of road and rubber",
                         f'<p class="soft">{text}</p>\n'
                         '<div class="charts" id="charts-spectrum"></div>'))
    if run.history.rows and energy_terms(run):
        sections.append(("energies", "Energies", _energies(run)))
    if run.history.rows and "iterations_normal" in run.history:
        sections.append(("convergence", "Convergence", _convergence(run)))
    sections.append(("made", "How it was made", _made(run)))
    return sections


def _table(caption: str, rows: list[tuple[str, str]]) -> str:
    """Return a table of names and values, which are already HTML."""
    lines = "\n".join(f'<tr><th scope="row">{name}</th><td>{value}</td></tr>'
                      for name, value in rows)
    return f"<table><caption>{caption}</caption><tbody>\n{lines}\n</tbody></table>"


def settings_groups(run: Run) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the groups of the resolved settings, each with its variables in words."""
    groups = []
    for group in parse_settings(str(run.attributes.get("settings", ""))):
        variables = []
        for name, values in group.values.items():
            value, note = ", ".join(values), group.notes.get(name, "")
            if note:
                value += f" ({note})" if "=" in note else f" {note}"
            variables.append((name, typeset(value)))
        groups.append((group.name, variables))
    return groups


def _case(run: Run, data: dict[str, Any]) -> str:
    """Return the tables of the case."""
    groups = [(name, variables) for name, variables in settings_groups(run)
              if variables and name not in ("output", "case")]
    phases = [dict(variables) for name, variables in groups if name == "phase"]
    tables = [_table(name.capitalize(), [(escape(key.replace("_", " ")), escape(value))
                                         for key, value in variables])
              for name, variables in groups if name != "phase"]
    if not tables:  # an older file has no settings
        grid = run.grid
        tables.append(_table("Grid", [
            ("cells", f"{grid.nx} × {grid.ny}"),
            ("size", f"{number_html(grid.lx, 'm')} × {number_html(grid.ly, 'm')}"),
            ("boundary", escape(grid.boundary))]))
        rows = [(escape(name.replace("_", " ")), escape(str(value)))
                for name, value in run.material.items()]
        if rows:
            tables.append(_table("Material", rows))
    chart = '<div class="charts" id="charts-material"></div>' if data["modulus"] else ""
    columns = "\n".join(tables)
    return f'<div class="columns">\n{columns}\n</div>\n{_phases(phases)}\n{chart}'


def _phases(phases: list[dict[str, str]]) -> str:
    """Return the table of the phases, with all variables that any of them sets."""
    if not phases:
        return ""
    nothing = ("0", ".false.", "0 s", "0 m/s", "")
    names = [name for name in dict.fromkeys(key for phase in phases for key in phase)
             if name != "name" and any(phase.get(name, "") not in nothing for phase in phases)]
    head = "".join(f'<th scope="col">{escape(name.replace("_", " "))}</th>'
                   for name in ("phase", *names))
    lines = "\n".join(
        f'<tr><th scope="row">{escape(phase.get("name", "") or str(number))}</th>'
        + "".join(f"<td>{escape(phase.get(name, '–'))}</td>" for name in names) + "</tr>"
        for number, phase in enumerate(phases, 1))
    return (f'<div class="wide"><table class="grid-table"><caption>Phases</caption>'
            f"<thead><tr>{head}</tr></thead><tbody>\n{lines}\n</tbody></table></div>")


def _history(run: Run, data: dict[str, Any]) -> str:
    """Return the section with the charts of the history."""
    rows = data["rows"]
    thinned = "" if rows["shown"] == rows["all"] else (
        f" {rows['shown']} of {rows['all']} rows are drawn, with the extremes of friction and"
        " contact area of every stretch.")
    names = [name for name in phase_names(run) if not re.fullmatch(r"(phase \d+)?", name)]
    phases = f" Phases: {escape(', '.join(names))}." if names else ""
    return ('<p class="soft">Hover, tap or use the arrow keys to read values; drag or pinch to'
            " zoom, double click to see all. The charts of this page zoom together."
            f"{phases}{thinned} <span id=\"columns-csv\">All columns drawn: </span></p>\n"
            '<p class="control" hidden><label for="axis">Against </label>'
            '<select id="axis"></select></p>\n'
            '<div class="charts" id="charts-time"></div>')


def _maps(run: Run, data: dict[str, Any]) -> str:
    """Return the section with the maps and their slider."""
    grid, shown = data["grid"], len(data["snapshots"])
    notes = []
    if grid["block"] > 1:
        notes.append(f"Downsampled for this page: means over blocks of {grid['block']}"
                    f"{'' if run.grid.ny == 1 else ' × ' + str(grid['block'])} cells (of contact"
                    f" the most frequent state), {grid['mx']} × {grid['my']} of"
                    f" {grid['nx']} × {grid['ny']} cells.")
    if shown < data["stored"]:
        notes.append(f"{shown} of {data['stored']} snapshots are on this page.")
    if not run.finished:
        notes.append("The run is not finished: these are the snapshots so far.")
    note = f'<p class="soft">{" ".join(notes)}</p>\n' if notes else ""
    same = "" if run.grid.ny == 1 or shown < 2 else (
        '<label><input type="checkbox" id="same" checked> one colour scale for all steps</label>')
    hidden = " hidden" if shown < 2 else ""
    kind = "charts" if run.grid.ny == 1 else "maps"
    return (f'{note}<div class="slider">\n<label for="step"{hidden}>Step</label>\n'
            f'<button type="button" id="step-back" aria-label="Step before"{hidden}>◀</button>\n'
            f'<input type="range" id="step" min="0" max="{shown - 1}" value="{shown - 1}" step="1"'
            f'{hidden}>\n'
            f'<button type="button" id="step-on" aria-label="Step after"{hidden}>▶</button>\n'
            f'<output id="step-shown" for="step"></output>\n{same}\n</div>\n'
            f'<div class="{kind}" id="maps-place"></div>')


def _energies(run: Run) -> str:
    """Return the section on the energy balance."""
    missing = closure(run)
    text = ""
    if missing is not None:
        text = ('<p class="soft">Work minus stored minus lost energy: at most'
                f" <strong>{missing.max(initial=0.0):.2g}</strong> of the largest energy so far."
                "</p>\n")
    error = missing_work(run)
    if error is not None:
        text += ('<p class="soft">Work of load and drive that no column accounts for (error of the'
                 f" steps): at most <strong>{error:.2g}</strong> of that work.</p>\n")
    names = [name for name in run.history
             if name.startswith(("energy_", "dissipated_", "work_"))]
    rows = [(escape(run.history.long_name(name)), number_html(float(run.history[name][-1]), "J"))
            for name in names if np.any(run.history[name])]
    table = _table("In the last row", rows) if rows else ""
    return f'{text}<div class="charts" id="charts-energy"></div>\n{table}'


def _convergence(run: Run) -> str:
    """Return the section on iterations and residuals."""
    history = run.history
    tolerance = solver_setting(run, "tolerance")
    rows = []
    if tolerance is not None:
        rows.append(("tolerance", f"{tolerance:g}"))
    for name in ("normal", "tangential"):
        iterations, residual = f"iterations_{name}", f"residual_{name}"
        if iterations in history and np.any(history[iterations]):
            rows.append((f"iterations, {name}", f"{history[iterations].min()} to"
                         f" {history[iterations].max()} a row, {history[iterations].sum()} in all"))
            if residual in history:
                at = int(np.argmax(history[residual]))
                rows.append((f"largest residual, {name}", f"{history[residual][at]:.3g}"
                             f" (row {at})"))
    if "ffts" in history:
        rows.append(("transforms", f"{int(history['ffts'].sum())}"))
    if "seconds" in history:
        seconds = float(history["seconds"].sum())
        rows.append(("time of the solvers",
                     number_html(seconds, "s") if seconds < 60.0 else duration(seconds)))
    return f'<div class="charts" id="charts-convergence"></div>\n{_table("All rows", rows)}'


def _made(run: Run) -> str:
    """Return the section on program, times, input and settings."""
    try:
        written = np.datetime64(int(run.path.stat().st_mtime), "s").astype(str) + "Z"
    except OSError:
        written = "-"
    rows = [("program", f"{escape(run.program)} {escape(run.version)}"),
            ("started", escape(run.created)), ("file last written", escape(written)),
            ("file", f"<code>{escape(str(run.path))}</code>"),
            ("snapshots", str(len(run.snapshots))), ("rows", str(run.history.rows))]
    settings = str(run.attributes.get("settings", ""))
    resolved = ("<details><summary>All settings, including defaults</summary>"
                f"<pre>{escape(settings)}</pre></details>" if settings else "")
    return (f"{_table('Result', rows)}\n<h3>Input file</h3>\n"
            f"<pre>{escape(run.input)}</pre>\n{resolved}")
