"""Friction over temperature, scale of the road and thickness of the block.

A pressed block is set in motion on a wavy road of two scales. A change of temperature is equivalent
to a change of all times, and a smaller road under a thinner block to a higher speed. Both hold
exactly.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np
from common import COLOURS
from sbr_road import WLF_SBR, sweep

import asperity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 1

WAVE, PRESSURE, SPEED, LOADING = 500e-6, 0.4e6, 1.0, 1e-3    # m, Pa, m/s, s
THICKNESS, TRAVEL = 1e-3, 1e-3                               # m, of the default case
TEMPERATURES = (-10.0, 0.0, 10.0, 25.0, 40.0, 60.0, 80.0)    # C
SCALES = (1 / 16, 1 / 4, 1.0, 4.0, 16.0)
THICKNESSES = (0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3)
#: Two equivalent problems differ by rounding, and one of them may need one more pass to reach the
#: tolerance of a step. They then differ by as much as the tolerance, which is therefore ten times
#: smaller than the difference that the study allows.
TOLERANCE, ALLOWED = 1e-7, 1e-6
#: Mass that prevents numerical stick-slip of a thick block.
HEAVY: dict[str, Any] = dict(density=100.0, passes=0)

#: Values that define a case.
Values = tuple[float, ...]
NAMES = ("grid.lx", "grid.ly", "surface[1].wavelength", "surface[1].amplitude",
         "surface[2].wavelength", "surface[2].amplitude", "material.thickness",
         "material.density", "material.temperature", "phase[1].duration", "phase[2].velocity_x",
         "phase[2].duration", "solver.passes")


def _values(cells: int, *, temperature: float = 25.0, speed: float = SPEED,
            loading: float = LOADING, scale: float = 1.0, thickness: float = THICKNESS,
            travel: float = TRAVEL, density: float = 0.0, passes: int = 0) -> Values:
    """Return the values of NAMES; road, block and travel are multiplied by `scale`."""
    wave, second = WAVE * scale, WAVE * scale * 16 / cells    # 16 cells in the second wave
    return (wave, wave / math.sqrt(3), wave, wave / 50, second, second / 50, thickness * scale,
            density, temperature, loading, speed, travel * scale / speed, passes)


def _runs(folder: Path, cells: int, cases: list[dict[str, float]]) -> list[dict[str, Any]]:
    """Return the friction over the travel of the drive (at scale 1), its maximum and last value."""
    wave = dict(shape="hexagonal_wave", wavelength=1.0, amplitude=1.0)
    case = asperity.Case(
        grid=dict(nx=cells, ny=-(-cells * 37 // 64), lx=1.0, ly=1.0), surface=[wave, wave],
        material=common.material_group(thickness=1.0, density=0.0, temperature=25.0,
                                       reference_temperature=WLF_SBR.t_ref, wlf_c1=WLF_SBR.c1,
                                       wlf_c2=WLF_SBR.c2),
        friction=dict(law="coulomb", coefficient=1.0),
        phase=[dict(pressure=PRESSURE, duration=1.0, steps=20),
               dict(velocity_x=1.0, duration=1.0)],
        solver=dict(tolerance=TOLERANCE, threads=1), output=dict(snapshot_every=0))
    table = sweep(case, {NAMES: [_values(cells, **one) for one in cases]}, folder)
    found = []
    for run, one in zip(table.runs, cases, strict=True):
        history = run.history
        sliding = history["phase"] == 2
        friction = history["friction"][sliding]
        top = int(friction.argmax())
        # the last period, or the part after the maximum if it is shorter
        late = max(top, friction.size - cells)
        found.append({
            "friction": friction, "area": history["contact_area"][sliding],
            "travel": history["road_x"][sliding] / one.get("scale", 1.0),
            "max": float(friction[top]), "dyn": float(friction[late:].mean()),
            "slips": float(history["stick_area"][sliding][-1]) == 0.0})
    return found


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the cases; each temperature and scale is also run as a change of times alone."""
    cells = 32 if quick else 64
    temperatures = (0.0, 60.0) if quick else TEMPERATURES
    scales = (1 / 4,) if quick else SCALES
    thicknesses = (0.25e-3, 1e-3) if quick else THICKNESSES
    shift = [float(WLF_SBR.shift_factor(t)) for t in temperatures]
    cases = {
        "temperature": [dict(temperature=t) for t in temperatures],
        "shifted": [dict(speed=SPEED * a, loading=LOADING / a) for a in shift],
        "scale": [dict(scale=s) for s in scales],
        "faster": [dict(speed=SPEED / s) for s in scales],
        # A larger mass: with the 20 kg/m3 of the thesis a block of 4 mm sticks and slips
        # numerically at steps of one cell, with any number of passes.
        "same_block": [dict(scale=0.25, thickness=4 * THICKNESS, travel=2 * TRAVEL, **HEAVY)],
        "thickness": [dict(thickness=h, travel=0.6e-3 + 0.4 * h, **HEAVY) for h in thicknesses]}
    data: dict[str, Any] = {
        "temperatures": np.array(temperatures), "scales": np.array(scales),
        "thicknesses": np.array(thicknesses), "shift": np.array(shift)}
    data |= {name: _runs(folder / name, cells, some) for name, some in cases.items()}
    for kind, other in (("temperature", "shifted"), ("scale", "faster")):
        data[f"{kind}_differs"] = [_change(*pair)
                                   for pair in zip(data[kind], data[other], strict=True)]
    return data


def _change(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Return the largest difference of friction and contact area at any time."""
    return max(float(np.abs(one[name] - other[name]).max()) for name in ("friction", "area"))


def check(data: dict[str, Any], quick: bool) -> None:
    """Check each temperature and scale against the equivalent change of times."""
    # The numbers are the same up to rounding and its effect on the iterations: see TOLERANCE. The
    # numbers of cells in contact must be equal.
    differs = max(*data["temperature_differs"], *data["scale_differs"])
    assert differs < ALLOWED, f"equal problems differ by {differs:.2e}"
    # Powers of two change exponents only, so that there is no rounding.
    assert max(data["scale_differs"]) == 0.0, f"scales differ: {data['scale_differs']}"
    # A higher temperature and a larger scale correspond to a lower speed, which reduces the
    # friction below its maximum.
    for kind, least in (("temperature", 0.0), ("scale", 0.25)):
        steady = np.array([item["dyn"] for item in data[kind]])[data[f"{kind}s"] >= least]
        assert (np.diff(steady) < 0).all(), f"{kind}: steady friction does not fall, {steady}"
    # A thicker block only takes longer to shear.
    steady = np.array([item["dyn"] for item in data["thickness"]])
    allowed = 0.005 if quick else 0.001
    assert np.ptp(steady) < allowed, f"steady friction changes with thickness: {steady}"
    top = [item["travel"][item["friction"].argmax()] for item in data["thickness"]]
    assert top[-1] > 1.5 * top[0], "a thicker block does not shear longer"
    small = data["scale"][int(np.argmin(np.abs(data["scales"] - 0.25)))]
    change = abs(data["same_block"][0]["dyn"] - small["dyn"])
    assert change < (0.005 if quick else 2e-4), f"the thickness matters: {change}"
    for item in data["temperature"] + data["scale"] + data["thickness"]:
        assert item["slips"], "a case still sticks at its end"
        assert item["dyn"] > 1.0, "friction is not above Coulomb's"


def picture(data: dict[str, Any]) -> Figure:
    """Draw friction over travel, temperature, scale and thickness."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 2, figsize=(11, 7.6), layout="constrained")
    panel = axes[0, 0]
    picked = range(0, len(data["temperature"]), 2)
    for number, case in enumerate(picked):
        item = data["temperature"][case]
        panel.plot(item["travel"] * 1e3, item["friction"], color=COLOURS[number],
                   ls=("-", "--", "-.", (0, (1, 1)))[number],
                   label=f"{data['temperatures'][case]:g} °C")
    panel.set(xlabel="travel of the drive, mm", ylabel="friction coefficient", ylim=(0.8, None),
              title="block set in motion at 1 m/s")
    panel.legend(fontsize="small")

    def both(panel: Any, x: np.ndarray, cases: list[dict[str, Any]], **style: Any) -> None:
        label = style.pop("label")
        panel.plot(x, [item["max"] for item in cases], color=COLOURS[1],
                   label=f"largest, {label}", **style)
        panel.plot(x, [item["dyn"] for item in cases], color=COLOURS[0],
                   label=f"steady, {label}", **style)

    both(axes[0, 1], data["temperatures"], data["temperature"], marker="o", ls="-",
         label="at this temperature")
    both(axes[0, 1], data["temperatures"], data["shifted"], marker="x", ls="", ms=10,
         label="25 °C, times over $a_T$")
    axes[0, 1].set(xlabel="temperature, °C", ylabel="friction coefficient")
    both(axes[1, 0], data["scales"], data["scale"], marker="o", ls="-", label="this scale")
    both(axes[1, 0], data["scales"], data["faster"], marker="x", ls="", ms=10,
         label="scale 1, speed over scale")
    axes[1, 0].plot(0.25, data["same_block"][0]["max"], "s", ms=11, mfc="none", color=COLOURS[1])
    axes[1, 0].plot(0.25, data["same_block"][0]["dyn"], "s", ms=11, mfc="none", color=COLOURS[0],
                    label="the block not scaled")
    axes[1, 0].set(xscale="log", xlabel="scale of road and block", ylabel="friction coefficient")
    both(axes[1, 1], data["thicknesses"] * 1e3, data["thickness"], marker="o", ls="-",
         label="25 °C, 1 m/s")
    axes[1, 1].set_xscale("log", base=2)
    axes[1, 1].set_xticks(data["thicknesses"] * 1e3,
                          [f"{h * 1e3:g}" for h in data["thicknesses"]])
    axes[1, 1].set(xlabel="thickness of the block, mm", ylabel="friction coefficient")
    for panel in axes.flat[1:]:
        panel.legend(fontsize="small")
        panel.set_ylim(1.0, 1.23)
    for panel in axes.flat:
        panel.grid(alpha=0.3)
    return figure
