"""Iterations of the tangential solver against the number of unknowns, for both methods.

The case is that of the thesis's figure 3.5: a sphere that is moved sideways from rest in one step.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np

import asperity
from asperity import theory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 2

MODULUS, POISSON, RADIUS, FORCE = 200e6, 0.42, 50e-3, 9.196
#: Iterations depend on the slip ratio only. With a small coefficient the sphere hardly moves, so
#: that the pressure stays the same and the count is that of the tangential problem alone.
COEFFICIENT = 1e-4
SIDE, SPEED, TOLERANCE, LIMIT = 2.4e-3, 1e-3, 1e-5, 8000
RATIOS = (0.1, 0.5, 0.9, 1.2)      # motion divided by that of full slip
CELLS = {"fast": (32, 48, 64, 96, 128, 192, 256), "thesis": (32, 48, 64, 96, 128, 192, 256)}
#: Position of the summit within its cell; the pressure of the outermost cells depends on it.
PLACES = ((0.5, 0.5), (0.1, 0.3), (0.4, 0.2))


def _one(folder: Path, method: str, cells: int, ratio: float, place: tuple[float, float]
         ) -> dict[str, Any]:
    """Return the work of one solve."""
    cell = SIDE / cells
    slide = theory.mindlin(RADIUS, MODULUS, POISSON, COEFFICIENT, FORCE, shift=0.0).slide_shift
    case = asperity.Case(
        "Iterations of the tangential solver",
        grid={"nx": cells, "ny": cells, "lx": SIDE, "boundary": "free"},
        surface=[{"shape": "paraboloid", "radius": RADIUS, "centre_x": SIDE / 2 + place[0] * cell,
                  "centre_y": SIDE / 2 + place[1] * cell}],
        material={"shear_modulus": MODULUS, "poisson": POISSON},
        friction={"law": "coulomb", "coefficient": COEFFICIENT, "slope_effect": False},
        phase=[{"force": FORCE},
               {"velocity_x": SPEED, "duration": ratio * slide / SPEED, "steps": 1}],
        solver={"tolerance": TOLERANCE, "method": method, "passes": 1, "max_iterations": LIMIT})
    path = folder / f"{method}_{cells}_{ratio}_{PLACES.index(place)}.h5"
    try:
        run = common.run(case, path)
    except asperity.NotConverged as error:
        run = error.result
    history, snapshot = run.history, run.snapshots[-1]
    pressure = snapshot.pressure[snapshot.pressure > 0]
    return {
        "unknowns": 2 * pressure.size, "converged": bool(run.finished),
        "iterations": int(history["iterations_tangential"][1]) if run.finished else LIMIT,
        "normal": int(history["iterations_normal"][1]),
        "ffts": float(history["ffts"][1]) if run.finished else np.nan,
        "residual": float(history["residual_tangential"][1]),
        "stick": float(history["stick_area"][-1] / history["contact_area"][-1]),
        "edge": float(pressure.min() / pressure.max()),
    }


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Solve with both methods for all slip ratios and grids."""
    grids = dict.fromkeys(CELLS, (24, 32, 48)) if quick else CELLS
    ratios = (0.5, 1.2) if quick else RATIOS
    places = PLACES[:1] if quick else PLACES
    data: dict[str, Any] = {"ratios": np.array(ratios)}
    for method, cells in grids.items():
        solves = [[[_one(folder, method, n, ratio, place) for place in places] for n in cells]
                  for ratio in ratios]
        for name in ("unknowns", "iterations", "ffts", "normal", "edge", "converged", "residual",
                     "stick"):
            data[f"{method}_{name}"] = np.array(
                [[[solve[name] for solve in at] for at in row] for row in solves])
        data[f"{method}_median"] = np.median(data[f"{method}_iterations"], axis=2)
        data[f"{method}_cells"] = np.array(cells)
        data[f"{method}_range"] = np.stack([data[f"{method}_iterations"].min(axis=(1, 2)),
                                            data[f"{method}_iterations"].max(axis=(1, 2))])
        data[f"{method}_unknowns_mean"] = data[f"{method}_unknowns"][0].mean(axis=1)
        #: Growth of the median of the iterations: the exponent of the number of unknowns.
        data[f"{method}_exponent"] = np.array([
            np.polyfit(np.log(unknowns.mean(axis=1)), np.log(median), 1)[0] for unknowns, median
            in zip(data[f"{method}_unknowns"], data[f"{method}_median"], strict=True)])
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the counts of 'fast', their growth, and the stick areas."""
    assert data["fast_converged"].all(), "fast: not converged"
    for method in ("fast", "thesis"):
        good = data[f"{method}_converged"]
        assert data[f"{method}_residual"][good].max() <= TOLERANCE, f"{method}: residual"
        # The pressure has hardly changed, so that the count is that of the tangential problem.
        assert data[f"{method}_normal"].max() <= 6, f"{method}: the normal solver iterated, too"
        for ratio, stick in zip(data["ratios"], data[f"{method}_stick"], strict=True):
            known = max(0.0, 1 - ratio)                 # (c/a)^2, Mindlin
            # The area is a count of cells; with 24 cells per side the contact is 16 cells wide.
            assert np.abs(stick - known).max() < (0.06 if quick else 0.03), \
                f"{method}: {ratio}: {np.abs(stick - known).max():.3f} of the area off"
    # From 2000 cells in contact on, the start on a coarser grid keeps the iterations from growing.
    assert data["fast_iterations"].max() <= 16, f"fast: {data['fast_iterations'].max()} iterations"
    assert data["fast_ffts"].max() <= 110, f"fast: {data['fast_ffts'].max()} transforms"
    most = 0.2 if quick else 0.05
    assert data["fast_exponent"].max() < most, f"fast grows: {data['fast_exponent']}"
    # 'thesis' has no preconditioner. The symbol of the operator is 1/|q|, so that its condition
    # number grows with the number of cells along a line, N^0.5, and the iterations of conjugate
    # gradients at least with its root, N^0.25. The thesis finds N^0.4. 'fast' does not have this
    # growth.
    for number, ratio in enumerate(data["ratios"]):
        slow, fast = data["thesis_exponent"][number], data["fast_exponent"][number]
        assert slow > 0.25 and slow > fast + 0.2, f"{ratio}: exponents {slow:.2f} and {fast:.2f}"
        if not quick:
            assert slow < 0.65, f"{ratio}: 'thesis' grows with the power {slow:.2f}"
        # Therefore 'thesis' takes more and more iterations than 'fast' as the mesh grows. It also
        # takes more transforms: an iteration of 'thesis' takes six, and one of 'fast' about five.
        for name, least in (("iterations", 4 if quick else 25), ("ffts", 4 if quick else 25)):
            behind = np.median(data[f"thesis_{name}"][number][-1]) / np.median(
                data[f"fast_{name}"][number][-1])
            assert behind > least, f"{ratio}: {name} of 'thesis' only {behind:.1f} times as many"


def picture(data: dict[str, Any]) -> Figure:
    """Draw iterations and transforms against the unknowns, and the reason of the scatter."""
    figure, (left, middle, right) = common.subplots(3)
    for number, ratio in enumerate(data["ratios"]):
        for method, style in (("fast", "-"), ("thesis", "--")):
            unknowns = data[f"{method}_unknowns"][number].mean(axis=1)
            for panel, name in ((left, "iterations"), (middle, "ffts")):
                values = data[f"{method}_{name}"][number].astype(float)
                values[~data[f"{method}_converged"][number]] = np.nan
                median = np.nanmedian(values, axis=1)
                panel.loglog(unknowns, median, style, marker=common.MARKERS[number], ms=4,
                             mfc="none", color=common.COLOURS[number],
                             label=f"{ratio:g}" if method == "fast" else None)
                if values.shape[1] > 1:
                    panel.fill_between(unknowns, np.nanmin(values, axis=1),
                                       np.nanmax(values, axis=1), lw=0, alpha=0.12,
                                       color=common.COLOURS[number])
        for method, fill in (("fast", True), ("thesis", False)):
            good = data[f"{method}_converged"][number]
            per = data[f"{method}_iterations"][number]
            right.loglog(data[f"{method}_edge"][number][good], per[good], ls="none",
                         marker=common.MARKERS[number], ms=4, color=common.COLOURS[number],
                         mfc=common.COLOURS[number] if fill else "none")
    unknowns = data["thesis_unknowns"][0].mean(axis=1)
    left.loglog(unknowns, 60 * (unknowns / unknowns[0]) ** 0.4, "k:", label="$N^{0.4}$ (thesis)")
    left.set(xlabel="unknowns, two a cell in contact", ylabel="iterations to 1e-5")
    left.legend(title="motion over that of full slip\nfull: 'fast', dashed: 'thesis'",
                title_fontsize="small", fontsize="x-small", ncols=2)
    middle.set(xlabel="unknowns, two a cell in contact", ylabel="real transforms")
    right.set(xlabel="smallest pressure in contact / largest", ylabel="iterations to 1e-5",
              title="full: 'fast', open: 'thesis'")
    return figure
