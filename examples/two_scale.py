"""The two-scale road of the thesis (table 4.1) for the studies of it: inputs and measures.

The studies are two_scale_road, fast_road, road_speed, road_load, road_loading_time and random_road.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import common
import numpy as np
from scipy.optimize import brentq

import asperity
from asperity.material import Prony

#: The longer wavelength, which is the cell's length along x, and the shorter one, m.
LONG = 500e-6
SHORT = LONG / 16
#: Amplitude over wavelength of both waves.
STEEPNESS = 0.01
#: Speed of the drive, m/s, mean pressure, Pa, loading time, s, and the block's height, m.
SPEED, PRESSURE, LOADING, THICKNESS = 1.0, 0.4e6, 1e-3, 4e-3
#: Cells along x of quick and full forms, and the shorter wave, which is longer than that of the
#: thesis, so that it has at least eight cells, and sixteen in the full form.
QUICK, FULL, WIDER = 64, 128, LONG / 8
BLUE, RED, GREEN, PURPLE, ORANGE = common.COLOURS[:5]


def compound(duration: float = 2e-3) -> Prony:
    """Return the compound `tread` of examples/materials at 25 C for cases of a duration (s).

    Arms slower than ten to a hundred times the duration do not relax in it, and are added to the
    spring. Arms faster than 0.1 ns relax within any step, and are left out. For the duration of
    table 4.1 ten arms remain.
    """
    g, tau = np.loadtxt(common.EXAMPLES / "materials" / "tread.txt", unpack=True)
    slow = tau > 1.5 * 10.0 ** math.ceil(math.log10(10.0 * max(duration, 2e-3)))
    kept = ~slow & (tau > 0.5e-10)
    return Prony(g[slow].sum(), g[kept], tau[kept])


def drive_to_slip(pressure: float, speed: float) -> float:
    """Return the travel of the drive, m, at which a sticking block has a traction of `pressure`."""
    rubber = compound()

    def traction(time):
        relaxed = rubber.tau * -np.expm1(-time / rubber.tau)
        return speed / THICKNESS * (rubber.g_inf * time + (rubber.g * relaxed).sum())

    return speed * brentq(lambda time: traction(time) - pressure, 0.0,
                          pressure * THICKNESS / (speed * rubber.g_inf), rtol=1e-6)


def waves(short: float | None = SHORT, steepness: float = STEEPNESS) -> str:
    """Return the &surface groups of the road, with or without a shorter wave of this length, m."""
    return "".join(
        f"&surface shape = 'hexagonal_wave', amplitude = {steepness * length!r},"
        f" wavelength = {length!r} /\n" for length in (LONG, short) if length)


def case(nx: int, road: str, *, speed: float = SPEED, pressure: float = PRESSURE,
         loading: float = LOADING, distance: float = 1.25 * LONG, shear_steps: int = 40,
         fine: float = 1.0, density: float | None = None, grip: float = 1.0,
         rubber: Prony | None = None) -> asperity.Case:
    """Return the case of a block that is pressed for a time and then driven over a road.

    The drive first shears the sticking block in `shear_steps` steps. Around the first full slip the
    steps are half a cell, and afterwards `fine` cells.

    Parameters
    ----------
    nx : int
        Cells along x; those along y follow for nearly square cells.
    road : str
        The &surface groups.
    speed, pressure, loading : float
        Speed of the drive, m/s, mean pressure, Pa, and loading time, s.
    distance : float
        Travel of the drive from first full slip on, m.
    shear_steps : int
        Steps until then.
    fine : float
        Cells that the drive moves in a step after the first full slip.
    density : float
        Density of the block, kg/m3, which only damps. The default is that of the thesis, 20, and
        below 1 m/s 20 divided by the square of the speed, which has the same share in the forces.
        With less, a slow block would stick and slip from step to step.
    grip : float
        Traction over pressure at which the whole contact is expected to slip.
    rubber : Prony, optional
        The compound; that of table 4.1 by default.
    """
    cell = LONG / nx
    if density is None:
        density = 20.0 * max(1.0, (SPEED / speed) ** 2)
    travel = drive_to_slip(grip * pressure, speed)
    made = asperity.Case.read(road + "&grid nx = 2 /\n&material shear_modulus = 1 /\n&phase /")
    made.grid.update(nx=nx, ny=2 * round(nx / math.sqrt(12.0)), lx=LONG, ly=LONG / math.sqrt(3.0))
    made.material.update(common.material_group(rubber or compound(), thickness=THICKNESS,
                                               density=density))
    made.friction.update(law="coulomb", coefficient=1.0)
    made.phase[0].update(name="press", pressure=pressure, duration=loading, steps=40)
    for name, way, steps in (("shear", 0.9 * travel, {"steps": shear_steps}),
                             ("onset", 0.1 * travel + WIDER, {"dt": 0.5 * cell / speed}),
                             ("slide", distance - WIDER, {"dt": fine * cell / speed})):
        made.phase.append(name=name, velocity_x=speed, duration=way / speed, **steps)
    made.solver.update(tolerance=1e-5)
    return made


def histories(folder: Path, cases: Sequence[asperity.Case],
              *said: str) -> list[dict[str, np.ndarray]]:
    """Run cases with different values side by side, and return the columns of each.

    `said` are parts of warnings that are expected in addition to those of all these cases.
    """
    def values(one: asperity.Case) -> dict[str, Any]:
        flat = {f"{group}.{name}": value for group in ("grid", "material")
                for name, value in one[group].items()}
        flat |= {f"adhesion.{name}": value for name, value in one["adhesion"].items()}
        for group in ("surface", "phase"):
            for number, entry in enumerate(one[group], 1):
                flat |= {f"{group}[{number}].{name}": value for name, value in entry.items()}
        return flat

    flat = [values(one) for one in cases]
    names = tuple(name for name in flat[0] if any(one[name] != flat[0][name] for one in flat))
    # Long steps are intended while the rubber creeps (phase 1) and sticks (phase 2).
    with common.expected(common.FEW_CELLS, common.LONG_STEPS, f"&phase 2: {common.LONG_WAYS}",
                         *said):
        table = asperity.sweep(cases[0], {names: [[one[name] for name in names] for one in flat]},
                               folder=folder, jobs=common.jobs, quiet=True)
    return [columns(run) for run in table.runs]


def columns(run: asperity.Run) -> dict[str, np.ndarray]:
    """Return the columns that the studies use, and `slid`, the sliding distance, m."""
    data = {name: np.array(run.history[name]) for name in (
        "phase", "time", "contact_area", "stick_area", "mean_gap", "friction", "friction_viscous",
        "sliding_speed", "road_x", "seconds")}
    way = data["sliding_speed"][1:] * np.diff(data["time"])
    data["slid"] = np.concatenate(([0.0], np.cumsum(way)))
    return data


def measures(data: dict[str, np.ndarray]) -> dict[str, float]:
    """Return maximum and plateau of the friction, and other means over the plateau.

    The plateau is the last period of the longer wave over which the interface slid, or the time
    since the first full slip if that is shorter.
    """
    slid, driven = data["slid"], data["road_x"] > 0.0
    slipping = driven & (data["stick_area"] < 1e-3)
    late = slipping & (slid > slid[-1] - LONG)
    peak = int(np.argmax(np.where(driven, data["friction"], -np.inf)))
    return {
        "maximum": float(data["friction"][peak]),
        "slid_to_maximum": float(slid[peak]),
        "plateau": float(data["friction"][late].mean()),
        "swing": float(data["friction"][late].std()),
        "viscous": float(data["friction_viscous"][late].mean()),
        "area": float(data["contact_area"][late].mean()),
        "gap": float(data["mean_gap"][late].mean()),
        "area_loaded": float(data["contact_area"][~driven][-1]),
        "gap_loaded": float(data["mean_gap"][~driven][-1]),
        "speed": float(data["sliding_speed"][late].mean()),
    }


def oscillation(data: dict[str, np.ndarray], periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Return wavelengths, m, and amplitudes of the friction over the sliding distance.

    They belong to the last `periods` periods of the longer wave, after a straight trend is removed.
    """
    start = data["slid"][-1] - periods * LONG
    x = start + periods * LONG * np.arange(2048 * periods) / (2048 * periods)
    y = np.interp(x, data["slid"], data["friction"])
    y -= np.polyval(np.polyfit(x - start, y, 1), x - start)
    amplitude = np.abs(np.fft.rfft(y))[1:] * 2.0 / y.size
    return periods * LONG / np.arange(1, amplitude.size + 1), amplitude


def viscous_in_full_contact(speed: float, pressure: float, waves: Sequence[float]) -> float:
    """Return -mean(P dH/dx)/mean(P) in steady sliding with full contact (coefficient 1).

    A hexagonal wave consists of three plane waves with a quarter of its amplitude, D, and twice its
    wave number, q: one along x, and two at 60 degrees to it. Each loses the stress
    q_x q D^2 G''(q_x V). In addition, the traction, which is equal to P, drags each point along x,
    relative to the mean by A_xx/A_zz = 2 - (q_x/q)^2 times its normal displacement. The pressure p
    therefore acts more on the leading flanks, which adds p q_x^2 D^2 (2 - (q_x/q)^2)/2.
    """
    stress = 0.0
    for wave in waves:
        q, amplitude = 4.0 * math.pi / wave, STEEPNESS * wave / 4.0
        for part in (1.0, 0.5, 0.5):
            lost = compound().complex_modulus(np.array([part * q * speed])).imag[0]
            stress += part * (q * amplitude) ** 2 * (
                lost + pressure * part * (2.0 - part**2) / 2.0)
    return stress / pressure


def check_slope(found: dict[str, np.ndarray | float], scales: int = 2) -> None:
    """Check the effect of the slopes on the friction (coefficient 1, slip along x).

    To second order in the slopes, the traction of a slipping point on a slope (-a, -b) is
    1 + 2 a + 2 a^2 + b^2/2 times its pressure. The mean of a, weighted by the pressure, is the
    viscous part. The squares add 5/4 of the mean square slope for a uniform pressure, less for
    contacts around the summits, and more for contacts on the leading flanks.
    """
    # Each scale has three waves with a quarter of its amplitude and twice its wave number.
    squares = scales * 3.0 * (math.pi * STEEPNESS) ** 2 / 2.0
    rest = np.asarray(found["plateau"]) - 1.0 - 2.0 * np.asarray(found["viscous"])
    assert (rest > 0.0).all() and (rest < 2.0 * squares).all(), f"slopes leave {rest}"
