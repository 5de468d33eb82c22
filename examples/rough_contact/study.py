"""Rough contact: the growth of the real contact area.

The case is input.nml, beside the theories of Persson and of Bush, Gibson and Thomas.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity
from asperity.theory import bush_gibson_thomas, persson_area

MINUTES = 0.3

HERE = Path(__file__).parent


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return loads (Pa), areas, areas of the theories, and the last pressure (Pa) and gap (m)."""
    case = asperity.Case.read(HERE / "input.nml")
    if quick:  # first the same waves with fewer cells each, then fewer waves
        case = common.shortened(case, cells=256)
    run = common.run(case, folder / "result.h5")
    modulus, slope = 4 * case.material.shear_modulus, case.surface[0].rms_slope
    load, area = np.array(run.history["pressure"]), np.array(run.history["contact_area"])
    return {"load": load, "area": area, "modulus": modulus, "rms_slope": slope,
            "persson": persson_area(load, modulus, slope),
            "bush_gibson_thomas": bush_gibson_thomas(load, modulus, slope),
            "residual": run.history["residual_normal"].max(),
            "pressure": run.snapshots[-1].pressure, "lx": run.grid.lx, "ly": run.grid.ly}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check that the area lies between the theories and grows more slowly than the load."""
    load, area = data["load"], data["area"]
    assert data["residual"] < 1e-6
    assert (np.diff(area) > 0).all()
    assert (np.diff(area / load)[-3:] < 0).all(), "the area must grow slower than the load"
    assert (area > data["persson"]).all() and (area < data["bush_gibson_thomas"]).all()
    np.testing.assert_allclose(data["pressure"].mean(), load[-1], rtol=1e-6)
    assert data["pressure"].min() >= 0


def picture(data: dict[str, Any]) -> Any:
    """Draw the pressure, the area over the load, and the ratio of both."""
    figure, (left, middle, right) = common.subplots(3, width=4.3, height=3.8)
    image = left.imshow(data["pressure"] / 1e6, origin="lower", cmap="viridis", vmin=0,
                        vmax=np.quantile(data["pressure"], 0.999) / 1e6,
                        extent=(0, data["lx"] * 1e3, 0, data["ly"] * 1e3))
    left.grid(visible=False)
    left.set(title=f"pressure at {data['load'][-1] / 1e6:g} MPa", xlabel="x, mm", ylabel="y, mm")
    figure.colorbar(image, label="MPa")
    scaled = data["load"] / data["modulus"] / data["rms_slope"]
    fine = np.linspace(scaled[0], scaled[-1], 100)
    stress = fine * data["modulus"] * data["rms_slope"]
    for axes, divided in ((middle, False), (right, True)):
        axes.plot(scaled, data["area"] / (scaled if divided else 1), "o", label="Asperity")
        for theory, label, style in ((persson_area, "Persson", "-"),
                                     (bush_gibson_thomas, "Bush, Gibson, Thomas", "--")):
            values = theory(stress, data["modulus"], data["rms_slope"])
            axes.plot(fine, values / (fine if divided else 1), style, label=label)
        axes.set(xlabel="load p/(E* h'rms)", xlim=(0, None))
    middle.legend()
    middle.set(ylabel="contact area, fraction", ylim=(0, None))
    right.set(ylabel="area over load, A E* h'rms/(A0 p)")
    return figure
