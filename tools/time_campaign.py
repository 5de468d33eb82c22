#!/usr/bin/env python3
"""Compare the time that `asperity check` predicts with that of runs, for random cases of all kinds.

    python tools/time_campaign.py [--count N] [--seed S] [--kind KIND] [--program PROGRAM]

A case is drawn for each kind: a rough road under a load or several, creep, sliding with and without
friction, adhesion, the pull-off of a sphere, and steady sliding. The script prints a line for each
case. For each kind it also prints the median of the predicted time over the real one, and the
range that contains nine tenths of these ratios. A run that takes longer than `--longest` seconds
is ended and left out, and its line says so. Other work on the machine makes the runs slower, so use
an idle one.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

Random = np.random.Generator
UNITS = {"second": 1.0, "minute": 60.0, "hour": 3600.0, "day": 86400.0}


def powers(random: Random, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform between two powers of ten."""
    return float(10.0 ** random.uniform(low, high))


def road(random: Random, n: int, slope: float, side: float = 1e-3, free: bool = False) -> str:
    """Return a square grid with n cells along a side, and a rough road."""
    short = random.choice([6, 10, 16]) / n * side
    boundary = "free" if free else "periodic"
    return (f"&grid nx = {n}, ny = {n}, lx = {side}, boundary = '{boundary}' /\n"
            f"&surface shape = 'self_affine', hurst = {random.uniform(0.6, 1.0):.2f},\n"
            f"   rms_slope = {slope:.3f}, wavelength_long = {random.choice([0.5, 0.25]) * side},\n"
            f"   wavelength_short = {short}, seed = {random.integers(1000)} /\n")


def rubber(random: Random) -> str:
    """Return a rubber of one, three or twelve arms."""
    arms = int(random.choice([1, 3, 12]))
    moduli = ", ".join(f"{powers(random, 5.5, 7.5):.4g}" for _ in range(arms))
    times = ", ".join(f"{tau:.4g}" for tau in 10.0 ** np.sort(random.uniform(-6.0, 0.0, arms)))
    return f"&material shear_modulus = 1e6, prony_g = {moduli},\n   prony_tau = {times} /\n"


def pressed(random: Random) -> str:
    """Draw a rough elastic contact under one load or ten."""
    n, slope = int(random.choice([128, 256, 512, 1024])), random.uniform(0.05, 0.6)
    return (road(random, n, slope, free=random.random() < 0.3)
            + "&material shear_modulus = 1e6 /\n"
            + f"&phase pressure = {powers(random, -2.5, -0.3) * slope * 4e6:.4g},"
            f" steps = {random.choice([1, 1, 10])}, ramp = 'linear' /\n")


def creeping(random: Random) -> str:
    """Draw a rubber under a constant load on a rough road, in time."""
    n, slope = int(random.choice([64, 128, 256])), random.uniform(0.05, 0.6)
    return (road(random, n, slope, free=random.random() < 0.3) + rubber(random)
            + f"&phase pressure = {powers(random, -2.0, -0.3) * slope * 4e6:.4g},"
            f" duration = {powers(random, -5.0, 0.0):.3g}, steps = {random.integers(10, 60)} /\n")


def sliding(random: Random, law: str = "") -> str:
    """Draw a rubber that slides over a rough road, in time."""
    n, slope = int(random.choice([64, 96, 128, 192])), random.uniform(0.05, 0.4)
    steps, speed = int(random.integers(10, 60)), powers(random, -3.0, 0.0)
    duration = steps * random.choice([0.25, 0.5, 1.0]) * 1e-3 / n / speed
    return (road(random, n, slope) + rubber(random) + law
            + f"&phase pressure = {powers(random, -2.0, -0.3) * slope * 4e6:.4g} /\n"
            f"&phase velocity_x = {speed:.4g}, duration = {duration:.4g}, steps = {steps} /\n")


def friction(random: Random) -> str:
    """Draw a coefficient of friction, on the slope or not."""
    return (f"&friction law = 'coulomb', coefficient = {random.uniform(0.1, 0.9):.2f},"
            f" slope_effect = {random.choice(['.true.', '.false.'])} /\n")


def rubbing(random: Random) -> str:
    """Draw a rubber that slides with friction, in time."""
    return sliding(random, friction(random))


def adhering(random: Random) -> str:
    """Draw a rough elastic contact with adhesion under one load or five."""
    n, slope = int(random.choice([64, 128, 256, 512])), random.uniform(0.2, 1.0)
    return (road(random, n, slope, side=n * 1.5e-9) + "&material shear_modulus = 6.25e6 /\n"
            "&adhesion potential = 'exponential', energy = 0.05, range = 2.071e-9 /\n"
            f"&phase pressure = {powers(random, -2.0, -0.5) * slope * 2.5e7:.4g},"
            f" steps = {random.choice([1, 5])}, ramp = 'linear' /\n")


def pulled_off(random: Random) -> str:
    """Draw a sphere with adhesion that is pulled off in steps."""
    n = int(random.choice([64, 128]))
    return (f"&grid nx = {n}, ny = {n}, lx = 30e-6, boundary = 'free' /\n"
            "&surface shape = 'sphere', radius = 50e-6 /\n"
            "&material shear_modulus = 1e6, poisson = 0.5 /\n"
            "&adhesion potential = 'exponential', energy = 0.05,"
            f" range = {powers(random, -7.5, -6.7):.3g} /\n"
            "&phase displacement = 4e-7 /\n"
            f"&phase displacement = -2e-7, steps = {random.integers(10, 40)},"
            " ramp = 'linear' /\n")


def steady(random: Random, law: str = "") -> str:
    """Draw one state of steady sliding, or five at increasing speeds."""
    n, slope = int(random.choice([64, 128, 256])), random.uniform(0.05, 0.3)
    pressure = powers(random, -2.0, -0.5) * slope * 4e6
    return road(random, n, slope) + rubber(random) + law + "".join(
        f"&phase pressure = {pressure:.4g}, velocity_x = {speed:.4g}, steady = .true. /\n"
        for speed in 10.0 ** np.linspace(-4.0, 0.0, int(random.choice([1, 5]))))


def steady_friction(random: Random) -> str:
    """Draw states of steady sliding with friction."""
    return steady(random, friction(random))


KINDS: dict[str, Callable[[Random], str]] = {
    each.__name__: each for each in (pressed, creeping, sliding, rubbing, adhering, pulled_off,
                                     steady, steady_friction)}


def predicted(program: str, case: Path) -> float:
    """Return the time that `asperity check` predicts, s."""
    printed = subprocess.run([program, "check", str(case)], capture_output=True, text=True,
                             check=True).stdout
    found = re.search(r"time: (?:about ([\d.]+) ([a-z]+?)s?|less than a second)\b", printed)
    if found is None:
        raise ValueError(f"{case}: asperity check prints no time:\n{printed}")
    return float(found[1]) * UNITS[found[2]] if found[1] else 0.5


def measure(text: str, program: str, longest: float) -> tuple[float, float, str]:
    """Return the predicted and the real time of a case, s, and its counts.

    The real time is nan if the run was ended because it took too long.
    """
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.nml"
        case.write_text(text)
        expected = predicted(program, case)
        begin = time.perf_counter()
        try:
            status = subprocess.run([program, "run", "case.nml", "--quiet"], capture_output=True,
                                    check=False, timeout=longest, cwd=folder).returncode
        except subprocess.TimeoutExpired:
            return expected, float("nan"), f"took longer than {longest:g} s"
        taken = time.perf_counter() - begin
        with h5py.File(case.with_suffix(".h5")) as file:
            rows, ffts = file["history/step"].size, file["history/ffts"][()].sum()
            words = f"{file['grid'].attrs['nx']} cells a side, {rows} rows, {ffts:.0f} transforms"
        return expected, taken, words + (f", status {status}" if status else "")


def main() -> None:
    """Draw, check and run the cases, and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=8, help="number of cases of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=list(KINDS), action="append")
    parser.add_argument("--program", default="asperity")
    parser.add_argument("--longest", type=float, default=60.0, help="longest run, s")
    chosen = parser.parse_args()
    for kind in chosen.kind or KINDS:
        ratios = []
        for number in range(chosen.count):
            random = np.random.default_rng([chosen.seed, list(KINDS).index(kind), number])
            expected, taken, words = measure(KINDS[kind](random), chosen.program, chosen.longest)
            if np.isfinite(taken):
                ratios.append(expected / taken)
            print(f"{kind:16} {number:3}  {expected:7.3g} s predicted, {taken:7.3g} s taken:"
                  f" {words}", flush=True)
        if ratios:
            low, middle, high = np.quantile(ratios, [0.05, 0.5, 0.95])
            print(f"{kind:16} predicted over taken: median {middle:.2g}, nine tenths from"
                  f" {low:.2g} to {high:.2g}", flush=True)


if __name__ == "__main__":
    main()
