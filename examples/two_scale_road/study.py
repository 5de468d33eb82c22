"""Two-scale road: a pressed block of rubber is set in motion (thesis, figure 4.7)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np
import two_scale as road
from matplotlib.figure import Figure

import asperity

#: Minutes of the full form on two cores.
MINUTES = 8
HERE = Path(__file__).resolve().parent


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run input.nml, or its quick form, and return the quantities over time."""
    if quick:
        case = road.case(road.QUICK, road.waves(road.WIDER))
        result = folder / "quick.h5"
    else:
        case = asperity.Case.read(HERE / "input.nml")
        result = folder / "two_scale_road.h5"
    run = asperity.open(result) if result.exists() else None
    if run is None or not run.finished or run.input != str(case):
        with common.expected(common.FEW_CELLS, common.LONG_STEPS,
                             f"&phase 2: {common.LONG_WAYS}"):
            run = asperity.run(case, output=result, threads=common.jobs)
    data = road.columns(run)
    return {**data, "found": road.measures(data)}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the stages of the start: stick, growing slip, maximum, oscillations."""
    found = data["found"]
    after = data["time"] - road.LOADING
    driven = after > 1e-9
    # The block sticks at first, and its mean shear stress is that of plain shear. The slip at the
    # edges of the contact is less than 2 % of the motion of the drive until half of the area slips.
    # The first step is left out: it is as short as the time of a shear wave through the block (0.9
    # us), so that the mass is still being accelerated.
    early = (after > 1.5e-6) & (data["stick_area"] > 0.5 * data["contact_area"])
    rubber = road.compound()
    time = after[early][:, None]
    strain_rate = road.SPEED / road.THICKNESS
    stress = strain_rate * (rubber.g_inf * time[:, 0] + (
        rubber.g * rubber.tau * -np.expm1(-time / rubber.tau)).sum(axis=1))
    assert early.sum() >= 10
    np.testing.assert_allclose(data["friction"][early], stress / road.PRESSURE, rtol=0.02,
                               err_msg="the sticking block is not in plain shear")
    # The whole contact slips a quarter of a millisecond after the start, as in the thesis (0.25
    # ms).
    slips = after[driven & (data["stick_area"] < 1e-3)][0]
    assert 0.22e-3 < slips < 0.33e-3, f"full slip {slips:.3g} s after the start"
    # The friction is above the Coulomb coefficient, and largest within the first quarter of the
    # long wave over which the interface slides. The thesis has 1.06 and 1.05 with its own compound.
    assert 1.01 < found["plateau"] < found["maximum"] < 1.08
    assert found["slid_to_maximum"] < 0.3 * road.LONG
    road.check_slope(found)
    # Rubber rises when it slides, and the drive shears it a little more.
    assert found["area"] < 0.8 * found["area_loaded"]
    assert found["gap"] > 1.5 * found["gap_loaded"]
    assert 0.85 < found["speed"] / road.SPEED < 1.0
    area = data["contact_area"][~driven]
    assert (np.diff(area) > -1e-12).all(), "contact shrinks at constant load"


def picture(data: dict[str, Any]) -> Figure:
    """Draw friction, areas and sliding speed over time, as a whole and in detail."""
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col")
    time, found = 1e3 * data["time"], data["found"]
    slip = np.where(data["road_x"] > 0.0, data["contact_area"] - data["stick_area"], 0.0)
    peak = int(data["friction"].argmax())
    for column in axes.T:
        column[0].plot(time, data["friction"], color=road.BLUE, label="friction")
        column[0].plot(time, 1.0 + 0.0 * time, color="grey", linestyle=":",
                       label="interface alone")
        column[0].plot(time[peak], data["friction"][peak], "o", color=road.RED,
                       label=f"maximum {found['maximum']:.3f}")
        column[1].plot(time, data["contact_area"], color="black", label="contact area")
        column[1].plot(time, slip, color=road.GREEN, linestyle="--", label="its part that slips")
        column[1].plot(time, data["sliding_speed"] / road.SPEED, color=road.ORANGE,
                       label="sliding speed over 1 m/s")
        column[1].set_xlabel("time (ms)")
        for panel in column:
            panel.grid(alpha=0.3)
    axes[0, 0].set(ylabel="friction coefficient", title="The whole", ylim=(-0.05, 1.2))
    axes[0, 1].set(ylim=(0.96, found["maximum"] + 0.01), title="Full slip and after")
    axes[1, 0].set(ylabel="fraction of the grid, of the drive", xlim=(0.0, time[-1]),
                   ylim=(0.0, 1.05))
    axes[1, 1].set(xlim=(1.2, time[-1]))
    axes[0, 0].legend(loc="center left")
    axes[1, 0].legend(loc="upper left")
    return figure
