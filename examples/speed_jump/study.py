"""Speed jump: friction of a tyre rubber whose sliding speed increases a hundredfold.

The case is input.nml, beside Persson's theory.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity
from asperity.theory import persson, self_affine_psd

MINUTES = 1.0

HERE = Path(__file__).parent
GAMMA = 0.45  # Persson's correction for partial contact, as the thesis takes it


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return area and friction at both speeds, computed and by the theory, and the history."""
    case = asperity.Case.read(HERE / "input.nml")
    if quick:
        case = common.shortened(case)
    run = common.run(case, folder / "result.h5")
    history = {name: np.array(run.history[name]) for name in
               ("time", "phase", "contact_area", "friction", "mean_gap", "pressure",
                "dissipated_viscous")}
    area, friction = history["contact_area"], history["friction"]
    slow, fast = (np.flatnonzero(history["phase"] == phase) for phase in (2, 3))
    slow, steady = (slow[-4:], fast[-8:]) if quick else (slow[-30:], fast[-64:])
    surface = case.surface[0]
    spectrum = self_affine_psd(surface.hurst, surface.wavelength_long, surface.wavelength_long,
                               surface.wavelength_short, rms_slope=surface.rms_slope)
    data = {"result": str(run.path), "history": history, "area_at_rest": area[0],
            "friction_peak": friction[fast].max(),
            "end": history["time"][-1], "rows_to_peak": int(friction[fast].argmax()) + 1}
    for name, rows, speed in (("slow", slow, 0.01), ("fast", steady, 1.0)):
        data[name] = {"area": area[rows].mean(), "friction": friction[rows].mean()}
        for gamma in (1.0, GAMMA):
            contact = persson(*spectrum, common.compound(), case.phase[0].pressure, speed,
                              gamma=gamma)
            data[name] |= {f"area_persson_{gamma:g}": float(contact.contact_area),
                           f"friction_persson_{gamma:g}": float(contact.friction)}
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the jump against the predictions of Persson's theory."""
    history, slow, fast = data["history"], data["slow"], data["fast"]
    # Friction rises steeply within a few cells of sliding, then decays.
    assert data["rows_to_peak"] <= 4
    assert data["friction_peak"] > 1.15 * fast["friction"]
    assert fast["friction"] > 3 * slow["friction"] > 0
    # The contact area falls when sliding begins and again at the jump, because the rubber rises.
    assert data["area_at_rest"] > slow["area"] > 1.5 * fast["area"]
    gap = {phase: history["mean_gap"][history["phase"] == phase][-1] for phase in (2, 3)}
    assert gap[3] > gap[2]
    # The pressure is prescribed, and the lost energy grows with every step of sliding.
    assert np.ptp(history["pressure"]) < 1e-4 * history["pressure"][0]
    assert (np.diff(history["dissipated_viscous"][1:]) > 0).all()
    if quick:
        return
    # Persson's area is 10 to 15 % too low, as in the thesis. The friction of his theory with and
    # without the correction is above and below the computed one.
    for name in ("slow", "fast"):
        one = data[name]
        assert 0.8 < one["area_persson_1"] / one["area"] < 1.0, name
        assert one["friction_persson_0.45"] < one["friction"] < one["friction_persson_1"], name


def picture(data: dict[str, Any]) -> Any:
    """Draw the overview of the result."""
    figure = asperity.open(data["result"]).overview()
    figure.set_size_inches(11.5, 4.0)
    return figure
