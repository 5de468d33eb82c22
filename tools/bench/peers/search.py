"""What the comparisons share: the case, its error, and the choice of the tolerance.

Each code stops by a measure of its own. All are compared at the same duality gap: the tolerance of
each is changed until its solution has a gap between 0.5e-6 and 1e-6, if that can be reached.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

WANTED = 1e-6

Answer = tuple[np.ndarray, float, int | None]
"""Pressure in Pa [n, n], processor time in s, transforms (None if they cannot be counted)."""


def symbol(n: int) -> np.ndarray:
    """Return displacement over pressure in m/Pa [n, n//2 + 1] for E* = 1 Pa and L = 1 m."""
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n)[None, :])
    q[0, 0] = np.inf
    return 2 / q


def duality_gap(height: np.ndarray, pressure: np.ndarray) -> float:
    """Return e1 = sum P (g - min g)/(sum P h_rms) in double precision, by NumPy's transforms."""
    shift = np.fft.irfft2(np.fft.rfft2(pressure) * symbol(len(height)), s=height.shape)
    gap = shift - height
    return float((pressure * (gap - gap.min())).sum() / (pressure.sum() * height.std()))


def search(solve: Callable[[np.ndarray, float, float], Answer], tolerance: float) -> None:
    """Solve the case of the command line, write the best pressure and print its figures.

    The command line gives the mean pressure in Pa and a folder with the file `height`, n x n
    doubles in m. The best answer is the fastest one that is accurate enough.

    Parameters
    ----------
    solve
        Gets the height in m, the mean pressure in Pa and a tolerance.
    tolerance
        The first tolerance that is tried.
    """
    load, folder = float(sys.argv[1]), Path(sys.argv[2])
    height = np.fromfile(folder / "height")
    height = height.reshape(2 * (round(len(height) ** 0.5),))
    best = None
    for _ in range(8):
        pressure, seconds, transforms = solve(height, load, tolerance)
        error = duality_gap(height, pressure)
        if error <= WANTED and (best is None or seconds < best["seconds"]):
            best = {"seconds": seconds, "e1": error, "transforms": transforms}
            pressure.tofile(folder / "other")
        if 0.5 * WANTED <= error <= WANTED:
            break
        tolerance *= min(max(0.75 * WANTED / error, 0.05), 20.0) ** 0.8
    print(json.dumps(best))
