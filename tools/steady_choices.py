#!/usr/bin/env python3
"""Print how mesh and patches affect a curve of steady friction, for docs/choosing.md.

    . tools/setup.sh && . tools/install_editable.sh
    python tools/steady_choices.py [--time]

A road of three octaves (rms slope 0.2) slides under a rubber with twelve arms that soften it by
100. First the same road on finer and finer meshes: viscous friction by the losses of the waves and
by the slopes under the pressure, and contact area, each over that of the finest mesh. Then the
scatter of friction between roads of other seeds, and the patches for an interval of 5 %.
With --time instead: the viscous friction of a run in time, by the slopes and by the loss of the
arms, over that of the steady state, in the third lap.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import warnings
from pathlib import Path

import numpy as np

import asperity

SIDE, OCTAVES = 8e-3, 3
SPEEDS = (1e-4, 1e-2, 1.0)
PRESSURE = 2e5


def case(cells: int, seed: int) -> asperity.Case:
    """Return a curve; the shortest wave is an eighth of the longest, half the side."""
    tau = np.logspace(-6, 0, 12)[::-1]
    moduli = 1e6 * np.diff(100 ** (np.arange(13) / 12))
    angle = math.radians(31.7)
    return asperity.Case(
        grid=dict(nx=cells, ny=cells, lx=SIDE),
        surface=dict(shape="self_affine", hurst=0.8, wavelength_long=SIDE / 2,
                     wavelength_short=SIDE / 2 / 2**OCTAVES, rms_slope=0.2, seed=seed),
        material=dict(shear_modulus=1e6, prony_g=moduli, prony_tau=tau),
        phase=[dict(steady=True, pressure=PRESSURE, velocity_x=v * math.cos(angle),
                    velocity_y=v * math.sin(angle)) for v in SPEEDS],
        output=dict(snapshot_fields=["pressure"], snapshot_every=1))


def solve(folder: Path, cells: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return friction by losses and by slopes, and area, at the speeds."""
    run = asperity.run(case(cells, seed), output=folder / f"{cells}_{seed}.h5", threads=1)
    road = asperity.surface.self_affine(
        cells, cells, SIDE, SIDE, hurst=0.8, wavelength_long=SIDE / 2,
        wavelength_short=SIDE / 2 / 2**OCTAVES, rms_slope=0.2, seed=seed)
    wave = 2 * np.pi * np.fft.fftfreq(cells, SIDE / cells)
    modes = np.fft.fft2(road)
    angle = math.radians(31.7)
    slope = np.fft.ifft2(1j * (wave * math.cos(angle) + wave[:, None] * math.sin(angle))
                         * modes).real
    slopes = np.array([-np.mean(one.pressure * slope) / np.mean(one.pressure)
                       for one in run.snapshots])
    return (run.history["friction_viscous"], np.abs(slopes), run.history["contact_area"])


def compare_in_time(folder: Path) -> None:
    """Print both measures of viscous friction in steps of time."""
    side, pressure, speed = 64e-3, 3e5, 0.1
    for cells in (64, 128):
        found = []
        for drive in (dict(steady=True), dict(duration=3 * side / speed, steps=3 * cells)):
            one = asperity.Case(
                grid=dict(nx=cells, ny=cells, lx=side),
                surface=dict(shape="self_affine", hurst=0.8, wavelength_long=side / 2,
                             wavelength_short=side / 8, rms_slope=0.2, seed=3),
                material=dict(shear_modulus=1e6, prony_g=[5e6, 4e6], prony_tau=[3e-2, 3e-3]),
                phase=dict(pressure=pressure, velocity_x=speed, **drive),
                output=dict(snapshot_every=0))
            history = asperity.run(one, output=folder / f"time{len(found)}.h5", threads=1,
                                   overwrite=True).history
            lap = slice(-min(cells, history.rows), None)
            found.append((history["friction_viscous"][lap].mean(),
                          history["power_viscous"][lap].mean() / (pressure * side**2 * speed)))
        (steady, _), in_time = found
        slopes, loss = (100 * (value / steady - 1) for value in in_time)
        print(f"{cells // 8} cells in the shortest wave, in time over steady: by slopes"
              f" {slopes:+.2f} %, by loss {loss:+.2f} %")


def main() -> None:
    """Run the cases and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--time", action="store_true", help="compare with a run in time")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if chosen.time:
            compare_in_time(folder)
            return
        meshes = [64, 128, 256]
        found = [solve(folder, cells, 1) for cells in meshes]
        print("| cells in the shortest wave | friction by losses | by slopes | contact area |")
        print("| --- | --- | --- | --- |")
        finest = found[-1]
        for cells, (losses, slopes, area) in zip(meshes[:-1], found[:-1], strict=True):
            parts = [100 * (x / y - 1) for x, y in zip((losses, slopes, area), (
                finest[0], finest[0], finest[2]), strict=True)]
            texts = [", ".join(f"{value:+.1f} %" for value in part) for part in parts]
            print(f"| {cells // 2 // 2**OCTAVES} | {' | '.join(texts)} |")
        draws = np.array([solve(folder, 128, seed)[0] for seed in range(1, 17)])
        scatter = draws.std(axis=0, ddof=1) / draws.mean(axis=0)
        patches = np.ceil((1.96 * scatter / 0.05) ** 2)
        print("scatter of friction between roads:", ", ".join(f"{100 * s:.0f} %" for s in scatter))
        print("patches for an interval of +- 5 %:", ", ".join(f"{n:.0f}" for n in patches))


if __name__ == "__main__":
    main()
