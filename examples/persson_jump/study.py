"""Jumps of speed and load on a rough road, beside Persson's theory.

Rubber slides at 10 mm/s, then faster. The study shows area and friction over time, their values
over the speed and the load, and the energies, all as means over several roads. Then the load jumps
while the rubber slides, and at rest, where the result is known exactly.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from common import COLOURS, compound
from sbr_road import Road, sweep

import asperity
from asperity import theory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 3

SIDE, HURST, SLOPE = 1e-3, 0.9, 0.02      # thesis, section 4.3
BEFORE, AFTER, PRESSURE = 0.01, 3.0, 0.1e6
SPEED_OF_LOADS = 0.3                      # m/s, speed after the jump in the sweep of the load
GAMMA = 0.45
#: Travel before and after the jump, over the side of the cell.
TRAVEL = (0.1875, 0.5)
HIGH, LOW = 0.1e6, 0.02e6                 # Pa, the loads of the drop at rest


def _jump(run: asperity.Run, pressure: float) -> dict[str, Any]:
    """Return the values after the jump of the speed in a run; row 0 is the last one before it."""
    history, side = run.history, run.grid.lx
    rows = np.flatnonzero(history["phase"] == 3)
    rows = np.append(rows[0] - 1, rows)
    steady = np.flatnonzero(history["phase"] == 2)
    steady = steady[len(steady) // 2:]
    scale = pressure * side**2 * run.grid.dx
    found = {name: history[name][rows] for name in ("friction", "contact_area")}
    found["energies"] = {
        name: sign * np.diff(history[column][rows]) / scale for name, column, sign in (
            ("drive", "work_drive", 1.0), ("load", "work_load", -1.0),
            ("elastic", "energy_elastic", 1.0), ("loss", "dissipated_viscous", 1.0))}
    work = history["work_normal"] + history["work_tangential"]
    found["open"] = float(np.ptp(work - history["energy_elastic"]
                                 - history["dissipated_viscous"]) / work.max())
    found["before"] = (float(history["friction"][steady].mean()),
                       float(history["contact_area"][steady].mean()))
    late = found["friction"].size // 4
    found["max"] = float(found["friction"].max())
    found["dyn"] = float(found["friction"][late:].mean())
    found["area"] = float(found["contact_area"][late:].mean())
    return found


def _means(folder: Path, road: Road, after: float, pressure: float, seeds: int,
           points: int) -> dict[str, Any]:
    """Return the means over the roads, and the theory.

    The runs start unrelaxed, so that the slow arms are in about the mean state of sliding.
    """
    slow, fast = (part * road.side / v for part, v in zip(TRAVEL, (BEFORE, after), strict=True))
    table = sweep(
        road.case(dict(pressure=1.0), dict(velocity_x=BEFORE, duration=slow),
                  dict(velocity_x=1.0, duration=1.0)),
        {("phase[1].pressure", "phase[3].velocity_x", "phase[3].duration"):
         [(pressure, after, fast)], "surface.seed": list(range(1, seeds + 1))}, folder)
    runs = [_jump(run, pressure) for run in table.runs]
    time = np.arange(runs[0]["friction"].size) * road.side / road.cells / after
    fine = np.concatenate([[0.0], np.geomspace(0.02 * time[1], time[-1], points)])
    expected = {gamma: theory.persson_speed_step(*road.spectrum, compound(), pressure, BEFORE,
                                                 after, fine, gamma=gamma)
                for gamma in (GAMMA, 1.0)}
    return {
        "travel": time * after, "fine": fine * after, "open": max(item["open"] for item in runs),
        "friction": np.array([item["friction"] for item in runs]),
        "area": np.array([item["contact_area"] for item in runs]),
        "energies": {name: np.mean([item["energies"][name] for item in runs], axis=0)
                     for name in runs[0]["energies"]},
        "before": np.mean([item["before"] for item in runs], axis=0),
        "max": np.array([item["max"] for item in runs]),
        "dyn": np.array([item["dyn"] for item in runs]),
        "late_area": np.array([item["area"] for item in runs]),
        "theory": {gamma: {"friction": item.friction, "area": item.contact_area,
                           "max": float(item.friction.max()), "dyn": float(item.friction[-1])}
                   for gamma, item in expected.items()}}


def _load_jumps(folder: Path, road: Road, seeds: int) -> list[dict[str, Any]]:
    """Return the values after a jump of the load at SPEED_OF_LOADS, down and up.

    Row 0 is the state before the jump.
    """
    found = []
    slide = [dict(velocity_x=SPEED_OF_LOADS, duration=part * road.side / SPEED_OF_LOADS)
             for part in (TRAVEL[0], 0.25)]
    for before, after in ((HIGH, LOW), (LOW, HIGH)):
        table = sweep(
            road.case(dict(pressure=before), slide[0], dict(pressure=after, **slide[1])),
            {"surface.seed": list(range(1, seeds + 1))}, folder / f"{before:g}_{after:g}")
        history = [run.history for run in table.runs]
        start = int(np.flatnonzero(history[0]["phase"] == 3)[0]) - 1
        found.append({
            "before": before, "after": after,
            # The first row is the state before the jump, the second one the state after it at the
            # same place.
            "travel": history[0]["road_x"][start:] - history[0]["road_x"][start],
            "area": np.array([one["contact_area"][start:] for one in history]),
            "friction": np.array([one["friction"][start:] for one in history]),
            "theory": {gamma: {name: getattr(item, name) for name in ("contact_area", "friction")}
                       for gamma in (GAMMA, 1.0)
                       for item in [theory.persson(*road.spectrum, compound(), [before, after],
                                                   SPEED_OF_LOADS, gamma=gamma)]}})
    return found


def _drops(folder: Path, road: Road, first: list[tuple[Any, ...]]) -> list[dict[str, Any]]:
    """Return the area over time after the load has dropped at rest, for each start."""
    hold = [dict(duration=2e-7 * 4.0**k, steps=4) for k in range(11)]
    table = sweep(
        road.case(dict(pressure=HIGH), dict(pressure=LOW, duration=1e-7, steps=2), *hold,
                  tolerance=1e-8),
        {("phase[1].relaxed", "phase[1].duration", "phase[1].steps"): first}, folder)
    found = []
    for run in table.runs:
        history = run.history
        rows = np.flatnonzero(np.isclose(history["pressure"], LOW, rtol=1e-3))
        found.append({"time": history["time"][rows] - history["time"][rows[0]],
                      "area": history["contact_area"][rows],
                      "before": float(history["contact_area"][rows[0] - 1])})
    return found


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the jumps and the drops."""
    road = (Road(64, SIDE, HURST, (4, 8), SLOPE) if quick
            else Road(256, SIDE, HURST, (4, 32), SLOPE))
    seeds = 2 if quick else 4
    points = 8 if quick else 40
    speeds = [AFTER] if quick else [0.03, 0.1, 0.3, 1.0, AFTER, 10.0, 30.0, 100.0]
    loads = [] if quick else [0.02e6, 0.05e6, 0.1e6, 0.2e6, 0.4e6, 1e6]
    by_speed = [_means(folder / "jumps", road, v, PRESSURE, seeds, points) for v in speeds]
    by_load = [_means(folder / "jumps", road, SPEED_OF_LOADS, p, seeds, points) if p != PRESSURE
               else by_speed[speeds.index(SPEED_OF_LOADS)] for p in loads]
    modulus = 4 * compound().equilibrium_modulus
    high, low = (asperity.solve_normal(road.map(1), SIDE, SIDE, modulus, pressure=p,
                                       tolerance=1e-8).contact_area for p in (HIGH, LOW))
    return {
        "speeds": np.array(speeds), "by_speed": by_speed, "loads": np.array(loads),
        "by_load": by_load, "jump": by_speed[speeds.index(AFTER)],
        "drops": dict(zip(("relaxed", "1 ms", "10 µs"), _drops(
            folder / "drops", road, [(True, None, None), (None, 1e-3, 20), (None, 1e-5, 20)]),
            strict=True)),
        "load_jumps": _load_jumps(folder / "loads", road, seeds),
        "elastic": (high, low), "cell": 1.0 / road.cells**2,
        "summary": [{
            "speed": v, "pressure": p, "cases": {name: {
                "runs": float(item[column].mean()), "scatter": float(item[column].std(ddof=1)),
                **{f"theory {gamma:g}": item["theory"][gamma][name] if name != "area"
                   else float(item["theory"][gamma]["area"][-1]) for gamma in (GAMMA, 1.0)}}
                for name, column in (("max", "max"), ("dyn", "dyn"), ("area", "late_area"))}}
            for v, p, item in [*((v, PRESSURE, item) for v, item in zip(speeds, by_speed,
                                                                       strict=True)),
                               *((SPEED_OF_LOADS, p, item) for p, item in zip(loads, by_load,
                                                                              strict=True))]]}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the runs against the theory, the energy balance, and the drop of the load."""
    for number, found in enumerate(data["by_speed"] + data["by_load"]):
        # The sum of the energies stored and lost equals the work, up to round-off.
        assert found["open"] < 1e-9, f"case {number}: the energy balance is off by {found['open']}"
    jump = data["jump"]
    for mean, expected in ((jump["before"][1], jump["theory"][1.0]["area"][0]),
                           (jump["late_area"].mean(), jump["theory"][1.0]["area"][-1])):
        # Thesis, figure 4.3: the area of the theory is up to 15 % smaller. The small number of
        # cells adds 5 %.
        assert 0.97 < mean / expected < 1.25, f"area {mean}, theory {expected}"
    friction = jump["friction"].mean(axis=0)
    peak = int(friction.argmax())
    dyn = jump["dyn"].mean()
    assert jump["travel"][peak] < 0.25 * SIDE / 4, "the maximum is late"
    assert friction[peak] > 1.1 * dyn > 1.1 * jump["before"][0], "no maximum"
    low, high = jump["theory"][GAMMA], jump["theory"][1.0]
    for name, value in (("max", jump["max"].mean()), ("dyn", dyn)):
        # Thesis: the friction differs by 30 % from gamma = 0.45 in steady state and by 50 % at the
        # maximum, and the theory is below the runs.
        assert 0.9 * low[name] < value < 1.1 * high[name], \
            f"{name} {value}, theory {low[name]} to {high[name]}"
    # The work of the drive that is not lost is stored or lifts the load. Seen from outside, the
    # balance has the error of the steps. With steps of one cell and 6 to 8 cells in the shortest
    # wave, the trapezoidal rule for the work on the road is 2 to 4 % off even if the slopes are
    # exact.
    energy = {name: values.sum() for name, values in jump["energies"].items()}
    balance = energy["drive"] - energy["load"] - energy["elastic"] - energy["loss"]
    assert abs(balance) < 0.04 * energy["drive"], \
        f"the balance of the work is off by {balance / energy['drive']:.3f}"
    first = {name: values[:peak + 1].sum() for name, values in jump["energies"].items()}
    assert first["load"] > first["elastic"] > 0, "the maximum does not lift the load"
    # A jump of the load while sliding. The theory treats each wave as in full contact, so that it
    # has no memory of the load. The runs need a part of the longest wave to reach the new state.
    # Before and after it their area is that of the theory, which is 15 % off (57 % at light load,
    # see persson_bell).
    for jump in data["load_jumps"]:
        area, travel = jump["area"].mean(axis=0), jump["travel"]
        ends = np.array([area[0], area[-len(area) // 4:].mean()])
        ratio = ends / jump["theory"][1.0]["contact_area"]
        assert (ratio > 0.97).all() and (ratio < 1.57).all(), f"load jump: {ratio} of the theory"
        done = travel[np.abs(area - ends[0]) > 0.95 * abs(ends[1] - ends[0])][0]
        assert done < 0.5 * SIDE / 4, f"steady {done} m after the jump"
        rest = np.abs(area[1] - ends[0]) / abs(ends[1] - ends[0])
        assert (rest > 0.8) if jump["after"] < jump["before"] else (rest < 0.2), f"at once {rest}"
    # The drop of the load at rest. Rubber that has relaxed has the area of the smaller load at
    # once, and keeps it. Otherwise the area grows to this value and never falls. The state of one
    # cell may change within 1e-8.
    exact = data["elastic"][1]
    for name, drop in data["drops"].items():
        assert np.diff(drop["area"]).min() >= -2 * data["cell"], f"{name}: the area falls"
        assert drop["area"][0] < drop["before"], f"{name}: no drop"
        assert drop["area"].max() <= exact + 2 * data["cell"], f"{name}: above the relaxed area"
    relaxed = data["drops"]["relaxed"]
    assert abs(relaxed["before"] - data["elastic"][0]) < 2 * data["cell"], "not relaxed"
    assert np.abs(relaxed["area"] - exact).max() < 2 * data["cell"], "not that of the load"
    assert np.ptp(data["drops"]["10 µs"]["area"]) > 0.02, "the area does not grow"
    if quick:
        return
    speeds = data["by_speed"]
    peaks = [item["max"].mean() for item in speeds]
    dyns = [item["dyn"].mean() for item in speeds]
    assert (np.diff(peaks) > 0).all(), "the maximum does not grow with speed"
    assert 0 < int(np.argmax(dyns)) < len(dyns) - 1, "steady friction has no maximum"
    full = data["by_load"][-1]
    # The theory is exact in full contact. The tolerance is for eight cells in the shortest wave,
    # which cause an error of 1.3 %.
    assert full["late_area"].min() > 0.999, "no full contact at 1 MPa"
    for name in ("max", "dyn"):
        error = full[name].mean() / full["theory"][GAMMA][name] - 1
        assert abs(error) < 0.04, f"full contact: {name} off by {error:+.3f}"


def picture(data: dict[str, Any]) -> Figure:
    """Draw the jump, values over speed and load, energies, jumps of the load, and the drop."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(5, 2, figsize=(11, 18), layout="constrained")
    jump = data["jump"]
    for panel, column, label in ((axes[0, 0], "friction", "friction coefficient"),
                                 (axes[0, 1], "area", "contact area, fraction")):
        for gamma, style in ((GAMMA, "-"), (1.0, ":")):
            if gamma == 1.0 and column == "area":
                continue
            panel.plot(jump["fine"] * 1e6, jump["theory"][gamma][column], ls=style,
                       color=COLOURS[0], label="theory" + (f", γ = {gamma:g}"
                                                          if column == "friction" else ""))
        values = jump[column]
        panel.fill_between(jump["travel"] * 1e6, values.min(axis=0), values.max(axis=0),
                           color=COLOURS[1], alpha=0.2, lw=0)
        panel.plot(jump["travel"] * 1e6, values.mean(axis=0), color=COLOURS[1],
                   label=f"mean and range of {len(values)} roads")
        panel.set(xlabel="travel since the jump, µm", ylabel=label, ylim=(0, None),
                  title="speed from 10 mm/s to 3 m/s at 0.1 MPa")

    for row, x, cases, label, title in (
            (1, data["speeds"], data["by_speed"], "speed after the jump, m/s",
             "jump from 10 mm/s at 0.1 MPa"),
            (2, data["loads"] / 1e6, data["by_load"], "pressure, MPa",
             "jump from 10 mm/s to 0.3 m/s")):
        panel, error = axes[row]
        for name, colour, mark, meaning in (("max", COLOURS[1], "o", "largest"),
                                            ("dyn", COLOURS[2], "s", "steady")):
            values = np.array([item[name] for item in cases])
            if values.size:
                panel.errorbar(x, values.mean(axis=1), values.std(axis=1, ddof=1), fmt=mark,
                               color=colour, capsize=3, label=f"{meaning}, runs")
            for gamma, style in ((GAMMA, "-"), (1.0, ":")):
                expected = [item["theory"][gamma][name] for item in cases]
                panel.plot(x, expected, color=colour, ls=style, label=f"{meaning}, γ = {gamma:g}")
                if values.size:
                    error.plot(x, 100 * (np.array(expected) / values.mean(axis=1) - 1), mark,
                               ls=style, color=colour, mfc=colour if gamma == GAMMA else "none",
                               label=f"{meaning} friction, γ = {gamma:g}")
        if cases:
            area = [item["theory"][1.0]["area"][-1] / item["late_area"].mean() for item in cases]
            error.plot(x, 100 * (np.array(area) - 1), "D-", color=COLOURS[0], label="area")
        panel.set(xscale="log", xlabel=label, ylabel="friction coefficient", ylim=(0, None),
                  title=title)
        error.axhline(0, color="k", lw=0.8)
        error.set(xscale="log", xlabel=label, ylabel="theory over the runs less 1, %",
                  title="the theory's error")

    panel = axes[3, 0]
    for number, (name, label) in enumerate((("drive", "drive (friction)"), ("load", "load, lifted"),
                                            ("elastic", "elastic energy"), ("loss", "loss"))):
        values = jump["energies"][name]
        panel.plot(jump["travel"][1:] * 1e6, values, color=COLOURS[number], label=label,
                   ls=("-", "--", "-.", (0, (1, 1)))[number])
    panel.set(xlabel="travel since the jump, µm", ylabel="energy a step / (p L² dx)",
              title="energies, 10 mm/s to 3 m/s", xlim=(0, 200))

    panel = axes[3, 1]
    for number, (name, drop) in enumerate(data["drops"].items()):
        panel.semilogx(drop["time"][1:], drop["area"][1:], color=COLOURS[number],
                       marker="osD"[number], ms=3, ls="-",
                       label="relaxed before" if number == 0 else f"pressed for {name} before")
    panel.axhline(data["elastic"][1], color="k", ls=":", label="relaxed at the smaller load")
    panel.set(xlabel="time since the drop, s", ylabel="contact area, fraction", ylim=(0, None),
              title="load drops from 0.1 to 0.02 MPa at rest")

    for panel, column, label in ((axes[4, 0], "area", "contact area, fraction"),
                                 (axes[4, 1], "friction", "friction coefficient")):
        name = "contact_area" if column == "area" else column
        for number, item in enumerate(data["load_jumps"]):
            word = "drop" if item["after"] < item["before"] else "rise"
            for gamma, style in ((GAMMA, "-"), (1.0, ":")):
                if gamma == GAMMA and column == "area":
                    continue
                values = item["theory"][gamma][name]
                panel.plot([0, 0, item["travel"][-1] * 1e6], [values[0], values[1], values[1]],
                           color=COLOURS[number], ls=style, lw=1,
                           label=f"{word}, theory" if column == "area"
                           else f"{word}, γ = {gamma:g}")
            panel.plot(item["travel"] * 1e6, item[column].mean(axis=0), color=COLOURS[number],
                       marker="os"[number], ms=3, label=f"{word}, mean of the roads")
        panel.set(xlabel="travel since the jump, µm", ylabel=label, xlim=(-3, 100),
                  ylim=(0, None), title="load between 0.1 and 0.02 MPa at 0.3 m/s")
    for panel in axes.flat:
        panel.grid(alpha=0.3)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize="small")
    return figure
