"""Adhesive rough contact under a load that rises and falls.

The case is input.nml. It is compared with the same map without adhesion.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity

MINUTES = 1.0

HERE = Path(__file__).parent
MODULUS = 25e6  # Pa, E*


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return loads (Pa), areas, gaps (m) with and without adhesion, and the last pressure (Pa)."""
    case = asperity.Case.read(HERE / "input.nml")
    if quick:  # a part of the area with cells of the same size, and every second load
        case.grid.update(nx=96, ny=96, lx=144e-9)
        case.surface[0].wavelength_long = 72e-9
        case.phase = case.phase[1::2]
    run = common.run(case, folder / "result.h5")
    load, area, gap = (np.array(run.history[name]) for name in
                       ("pressure", "contact_area", "mean_gap"))
    contact, bare_area, bare_gap = None, [], []
    for value in load[:load.argmax() + 1]:
        contact = asperity.solve_normal(run.height, run.grid.lx, run.grid.ly, MODULUS,
                                        pressure=value, start=contact)
        bare_area.append(contact.contact_area)
        bare_gap.append(contact.gap.mean())
    return {"load": load, "area": area, "gap": gap, "bare_area": np.array(bare_area),
            "bare_gap": np.array(bare_gap), "pressure": run.snapshots[-1].pressure,
            "slope": float(asperity.surface.statistics(run.height, run.grid.lx,
                                                       run.grid.ly).rms_slope),
            "strongest": case.adhesion.energy / case.adhesion.range,
            "lx": run.grid.lx, "ly": run.grid.ly}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check that the loop is monotone, has hysteresis, and exceeds the bare contact."""
    area, gap, load = data["area"], data["gap"], data["load"]
    turn = int(load.argmax())
    np.testing.assert_allclose(load[turn::-1], load[turn:], rtol=1e-9)
    assert (np.diff(area[:turn + 1]) > 0).all() and (np.diff(area[turn:]) < 0).all()
    assert (np.diff(gap[:turn + 1]) < 0).all() and (np.diff(gap[turn:]) > 0).all()
    # Summits that have jumped into contact must be pulled off, so that the contact area is larger
    # on the way back.
    assert (area[turn + 1:] > area[turn - 1::-1]).all()
    assert (gap[turn + 1:] < gap[turn - 1::-1]).all()
    assert (area[:turn + 1] > data["bare_area"]).all()
    assert (gap[:turn + 1] < data["bare_gap"]).all()
    # Without adhesion, the slope of the area at the smallest load lies between that of Persson and
    # that of Bush, Gibson and Thomas. The bounds are wider because there are few summits, and
    # because cells at the edge of the contact count in full.
    slope = data["bare_area"][0] * MODULUS * data["slope"] / load[0]
    assert 0.9 * np.sqrt(8 / np.pi) < slope < 1.3 * np.sqrt(2 * np.pi), f"slope of the area {slope}"
    # After the release the summits are pressed by the attraction around them. The attraction is at
    # most energy/range, and nearly that where a contact is about to open. The sum of both is the
    # load.
    assert -1.0001 < data["pressure"].min() / data["strongest"] < -0.9
    assert abs(data["pressure"].mean() / load[-1] - 1) < 1e-5


def picture(data: dict[str, Any]) -> Any:
    """Draw area and gap over the load, and the pressure after the release."""
    figure, (left, middle, right) = common.subplots(3, width=4.3, height=3.8)
    load, turn = data["load"] / 1e6, int(data["load"].argmax()) + 1
    for axes, name, factor, label in ((left, "area", 1, "contact area, fraction"),
                                      (middle, "gap", 1e9, "mean gap, nm")):
        axes.plot(load[:turn], factor * data[name][:turn], "o-", label="pressed")
        axes.plot(load[turn - 1:], factor * data[name][turn - 1:], "s--", label="released")
        axes.plot(load[:turn], factor * data[f"bare_{name}"], "k:", label="without adhesion")
        axes.set(xscale="log", xlabel="mean pressure, MPa", ylabel=label, ylim=(0, None))
        axes.legend()
    image = right.imshow(data["pressure"] / 1e6, origin="lower", cmap="RdBu_r", vmin=-50, vmax=50,
                         extent=(0, data["lx"] * 1e6, 0, data["ly"] * 1e6))
    right.grid(visible=False)
    right.set(title="pressure after release", xlabel="x, µm", ylabel="y, µm")
    figure.colorbar(image, label="MPa")
    return figure
