#!/usr/bin/env python3
"""Measure the tangential solver and the coupled step of friction, and print tables.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/bench/friction.py [--cells 64 128 256] [--steps 0] [--threads 2]
    python tools/bench/friction.py --result build/examples/two_scale_road/two_scale_road.h5

First Mindlin's sphere (G = 200 MPa, nu = 0.42, R = 50 mm, 9.196 N; thesis, fig. 3.5) brought to
half of full slip in one step with one pass, on meshes that grow: tangential iterations, and all
transforms of the step. An iteration takes a product of the operator and one of the preconditioner,
four transforms each; those of the preconditioner, which has no padding, count as a quarter here.

Then the road of two scales (examples/two_scale_road), whole or its first steps of sliding: the cost
of a step, by the part of the contact that sticks. With `--result` the table is that of an existing
result, such as that of examples/make.py. All figures are of one run on one machine: compare ratios,
and on a busy machine only the counts.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import asperity

ROOT = Path(__file__).resolve().parents[2]
SPHERE = """
&grid nx = {n}, ny = {n}, lx = 2.4e-3, boundary = 'free' /
&surface shape = 'paraboloid', radius = 50e-3 /
&material shear_modulus = 200e6, poisson = 0.42 /
&friction law = 'coulomb', coefficient = 0.3, slope_effect = .false. /
&phase force = 9.196 /
&phase velocity_x = 1, duration = {shift}, steps = 1 /
&solver tolerance = {tolerance}, passes = 1, coupling_tolerance = 100, threads = {threads},
   method = '{method}', max_iterations = 20000 /
"""


def sphere(folder: Path, n: int, tolerance: float, method: str, threads: int) -> tuple[int, float]:
    """Return the tangential iterations of the step, and all its transforms.

    The normal solve of the step starts from its solution, ends without an iteration, and takes
    hardly any transforms.
    """
    half = 0.5 * full_slip()
    case = folder / "sphere.nml"
    case.write_text(
        SPHERE.format(n=n, tolerance=tolerance, method=method, threads=threads, shift=half))
    history = asperity.run(case, quiet=True).history
    if history["iterations_normal"][-1] > 0:
        raise RuntimeError("the normal solve of the step takes iterations, too")
    return int(history["iterations_tangential"][-1]), history["ffts"][-1]


def full_slip() -> float:
    """Return the motion to full slip of the sphere (Mindlin), m."""
    shear, poisson, radius, force, friction = 200e6, 0.42, 50e-3, 9.196, 0.3
    modulus = 2 * shear / (1 - poisson)
    contact = (0.75 * force * radius / modulus) ** (1 / 3)
    return 3 * friction * force * (2 - poisson) / (16 * contact * shear)


def road(folder: Path, steps: int, threads: int) -> asperity.Run:
    """Run the road of two scales."""
    case = asperity.Case.read(ROOT / "examples/two_scale_road/input.nml")
    case.solver.threads = threads
    if steps:
        slide = case.phase[1]
        cell = case.grid.lx / case.grid.nx
        slide.duration = steps * cell / slide.velocity_x
    return case.run(output=folder / "road.h5", quiet=True)


def print_steps(run: asperity.Run) -> None:
    """Print the costs of the steps of a run."""
    history = run.history
    slides = history["phase"] >= 2
    part = np.divide(history["stick_area"], history["contact_area"])
    print("\n| sticking part of the contact, % | steps | normal iterations |"
          " tangential iterations | passes | transforms | seconds per step |\n"
          "| --- | --- | --- | --- | --- | --- | --- |")
    for low, high, name in ((0.75, 2, "more than 75"), (0.25, 0.75, "25 to 75"),
                            (1e-12, 0.25, "below 25"), (-1, 1e-12, "0"), (-1, 2, "all")):
        rows = slides & (part >= low) & (part < high)
        if rows.any():
            means = [history[key][rows].mean() for key in
                     ("iterations_normal", "iterations_tangential", "passes", "ffts", "seconds")]
            print(f"| {name} | {rows.sum()} | {means[0]:.1f} | {means[1]:.1f} | {means[2]:.1f} |"
                  f" {means[3]:.0f} | {means[4]:.3f} |")
    print(f"\nThe whole run has {len(history['step'])} rows and took "
          f"{history['seconds'].sum():.0f} s.")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="*", default=[64, 128, 256])
    parser.add_argument("--thesis", action="store_true", help="the method of the thesis, too")
    parser.add_argument("--steps", type=int, default=0,
                        help="steps of sliding on the road; 0: all; below 0: not the road")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--result", type=Path, help="only the table of the steps of this run")
    given = parser.parse_args()
    if given.result:
        print_steps(asperity.open(given.result))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print("| cells along a side | method | tolerance | iterations | transforms |"
              "\n| --- | --- | --- | --- | --- |")
        for method in ("fast", "thesis") if given.thesis else ("fast",):
            for tolerance in (1e-5, 1e-8):
                for n in given.cells:
                    iterations, ffts = sphere(folder, n, tolerance, method, given.threads)
                    print(f"| {n} | {method} | {tolerance:g} | {iterations} | {ffts:.0f} |")
        if given.steps >= 0:
            print_steps(road(folder, given.steps, given.threads))


if __name__ == "__main__":
    main()
