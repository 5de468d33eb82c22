#!/usr/bin/env python3
"""Draw area and mean gap against load of a result of input.nml, with and without adhesion."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np

import asperity

HERE = Path(__file__).resolve().parent


def without_adhesion(run: asperity.Run, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return areas and mean gaps of the same map without adhesion."""
    contact, areas, gaps = None, [], []
    for load in loads:
        contact = asperity.solve_normal(run.height, run.grid.lx, run.grid.ly, 25e6, pressure=load,
                                        start=contact)
        areas.append(contact.contact_area)
        gaps.append(contact.gap.mean())
    return np.array(areas), np.array(gaps)


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("result", type=Path, nargs="?", default=HERE / "adhesive_rough.h5")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "picture.png")
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    from matplotlib import pyplot

    run = asperity.open(arguments.result)
    load, area, gap = (np.array(run.history[name]) for name in
                       ("pressure", "contact_area", "mean_gap"))
    turn = int(load.argmax()) + 1
    bare_area, bare_gap = without_adhesion(run, load[:turn])
    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    for axes, values, bare, name in ((left, area, bare_area, "contact area, fraction"),
                                     (middle, gap * 1e9, bare_gap * 1e9, "mean gap, nm")):
        axes.plot(load[:turn] / 1e6, values[:turn], "o-", label="pressed")
        axes.plot(load[turn - 1:] / 1e6, values[turn - 1:], "s--", label="released")
        axes.plot(load[:turn] / 1e6, bare, "k:", label="without adhesion")
        axes.set(xscale="log", xlabel="mean pressure, MPa", ylabel=name, ylim=(0, None))
        axes.legend(fontsize="small")
    pressure = run.snapshots[-1].pressure
    image = right.imshow(pressure / 1e6, origin="lower", cmap="RdBu_r", vmin=-50, vmax=50,
                         extent=(0, run.grid.lx * 1e6, 0, run.grid.ly * 1e6))
    right.set(title="pressure after release", xlabel="x, µm", ylabel="y, µm")
    figure.colorbar(image, label="MPa")
    figure.savefig(arguments.output, dpi=110)


if __name__ == "__main__":
    main()
