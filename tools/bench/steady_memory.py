#!/usr/bin/env python3
"""Compare the memory of steady rows with the prediction of `asperity check`.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/bench/steady_memory.py [--cells 128 256 512] [--laws none flat slope]

Each line is a run of its own: the prediction, the most that it says a row may take if it is solved
all at once, the largest memory of its process, and the ratios of both predictions to it. The last
cases have few cells in contact, whose dense system is not predicted.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from steady import LAWS, case

from asperity.runs.program import program

CASES = ((1, 100, 1, (1e-4, 1e-3)), (12, 100, 1, (1e-4, 1e-3)), (12, 100, 0.1, (1e-2, 1e-1)),
         (12, 1000, 0.1, (1.0, 10.0)))


def size(pattern: str, text: str) -> float:
    """Return a size that `asperity check` prints, in MB; 0 if it does not print it."""
    found = re.search(pattern, text)
    return float(found[1]) * (1000 if found[2] == "GB" else 1) if found else 0.0


def main() -> None:
    """Run the cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[128, 256, 512])
    parser.add_argument("--laws", nargs="+", default=["none", "flat", "slope"], choices=LAWS)
    chosen = parser.parse_args()
    print("law, cells, arms, ratio, p/G: predicted MB, at most MB, largest MB, ratios")
    with tempfile.TemporaryDirectory() as name:
        path = Path(name, "case.nml")
        for law in chosen.laws:
            for cells in chosen.cells:
                for arms, ratio, pressure, speeds in CASES:
                    path.write_text(
                        case(cells, arms, ratio, pressure * 1e6, LAWS[law].format(mu=0.3),
                             np.array(speeds)).replace("short = 4e-3", "short = 16e-3")
                        + "\n&solver tolerance = 1e-5 /\n")
                    printed = subprocess.run([program(), "check", path.name], cwd=name, check=True,
                                          capture_output=True, text=True).stdout
                    predicted = size(r"memory: about ([\d.]+) (\w+)", printed)
                    most = predicted + size(r"takes up to ([\d.]+) (\w+)", printed)
                    run = subprocess.Popen(
                        [program(), "run", path.name, "--overwrite", "--quiet", "--threads", "1"],
                        cwd=name, stderr=subprocess.DEVNULL)
                    _, _, used = os.wait4(run.pid, 0)
                    largest = used.ru_maxrss * 1024e-6
                    print(f"{law}, {cells}, {arms}, {ratio}, {pressure}: {predicted:.1f},"
                          f" {most:.1f}, {largest:.1f}, {predicted / largest:.3f},"
                          f" {most / largest:.3f}", flush=True)


if __name__ == "__main__":
    main()
