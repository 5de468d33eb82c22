"""Measure what mesh, time step and tolerance cost and bring: the tables of docs/choosing.md.

    python tools/choosing.py

Prints three tables in Markdown; about ten seconds on one processor.
"""

import re
import tempfile
import warnings
from pathlib import Path

import numpy as np

import asperity
from asperity.material import Prony
from asperity.theory import hunter

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(tempfile.mkdtemp())


def run(text, name):
    """Run an input and return its history."""
    case = FOLDER / f"{name}.nml"
    case.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")              # steps that are too coarse are the point
        return asperity.run(case).history


def mesh():
    """Contact area and mean gap of one rough surface on finer and finer grids."""
    print("| cells in the shortest wave | contact area | mean gap, rms heights |\n"
          "| --- | --- | --- |")
    for cells in (2, 4, 8, 16, 32):
        n = 32 * cells
        height = asperity.surface.self_affine(
            n, lx=1.0, hurst=0.8, wavelength_long=0.25, wavelength_short=1 / 32 * (1 + 1e-9),
            rms_slope=0.1, seed=1)
        contact = asperity.solve_normal(height, 1.0, 1.0, 1.0, pressure=0.005)
        print(f"| {cells} | {contact.contact_area:.4f} |"
              f" {contact.gap.mean() / height.std():.4f} |")


def time_step():
    """Friction of a sliding cylinder against Hunter's solution."""
    glassy, ratio, creep, radius, load = 2.75e6, 9.0, 1e-2, 10e-3, 50.0
    rubber = Prony.from_zener(0.0, [glassy], [glassy / ratio], [creep * glassy / ratio])
    print("\n| cells a step | `exponential2` | `exponential` | `backward_euler` |\n"
          "| --- | --- | --- | --- |")
    speed, nx, lx = 0.02, 1536, 36e-3
    exact = float(hunter(radius, load, speed, rubber).friction)
    for cells in (4.0, 2.0, 1.0, 0.5):
        errors = []
        for scheme in ("exponential2", "exponential", "backward_euler"):
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
            errors.append(history["friction"][-1] / exact - 1.0)
        print(f"| {cells:g} | " + " | ".join(f"{100 * error:+.2f} %" for error in errors) + " |")


def tolerance():
    """Friction and contact area of the example speed_jump, coarse, against a tight tolerance."""
    text = (ROOT / "examples" / "speed_jump" / "input.nml").read_text()
    text = re.sub(r"n([xy]) = 512", r"n\1 = 128", text).replace("15.625e-6", "62.5e-6")
    print("\n| `tolerance` | friction | contact area | FFTs a step |\n| --- | --- | --- | --- |")
    values = ("1e-3", "1e-4", "1e-5", "1e-6", "1e-8")
    histories = {value: run(text.replace("tolerance = 1e-5", f"tolerance = {value}"), value)
                 for value in values}
    exact = histories["1e-8"]
    for value, history in histories.items():
        friction = np.abs(history["friction"][1:] / exact["friction"][1:] - 1.0).max()
        area = np.abs(history["contact_area"] - exact["contact_area"]).max()
        print(f"| {value} | {100 * friction:.3f} % | {area:.5f} | {history['ffts'].mean():.0f} |")


if __name__ == "__main__":
    asperity.set_threads(1)
    mesh()
    time_step()
    tolerance()
