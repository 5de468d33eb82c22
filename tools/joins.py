"""Compare methods that make a patch of a road periodic, by the load that the join carries.

Patches are cut from larger random roads as `asperity.roads.patches.MeasuredRoad` does it, and
made periodic by each method; `blend_mean` is `blend` with each patch levelled by its mean plane
instead of the plane that rests on its tops. On each patch an elastic contact is solved, and on the
whole road, which is periodic by itself. For each kind of road and each method: the share of the
load at the join over the share of the area there (1 is right) with its standard error, and contact
area, rms slope and rms height over those of the whole road.

    python tools/joins.py [--cells N] [--patches N] [--load P]
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import asperity
from asperity import theory
from asperity.roads import patches
from asperity.roads.joins import load_at_join
from asperity.roads.measured import MeasuredSurface
from asperity.roads.patches import MeasuredRoad, low_pass
from asperity.roads.spectra import Spectrum

METHODS = ("seam", "mirror", "blend", "blend_mean", "smooth", "window")
TIMES = 4               # side of a road over the side of a patch


def self_affine(cells: int, longest: float, seed: int) -> np.ndarray:
    """Return a road of H = 0.8 whose longest wave is so many sides of a patch."""
    k, psd = theory.self_affine_psd(0.8, longest, longest, 6.0 / cells, rms_slope=0.1)
    side = TIMES * cells
    return Spectrum(k, psd).draw(side, side, float(TIMES), float(TIMES), seed)


def stones(cells: int, size: float, seed: int) -> np.ndarray:
    """Return stones of this size (in sides of a patch), rolled flat, with a fine texture."""
    random = np.random.default_rng(seed)
    side = TIMES * cells
    place = np.arange(side) / cells
    height = np.full((side, side), -np.inf)
    count = round((TIMES / size) ** 2)
    for x, y, top in zip(*(TIMES * random.random((2, count))),
                         0.08 * size * random.standard_normal(count), strict=True):
        dx = (place - x + 0.5 * TIMES) % TIMES - 0.5 * TIMES
        dy = ((place - y + 0.5 * TIMES) % TIMES - 0.5 * TIMES)[:, None]
        np.maximum(height, top - 0.45 * (dx**2 + dy**2) / size, out=height)
    plane = np.quantile(height, 0.7)
    height = np.where(height > plane, plane + 0.1 * (height - plane), height)
    return low_pass(height, TIMES, TIMES, 6.0 / cells) + self_affine(cells, 0.1, seed)


ROADS = {
    "self-affine, waves up to a quarter of the patch": lambda n, s: self_affine(n, 0.25, s),
    "self-affine, waves up to the patch": lambda n, s: self_affine(n, 1.0, s),
    "self-affine, waves up to four patches": lambda n, s: self_affine(n, 4.0, s),
    "flat-topped stones, eight in a side of the patch": lambda n, s: stones(n, 0.125, s),
    "flat-topped stones, three in a side of the patch": lambda n, s: stones(n, 0.333, s),
}


LEVEL = patches.rested


def level_mean(height: np.ndarray) -> np.ndarray:
    """Return a map without its mean plane."""
    return LEVEL(height, 0.5)


def solve(height: np.ndarray, lx: float, ly: float, pressure: float) -> asperity.NormalContact:
    """Return the contact of a map, E* = 1."""
    return asperity.solve_normal(height, lx, ly, 1.0, pressure=pressure, tolerance=1e-4)


def main() -> None:
    """Solve the contacts and print the table."""
    warnings.simplefilter("ignore", UserWarning)       # the patches of contact are small on purpose
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", type=int, default=128, help="of a side of a patch")
    parser.add_argument("--patches", type=int, default=24, help="of each kind of road")
    parser.add_argument("--load", type=float, default=0.02, help="mean pressure over E* rms slope")
    chosen = parser.parse_args()
    n, side = chosen.cells, float(TIMES)
    for name, make in ROADS.items():
        found: dict[str, list[tuple[float, ...]]] = {method: [] for method in METHODS}
        true = []
        for seed in range(-(-chosen.patches // 9)):
            surface = MeasuredSurface(make(n, seed), side, side, False, "m")
            slope = asperity.surface.statistics(surface.height, side, side).rms_slope
            pressure = chosen.load * slope
            whole = solve(surface.height, side, side, pressure)
            true.append((1.0, whole.contact_area, slope, surface.height.std()))
            for method in METHODS:
                how, _, mean_plane = method.partition("_")
                patches.rested = level_mean if mean_plane else LEVEL
                road = MeasuredRoad([surface], n, how)
                for k in range(min(9, chosen.patches - 9 * seed, road.count)):
                    patch = road.patch(k)
                    solved = solve(patch.height, patch.lx, patch.ly, pressure)
                    load, area = load_at_join(solved.pressure, how)
                    found[method].append((
                        load / area, solved.contact_area,
                        asperity.surface.statistics(patch.height, patch.lx, patch.ly).rms_slope,
                        patch.height.std()))
        print(f"{name}: patches of {n} x {n} cells")
        known = np.mean(true, axis=0)
        for method, values in found.items():
            mean = np.mean(values, axis=0) / known
            error = np.std(values, axis=0, ddof=1) / known / np.sqrt(len(values))
            print(f"  {method:10} {len(values)} patches: load at the join {mean[0]:.2f} +-"
                  f" {error[0]:.2f} of its share, area {mean[1]:.3f} +- {error[1]:.3f}, rms slope"
                  f" {mean[2]:.3f}, rms height {mean[3]:.3f}", flush=True)


if __name__ == "__main__":
    main()
