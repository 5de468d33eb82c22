"""A sphere slides on a viscoelastic solid: pressure, and friction over the speed.

The study computes the case of the thesis's figures 2.6 and 2.7, beside the two limits of the
friction in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np
from viscoelastic_sphere import CREEP, FORCE, RADIUS, RATIO, WIDTH, base

import asperity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 3

MEAN = FORCE / (np.pi * WIDTH**2)
PROFILES = (0.4, 0.8, 1.2)


def slide(folder: Path, speeds: Sequence[float], cells: float, travel: float) -> asperity.Sweep:
    """Slide at speeds V*; the road moves by `travel` a* in each run."""
    case = base(cells, travel)
    steps = case.phase[1].steps
    velocities = [speed * WIDTH / CREEP for speed in speeds]
    return asperity.sweep(
        case, {("phase[2].velocity_x", "phase[2].duration"):
               [(v, steps * WIDTH / cells / v) for v in velocities]},
        folder=folder, jobs=common.jobs, measure=lambda run: {}, quiet=True)


def slow(speed: Any) -> Any:
    """Return the friction at low speed: a relaxed contact loses (1 - G_e/G(0)) tau' V/R."""
    return RATIO / (1 + RATIO) * np.asarray(speed) * WIDTH / RADIUS


def fast(speed: Any) -> Any:
    """Return the friction at high speed.

    The damper flows under the pressure of the glassy contact: mu V F = G0/eta p.A p with
    p.A p = 4/5 F delta of Hertz.
    """
    return 0.8 * RATIO * WIDTH / RADIUS / np.asarray(speed)


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Slide at all speeds."""
    speeds = (0.1, 0.8, 3.0, 30.0) if quick else (
        0.03, 0.1, 0.2, 0.4, 0.8, 1.2, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0)
    data: dict[str, Any] = {"speed": np.array(speeds), "friction": [], "area": [], "drift": [],
                            "lost": [], "profiles": []}
    cells = 4 if quick else 12
    bell = slide(folder / "bell", speeds, cells, 8 if quick else 14)
    for run in bell.runs:
        friction = np.array(run.history["friction"])
        last = 2 * cells                                     # the last 2 a* of the travel
        data["friction"].append(float(friction[-last:].mean()))
        data["drift"].append(float(np.ptp(friction[-last:]) / friction[-last:].mean()))
        area = np.array(run.history["contact_area"]) * run.grid.lx * run.grid.ly
        data["area"].append(float(area[-1]) / (np.pi * WIDTH**2))
        # The work of the drive is lost in the solid.
        road, lost = np.array(run.history["road_x"]), np.array(run.history["dissipated_viscous"])
        data["lost"].append(float(lost[-1] - lost[-1 - last])
                            / (FORCE * float(road[-1] - road[-1 - last])))
    chosen = PROFILES[1:2] if quick else PROFILES
    fine = slide(folder / "profiles", chosen, 8 if quick else 32, 3 if quick else 7)
    for speed, run in zip(chosen, fine.runs, strict=True):
        pressure = run.snapshots[-1].pressure
        row = run.grid.ny // 2
        summit = run.grid.x[run.height[row].argmax()] + run.history["road_x"][-1]
        data["profiles"].append({
            "speed": speed, "x": (run.grid.x - summit) / WIDTH, "pressure": pressure[row] / MEAN,
            "friction": float(run.history["friction"][-1])})
        inside = pressure[row] > 0
        x = data["profiles"][-1]["x"]
        data["profiles"][-1] |= {"front": x[inside].max(), "back": x[inside].min(),
                                 "spike": (pressure[row] / MEAN)[x > 1.0].max()}
    for name in ("friction", "area", "drift", "lost"):
        data[name] = np.array(data[name])
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the limits, the maximum, the energy and the shape of the profiles."""
    speed, friction = data["speed"], data["friction"]
    top = int(friction.argmax())
    assert 0 < top < speed.size - 1, "no bell"
    rise = np.diff(friction)
    assert (rise[:top] > 0).all() and (rise[top:] < 0).all(), f"not one maximum: {friction}"
    assert 1 < speed[top] < 8, f"maximum at V* = {speed[top]}"
    # The limits bound the curve, which approaches them to the next order in V*.
    assert (friction < 1.03 * np.minimum(slow(speed), fast(speed))).all(), "above a limit"
    near = friction[0] / slow(speed[0])
    assert abs(near - 1) < (0.05 if quick else 0.03), f"slow limit: {near:.3f}"
    near = friction[-1] / fast(speed[-1])
    assert abs(near - 1) < (0.2 if quick else 0.1), f"fast limit: {near:.3f}"
    # The contact shrinks from the relaxed one, which is 10^(2/3) times the glassy one, to the
    # glassy one.
    assert (np.diff(data["area"]) < 0).all(), f"areas {data['area']}"
    assert data["area"][0] < 1.1 * 10 ** (2 / 3) and data["area"][-1] > 0.95
    assert (data["drift"] < 0.05).all(), f"not steady: {data['drift']}"
    # In steady state the force that is lost in the solid is the friction. What still changes is
    # stored.
    assert np.allclose(data["lost"], friction, rtol=0.1 if quick else 0.05), "energy"
    for profile in data["profiles"]:
        x, p = profile["x"], profile["pressure"]
        inside = x[p > 0]
        # The road moves to +x: the leading edge is ahead of the summit, and has the higher
        # pressure.
        assert inside.max() > -inside.min(), "the contact is not shifted to the front"
        assert float((p * x).sum()) > 0, "the pressure is not higher in front"


def picture(data: dict[str, Any]) -> Figure:
    """Draw the profiles, and the friction over the speed."""
    figure, (left, right) = common.subplots(2)
    for profile, colour in zip(data["profiles"], common.COLOURS, strict=False):
        left.plot(profile["x"], profile["pressure"], color=colour, label=f"V* = {profile['speed']}")
    r = np.linspace(-1, 1, 201)
    left.plot(r, 1.5 * np.sqrt(1 - r * r), "k:", label="Hertz, glassy")
    left.set(xlabel="x/a*, the summit at 0, sliding to the right", ylabel="pressure/p$_0$",
             xlim=(-2.4, 2.4), ylim=(0, None))
    left.legend(fontsize="small")
    fine = np.geomspace(data["speed"][0], data["speed"][-1], 50)
    right.loglog(data["speed"], data["friction"], "o-", color=common.COLOURS[0], label="Asperity")
    right.loglog(fine, slow(fine), "k--", lw=1, label="slow limit")
    right.loglog(fine, fast(fine), "k:", lw=1, label="fast limit")
    right.set(xlabel="V* = V τ′/a*", ylabel="friction coefficient",
              ylim=(data["friction"].min() / 2, 3 * data["friction"].max()))
    right.legend(fontsize="small")
    return figure
