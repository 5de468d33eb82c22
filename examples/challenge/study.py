"""A contact like that of the Contact Mechanics Challenge: rough, with adhesion of short range.

Solid, adhesion, slope, Hurst exponent and shortest wave are those of the challenge (thesis, section
4.2). The map is 65 times smaller, so that the cells resolve the range. The study computes the
quantities of the challenge.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np

import asperity
from asperity import theory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 7

MODULUS, ENERGY, RANGE = 25e6, 0.05, 2.071e-9      # Pa, J/m2, m
HURST, SLOPE, SHORT = 0.8, 1.0, 100e-9             # shortest wave, m
REFERENCE = 0.25e6                                 # Pa


def patches(contact: np.ndarray) -> np.ndarray:
    """Return the numbers of cells of the patches of contact of a periodic map."""
    from scipy import ndimage

    label, count = ndimage.label(contact)
    parent = np.arange(count + 1)

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for one, other in ((label[0], label[-1]), (label[:, 0], label[:, -1])):
        for a, b in zip(one, other, strict=True):
            if a and b:
                parent[root(a)] = root(b)
    joined = np.array([root(i) for i in range(count + 1)])[label]
    sizes = np.bincount(joined[contact])
    return np.sort(sizes[sizes > 0])[::-1]


def histogram(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the density of values of the whole map over a part of its range."""
    return np.histogram(values, edges)[0] / (values.size * np.diff(edges))


def full_energy(long: float, rolloff: float) -> float:
    """Return the elastic energy of full contact with the law's waves, J/m2: E*/4 <h q h>."""
    k, psd = theory.self_affine_psd(HURST, long, rolloff, SHORT, rms_slope=SLOPE)
    fine = np.geomspace(k[0], k[-1], 4001)
    values = np.exp(np.interp(np.log(fine), np.log(k), np.log(psd)))
    return float(MODULUS / 4 * np.trapezoid(values * fine**2, fine) / (2 * math.pi))


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Press the map with and without adhesion, and with other ranges at the reference load."""
    asperity.set_threads(common.jobs)
    # The quick form has a quarter of the cells per side, and a longer range, which they resolve.
    cells, cell, reach = (128, 6e-9, 4 * RANGE) if quick else (1024, 1.5e-9, RANGE)
    loads = (0.1e6, REFERENCE) if quick else (0.05e6, 0.1e6, REFERENCE, 0.5e6, 1e6, 2e6)
    factors = (1, 2) if quick else (1, 2, 4, 8)
    side = cells * cell
    height = asperity.surface.self_affine(
        cells, lx=side, hurst=HURST, wavelength_long=side / 2, wavelength_rolloff=side / 4,
        wavelength_short=SHORT, rms_slope=SLOPE, seed=1)
    options: dict[str, Any] = dict(energy=ENERGY, max_iterations=4000, tolerance=1e-5)
    edges = np.linspace(-1.1 * ENERGY / reach, 60e6, 121)
    gap_edges = np.geomspace(reach / 20, 3e-7, 61)
    data: dict[str, Any] = {
        "side": side, "cells": cells, "range": reach, "load": np.array(loads),
        "rms_height": float(height.std()), "pressure_edges": edges, "gap_edges": gap_edges,
        "c2": ENERGY / full_energy(side / 2, side / 4),
        "c2_of_the_challenge": ENERGY / full_energy(1e-4, 2e-5)}
    found: dict[str, dict[str, list[Any]]] = {
        kind: {name: [] for name in ("area", "gap", "approach", "ffts", "residual", "balance")}
        for kind in ("adhesive", "bare")}
    contact: Any = "non_adhesive"
    bare: Any = None
    for load in loads:
        contact = asperity.solve_adhesive(height, side, None, MODULUS, range=reach, pressure=load,
                                          start=contact, **options)
        bare = asperity.solve_normal(height, side, None, MODULUS, pressure=load, start=bare)
        for kind, one in (("adhesive", contact), ("bare", bare)):
            found[kind]["area"].append(one.contact_area)
            found[kind]["gap"].append(float(one.gap.mean()))
            found[kind]["approach"].append(one.displacement)
            found[kind]["ffts"].append(one.ffts)
            found[kind]["residual"].append(one.residual)
            found[kind]["balance"].append(float(one.pressure.mean() / load - 1))
        if load != REFERENCE:
            continue
        for kind, one in (("adhesive", contact), ("bare", bare)):
            touch = one.gap <= 0 if kind == "adhesive" else one.pressure > 0
            data[f"{kind}_reference"] = {
                "pressures": histogram(one.pressure, edges),
                "gaps": histogram(one.gap[~touch], gap_edges) * float((~touch).mean()),
                "lowest": float(one.pressure.min()), "highest": float(one.pressure.max()),
                "patches": patches(touch)}
        data["touch"] = contact.gap <= 0
        data["bare_touch"] = bare.pressure > 0
        row = int(np.count_nonzero(contact.gap <= 0, axis=1).argmax())
        data["line"] = {"x": np.arange(cells) * cell, "road": height[row],
                        "rubber": contact.displacement_z[row] - contact.displacement + height.max()}
        # Longer ranges of the same energy start from the contact without adhesion, as the first one
        # does.
        ranges: dict[str, list[float]] = {"range": [], "area": [], "gap": []}
        for factor in factors:
            one = asperity.solve_adhesive(height, side, None, MODULUS, range=factor * reach,
                                          pressure=load, start="non_adhesive", **options)
            ranges["range"].append(factor * reach)
            ranges["area"].append(one.contact_area)
            ranges["gap"].append(float(one.gap.mean()))
        data["ranges"] = {name: np.array(values) for name, values in ranges.items()}
    for kind, columns in found.items():
        data[kind] = {name: np.array(values) for name, values in columns.items()}
    data["slope_of_area"] = data["bare"]["area"] * MODULUS * SLOPE / data["load"]
    data["slope_of_theories"] = [math.sqrt(8 / math.pi), math.sqrt(2 * math.pi)]
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Assert the balance of forces, bounds, and trends with load and range."""
    adhesive, bare, load = data["adhesive"], data["bare"], data["load"]
    for kind, found in (("adhesive", adhesive), ("bare", bare)):
        assert (found["residual"] < 1e-5).all(), f"{kind}: residuals {found['residual']}"
        assert (np.abs(found["balance"]) < 1e-6).all(), f"{kind}: the pressure is not the load"
        assert (np.diff(found["area"]) > 0).all(), f"{kind}: the area does not grow"
        assert (np.diff(found["gap"]) < 0).all(), f"{kind}: the gap does not close"
    assert (adhesive["area"] > 1.5 * bare["area"]).all(), "adhesion does not enlarge the contact"
    assert (adhesive["gap"] < bare["gap"]).all(), "adhesion does not close the gap"
    # Without adhesion and at low load, the slope lies between that of Persson, 1.60, and that of
    # Bush, Gibson and Thomas, 2.51. The bounds are wider because counted cells overestimate the
    # area by half the perimeter, and because a small map is a small sample.
    low, (least, most) = data["slope_of_area"][0], data["slope_of_theories"]
    assert least < low < 1.15 * most, f"slope of the area {low}"
    # The largest attraction is w/z0. Within a patch the pressure of the wall adds to it.
    sharp = data["adhesive_reference"]
    strongest = ENERGY / data["range"]
    assert sharp["lowest"] >= -strongest * (1 + 1e-4), "the attraction exceeds its maximum"
    assert sharp["lowest"] < -0.9 * strongest, "the attraction does not reach its maximum"
    assert data["bare_reference"]["lowest"] == 0
    # The histogram contains the map except the highest pressures (one per mille).
    width = np.diff(data["pressure_edges"])
    for kind in ("adhesive", "bare"):
        assert abs((data[f"{kind}_reference"]["pressures"] * width).sum() - 1) < 2e-3, kind
        sizes = data[f"{kind}_reference"]["patches"]
        area = data[kind]["area"][load == REFERENCE][0] * data["cells"] ** 2
        assert sizes.sum() == round(area), f"{kind}: patches {sizes.sum()}, contact {area}"
    # Patches that grow by adhesion join: the largest patch has a larger share of the area.
    assert sharp["patches"][0] > data["bare_reference"]["patches"][0]
    # A longer range of the same energy attracts less: the contact area falls towards that without
    # adhesion.
    area = data["ranges"]["area"]
    assert (np.diff(area) < 0).all(), f"areas of the ranges: {area}"


def picture(data: dict[str, Any]) -> Figure:
    """Draw the map, a section, the curves over the load, and the distributions."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    figure, axes = common.subplots(2, 4, width=5.4, height=3.9)
    where, section, areas, means, pressures, gaps, sizes, ranges = axes.flat
    blue, red = common.COLOURS[:2]
    side = data["side"] * 1e6
    where.grid(False)
    where.imshow(data["touch"].astype(int) + data["bare_touch"], origin="lower", vmin=0, vmax=2,
                 extent=(0, side, 0, side), interpolation="nearest",
                 cmap=ListedColormap(["#f0f0f0", common.COLOURS[5], "#000000"]))
    where.set(title="contact at 0.25 MPa", xlabel="x, µm", ylabel="y, µm")
    where.legend(handles=[Patch(color=common.COLOURS[5], label="with adhesion"),
                          Patch(color="#000000", label="without, too")],
                 loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    line = data["line"]
    x, nano = line["x"] * 1e6, 1e9
    section.fill_between(x, line["road"] * nano, line["road"].min() * nano - 20, color="#bbbbbb",
                         label="road")
    section.plot(x, line["rubber"] * nano, color=blue, label="surface of the solid")
    section.set(title="a section through most contact", xlabel="x, µm", ylabel="z, nm",
                ylim=(line["road"].min() * nano - 20, line["road"].max() * nano + 60))
    section.legend()
    load = data["load"] / 1e6
    areas.loglog(load, data["adhesive"]["area"], "o-", color=blue, label="adhesive")
    areas.loglog(load, data["bare"]["area"], "s-", color=red, label="without adhesion")
    areas.loglog(load, theory.persson_area(data["load"], MODULUS, SLOPE), "k:",
                 label="Persson, without adhesion")
    unit = data["rms_height"]
    means.semilogx(load, data["adhesive"]["gap"] * nano, "o-", color=blue, label="adhesive")
    means.semilogx(load, data["bare"]["gap"] * nano, "s-", color=red, label="without adhesion")
    means.axhline(unit * nano, color="k", ls=":", lw=1, label="rms height of the map")
    areas.set(xlabel="mean pressure, MPa", ylabel="fraction in contact", title="contact area")
    means.set(xlabel="mean pressure, MPa", ylabel="mean gap, nm", ylim=(0, None), title="mean gap")
    for kind, colour, name in (("adhesive", blue, "adhesive"), ("bare", red, "without adhesion")):
        found = data[f"{kind}_reference"]
        middle = (data["pressure_edges"][1:] + data["pressure_edges"][:-1]) / 2e6
        shown = found["pressures"] > 0
        pressures.semilogy(middle[shown], found["pressures"][shown] * 1e6, ".-", color=colour,
                           label=name)
        centre = np.sqrt(data["gap_edges"][1:] * data["gap_edges"][:-1]) * nano
        shown = found["gaps"] > 0
        gaps.loglog(centre[shown], found["gaps"][shown] / nano, ".-", color=colour, label=name)
        cells = found["patches"] * (data["side"] / data["cells"]) ** 2 * 1e12
        sizes.loglog(cells, np.arange(1, cells.size + 1), ".-", color=colour, label=name)
    pressures.axvline(-ENERGY / data["range"] / 1e6, color="k", ls=":", lw=1, label="−w/z$_0$")
    pressures.set(xlabel="pressure, MPa", ylabel="density, 1/MPa")
    gaps.axvline(data["range"] * nano, color="k", ls=":", lw=1, label="range")
    gaps.set(xlabel="gap, nm", ylabel="density, 1/nm")
    sizes.set(xlabel="area of a patch, µm²", ylabel="number of patches of this area or more")
    pressures.set_title("pressure at 0.25 MPa")
    gaps.set_title("gap at 0.25 MPa")
    sizes.set_title("patches of contact at 0.25 MPa")
    reach = data["ranges"]["range"] * nano
    ranges.plot(reach, 100 * data["ranges"]["area"], "o-", color=blue, label="area, %")
    ranges.plot(reach, data["ranges"]["gap"] * nano, "o--", color=blue, mfc="none",
                label="mean gap, nm")
    ranges.axhline(100 * float(data["bare"]["area"][data["load"] == REFERENCE][0]), color=red,
                   ls="-", lw=1, label="area without adhesion, %")
    ranges.set(xlabel="range of adhesion, nm (same energy)", ylabel="area, %; gap, nm",
               ylim=(0, None), title="other ranges at 0.25 MPa")
    for one in (areas, means, pressures, gaps, sizes, ranges):
        one.legend()
    return figure
