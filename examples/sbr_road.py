"""Parts that the studies of the model compound on a self-affine road share."""

from __future__ import annotations

from typing import Any

import common
import numpy as np

import asperity
from asperity import theory
from asperity.material import WLF

#: Constants of the time-temperature shift of the compound, see materials/README.md.
WLF_SBR = WLF(4.57, 113.6, 25.0)


class Road:
    """A periodic self-affine road of `cells` x `cells` with the spectrum of eq. 1.6."""

    def __init__(self, cells: int, side: float, hurst: float, waves: tuple[float, float],
                 rms_slope: float) -> None:
        self.cells, self.side, self.hurst, self.rms_slope = cells, side, hurst, rms_slope
        #: Longest and shortest wavelength, m: the side over `waves`.
        self.long, self.short = side / waves[0], side / waves[1]

    @property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the points between which the PSD of the maps is interpolated."""
        return theory.self_affine_psd(self.hurst, self.long, self.long, self.short,
                                      rms_slope=self.rms_slope)

    def map(self, seed: int) -> np.ndarray:
        """Return the height of a map, m."""
        return asperity.surface.self_affine(
            self.cells, lx=self.side, hurst=self.hurst, wavelength_long=self.long,
            wavelength_short=self.short, rms_slope=self.rms_slope, seed=seed)

    def case(self, *phases: dict[str, Any], tolerance: float = 1e-5) -> asperity.Case:
        """Return a case of the compound on the map of seed 1."""
        return asperity.Case(
            grid=dict(nx=self.cells, ny=self.cells, lx=self.side),
            surface=dict(shape="self_affine", hurst=self.hurst, wavelength_long=self.long,
                         wavelength_short=self.short, rms_slope=self.rms_slope, seed=1),
            material=common.material_group(), phase=list(phases),
            solver=dict(tolerance=tolerance, threads=1), output=dict(snapshot_every=0))


def sweep(case: asperity.Case, parameters: dict[Any, Any], folder: Any,
          *said: str) -> asperity.Sweep:
    """Run a case with other values. Results that exist already are kept.

    `said` are warnings that are expected in addition to the one on long steps.
    """
    # At rest the steps grow with the elapsed time, so that they exceed the relaxation time of one
    # arm after the other. These arms are then relaxed.
    with common.expected(common.LONG_STEPS, *said):
        return asperity.sweep(case, parameters, folder=folder, jobs=common.jobs, quiet=True)
