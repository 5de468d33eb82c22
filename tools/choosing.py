"""Measure the effect and the cost of mesh, time step, arms, tolerance, passes and mass.

    python tools/choosing.py [NAME ...]      # mesh, step, arms, tolerance, adhesion, ...

This prints the tables of docs/choosing.md, writes them into the page between their marks, and draws
the figures docs/figures/choosing_*.png. All parts together take about two minutes on one processor.
"""

import os
import re
import runpy
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import h5py
import matplotlib
import numpy as np

import asperity
from asperity.material import Prony
from asperity.theory import hunter, persson, self_affine_psd

matplotlib.use("Agg")
from matplotlib import pyplot

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "choosing.md"
FIGURES = ROOT / "docs" / "figures"
FOLDER = Path(tempfile.mkdtemp())
BLUE, RED, GREEN, PINK, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#888888"


def run(text, name):
    """Run an input and return its history, up to where a solver did not converge."""
    case = FOLDER / f"{name}.nml"
    case.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")              # some cases are too coarse on purpose
        try:
            return asperity.run(case, threads=1).history
        except asperity.NotConverged as error:
            return error.result.history


def table(head, rows):
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def axes(columns, width=4.2):
    """Return a figure of one row and its axes."""
    figure, parts = pyplot.subplots(1, columns, figsize=(width * columns, 3.4),
                                    layout="constrained", squeeze=False)
    return figure, parts[0]


def mesh():
    """Measure contact area and mean gap of one rough surface on finer and finer grids."""
    counts, rows, contacts, values = (2, 4, 8, 16, 32), [], {}, []
    for cells in counts:
        n = 32 * cells
        height = asperity.surface.self_affine(
            n, lx=1.0, hurst=0.8, wavelength_long=0.25, wavelength_short=1 / 32 * (1 + 1e-9),
            rms_slope=0.1, seed=1)
        contacts[cells] = asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=0.005)
        area = contacts[cells].contact_area
        values.append((area, contacts[cells].gap.mean() / height.std()))
        rows.append([str(cells), f"{values[-1][0]:.4f}", f"{values[-1][1]:.4f}"])
    figure, (left, *maps) = axes(3)
    area, gap = np.array(values).T
    left.loglog(counts[:-1], 100 * np.abs(area[:-1] / area[-1] - 1), "o-", color=BLUE,
                label="contact area")
    left.loglog(counts[:-1], 100 * np.abs(gap[:-1] / gap[-1] - 1), "s--", color=RED,
                label="mean gap")
    left.set(xlabel="Cells in the shortest wave", ylabel="Error, %", xticks=counts[:-1],
             title="Against 32 cells")
    left.set_xticklabels(counts[:-1])
    left.minorticks_off()
    left.legend()
    for axis, cells in zip(maps, (4, 32), strict=True):
        # The same corner of the surface, around the largest contact of the fine grid.
        n = 32 * cells
        first = contacts[32].pressure
        j, i = np.unravel_index(first.argmax(), first.shape)
        part = np.arange(-3 * cells, 3 * cells)
        pressure = contacts[cells].pressure
        rows_ = (j * n // 1024 + part) % n
        columns = (i * n // 1024 + part) % n
        picture = axis.imshow(np.where(pressure > 0, pressure, np.nan)[np.ix_(rows_, columns)],
                              origin="lower", extent=(-3, 3, -3, 3), cmap="viridis", vmin=0,
                              vmax=first.max())
        axis.set(title=f"{cells} cells in the shortest wave",
                 xlabel="x, shortest waves", facecolor="#e8e8e8")
    figure.colorbar(picture, ax=maps, label="Pressure / E*")
    return table(["cells in the shortest wave", "contact area", "mean gap, rms heights"],
                 rows), figure


def slide(surface, n, ny, pressure, *, steps, interpolation, way=1e-3):
    """Slide a rubber with two arms at 1 m/s on a road of 1 mm without friction."""
    return run(f"""
        &grid nx = {n}, ny = {ny}, lx = 1e-3 /
        &surface {surface} /
        &material shear_modulus = 1e6, prony_g = 2e6, 1e6, prony_tau = 1e-5, 1e-3,
                  thickness = 1e-3 /
        &phase pressure = {pressure}, relaxed = .true. /
        &phase duration = {way}, velocity_x = 1.0, steps = {steps} /
        &solver tolerance = 1e-6, interpolation = '{interpolation}' /
        """, "slide")


def slopes():
    """Measure friction on a rough road and on bars with sharp edges, with both interpolations."""
    rough = ("shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, "
             "wavelength_long = 0.25e-3, wavelength_short = 62.5e-6")
    rows = []
    for cells in (4, 6, 8, 12, 16):
        n = 16 * cells
        row = [str(cells)]
        for interpolation in ("linear", "cubic"):
            history = slide(rough, n, n, 0.2e6, steps=n // 4, interpolation=interpolation,
                            way=0.25e-3)
            row.append(f"{history['friction'][-n // 16:].mean():.4f}")
        rows.append(row)
    smooth = table(["cells in the shortest wave", "`linear`", "`cubic`"], rows)

    rows = []
    for n in (64, 128, 256):
        x = (np.arange(n) + 0.5) / n * 4 % 1
        path = FOLDER / f"bars_{n}.h5"
        with h5py.File(path, "w") as file:
            file["height"] = 1e-5 * np.clip((0.25 - abs(x - 0.5)) / 0.05, -1, 1)[None, :]
        for parts in (1, 4):
            row = [str(n // 4), str(parts)]
            for interpolation in ("linear", "cubic"):
                history = slide(f"shape = 'file', file = '{path}', dataset = 'height'", n, 1, 5e4,
                                steps=2 * n * parts, interpolation=interpolation, way=2e-3)
                wave = slice(-1 - n // 4 * parts, None)
                lost = np.ptp((history["work_normal"] - history["work_load"])[wave])
                lost /= history["force"][-1] * np.ptp(history["road_x"][wave])
                row += [f"{history['friction'][wave][1:].mean():.4f}", f"{lost:.4f}"]
            rows.append(row)
    sharp = table(["cells per bar and gap", "steps per cell", "`linear`", "its loss", "`cubic`",
                   "its loss"], rows)
    return {"slopes": smooth, "kinks": sharp}, None


def step():
    """Compare the friction of a sliding cylinder with Hunter's solution."""
    glassy, ratio, creep, radius, load = 2.75e6, 9.0, 1e-2, 10e-3, 50.0
    rubber = Prony.from_zener(0.0, [glassy], [glassy / ratio], [creep * glassy / ratio])
    speed, nx, lx = 0.02, 1536, 36e-3
    exact = float(hunter(radius, load, speed, rubber).friction)
    schemes, sizes = ("exponential2", "exponential", "backward_euler"), (4.0, 2.0, 1.0, 0.5)
    errors = np.zeros((len(sizes), len(schemes)))
    for row, cells in enumerate(sizes):
        for column, scheme in enumerate(schemes):
            dt = cells * lx / nx / speed
            history = run(f"""
                &grid nx = {nx}, ny = 1, lx = {lx}, ly = 1.0 /
                &surface shape = 'paraboloid', radius = {radius} /
                &material shear_modulus = 0.0, zener_g0 = {glassy}, zener_g1 = {glassy / ratio},
                   zener_eta = {creep * glassy / ratio} /
                &phase pressure = {load / lx}, relaxed = .true. /
                &phase duration = {60 * 4 * lx / nx / speed}, dt = {dt}, velocity_x = {speed} /
                &solver time_scheme = '{scheme}', interpolation = 'cubic', tolerance = 1e-7 /
                """, f"step_{cells}_{scheme}")
            errors[row, column] = 100 * (history["friction"][-1] / exact - 1.0)
    figure, (axis,) = axes(1, 5)
    for column, (scheme, colour, mark) in enumerate(zip(schemes, (BLUE, GREEN, RED), "osD",
                                                        strict=True)):
        axis.loglog(sizes, np.abs(errors[:, column]), mark + "-", color=colour, label=scheme)
    axis.set(xlabel="Cells per step", ylabel="Error of the friction, %", xticks=sizes,
             title="Sliding cylinder against Hunter's solution")
    axis.set_xticklabels([f"{size:g}" for size in sizes])
    axis.minorticks_off()
    axis.legend()
    rows = [[f"{cells:g}", *(f"{error:+.2f} %" for error in line)]
            for cells, line in zip(sizes, errors, strict=True)]
    return table(["cells per step", *(f"`{scheme}`" for scheme in schemes)], rows), figure


def tolerance():
    """Compare friction and area of a coarse `speed_jump` with those at a tight tolerance."""
    text = (ROOT / "examples" / "speed_jump" / "input.nml").read_text()
    text = re.sub(r"n([xy]) = 512", r"n\1 = 128", text).replace("15.625e-6", "62.5e-6")
    values = ("1e-3", "1e-4", "1e-5", "1e-6", "1e-8")
    histories = {value: run(text.replace("tolerance = 1e-5", f"tolerance = {value}"), value)
                 for value in values}
    exact, rows, found = histories["1e-8"], [], []
    for value, history in histories.items():
        friction = np.abs(history["friction"][1:] / exact["friction"][1:] - 1.0).max()
        area = np.abs(history["contact_area"] - exact["contact_area"]).max()
        found.append((float(value), 100 * friction, 100 * area, history["ffts"].mean()))
        rows.append([value, f"{100 * friction:.4f} %", f"{area:.5f}", f"{found[-1][3]:.0f}"])
    found = np.array(found).T
    figure, (left, right) = axes(2)
    left.loglog(found[0, :-1], found[1, :-1], "o-", color=BLUE, label="friction, relative")
    seen = found[2, :-1] > 0
    left.loglog(found[0, :-1][seen], found[2, :-1][seen], "s--", color=RED,
                label="contact area, of the grid")
    left.set(xlabel="tolerance", ylabel="Largest change, %", title="Against 1e-8")
    left.legend()
    right.semilogx(found[0], found[3], "o-", color=BLUE)
    right.set(xlabel="tolerance", ylabel="FFTs per step", ylim=(0, None), title="Cost")
    return table(["`tolerance`", "friction", "contact area", "FFTs per step"], rows), figure


def adhesion():
    """Find the pull-off force of an elastic sphere, Tabor parameter 2, on finer and finer grids."""
    modulus, energy, reach, radius, lx = 4e6, 0.05, 0.27e-6, 1e-3, 0.2e-3
    limit = 0.7 * modulus * reach**2 / energy
    approaches = np.linspace(0.4e-6, -1.4e-6, 37)
    rows, curves = [], {}
    for n in (24, 32, 48, 64, 96, 192):
        phases = "\n".join(f"&phase displacement = {approach} /" for approach in approaches)
        history = run(f"""
            &grid nx = {n}, ny = {n}, lx = {lx}, boundary = 'free' /
            &surface shape = 'paraboloid', radius = {radius} /
            &material poisson = 0.5, shear_modulus = {modulus / 4} /
            &adhesion potential = 'exponential', energy = {energy}, range = {reach} /
            {phases}
            &solver tolerance = 1e-6 /
            """, f"adhesion_{n}")
        curves[n] = history["displacement"], history["force"] / (np.pi * energy * radius)
    finest = curves[192][1].min()
    for n, (_, force) in curves.items():
        rows.append([f"{lx / n * 1e6:.2f}", f"{0.7 * lx / n / limit:.2f}", f"{force.min():.4f}",
                     f"{100 * (force.min() / finest - 1):+.2f} %"])
    figure, (left, right) = axes(2)
    for n, colour, mark in ((24, RED, "D"), (48, GREEN, "s"), (192, BLUE, "o")):
        displacement, force = curves[n]
        left.plot(displacement * 1e6, force, mark + "-", color=colour, markersize=3,
                  label=f"dx = {0.7 * lx / n / limit:.2f} E* range²/energy")
    left.set(xlabel="Approach, µm", ylabel="Force / (π energy R)", title="Pulled off, step by step")
    left.set_xticks(np.arange(-1.5, 0.6, 0.5))
    left.legend(fontsize="small")
    sizes = np.array([float(row[1]) for row in rows])
    right.loglog(sizes[:-1], [abs(float(row[3].split()[0])) for row in rows][:-1], "o-", color=BLUE)
    right.axvline(0.7, color=GREY, linestyle="--")
    ticks = (0.4, 0.7, 1.0, 1.4)
    right.set(xlabel="dx, E* range²/energy", ylabel="Error of the pull-off force, %",
              title="Against the finest grid", xticks=ticks)
    right.set_xticklabels([f"{tick:g}" for tick in ticks])
    right.xaxis.set_minor_locator(pyplot.NullLocator())
    return table(["dx, µm", "dx, E\\* range²/energy", "pull-off force, π energy R", "error"],
                 rows), figure


#: Numbers of passes in tables and figures.
PASSES = {1: "1", 2: "2", 4: "4", 0: "0: until settled"}


def block(thickness, density, passes, steps, *, cells=48, duration=3e-3):
    """Run an elastic block that starts to slide on a wave, with friction; return its history."""
    return run(f"""
        &grid nx = {cells}, ny = 1, lx = 1e-3, ly = 1e-3 /
        &surface shape = 'sine', amplitude = 3e-5, wavelength = 0.5e-3 /
        &material shear_modulus = 1e6, thickness = {thickness}, density = {density} /
        &friction law = 'coulomb', coefficient = 0.5 /
        &phase pressure = 0.15e6 /
        &phase velocity_x = 1, duration = {duration}, steps = {steps} /
        &solver passes = {passes}, coupling_tolerance = 100 /
        """, f"block_{thickness}_{density}_{passes}_{steps}_{cells}")


def ripple(cells, thickness):
    """Return the largest change of friction with position, max |dT/dx|, over the stiffness."""
    thin, modulus = 2e-5, 1e6
    history = block(thin, 0, 0, 16 * 14, cells=cells, duration=14 * 1e-3 / cells)
    last = slice(-64, None)                      # the last four cells: steady sliding
    traction = history["traction_x"][last]
    place = history["road_x"][last] - traction * thin / modulus
    return np.abs(np.gradient(traction, place)).max() * thickness / modulus


def friction():
    """Compare passes, steps and masses for a block that slides with friction."""
    rows = []
    for passes in (1, 2, 4, 0):
        values = []
        for steps in (60, 120, 240):
            history = block(2e-3, 0, passes, steps)
            values.append(history["friction"][history["time"] > 1.5e-3].mean())
        rows.append([PASSES[passes], *(f"{value:.4f}" for value in values)])
    thin = table(["`passes`", "friction, 60 steps", "120 steps", "240 steps"], rows)

    figure, (left, right) = axes(2, 4.6)
    for passes, colour in ((1, RED), (2, GREEN), (0, BLUE)):
        history = block(2e-3, 0, passes, 60)
        left.plot(1e3 * history["time"], history["friction"], color=colour,
                  label=f"passes = {PASSES[passes]}")
    left.set(xlabel="Time, ms", ylabel="Friction coefficient", ylim=(0.45, None),
             xlim=(0.9, 3), title="Block 2 mm thick, no mass")
    left.legend()

    rows, dt = [], 3e-3 / 144                        # one cell per step
    for density in (0, 3, 10, 30, 100, 300):
        history = block(2e-2, density, 0, 144)
        late = history["time"] > 2e-3
        speed = history["sliding_speed"][late]
        period = 2 * np.pi * 2e-2 * np.sqrt(density / 2e6)
        rows.append([f"{density}", f"{period / dt:.0f}", f"{np.std(speed):.1g}",
                     f"{speed.max():.2f}", f"{history['friction'][late].mean():.4f}"])
        if density in (0, 30):
            right.plot(1e3 * history["time"], history["sliding_speed"],
                       color=RED if density == 0 else BLUE, label=f"density = {density} kg/m³")
    right.set(xlabel="Time, ms", ylabel="Mean slip speed, m/s", xlim=(0.9, 3),
              title="Block 20 mm thick")
    right.legend()
    thick = table(["`density`, kg/m³", "period, steps", "rms oscillation of the speed, m/s",
                   "highest speed, m/s", "friction"], rows)

    rows = []
    for cells in (48, 96, 192):
        row = [str(cells // 2), f"{ripple(cells, 2e-2):.1f}"]
        for density, passes in ((0, 2), (0, 4), (0, 0), (30, 0)):
            history = block(2e-2, density, passes, 3 * cells, cells=cells)
            speed = history["sliding_speed"][history["time"] > 2e-3]
            row.append(f"{np.abs(np.diff(speed)).mean():.1g}")
        rows.append(row)
    steps = table(["cells per wave", "h/G max abs(dT/dx)", "2 passes", "4", "settled",
                   "settled, 30 kg/m³"], rows)
    return {"passes": thin, "mass": thick, "swing": steps}, figure


def merge():
    """Slide on a rough road with arms below the time step: kept, merged, and left out."""
    n, side, speed = 128, 1e-3, 0.1
    step = side / n / speed
    tau = step * np.array([10.0, 1.0, 1 / 15, 1 / 150, 1 / 1500])
    g = np.array([1e6, 2e6, 1e7, 5e7, 2e8])
    fast = tau < 0.1 * step
    longest = tau[fast].max()
    cases = {"all five": (g, tau),
             "the fast three merged": (np.append(g[~fast], (g * tau)[fast].sum() / longest),
                                       np.append(tau[~fast], longest)),
             "the fast three left out": (g[~fast], tau[~fast])}
    rows = []
    for name, (moduli, times) in cases.items():
        history = run(f"""
            &grid nx = {n}, ny = {n}, lx = {side} /
            &surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2,
                     wavelength_long = {side / 4}, wavelength_short = {side / 16} /
            &material shear_modulus = 1e6, prony_g = {', '.join(map(str, moduli))},
                      prony_tau = {', '.join(map(str, times))} /
            &phase pressure = 0.2e6, relaxed = .true. /
            &phase velocity_x = {speed}, duration = {64 * step} /
            """, f"merge_{len(rows)}")
        rows.append([name, f"{history['friction'][-20:].mean():.4f}",
                     f"{history['contact_area'][-20:].mean():.4f}"])
    return table(["arms", "friction", "contact area"], rows), None


def arms():
    """Fit a compound with few and with many arms, leave arms out, and compare loss and friction."""
    curve = runpy.run_path(str(ROOT / "examples/materials/make_sbr.py"))["master_curve"]
    omega, inside = np.geomspace(1e-2, 1e12, 281), np.geomspace(1e1, 1e9, 801)
    longest, shortest, speeds = 1e-3, 8e-6, np.geomspace(1e-3, 10.0, 41)
    spectrum = self_affine_psd(0.8, longest, longest, shortest, rms_slope=0.5)

    def friction_of(rubber, speed):
        return persson(*spectrum, rubber, 0.2e6, speed, gamma=0.45).friction

    fits = {count: Prony.fit(omega, curve(omega).real, curve(omega).imag, arms_per_decade=count,
                             tau_range=(1e-13, 1e3)) for count in (0.5, 1, 2, 4)}
    best, exact = friction_of(fits[4], speeds), curve(inside)
    number = []
    figure, (left, right) = axes(2)
    for count, colour, line in zip((0.5, 1, 2), (RED, BLUE, GREEN), ("--", "-", ":"), strict=True):
        loss, mu = fits[count].complex_modulus(inside).imag, friction_of(fits[count], speeds)
        number.append([f"{count:g}", str(len(fits[count].g)),
                       f"{100 * np.abs(loss / exact.imag - 1).max():.2g} %",
                       f"{100 * np.abs(mu / best - 1).max():.2g} %"])
        left.semilogx(inside / (2 * np.pi), loss / exact.imag, line, color=colour,
                      label=f"{count:g} per decade")
        right.semilogx(speeds, mu, line, color=colour, label=f"{count:g} per decade")
    left.set(xlabel="Frequency, Hz", ylabel="Loss modulus / that of the compound")
    right.set(xlabel="Speed, m/s", ylabel="Friction, Persson's theory")
    left.legend()

    rubber, cut = fits[1], []

    def change(other, speed):
        return f"{100 * (friction_of(other, speed) / friction_of(rubber, speed) - 1):+.1f} %"

    for decades in (0, 1, 2, 3):
        row = [str(decades)]
        for speed in (0.01, 0.1, 1.0):
            fast = rubber.tau < 10.0**-decades * shortest / (2 * np.pi * speed)
            left_out = Prony(rubber.g_inf, rubber.g[~fast], rubber.tau[~fast])
            row.append(change(left_out, speed))
        slow = rubber.tau > 10.0**decades * longest / (2 * np.pi * 0.01)
        spring = rubber.g_inf + rubber.g[slow].sum()
        row.append(change(Prony(spring, rubber.g[~slow], rubber.tau[~slow]), 0.01))
        cut.append(row)
    return {"arms": table(["arms per decade", "arms", "loss modulus, largest error",
                           "friction, largest error"], number),
            "cut": table(["decades beyond", "fast arms left out, 0.01 m/s", "0.1 m/s", "1 m/s",
                          "slow arms as a spring, 0.01 m/s"], cut)}, figure


def program():
    """Return the path of the program."""
    built = ROOT / ".venv" / "python" / "asperity"
    return str(built) if built.exists() else "asperity"


def measured(text, name):
    """Return predicted and used memory (MB), transforms per row, and seconds per transform.

    The seconds are those in which the run had a processor, so that other programs do not count.
    """
    case = FOLDER / f"{name}.nml"
    case.write_text(text)
    printed = subprocess.run([program(), "check", str(case)], check=True, capture_output=True,
                          text=True).stdout
    amount, unit = re.search(r"! memory: about (\S+) (MB|GB)", printed).groups()
    begin = time.monotonic()
    child = subprocess.Popen([program(), "run", str(case), "--quiet", "--threads", "1"])
    peak, done = 0, 0
    while not done:
        found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{child.pid}/status").read_text())
        peak = int(found[1]) if found else peak
        time.sleep(2e-3)
        done, status, used = os.wait4(child.pid, os.WNOHANG)
    share = (used.ru_utime + used.ru_stime) / (time.monotonic() - begin)
    if status:
        raise RuntimeError(f"{name}: exit status {os.waitstatus_to_exitcode(status)}")
    history = asperity.open(case.with_suffix(".h5")).history
    return (float(amount) * (1000 if unit == "GB" else 1), peak * 1024 / 1e6,
            history["ffts"][1:].mean() if len(history["ffts"]) > 1 else history["ffts"].mean(),
            share * history["seconds"].sum() / history["ffts"].sum())


def cost():
    """Compare predicted and used memory, and measure the number and time of transforms."""
    n = 512
    rough = ("&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2,"
             " wavelength_long = 0.25e-3, wavelength_short = 31.3e-6 /")
    arms = ("prony_g = " + ", ".join(["0.4e6"] * 10) + ", prony_tau = "
            + ", ".join(f"1e{k}" for k in range(-7, 3)))
    slide = ("&phase pressure = 0.1e6, relaxed = .true. /\n"
             f"&phase velocity_x = 0.1, duration = {12 * 1e-3 / n / 0.1:g} /")
    cases = {
        "elastic": ("", "", "&phase pressure = 0.1e6 /", ""),
        "elastic, mixed precision": ("", "", "&phase pressure = 0.1e6 /", "precision = 'mixed'"),
        "elastic, free": (", boundary = 'free'",
                          "&surface shape = 'paraboloid', radius = 2e-3 /",
                          "&phase pressure = 0.1e6 /", ""),
        "adhesive": ("", "&adhesion potential = 'exponential', energy = 0.05, range = 1e-6 /",
                     "&phase pressure = 0.1e6 /", ""),
        "sliding, ten arms": ("", arms, slide, ""),
        "sliding, ten arms, friction": (
            "", arms + ", thickness = 1e-3 /\n&friction law = 'coulomb', coefficient = 0.5", slide,
            ""),
    }
    rows = []
    for name, (grid, middle, phases, solver) in cases.items():
        group, rest = (middle, "") if not middle.startswith("&") else ("", middle)
        predicted, taken, ffts, seconds = measured(f"""
            &grid nx = {n}, ny = {n}, lx = 1e-3{grid} /
            {rough}
            &material shear_modulus = 1e6{', ' + group if group else ''} /
            {rest}
            {phases}
            &solver tolerance = 1e-5 {', ' + solver if solver else ''} /
            """, f"cost_{len(rows)}")
        rows.append([name, f"{predicted:.0f}", f"{taken:.0f}", f"{ffts:.0f}",
                     f"{1e3 * seconds:.1f}"])
    return table(["case, 512 x 512", "memory by `asperity check`, MB", "taken, MB", "FFTs per row",
                  "ms per FFT, everything included"], rows), None


PARTS = {"mesh": mesh, "slopes": slopes, "step": step, "tolerance": tolerance, "adhesion": adhesion,
         "arms": arms, "merge": merge, "friction": friction, "cost": cost}


def main():
    """Measure the parts named on the command line, all by default, and rewrite them in the page."""
    asperity.set_threads(1)
    for name in sys.argv[1:] or PARTS:
        tables, figure = PARTS[name]()
        if figure:
            figure.savefig(FIGURES / f"choosing_{name}.png", dpi=110)
        for mark, text in (tables if isinstance(tables, dict) else {name: tables}).items():
            print(text)
            page = PAGE.read_text()
            begin, end = f"<!-- {mark}: begin -->\n", f"<!-- {mark}: end -->"
            if begin in page:
                head, rest = page.split(begin)
                PAGE.write_text(f"{head}{begin}\n{text}\n{end}{rest.split(end)[1]}")


if __name__ == "__main__":
    main()
