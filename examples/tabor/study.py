"""Contact radius of an adhesive sphere over the Tabor parameter.

The sphere is that of the thesis's figure 1.7: R = 1 m, F = 1e-5 N, w = 3.2e-5 J/m2, G = 0.37 Pa,
incompressible.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np

import asperity
from asperity import theory

MINUTES = 0.5

RADIUS, FORCE, ENERGY, MODULUS = 1.0, 1e-5, 3.2e-5, 4 * 0.37
#: The range of the attraction at which the Tabor parameter is 1, m.
LENGTH = (RADIUS * (ENERGY / MODULUS) ** 2) ** (1 / 3)


def contact_radius(tabor: float, potential: str, cells: int) -> float:
    """Return the radius, m, of the contact area on a map of `cells` per side."""
    reach = LENGTH / tabor
    # Twice the JKR radius, and the reach of the attraction around the contact.
    side = 2.6 * np.hypot(0.075, np.sqrt((2.0 if potential != "exponential" else 5.0) * reach))
    sphere = asperity.surface.shape("paraboloid", cells, lx=side, radius=RADIUS, boundary="free")
    contact = asperity.solve_adhesive(
        sphere, side, None, MODULUS, potential=potential, energy=ENERGY, range=reach, force=FORCE,
        boundary="free", max_iterations=3000)
    return float(side * np.sqrt(contact.contact_area / np.pi))


def maugis_radius(tabor: float) -> float:
    """Return the radius of Maugis's theory, m."""
    return theory.maugis(RADIUS, MODULUS, ENERGY, force=FORCE, range=LENGTH / tabor).contact_radius


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Return the radii of both potentials, of Maugis's theory and of its limits, m."""
    tabor = [0.1, 0.6] if quick else [0.05, 0.1, 0.2, 0.35, 0.6, 1.0, 1.7, 3.0, 5.0]
    cells = 96 if quick else 288
    return {
        "tabor": np.array(tabor),
        "exponential": np.array([contact_radius(t, "exponential", cells) for t in tabor]),
        "maugis_dugdale": np.array([contact_radius(t, "maugis_dugdale", cells) for t in tabor]),
        "theory": np.array([maugis_radius(t) for t in tabor]),
        "jkr": theory.jkr(RADIUS, MODULUS, ENERGY, force=FORCE).contact_radius,
        "dmt": theory.dmt(RADIUS, MODULUS, ENERGY, force=FORCE).contact_radius,
        "hertz": (3 * FORCE * RADIUS / (4 * MODULUS)) ** (1 / 3),
    }


def check(data: dict[str, Any], quick: bool) -> None:
    """Check both potentials against the theory."""
    exact = data["theory"]
    # The area counts whole cells. With 96 per side, about 20 across the radius, the error is 2 %;
    # with 288 it is less than 1 %.
    error = np.abs(data["maugis_dugdale"] / exact - 1).max()
    assert error < (0.02 if quick else 0.01), f"Maugis-Dugdale is {error:.2%} off its theory"
    # The attraction has another shape with the same energy and range. The radius between DMT and
    # JKR differs by 1.5 %.
    error = np.abs(data["exponential"] / exact - 1).max()
    assert error < (0.03 if quick else 0.02), f"the exponential potential is {error:.2%} off"
    assert (np.diff(data["exponential"]) > 0).all(), "the contact must grow with the parameter"
    assert data["hertz"] < data["dmt"] < data["jkr"]
    if not quick:
        assert abs(data["exponential"][-1] / data["jkr"] - 1) < 0.01, "JKR is not reached"
        # At 0.05 Maugis's theory itself is still 3.6 % above DMT.
        assert abs(data["exponential"][0] / data["dmt"] - 1) < 0.05, "DMT is not reached"


def picture(data: dict[str, Any]) -> Any:
    """Draw the radii over the parameter."""
    figure, axes = common.subplots(width=6.5, height=4.5)
    fine = np.geomspace(0.03, 10.0, 60)
    axes.plot(fine, [maugis_radius(t) for t in fine], "k-", label="Maugis")
    for name, style in (("jkr", "--"), ("dmt", "-."), ("hertz", ":")):
        axes.axhline(data[name], color="grey", linestyle=style,
                     label=name.upper() if name != "hertz" else "Hertz")
    axes.plot(data["tabor"], data["maugis_dugdale"], "o", mfc="none",
              label="Asperity, Maugis-Dugdale")
    axes.plot(data["tabor"], data["exponential"], "x", label="Asperity, exponential")
    axes.set(xscale="log", xlabel="Tabor parameter (R w²/(E*² z0³))^(1/3)",
             ylabel="contact radius, m", ylim=(0, None))
    axes.legend(fontsize="small")
    return figure
