"""Road speed: maximum and plateau of friction over the speed (thesis, figure 4.10)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import two_scale as road
from matplotlib.figure import Figure

#: Minutes of the full form on two cores.
MINUTES = 4.0


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the case at each speed."""
    cells, short = (road.QUICK if quick else road.FULL), road.WIDER
    speeds = [0.3, 3.0, 30.0] if quick else [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0]
    rubber = road.compound(0.1)
    # At high speed the block must be accelerated, so that the drive travels farther until the speed
    # is steady.
    cases = [road.case(
        cells, road.waves(short), speed=speed, rubber=rubber, shear_steps=20 if quick else 40,
        distance=(1.0 if quick else 1.25 if speed < 5.0 else 2.0) * road.LONG)
        for speed in speeds]
    found = [road.measures(case) for case in road.histories(folder, cases)]
    data = {name: np.array([case[name] for case in found]) for name in found[0]}
    data["driven"] = np.array(speeds)
    frequency = np.geomspace(1e1, 1e7, 200)
    data["frequency"] = frequency
    data["storage"], data["loss"] = (getattr(rubber.complex_modulus(2.0 * np.pi * frequency), part)
                                     for part in ("real", "imag"))
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check that the maximum grows with the speed, and the trend of the plateau."""
    # "mu_max keeps increasing with speed just as G' does with the frequency."
    assert (np.diff(data["maximum"]) > 0.0).all(), "the maximum does not grow with speed"
    assert (data["maximum"] - data["plateau"] > 2e-3).all()
    # The plateau rises at least up to 30 m/s. Above, it becomes flat or falls.
    slow = data["driven"] <= 30.0
    assert (np.diff(data["plateau"][slow]) > 0.0).all(), "the plateau does not rise"
    # The rubber stiffens: the contact area is smaller and the gap larger, and both differ more from
    # those before motion.
    assert (np.diff(data["area"]) < 0.0).all()
    assert (np.diff(data["gap"]) > 0.0).all()
    # The state before the motion is the same for all speeds.
    assert np.ptp(data["area_loaded"]) < 1e-6
    road.check_slope(data)
    if not quick:
        # From 10 m/s on the plateau changes by less than from 1 to 10 m/s.
        fast, middle, slow = (data["plateau"][data["driven"] == v][0] for v in (100.0, 10.0, 1.0))
        assert abs(fast - middle) < 0.7 * (middle - slow)


def picture(data: dict[str, Any]) -> Figure:
    """Draw maximum, plateau and their causes over the speed, beside area and modulus."""
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    speed = data["driven"]
    left.semilogx(speed, data["maximum"], "s-", color=road.RED, label="maximum")
    left.semilogx(speed, data["plateau"], "o-", color=road.BLUE, label="plateau")
    left.semilogx(speed, 1.0 + data["viscous"], "^:", color=road.GREEN,
                  label="1 + viscous part of the plateau")
    left.set(xlabel="speed of the drive (m/s)", ylabel="friction coefficient")
    right.semilogx(speed, data["area"], "o-", color="black", label="contact area in the plateau")
    right.axhline(data["area_loaded"][0], color="grey", linestyle="--",
                  label="contact area before motion")
    loss = data["loss"] / data["storage"]
    right.semilogx(data["frequency"] * road.WIDER, loss, color=road.PURPLE,
                   label="loss factor at speed/short wave")
    right.semilogx(data["frequency"] * road.LONG, loss, color=road.PURPLE, linestyle="-.",
                   label="loss factor at speed/long wave")
    right.set(xlabel="speed of the drive (m/s)", ylabel="area fraction, loss factor",
              xlim=(speed[0] / 1.5, speed[-1] * 1.5), ylim=(0.0, None))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    return figure
