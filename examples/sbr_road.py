"""What the studies of the model compound on a self-affine road share."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

import asperity
from asperity import theory
from asperity.material import WLF, Prony

#: Constants of the time-temperature shift of the compound, see materials/README.md.
WLF_SBR = WLF(4.57, 113.6, 25.0)


def compound() -> Prony:
    """Return the model compound of examples/materials at 25 C."""
    g, tau = np.loadtxt(Path(__file__).parent / "materials" / "sbr.txt", unpack=True)
    return Prony(g[0], g[1:], tau[1:])


def active(rubber: Prony, slowest: float, fastest: float) -> Prony:
    """Return the material without the arms that do nothing between two times (s).

    Arms 1e4 times slower than `slowest` join the spring, which a run that starts unrelaxed
    cannot tell from them; arms 1e6 times faster than `fastest` are left out.
    """
    slow = rubber.tau > 1e4 * slowest
    kept = ~slow & (rubber.tau > 1e-6 * fastest)
    return Prony(rubber.g_inf + float(rubber.g[slow].sum()), rubber.g[kept], rubber.tau[kept])


class Road:
    """A self-affine road of `cells` x `cells`, periodic, with the spectrum of eq. 1.6."""

    def __init__(self, cells: int, side: float, hurst: float, waves: tuple[float, float],
                 rms_slope: float) -> None:
        self.cells, self.side, self.hurst, self.rms_slope = cells, side, hurst, rms_slope
        #: Longest and shortest wavelength, m: the side over `waves`.
        self.long, self.short = side / waves[0], side / waves[1]

    @property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Knots of the PSD that the maps are made of."""
        return theory.self_affine_psd(self.hurst, self.long, self.long, self.short,
                                      rms_slope=self.rms_slope)

    def map(self, seed: int) -> np.ndarray:
        """Return the height of a map, m."""
        return asperity.surface.self_affine(
            self.cells, lx=self.side, hurst=self.hurst, wavelength_long=self.long,
            wavelength_short=self.short, rms_slope=self.rms_slope, seed=seed)

    def case(self, material: Prony, phases: str, seed: int) -> str:
        """Return the namelists of a case."""
        return f"""&grid nx = {self.cells}, ny = {self.cells}, lx = {self.side!r} /
&surface shape = 'self_affine', hurst = {self.hurst!r}, wavelength_long = {self.long!r},
  wavelength_short = {self.short!r}, rms_slope = {self.rms_slope!r}, seed = {seed} /
{material.to_namelist()}
{phases}
&solver tolerance = 1e-5, threads = 1 /
&output snapshot_every = 0 /
"""


def run(folder: Path, name: str, text: str) -> asperity.Run:
    """Run a case in `folder` and return the result."""
    case = folder / f"{name}.nml"
    case.write_text(text)
    with warnings.catch_warnings():
        # at rest the steps grow with the time that has passed, arm after arm falls still
        warnings.filterwarnings("ignore", ".*longer than the shortest active relaxation time")
        return asperity.run(case, output=folder / f"{name}.h5")
