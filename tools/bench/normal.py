#!/usr/bin/env python3
"""Measure the normal solver and write its part of docs/benchmarks.md.

    . tools/setup.sh
    python tools/bench/normal.py

All figures that are compared are ratios within one run on one machine. Processor time is used where
one thread works, so that a busy machine matters little. `peers.py` compares with other codes.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys

from benchmark_page import ROOT, write_part


def asperity(
    n: int, load: float, threads: int, precision: str = "double", folder: str | None = None
) -> dict[str, float]:
    """Run bench_normal once and return its figures."""
    command = ["fpm", "run", "--profile", "release", "--example", "bench_normal", "--"]
    command += [str(n), str(load), str(threads), precision] + ([folder] if folder else [])
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    line = next(x for x in done.stdout.splitlines() if x.startswith("iterations="))
    if not line.rstrip().endswith("reason=converged"):
        raise RuntimeError(line)
    while "= " in line:
        line = line.replace("= ", "=")
    pairs = (word.split("=") for word in line.split() if "=" in word)
    return {key: float(value) for key, value in pairs if key != "reason"}


def best(
    n: int, load: float, threads: int, repeats: int = 3, precision: str = "double"
) -> dict[str, float]:
    """Choose the run with the least processor (one thread) or wall time."""
    key = "cpu" if threads == 1 else "wall"
    runs = (asperity(n, load, threads, precision) for _ in range(repeats))
    return min(runs, key=lambda run: run[key])


def own_transforms(run: dict[str, float]) -> float:
    """Return the processor time of a run's transforms, each in its own precision."""
    single = run["single_ffts"]
    return (run["ffts"] - single) * run["fft_cpu"] + single * run["single_cpu"]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=int, default=2048, help="largest n (default: 2048)")
    options = parser.parse_args()
    subprocess.run(
        ["fpm", "build", "--profile", "release"], cwd=ROOT, check=True, capture_output=True
    )
    command = "python tools/bench/normal.py"
    if options.largest != 2048:
        command += f" --largest {options.largest}"
    text = [
        "## Normal solver, one thread",
        "",
        f"Made by `{command}` on {platform.machine()}, {platform.system()}.",
        "",
        "The case is a periodic rough contact with L = 1 m, modes 4 to n/16, Hurst exponent 0.8,",
        "rms slope h' = 0.1, E* = 1 Pa and mean pressure p. It is solved until the duality gap",
        "e1 = sum P (g - min g)/(sum P h_rms) is at most 1e-6.",
        "",
        "The transforms are real n x n FFTs; each r2c or c2r transform counts as one. Time/FFT",
        "time is the processor time of the solve over that of its transforms, measured in the",
        "same run. Peak memory is that of the whole process, including the generation of the",
        "surface, in fields of n x n doubles (for small n it is mostly the program itself). In",
        "mixed precision the iterations use transforms in single precision and are timed with",
        "those; the last column is the time of the solve over that in double precision.",
        "",
        "| n | p/(E* h') | precision | iterations | FFTs | e1 | contact | time/FFT time "
        "| peak memory | time/double |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    n = 256
    while n <= options.largest:
        for load in (0.005, 0.05, 0.5):
            double = 0.0
            for precision in ("double", "mixed"):
                run = best(n, load, 1, 3 if n < 4096 else 1, precision)
                double = double or run["cpu"]
                ratio = run["cpu"] / own_transforms(run)
                text.append(
                    f"| {n} | {load:g} | {precision} | {run['iterations']:.0f} | {run['ffts']:.0f} "
                    f"| {run['e1']:.1e} | {run['area']:.3f} | {ratio:.2f} | {run['fields']:.1f} "
                    f"| {run['cpu'] / double:.2f} |"
                )
                print(text[-1], file=sys.stderr)
        n *= 2
    one, two = best(options.largest, 0.05, 1), best(options.largest, 0.05, 2)
    text += [
        "",
        "## Two threads",
        "",
        f"n = {options.largest}, p = 0.05 E* h': {one['wall'] / two['wall']:.2f} times as fast as "
        "one thread by wall time",
        f"(one transform: {one['fft_wall'] / two['fft_wall']:.2f} times).",
    ]
    print(text[-2], text[-1], file=sys.stderr)
    write_part("normal", text)


if __name__ == "__main__":
    main()
