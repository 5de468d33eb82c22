"""Loading time on the road: a longer rest causes a higher peak (thesis, figure 4.13)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import two_scale as road
from matplotlib.figure import Figure

#: Minutes of the full form on two cores.
MINUTES = 2.0


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run each loading time."""
    times = [1e-5, 1e-3, 1e-1] if quick else [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0]
    cells, short = (road.QUICK if quick else road.FULL), road.WIDER
    rubber = road.compound(times[-1])
    cases = [road.case(cells, road.waves(short), loading=time, rubber=rubber,
                       distance=(1.15 if quick else 1.25) * road.LONG,
                       shear_steps=15 if quick else 40) for time in times]
    done = road.histories(folder, cases)
    found = [road.measures(case) for case in done]
    data: dict[str, Any] = {"loading": np.array(times), "curves": [
        {key: case[key] for key in ("road_x", "friction")} for case in done]}
    data.update({key: np.array([case[key] for case in found]) for key in found[0]})
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the statements of the thesis on the loading time."""
    # The maximum grows with the time. The plateau hardly depends on it; in a truly steady state it
    # would not, but the interface slides only one period of the long wave.
    rise = data["maximum"] - data["plateau"]
    assert (np.diff(data["maximum"]) > -2e-4).all()
    assert rise[-1] > 3.0 * rise[0]
    assert np.ptp(data["plateau"]) < 0.25 * rise[-1]
    # After a longer rest the friction oscillates more, because the road meets its own footprint
    # again.
    assert (np.diff(data["swing"]) > -1e-4).all() and data["swing"][-1] > 2.5 * data["swing"][0]
    # The contact area grows with the time of rest, and the gap falls.
    assert (np.diff(data["area_loaded"]) > 0.0).all()
    assert (np.diff(data["gap_loaded"]) < 0.0).all()
    road.check_slope(data)
    # After the shortest time the contact area still grows and the gap still falls in sliding. After
    # the longest time it is the opposite.
    assert data["area"][0] > data["area_loaded"][0] and data["gap"][0] < data["gap_loaded"][0]
    assert data["area"][-1] < data["area_loaded"][-1] and data["gap"][-1] > data["gap_loaded"][-1]


def picture(data: dict[str, Any]) -> Figure:
    """Draw maximum, plateau and gap over the loading time, and three of the starts."""
    figure = Figure(figsize=(13.0, 4.4), layout="constrained")
    friction, gap, curves = figure.subplots(1, 3)
    time = data["loading"]
    friction.semilogx(time, data["maximum"], "s-", color=road.RED, label="maximum")
    friction.semilogx(time, data["plateau"], "o-", color=road.BLUE, label="plateau")
    gap.semilogx(time, 1e6 * data["gap_loaded"], "s--", color=road.RED, label="before motion")
    gap.semilogx(time, 1e6 * data["gap"], "o-", color=road.BLUE, label="plateau")
    friction.set(xlabel="loading time (s)", ylabel="friction coefficient")
    gap.set(xlabel="loading time (s)", ylabel="mean gap (µm)", ylim=(0.0, None))
    shown = (1, len(time) // 2 - 1, -2) if len(time) > 3 else (0, 1, 2)
    for index, colour in zip(shown, (road.BLUE, road.GREEN, road.RED), strict=True):
        curve = data["curves"][index]
        driven = curve["road_x"] > 0.0
        curves.plot(1e6 * curve["road_x"][driven], curve["friction"][driven], color=colour,
                    label=f"after {time[index]:g} s")
    curves.set(xlabel="travel of the drive (µm)", ylabel="friction coefficient",
               xlim=(220.0, None), ylim=(0.97, None))
    for axes in (friction, gap, curves):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    return figure
