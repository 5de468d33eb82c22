"""Constant contact area: a controller sets the load of a rubber on a rough road.

`asperity.Simulation` computes one row; the controller reads its contact area and sets the pressure
of the next row.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity
from asperity.material import Prony

MINUTES = 0.5

RUBBER = Prony(1e6, [2e6, 1e6], [1e-3, 10e-3])
COLUMNS = ("time", "phase", "pressure", "contact_area", "displacement", "friction")


def rubber_on_road(quick: bool) -> asperity.Case:
    """Return the case: the rubber is pressed on the road, rests, and then slides."""
    cells = 48 if quick else 128
    few = 2 if quick else 1
    return asperity.Case(
        title="Constant contact area",
        grid=dict(nx=cells, ny=cells, lx=1e-3),
        surface=dict(shape="self_affine", hurst=0.8, wavelength_long=0.25e-3,
                     wavelength_short=8e-3 / cells, rms_slope=0.2, seed=2),
        material=common.material_group(RUBBER),
        phase=[dict(name="early rest", pressure=0.2e6, duration=2e-3, steps=80 // few),
               dict(name="rest", duration=18e-3, steps=90 // few),
               dict(name="slide", duration=20e-3, steps=100 // few, velocity_x=0.02)],
        solver=dict(threads=common.jobs),
        output=dict(snapshot_every=9 if quick else 3))


def drive(case: asperity.Case) -> dict[str, Any]:
    """Return the history of a simulation in which the load holds the contact area of the start."""
    sim = asperity.Simulation(case)
    rows = [sim.advance()]
    wanted = rows[0].contact_area
    while not sim.finished:
        # The area is nearly proportional to the pressure.
        sim.pressure = rows[-1].pressure * wanted / rows[-1].contact_area
        rows.append(sim.advance())
    return {name: np.array([row[name] for row in rows]) for name in COLUMNS}


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return the histories with a constant area and with a constant load, and their end values."""
    case = rubber_on_road(quick)
    with common.expected(common.LONG_WAYS):
        area = drive(case)
        run = common.run(case, folder / "constant_load.h5")
    load = {name: np.array(run.history[name]) for name in COLUMNS}
    rest = area["phase"] < 3
    settled = slice(-(10 if quick else 40), None)
    relaxed = RUBBER.relaxation_modulus(area["time"][rest]) / RUBBER.relaxation_modulus(0.0)
    found = area["pressure"][rest] / area["pressure"][0]
    return {
        "result": str(run.path), "constant_area": area, "constant_load": load,
        "exact": area["pressure"][0] * relaxed, "wanted": area["contact_area"][0],
        "area_error_rest": np.abs(area["contact_area"][rest] / area["contact_area"][0] - 1).max(),
        "approach_change": np.ptp(area["displacement"][rest]) / area["displacement"][0],
        "load_after_rest": found[-1], "exact_after_rest": relaxed[-1],
        "load_error_late": np.abs(found / relaxed - 1)[area["time"][rest] > 5e-3].max(),
        "area_after_rest": load["contact_area"][load["phase"] < 3][-1],
        "least_area_sliding": area["contact_area"][~rest].min() / area["contact_area"][0],
        "slide": {name: {column: one[column][settled].mean()
                         for column in ("pressure", "contact_area", "friction")}
                  for name, one in (("constant_area", area), ("constant_load", load))},
    }


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the load against the relaxation function, and the area against the wanted one."""
    assert data["area_error_rest"] < (0.1 if quick else 0.03)
    assert data["approach_change"] < (0.03 if quick else 0.01)
    assert abs(data["load_after_rest"] / data["exact_after_rest"] - 1) < 0.01
    # The controller is one row late, and the rows of the quick form are twice as long.
    assert data["load_error_late"] < (0.05 if quick else 0.015)
    assert data["area_after_rest"] > 2 * data["wanted"]
    slide = data["slide"]
    assert abs(slide["constant_area"]["contact_area"] / data["wanted"] - 1) < 0.02
    assert slide["constant_area"]["pressure"] > 1.5 * data["load_after_rest"] * \
        data["constant_area"]["pressure"][0]


def picture(data: dict[str, Any]) -> Any:
    """Draw load, area, approach and friction of both cases over time."""
    figure, axes = common.subplots(2, 2, width=4.4, height=2.7, sharex=True)
    area, load = data["constant_area"], data["constant_load"]
    for panel, column, factor, label in (
            (axes[0, 0], "pressure", 1e-3, "pressure (kPa)"),
            (axes[0, 1], "contact_area", 1.0, "contact area fraction"),
            (axes[1, 0], "displacement", 1e6, "approach (µm)"),
            (axes[1, 1], "friction", 1.0, "friction coefficient")):
        panel.plot(1e3 * load["time"], factor * load[column], color=common.COLOURS[1],
                   label="constant load")
        panel.plot(1e3 * area["time"], factor * area[column], color=common.COLOURS[0],
                   label="constant area")
        panel.set_ylabel(label)
        panel.axvline(1e3 * area["time"][area["phase"] < 3][-1], color="0.6", linewidth=0.8)
        panel.set_ylim(bottom=0)
    axes[0, 0].plot(1e3 * area["time"][area["phase"] < 3], 1e-3 * data["exact"], "--",
                    color=common.COLOURS[6], label="relaxation function")
    for panel in axes[1]:
        panel.set_xlabel("time (ms)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False)
    figure.text(0.01, 0.01, "grey line: the road starts to slide", fontsize="small", color="0.4")
    return figure
