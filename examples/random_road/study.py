"""Random road: a rough road beside the wavy one with the same long wave (thesis, figure 4.14)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import common
import numpy as np
import two_scale as road
from matplotlib.figure import Figure

import asperity

#: Minutes of the full form on two cores.
MINUTES = 3.0
HURST = 0.8


def first_octave(height: np.ndarray) -> float:
    """Return the rms height, m, of the waves between the longest one of the road and half of it."""
    ny, nx = height.shape
    kx = np.fft.fftfreq(nx, 1.0 / nx)
    ky = np.fft.fftfreq(ny, 1.0 / ny) * np.sqrt(3.0)
    order = np.hypot(kx, ky[:, None])
    waves = np.fft.fft2(height) / height.size
    return float(np.sqrt((np.abs(waves[(order > 0.5) & (order < 2.01)]) ** 2).sum()))


def rough(cells: int, short: float, seed: int) -> tuple[str, float]:
    """Return the &surface group of a self-affine road, and the mean square of its slope.

    The first octave of the road is as high as the long wave of the wavy road.
    """
    # Each of the three waves of the product of sines has a quarter of its amplitude.
    wanted = road.STEEPNESS * road.LONG / 4.0 * np.sqrt(3.0 / 2.0)
    rows = 2 * round(cells / np.sqrt(12.0))
    height = asperity.surface.self_affine(
        cells, rows, lx=road.LONG, ly=road.LONG / np.sqrt(3.0), hurst=HURST,
        wavelength_long=road.LONG, wavelength_short=short, rms_height=1e-6, seed=seed)
    factor = wanted / first_octave(height)
    slope = asperity.surface.statistics(height, road.LONG, road.LONG / np.sqrt(3.0)).rms_slope
    return (f"&surface shape = 'self_affine', hurst = {HURST}, wavelength_long = {road.LONG!r},"
            f" wavelength_short = {short!r}, seed = {seed},"
            f" rms_height = {float(1e-6 * factor)!r} /"), float((slope * factor) ** 2)


def compute(folder: Path, quick: bool) -> dict[str, Any]:
    """Run both roads at the default, at several speeds and at several loads."""
    cells, short = (road.QUICK if quick else road.FULL), road.WIDER
    speeds = [30.0] if quick else [0.1, 10.0, 30.0, 100.0]
    loads = [] if quick else [4e3, 40e3, 0.8e6]
    data: dict[str, Any] = {"speeds": np.array(sorted([road.SPEED, *speeds])),
                            "loads": np.array(sorted([road.PRESSURE, *loads]))}
    random, data["squares"] = rough(cells, short, 1)
    for name, surface in (("wavy", road.waves(short)), ("random", random)):
        points = [(road.SPEED, road.PRESSURE), *((speed, road.PRESSURE) for speed in speeds),
                  *((road.SPEED, load) for load in loads)]
        cases = [road.case(
            cells, surface, speed=speed, pressure=load, shear_steps=15 if quick else 30,
            distance=(0.8 if quick else 1.25 if speed < 5.0 else 2.0) * road.LONG)
            for speed, load in points]
        # As in the thesis, the longest wave of the road is as long as the cell.
        done = road.histories(folder / name, cases, common.LONG_WAVES)
        found = {point: road.measures(case) for point, case in zip(points, done, strict=True)}
        data[f"{name}_curve"] = {key: done[0][key] for key in ("road_x", "slid", "friction")}
        for key in ("maximum", "plateau", "area", "slid_to_maximum", "viscous"):
            data[f"{name}_{key}"] = found[road.SPEED, road.PRESSURE][key]
            data[f"{name}_{key}_speed"] = np.array(
                [found[v, road.PRESSURE][key] for v in data["speeds"]])
            data[f"{name}_{key}_load"] = np.array(
                [found[road.SPEED, p][key] for p in data["loads"]])
    return data


def roughness(curve: dict[str, np.ndarray]) -> float:
    """Return the rms of the fast part of the friction in sliding: variations within 80 um."""
    late = curve["slid"] > 0.25 * curve["slid"][-1]
    x = np.linspace(curve["slid"][late][0], curve["slid"][-1], 512)
    y = np.interp(x, curve["slid"][late], curve["friction"][late])
    width = max(3, round(80e-6 / (x[1] - x[0])))
    smooth = np.convolve(y, np.ones(width) / width, mode="valid")
    inner = y[width // 2:width // 2 + smooth.size]
    return float(np.std(inner - smooth))


def check(data: dict[str, Any], quick: bool) -> None:
    """Check that the friction of the rough road is lower and smoother, with the same trends."""
    assert data["random_plateau"] < data["wavy_plateau"]
    assert data["random_maximum"] < data["wavy_maximum"]
    assert roughness(data["random_curve"]) < 0.7 * roughness(data["wavy_curve"])
    # After twice the viscous part has been subtracted, the effect of the slopes is of the order of
    # their mean square: see check_slope.
    for case in ("", "_speed", "_load"):
        road.check_slope({name: data[f"wavy_{name}{case}"] for name in ("plateau", "viscous")})
        rest = np.asarray(data[f"random_plateau{case}"]) - 1 - 2 * np.asarray(
            data[f"random_viscous{case}"])
        assert (rest > 0).all() and (rest < 2 * data["squares"]).all(), f"slopes leave {rest}"
    for name in ("wavy", "random"):
        assert data[f"{name}_plateau"] > 1.005
        assert data[f"{name}_maximum"] - data[f"{name}_plateau"] > 2e-3
        assert (np.diff(data[f"{name}_maximum_speed"]) > 0.0).all()
        slow = data["speeds"] <= 30.0
        assert (np.diff(data[f"{name}_plateau_speed"][slow]) > 0.0).all()
        if not quick:
            top = int(data[f"{name}_plateau_load"].argmax())
            assert 0 < top < len(data["loads"]) - 1


def picture(data: dict[str, Any]) -> Figure:
    """Draw the friction of both roads over the travel, the speed and the load."""
    figure = Figure(figsize=(13.0, 4.4), layout="constrained")
    curves, speed, load = figure.subplots(1, 3)
    for name, colour in (("wavy", road.BLUE), ("random", road.RED)):
        curve = data[f"{name}_curve"]
        driven = curve["road_x"] > 0.0
        curves.plot(1e6 * curve["road_x"][driven], curve["friction"][driven], color=colour,
                    label=name)
        for axes, key, x in ((speed, "speed", data["speeds"]), (load, "load", data["loads"] / 1e6)):
            axes.semilogx(x, data[f"{name}_maximum_{key}"], "s--", color=colour,
                          label=f"{name}, maximum")
            axes.semilogx(x, data[f"{name}_plateau_{key}"], "o-", color=colour,
                          label=f"{name}, plateau")
    curves.set(xlabel="travel of the drive (µm)", ylabel="friction coefficient",
               xlim=(220.0, None), ylim=(0.97, None),
               title="1 m/s, 0.4 MPa")
    speed.set(xlabel="speed of the drive (m/s)", title="0.4 MPa")
    load.set(xlabel="mean pressure (MPa)", title="1 m/s")
    for axes in (curves, speed, load):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    return figure
