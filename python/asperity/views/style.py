"""The common style of all pictures: colours, short names, SI prefixes, sizes for print."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..base.files import PICTURE, check_output, new_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

    from ..results import Snapshot

__all__ = ["COLOURS", "DOUBLE_COLUMN", "LABELS", "NO_CONTACT", "PRINT", "SINGLE_COLUMN", "SLIP",
           "STICK", "axis_text", "check_picture", "distinct_colours", "fitted", "label_of",
           "print_style", "save_picture", "sentence", "shown_once", "si_scale", "typeset", "when"]

# Okabe and Ito's palette: blue, vermilion, green, purple, orange, sky blue, black.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
NO_CONTACT, STICK, SLIP = "#e8e8e8", "#0072B2", "#E69F00"
PREFIXES = {-18: "a", -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M",
            9: "G", 12: "T"}

# Widths of the columns of a journal, inches (89 and 183 mm), and suitable sizes of text and lines.
SINGLE_COLUMN, DOUBLE_COLUMN = 3.5, 7.2
PRINT: dict[RcKeyType, Any] = {
    "font.size": 8.0, "axes.titlesize": 8.0, "axes.labelsize": 8.0, "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0, "ytick.labelsize": 7.0, "figure.titlesize": 9.0,
    "axes.linewidth": 0.6, "lines.linewidth": 1.2, "lines.markersize": 3.5, "grid.linewidth": 0.5,
    "xtick.major.width": 0.6, "ytick.major.width": 0.6, "figure.dpi": 150, "savefig.dpi": 300,
}

# Short names for the axes. Other columns and fields appear with their long name.
LABELS = {
    "time": "Time",
    "pressure": "Pressure",
    "force": "Normal force",
    "displacement": "Approach",
    "contact_area": "Contact area fraction",
    "stick_area": "Stick area fraction",
    "sliding_speed": "Sliding speed",
    "mean_gap": "Mean gap",
    "gap": "Gap",
    "friction": "Friction coefficient",
    "friction_viscous": "Viscous friction coefficient",
    "height": "Height",
    "road_height": "Height of the road",
    "displacement_z": "Normal displacement",
    "displacement_x": "Displacement along x",
    "displacement_y": "Displacement along y",
    "traction_x": "Traction along x",
    "traction_y": "Traction along y",
    "slip_x": "Slip along x",
    "slip_y": "Slip along y",
    "road_x": "Road displacement along x",
    "road_y": "Road displacement along y",
    "contact": "Contact",
    "energy": "Energy",
    "energy_elastic": "Elastic energy",
    "energy_adhesive": "Energy of adhesion",
    "energy_kinetic": "Kinetic energy",
    "energy_radiated": "Radiated by adhesive jumps",
    "dissipated_viscous": "Lost in the rubber",
    "dissipated_numerical": "Lost by the scheme",
    "dissipated_friction": "Lost by friction",
    "power_viscous": "Rate of loss in the rubber",
    "power_friction": "Rate of loss by friction",
    "work_normal": "Normal work",
    "work_tangential": "Tangential work",
    "work_load": "Work of the load",
    "work_drive": "Work of the drive",
    "work_missing": "Work missing",
    "iterations_normal": "Iterations, normal",
    "iterations_tangential": "Iterations, tangential",
    "residual_normal": "Residual, normal",
    "residual_tangential": "Residual, tangential",
    "residual_coupling": "Residual, coupling",
    "passes": "Passes",
    "step": "Step",
    "phase": "Phase",
    "ffts": "Transforms",
    "seconds": "Solver time",
}


def check_picture(path: Path | None) -> None:
    """Refuse a file that matplotlib cannot write, or that is no picture; None is accepted.

    Raises
    ------
    ValueError
        If the ending is not one of matplotlib's, or the file exists and is no picture.
    """
    from matplotlib.backend_bases import FigureCanvasBase

    if path and path.suffix[1:].lower() not in FigureCanvasBase.get_supported_filetypes():
        raise ValueError(f"{path}: the ending must be .png, .pdf, .svg or another that matplotlib"
                         " writes")
    # Raw pixels have no mark by which they could be recognised.
    if path and path.suffix.lower() not in (".raw", ".rgba"):
        check_output(path, PICTURE)


def save_picture(figure: Figure, path: Path, dpi: int) -> None:
    """Write a figure. `check_picture` has allowed the file."""
    with new_file(path) as new:
        figure.savefig(new, dpi=dpi)


def si_scale(values: ArrayLike, units: str) -> tuple[float, str]:
    """Return the factor and the prefixed unit with which values have up to three digits.

    Parameters
    ----------
    values : array_like
        Values in SI units, of any shape.
    units : str
        Their unit, or '1' for pure numbers, which get no prefix.

    Returns
    -------
    factor : float
        Factor by which the values are to be multiplied.
    unit : str
        The prefixed unit.

    Examples
    --------
    >>> si_scale([0.0, 2.5e-3], "m")
    (1000.0, 'mm')
    >>> si_scale(3.2e6, "Pa")
    (1e-06, 'MPa')
    >>> si_scale(0.02, "m/s")
    (1000.0, 'mm/s')
    >>> si_scale(7300.0, "s")
    (1.0, 's')
    >>> si_scale(0.2, "1")
    (1.0, '')
    """
    if units in ("1", ""):
        return 1.0, ""
    finite = np.abs(np.asarray(values, dtype=float))
    finite = finite[np.isfinite(finite)]
    largest = float(finite.max(initial=0.0))
    if largest == 0.0:
        return 1.0, units
    # A value that would be rounded to 1000 uses the next prefix.
    exponent = 3 * int(np.floor(np.log10(largest * (1.0 + 1e-9)) / 3.0))
    exponent = min(exponent, 0 if units == "s" else max(PREFIXES))
    # Values below all prefixes are mostly round-off.
    if (not re.fullmatch(r"[A-Za-z]+(/s)?", units) or units == "kg"
            or exponent < min(PREFIXES)):
        return 1.0, units
    return float(f"1e{-exponent}"), PREFIXES[exponent] + units


def label_of(name: str, names: Any) -> str:
    """Return the short name of a column or field, or else its long name, `names.long_name`."""
    return LABELS.get(name) or sentence(names.long_name(name))


def axis_text(label: str, unit: str) -> str:
    """Return the text of an axis, which begins with a small letter.

    Examples
    --------
    >>> axis_text("Time", "ms"), axis_text("Contact area fraction", "")
    ('time (ms)', 'contact area fraction')
    """
    text = label[:1].lower() + label[1:]
    return f"{text} ({unit})" if unit else text


def distinct_colours(count: int, *, dark: bool = False) -> list[str]:
    """Return a colour for each of some curves.

    If there are more curves than colours in the palette, they are equally spaced on a scale whose
    lightness increases, so that no two curves have the same colour. The end of the scale that
    would not be seen on the paper, light or dark, is left out.
    """
    if count <= len(COLOURS):
        return list(COLOURS[:count])
    import matplotlib as mpl  # here, because commands that draw nothing must not wait for it

    steps = np.linspace(0.25, 1.0, count) if dark else np.linspace(0.0, 0.92, count)
    return [mpl.colors.to_hex(colour) for colour in mpl.colormaps["viridis"](steps)]


def typeset(text: str) -> str:
    """Return a text for a page, with the units that files and terminals have in plain ASCII.

    Examples
    --------
    >>> typeset("now 20 kg/m3, at -20 C"), typeset("m/s2"), typeset("C1 = 14 in m2.h5")
    ('now 20 kg/m³, at -20 °C', 'm/s²', 'C1 = 14 in m2.h5')
    """
    text = re.sub(r"(?<=\d) C\b", " °C", text)
    return re.sub(r"\b(kg/m|[JW]/m|m/s)([23])\b",
                  lambda found: found[1] + "²³"[int(found[2]) - 2], text)


def sentence(text: str) -> str:
    """Return a text that starts with a capital."""
    return text[:1].upper() + text[1:]


def fitted(title: str, inches: float, rest: str = "") -> str:
    """Return a title that fits above a figure together with other words.

    Parameters
    ----------
    title : str
        Title that the user has chosen. A long one is cut, and ends with an ellipsis.
    inches : float
        Width of the figure.
    rest : str
        Words that follow on the same line, which are not cut.

    Examples
    --------
    >>> fitted("A block on a road", 3.5)
    'A block on a road'
    >>> len(fitted("A block " * 50, 3.5, ": step 3")) < 60
    True
    """
    letter = 0.55 * PRINT["figure.titlesize"] / 72.0  # the average width, inches
    room = max(int(inches / letter) - len(rest), 12)
    words = " ".join(title.split())
    return words if len(words) <= room else f"{words[:room - 1].rstrip()}\u2026"


def when(snapshot: Snapshot) -> str:
    """Return the step and time of a snapshot."""
    if snapshot.time == 0.0:
        return f"step {snapshot.step}"
    factor, unit = si_scale(snapshot.time, "s")
    return f"step {snapshot.step}, t = {snapshot.time * factor:.4g} {unit}"


@contextmanager
def print_style() -> Iterator[None]:
    """Give new figures the sizes of print."""
    import matplotlib as mpl

    with mpl.rc_context(PRINT):
        try:
            yield
        finally:
            # The first figure chooses the backend. That of notebooks switches on the display of
            # figures, which has to outlast this context.
            interactive = mpl.is_interactive()
    mpl.interactive(interactive)


def shown_once(figure: Figure) -> Figure:
    """Return a figure so that a notebook displays it only once.

    The inline backend displays all open figures at the end of a cell, and the value of the cell in
    addition. A closed figure is displayed as the value only.
    """
    import matplotlib.pyplot as plt

    if "inline" in plt.get_backend().lower():
        plt.close(figure)
    return figure
