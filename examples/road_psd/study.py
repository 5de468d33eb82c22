"""The power spectral density of a road: the law, and maps that are generated from it.

The study generates self-affine maps with both generators, with and without roll-off, from the
thesis's eq. 1.6. It compares the power spectral density, that of a profile, statistics and the
distribution of heights with the law.
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

MINUTES = 0.3

#: Side of the map, long, roll-off and short wavelength, m; Hurst exponent; rms height, m.
SIDE, LONG, ROLLOFF = 20e-3, 10e-3, 2e-3
HURST, RMS_HEIGHT = 0.8, 50e-6
GENERATORS = ("random_phase", "filtered_noise")


def _map(cells: int, rolloff: float, generator: str, seed: int = 1) -> np.ndarray:
    """Return a map whose shortest wave is 8 cells long."""
    return asperity.surface.self_affine(
        cells, lx=SIDE, hurst=HURST, wavelength_long=LONG, wavelength_rolloff=rolloff,
        wavelength_short=8 * SIDE / cells, rms_height=RMS_HEIGHT, seed=seed, generator=generator)


def _law(k: np.ndarray, cells: int, rolloff: float) -> np.ndarray:
    """Return eq. 1.6 at the wave numbers k inside the band, scaled to the rms height."""
    knots, psd = theory.self_affine_psd(HURST, LONG, rolloff, 8 * SIDE / cells,
                                        rms_height=RMS_HEIGHT)
    return np.exp(np.interp(np.log(k), np.log(knots), np.log(psd)))


def _inside(k: np.ndarray, high: float) -> np.ndarray:
    """Return the rings entirely in the band; they are as wide as the spacing of the modes."""
    spacing = 2 * math.pi / SIDE
    return (k > 2 * math.pi / LONG) & (k < high - 0.5 * spacing)


def _profile_psd(height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the density of lines along x, averaged over all lines, m3."""
    cells = height.shape[1]
    lines = np.abs(np.fft.rfft(height, axis=1) / cells) ** 2 * SIDE
    return 2 * math.pi / SIDE * np.arange(1, cells // 2), lines.mean(axis=0)[1:cells // 2]


def _profile_law(k: np.ndarray, cells: int) -> np.ndarray:
    """Return the density of a line by the law: its sum over all waves across."""
    high = 2 * math.pi / (8 * SIDE / cells)
    law = np.zeros_like(k)
    for i, along in enumerate(k):
        if along < high:
            # The midpoint rule has 2000 points, because the law has a jump and a kink.
            top = math.sqrt(high**2 - along**2)
            across = (np.arange(2000) + 0.5) * top / 2000
            total = np.hypot(along, across)
            inside = total >= 2 * math.pi / LONG
            law[i] = _law(total[inside], cells, ROLLOFF).sum() * top / 2000 / math.pi
    return law


def _slope(k: np.ndarray, psd: np.ndarray, low: float, high: float) -> float:
    """Return the exponent of a power law between two wave numbers."""
    band = (k > low) & (k < high)
    return float(np.polyfit(np.log(k[band]), np.log(psd[band]), 1)[0])


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Generate the maps and measure them, without files."""
    cells = 512 if quick else 2048
    seeds = 4 if quick else 8
    low, high = 2 * math.pi / ROLLOFF, 2 * math.pi / (8 * SIDE / cells)
    spacing = 2 * math.pi / SIDE
    data: dict[str, Any] = {"cells": cells, "low": low, "high": high}
    for generator in GENERATORS:
        height = _map(cells, ROLLOFF, generator)
        rings = asperity.surface.psd(height, SIDE)
        band = _inside(rings.wavenumber, high)
        k, psd, modes = (np.asarray(values)[band] for values in rings)
        line_k, line = _profile_psd(height)
        data[generator] = {
            "k": k, "psd": psd, "modes": modes, "law": _law(k, cells, ROLLOFF),
            # beyond the short wave, with a margin of half a ring
            "outside": float(np.sum((rings.psd * rings.modes)[rings.wavenumber > high + spacing])
                             / np.sum(rings.psd * rings.modes)),
            "variance": float(np.sum(rings.psd * rings.modes)) / SIDE**2,
            "line_k": line_k, "line": line, "line_law": _profile_law(line_k, cells),
            "exponent": _slope(k, psd, 1.5 * low, high),
            "statistics": asperity.surface.statistics(height, SIDE)._asdict(),
            "heights": np.histogram(height / RMS_HEIGHT, 40, (-5, 5), density=True)[0],
        }
        kurtoses = [asperity.surface.statistics(_map(cells // 2, ROLLOFF, generator, seed), SIDE)
                    for seed in range(1, seeds + 1)]
        data[generator]["skewness_of_seeds"] = [s.skewness for s in kurtoses]
        data[generator]["kurtosis_of_seeds"] = [s.kurtosis for s in kurtoses]
    noise = data["filtered_noise"]
    ratio = noise["psd"] / noise["law"]
    # Relative to rings of this number of modes with exponentially distributed power. The power of
    # -k is the same.
    data["scatter"] = float(((ratio / np.median(ratio) - 1) * np.sqrt(noise["modes"] / 2)).std())
    data["map"] = height[:: cells // 512, :: cells // 512]
    # values by the moments of the law
    fine = np.geomspace(2 * math.pi / LONG, high, 20001)
    values = _law(fine, cells, ROLLOFF) * fine / (2 * math.pi)
    # The one-dimensional moments of an isotropic surface are m0 = <h2>, m2 = <|grad h|2>/2, ...
    m0 = float(np.trapezoid(values, fine))
    m2 = float(np.trapezoid(values * fine**2, fine)) / 2
    m4 = 3 * float(np.trapezoid(values * fine**4, fine)) / 8
    data["law_statistics"] = {
        "rms_height": math.sqrt(m0), "rms_slope": math.sqrt(2 * m2),
        "rms_curvature": math.sqrt(2 * m4 / 3), "nayak": m0 * m4 / m2**2}
    # Without roll-off the waves fill the band from the longest one on.
    height = _map(cells, LONG, "random_phase")
    rings = asperity.surface.psd(height, SIDE)
    band = _inside(rings.wavenumber, high)
    data["no_rolloff"] = {
        "k": rings.wavenumber[band], "psd": rings.psd[band],
        "law": _law(rings.wavenumber[band], cells, LONG),
        "statistics": asperity.surface.statistics(height, SIDE)._asdict()}
    return data


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the maps against the law."""
    for generator in GENERATORS:
        found = data[generator]
        assert abs(found["variance"] / RMS_HEIGHT**2 - 1) < 1e-9, "Parseval's sum is not <h2>"
        assert found["outside"] < 1e-12, f"{generator}: power outside the band"
        ratio = found["psd"] / found["law"]
        if generator == "random_phase":
            # The law is taken at the mean wave number of a ring, and the scale from the integral
            # instead of the sum over the modes. A ring is as wide as the spacing of the modes, so
            # that the mean of k^-3.6 over it deviates by (3.6 4.6/24) (dk/k)^2, which is 1 % at ten
            # spacings. The kink of the roll-off is there, too.
            inner = found["k"] > 1.2 * data["low"]
            spread = ratio[inner] / np.median(ratio[inner]) - 1
            assert np.abs(spread).max() < 0.02, f"random phase: off by {np.abs(spread).max():.3f}"
            assert abs(np.median(ratio[inner]) - 1) < 0.03, "random phase: scale"
        else:
            # The power of a mode is exponentially distributed, and that of -k is the same. The mean
            # of a ring of N modes therefore scatters by sqrt(2/N).
            assert 0.85 < data["scatter"] < 1.15, f"filtered noise: scatter {data['scatter']:.2f}"
            assert abs(np.average(ratio, weights=found["modes"]) - 1) < 0.1, "filtered: scale"
        assert abs(found["exponent"] + 2 * (1 + HURST)) < 0.03, f"exponent {found['exponent']}"
        # A line is a sum over the modes across. The tolerance is 1 % for the sum instead of the
        # integral. The points of noise scatter by 1/sqrt(modes across), about 5 % here, but their
        # mean does not.
        inner = (found["line_k"] > 0.3 * data["low"]) & (found["line_k"] < 0.9 * data["high"])
        ratio = found["line"][inner] / found["line_law"][inner]
        assert abs(ratio.mean() - 1) < 0.05, f"{generator}: lines off by {ratio.mean() - 1:+.3f}"
        # Slope and curvature come from the many short waves, so that they are accurate even for
        # noise. The rms height is prescribed.
        law, statistics = data["law_statistics"], found["statistics"]
        for name, tolerance in (("rms_height", 1e-6), ("rms_slope", 0.06), ("rms_curvature", 0.06),
                                ("nayak", 0.25)):
            got = statistics[name] / law[name] - 1
            assert abs(got) < tolerance, f"{generator}: {name} off by {got:+.3f}"
        # A Gaussian map has about 50 independent hills of the length LONG/ROLLOFF. Its skewness is
        # 0 and its kurtosis 3 within the scatter of the seeds.
        for name, wanted in (("skewness", 0.0), ("kurtosis", 3.0)):
            values = np.array(found[f"{name}_of_seeds"])
            assert abs(values.mean() - wanted) < 0.15, f"{generator}: {name} {values}"
    spread = data["no_rolloff"]["psd"] / data["no_rolloff"]["law"]
    inner = data["no_rolloff"]["k"] > 1.2 * data["low"]
    assert np.ptp(spread[inner]) < 0.05, "no roll-off: not the law"
    # Most of the height is in the longest waves, and the map contains few of them. The sum over
    # them differs by a fifth from the integral of the law.
    assert abs(np.median(spread) - 1) < 0.25, f"no roll-off: scale {np.median(spread):.2f}"
    # The same height in longer waves makes a surface with smaller slopes.
    assert data["no_rolloff"]["statistics"]["rms_slope"] < \
        0.7 * data["random_phase"]["statistics"]["rms_slope"]


def picture(data: dict[str, Any]) -> Figure:
    """Draw the map, the densities and the distribution of heights."""
    figure, (left, middle, right) = common.subplots(3, width_ratios=(1, 1.3, 0.9))
    left.grid(False)
    image = left.imshow(data["map"] * 1e6, origin="lower", cmap="cividis",
                        extent=(0, SIDE * 1e3, 0, SIDE * 1e3))
    left.set(title="filtered noise, roll-off at 2 mm", xlabel="x, mm", ylabel="y, mm")
    figure.colorbar(image, label="height, µm", shrink=0.85)

    noise, phase, bare = data["filtered_noise"], data["random_phase"], data["no_rolloff"]
    middle.loglog(phase["k"], phase["psd"], color=common.COLOURS[5], lw=5, label="random phases")
    middle.loglog(noise["k"], noise["psd"], ".", ms=2.5, color=common.COLOURS[0],
                  label="filtered noise")
    middle.loglog(phase["k"], phase["law"], "k--", lw=1, label="eq. 1.6")
    middle.loglog(bare["k"], bare["psd"], color=common.COLOURS[1], lw=2.5, label="without roll-off")
    middle.loglog(bare["k"], bare["law"], "k--", lw=1)
    for wave, name in ((LONG, "$k_l$"), (ROLLOFF, "$k_r$"), (8 * SIDE / data["cells"], "$k_s$")):
        middle.axvline(2 * math.pi / wave, color="grey", lw=0.5)
        middle.text(2 * math.pi / wave, 0.02, f" {name}", transform=middle.get_xaxis_transform())
    middle.set(xlabel="wave number |k|, rad/m", ylabel="power spectral density, m⁴")
    middle.legend(fontsize="small")

    edges = np.linspace(-5, 5, 41)
    centres = (edges[1:] + edges[:-1]) / 2
    for found, colour, mark, name in ((noise, common.COLOURS[1], "s", "filtered noise"),
                                      (phase, common.COLOURS[0], "o", "random phases")):
        shown = found["heights"] > 0
        right.semilogy(centres[shown], found["heights"][shown], mark, ms=4, color=colour,
                       mfc="none", label=name)
    right.semilogy(centres, np.exp(-centres**2 / 2) / math.sqrt(2 * math.pi), "k--", lw=1,
                   label="Gauss")
    right.set(xlabel="height/rms height", ylabel="probability density", ylim=(1e-5, 1))
    right.legend(fontsize="small")
    return figure
