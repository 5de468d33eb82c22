#!/usr/bin/env python3
"""Measure a step of the sliding, viscoelastic contact and print a table.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/bench/steps.py [--cells 1024] [--steps 100] [--threads 1]

A rough road slides by one cell per step under a rubber with ten arms (thesis, 4.3). To find the
cost of the arms, one arm is split into ten equal ones: the contact is the same to round-off, so the
additional time is that of nine more arms. All figures are of one run on one machine: compare
ratios.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import asperity

CASE = """
&grid nx = {n}, ny = {n}, lx = 10e-3 /
&surface shape = 'self_affine', hurst = 0.8, wavelength_long = 2.5e-3,
   wavelength_short = {short}, rms_slope = 0.3, seed = 3 /
&material shear_modulus = 1e6, {arms} /
&phase pressure = 3e5, duration = 1e-3, steps = 4, ramp = 'linear' /
&phase velocity_x = 1, dt = {dt}, duration = {duration} /
&solver tolerance = 1e-5, threads = {threads} /
"""

DECADES = "prony_g = 10*3e6, prony_tau = 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1, 10"
ONE = "prony_g = 3e6, prony_tau = 1e-4"
SPLIT = "prony_g = 10*3e5, prony_tau = 10*1e-4"


def measure(folder: Path, arms: str, cells: int, steps: int, threads: int) -> dict[str, float]:
    """Run a case and return the medians over the sliding steps, the first five left out."""
    dt = 10e-3 / cells
    path = folder / "case.nml"
    path.write_text(
        CASE.format(
            n=cells, short=160e-3 / cells, arms=arms, dt=dt, duration=steps * dt, threads=threads
        )
    )
    history = asperity.run(path).history
    late = slice(10, None)
    return {
        "ffts": float(np.mean(history["ffts"][late])),
        "iterations": float(np.mean(history["iterations_normal"][late])),
        "seconds": float(np.median(history["seconds"][late])),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, default=1024, help="cells along a side")
    parser.add_argument("--steps", type=int, default=100, help="steps of sliding")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print("| case | iterations | FFTs a step | seconds a step |")
        print("| --- | --- | --- | --- |")
        rows = {}
        cases = {"ten arms, a decade each": DECADES, "one arm": ONE, "the same arm in ten": SPLIT}
        for name, arms in cases.items():
            row = measure(Path(folder), arms, options.cells, options.steps, options.threads)
            rows[name] = row
            numbers = f"{row['iterations']:.1f} | {row['ffts']:.1f} | {row['seconds']:.3f}"
            print(f"| {name} | {numbers} |")
        split, one = rows["the same arm in ten"], rows["one arm"]
        arms = (split["seconds"] - one["seconds"]) / 9 * 10
        print(f"\nTen arms cost {arms / (split['seconds'] - arms):.0%} of the rest of the step.")


if __name__ == "__main__":
    main()
