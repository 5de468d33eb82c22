"""Solve a rough contact with slippy: Polonsky and Keer's method on FFTW."""

from __future__ import annotations

import time

import numpy as np
import slippy

slippy.CORES = 1
slippy.CUDA = False

from search import Answer, search, symbol  # noqa: E402
from slippy.core.influence_matrix_utils import plan_convolve, polonsky_and_keer  # noqa: E402


def solve(height: np.ndarray, load: float, tolerance: float) -> Answer:
    """Solve once, on one thread; the plans of the transforms are made before."""
    n = len(height)
    start_pressure = np.ones((n, n))
    # slippy takes a whole spectrum, of which it reads half of the columns.
    half = symbol(n)
    spectrum = np.concatenate([half, half[:, -2:0:-1]], axis=1)
    operator = plan_convolve(start_pressure, spectrum, None, circular=True, fft_im=True)
    transforms = 0

    def displacement(pressure: np.ndarray) -> np.ndarray:
        nonlocal transforms
        transforms += 2
        return operator(pressure)

    start = time.process_time()
    failed, pressure, _ = polonsky_and_keer(
        displacement, start_pressure, height.max() - height, load, 1 / n, eps_0=tolerance
    )
    seconds = time.process_time() - start
    if failed:
        raise RuntimeError("slippy did not converge")
    return pressure, seconds, transforms


search(solve, 1e-6)
