#!/usr/bin/env python3
"""Count the iterations and transforms of small cases, and compare them with the stored table.

    python tools/bench/counts.py [--program PROGRAM] [--update]

It prints the counts and marks those that have changed; with --update it writes them to
tools/bench/counts.csv. The counts say how much work a case takes, whatever the machine and whatever
else it does. They depend a little on the order of rounding, and so on the compiler and the
processor. A count therefore agrees with the table if it differs by no more than a tenth and two. A
change that saves more than that updates the table, so that the table also notices when the gain is
lost again. `python/tests/test_counts.py` compares them in the continuous integration.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "tools" / "bench" / "counts.csv"
COLUMNS = ("iterations_normal", "iterations_tangential", "passes", "ffts")

ROUGH = """
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.1, wavelength_long = 0.25,
   wavelength_rolloff = 0.25, wavelength_short = {short}, seed = 1 /
&material shear_modulus = 0.25 /
&phase pressure = {pressure} /
"""
SQUARE = "&grid nx = {n}, ny = {n}, lx = 1.0 /" + ROUGH
WAVES = """
&grid nx = 96, ny = 56, lx = 500e-6, ly = 288.675134594813e-6 /
&surface shape = 'hexagonal_wave', wavelength = 500e-6, amplitude = 5e-6 /
&surface shape = 'hexagonal_wave', wavelength = 62.5e-6, amplitude = 0.6e-6 /
&material poisson = 0.5, shear_modulus = 2e6, prony_g = 2e7, 4e6, 1e6, prony_tau = 1e-7, 1e-5, 1e-3,
   thickness = 4e-3, density = {density} /
&friction law = 'coulomb', coefficient = 0.5 /
&phase pressure = 0.4e6, duration = 1e-3, steps = 4, ramp = 'linear' /
&phase velocity_x = {speed}, duration = {duration}, steps = {steps} /
&solver tolerance = 1e-5 /
"""
ROUGH_ADHESION = """
&grid nx = {n}, ny = {n}, lx = {lx} /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 1.0, wavelength_long = {long},
   wavelength_rolloff = {long}, wavelength_short = {short}, seed = 1 /
&material shear_modulus = 6.25e6 /
&adhesion potential = 'exponential', energy = 0.05, range = 2.071e-9 /
&phase pressure = 1.25e6 /
"""

CASES = {
    "rough, light": SQUARE.format(n=256, short=16 / 256, pressure=0.0005),
    "rough, heavy": SQUARE.format(n=256, short=16 / 256, pressure=0.05),
    "rough, 512": SQUARE.format(n=512, short=16 / 512, pressure=0.005),
    "rough, mixed": SQUARE.format(n=512, short=16 / 512, pressure=0.005)
    + "&solver precision = 'mixed' /",
    "rough, given approach": SQUARE.format(n=256, short=16 / 256, pressure=0.005).replace(
        "pressure = 0.005", "displacement = 0.004"),
    "rough, oblong cells": "&grid nx = 256, ny = 96, lx = 1.0, ly = 1.0 /"
    + ROUGH.format(short=0.08, pressure=0.005),
    "rough, long grid": "&grid nx = 1536, ny = 48, lx = 32.0, ly = 1.0 /"
    + ROUGH.format(short=0.125, pressure=0.05),
    "rough, free": "&grid nx = 128, ny = 128, lx = 1.0, boundary = 'free' /"
    + ROUGH.format(short=16 / 128, pressure=0.005),
    "rough, free, to the edge": "&grid nx = 192, ny = 150, lx = 1.0, boundary = 'free' /"
    + ROUGH.format(short=12 / 192, pressure=0.05),
    "line contact": "&grid nx = 2048, ny = 1, lx = 1.0 /"
    + ROUGH.format(short=16 / 2048, pressure=0.005),
    "rough, method of the thesis": SQUARE.format(n=64, short=16 / 64, pressure=0.005)
    + "&solver method = 'thesis' /",
    "sphere, creep": """
&grid nx = 64, ny = 64, lx = 2e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 5e-3 /
&material shear_modulus = 1e6, prony_g = 9e6, prony_tau = 1e-2 /
&phase force = 1, duration = 0.1, steps = 20 /
""",
    "road without friction": """
&grid nx = 128, ny = 64, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 5e-4,
   wavelength_short = 8e-5, seed = 3 /
&material shear_modulus = 1e6, prony_g = 9e6, prony_tau = 1e-3 /
&phase pressure = 1e5 /
&phase velocity_x = 0.1, duration = 1e-3, steps = 20 /
""",
    "sphere, half of full slip": """
&grid nx = 64, ny = 64, lx = 2.4e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 50e-3 /
&material shear_modulus = 200e6, poisson = 0.42 /
&friction law = 'coulomb', coefficient = 0.3, slope_effect = .false. /
&phase force = 9.196 /
&phase velocity_x = 1, duration = 1.1e-6, steps = 1 /
&solver tolerance = 1e-5, passes = 1, coupling_tolerance = 100 /
""",
    "two scales, stick to slip": WAVES.format(density=0, speed=0.3, duration=20e-6, steps=24),
    "two scales, full slip": WAVES.format(density=20, speed=3, duration=100e-6, steps=58),
    "sphere, adhesion": """
&grid nx = 128, ny = 128, lx = 30e-6 /
&surface shape = 'sphere', radius = 50e-6 /
&material shear_modulus = 1e6, poisson = 0.5 /
&adhesion potential = 'exponential', energy = 0.05, range = 60e-9 /
&phase pressure = 0 /
""",
    "rough, adhesion": ROUGH_ADHESION.format(n=128, lx=192e-9, long=48e-9, short=19.5e-9),
    "rough, adhesion in spots": ROUGH_ADHESION.format(n=512, lx=768e-9, long=192e-9, short=20e-9),
    "steady sliding": """
&grid nx = 64, ny = 64, lx = 1e-3 /
&surface shape = 'self_affine', hurst = 0.8, rms_slope = 0.2, wavelength_long = 5e-4,
   wavelength_short = 1e-4, seed = 3 /
&material shear_modulus = 1e6, prony_g = 9e6, prony_tau = 1e-3 /
&phase pressure = 1e5, velocity_x = 0.1, steady = .true. /
""",
}


def count(text: str, program: str) -> dict[str, int]:
    """Run a case with one thread and return its counts, summed over all rows."""
    with tempfile.TemporaryDirectory() as name:
        case = Path(name) / "case.nml"
        case.write_text(text)
        done = subprocess.run(
            [program, "run", "case.nml", "--output", "case.h5", "--quiet", "--threads", "1"],
            cwd=name, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(done.stderr + text)
        with h5py.File(Path(name) / "case.h5") as file:
            return {key: round(float(file["history"][key][()].sum())) for key in COLUMNS}


def measure(program: str) -> dict[str, dict[str, int]]:
    """Return the counts of all cases."""
    return {name: count(text, program) for name, text in CASES.items()}


def stored() -> dict[str, dict[str, int]]:
    """Return the counts of the table."""
    with TABLE.open(newline="") as file:
        return {row.pop("case"): {key: int(row[key]) for key in COLUMNS}
                for row in csv.DictReader(file)}


def agrees(found: int, expected: int) -> bool:
    """Return whether a count agrees with that of the table."""
    return abs(found - expected) <= 0.1 * expected + 2


def main() -> None:
    """Count, print and compare, or update the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="asperity", help="the program to count with")
    parser.add_argument("--update", action="store_true", help="write the table")
    given = parser.parse_args()
    found = measure(str(given.program))
    if given.update:
        with TABLE.open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["case", *COLUMNS])
            for name, counts in found.items():
                writer.writerow([name, *counts.values()])
        return
    expected = stored()
    same = True
    for name, counts in found.items():
        words = [f"{key} {value} ({expected[name][key]})" for key, value in counts.items()]
        changed = not all(agrees(value, expected[name][key]) for key, value in counts.items())
        same = same and not changed
        print(f"{name}: {', '.join(words)}{'  CHANGED' if changed else ''}")
    if not same:
        sys.exit(1)


if __name__ == "__main__":
    main()
