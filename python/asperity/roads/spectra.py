"""Power spectral densities of roads: measured, joined and cut; random maps are drawn from them.

The density Phi is that of `asperity.surface.psd` (m4): mean(h^2) = int Phi k dk/(2 pi). Persson's
C(q) is Phi/(4 pi^2). Between its knots a spectrum is a power law, a straight line in log-log.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..base.check import array_of, positive
from ..base.names import counted
from .map_work import fit_terms, polynomial
from .mode_cells import mean_densities
from .profile_fit import isotropic_fit
from .windows import map_window

__all__ = ["Spectrum", "isotropic_of_profile", "join_spectra", "name_of_several",
           "spectrum_of_map"]

FloatArray = NDArray[np.float64]

_PER_DECADE = 20        # bands of a measured spectrum per decade
_WAVES_IN_MAP = 3.0     # periods within the map of the longest wave that a scan measures reliably
_CELLS_IN_WAVE = 6.0    # cells within the shortest such wave
_LONGEST_NAME = 120     # characters of the name of several roads
_NO_WAVES = 1e-3        # share of the mean square height of long waves that count as none
_ROUND_OFF = 1e-16      # share of the largest density times k^2 below which a density is round-off


@dataclass(frozen=True)
class Spectrum:
    """An isotropic power spectral density, given at its knots.

    Attributes
    ----------
    wavenumber : ndarray, shape (n,)
        Wave numbers of the knots, rad/m, ascending.
    psd : ndarray, shape (n,)
        Densities at the knots, m4, > 0.
    name : str
        Origin of the spectrum.
    notes : list of str
        Notes for the user.

    Raises
    ------
    ValueError
        If the arrays do not have the same length of at least 2, or contain values that are not
        allowed.
    """

    wavenumber: FloatArray
    psd: FloatArray
    name: str = "spectrum"
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        k = array_of("wavenumber", self.wavenumber, low=0.0, low_open=True, ndim=1, increasing=True)
        psd = array_of("psd", self.psd, low=0.0, low_open=True, ndim=1)
        if k.size < 2 or psd.size != k.size:
            raise ValueError(f"wavenumber, psd: have {k.size} and {psd.size} values: must have the"
                             " same number, at least 2")
        object.__setattr__(self, "wavenumber", k)
        object.__setattr__(self, "psd", psd)

    @property
    def band(self) -> tuple[float, float]:
        """Longest and shortest wavelength, m."""
        return 2.0 * math.pi / self.wavenumber[0], 2.0 * math.pi / self.wavenumber[-1]

    def at(self, wavenumber: FloatArray) -> FloatArray:
        """Return the density at wave numbers.

        Parameters
        ----------
        wavenumber : ndarray
            Wave numbers, rad/m, any shape.

        Returns
        -------
        ndarray
            Density, m4, shape of `wavenumber`; it is zero outside the band.
        """
        wavenumber = np.asarray(wavenumber, dtype=float)
        inside = (wavenumber >= self.wavenumber[0] * (1 - 1e-12)) & (
            wavenumber <= self.wavenumber[-1] * (1 + 1e-12))
        logs = np.interp(np.log(np.where(inside, wavenumber, self.wavenumber[0])),
                         np.log(self.wavenumber), np.log(self.psd))
        return np.where(inside, np.exp(logs), 0.0)

    def cut(self, long: float | None = None, short: float | None = None) -> Spectrum:
        """Return the part between two wavelengths, m.

        Parameters
        ----------
        long, short : float, optional
            Longest and shortest wavelength, m; by default those of the spectrum.

        Returns
        -------
        Spectrum

        Raises
        ------
        ValueError
            If no part of the spectrum is between them.
        """
        low = self.wavenumber[0] if long is None else max(
            self.wavenumber[0], 2.0 * math.pi / positive("long", long))
        high = self.wavenumber[-1] if short is None else min(
            self.wavenumber[-1], 2.0 * math.pi / positive("short", short))
        if not low < high:
            wanted = [] if long is None else [f"at most {long:.3g} m"]
            wanted += [] if short is None else [f"at least {short:.3g} m"]
            raise ValueError(f"{self.name}: has waves of {self.band[0]:.3g} to {self.band[1]:.3g}"
                             f" m, and none of those that are wanted, {' and '.join(wanted)}")
        inner = (self.wavenumber > low * (1 + 1e-12)) & (self.wavenumber < high * (1 - 1e-12))
        k = np.concatenate([[low], self.wavenumber[inner], [high]])
        return Spectrum(k, self.at(k), self.name, list(self.notes))

    def extended(self, short: float) -> Spectrum:
        """Return the spectrum extrapolated to a shorter wavelength, as in its last decade.

        Parameters
        ----------
        short : float
            New shortest wavelength, m.

        Returns
        -------
        Spectrum

        Examples
        --------
        >>> line = Spectrum(np.array([1e2, 1e4]), np.array([1e-10, 1e-16]))
        >>> round(float(np.log10(line.extended(2e-5 * math.pi).psd[-1])), 9)
        -19.0
        """
        k, psd = self.wavenumber, self.psd
        end = 2.0 * math.pi / positive("short", short)
        if end <= k[-1]:
            return self
        last = k >= 0.1 * k[-1] if np.count_nonzero(k >= 0.1 * k[-1]) > 1 else slice(-2, None)
        slope = float(np.polyfit(np.log(k[last]), np.log(psd[last]), 1)[0])
        return Spectrum(np.append(k, end), np.append(psd, psd[-1] * (end / k[-1]) ** slope),
                        self.name, list(self.notes))

    def scaled(self, factor: float) -> Spectrum:
        """Return the spectrum of the same road with all heights multiplied by a factor.

        Parameters
        ----------
        factor : float
            Factor of the heights; the density is multiplied by its square.

        Returns
        -------
        Spectrum
        """
        return Spectrum(self.wavenumber, self.psd * factor**2, self.name, list(self.notes))

    def draw(self, nx: int, ny: int, lx: float, ly: float, seed: int | Sequence[int]
             ) -> FloatArray:
        """Return a periodic map with random phases and the amplitudes of the spectrum.

        The amplitude of a mode follows from the mean density over its cell of the wave-vector
        plane, so that rms height and slope are those of the spectrum: within 1 % on sides of two
        longest waves and more, and within about 3 % on a side of one longest wave.

        Parameters
        ----------
        nx, ny : int
            Number of cells.
        lx, ly : float
            Lengths, m.
        seed : int or sequence of int
            Seed of the random phases. The same seed gives the same bits.

        Returns
        -------
        ndarray, shape (ny, nx)
            Heights, m.
        """
        kx = 2.0 * math.pi * np.fft.rfftfreq(nx, lx / nx)
        ky = 2.0 * math.pi * np.fft.fftfreq(ny, ly / ny)
        edges = float(self.wavenumber[0]), float(self.wavenumber[-1])
        amplitude = np.sqrt(mean_densities(self.at, edges, kx, ky) * lx * ly)
        # The phases of white noise are those of a real map; its amplitudes are replaced.
        noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((ny, nx)))
        size = np.abs(noise)
        phases = np.where(size > 0.0, noise / np.where(size > 0.0, size, 1.0), 1.0)
        density = nx * ny / (lx * ly)
        return np.fft.irfft2(amplitude * phases * density, s=(ny, nx))


def spectrum_of_map(height: FloatArray, lx: float, ly: float, *, periodic: bool = False,
                    name: str = "map") -> Spectrum:
    """Return the spectrum of a measured map, for the wavelengths that it measures reliably.

    These are from a third of the shorter length down to six cells. A map that is not periodic is
    first levelled and weighted by Hann's window. For a profile the spectrum of its isotropic road
    is fitted (`asperity.roads.profile_fit`).

    Parameters
    ----------
    height : ndarray, shape (ny, nx)
        Heights, m. A map with ny = 1 counts as a profile of an isotropic road.
    lx, ly : float
        Lengths, m.
    periodic : bool
        Whether opposite edges match.
    name : str
        Name of the spectrum.

    Returns
    -------
    Spectrum

    Raises
    ------
    ValueError
        If the map is flat, is too small, or has roughness of a single wavelength in this range.
    """
    ny, nx = height.shape
    weights = np.ones_like(height)
    if not periodic:
        height = height - height.mean() if ny == 1 else _levelled(height)
        weights = map_window(height.shape)
    modes = np.fft.rfft2((height - np.average(height, weights=weights)) * weights)
    power = np.abs(modes)**2 / (nx * ny * float(np.sum(weights**2)))
    kx = 2.0 * math.pi * np.fft.rfftfreq(nx, lx / nx)
    if ny == 1:
        # The density Phi1 of the profile satisfies mean(h^2) = int Phi1 dk/pi over k > 0.
        density = power[0] * lx
        low, high = _reliable(density[1:], lx, lx / nx, name)
        slope = density * kx**2
        inside = (kx >= low * (1 - 1e-12)) & (kx <= high * (1 + 1e-12))
        least = _ROUND_OFF * slope.max()
        rough = np.flatnonzero(inside & (slope > least))
        if rough.size < 2:
            raise _too_few(int(np.count_nonzero(inside)), lx, lx / nx, name)
        # Smooth modes after the first rough one count, too: the road has nothing there.
        kept = slice(rough[0], np.flatnonzero(inside)[-1] + 1)
        k = kx[kept]
        road, psd = isotropic_fit(k, np.maximum(density[kept], least / k**2), not periodic)
        notes = [] if road[-1] > 0.99 * k[-1] else [
            f"{name}: has no waves shorter than {2.0 * math.pi / road[-1]:.3g} m, although those"
            f" down to {2.0 * math.pi / k[-1]:.3g} m were measured"]
        return _without_empty_start(Spectrum(road, psd, name, notes))
    ky = 2.0 * math.pi * np.fft.fftfreq(ny, ly / ny)
    k = np.hypot(kx, ky[:, None]).ravel()[1:]
    k, psd = _banded(k, (power * lx * ly).ravel()[1:], min(lx, ly), max(lx / nx, ly / ny), name)
    return _without_empty_start(Spectrum(k, psd, name))


def _without_empty_start(spectrum: Spectrum) -> Spectrum:
    """Return a spectrum without its longest waves if they have nearly none of its height.

    A scan measures waves up to a third of its length, also where the road has none of them. The
    maps that are drawn would otherwise be far larger than its waves.
    """
    k = np.geomspace(spectrum.wavenumber[0], spectrum.wavenumber[-1], 2000)
    below = np.concatenate([[0.0], np.cumsum(np.diff(k) * (spectrum.at(k) * k)[1:])])
    first = int(np.searchsorted(below, _NO_WAVES * below[-1])) - 1
    return spectrum if first < 1 else spectrum.cut(long=2.0 * math.pi / k[first])


def isotropic_of_profile(wavenumber: FloatArray, psd: FloatArray, *, name: str = "profile"
                         ) -> Spectrum:
    """Return the spectrum of the isotropic road whose profiles have a given spectrum.

    This is Abel's transform, Phi(k) = -2 int_k^inf Phi1'(y)/sqrt(y^2 - k^2) dy. The density Phi1 of
    the profile is a power law between the knots, and the last one continues beyond the last knot.

    Parameters
    ----------
    wavenumber : ndarray, shape (n,)
        Wave numbers, rad/m, ascending.
    psd : ndarray, shape (n,)
        Density of the profile, m3: mean(h^2) = int Phi1 dk/pi.
    name : str
        Name of the spectrum.

    Returns
    -------
    Spectrum
    """
    k = array_of("wavenumber", wavenumber, low=0.0, low_open=True, ndim=1, increasing=True)
    level = np.log(array_of("psd", psd, low=0.0, low_open=True, ndim=1))
    logs = np.log(k)
    slopes = np.diff(level) / np.diff(logs)
    tail = min(float(np.polyfit(logs[-6:], level[-6:], 1)[0]), -1.0)
    # With y = k cosh(t) the root cancels, and the integrand falls like exp(tail t).
    t = np.linspace(0.0, 40.0 / abs(tail), 4001)
    found = np.empty(k.size)
    for i, one in enumerate(logs):
        y = one + np.log(np.cosh(t))
        piece = np.clip(np.searchsorted(logs, y, side="right") - 1, 0, slopes.size - 1)
        beyond = y >= logs[-1]
        slope = np.where(beyond, tail, slopes[piece])
        value = np.where(beyond, level[-1] + tail * (y - logs[-1]),
                         level[piece] + slopes[piece] * (y - logs[piece]))
        found[i] = -2.0 * np.trapezoid(slope * np.exp(value - y), t)
    good = found > 0.0
    if good.sum() < 2:
        raise ValueError(f"{name}: {int(good.sum())} of {counted(k.size, 'band')} of the profile"
                         " can belong to an isotropic road: must be at least 2")
    notes = [] if good.all() else [f"{name}: {int((~good).sum())} bands of the profile have no"
                                   " isotropic counterpart and are left out"]
    return Spectrum(k[good], found[good], name, notes)


def join_spectra(spectra: Sequence[Spectrum], name: str | None = None) -> Spectrum:
    """Return one spectrum that combines several scans, each within its own band.

    Where bands overlap, the densities are averaged with weights that fade towards the ends of each
    band, so that no step remains. The mean of the logarithms would be too low, because the density
    of each scan scatters: by 44 % where each has a single mode. Gaps are filled by a power law,
    and noted.

    Parameters
    ----------
    spectra : sequence of Spectrum
        At least one spectrum.
    name : str, optional
        Name of the result.

    Returns
    -------
    Spectrum

    Raises
    ------
    ValueError
        If no spectrum is given.

    Examples
    --------
    >>> wide = Spectrum(np.array([1e2, 1e4]), np.array([1e-10, 1e-16]))
    >>> fine = Spectrum(np.array([1e3, 1e6]), np.array([1e-13, 1e-22]))
    >>> bool(np.allclose(join_spectra([wide, fine]).at(np.array([1e5])), 1e-19))
    True
    """
    if not spectra:
        raise ValueError("spectra: must have at least one")
    notes = [note for one in spectra for note in one.notes]
    if len(spectra) == 1:
        return spectra[0] if name is None else replace(spectra[0], name=name)
    low = min(one.wavenumber[0] for one in spectra)
    high = max(one.wavenumber[-1] for one in spectra)
    knots = np.unique(np.concatenate([one.wavenumber for one in spectra]))
    total, weight = np.zeros(knots.size), np.zeros(knots.size)
    for one in spectra:
        ends = np.log([one.wavenumber[0], one.wavenumber[-1]])
        inside = (knots >= one.wavenumber[0]) & (knots <= one.wavenumber[-1])
        at = np.log(knots[inside])
        share = np.minimum(at - ends[0], ends[1] - at) / (ends[1] - ends[0])
        part = np.maximum(share, 1e-6)
        total[inside] += part * one.at(knots[inside])
        weight[inside] += part
    ordered = sorted(spectra, key=lambda one: one.wavenumber[0])
    reach = ordered[0].wavenumber[-1]
    for one in ordered[1:]:
        if one.wavenumber[0] > reach:
            notes.append(f"no scan covers the waves from {2 * math.pi / reach:.3g} to"
                         f" {2 * math.pi / one.wavenumber[0]:.3g} m: the gap is filled by a"
                         " power law")
        reach = max(reach, one.wavenumber[-1])
    notes.append(f"{len(spectra)} spectra joined, waves of {2 * math.pi / low:.3g} to"
                 f" {2 * math.pi / high:.3g} m")
    # knots closer than 1e-6 are one
    apart = np.concatenate([[True], np.diff(np.log(knots)) > 1e-6])
    return Spectrum(knots[apart], (total / weight)[apart],
                    name or name_of_several(one.name for one in spectra), notes)


def name_of_several(names: Iterable[str]) -> str:
    """Return one name for several roads; the title of a case holds 256 characters."""
    different = list(dict.fromkeys(names))
    joined = " and ".join(different)
    if len(joined) <= _LONGEST_NAME:
        return joined
    return f"{different[0]:.{_LONGEST_NAME}}" + (
        f" and {len(different) - 1} others" if len(different) > 1 else "")


def _levelled(height: FloatArray) -> FloatArray:
    """Return a map without its mean plane."""
    basis, _ = polynomial(height.shape, "tilt")
    fit = fit_terms(height, np.isfinite(height), basis)
    return np.asarray(height - sum(c * term for c, term in zip(fit, basis, strict=True)))


def _reliable(psd: FloatArray, length: float, cell: float, name: str) -> tuple[float, float]:
    """Return the wave numbers between which a scan measures reliably."""
    if not np.any(psd > 0.0):
        raise ValueError(f"{name}: is flat: must have roughness")
    low = 2.0 * math.pi * _WAVES_IN_MAP / length
    high = 2.0 * math.pi / (_CELLS_IN_WAVE * cell)
    if not low < high:
        raise _too_few(0, length, cell, name)
    return low, high


def _too_few(places: int, length: float, cell: float, name: str) -> ValueError:
    """Return the error of a scan with too few reliable waves, or with roughness in too few."""
    if places < 2:
        return ValueError(f"{name}: is too small for a spectrum: its shorter side of {length:.4g} m"
                          f" has {length / cell:.0f} cells, and only waves between six cells and a"
                          " third of the side are measured reliably")
    return ValueError(f"{name}: has roughness of a single wavelength, or of none, between"
                      f" {_CELLS_IN_WAVE * cell:.4g} m (six cells) and {length / _WAVES_IN_MAP:.4g}"
                      " m (a third of the shorter side): must have several waves there, because"
                      " only these are measured reliably")


def _banded(k: FloatArray, psd: FloatArray, length: float, cell: float, name: str
            ) -> tuple[FloatArray, FloatArray]:
    """Return the means over bands of equal ratio, within the reliable range of wavelengths."""
    low, high = _reliable(psd, length, cell, name)
    count = max(2, math.ceil(_PER_DECADE * math.log10(high / low)))
    edges = np.geomspace(low, high, count + 1)
    band = np.searchsorted(edges, k, side="right") - 1
    inside = (band >= 0) & (band < count)
    modes = np.bincount(band[inside], minlength=count)
    waves = np.bincount(band[inside], np.log(k[inside]), count)
    sums = np.bincount(band[inside], psd[inside], count)
    middle = np.exp(waves / np.maximum(modes, 1))
    slope = sums * middle**2
    kept = (modes > 0) & (slope > _ROUND_OFF * slope.max())
    if np.count_nonzero(kept) < 2:
        raise _too_few(int(np.count_nonzero(modes)), length, cell, name)
    return middle[kept], sums[kept] / modes[kept]
