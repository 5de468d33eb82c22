#!/usr/bin/env python3
"""Run input.nml with and without its &adhesion and draw the loops of force and displacement."""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path

import matplotlib
import numpy as np

import asperity

HERE = Path(__file__).resolve().parent


COLUMNS = ("displacement", "force", "work_load", "energy_elastic", "energy_adhesive",
           "dissipated_viscous", "contact_area", "time")


def run(text: str) -> dict[str, np.ndarray]:
    """Run an input and return its history."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.nml"
        case.write_text(text)
        history = asperity.run(case, output=Path(folder) / "case.h5").history
        return {name: np.array(history[name]) for name in COLUMNS}


def loops(quick: bool = False) -> dict[str, dict[str, np.ndarray]]:
    """Return the histories with and without adhesion."""
    text = (HERE / "input.nml").read_text()
    if quick:
        text = re.sub(r"n([xy]) = 128", r"n\1 = 48", text)
        text = text.replace("steps = 50", "steps = 12").replace("steps = 125", "steps = 30")
    bare = re.sub(r"(?s)&adhesion.*?\n/\n", "", text)
    return {"with adhesion": run(text), "without": run(bare)}


def main() -> None:
    """Draw the picture and print what is lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=HERE / "picture.png")
    parser.add_argument("--quick", action="store_true", help="a coarse grid and few steps")
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for name, history in loops(arguments.quick).items():
        left.plot(history["displacement"] * 1e6, history["force"] * 1e6, label=name)
        right.plot(history["time"], history["dissipated_viscous"] * 1e12, label=name)
        print(f"{name}: largest pull {-history['force'].min() * 1e6:.1f} uN, lost in the solid"
              f" {history['dissipated_viscous'][-1] * 1e12:.1f} pJ")
    left.axhline(0, color="grey", linewidth=0.5)
    left.set(xlabel="displacement, µm", ylabel="force, µN")
    right.set(xlabel="time, s", ylabel="energy lost in the solid, pJ")
    left.legend()
    right.legend()
    figure.savefig(arguments.output, dpi=110)


if __name__ == "__main__":
    main()
