"""Compare methods that make a patch of a road periodic: what load the join carries.

Patches are cut from larger random roads. On each, made periodic by each method, an elastic contact
is solved; beside it the same number of maps of the same spectrum that are periodic by themselves.
For each method: the share of the load at the join over the share of the area there (1 is right),
and contact area, rms slope and mean gap over those of the periodic maps.

    python tools/joins.py [--cells N] [--patches N] [--load P]
"""

from __future__ import annotations

import argparse

import numpy as np

import asperity
from asperity import theory
from asperity.roads.joins import join, load_at_join, margin_of, strip
from asperity.roads.patches import _levelled, low_pass
from asperity.roads.spectra import Spectrum

METHODS = ("blend", "smooth", "mirror", "window")


def contact(height: np.ndarray, side: float, pressure: float) -> asperity.NormalContact:
    """Return the contact of a map, E* = 1."""
    ny, nx = height.shape
    return asperity.solve_normal(height, side * nx, side * ny, 1.0, pressure=pressure,
                                 tolerance=1e-4)


def main() -> None:
    """Solve and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, default=128, help="of a side of a patch")
    parser.add_argument("--patches", type=int, default=16, help="of each kind of road")
    parser.add_argument("--load", type=float, default=0.02, help="mean pressure over E* rms slope")
    chosen = parser.parse_args()
    n = chosen.cells
    for name, longest in (("waves up to a quarter of the patch", 0.25),
                          ("waves up to the patch", 1.0), ("waves of four patches", 4.0)):
        k, psd = theory.self_affine_psd(0.8, longest, longest, 6.0 / n, rms_slope=0.1)
        spectrum = Spectrum(k, psd)
        large = 4 * n
        found: dict[str, list[tuple[float, ...]]] = {method: [] for method in METHODS}
        found["periodic"] = []
        for seed in range(chosen.patches):
            road = spectrum.draw(large, large, 4.0, 4.0, seed)
            for method in METHODS:
                margin = margin_of(n) if method == "blend" else 0
                part = _levelled(road[n : 2 * n + margin, n : 2 * n + margin])
                height = join(part, method, (n, n))
                lx, ly = height.shape[1] / n, height.shape[0] / n
                height = low_pass(height, lx, ly, 6.0 / n)
                solved = contact(height, 1.0 / n, 0.1 * chosen.load)
                load, area = load_at_join(solved.pressure, method)
                slope = asperity.surface.statistics(height, lx, ly).rms_slope
                found[method].append((load / area, solved.contact_area, slope, height.std()))
            whole = contact(road, 1.0 / n, 0.1 * chosen.load)
            near = strip((large, large), 0.125)
            found["periodic"].append((
                float(whole.pressure[near].sum() / whole.pressure.sum() / near.mean()),
                whole.contact_area, asperity.surface.statistics(road, 4.0, 4.0).rms_slope,
                road.std()))
        print(f"{name}: H = 0.8, {chosen.patches} patches of {n} x {n} cells")
        true = np.mean(found["periodic"], axis=0)
        for method, values in found.items():
            mean = np.mean(values, axis=0)
            error = np.std(values, axis=0, ddof=1) / np.sqrt(len(values))
            print(f"  {method:9} load at the join {mean[0]:.2f} +- {error[0]:.2f} of its share,"
                  f" area {mean[1] / true[1]:.3f} +- {error[1] / true[1]:.3f},"
                  f" rms slope {mean[2] / true[2]:.3f}, rms height {mean[3] / true[3]:.2f}")


if __name__ == "__main__":
    main()
