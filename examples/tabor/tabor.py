#!/usr/bin/env python3
"""Contact radius of an adhesive sphere against the Tabor parameter, beside Maugis's theory.

The sphere of the thesis's figure 1.7: R = 1 m, F = 1e-5 N, w = 3.2e-5 J/m2, G = 0.37 Pa,
incompressible.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np

import asperity
from asperity import theory

HERE = Path(__file__).resolve().parent
RADIUS, FORCE, ENERGY, MODULUS = 1.0, 1e-5, 3.2e-5, 4 * 0.37
#: The range of the attraction at which the Tabor parameter is 1, m.
LENGTH = (RADIUS * (ENERGY / MODULUS) ** 2) ** (1 / 3)


def contact_radius(tabor: float, potential: str, cells: int) -> float:
    """Return the radius, m, of the area of contact on a map of `cells` a side."""
    reach = LENGTH / tabor
    # Twice the radius of JKR, and what the attraction reaches around it.
    side = 2.6 * np.hypot(0.075, np.sqrt((2.0 if potential != "exponential" else 5.0) * reach))
    sphere = asperity.surface.shape("paraboloid", cells, lx=side, radius=RADIUS, boundary="free")
    contact = asperity.solve_adhesive(
        sphere, side, None, MODULUS, potential=potential, energy=ENERGY, range=reach, force=FORCE,
        boundary="free", max_iterations=3000)
    return side * np.sqrt(contact.contact_area / np.pi)


def study(tabors: list[float], cells: int) -> dict[str, np.ndarray]:
    """Return the radii of both potentials and of Maugis's theory."""
    return {
        "exponential": np.array([contact_radius(t, "exponential", cells) for t in tabors]),
        "maugis_dugdale": np.array([contact_radius(t, "maugis_dugdale", cells) for t in tabors]),
        "theory": np.array([theory.maugis(RADIUS, MODULUS, ENERGY, force=FORCE, range=LENGTH / t
                                          ).contact_radius for t in tabors]),
    }


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=HERE / "picture.png")
    parser.add_argument("--quick", action="store_true", help="a coarse grid and few points")
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    from matplotlib import pyplot

    tabors = [0.2, 1.0] if arguments.quick else [0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 1.7, 3.0, 5.0]
    found = study(tabors, 64 if arguments.quick else 256)
    figure, axes = pyplot.subplots(figsize=(6.5, 4.5), layout="constrained")
    fine = np.geomspace(0.03, 10.0, 80)
    axes.plot(fine, [theory.maugis(RADIUS, MODULUS, ENERGY, force=FORCE, range=LENGTH / t
                                   ).contact_radius for t in fine], "k-", label="Maugis")
    lines = {"JKR": theory.jkr(RADIUS, MODULUS, ENERGY, force=FORCE).contact_radius,
             "DMT": theory.dmt(RADIUS, MODULUS, ENERGY, force=FORCE).contact_radius,
             "Hertz": (3 * FORCE * RADIUS / (4 * MODULUS)) ** (1 / 3)}
    for (name, value), style in zip(lines.items(), ("--", "-.", ":"), strict=True):
        axes.axhline(value, color="grey", linestyle=style, label=name)
    axes.plot(tabors, found["maugis_dugdale"], "o", mfc="none", label="Asperity, Maugis-Dugdale")
    axes.plot(tabors, found["exponential"], "x", label="Asperity, exponential")
    axes.set(xscale="log", xlabel="Tabor parameter (R w²/(E*² z0³))^(1/3)",
             ylabel="contact radius, m", ylim=(0, None))
    axes.legend(fontsize="small")
    figure.savefig(arguments.output, dpi=110)
    print("Tabor   exponential   Maugis-Dugdale   theory, m")
    for row in zip(tabors, *found.values(), strict=True):
        print("{:5.2f}   {:11.5f}   {:14.5f}   {:6.5f}".format(*row))


if __name__ == "__main__":
    main()
