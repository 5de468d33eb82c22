"""Two-scale road with adhesion: maximum and steady friction (thesis, figures 4.15 and 4.16).

The study computes the default case of the thesis with and without adhesion. On waves twice as high
it computes the friction over the speed of the drive, beside the criterion of adhesion.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import common
import numpy as np
import two_scale as road
from matplotlib.figure import Figure

#: Minutes of the full form on two cores.
MINUTES = 15.0
#: Energy of adhesion, J/m2, and its range, m: those of the thesis.
ENERGY, RANGE = 20e-3, 63.5e-9
#: Cells along x of the full form; the short wave has 8 cells.
CELLS = 256
HIGH = 2.0 * road.STEEPNESS


def criterion(frequency: Any, short: float, steepness: float) -> Any:
    """Return C2 of eq. 4.9 for the short wave, with the storage modulus at a frequency, Hz."""
    modulus = road.compound(0.1).storage_modulus(2.0 * math.pi * np.asarray(frequency))
    return ENERGY * 8.0 * short / (3.0 * math.pi * modulus * (steepness * short) ** 2)


def _case(cells: int, short: float, steepness: float, speed: float, length: float,
          adhesive: bool) -> Any:
    """Return the case at a speed, m/s, with adhesion of a range (m) or without."""
    made = road.case(cells, road.waves(short, steepness), speed=speed, rubber=road.compound(0.1),
                     grip=1.0 + 0.7 * ENERGY / length / road.PRESSURE if adhesive else 1.0,
                     **({"shear_steps": 10, "distance": 0.4 * road.LONG} if cells < CELLS else {}))
    if made.grid.ny == 148:
        # With the factors 148 = 4 x 37, the transforms of this number of rows would take much
        # longer.
        made.grid.ny = 150
    made.solver.tolerance = 1e-4 if cells < CELLS else 1e-5
    if adhesive:
        made.adhesion.update(potential="exponential", energy=ENERGY, range=length)
    return made


def _found(data: dict[str, np.ndarray], period: float) -> dict[str, float]:
    """Return maximum and mean of the friction, and the state at these points.

    The mean is that over the last `period`, m, of the drive.
    """
    driven = data["road_x"] > 0.0
    friction = data["friction"]
    late = data["road_x"] > data["road_x"][-1] - period     # all steps have the same length
    return {"maximum": float(friction[driven].max()), "steady": float(friction[late].mean()),
            "swing": float(np.ptp(friction[late])),
            "area": float(data["contact_area"][late].mean()),
            "viscous": float(data["friction_viscous"][late].mean()),
            "loaded": float(data["contact_area"][~driven][-1]),
            "at_maximum": float(data["contact_area"][int(np.argmax(friction))]),
            "slowest": float(data["sliding_speed"][late].min()),
            "fastest": float(data["sliding_speed"][late].max())}


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the default case, and the speeds on high waves, with and without adhesion."""
    # Cells must be smaller than 0.7 E* range^2/energy. The quick form takes a longer range.
    cells, short, length = (road.QUICK, road.WIDER, 3.0 * RANGE) if quick else (
        CELLS, road.SHORT, RANGE)
    speeds = [1.0, 30.0] if quick else [0.01, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0]
    period = (0.2 if quick else 1.0) * road.LONG
    line = np.geomspace(speeds[0], speeds[-1], 41)
    data: dict[str, Any] = {
        "speeds": np.array(speeds), "bound": ENERGY / length / road.PRESSURE, "line": line,
        "c_loading": float(criterion(1.0 / road.LOADING, short, road.STEEPNESS)),
        "c_sliding": float(criterion(road.SPEED / short, short, road.STEEPNESS)),
        "c_loading_high": float(criterion(1.0 / road.LOADING, short, HIGH)),
        "c_high": criterion(np.array(speeds) / short, short, HIGH),
        "c_line": criterion(line / short, short, HIGH)}
    for name, adhesive in (("adhesive", True), ("bare", False)):
        cases = [_case(cells, short, road.STEEPNESS, road.SPEED, length, adhesive),
                 *(_case(cells, short, HIGH, speed, length, adhesive) for speed in speeds)]
        # Below 0.1 m/s the rubber relaxes so much that the cells are too wide; see the README.
        default, *high = road.histories(folder / name, cases, common.WIDE_CELLS)
        data[name] = {"curve": default, **_found(default, period)}
        found = [_found(case, period) for case in high]
        data[f"{name}_high"] = {key: np.array([one[key] for one in found]) for key in found[0]}
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the statements of the thesis on adhesion in the default case and over the speed."""
    sticky, bare = data["adhesive"], data["bare"]
    high, high_bare = data["adhesive_high"], data["bare_high"]
    # Eq. 4.9 with the moduli of our compound gives the numbers of the thesis, 0.9, 0.5 and 0.22.
    if not quick:
        for name, value in (("c_loading", 0.9), ("c_sliding", 0.5), ("c_loading_high", 0.22)):
            assert abs(data[name] / value - 1.0) < 0.05, f"{name} is {data[name]}"
    # "Adhesion increases both maximum and steady-state friction" ...
    assert sticky["loaded"] > bare["loaded"] + 0.05
    assert sticky["maximum"] > bare["maximum"] + 0.3 * data["bound"]
    assert sticky["steady"] > bare["steady"] + 0.1 * data["bound"]
    # ... because the contact pulls. Friction is that of the pressure plus energy/range on the area
    # in contact, multiplied by the effect of slopes and loss without adhesion. This holds within
    # 0.05, and within 0.1 on high waves: their slopes count four times as much, and a larger
    # contact area has other slopes.
    for case, other, slopes in ((sticky, bare, 0.05), (high, high_bare, 0.1)):
        for what, area in (("steady", "area"), ("maximum", "at_maximum")):
            grip = (1.0 + data["bound"] * np.asarray(case[area])) * np.asarray(other[what])
            np.testing.assert_allclose(case[what], grip, rtol=slopes, err_msg=what)
    # "The contact area shrinks during sliding."
    assert sticky["area"] < 0.8 * sticky["loaded"]
    # On high waves the criterion falls with the speed, and so does the gain of the steady friction.
    # The gain of the maximum is about the same at all speeds.
    gain = high["steady"] - high_bare["steady"]
    most = high["maximum"] - high_bare["maximum"]
    assert (np.diff(gain) < 0.01).all() and gain[-1] < (0.75 if quick else 0.5) * gain[0], \
        f"steady gains {gain}"
    assert (np.diff(data["c_high"]) < 0.0).all()
    assert most.min() > 0.4 * most.max() > 0.0, f"gains of the maximum {most}"
    assert (most > gain).all()


def picture(data: dict[str, Any]) -> Figure:
    """Draw friction and areas over time, and friction and criterion over the speed."""
    figure = Figure(figsize=(12.5, 7.6), layout="constrained")
    (friction, over), (area, gain) = figure.subplots(2, 2)
    for name, label, colour in (("bare", "without adhesion", road.BLUE),
                                ("adhesive", "with adhesion", road.RED)):
        curve = data[name]["curve"]
        time = 1e3 * curve["time"]
        friction.plot(time, curve["friction"], color=colour, label=label)
        area.plot(time, curve["contact_area"], color=colour, label=f"contact, {label}")
        slips = np.where(curve["road_x"] > 0.0, curve["contact_area"] - curve["stick_area"], 0.0)
        area.plot(time, slips, color=colour, linestyle=":", label=f"slipping, {label}")
        found = data[f"{name}_high"]
        over.semilogx(data["speeds"], found["maximum"], "s--", color=colour,
                      label=f"maximum, {label}")
        over.semilogx(data["speeds"], found["steady"], "o-", color=colour,
                      label=f"steady, {label}")
    friction.set(ylabel="friction coefficient", xlabel="time (ms)", ylim=(0.0, None),
                 title="default road, 1 m/s from 1 ms on")
    area.set(ylabel="fraction of the grid", xlabel="time (ms)", ylim=(0.0, 1.0))
    over.set(ylabel="friction coefficient", xlabel="speed of the drive (m/s)",
             title="waves twice as high", ylim=(1.0, 1.8))
    high, bare = data["adhesive_high"], data["bare_high"]
    gain.loglog(data["speeds"], high["maximum"] - bare["maximum"], "s--", color=road.PURPLE,
                label="what adhesion adds to the maximum")
    gain.loglog(data["speeds"], high["steady"] - bare["steady"], "o-", color=road.PURPLE,
                label="what it adds to the steady friction")
    gain.loglog(data["line"], data["c_line"], color=road.GREEN, linestyle="-.",
                label="criterion C₂, modulus at speed/short wave")
    gain.axhline(data["c_loading_high"], color="grey", linestyle=":", label="C₂ of the loading")
    gain.set(xlabel="speed of the drive (m/s)", ylabel="friction coefficient, criterion")
    for axes in (friction, over, area, gain):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize="small", ncols=2 if axes is over else 1,
                    loc="upper right" if axes is over else "best")
    return figure
