"""Pictures of results, with matplotlib: maps and profiles of fields, histories, an overview.

Colours are told apart by colour-blind readers; axes carry units with SI prefixes (mm, MPa).
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .result import Grid, Run, Snapshot

__all__ = ["plot_field", "plot_history", "plot_overview", "si_scale"]

# Okabe and Ito's palette: blue, vermilion, green, purple, orange, sky blue, black.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
NO_CONTACT = "#e8e8e8"
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}

# Short names for the axes; other columns and fields show their long name.
LABELS = {
    "time": "Time",
    "pressure": "Pressure",
    "force": "Normal force",
    "displacement": "Approach",
    "contact_area": "Contact area fraction",
    "mean_gap": "Mean gap",
    "gap": "Gap",
    "friction": "Friction coefficient",
    "friction_viscous": "Viscous friction coefficient",
    "height": "Height",
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
    "step": "Step",
    "phase": "Phase",
    "ffts": "Transforms",
    "seconds": "Solver time",
}
SIGNED = ("traction_x", "traction_y", "slip_x", "slip_y", "displacement_x", "displacement_y")


def si_scale(values: ArrayLike, units: str) -> tuple[float, str]:
    """Return the factor and the prefixed unit that show values with up to three digits.

    Parameters
    ----------
    values : array_like
        Values in SI units, of any shape.
    units : str
        Their unit; '1' for pure numbers, which get no prefix.

    Returns
    -------
    factor : float
        Multiply the values by it.
    unit : str
        The prefixed unit.

    Examples
    --------
    >>> si_scale([0.0, 2.5e-3], "m")
    (1000.0, 'mm')
    >>> si_scale(3.2e6, "Pa")
    (1e-06, 'MPa')
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
    # A value that rounds up to 1000 of a prefix takes the next one.
    exponent = 3 * int(np.floor(np.log10(largest * (1.0 + 1e-9)) / 3.0))
    exponent = min(max(exponent, min(PREFIXES)), max(PREFIXES))
    if not re.fullmatch(r"[A-Za-z]+", units) or units == "kg":
        return 1.0, units
    return float(f"1e{-exponent}"), PREFIXES[exponent] + units


def plot_field(snapshot: Snapshot, name: str = "pressure", ax: Axes | None = None) -> Axes:
    """Draw a field of a snapshot: a map with a colour bar, or a profile if ny is 1.

    Parameters
    ----------
    snapshot : Snapshot
        Whose field.
    name : str
        Name of the field.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes; the figure is ``axes.figure``.
    """
    field = snapshot[name]
    grid = snapshot.run.grid
    label = LABELS.get(name, _sentence(snapshot.long_name(name)))
    if grid.ny == 1:
        axes = _profile(grid, field[0], label, snapshot.units(name), ax)
    else:
        axes = _map(grid, field, name, label, snapshot.units(name), ax)
    axes.set_title(f"{label}, {_when(snapshot)}")
    return axes


def plot_history(run: Run, name: str = "contact_area", x: str | None = None,
                 ax: Axes | None = None, **style: Any) -> Axes:
    """Draw a column of the history against another one.

    Parameters
    ----------
    run : Run
        Whose history.
    name : str
        Column to draw.
    x : str, optional
        Column along the axis: time by default; where time stands still, pressure or step.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure if left out.
    **style
        Passed on to `matplotlib.axes.Axes.plot`.

    Returns
    -------
    matplotlib.axes.Axes
        The axes; the figure is ``axes.figure``.
    """
    history = run.history
    values = history[name]
    if x is None:
        x = next((column for column in ("time", "pressure", "step")
                  if column != name and column in history and np.ptp(history[column]) > 0.0),
                 "step") if history.rows else "step"
    along = history[x]
    axes = ax if ax is not None else _new_axes((5.6, 3.8))
    x_factor, x_unit = si_scale(along, history.units(x))
    factor, unit = si_scale(values, history.units(name))
    style = {"color": COLOURS[0], "marker": "o" if len(values) <= 40 else "", "markersize": 4.0,
             **style}
    axes.plot(along * x_factor, values * factor, **style)
    axes.set_xlabel(_axis(LABELS.get(x, _sentence(history.long_name(x))), x_unit))
    axes.set_ylabel(_axis(LABELS.get(name, _sentence(history.long_name(name))), unit))
    axes.grid(alpha=0.3)
    if run.title and ax is None:
        axes.set_title(run.title)
    return axes


def plot_overview(run: Run) -> Figure:
    """Draw the last pressure, the last gap, and what the history tells.

    The history is the contact area against the load, beside Persson's theory where the road is
    rough and the material elastic; of a run in time it is contact area and friction.
    """
    snapshot = run.snapshots[-1] if len(run.snapshots) else None
    names = [name for name in ("pressure", "gap") if snapshot is not None and name in snapshot]
    grid = run.grid
    ratio = 1.0 if grid.ny == 1 else float(np.clip(grid.ly / grid.lx, 0.4, 1.6))
    count = len(names) + 1
    figure, axes = plt.subplots(1, count, figsize=(4.9 * count, 1.0 + 3.7 * ratio),
                                layout="constrained", squeeze=False)
    for name, panel in zip(names, axes[0], strict=False):
        plot_field(snapshot, name, panel)
        panel.set_title(LABELS[name])
    panel = axes[0, -1]
    if run.history.rows and np.ptp(run.history["time"]) > 0.0:
        _time_panel(run, panel)
    else:
        _load_panel(run, panel)
    when = f": {_when(snapshot)}" if snapshot is not None else ""
    figure.suptitle(f"{run.title or run.path.name}{when}")
    return figure


def _load_panel(run: Run, axes: Axes) -> None:
    """Contact area against pressure, with Persson's theory where it holds."""
    history = run.history
    pressure = history["pressure"]
    factor, unit = si_scale(pressure, "Pa")
    rough = re.search(r"(?i)shape *= *['\"](self_affine|file)['\"]", run.input)
    if rough and run.grid.boundary == "periodic" and run.grid.ny > 1 and _is_elastic(run):
        modulus = 2.0 * float(run.material.shear_modulus) / (1.0 - float(run.material.poisson))
        slope = _rms_slope(run.grid, run.height)
        if slope > 0.0 and pressure.max(initial=0.0) > 0.0:
            from .theory import persson_area  # SciPy takes its time to load

            loads = np.linspace(0.0, 1.05 * pressure.max(), 200)
            areas = persson_area(loads, modulus, slope)
            axes.plot(loads * factor, areas, color=COLOURS[1], linestyle="--",
                      label="Persson (2001)")
    axes.plot(pressure * factor, history["contact_area"], color=COLOURS[0], marker="o",
              markersize=4.0, linestyle="-" if history.rows > 1 else "", label="this run")
    axes.set_xlabel(_axis(LABELS["pressure"], unit))
    axes.set_ylabel(LABELS["contact_area"])
    axes.set_xlim(left=min(0.0, pressure.min(initial=0.0) * factor))
    axes.set_ylim(bottom=0.0)
    axes.set_title("Contact area against load")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper left")


def _time_panel(run: Run, axes: Axes) -> None:
    """Contact area, and friction where the road moves, against time or the road's travel."""
    names = ["contact_area", *(["friction"] if np.any(run.history["friction"]) else [])]
    travel = _travel(run)
    for number, (name, panel) in enumerate(zip(names, (axes, None), strict=False)):
        panel = panel or axes.twinx()
        if travel is None:
            plot_history(run, name, "time", panel, color=COLOURS[number], marker="")
        else:
            factor, unit = si_scale(travel, "m")
            panel.plot(travel * factor, run.history[name], color=COLOURS[number])
            panel.set_xlabel(_axis("Travel of the road", unit))
            panel.set_ylabel(LABELS[name])
        if len(names) == 2:
            panel.yaxis.label.set_color(COLOURS[number])
        panel.set_ylim(bottom=min(0.0, 1.05 * float(np.nanmin(run.history[name]))))
    axes.grid(alpha=0.3)
    axes.set_title("Contact area and friction" if len(names) == 2 else "Contact area")


def _travel(run: Run) -> NDArray[np.float64] | None:
    """Return the way of the road, m, where its speeds differ so much that time hides the fast part.

    A phase that covers a tenth of the way in less than a twentieth of the time would be a vertical
    line over time.
    """
    history = run.history
    if "road_x" not in history or "road_y" not in history:
        return None
    moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
    passed = np.diff(history["time"])
    phases = history["phase"][1:]
    if not np.any(moved):
        return None
    hidden = any(moved[phases == phase].sum() > 0.1 * moved.sum()
                 and passed[phases == phase].sum() < 0.05 * passed.sum()
                 for phase in np.unique(phases))
    return np.concatenate([[0.0], np.cumsum(moved)]) if hidden else None


def _map(grid: Grid, field: NDArray[Any], name: str, label: str, units: str,
         ax: Axes | None) -> Axes:
    """Draw a map with its colour bar."""
    ratio = float(np.clip(grid.ly / grid.lx, 0.25, 2.5))
    axes = ax if ax is not None else _new_axes((5.6, 1.1 + 4.2 * ratio))
    length, length_unit = si_scale([grid.lx, grid.ly], "m")
    factor, unit = si_scale(_typical(field), units)
    extent = length * np.array([-0.5 * grid.dx, grid.lx - 0.5 * grid.dx,
                                -0.5 * grid.dy, grid.ly - 0.5 * grid.dy])
    style: dict[str, Any] = {}
    extend = "neither"
    shown = field * factor if name != "contact" else field
    if name == "contact":
        style = {"cmap": ListedColormap([NO_CONTACT, COLOURS[0], COLOURS[4]]),
                 "norm": BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3)}
    elif name in SIGNED:
        limit = _limit(np.abs(shown))
        style = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
        extend = "both" if np.abs(shown).max(initial=0.0) > limit else "neither"
    elif name == "pressure" and shown.min(initial=0.0) >= 0.0:
        cmap = plt.get_cmap("viridis").with_extremes(bad=NO_CONTACT)
        limit = _limit(shown[shown > 0.0])
        style = {"cmap": cmap, "vmin": 0.0, "vmax": limit}
        extend = "max" if shown.max(initial=0.0) > limit else "neither"
        shown = np.ma.masked_less_equal(shown, 0.0)
    elif name == "pressure":
        limit = _limit(np.abs(shown))
        style = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
        extend = "both" if np.abs(shown).max() > limit else "neither"
    else:
        style = {"cmap": "cividis"}
    image = axes.imshow(shown, origin="lower", extent=tuple(extent), aspect="equal",
                        interpolation="nearest" if name == "contact" else "auto", **style)
    bar = axes.figure.colorbar(image, ax=axes, extend=extend,
                               **({"orientation": "horizontal", "pad": 0.12} if ratio < 0.45
                                  else {"fraction": 0.046 * ratio, "pad": 0.03}))
    bar.set_label(_axis(label, unit))
    if name == "contact":
        bar.set_ticks([0, 1, 2], labels=["open", "stick", "slip"])
    axes.set_xlabel(f"x ({length_unit})")
    axes.set_ylabel(f"y ({length_unit})")
    return axes


def _profile(grid: Grid, field: NDArray[Any], label: str, units: str, ax: Axes | None) -> Axes:
    """Draw a field of a line contact over x."""
    axes = ax if ax is not None else _new_axes((5.6, 3.8))
    length, length_unit = si_scale(grid.lx, "m")
    factor, unit = si_scale(field, units)
    axes.plot(grid.x * length, field * factor, color=COLOURS[0])
    axes.set_xlabel(f"x ({length_unit})")
    axes.set_ylabel(_axis(label, unit))
    axes.grid(alpha=0.3)
    return axes


def _new_axes(size: tuple[float, float]) -> Axes:
    """Make a figure of one panel."""
    return plt.subplots(figsize=size, layout="constrained")[1]


def _axis(label: str, unit: str) -> str:
    """Return the text of an axis."""
    return f"{label} ({unit})" if unit else label


def _sentence(text: str) -> str:
    """Return a text that starts with a capital."""
    return text[:1].upper() + text[1:]


def _when(snapshot: Snapshot) -> str:
    """Return the step and time of a snapshot."""
    if snapshot.time == 0.0:
        return f"step {snapshot.step}"
    factor, unit = si_scale(snapshot.time, "s")
    return f"step {snapshot.step}, t = {snapshot.time * factor:.4g} {unit}"


def _limit(values: NDArray[Any]) -> float:
    """Return the end of a colour scale: the largest value unless a few cells stand far out."""
    if values.size == 0:
        return 1.0
    largest, most = float(values.max()), float(np.percentile(values, 99.5))
    if largest == 0.0:
        return 1.0
    return largest if largest < 1.5 * most or most == 0.0 else most


def _typical(field: NDArray[Any]) -> float:
    """Return the value that sets the prefix of a colour bar."""
    positive = np.abs(field[np.nonzero(field)])
    return _limit(positive) if positive.size else 0.0


def _is_elastic(run: Run) -> bool:
    """Whether the material has no memory."""
    arms = run.material.get("prony_g")
    return ("shear_modulus" in run.material and "poisson" in run.material
            and (arms is None or not np.any(arms)))


def _rms_slope(grid: Grid, height: NDArray[np.float64]) -> float:
    """Root mean square slope of a periodic height map, spectral."""
    kx = 2.0 * np.pi * np.fft.rfftfreq(grid.nx, grid.dx)
    ky = 2.0 * np.pi * np.fft.fftfreq(grid.ny, grid.dy)
    modes = np.abs(np.fft.rfft2(height) / height.size) ** 2
    modes[:, 1 : (grid.nx + 1) // 2] *= 2.0
    return float(np.sqrt(np.sum((kx**2 + ky[:, None] ** 2) * modes)))
