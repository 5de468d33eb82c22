"""From a measured road and a rubber to friction: an asphalt, three temperatures, three loads.

The study generates a road that resembles the scan of an asphalt: broken stones side by side, rolled
flat, with a fine texture. Patches are cut from it as from a measured map, and `friction_curve`
computes friction and contact area of the model compound, beside Persson's theory for the same
patches. Finally, shorter and shorter waves of the same patches are kept.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import common
import numpy as np
from common import COLOURS, MARKERS, compound, subplots

import asperity
from asperity import theory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MINUTES = 4

STONE = 1.5e-3                            # mean distance of the stones, m
STEEPNESS = 0.45                          # height of a stone over half its width
TEXTURE = (0.8, 4e-4, 0.25)               # Hurst exponent, longest wave (m), rms slope
WLF = (4.57, 113.6)                       # temperature of the compound, C
PRESSURES = (0.1e6, 0.2e6, 0.4e6)         # Pa
TEMPERATURES = (0.0, 25.0, 60.0)          # C
SPEEDS = np.geomspace(1e-4, 10.0, 11)     # m/s
GAMMA = 0.45                              # Yang and Persson's factor as the thesis takes it
COEFFICIENT = 0.3                         # of Coulomb's law in the interface


def asphalt(cells: int, side: float, seed: int = 1) -> np.ndarray:
    """Return the heights (m) of a periodic square road: the upper envelope of broken stones.

    The stones are paraboloids of random place, width, direction and height. The roller has pressed
    in the highest ones: only a tenth of the height above the bearing plane remains. The texture of
    the broken faces is a self-affine map; polished tops keep half of it.
    """
    random = np.random.default_rng(seed)
    count = int(np.ceil(side / STONE)) ** 2
    step = side / cells
    # Farther away than twice the mean distance, a stone is nowhere the highest.
    near = np.arange(-round(2 * STONE / step), round(2 * STONE / step) + 1)
    height = np.full((cells, cells), -np.inf)
    for x, y, turn, width, shape, top in zip(
            *(side * random.random((2, count))), np.pi * random.random(count),
            STONE * random.uniform(0.7, 1.3, count), random.uniform(0.7, 1.4, count),
            0.08 * STONE * random.standard_normal(count), strict=True):
        column, row = round(x / step) + near, round(y / step) + near
        dx, dy = column * step - x, (row * step - y)[:, None]
        along = (np.cos(turn) * dx + np.sin(turn) * dy) / (width * np.sqrt(shape))
        across = (np.cos(turn) * dy - np.sin(turn) * dx) * np.sqrt(shape) / width
        here = np.ix_(row % cells, column % cells)
        height[here] = np.maximum(height[here],
                                  top - STEEPNESS * width * (along**2 + across**2))
    plane = np.quantile(height, 0.7)
    worn = height > plane
    height[worn] = plane + 0.1 * (height[worn] - plane)
    hurst, longest, slope = TEXTURE
    fine = asperity.surface.self_affine(
        cells, cells, side, side, hurst=hurst, wavelength_long=longest,
        wavelength_short=4 * side / cells, rms_slope=slope, seed=seed)
    return height + np.where(worn, 0.5, 1.0) * fine


def _curve(road: Path, folder: Path, **settings: Any) -> Any:
    """Return the data set of the model compound on patches of the road."""
    options = dict(speeds=SPEEDS, pressures=PRESSURES[1:2], temperatures=TEMPERATURES[1:2],
                   cells=192, patches=4, angle=31.7, wlf=WLF, reference=25.0)
    return asperity.friction_curve(str(road), compound(), folder=folder, jobs=common.jobs,
                                   quiet=True, **options | settings)


def _tops(height: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the spectrum of the upper part of the road alone: Persson's top spectrum.

    Heights below the bearing plane are replaced by the plane, and the density is divided by the
    share of the area above it.
    """
    plane = np.quantile(height, 0.7)
    share = float((height > plane).mean())
    wave, psd = theory.surface_psd(np.maximum(height, plane), side)
    return wave, psd / share


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Generate the road, and compute the curves."""
    cells, side = (256, 10.24e-3) if quick else (2048, 20.48e-3)
    height = asphalt(cells, side)
    coarse = height.reshape(cells // 2, 2, cells // 2, 2).mean(axis=(1, 3))
    maps = [folder / "asphalt_fine.h5", folder / "asphalt.h5"]
    for path, one in zip(maps, (height, coarse), strict=True):
        asperity.surface.save(path, one, side, side)
    few = dict(cells=48, patches=2, speeds=SPEEDS[::5]) if quick else {}
    curves = _curve(maps[1], folder / "runs", pressures=PRESSURES, temperatures=TEMPERATURES, **few)
    rubbing = _curve(maps[1], folder / "runs", coefficient=COEFFICIENT, **few)
    found = {name: curves[name].values for name in (
        "friction_mean", "friction_low", "friction_high", "contact_area_mean", "friction_persson",
        "area_persson", "a_t")}
    found |= {"speed": curves["speed"].values, "height": coarse[::4, ::4],
              "side": 1e3 * side, "statistics": asperity.surface.statistics(coarse, side)._asdict(),
              "notes": curves.attrs.get("notes", ""),
              "rubbing": rubbing["friction_mean"].values[0, 0],
              "rubbing_viscous": rubbing["friction_viscous_mean"].values[0, 0]}
    found |= _sections(found)
    tops = _tops(coarse, side)
    found["tops"] = [theory.persson(*tops, compound(), p, found["speed"], gamma=GAMMA).friction
                     for p in PRESSURES]

    size, step = (96, side / cells) if quick else (384, side / cells)
    short = [6.0 * step * 2**k for k in range(3 if quick else 5)][::-1]
    fine = [_curve(maps[0], folder / "waves", cells=size, patches=1, short=wave,
                   speeds=SPEEDS[::5] if quick else SPEEDS[1::2]) for wave in short]
    found |= {"short": short, "fine_speed": fine[0]["speed"].values,
              "fine": [one["friction_mean"].values[0, 0] for one in fine],
              "fine_area": [one["contact_area_mean"].values[0, 0] for one in fine],
              "fine_persson": [one["friction_persson"].values[0, 0] for one in fine]}
    return found


def _sections(found: dict[str, Any]) -> dict[str, Any]:
    """Return the curves at the middle temperature and at the middle load."""
    friction, expected = found["friction_mean"], found["friction_persson"]
    half = 0.5 * (found["friction_high"] - found["friction_low"])
    return {"by_load": friction[:, 1], "by_load_half_interval": half[:, 1],
            "by_load_persson": expected[:, 1], "by_load_ratio": friction[:, 1] / expected[:, 1],
            "by_load_area": found["contact_area_mean"][:, 1],
            "by_load_area_persson": found["area_persson"][:, 1],
            "join_percent": [float(one)
                             for one in re.findall(r"([\d.]+) % of the", found["notes"])],
            "by_temperature": friction[1], "by_temperature_persson": expected[1]}


def check(data: dict[str, Any], quick: bool) -> None:
    """Check the curves against the claims of the README."""
    friction, theory_ = data["friction_mean"], data["friction_persson"]
    area = data["contact_area_mean"]
    assert np.isfinite(friction).all(), "some point did not converge"
    assert (np.diff(area, axis=2) < 0).all(), "the area does not fall with speed"
    assert (np.diff(area, axis=0) > 0).all(), "the area does not grow with the load"
    rubbing = data["rubbing"] - data["rubbing_viscous"]
    np.testing.assert_allclose(rubbing, COEFFICIENT, rtol=0.05)
    if quick:
        return
    # A change of temperature is equivalent to a change of speed: the friction at 0 or 60 C and the
    # speed v is that at 25 C and a_T v.
    for j in (0, 2):
        shifted = np.interp(np.log(data["a_t"][j] * data["speed"]), np.log(data["speed"]),
                            friction[1, 1], left=np.nan, right=np.nan)
        inner = np.isfinite(shifted)
        assert np.abs(friction[1, j, inner] / shifted[inner] - 1).max() < 0.15, "no master curve"
    ratio = friction / theory_
    assert ratio.min() > 0.2 and ratio.max() < 1.0, f"runs over theory: {ratio}"
    assert (ratio[:, :, -1] < 0.75).all(), "at high speed the theory is not far above"
    fine, expected = np.array(data["fine"]), np.array(data["fine_persson"])
    # The first octave below the size of the stones may reduce the friction a little, because it
    # divides the contact.
    assert (np.diff(fine[1:], axis=0) > 0).all(), "a shorter wave reduces friction"
    assert (np.diff(expected, axis=0) > 0).all()
    assert (np.diff(data["fine_area"], axis=0)[2:] < 0).all(), "a shorter wave adds area"


def picture(data: dict[str, Any]) -> Figure:
    """Draw the road, the curves beside the theory, and the effect of shorter waves."""
    figure, axes = subplots(2, 2, width=5.6, height=4.0)
    road, loads, warmth, waves = axes.flat
    image = road.imshow(1e3 * data["height"], extent=(0, data["side"], 0, data["side"]),
                        cmap="cividis")
    figure.colorbar(image, ax=road, label="height, mm")
    road.set(title="the road", xlabel="x, mm", ylabel="y, mm")
    road.grid(visible=False)
    speed = data["speed"]
    for i, pressure in enumerate(PRESSURES):
        _band(loads, data, (i, 1), f"{1e-6 * pressure:g} MPa", i)
        loads.semilogx(speed, data["friction_persson"][i, 1], "--", color=COLOURS[i])
        loads.semilogx(speed, data["tops"][i], ":", color=COLOURS[i])
    loads.set(title="25 °C; dashed: Persson, dotted: of the tops")
    for j, celsius in enumerate(TEMPERATURES):
        _band(warmth, data, (1, j), f"{celsius:g} °C", j)
        warmth.semilogx(speed, data["friction_persson"][1, j], "--", color=COLOURS[j])
    warmth.set(title="0.2 MPa; dashed: Persson")
    for k, v in enumerate(data["fine_speed"]):
        for name, style in (("fine", "-"), ("fine_persson", "--")):
            waves.semilogx(1e3 * np.array(data["short"]), [one[k] for one in data[name]], style,
                           marker=MARKERS[k] if name == "fine" else None, color=COLOURS[k],
                           label=f"{v:.3g} m/s" if name == "fine" else None)
    waves.set(title="shorter waves, 25 °C, 0.2 MPa; dashed: Persson", xlabel="shortest wave, mm",
              ylabel="friction coefficient", ylim=(0, None))
    waves.invert_xaxis()
    for panel in (loads, warmth):
        panel.set(xlabel="speed, m/s", ylabel="friction coefficient", ylim=(0, None))
    for panel in (loads, warmth, waves):
        panel.legend()
    return figure


def _band(panel: Any, data: dict[str, Any], at: tuple[int, int], label: str, colour: int) -> None:
    """Draw a curve with its 95 % interval."""
    low, high = data["friction_low"][at], data["friction_high"][at]
    panel.semilogx(data["speed"], data["friction_mean"][at], MARKERS[colour] + "-", ms=4,
                   color=COLOURS[colour], label=label)
    panel.fill_between(data["speed"], low, high, color=COLOURS[colour], alpha=0.15)
