#!/usr/bin/env python3
r"""Compare the normal solver with other codes, and write their part of docs/benchmarks.md.

Each code needs an environment of its own, since they need different versions of NumPy:

    . tools/setup.sh
    python -m venv /tmp/tamaas && /tmp/tamaas/bin/pip install tamaas==2.9.0
    python -m venv /tmp/cm && /tmp/cm/bin/pip install ContactMechanics==1.8.3
    python -m venv /tmp/slippy && /tmp/slippy/bin/pip install 'numpy<1.24' scipy numba pyfftw \
        matplotlib scikit-image tinydb sympy && /tmp/slippy/bin/pip install --no-deps slippy==0.5.2
    python tools/bench/peers.py --tamaas /tmp/tamaas/bin/python --slippy /tmp/slippy/bin/python \
        --contact-mechanics /tmp/cm/bin/python

(The metadata of slippy ask for a NumPy that a recent Python cannot build, hence --no-deps.) Codes
that are not given are left out, and the page stays as it is unless all three are given. All codes
use one thread, and all times are processor times on one machine: compare their ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from benchmark_page import ROOT, write_part
from normal import asperity

NAMES = {
    "tamaas": "Tamaas 2.9.0",
    "slippy": "slippy 0.5.2",
    "contact_mechanics": "ContactMechanics 1.8.3",
}
HEAD = [
    "## Against other codes",
    "",
    "Made by `python tools/bench/peers.py`, which says how to get the other codes. All solve",
    "the same periodic rough contact (the case above) by Polonsky and Keer's method with one",
    "thread each: Tamaas (PolonskyKeerRey), slippy (polonsky_and_keer) and ContactMechanics",
    "(minimize_proxy), as installed from PyPI. The tolerance of each is chosen so that the",
    "duality gap e1, recomputed in double precision, is between 0.5e-6 and 1e-6, if that can",
    "be reached. The ratio is the time over that of Asperity in double precision. The last",
    "column is sum |P - P'|/sum P, where P' is the pressure of Asperity. The transforms of",
    "Tamaas cannot be counted from outside.",
    "",
    "| n | p/(E* h') | code | FFTs | seconds | ratio | e1 | difference |",
    "| --- | --- | --- | --- | --- | --- | --- | --- |",
]


def own_rows(n: int, load: float, folder: Path) -> tuple[list[str], float, np.ndarray]:
    """Solve in both precisions; return rows, and the time and pressure in double precision."""
    rows, seconds, pressure = [], 0.0, np.empty(0)
    for precision in ("double", "mixed"):
        runs = (asperity(n, load, 1, precision, str(folder)) for _ in range(5))
        run = min(runs, key=lambda found: found["cpu"])
        seconds = run["cpu"] if precision == "double" else seconds
        rows.append(
            f"| {n} | {load:g} | Asperity, {precision} | {run['ffts']:.0f} | {run['cpu']:.3f} "
            f"| {run['cpu'] / seconds:.2g} | {run['e1']:.1e} | |"
        )
        pressure = pressure if rows[1:] else np.fromfile(folder / "pressure").reshape(n, n)
    return rows, seconds, pressure


def peer_row(
    code: str, python: str, n: int, load: float, folder: Path, seconds: float, pressure: np.ndarray
) -> str:
    """Solve the same case by another code."""
    script = Path(__file__).parent / "peers" / f"run_{code}.py"
    done = subprocess.run(
        [python, str(script), str(0.1 * load), str(folder)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    found = json.loads(next(x for x in done.stdout.splitlines() if x.startswith("{")))
    other = np.fromfile(folder / "other").reshape(n, n)
    transforms = "" if found["transforms"] is None else found["transforms"]
    return (
        f"| {n} | {load:g} | {NAMES[code]} | {transforms} | {found['seconds']:.2f} "
        f"| {found['seconds'] / seconds:.0f} | {found['e1']:.1e} "
        f"| {np.abs(other - pressure).sum() / pressure.sum():.1e} |"
    )


def main() -> None:
    """Compare, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for code, name in NAMES.items():
        parser.add_argument(
            "--" + code.replace("_", "-"), metavar="PYTHON", help=f"a Python that has {name}"
        )
    parser.add_argument("--sizes", type=int, nargs="+", default=[512, 1024], metavar="N")
    options = parser.parse_args()
    subprocess.run(
        ["fpm", "build", "--profile", "release"], cwd=ROOT, check=True, capture_output=True
    )
    text = list(HEAD)
    for n in options.sizes:
        for load in (0.005, 0.05, 0.5):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                rows, seconds, pressure = own_rows(n, load, folder)
                for code in NAMES:
                    if python := getattr(options, code):
                        rows.append(peer_row(code, python, n, load, folder, seconds, pressure))
            print(*rows, sep="\n", flush=True)
            text += rows
    if not all(getattr(options, code) for code in NAMES):
        print("The page stays as it is: give all three codes to write it.", file=sys.stderr)
        return
    write_part("peers", text)


if __name__ == "__main__":
    main()
