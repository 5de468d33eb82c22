"""Fast road: friction at 30 m/s beside that at 1 m/s (thesis, figures 4.8 and 4.9)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import two_scale as road
from matplotlib.figure import Figure

#: Minutes of the full form on two cores.
MINUTES = 0.5
SLOW, FAST = 1.0, 30.0
PERIODS = 2


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run both speeds, and compute the moduli of the rubber."""
    cells, short = (road.QUICK if quick else road.FULL), road.WIDER
    data: dict[str, Any] = {"short": short}
    cases = [road.case(cells, road.waves(short), speed=speed, distance=periods * road.LONG,
                       shear_steps=20)
             for speed, periods in ((SLOW, 1.0 if quick else 2.0), (FAST, PERIODS + 0.7))]
    data["slow"], data["fast"] = road.histories(folder, cases)
    data["found"] = {name: road.measures(data[name]) for name in ("slow", "fast")}
    data["wavelength"], data["amplitude"] = road.oscillation(data["fast"], PERIODS)
    data["frequency"] = np.geomspace(1e2, 1e8, 200)
    data["modulus"] = road.compound().complex_modulus(2.0 * np.pi * data["frequency"])
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check that speed raises friction, and that both waves of the road show in it."""
    slow, fast = data["found"]["slow"], data["found"]["fast"]
    # Both friction maxima rise, and so does the loss factor at the two frequencies of the road.
    assert fast["maximum"] > slow["maximum"] + 0.015
    assert fast["plateau"] > slow["plateau"] + 0.01
    assert fast["viscous"] > 1.3 * slow["viscous"]
    assert fast["area"] < 0.6 * slow["area"]
    for found in (slow, fast):
        road.check_slope(found)
    # The stiffer block slips after a shorter travel of the drive. It is the travel that shears a
    # sticking block up to the friction, 0.1 mm instead of 0.28 mm. The travel differs a little
    # because the edges of the contacts slip earlier, and a few cells (less than a hundredth of the
    # grid) later.
    travel = [data[name]["road_x"][(data[name]["stick_area"] < 1e-2)
                                   & (data[name]["road_x"] > 0.0)][0] for name in ("slow", "fast")]
    for way, speed, found in zip(travel, (SLOW, FAST), (slow, fast), strict=True):
        known = road.drive_to_slip(found["plateau"] * road.PRESSURE, speed)
        assert abs(way / known - 1.0) < 0.1, f"{speed} m/s: slips after {way}, plain shear {known}"
    # The road repeats after the long wave. The components with a whole number of periods in it
    # therefore contain most of the oscillation, and the short wave is larger than its neighbours.
    amplitude = data["amplitude"]
    order = np.arange(1, amplitude.size + 1)
    whole = order % PERIODS == 0
    assert (amplitude[whole] ** 2).sum() > 3.0 * (amplitude[~whole & (order > PERIODS)] ** 2).sum()
    wave = round(PERIODS * road.LONG / data["short"])
    near = np.r_[wave - 3:wave, wave + 1:wave + 4] - 1
    assert amplitude[wave - 1] > 1.5 * amplitude[near].mean()
    assert amplitude[[PERIODS - 1, 2 * PERIODS - 1]].max() > 3e-3


def picture(data: dict[str, Any]) -> Figure:
    """Draw friction over the sliding distance, its spectrum, and the moduli of the rubber."""
    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    (drive, way), (spectrum, moduli) = figure.subplots(2, 2)
    for name, speed, colour in (("slow", SLOW, road.BLUE), ("fast", FAST, road.RED)):
        case = data[name]
        drive.plot(1e6 * case["road_x"], case["friction"], color=colour, label=f"{speed:g} m/s")
        way.plot(1e6 * case["slid"], case["friction"], color=colour, label=f"{speed:g} m/s")
    drive.set(xlabel="travel of the drive (µm)", ylabel="friction coefficient", ylim=(0.0, None),
              xlim=(0.0, None))
    way.set(xlabel="way that the interface slid (µm)", ylabel="friction coefficient",
            xlim=(0.0, None), ylim=(1.0, 1.1))
    drive.legend(loc="lower right")
    spectrum.loglog(1e6 * data["wavelength"], data["amplitude"], ".-", color=road.RED)
    for length, label in ((road.LONG, "long wave"), (data["short"], "short wave")):
        spectrum.axvline(1e6 * length, color="grey", linestyle="--")
        spectrum.text(1e6 * length, 0.03, f"{label} ", rotation=90, va="bottom", ha="right",
                      transform=spectrum.get_xaxis_transform())
    spectrum.set(xlabel="wavelength over the way slid (µm)", ylabel="amplitude of friction",
                 xlim=(4.0, None), ylim=(1e-5, None), title="30 m/s: what friction oscillates with")
    moduli.loglog(data["frequency"], data["modulus"].real / 1e6, color="black", label="G' (MPa)")
    moduli.loglog(data["frequency"], data["modulus"].imag / 1e6, color=road.GREEN,
                  linestyle="--", label="G'' (MPa)")
    moduli.loglog(data["frequency"], data["modulus"].imag / data["modulus"].real,
                  color=road.PURPLE, linestyle="-.", label="loss factor (-)")
    for value in (1.0 / road.LOADING, FAST / road.LONG, FAST / data["short"]):
        moduli.axvline(value, color="grey", linestyle="--")
    moduli.set(xlabel="frequency (Hz)",
               title="The rubber; bars: 1/loading time, 30 m/s over the waves")
    moduli.legend()
    for axes in (drive, way, spectrum, moduli):
        axes.grid(alpha=0.3)
    return figure
