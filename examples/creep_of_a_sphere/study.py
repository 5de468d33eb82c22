"""A sphere sinks into a viscoelastic solid: radius and pressure over time.

The study computes the case of the thesis's section 2.2.1, beside the theory of Lee and Radok.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np

import asperity
from asperity import theory
from asperity.material import Prony

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 1

HERE = Path(__file__).resolve().parent
RADIUS, FORCE, SIDE = 1e-3, 2e-5, 80e-6
SOLID = Prony.from_zener(0.0, [1e6], [1e5], [1e5])     # G0, G1, eta
TIMES = (0.0, 0.05, 0.2, 0.5, 1.0, 3.0, 12.0)


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run the case, with fewer cells and steps in the quick form, and the theory."""
    text = (HERE / "input.nml").read_text()
    if quick:
        text = text.replace("= 256", "= 48").replace("steps = 24", "steps = 9")
    case = folder / "creep.nml"
    case.write_text(text)
    with common.expected(common.LONG_STEPS):  # cells of the quick form
        run = asperity.run(case, output=folder / "creep.h5", threads=common.jobs)
    history, grid = run.history, run.grid
    times = np.array(history["time"])
    known = theory.lee_radok(RADIUS, FORCE, SOLID, times)
    data: dict[str, Any] = {
        "time": times,
        "cell": grid.dx,
        "radius": SIDE * np.sqrt(np.array(history["contact_area"]) / np.pi),
        "approach": np.array(history["displacement"]),
        "known_radius": known.contact_radius,
        "known_approach": known.approach,
        "profiles": [],
    }
    middle = grid.ny // 2
    x = grid.x - SIDE / 2
    for snapshot in run.snapshots:
        t = snapshot.time
        radius = float(np.interp(t, times, known.contact_radius))
        disc = theory.hertz(RADIUS, 4 * SOLID.instantaneous_modulus, contact_radius=radius)
        data["profiles"].append({
            "time": t, "x": x, "contact_radius": radius,
            "pressure": snapshot.pressure[middle], "displacement": snapshot.displacement_z[middle],
            "known_pressure": known.pressure(np.abs(x), t),
            # P = G(t) * S, where S is the pressure of an elastic contact of this radius, because
            # the surface has the shape of a Hertzian contact at all times.
            "known_displacement": disc.displacement(np.abs(x)),
            # Hertz's pressure for the same radius and load
            "hertz": 1.5 * FORCE / (np.pi * radius**2) * np.sqrt(
                np.clip(1 - (x / radius) ** 2, 0, None)),
        })
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check radius, approach, pressure and displacement against the theory."""
    cell, end = data["cell"], data["known_radius"][-1]
    # The area is a count of cells, with an error of half a cell at the edge of the contact.
    error = np.abs(data["radius"] - data["known_radius"]).max()
    assert error < 0.5 * cell, f"contact radius off by {error / cell:.2f} cells"
    # The error of the approach falls with the square of the cell and the cube of the step. It is
    # largest for the smallest contact, which has about 19 cells across if n = 48.
    error = np.abs(data["approach"] / data["known_approach"] - 1)
    assert error.max() < (3e-3 if quick else 2e-4), f"approach off by {error.max():.1e}"
    assert (np.diff(data["radius"][1:]) >= 0).all(), "the contact shrinks"
    assert len(data["profiles"]) == len(TIMES)
    assert np.allclose([p["time"] for p in data["profiles"]], TIMES, atol=1e-9)
    for profile in data["profiles"]:
        a = profile["contact_radius"]
        scale = profile["known_pressure"].max()
        inner = np.abs(profile["x"]) < a - 2 * cell
        error = np.abs(profile["pressure"] - profile["known_pressure"])[inner].max() / scale
        # The slope of the pressure is infinite at the edge, so that the error is of the order of
        # the cell there.
        assert error < (0.03 if quick else 0.015), f"pressure at {profile['time']} s: {error:.3f}"
        error = np.abs(profile["displacement"] - profile["known_displacement"]).max()
        assert error < (6e-3 if quick else 6e-4) * a * a / RADIUS, \
            f"displacement at {profile['time']} s: {error:.2e} m"
    # The pressure is Hertzian immediately after loading and at the end. In between it has spikes at
    # the edge, as the thesis says.
    unlike = [np.abs(p["known_pressure"] - p["hertz"]).max() / p["hertz"].max()
              for p in data["profiles"]]
    ours = [np.abs(p["pressure"] - p["hertz"])[np.abs(p["x"]) < p["contact_radius"] - 2 * cell
                                              ].max() / p["hertz"].max() for p in data["profiles"]]
    assert ours[0] < 0.03, f"not Hertz's pressure after loading: {ours[0]:.3f}"
    assert ours[-1] < 0.03, f"not Hertz's pressure at the end: {ours[-1]:.3f}"
    assert max(unlike) > 0.3, "no transient"
    spikes = [p["pressure"].max() / p["pressure"][p["x"].size // 2] for p in data["profiles"]]
    assert max(spikes) > 1.2 > 1.01 > max(spikes[0], spikes[-1]), f"spikes at the edge: {spikes}"
    assert abs(end - 34.552e-6) < 1e-9, f"the theory's last radius is {end}"


def picture(data: dict[str, Any]) -> Figure:
    """Draw radius, pressures and displacements."""
    figure, (left, middle, right) = common.subplots(3)
    shown = data["time"] <= 4
    fine = np.linspace(0, 4, 400)
    left.plot(fine, theory.lee_radok(RADIUS, FORCE, SOLID, fine).contact_radius * 1e6, color="k",
              lw=1, label="Lee and Radok")
    left.plot(data["time"][shown][::3], data["radius"][shown][::3] * 1e6, "o", ms=4, mfc="none",
              color=common.COLOURS[0], label="Asperity")
    left.set(xlabel="time, s", ylabel="contact radius, µm", ylim=(0, None))
    left.legend()
    for profile, colour in zip(data["profiles"], (*common.COLOURS[:6], "grey"), strict=True):
        x = profile["x"] * 1e6
        step = max(1, x.size // 64)
        middle.plot(x, profile["known_pressure"] / 1e3, color=colour, lw=1)
        middle.plot(x[::step], profile["pressure"][::step] / 1e3, "o", ms=3, mfc="none",
                    color=colour, label=f"{profile['time']:g} s")
        right.plot(x, -profile["known_displacement"] * 1e6, color=colour, lw=1)
        right.plot(x[::step], -profile["displacement"][::step] * 1e6, "o", ms=3, mfc="none",
                   color=colour)
    middle.set(xlabel="x, µm", ylabel="pressure, kPa", ylim=(0, 65))
    middle.legend(fontsize="small", ncols=2, title="points: Asperity, lines: theory",
                  title_fontsize="small")
    right.set(xlabel="x, µm", ylabel="height of the surface, µm")
    return figure
