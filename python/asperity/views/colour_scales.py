"""Colour scales of maps: their limits, colours and units.

Data of one sign have a scale that begins at zero. Data of both signs, such as the pressure of an
adhesive contact, have diverging colours that are white at zero. If the values of one sign are less
than half as large as those of the other, each sign has half of the colours for its own values: in a
contact that is pulled off, tensions can be ten times as large as pressures, and a scale with the
same limit for both would show no pressure at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize, TwoSlopeNorm
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ..results.settings import has_friction
from .style import NO_CONTACT, SLIP, STICK, si_scale

if TYPE_CHECKING:
    from matplotlib.colorbar import Colorbar

    from ..results import Snapshot
    from ..results.result_file import ResultFile

__all__ = ["field_style", "mark_scale", "scale_ends", "scale_limit", "state_style",
           "typical_value", "without_open_cells", "without_round_off"]

SIGNED = ("traction_x", "traction_y", "slip_x", "slip_y", "displacement_x", "displacement_y")
# A sign whose values are smaller than those of the other sign by this factor is not shown.
NEGLIGIBLE = 1e-3
# From this part of the larger limit on, both limits are the same.
ALIKE = 0.5
# The least part of the larger limit that the other limit is, so that values which are small against
# all others do not get full colours.
LEAST = 0.1
ROUND_OFF = 1e-12  # largest gap over displacement and height of the road that is round-off


def scale_limit(values: NDArray[Any]) -> float:
    """Return the end of a colour scale: the largest value, but without a few extreme cells."""
    if values.size == 0:
        return 1.0
    largest, most = float(values.max()), float(np.percentile(values, 99.5))
    if largest == 0.0:
        return 1.0
    return largest if largest < 1.5 * most or most == 0.0 else most


def typical_value(field: NDArray[Any]) -> float:
    """Return the value that determines the prefix of a colour bar."""
    positive = np.abs(field[np.nonzero(field)])
    return scale_limit(positive) if positive.size else 0.0


def scale_ends(field: NDArray[Any]) -> tuple[float, float]:
    """Return the ends of the colour scale of a field around zero.

    Parameters
    ----------
    field : ndarray
        The values.

    Returns
    -------
    low, high : float
        The ends, low <= 0 <= high. An end is 0 if the field has no values of this sign, or only
        negligible ones.

    Examples
    --------
    >>> import numpy as np
    >>> scale_ends(np.array([0.0, 1.0, 2.0])), scale_ends(np.array([-4.0, -1e-4, 2.0]))
    ((0.0, 2.0), (-4.0, 4.0))
    >>> scale_ends(np.array([-4.0, 1.0])), scale_ends(np.array([-8.0, 0.1]))
    ((-4.0, 1.0), (-8.0, 0.8))
    >>> scale_ends(np.array([-1e-5, 0.0, 2.0]))
    (0.0, 2.0)
    """
    low, high = (scale_limit(part) if part.size else 0.0
                 for part in (-field[field < 0.0], field[field > 0.0]))
    largest = max(low, high)
    low, high = (0.0 if end <= NEGLIGIBLE * largest else largest if end >= ALIKE * largest
                 else max(end, LEAST * largest) for end in (low, high))
    return (-low if low > 0.0 else 0.0), high


def field_style(field: NDArray[Any], name: str, units: str) -> tuple[float, str, dict[str, Any]]:
    """Return factor and unit of the colour scale of a field, and arguments of imshow.

    Parameters
    ----------
    field : ndarray
        Values, shape (ny, nx), in `units`.
    name : str
        Name of the field, such as ``"pressure"``.
    units : str
        SI unit of the field.

    Returns
    -------
    factor : float
        Values times this factor are in the unit.
    unit : str
        The unit of the colour scale, such as ``"MPa"``.
    style : dict
        The arguments ``cmap`` and ``norm`` of `imshow`, in this unit.
    """
    factor, unit = si_scale(typical_value(field), units)
    cmap: Any = "cividis"
    if name in SIGNED or name == "pressure":
        low, high = (end * factor for end in scale_ends(field))
        if low < 0.0 < high:
            return factor, unit, {"cmap": "RdBu_r", "norm": TwoSlopeNorm(0.0, low, high)}
        if low == high:
            high = 1.0
        cmap = "viridis" if high > 0.0 else "viridis_r"
        if name == "pressure":
            # Tensions are blue, as they are beside pressures.
            cmap = plt.get_cmap("viridis" if high > 0.0 else "Blues_r").with_extremes(
                bad=NO_CONTACT)
    else:
        low, high = float(field.min()) * factor, float(field.max()) * factor
        if low == high:  # for example the gap in full contact
            low, high = min(0.0, low), max(0.0, low) or 1.0
    return factor, unit, {"cmap": cmap, "norm": Normalize(low, high)}


def mark_scale(bar: Colorbar, label: str, field: NDArray[Any]) -> None:
    """Label a colour bar, and give each half of that of a field of both signs its own ticks.

    The bar of a field that is zero everywhere, such as the gap in full contact, has no other tick
    than zero.
    """
    bar.set_label(label)
    norm = bar.norm
    if not field.any():
        bar.set_ticks([0.0])
    elif isinstance(norm, TwoSlopeNorm):
        low, high = float(norm.vmin or 0.0), float(norm.vmax or 0.0)
        steps = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10])
        ticks = [tick for ends in ((low, 0.0), (0.0, high)) for tick in steps.tick_values(*ends)
                 if ends[0] <= tick <= ends[1]]
        bar.set_ticks(sorted(set(ticks)))


def without_open_cells(field: NDArray[Any], name: str) -> NDArray[Any]:
    """Return a field for a picture, in which cells out of contact are masked.

    Parameters
    ----------
    field : ndarray
        Values, shape (ny, nx).
    name : str
        Name of the field. Only ``"pressure"`` without tension is masked, where it is zero.

    Returns
    -------
    ndarray
        The masked field, or the field itself.
    """
    if name == "pressure" and field.min(initial=0.0) >= 0.0:
        return np.ma.masked_less_equal(field, 0.0)
    return field


def without_round_off(snapshot: Snapshot, name: str) -> NDArray[Any]:
    """Return a field for a picture, in which a gap is zero if nothing but round-off is left of it.

    The gap is the difference of displacement and road. In full contact it would show the last
    digits of both.

    Parameters
    ----------
    snapshot : Snapshot
        The snapshot.
    name : str
        Name of the field; only ``"gap"`` is changed.

    Returns
    -------
    ndarray
        The field, shape (ny, nx), or zeros.
    """
    field = snapshot[name]
    if name != "gap":
        return field
    largest = max((float(np.abs(snapshot[part]).max()) for part in ("displacement_z", "road_height")
                   if part in snapshot), default=0.0)
    return np.zeros_like(field) if np.abs(field).max() <= ROUND_OFF * largest else field


def state_style(run: ResultFile) -> dict[str, Any]:
    """Return arguments of imshow for the map of open, sticking and slipping cells.

    Parameters
    ----------
    run : ResultFile
        The result; without friction, sticking and slipping cells have the same colour.

    Returns
    -------
    dict
        The arguments ``cmap`` and ``norm`` of `imshow`, for the values 0, 1 and 2.
    """
    colours = [NO_CONTACT, STICK, SLIP] if has_friction(run) else [NO_CONTACT, STICK, STICK]
    return {"cmap": ListedColormap(colours), "norm": BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3)}
