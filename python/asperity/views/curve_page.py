"""The page of a friction curve: one self-contained HTML file for any browser."""

from __future__ import annotations

import math
from html import escape
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import WEB_PAGE, check_output, write_text
from ..base.library import version
from ..base.names import counted
from ..results import open_result
from ..results.curve_remarks import marks_of
from .page_parts import colour_scales, fill_page, page_file, page_json
from .report_data import blocks, now, packed
from .style import COLOURS, distinct_colours, typeset

if TYPE_CHECKING:
    from ..results.friction_curve import FrictionCurve

__all__ = ["curve_page", "write_curve_page"]

SCRIPTS = ("save.js", "theme.js", "chart.js", "map.js", "curve.js")
_BUDGET = 12e6          # characters that all maps may take together
_SIDES = (192, 128, 96, 64, 48, 32)

# Of the settings. The curve is extended to a wavelength, or not at all.
_UNITS = {"lx": " m", "ly": " m", "shortest_wave": " m", "extended_to": " m", "angle": "°"}

_NAMES = {"friction": "friction", "friction_viscous": "slopes", "friction_interface": "interface",
          "friction_loss": "loss",
          "contact_area": "contact area", "mean_gap": "mean gap",
          "friction_persson": "Persson", "area_persson": "Persson"}


def write_curve_page(curve: FrictionCurve, path: str | Path) -> Path:
    """Write the page; return the file.

    Parameters
    ----------
    curve : FrictionCurve
        The curve to show.
    path : str or Path
        NAME.html.

    Raises
    ------
    ValueError
        If the name does not end in .html, or the file exists and is no page of Asperity.
    OSError
        If the page cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"{target}: the name of a page must end in .html")
    check_output(target, WEB_PAGE)
    write_text(target, curve_page(curve))
    return target


def curve_page(curve: FrictionCurve) -> str:
    """Return the page of a curve as text."""
    data = _data(curve)
    title = str(curve.settings.get("title", "Friction"))
    sections = [("curves", "Curves", _curves_section(curve)), ("point", "Chosen point",
                                                          _point_section(data)),
                ("table", "Table", _table(curve)), ("how", "How it was made", _settings(curve))]
    parts = {
        "version": escape(version()),
        "title": escape(title),
        "subtitle": escape(_subtitle(curve)),
        "style": "\n".join([page_file("report.css"), *_colour_rules(_numbers_of_curves(curve))]),
        "links": "\n".join(f'<a href="#{key}-part">{head}</a>' for key, head, _ in sections),
        "notes": _notes(curve),
        "tiles": "",
        "sections": "\n".join(
            f'<section id="{key}-part">\n<h2>{head}</h2>\n{body}\n</section>'
            for key, head, body in sections),
        "footer": f"Page made by asperity {escape(version())} at {now()}.",
        "data": page_json(data),
        "script": "\n".join(page_file(name) for name in SCRIPTS),
    }
    return fill_page(parts)


def _numbers_of_curves(curve: FrictionCurve) -> list[int]:
    """Return how many curves a chart can have that are more than the style sheet has colours for.

    A chart is drawn against one axis. Each of the other two shows all its values or one of them.
    """
    sizes = [curve.pressure.size, curve.temperature.size, curve.speed.size]
    found = set(sizes) | {a * b for a, b in combinations(sizes, 2)}
    return sorted(count for count in found if count > len(COLOURS))


def _colour_rules(counts: list[int]) -> list[str]:
    """Return style rules for more curves than the palette has colours.

    The colour of curve i of n has the name n-i. In the light theme and in print it is that of the
    picture of the curve.
    """
    names = [f"{count}-{i}" for count in counts for i in range(count)]
    if not names:
        return []
    light, dark = ("".join(f"--c{name}:{colour};" for name, colour in zip(
        names, (colour for count in counts for colour in distinct_colours(count, dark=theme)),
        strict=True)) for theme in (False, True))
    return [f":root{{{light}}}",
            f'@media (prefers-color-scheme: dark){{:root:not([data-theme="light"]){{{dark}}}}}',
            f':root[data-theme="dark"]{{{dark}}}',
            '@media print{:root,:root:not([data-theme="light"]),:root[data-theme="dark"]'
            f"{{{light}}}}}",
            *(f".stroke{name}{{stroke:var(--c{name})}}.fill{name}{{fill:var(--c{name})}}"
              for name in names)]


def _subtitle(curve: FrictionCurve) -> str:
    """Return the line under the title."""
    counts = [counted(len(values), name) for name, values in
              (("pressure", curve.pressure), ("temperature", curve.temperature),
               ("speed", curve.speed))]
    return (f"{', '.join(counts)}; {counted(len(curve.patches), 'patch', 'patches')} of"
            f" {curve.settings['nx']} × {curve.settings['ny']} cells; steady sliding")


def _numbers(values: NDArray[Any]) -> Any:
    """Return an array as nested lists for JSON, to eight digits, None where there is no number."""
    if values.ndim:
        return [_numbers(part) for part in values]
    value = float(values)
    return float(f"{value:.8g}") if math.isfinite(value) else None


def _data(curve: FrictionCurve) -> dict[str, Any]:
    """Return the data of the charts and maps."""
    values: dict[str, Any] = {}
    for name in curve.values:
        mean, low, high = curve.mean(name)
        values |= {name: _numbers(mean), f"{name}_low": _numbers(low),
                   f"{name}_high": _numbers(high)}
    if not float(curve.settings.get("coefficient", 0.0)):
        for name in ("friction_viscous", "friction_interface", "friction_loss"):
            values.pop(name, None)  # all friction is loss in the rubber
    values |= {name: _numbers(array) for name, array in curve.theory.items()}
    maps, grid = _maps(curve)
    return {
        "axes": {name: _numbers(getattr(curve, name))
                 for name in ("pressure", "temperature", "speed")},
        "a_t": _numbers(curve.a_t), "values": values, "names": _NAMES,
        "losses": {name: _numbers(array) for name, array in curve.losses.items()},
        "marks": {",".join(map(str, at)): marks for at in np.ndindex(curve.theory[
            "friction_persson"].shape) if (marks := marks_of(curve.remarks, at))},
        "octave": _numbers(curve.octave), "relaxation": _numbers(curve.relaxation_time),
        "maps": maps, "grid": grid, "colours": colour_scales()}


def _maps(curve: FrictionCurve) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the pressure maps of the first patch, one per point, and their grid."""
    if not curve.sources:
        return {}, {}
    runs = {path: open_result(path) for path in {path for path, _ in curve.sources.values()}}
    first = next(iter(runs.values())).grid
    side = next((one for one in _SIDES if len(curve.sources) * one * one * 8 / 3 <= _BUDGET),
                _SIDES[-1])
    block = -(-max(first.nx, first.ny) // side)
    maps = {}
    for at, (path, step) in curve.sources.items():
        snapshots = runs[path].snapshots
        if step in snapshots.steps:
            found = packed(blocks(snapshots.at_step(step).pressure, block))
            maps[",".join(map(str, at))] = found
    grid = {"nx": first.nx, "ny": first.ny, "lx": first.lx, "ly": first.ly, "block": block,
            "mx": -(-first.nx // block), "my": -(-first.ny // block)}
    return maps, grid


def _curves_section(curve: FrictionCurve) -> str:
    """Return the charts and the controls above them."""
    signs = ""
    if curve.remarks:
        signs = (" A ring marks a point with warnings, which are listed above; a cross at the lower"
                 " edge stands for a point at which no patch has a solution.")
    return ('<p class="soft">Mean over the patches with its 95 % interval. The dashed line is'
            " Persson's theory for the same roughness. Click on a point to see where it touches and"
            f' where it loses energy.{signs}</p>\n<div class="choices" id="choices"></div>\n'
            '<div class="charts" id="curves"></div>')


def _point_section(data: dict[str, Any]) -> str:
    """Return the energy losses and the pressure map of the chosen point."""
    parts = ['<p>At <strong id="point"></strong>:</p>',
             '<p class="warn" id="point-warnings"></p>']
    if data["losses"]:
        parts.append('<div class="charts" id="losses"></div>')
    if data["maps"]:
        parts.append('<div class="maps" id="map"></div>')
    return "\n".join(parts)


def _notes(curve: FrictionCurve) -> str:
    """Return the boxes of warnings and notes, empty without any."""
    boxes = ""
    for head, texts in (("Warnings", curve.warnings), ("Notes", curve.notes)):
        if texts:
            lines = "".join(f"<li>{escape(typeset(text))}</li>" for text in texts)
            boxes += f'<div class="note"><p><strong>{head}</strong></p><ul>{lines}</ul></div>'
    return boxes


def _table(curve: FrictionCurve) -> str:
    """Return the table of the means."""
    heads = ("pressure (Pa)", "temperature (°C)", "speed (m/s)", "friction", "low", "high",
             "viscous", "contact area", "mean gap (m)", "Persson", "patches", "warnings")
    top = "".join(f"<th>{head}</th>" for head in heads)
    shown = [(*(_cell(value) for value in row[:11]), escape(marks_of(curve.remarks, at)))
             for at, row in zip(np.ndindex(curve.theory["friction_persson"].shape), curve.rows(),
                                strict=True)]
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in shown)
    return (f'<div class="wide"><table class="points"><thead><tr>{top}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>")


def _cell(value: float) -> str:
    """Return a number as a cell of the table."""
    return f"{value:.4g}".replace("-", "−") if math.isfinite(value) else "–"


def _settings(curve: FrictionCurve) -> str:
    """Return the settings of the curve and the list of its patches."""
    rows = "".join(f"<tr><th>{escape(name.replace('_', ' '))}</th>"
                   f"<td>{escape(typeset(value))}"
                   f"{'' if value == 'no' else _UNITS.get(name, '')}</td></tr>"
                   for name, value in curve.settings_text().items() )
    patches = "".join(f"<li>{escape(typeset(label))}</li>" for label in curve.patches)
    left = np.asarray(curve.theory["friction_left_out"])
    more = ""
    if np.any(left > 1e-4):
        more = (f"<p>Persson's theory predicts that the waves left out of the road add at"
                f" most {float(left.max()):.3g} to the friction.</p>")
    return (f'<div class="wide"><table>{rows}</table></div>{more}<details><summary>Patches'
            f"</summary><ol>{patches}</ol></details>")
