#!/usr/bin/env python3
"""Measure the normal solver and write docs/benchmarks.md.

    . tools/setup.sh
    python -m venv /tmp/tamaas && /tmp/tamaas/bin/pip install tamaas==2.9.0
    python tools/bench/normal.py --tamaas /tmp/tamaas/bin/python

Without --tamaas the comparison is left out. All figures that are compared are ratios within one
run on one machine. Processor time is used where one thread works, so that a busy machine matters
little.
"""

from __future__ import annotations

import argparse
import json
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]

TAMAAS = r"""
import json, sys, time
import numpy as np
import tamaas as tm
n, load, folder = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
tm.initialize(1)
height = np.fromfile(folder + "/height").reshape(n, n)
rms = height.std()
tolerance, found = 1e-6, None
for k in range(8):
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], [n, n])
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, height, tolerance)
    solver.max_iter = 20000
    start = time.process_time()
    solver.solve(0.1 * load)
    seconds = time.process_time() - start
    traction = np.array(model.traction).reshape(n, n)
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n)[None, :])
    q[0, 0] = 1.0
    u = np.fft.rfft2(traction) * 2 / q
    u[0, 0] = 0
    gap = np.fft.irfft2(u, s=(n, n)) - height
    e1 = float((traction * (gap - gap.min())).sum() / (traction.sum() * rms))
    if e1 <= 1e-6 and (found is None or seconds < found[0]):
        found = seconds, e1, tolerance
        traction.tofile(folder + "/other")
    if 0.5e-6 <= e1 <= 1e-6:
        break
    tolerance *= min(max(0.75e-6 / e1, 0.05), 20.0) ** 0.8
seconds, e1, tolerance = found
print(json.dumps({"seconds": seconds, "e1": e1, "tolerance": tolerance}))
"""


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


def duality_gap(height: np.ndarray, pressure: np.ndarray) -> float:
    """Recompute e1 in double precision by NumPy's transforms, E* = 1 Pa, L = 1 m."""
    n = len(height)
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n)[None, :])
    q[0, 0] = 1.0
    u = np.fft.rfft2(pressure) * 2 / q
    u[0, 0] = 0
    gap = np.fft.irfft2(u, s=(n, n)) - height
    return float((pressure * (gap - gap.min())).sum() / (pressure.sum() * height.std()))


def compare(python: str, n: int, load: float) -> list[str]:
    """Make the rows of the comparison with Tamaas, in both precisions."""
    with tempfile.TemporaryDirectory() as folder:
        ours = {}
        pressure = {}
        for precision in ("double", "mixed"):
            runs = (asperity(n, load, 1, precision, folder) for _ in range(5))
            ours[precision] = min(runs, key=lambda run: run["cpu"])
            pressure[precision] = np.fromfile(folder + "/pressure").reshape(n, n)
        height = np.fromfile(folder + "/height").reshape(n, n)
        done = subprocess.run(
            [python, "-c", TAMAAS, str(n), str(load), folder],
            capture_output=True,
            text=True,
            check=True,
        )
        other = json.loads(done.stdout.splitlines()[-1])
        field = np.fromfile(folder + "/other").reshape(n, n)
        return [
            f"| {n} | {load:g} | {precision} | {run['cpu']:.3f} "
            f"| {duality_gap(height, pressure[precision]):.1e} "
            f"| {other['seconds']:.2f} | {other['e1']:.1e} | {other['seconds'] / run['cpu']:.0f} "
            f"| {np.abs(field - pressure[precision]).sum() / pressure[precision].sum():.1e} |"
            for precision, run in ours.items()
        ]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tamaas", metavar="PYTHON", help="a Python that has Tamaas 2.9.0")
    parser.add_argument("--largest", type=int, default=2048, help="largest n (default: 2048)")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "benchmarks.md")
    options = parser.parse_args()
    subprocess.run(
        ["fpm", "build", "--profile", "release"], cwd=ROOT, check=True, capture_output=True
    )
    command = "python tools/bench/normal.py"
    if options.tamaas:
        command += " --tamaas PYTHON"
    if options.largest != 2048:
        command += f" --largest {options.largest}"
    text = [
        "# Benchmarks",
        "",
        f"Made by `{command}`",
        f"on {platform.machine()}, {platform.system()}; the script says how to get Tamaas.",
        "The seconds are those of one run on one machine: compare ratios rather than seconds.",
        "",
        "The case is a periodic rough contact with L = 1 m, modes 4 to n/16, Hurst exponent 0.8,",
        "rms slope h' = 0.1, E* = 1 Pa and mean pressure p. It is solved until the duality gap",
        "e1 = sum P (g - min g)/(sum P h_rms), recomputed in double precision, is at most 1e-6.",
        "",
        "## Normal solver, one thread",
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
    if options.tamaas:
        text += [
            "",
            "## Against Tamaas 2.9.0",
            "",
            "Tamaas is the wheel on PyPI (PolonskyKeerRey, one thread). Its tolerance is chosen so",
            "that e1 is between 0.5e-6 and 1e-6, if possible. The last column is",
            "sum |P - P'|/sum P.",
            "",
            "| n | p/(E* h') | precision | Asperity, s | e1 | Tamaas, s | e1 | ratio "
            "| difference |",
            "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
        ]
        for n in (512, 1024):
            text += compare(options.tamaas, n, 0.05)
            print(*text[-2:], sep="\n", file=sys.stderr)
    # The other benches keep their parts between marks.
    old = options.output.read_text() if options.output.exists() else ""
    mark = old.find("<!--")
    text += ["", old[mark:].rstrip()] if mark >= 0 else []
    options.output.write_text("\n".join(text) + "\n")


if __name__ == "__main__":
    main()
