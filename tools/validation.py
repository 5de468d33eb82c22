"""Run the validation cases and write docs/validation.md with its figures.

    python tools/validation.py [NAME ...]

Each case runs the program and is compared with a known solution of `asperity.theory` or with a
value of the literature. If names are given, only those chapters are run and drawn, and the page is
not written.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import asperity
from asperity import theory
from asperity.material import Prony
from asperity.plot import COLOURS

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))
from coupled_reference import Block

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
DOCS = Path(__file__).resolve().parents[1] / "docs"
FIGURES = DOCS / "figures"
SCHEMES = ("backward_euler", "exponential", "exponential2")
BLUE, RED, GREEN, PURPLE = COLOURS[:4]
FloatArray = NDArray[np.float64]


@dataclass
class Row:
    """One comparison: the quantity, our value, the reference and the units."""

    what: str
    value: float
    reference: float
    units: str = ""

    def markdown(self) -> str:
        """Return the row of the table."""
        error = self.value / self.reference - 1.0
        return (f"| {self.what} | {self.value:.6g} {self.units} "
                f"| {self.reference:.6g} {self.units} | {100 * error:+.3g} % |")


@dataclass
class Chapter:
    """A chapter of the page."""

    title: str
    text: str
    rows: list[Row] = field(default_factory=list)
    figure: str = ""
    caption: str = ""

    def markdown(self) -> str:
        """Return the chapter."""
        parts = [f"## {self.title}", self.text]
        if self.rows:
            parts.append("\n".join(["| quantity | Asperity | reference | difference |",
                                    "| --- | --- | --- | --- |",
                                    *(row.markdown() for row in self.rows)]))
        if self.figure:
            parts.append(f"![{self.caption}](figures/{self.figure})\n\n*{self.caption}*")
        return "\n\n".join(parts)


def run(text: str) -> asperity.result.Run:
    """Run a case given as text, in a temporary folder that is removed at the end."""
    folder = Path(tempfile.mkdtemp(dir=run.folder))
    case = folder / "case.nml"
    case.write_text(text)
    return asperity.run(case, threads=1)


def finish(figure, name: str) -> str:
    """Save a figure."""
    FIGURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURES / name, dpi=110)
    plt.close(figure)
    return name


def hertz() -> Chapter:
    """Press a sphere on an elastic half-space, free boundary."""
    radius, modulus, force = 0.05, 344.828e6, 9.19540
    known = theory.hertz(radius, modulus, force=force)
    errors, cells = [], []
    for n in (16, 32, 64, 128, 256):
        result = run(f"""&grid nx = {n}, ny = {n}, lx = 2.4e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = {radius} /
&material poisson = 0.42, shear_modulus = {modulus * 0.58 / 2!r} /
&phase force = {force!r} /
&solver tolerance = 1e-8 /
""")
        cells.append(2 * known.contact_radius / (2.4e-3 / n))
        errors.append((abs(result.history["displacement"][-1] / known.approach - 1),
                       abs(result.snapshots[-1].pressure.max() / known.peak_pressure - 1)))
    snapshot = result.snapshots[-1]
    x = result.grid.x - 1.2e-3
    area = result.history["contact_area"][-1] * result.grid.lx * result.grid.ly
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    r = np.linspace(-1.2e-3, 1.2e-3, 600)
    left.plot(r * 1e3, known.pressure(np.abs(r)) / 1e6, color=BLUE, label="Hertz")
    left.plot(x[::6] * 1e3, snapshot.pressure[128, ::6] / 1e6, "o", ms=3.5, color=RED,
              label="Asperity")
    left.set(xlabel="x (mm)", ylabel="Pressure (MPa)")
    left.legend()
    errors = np.array(errors)
    right.loglog(cells, errors[:, 0], "o-", color=BLUE, label="approach")
    right.loglog(cells, errors[:, 1], "s-", color=RED, label="peak pressure")
    right.loglog(cells, 0.5 / np.array(cells) ** 2, "k:", label="order 2")
    right.set(xlabel="Cells over the contact", ylabel="Relative error")
    right.set_xticks([20, 50, 100, 200], ["20", "50", "100", "200"])
    right.minorticks_off()
    right.legend()
    return Chapter(
        "Hertz: a sphere on an elastic half-space",
        "E\\* = 344.828 MPa, R = 50 mm and F = 9.19540 N give a contact radius of 1 mm. The"
        f" boundary is free, on a mesh of 256 x 256 cells with {cells[-1]:.0f} over the contact."
        " The surface is a paraboloid, as in the theory. The contact radius is that of the cells"
        " in contact, sqrt(area/pi).",
        [Row("approach", result.history["displacement"][-1] * 1e3, known.approach * 1e3, "mm"),
         Row("peak pressure", snapshot.pressure.max() / 1e6, known.peak_pressure / 1e6, "MPa"),
         Row("contact radius", math.sqrt(area / math.pi) * 1e3, known.contact_radius * 1e3, "mm")],
        finish(figure, "hertz.png"), "Pressure through the middle, and errors against the mesh.")


def westergaard() -> Chapter:
    """Press a wave on an elastic half-space, line contact."""
    amplitude, wavelength, shear = 1e-6, 1e-3, 0.25e6
    modulus = 4 * shear
    full = math.pi * modulus * amplitude / wavelength
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    loads = [0.05, 0.2, 0.4, 0.6, 0.8, 0.95]
    areas, rows = [], []
    for load in loads:
        result = run(f"""&grid nx = 1024, ny = 1, lx = {wavelength!r} /
&surface shape = 'sine', amplitude = {amplitude!r}, wavelength = {wavelength!r} /
&material shear_modulus = {shear!r} /
&phase pressure = {load * full!r} /
&solver tolerance = 1e-9 /
""")
        known = theory.westergaard(amplitude, wavelength, modulus, load * full)
        areas.append(result.history["contact_area"][-1])
        if load in (0.2, 0.6):
            x = result.grid.x - wavelength / 2
            colour = BLUE if load == 0.2 else GREEN
            right.plot(x * 1e3, known.pressure(x), color=colour, label=f"{load} p*")
            right.plot(x[::16] * 1e3, result.snapshots[-1].pressure[0, ::16], "o", ms=3.5,
                       color=colour)
            rows += [Row(f"contact fraction at {load} p*", areas[-1], known.area_fraction),
                     Row(f"mean gap at {load} p*", result.history["mean_gap"][-1] * 1e9,
                         known.mean_gap * 1e9, "nm"),
                     Row(f"peak pressure at {load} p*", result.snapshots[-1].pressure.max(),
                         float(known.pressure(0.0)), "Pa")]
    p = np.linspace(0, 1, 400)
    known = [theory.westergaard(amplitude, wavelength, modulus, q * full) for q in p]
    left.plot(p, [wave.area_fraction for wave in known], color=BLUE, label="Westergaard")
    left.plot(loads, areas, "o", color=RED, label="Asperity")
    left.set(xlabel="p/p*", ylabel="Contact fraction")
    left.legend()
    right.set(xlabel="x (mm)", ylabel="Pressure (Pa)")
    right.legend(title="lines: theory")
    return Chapter(
        "Westergaard: a wave on an elastic half-space",
        "Plane strain, 1024 cells per wave, E\\* = 1 MPa, amplitude 1 µm, wavelength 1 mm. The gap"
        " closes at p\\* = pi E\\* D/L. The contact fraction is obtained by counting cells; one"
        " cell is 0.001.",
        rows, finish(figure, "westergaard.png"), "Contact fraction against load; pressure.")


def lee_radok() -> Chapter:
    """Compare creep under a sphere after a step of the load."""
    radius, force = 1e-3, 0.02e-3
    solids = {
        "one branch": (Prony.from_zener(0.0, [1e6], [1e5], [1e5]),
                       "zener_g0 = 1e6, zener_g1 = 1e5, zener_eta = 1e5", (0.25, 0.75, 4.0)),
        "four arms": (Prony(1e5, [4e5, 3e5, 2e5, 1e5], [1e-3, 1e-2, 1e-1, 1.0]),
                      "shear_modulus = 1e5, prony_g = 4e5, 3e5, 2e5, 1e5, "
                      "prony_tau = 1e-3, 1e-2, 1e-1, 1", (4e-3, 0.036, 0.36, 3.6)),
    }
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    rows = []
    for name, colour in zip(solids, (BLUE, GREEN), strict=True):
        solid, material, durations = solids[name]
        phases = "".join(f"&phase {f'force = {force!r}, ' if k == 0 else ''}duration = {t!r}, "
                         "steps = 24 /\n" for k, t in enumerate(durations))
        result = run(f"""&grid nx = 128, ny = 128, lx = 0.1e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = {radius!r} /
&material {material} /
{phases}&solver tolerance = 1e-8 /
""")
        t = result.history["time"]
        known = theory.lee_radok(radius, force, solid, t)
        a = np.sqrt(result.history["contact_area"] / math.pi) * 0.1e-3
        late = np.maximum(t, 1e-4)
        fine = np.geomspace(1e-4, t[-1], 200)
        curve = theory.lee_radok(radius, force, solid, fine).contact_radius
        left.semilogx(fine, curve * 1e6, color=colour, label=f"theory, {name}")
        left.semilogx(late[::4], a[::4] * 1e6, "o", ms=4, color=colour)
        approach = result.history["displacement"]
        right.loglog(late, np.abs(approach / known.approach - 1), color=colour, label=name)
        for moment in (0.0, 1.0) if name == "one branch" else (0.04, 4.0):
            k = int(np.argmin(np.abs(t - moment)))
            rows += [Row(f"contact radius, {name}, t = {t[k]:.3g} s", a[k] * 1e6,
                         known.contact_radius[k] * 1e6, "µm"),
                     Row(f"approach, {name}, t = {t[k]:.3g} s", approach[k] * 1e6,
                         known.approach[k] * 1e6, "µm")]
    left.set(xlabel="Time (s), 0 drawn at 0.1 ms", ylabel="Contact radius (µm)")
    left.legend(title="circles: Asperity")
    right.set(xlabel="Time (s), 0 drawn at 0.1 ms", ylabel="Relative error of the approach")
    right.legend()
    return Chapter(
        "Lee and Radok: creep under a sphere",
        "The case is that of Bugnicourt (thesis, INSA Lyon 2017, section 2.2.1): R = 1 mm, F ="
        " 0.02 mN, G0 = 1 MPa, G1 = 0.1 MPa, creep time 1 s. A second material is a Prony series"
        " of four arms from 1 ms to 1 s. The mesh has 128 x 128 cells and a free boundary; the"
        " scheme is `exponential2`. The steps grow from phase to phase, so that the first steps of"
        " a phase are the coarsest compared with the relaxation that goes on at that time.",
        rows, finish(figure, "lee_radok.png"), "Contact radius and error of the approach in time.")


def lee_radok_order() -> Chapter:
    """Measure the orders in time, on one mesh."""
    def approach(scheme: str, steps: int) -> float:
        result = run(f"""&grid nx = 40, ny = 40, lx = 0.1e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 1e-3 /
&material zener_g0 = 1e6, zener_g1 = 1e5, zener_eta = 1e5 /
&phase force = 0.02e-3, duration = 0.4, steps = {steps} /
&solver tolerance = 1e-9, time_scheme = '{scheme}' /
""")
        return float(result.history["displacement"][-1])

    reference = approach("exponential2", 512)
    counts = np.array([4, 8, 16, 32, 64])
    tau = 1 / 11
    figure, axes = plt.subplots(figsize=(5.2, 3.8), layout="constrained")
    lines = []
    for scheme, colour in zip(SCHEMES, (RED, GREEN, BLUE), strict=True):
        errors = np.array([abs(approach(scheme, int(n)) / reference - 1) for n in counts])
        axes.loglog(0.4 / counts / tau, errors, "o-", color=colour, label=scheme)
        order = math.log(errors[1] / errors[3]) / math.log(4)
        lines.append(f"| `{scheme}` | {order:.2f} | {errors[2]:.1e} |")
    axes.set(xlabel="Time step over relaxation time", ylabel="Relative error of the approach")
    axes.legend()
    return Chapter(
        "Orders in time",
        "The sphere of Lee and Radok at 0.4 s, compared with 512 steps of `exponential2` on the"
        " same mesh, so that the error of the mesh cancels.\n\n"
        "| scheme | order | error at 16 steps |\n| --- | --- | --- |\n" + "\n".join(lines),
        [], finish(figure, "orders.png"), "Error in time of the three schemes.")


def hunter() -> Chapter:
    """Slide a cylinder."""
    solid = Prony.from_zener(0.0, [2.75e6], [2.75e6 / 9], [2.75e6 / 9 * 0.01])
    radius, load = 0.01, 50.0
    speeds = (0.001, 0.005, 0.02, 0.05, 0.1)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    v = np.geomspace(0.5e-3, 2.0, 200)
    left.semilogx(v * 1e3, [theory.hunter(radius, load, s, solid).friction for s in v], color=BLUE,
                  label="Hunter")
    rows = []
    for speed in speeds:
        known = theory.hunter(radius, load, speed, solid)
        dx = known.half_width / 50
        cells = 4096
        steps = 150 + round(0.05 * speed / dx)
        result = run(f"""&grid nx = {cells}, ny = 1, lx = {cells * dx!r} /
&surface shape = 'paraboloid', radius = {radius!r} /
&material zener_g0 = 2.75e6, zener_g1 = {2.75e6 / 9!r}, zener_eta = {2.75e4 / 9!r} /
&phase pressure = {load / (cells * dx)!r}, relaxed = .true., velocity_x = {speed!r},
   duration = {steps * dx / speed!r}, steps = {steps} /
&solver tolerance = 1e-9 /
""")
        friction = float(result.history["friction"][-1])
        rows.append(Row(f"friction at {speed * 1e3:g} mm/s", friction, known.friction))
        left.semilogx(speed * 1e3, friction, "o", color=RED,
                      label="Asperity" if speed == speeds[0] else None)
        if speed in (0.005, 0.1):
            road = float(result.history["road_x"][-1])
            length = cells * dx
            x = (result.grid.x - road) % length - length / 2
            order = np.argsort(x)
            near = order[np.abs(x[order]) < 1e-3]
            colour = GREEN if speed == 0.005 else PURPLE
            right.plot(x[near] * 1e3, known.pressure(x[near]) / 1e3, color=colour,
                       label=f"{speed * 1e3:g} mm/s")
            every = near[:: max(1, len(near) // 40)]
            right.plot(x[every] * 1e3, result.snapshots[-1].pressure[0, every] / 1e3, "o", ms=3.5,
                       color=colour)
    left.set(xlabel="Speed (mm/s)", ylabel="Friction coefficient")
    left.legend()
    right.set(xlabel="x from the axis (mm), moving to the right", ylabel="Pressure (kPa)")
    right.set_xticks([-1, -0.5, 0, 0.5, 1])
    right.legend(title="lines: theory")
    return Chapter(
        "Hunter: a cylinder sliding on a viscoelastic half-space",
        "R = 10 mm, 50 N/m, G0 = 2.75 MPa, G0/G1 = 9, creep time 10 ms. The road moves by one"
        " cell per step, with 100 cells over the contact; the scheme is `exponential2`. The case"
        " is in plane strain in a periodic cell of 41 contact widths. The periodic images cause an"
        " error of the order 1/L^2, which explains the difference at 100 mm/s.",
        rows, finish(figure, "hunter.png"), "Friction against speed; pressure.")


def waves() -> Chapter:
    """Slide oblique waves in full contact: start-up and steady sliding."""
    lx, ly = 0.96e-3, 0.6e-3
    solid = Prony(0.5e6, [1e6, 2e6], [5e-3, 5e-2])
    velocity = np.array([30e-3, -24e-3])
    vectors = 2 * math.pi * np.array([[1 / lx, 1 / ly], [2 / lx, -1 / ly], [0.0, 1 / ly]])
    amplitudes = np.array([0.6e-6, 0.4e-6, 0.5e-6])
    nx, ny = 128, 100
    figure, axes = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    rows = []
    x, y = np.arange(nx) * lx / nx, np.arange(ny) * ly / ny
    height = sum(a * np.cos(q[0] * x + q[1] * y[:, None])
                 for a, q in zip(amplitudes, vectors, strict=True))
    path = Path(tempfile.mkdtemp(dir=run.folder)) / "waves.h5"
    with h5py.File(path, "w") as file:
        file["surface"] = height
    for angle, colour in ((0, BLUE), (1, RED)):
        direction = velocity if angle == 0 else np.array([0.0, 24e-3])
        result = run(f"""&grid nx = {nx}, ny = {ny}, lx = {lx!r}, ly = {ly!r} /
&surface shape = 'file', file = '{path}' /
&material shear_modulus = 0.5e6, prony_g = 1e6, 2e6, prony_tau = 5e-3, 5e-2 /
&phase pressure = 1e6, relaxed = .true., duration = 0.5, steps = 2000,
   velocity_x = {float(direction[0])!r}, velocity_y = {float(direction[1])!r} /
&solver tolerance = 1e-7, interpolation = 'cubic' /
""")
        t = result.history["time"]
        known = theory.full_contact_waves(amplitudes, vectors, direction, solid, times=t)
        steady = theory.full_contact_waves(amplitudes, vectors, direction, solid)
        along = direction / np.hypot(*direction)
        ours = result.history["friction"] * result.history["pressure"]
        name = "oblique" if angle == 0 else "along y"
        stress = known.friction_stress @ along
        axes.plot(t[:800] * 1e3, stress[:800], color=colour, label=f"closed form, {name}")
        axes.plot(t[:800:8] * 1e3, ours[:800:8], "o", ms=3.5, color=colour)
        for moment in (0.005, 0.05):
            k = int(np.argmin(np.abs(t - moment)))
            rows.append(Row(f"friction stress, {name}, t = {t[k] * 1e3:.3g} ms", ours[k],
                            float(stress[k]), "Pa"))
        rows.append(Row(f"friction stress, {name}, steady", ours[-1],
                        float(steady.friction_stress @ along), "Pa"))
    axes.set(xlabel="Time (ms)", ylabel="Friction stress (Pa)")
    axes.legend(title="circles: Asperity")
    return Chapter(
        "Waves in full contact: start-up and steady sliding",
        "Three waves of different directions on a grid of oblong cells, with two arms, start from"
        " rest. The road moves obliquely at 30 and -24 mm/s, or along y at 24 mm/s, by whole cells"
        " per step. In steady sliding each wave adds the stress q^2 D^2 E''(q.V)/4 along q.",
        rows, finish(figure, "waves.png"), "Friction stress after the start.")


def adhesion() -> Chapter:
    """Compare adhesive spheres with Maugis and JKR."""
    radius, force, energy, modulus, cells = 1.0, 1e-5, 3.2e-5, 1.48, 256
    reach = (radius * (energy / modulus) ** 2) ** (1 / 3)        # range for a Tabor parameter of 1
    tabor = np.array([0.1, 0.3, 0.6, 1.0, 3.0, 5.0])
    jkr = theory.jkr(radius, modulus, energy, force=force).contact_radius

    def computed(parameter: float, potential: str) -> float:
        length = reach / parameter
        side = 2.6 * math.hypot(0.075, math.sqrt((5.0 if potential == "exponential" else 2.0)
                                                 * length))
        sphere = asperity.surface.shape("paraboloid", cells, lx=side, radius=radius,
                                        boundary="free")
        contact = asperity.solve_adhesive(
            sphere, side, None, modulus, potential=potential, energy=energy, range=length,
            force=force, boundary="free", max_iterations=3000)
        return side * math.sqrt(contact.contact_area / math.pi)

    def known(parameter: float) -> float:
        return theory.maugis(radius, modulus, energy, force=force,
                             range=reach / parameter).contact_radius

    def pull_off(parameter: float, cell: float) -> Row:
        """Find the largest pull with cells of `cell` E* range^2/energy."""
        exact = theory.maugis(radius, modulus, energy, force=0.0, maugis_parameter=parameter)
        length = reach * (9 / (2 * math.pi)) ** (1 / 3) / parameter
        side = 4 * (math.pi * energy * radius**2 / (4 / 3 * modulus)) ** (1 / 3)
        n = round(side / (cell * modulus * length**2 / energy))
        sphere = asperity.surface.shape("paraboloid", n, lx=side, radius=radius, boundary="free")
        contact, least = "non_adhesive", 0.0
        for approach in np.linspace(0.0, -0.09 * side**2 / radius, 25):
            contact = asperity.solve_adhesive(
                sphere, side, None, modulus, potential="maugis_dugdale", energy=energy,
                range=length, displacement=approach, boundary="free", start=contact)
            least = min(least, contact.force)
            if contact.contact_area == 0.0:
                break
        return Row(f"Maugis-Dugdale, lambda {parameter:g}, cells of {cell:g} E\\*"
                   " range²/energy, pull-off", -least * 1e6, -exact.pull_off_force * 1e6, "µN")

    square = {t: computed(t, "maugis_dugdale") for t in tabor[tabor <= 1.0]}
    smooth = {t: computed(t, "exponential") for t in tabor}
    rows = [Row(f"contact radius, Maugis-Dugdale, Tabor parameter {t:g}", a * 1e3, known(t) * 1e3,
                "mm")
            for t, a in square.items()]
    rows.append(Row("contact radius, exponential, Tabor parameter 5, JKR", smooth[5.0] * 1e3,
                    jkr * 1e3, "mm"))
    rows += [pull_off(*given) for given in ((1.0, 0.13), (2.0, 0.13), (2.0, 0.26), (5.0, 0.8))]
    figure, axes = plt.subplots(figsize=(4.6, 3.6), layout="constrained")
    fine = np.geomspace(0.05, 10.0, 60)
    axes.semilogx(fine, [known(t) * 1e3 for t in fine], color=BLUE, label="Maugis")
    axes.axhline(jkr * 1e3, color="grey", ls="--", label="JKR")
    axes.plot(square.keys(), [a * 1e3 for a in square.values()], "o", mfc="none", color=BLUE,
              label="Asperity, Maugis-Dugdale")
    axes.plot(smooth.keys(), [a * 1e3 for a in smooth.values()], "x", color=RED,
              label="Asperity, exponential")
    axes.set(xlabel="Tabor parameter", ylabel="Contact radius (mm)")
    axes.legend()
    return Chapter(
        "Maugis and JKR: adhesive spheres",
        "The sphere is that of the thesis, figure 1.7: R = 1 m, F = 10 µN, work of adhesion 32"
        f" µJ/m², E\\* = 1.48 Pa, with a free boundary and {cells} x {cells} cells. The contact"
        " radius is that of the cells in contact. Maugis's theory describes the Maugis-Dugdale"
        " potential; the exponential potential must approach JKR at large Tabor parameters. The"
        " last rows are the largest pull when the same sphere is pulled off by its displacement on"
        " coarse grids, which must not depend on the cells.",
        rows, finish(figure, "maugis.png"), "Contact radius against the Tabor parameter.")


def mindlin() -> Chapter:
    """Compare a sphere that is moved there and back with Cattaneo and Mindlin."""
    case = asperity.Case.read(EXAMPLES / "mindlin" / "input.nml")
    result = run(str(case))
    history, load = result.history, case.phase[0].force
    mu, area = case.friction.coefficient, result.grid.lx * result.grid.ly
    way = history["road_x"]
    exact = theory.mindlin(50e-3, 200e6, 0.0, mu, load, shift=way)
    ours = history["traction_x"] * area
    rows = []
    for name, step in (("loading", 3), ("loading", 6), ("loading", 9), ("unloading", 15),
                       ("unloading", 21), ("reloading", 33)):
        rows.append(Row(f"tangential force, {name}, shift {way[step] * 1e6:.3g} µm", ours[step],
                        float(exact.tangential[step]), "N"))
    snapshot = next(one for one in result.snapshots if one.step == 6)
    stuck = (snapshot.contact == 1).sum() * result.grid.dx * result.grid.dy
    rows.append(Row("stick radius, loading, shift 4.8 µm", math.sqrt(stuck / math.pi) * 1e3,
                    float(exact.stick_radius[6]) * 1e3, "mm"))
    figure, axes = plt.subplots(figsize=(4.6, 3.6), layout="constrained")
    fine = np.concatenate([np.linspace(a, b, 60) for a, b in
                           ((0, 7.2e-6), (7.2e-6, -7.2e-6), (-7.2e-6, 7.2e-6))])
    axes.plot(fine * 1e6, theory.mindlin(50e-3, 200e6, 0.0, mu, load, shift=fine).tangential,
              color=BLUE, label="theory")
    axes.plot(way * 1e6, ours, "o", ms=4, mfc="none", color=RED, label="Asperity")
    axes.set(xlabel="Shift of the sphere (µm)", ylabel="Tangential force (N)")
    axes.legend()
    return Chapter(
        "Cattaneo and Mindlin: a sphere moved sideways",
        "A sphere is pressed, moved to nine tenths of the displacement at full sliding, moved"
        " back as far to the other side, and moved forward again: R = 50 mm, G = 200 MPa, ν = 0,"
        " for which the theory is exact, µ = 0.4. The boundary is free, with 128 x 128 cells, 107"
        " of them over the contact. The stick radius is obtained by counting cells. A study has"
        " [other Poisson ratios](../examples/mindlin/README.md).",
        rows, finish(figure, "mindlin.png"), "Tangential force against the shift.")


def cylinder() -> Chapter:
    """Compare a cylinder that slides with friction on the slope with Hunter's pressure."""
    rows = []
    steady = theory.hunter(10e-3, 100.0, 0.11, Prony(0.333e6, [3e6], [1.11e-3]))
    for name, slope in (("no friction", None), ("µ = 1.5, without slope", False),
                        ("µ = 1.5, with slope", True)):
        case = asperity.Case.read(EXAMPLES / "cylinder_friction" / "input.nml")
        if slope is None:
            del case.friction.law, case.friction.coefficient
            known = steady.friction_force
        else:
            case.friction.slope_effect = slope
            known = steady.total_friction_force(1.5, slope_effect=slope)
        rows.append(Row(f"tangential force, {name}",
                        100.0 * run(str(case)).history["friction"][-1], known, "N/m"))
    return Chapter(
        "A cylinder with friction, on the true slope",
        "The case is that of the thesis, section 3.5.1: R = 10 mm, 100 N/m, 110 mm/s, a spring of"
        " 0.333 MPa and an arm of 3 MPa and 1.11 ms. The reference is the bound of the friction"
        " law on the arc under Hunter's pressure. The thesis has 4.5, 154 and 165 N/m, and its"
        " finite elements 168 N/m for the last. The case is in plane strain, with 2048 cells over"
        " 24 mm; the periodic images change the viscous part by 0.6 %. See also [the"
        " study](../examples/cylinder_friction/README.md).", rows)


def books() -> Chapter:
    """Check the energy balance of a run with all parts of the physics."""
    result = run("""&grid nx = 96, ny = 64, lx = 0.3e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 75e-6,
         wavelength_short = 25e-6 /
&material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-5, 1e-3, thickness = 0.5e-3,
          density = 100 /
&adhesion potential = 'exponential', energy = 0.02, range = 0.2e-6 /
&friction law = 'coulomb', coefficient = 0.5 /
&phase pressure = 0.2e6, duration = 50e-6, ramp = 'linear', steps = 20 /
&phase velocity_x = 0.8, velocity_y = 0.3, duration = 150e-6 /
&phase pressure = 0.1e6, velocity_x = 0.2, duration = 200e-6 /
&solver tolerance = 1e-7 /
""")
    h = result.history
    put_in = h["work_normal"] + h["work_tangential"]
    stored = h["energy_elastic"] + h["energy_adhesive"] + h["energy_kinetic"]
    lost = h["dissipated_viscous"] + h["dissipated_friction"]
    left = np.abs(put_in - (stored - stored[0]) - lost
                  - (put_in[0] - lost[0])).max() / np.abs(put_in).max()
    return Chapter(
        "The energy balance",
        "A rough road under a viscoelastic block with inertia, adhesion and friction on the true"
        " slope is loaded by a ramp, driven obliquely, and then driven under half of the load in"
        f" another direction, in {len(put_in)} rows. Of the work put in, {put_in[-1] * 1e9:.3g} nJ,"
        f" {h['dissipated_friction'][-1] * 1e9:.3g} nJ are lost by friction and"
        f" {h['dissipated_viscous'][-1] * 1e9:.3g} nJ in the rubber. In every row the balance"
        f" closes within {left:.0e} of the work.")


def kink() -> Chapter:
    """Ramp the load of a flat punch up and down, and compare with exact creep."""
    cells = 24
    i = np.arange(cells) - (cells - 1) / 2
    punch = np.where(np.hypot(*np.meshgrid(i, i)) < 7, 0.0, -1e-2)
    path = Path(run.folder) / "punch.h5"
    with h5py.File(path, "w") as file:
        file["surface"] = punch
    head = (f"&grid nx = {cells}, ny = {cells}, lx = 24e-3, boundary = 'free' /\n"
            f"&surface shape = 'file', file = '{path}' /\n")
    constant = 1e6 * float(run(head + "&material shear_modulus = 1e6 /\n&phase force = 1 /\n"
                               "&solver tolerance = 1e-10 /\n").history["displacement"][0])

    def ramp(solid: Prony, t: FloatArray) -> FloatArray:
        """Integrate the creep compliance from 0 by Gauss's rule; 0 for negative times."""
        nodes, weights = np.polynomial.legendre.leggauss(40)
        edges = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 25)])
        out = np.zeros_like(t)
        for k, end in enumerate(np.maximum(t, 0.0)):
            for low, high in zip(end * edges[:-1], end * edges[1:], strict=True):
                s = 0.5 * (low + high) + 0.5 * (high - low) * nodes
                out[k] += 0.5 * (high - low) * weights @ solid.creep_compliance(s)
        return out

    lines = []
    for tau in ([0.3], [0.01, 0.1, 1.0], [1e-3, 1e-2, 0.1, 1.0, 10.0],
                [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0]):
        solid = Prony(0.1e6, [1e6] * len(tau), tau)
        for scheme in ("exponential", "exponential2"):
            errors = []
            for steps in (8, 16, 32, 64):
                result = run(head + f"&material shear_modulus = 0.1e6, prony_g = {len(tau)}*1e6,"
                             f" prony_tau = {', '.join(map(repr, tau))} /\n"
                             + "".join(f"&phase force = {force}, duration = 1, ramp = 'linear',"
                                       f" steps = {steps} /\n" for force in (1.0, 0.3))
                             + f"&solver tolerance = 1e-10, time_scheme = '{scheme}' /\n")
                t = result.history["time"][steps + 1:]
                exact = constant * (ramp(solid, t) - 1.7 * ramp(solid, t - 1.0))
                errors.append(np.abs(result.history["displacement"][steps + 1:] - exact).max()
                              / result.history["displacement"].max())
            lines.append(f"| {len(tau)} | `{scheme}` | "
                         + " | ".join(f"{error:.1e}" for error in errors) + " |")
    return Chapter(
        "A ramp that turns",
        "A flat punch is loaded by a force that grows for one second and then falls to 0.3 of its"
        " maximum in another second. The contact never changes, so that the approach is exactly"
        " the creep of the material times an elastic constant of the mesh. The arms have 1 MPa"
        " each and are a decade apart, in parallel with a spring of 0.1 MPa. The table shows the"
        " error of the worst row after the turn, relative to the largest approach, for different"
        " numbers of steps per ramp.\n\n"
        "| arms | scheme | 8 | 16 | 32 | 64 |\n| --- | --- | --- | --- | --- | --- |\n"
        + "\n".join(lines))


def block() -> Chapter:
    """Compare the motion of a block with mass under friction and changing loads."""
    height, density, road, modulus = 1e-3, 2000.0, 0.3, 1e6
    mass = density * height / 2
    period = 2 * np.pi * math.sqrt(height * mass / modulus)
    g, tau = np.array([0.3e6, 0.2e6]), np.array([0.05, 0.5]) * period
    frictions = (4e4, 1.2e4, 3e4)

    def exact(times: FloatArray) -> FloatArray:
        """Integrate the motion in short steps; changes of stick and slip are found by bisection."""
        y, sticks, sign, t, rows = np.zeros(4), True, 1.0, 0.0, []

        def stress(y: FloatArray) -> float:
            return modulus * y[0] / height + y[2:].sum()

        def rate(y: FloatArray) -> FloatArray:
            speed = y[1] + road
            force = 0.0 if sticks else (sign * bound - stress(y)) / mass
            return np.array([speed, force, *(g * speed / height - y[2:] / tau)])

        def step(y: FloatArray, dt: float) -> FloatArray:
            a = rate(y)
            b = rate(y + dt / 2 * a)
            c = rate(y + dt / 2 * b)
            return y + dt / 6 * (a + 2 * b + 2 * c + rate(y + dt * c))

        def turns(y: FloatArray) -> bool:
            return abs(stress(y)) > bound if sticks else y[1] * sign > 0

        for end in times:
            bound = frictions[min(2, int((t + 1e-9 * period) / (4 * period)))]
            while t < end - 1e-9 * period:
                if sticks and abs(stress(y)) > bound:
                    sticks, sign = False, math.copysign(1.0, stress(y))
                dt = min(period / 1000, end - t)
                after = step(y, dt)
                if turns(after):
                    low, high = 0.0, dt
                    for _ in range(50):
                        dt = (low + high) / 2
                        low, high = (low, dt) if turns(step(y, dt)) else (dt, high)
                    dt, after = high, step(y, high)
                    if not sticks:
                        after[1] = 0.0
                    sticks = not sticks and abs(stress(after)) <= bound
                    sign = math.copysign(1.0, stress(after))
                y, t = after, t + dt
            rows.append(y[:2])
        return np.array(rows)

    lines = []
    for steps in (10, 20, 40, 80, 160):
        phases = "".join(f"&phase pressure = {2 * f}, velocity_x = {road}, duration = {4 * period!r},"  # noqa: E501
                         f" steps = {4 * steps} /\n" for f in frictions)
        result = run(f"""&grid nx = 4, ny = 2, lx = 2e-3 /
&surface shape = 'flat' /
&material shear_modulus = {modulus}, prony_g = 0.3e6, 0.2e6,
          prony_tau = {float(tau[0])!r}, {float(tau[1])!r},
          thickness = {height}, density = {density} /
&friction law = 'coulomb', coefficient = 0.5 /
&solver tolerance = 1e-10, passes = 4 /
{phases}""")
        h = result.history
        timed = np.flatnonzero(np.diff(h["time"], prepend=-1.0) > 0)[1:]
        # displacement of the interface: that of the road minus the distance it has slid
        slid = np.cumsum(h["sliding_speed"][timed] * np.diff(h["time"][timed], prepend=0.0))
        found = h["road_x"][timed] - slid
        known = exact(h["time"][timed])
        kinetic = np.sqrt(2 * h["energy_kinetic"][timed] / (mass * result.grid.lx * result.grid.ly))
        errors = [np.sqrt(np.mean((a - b) ** 2) / np.mean(b ** 2))
                  for a, b in ((found, known[:, 0]), (kinetic, np.abs(known[:, 1])))]
        missing = np.abs(h["work_missing"]).max() / np.abs(h["work_drive"] + h["work_load"]).max()
        lines.append(f"| {steps} | {errors[0]:.1e} | {errors[1]:.1e} "
                     f"| {h['dissipated_numerical'][-1] / h['dissipated_viscous'][-1]:.1e} "
                     f"| {missing:.1e} |")
    return Chapter(
        "A block with mass",
        "A flat block with two arms and a mass on a flat road is dragged by friction: it sticks,"
        " slips and oscillates. After four periods the load drops, after eight it rises. The exact"
        " motion is that of one mass on a spring with arms under Coulomb friction. The columns are"
        " the rms errors over all rows, relative to the rms of the displacement and of the speed;"
        " the numerical loss over the loss in the rubber; and the missing work over the work of"
        " load and drive.\n\n"
        "| steps per period | displacement | speed | numerical over viscous loss | missing work |\n"
        "| --- | --- | --- | --- | --- |\n" + "\n".join(lines))


def steep_map(slope: float, nx: int = 9, ny: int = 6, length: float = 1e-3) -> FloatArray:
    """Return a periodic map of three waves with an rms slope."""
    dx = length / nx
    x, y = np.meshgrid(np.arange(nx) * dx, np.arange(ny) * dx)
    height, square = np.zeros_like(x), 0.0
    for i, j, phase in ((1, 0, 3.0), (1, 1, 1.0), (2, 0, 5.0)):
        k = 2 * math.pi * np.array([i / length, j / (ny * dx)])
        height += np.cos(k[0] * x + k[1] * y + phase) / np.hypot(*k)
        square += 0.5
    return height * slope / math.sqrt(square)


def steep() -> Chapter:
    """Drive a block over steep roads, and compare whole steps with a dense Newton method."""
    nx, ny, length, mu, dt = 9, 6, 1e-3, 0.8, 5e-4
    arms = [(2e6, 2e-4), (1e6, 3e-3)]
    rows, lines = [], []
    for slope in (0.2, 0.3, 0.4, 0.5):
        height = steep_map(slope, nx, ny, length)
        path = Path(run.folder) / f"steep_{slope}.h5"
        with h5py.File(path, "w") as file:
            file["surface"] = height
        pressure = 1.6e6 * slope
        text = f"""&grid nx = {nx}, ny = {ny}, lx = {length}, ly = {ny * length / nx!r} /
&surface shape = 'file', file = '{path}' /
&material poisson = 0.4, shear_modulus = 1e6, thickness = 0.5e-3, prony_g = 2e6, 1e6,
          prony_tau = 2e-4, 3e-3 /
&friction law = 'coulomb', coefficient = {mu} /
&phase pressure = {pressure!r} /
&phase velocity_x = 0.1, velocity_y = 0.04, duration = {6 * dt}, steps = 6 /
&phase pressure = {pressure / 2!r} /
&solver tolerance = 1e-9, time_scheme = 'exponential', passes = PASSES /
&output snapshot_every = 1 /
"""
        result = run(text.replace("PASSES", "0"))
        block = Block(height, length / nx, poisson=0.4, thickness=0.5e-3, long_term=1e6, arms=arms,
                      coefficient=mu)
        steps = [(pressure, (0.0, 0.0), 0.0)] + 6 * [(pressure, (0.1 * dt, 0.04 * dt), dt)] + [
            (pressure / 2, (0.0, 0.0), 0.0)]
        worst = left = 0.0
        known = []
        for snapshot, step in zip(result.snapshots, steps, strict=True):
            left = max(left, block.step(*step))
            known.append(block.traction[0].mean())
            worst = max(worst, *(
                np.abs(found.ravel() - exact).max() / block.pressure.max() for found, exact in (
                    (snapshot.pressure, block.pressure), (snapshot.traction_x, block.traction[0]),
                    (snapshot.traction_y, block.traction[1]))))
        history = result.history
        rows += [Row(f"traction along x, rms slope {slope}, step 6", history["traction_x"][6] / 1e3,
                     known[6] / 1e3, "kPa"),
                 Row(f"traction along x, rms slope {slope}, half the load",
                     history["traction_x"][7] / 1e3, known[7] / 1e3, "kPa")]
        two = run(text.replace("PASSES", "2, coupling_tolerance = 1")).history["traction_x"]
        lines.append(f"| {slope} | {history['passes'][1:].max()} | {worst:.1e} | {left:.1e} "
                     f"| {100 * (two[6] / known[6] - 1):+.2g} % "
                     f"| {100 * (two[7] / known[7] - 1):+.2g} % |")
    return Chapter(
        "A steep road",
        "Three waves under a viscoelastic block (ν = 0.4, two arms, half a wavelength thick, µ ="
        " 0.8) are pressed and driven obliquely for six steps of a third of a cell; then half of"
        " the load is removed at once. The reference shares no part with the program: it solves"
        " each whole step by Newton's method for the pressures and tractions of all cells, with"
        " dense matrices (python/tests/coupled_reference.py). The first columns are the largest"
        " number of passes of a row, the largest difference of pressure and traction in any cell"
        " and row relative to the largest pressure, and the residual of the reference. The last"
        " two columns are the errors of the mean traction if only two passes are allowed (`passes"
        " = 2`), after six steps and under half of the load.\n\n"
        "| rms slope | passes | all cells, all rows | reference | two passes | two passes, half the"
        " load |\n| --- | --- | --- | --- | --- | --- |\n" + "\n".join(lines), rows)


def drop() -> Chapter:
    """Reduce the load of a sphere in partial slip, and compare with Cattaneo and Mindlin."""
    radius, modulus, mu, side = 10e-3, 1e6, 0.01, 2.7e-3
    load = 8 * modulus * 1e-9 / (3 * radius)
    shift = 0.4 * mu * 1e-6 / radius
    rows = []
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for factor, colour in ((0.9, GREEN), (0.5, BLUE)):
        result = run(f"""&grid nx = 192, ny = 192, lx = {side}, boundary = 'free' /
&surface shape = 'paraboloid', radius = {radius} /
&material poisson = 0, shear_modulus = {modulus} /
&friction law = 'coulomb', coefficient = {mu}, slope_effect = .false. /
&phase force = {load!r} /
&phase velocity_x = 1e-3, duration = {shift / 1e-3!r}, steps = 8 /
&phase force = {factor * load!r}, velocity_x = 1e-3, duration = {shift / 1e-3!r}, steps = 8 /
&solver tolerance = 1e-8 /
&output snapshot_every = 1 /
""")
        history = result.history
        found, way = history["traction_x"] * side**2, history["road_x"]

        def known(force: float, way: FloatArray) -> tuple[FloatArray, FloatArray]:
            """Return force and stick radius, which follow from d(c) = d(a) - shift/mu."""
            depth = 1e-4 * (force / load) ** (2 / 3)
            return (theory.mindlin(radius, modulus, 0.0, mu, force, shift=way).tangential,
                    np.sqrt(radius * np.maximum(depth - way / mu, 0.0)))

        fine = np.linspace(shift, 2 * shift, 60)
        left.plot(np.linspace(0, shift, 60) * 1e6, known(load, np.linspace(0, shift, 60))[0] * 1e6,
                  color="grey")
        left.plot(fine * 1e6, known(factor * load, fine)[0] * 1e6, color=colour,
                  label=f"theory, {factor} of the load")
        left.plot(way * 1e6, found * 1e6, "o", ms=4, mfc="none", color=colour)
        snapshot = next(one for one in result.snapshots if one.step == 9)
        x = result.grid.x - side / 2
        middle = snapshot.traction_x[95:97].mean(axis=0)
        near = np.abs(x) < 1.1e-3
        right.plot(x[near] * 1e3, middle[near] / 1e3, color=colour,
                   label=f"traction, {factor} of the load")
        right.plot(x[near] * 1e3, mu * snapshot.pressure[95:97].mean(axis=0)[near] / 1e3, ":",
                   color=colour)
        stick = np.sqrt(history["stick_area"] / math.pi) * side
        for row, when in ((9, "at once"), (13, f"shift {way[13] * 1e6:.3g} µm"),
                          (17, f"shift {way[17] * 1e6:.3g} µm")):
            force, radius_known = known(factor * load, way[row])
            rows.append(Row(f"tangential force, {factor} of the load, {when}", found[row] * 1e6,
                            float(force) * 1e6, "µN"))
            if radius_known > 0 and row == 9:
                rows.append(Row(f"stick radius, {factor} of the load, {when}", stick[row] * 1e3,
                                float(radius_known) * 1e3, "mm"))
    left.set(xlabel="Shift of the sphere (µm)", ylabel="Tangential force (µN)")
    left.legend(title="circles: Asperity")
    right.set(xlabel="x (mm), right after the drop", ylabel="kPa")
    right.legend(title="dotted: bound")
    return Chapter(
        "A drop of the load in partial slip",
        "A sphere (R = 10 mm, G = 1 MPa, ν = 0, µ = 0.01, contact radius 1 mm) is moved sideways"
        f" by {shift * 1e9:.3g} nm, which is four tenths of the displacement at full sliding. Then"
        " a tenth or half of the load is removed at once, and the sphere is moved on. No time"
        " passes in the drop and the sphere does not move, but points whose traction exceeds the"
        " bound slip back and load their neighbours. With proportional slip the state is that of"
        " Cattaneo and Mindlin under the new load. The boundary is free, with 192 x 192 cells, 142"
        " of them over the contact at first. The stick radius is obtained by counting cells.",
        rows, finish(figure, "drop.png"),
        "Tangential force against the shift; tractions on the middle line right after the drop.")


CHAPTERS: dict[str, Callable[[], Chapter]] = {
    "hertz": hertz,
    "westergaard": westergaard,
    "lee_radok": lee_radok,
    "lee_radok_order": lee_radok_order,
    "hunter": hunter,
    "waves": waves,
    "adhesion": adhesion,
    "mindlin": mindlin,
    "cylinder": cylinder,
    "steep": steep,
    "drop": drop,
    "books": books,
    "kink": kink,
    "block": block,
}

HEAD = """# Validation

This page compares runs of the program with known solutions. `python tools/validation.py` writes the
page and its figures. The tests contain the same cases with stated tolerances, and many more:
translations of the road, mirror images, quarter turns, scaling, threads and restarts, none of which
may change a result, orders of convergence, and limits. The references are those of
`asperity.theory`, which cites the papers. The [gallery](gallery.md) compares cases without an exact
solution, rough roads above all, with Persson's theory and with the thesis.
"""


def main() -> None:
    """Run the chapters, and write the page if all are run."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("names", nargs="*", metavar="NAME", choices=[[], *CHAPTERS],
                        help=f"only these chapters, without the page: {', '.join(CHAPTERS)}")
    names = parser.parse_args().names
    chapters = []
    asperity.set_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        run.folder = folder
        for name in names or CHAPTERS:
            chapters.append(CHAPTERS[name]())
            print(chapters[-1].markdown(), "\n", flush=True)
    if not names:
        DOCS.mkdir(exist_ok=True)
        (DOCS / "validation.md").write_text(
            "\n".join([HEAD, *(chapter.markdown() + "\n" for chapter in chapters)]))


if __name__ == "__main__":
    main()
