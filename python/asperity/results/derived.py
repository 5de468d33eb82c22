"""Numbers that follow from a result: friction by its causes, the books of energy, slopes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .history import Grid
    from .run import Run
    from .snapshot import Snapshot

__all__ = ["closure", "energy_terms", "friction_outside", "has_adhesion", "has_friction",
           "has_rough_road", "is_elastic", "moved_slopes", "rms_slope", "road_slopes", "road_speed",
           "setting", "solver_setting", "travel"]

FloatArray = NDArray[np.float64]


def setting(run: Run, group: str, name: str) -> str | None:
    """Return a setting of the run as text, without quotes; None where the file does not tell.

    The first group of that name counts. The resolved settings are read, or the input where an
    older file has none.
    """
    text = str(run.attributes.get("settings", "") or run.input)
    for body in re.findall(rf"(?is)&{group}\b(.*?)(?:\n\s*/|/\s*(?:\n|$))", text):
        found = re.search(rf"(?im)(?:^|[\s,]){name}\s*=\s*('[^']*'|\"[^\"]*\"|[^\s,!]+)", body)
        if found:
            return found[1].strip("'\"")
    return None


def solver_setting(run: Run, name: str) -> float | None:
    """Return a number of the group `&solver`, such as its tolerance."""
    text = setting(run, "solver", name)
    try:
        return None if text is None else float(text.lower().replace("d", "e"))
    except ValueError:
        return None


def has_friction(run: Run) -> bool:
    """Whether the interface of the run has friction."""
    law = setting(run, "friction", "law")
    if law is not None:
        return law.lower() != "none"
    columns = [run.history[name] for name in ("stick_area", "dissipated_friction", "traction_x")
               if name in run.history]
    return any(bool(np.any(column)) for column in columns)


def has_adhesion(run: Run) -> bool:
    """Whether the surfaces of the run attract each other."""
    potential = setting(run, "adhesion", "potential")
    if potential is not None:
        return potential.lower() != "none"
    return bool("energy_adhesive" in run.history and np.any(run.history["energy_adhesive"]))


def has_rough_road(run: Run) -> bool:
    """Whether the road is self-affine or measured."""
    return bool(re.search(r"(?i)shape *= *['\"](self_affine|file)['\"]", run.input))


def is_elastic(run: Run) -> bool:
    """Whether the material has no memory."""
    arms = run.material.get("prony_g")
    return ("shear_modulus" in run.material and "poisson" in run.material
            and (arms is None or not np.any(arms)))


def rms_slope(grid: Grid, height: FloatArray) -> float:
    """Root mean square slope of a periodic height map, spectral."""
    kx = 2.0 * np.pi * np.fft.rfftfreq(grid.nx, grid.dx)
    ky = 2.0 * np.pi * np.fft.fftfreq(grid.ny, grid.dy)
    modes = np.abs(np.fft.rfft2(height) / height.size) ** 2
    modes[:, 1 : (grid.nx + 1) // 2] *= 2.0
    return float(np.sqrt(np.sum((kx**2 + ky[:, None] ** 2) * modes)))


def travel(run: Run) -> FloatArray | None:
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


def energy_terms(run: Run) -> dict[str, FloatArray]:
    """Return work put in, energy stored and energies lost, J, one value a row.

    'work' is that of the normal and the tangential tractions, 'stored' the elastic, adhesive and
    kinetic energy since the first row; 'viscous' and 'friction' are lost. What the history lacks
    is left out, with nothing but zeros it is kept.
    """
    history = run.history

    def total(*names: str) -> FloatArray | None:
        found = [np.asarray(history[name], dtype=float) for name in names if name in history]
        return np.sum(found, axis=0) if found else None

    terms = {
        "work": total("work_normal", "work_tangential"),
        "stored": total("energy_elastic", "energy_adhesive", "energy_kinetic"),
        "viscous": total("dissipated_viscous"),
        "friction": total("dissipated_friction"),
    }
    return {name: values for name, values in terms.items() if values is not None}


def closure(run: Run) -> FloatArray | None:
    """Return what the books of energy miss in each row, over the largest energy so far.

    Work less the change of the stored energy less the losses; the first row counts from nothing:
    the work of a jump is what it stores. None where the history lacks a term.
    """
    terms = energy_terms(run)
    if set(terms) != {"work", "stored", "viscous", "friction"} or not run.history.rows:
        return None
    missing = np.abs(terms["work"] - terms["stored"] - terms["viscous"] - terms["friction"])
    largest = np.maximum.accumulate(np.max(np.abs(list(terms.values())), axis=0))
    return np.divide(missing, largest, out=np.zeros_like(missing), where=largest > 0.0)


def road_speed(run: Run) -> FloatArray:
    """Return the speed of the road in each step, m/s; 0 where no time passes."""
    history = run.history
    passed = np.diff(history["time"])
    moved = np.hypot(np.diff(history["road_x"]), np.diff(history["road_y"]))
    speed = np.divide(moved, passed, out=np.zeros_like(moved), where=passed > 0.0)
    return np.concatenate([[0.0], speed])


def direction(run: Run, row: int) -> tuple[float, float] | None:
    """Return the unit vector of the road's way up to a row: of its last move; None before."""
    history = run.history
    for last in range(row, 0, -1):
        moved = [float(history[name][last] - history[name][last - 1])
                 for name in ("road_x", "road_y")]
        way = float(np.hypot(*moved))
        if way > 0.0:
            return moved[0] / way, moved[1] / way
    return None


def road_slopes(run: Run) -> list[FloatArray]:
    """Return dH/dx and dH/dy of the road at its cells, by central differences."""
    grid, height = run.grid, run.height
    slopes = []
    for axis, spacing in ((1, grid.dx), (0, grid.dy)):
        if height.shape[axis] < 2:
            slopes.append(np.zeros_like(height))
        elif grid.boundary == "periodic":
            slopes.append((np.roll(height, -1, axis) - np.roll(height, 1, axis)) / (2 * spacing))
        else:
            slopes.append(np.gradient(height, spacing, axis=axis))
    return slopes


def moved_slopes(snapshot: Snapshot, road: tuple[float, float],
                 slopes: list[FloatArray] | None = None) -> tuple[FloatArray, FloatArray]:
    """Return the slopes of the road under the points of the rubber, as the program takes them.

    Central differences of the height, interpolated between cells where the road has moved to,
    seen from the displaced rubber.

    Parameters
    ----------
    snapshot : Snapshot
        Its displacements along x and y are used where it has them.
    road : tuple of float
        How far the road has moved along x and y, m.
    slopes : list of ndarray, optional
        Those of `road_slopes`, where many snapshots are looked at.

    Returns
    -------
    tuple of ndarray
        dH/dx and dH/dy, shape (ny, nx).
    """
    from scipy.ndimage import map_coordinates

    grid = snapshot.run.grid
    slopes = road_slopes(snapshot.run) if slopes is None else slopes
    at = list(np.indices(slopes[0].shape).astype(float))
    for axis, (name, spacing, moved) in enumerate((("displacement_y", grid.dy, road[1]),
                                                   ("displacement_x", grid.dx, road[0]))):
        at[axis] -= moved / spacing
        if name in snapshot:
            at[axis] += snapshot[name] / spacing
    mode = "grid-wrap" if grid.boundary == "periodic" else "constant"
    along_x, along_y = (map_coordinates(slope, at, order=1, mode=mode) for slope in slopes)
    return along_x, along_y


def friction_outside(run: Run) -> tuple[FloatArray, FloatArray]:
    """Return how much of the friction coefficient comes from attraction outside the contact.

    It is -mean(P dH/ds) over the open cells, over mean(P), a part of the viscous friction, known
    at the snapshots only.

    Parameters
    ----------
    run : Run
        With adhesion and snapshots of pressure and contact.

    Returns
    -------
    rows : ndarray of int
        Rows of the history that have a value.
    values : ndarray
        The coefficients.
    """
    rows, values = [], []
    slopes = None
    steps = list(run.history["step"]) if "step" in run.history else []
    for snapshot in run.snapshots:
        if ("pressure" not in snapshot or "contact" not in snapshot
                or snapshot.step not in steps):
            continue
        row = steps.index(snapshot.step)
        along = direction(run, row)
        pressure = snapshot["pressure"]
        if along is None or pressure.mean() == 0.0:
            continue
        slopes = road_slopes(run) if slopes is None else slopes
        slope_x, slope_y = moved_slopes(snapshot, (float(run.history["road_x"][row]),
                                                   float(run.history["road_y"][row])), slopes)
        slope = along[0] * slope_x + along[1] * slope_y
        open_cells = snapshot["contact"] == 0
        rows.append(row)
        values.append(-float(np.mean(pressure * slope * open_cells) / pressure.mean()))
    return np.array(rows, dtype=int), np.array(values)


