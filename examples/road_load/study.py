"""Road load: friction over the load on one and two scales (thesis, figures 4.11 and 4.12)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np
import two_scale as road
from matplotlib.figure import Figure

#: Minutes of the full form on two cores.
MINUTES = 5.0
LOWEST = 4e3


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run each load on the road of both waves and on that of the long wave alone."""
    loads = [LOWEST, 0.1e6, 0.8e6] if quick else [
        LOWEST, 12e3, 40e3, 0.1e6, 0.2e6, 0.4e6, 0.8e6, 1.6e6, 3.2e6]
    cells, short = (road.QUICK if quick else road.FULL), road.WIDER
    data: dict[str, Any] = {"load": np.array(loads)}
    for name, wave in (("two", short), ("one", None)):
        # Contacts are small at low load, so that the grid has twice the cells. At the highest load
        # the contact is nearly full. It would stick and slip from step to step without shorter
        # steps and a larger mass.
        cases = [road.case(
            cells if quick or load > 50e3 else 2 * cells, road.waves(wave), pressure=load,
            distance=(0.6 if quick else 1.25) * road.LONG, shear_steps=10 if quick else 40,
            **({"fine": 0.5, "density": 100.0} if load > 1e6 else {})) for load in loads]
        for case in cases:
            # With the factors 148 = 4 x 37, the transforms of this number of rows would take much
            # longer.
            if case.grid.ny == 148:
                case.grid.ny = 150
        # At the lowest loads few summits touch, in contacts of few cells.
        done = road.histories(folder / name, cases, common.SMALL_CONTACTS)
        data[f"{name}_curve"] = {key: done[0][key] for key in ("slid", "friction")}
        found = [road.measures(case) for case in done]
        data[name] = {key: np.array([case[key] for case in found]) for key in found[0]}
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the statements of the thesis on the load."""
    two, one = data["two"], data["one"]
    for found, scales in ((two, 2), (one, 1)):
        # "Steady-state friction first increases along with the normal load", "goes through a
        # maximum before decreasing", and the mean gap tends to zero.
        top = int(found["plateau"].argmax())
        assert 0 < top < len(found["plateau"]) - 1, "no maximum against the load"
        assert (np.diff(found["gap"]) < 1e-12).all()     # m: round-off in full contact
        assert found["gap"][-1] < 0.03 * found["gap"][0]
        assert (np.diff(found["area_loaded"]) >= 0.0).all()
        # "Both the increase of viscoelastic loss and the increase in slope effect play an equally
        # important part."
        road.check_slope(found, scales)
        # In full contact the viscous part is known. The tolerance of 5 % is for a speed that still
        # rises, because the interface has slid over the road only once.
        for number in np.flatnonzero(found["area"] > 0.999):
            known = road.viscous_in_full_contact(
                found["speed"][number], data["load"][number],
                (road.LONG, road.WIDER)[:scales])
            assert abs(found["viscous"][number] / known - 1.0) < 0.05, \
                f"full contact: {found['viscous'][number]}, known {known}"
    # The first summits are Hertzian contacts, whose viscous coefficient grows with the load to the
    # power 1/3. The computed contact areas are too large for this, so that the power is lower.
    low, high = one["viscous"][:2]
    power = np.log(high / low) / np.log(data["load"][1] / data["load"][0])
    assert 0.1 < power < 1 / 3
    # On two scales the peak over the plateau falls with the load, up to oscillations of the
    # friction of about 1e-3 ...
    rise = two["maximum"] - two["plateau"]
    assert (np.diff(rise) < 1e-3).all() and rise[-1] < 0.4 * rise[0]
    # ... and not on one scale unless the contact is full. At the lowest load it is much lower
    # there.
    single = one["maximum"] - one["plateau"]
    low = data["load"] < 0.15e6
    assert single[0] < 0.6 * rise[0] and np.ptp(single[low]) < 0.3 * single[low].max()
    # The peak is narrow: the interface slides less than a fifth of the short wave up to it (two
    # cells in the quick form), and less than up to the peak on one scale.
    assert two["slid_to_maximum"][0] < 0.2 * road.WIDER
    assert two["slid_to_maximum"][0] < 0.7 * one["slid_to_maximum"][0]


def picture(data: dict[str, Any]) -> Figure:
    """Draw friction and gap over the load, and the start at the lowest load."""
    figure = Figure(figsize=(12.5, 7.2), layout="constrained")
    (friction, rise), (gap, start) = figure.subplots(2, 2)
    load = data["load"] / 1e6
    for name, label, colour in (("two", "two scales", road.BLUE),
                                ("one", "one scale", road.ORANGE)):
        found = data[name]
        friction.semilogx(load, found["maximum"], "s--", color=colour, label=f"{label}, maximum")
        friction.semilogx(load, found["plateau"], "o-", color=colour, label=f"{label}, plateau")
        rise.semilogx(load, found["maximum"] - found["plateau"], "s-", color=colour,
                      label=f"{label}, maximum less plateau")
        rise.loglog(load, found["viscous"], "^:", color=colour,
                    label=f"{label}, viscous part of the plateau")
        gap.semilogx(load, 1e6 * found["gap_loaded"], "s--", color=colour,
                     label=f"{label}, before motion")
        gap.semilogx(load, 1e6 * found["gap"], "o-", color=colour, label=f"{label}, plateau")
        curve = data[f"{name}_curve"]
        start.plot(1e6 * curve["slid"], curve["friction"], color=colour, label=label)
    rise.set_yscale("log")
    friction.set(ylabel="friction coefficient")
    rise.set(ylabel="parts of the friction coefficient")
    gap.set(ylabel="mean gap (µm)")
    for axes in (friction, rise, gap):
        axes.set_xlabel("mean pressure (MPa)")
    start.set(xlabel="way that the interface slid (µm)", ylabel="friction coefficient",
              xlim=(-2.0, 200.0), ylim=(0.98, 1.06), title=f"start under {LOWEST / 1e3:g} kPa")
    for axes in (friction, rise, gap, start):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize="small")
    friction.set_ylim(top=1.078)
    return figure
