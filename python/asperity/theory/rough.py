"""Spectra of randomly rough surfaces, and the contact area of elastic solids on them.

The area is that of Persson's theory, or of the theory of Bush, Gibson and Thomas at low load.
Module `log_panels` says what a spectrum is; module `sliding_rough` has Persson's theory of sliding.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import erf

from ..base.check import array_of, exactly_one, number, positive
from ..roads import surface
from .log_panels import panels_of

FloatArray = NDArray[np.float64]

_FEWEST = 16             # modes of a band


def self_affine_psd(
    hurst: float,
    wavelength_long: float,
    wavelength_rolloff: float,
    wavelength_short: float,
    *,
    rms_height: float | None = None,
    rms_slope: float | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the knots of a self-affine PSD with roll-off (thesis, eq. 1.6).

    Parameters
    ----------
    hurst : float
        Hurst exponent, 0 < H <= 1.
    wavelength_long, wavelength_rolloff, wavelength_short : float
        Wavelengths, m, with long >= roll-off > short > 0. If the first two are equal, there is no
        plateau.
    rms_height, rms_slope : float
        Give exactly one, > 0: root mean square height (m) or slope.

    Returns
    -------
    wavenumber : ndarray, shape (2,) or (3,)
        Wave numbers of the knots, rad/m.
    psd : ndarray of the same shape
        Density at the knots, m^4. It is a power law between the knots, and zero outside.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> k, psd = self_affine_psd(0.8, 1e-4, 2e-5, 1e-7, rms_slope=1.0)
    >>> round(psd_moments(k, psd)[1], 12)
    1.0
    """
    h = number("hurst", hurst, 0.0, 1.0, low_open=True)
    short = positive("wavelength_short", wavelength_short)
    roll = number("wavelength_rolloff", wavelength_rolloff, short, low_open=True)
    long = number("wavelength_long", wavelength_long, roll)
    k = 2.0 * math.pi / np.array([long, roll, short] if long > roll else [roll, short])
    psd = np.ones(k.size)
    psd[-1] = (k[-1] / k[-2]) ** (-2.0 * (1.0 + h))
    height, slope = psd_moments(k, psd)
    name, wanted = exactly_one(rms_height=rms_height, rms_slope=rms_slope)
    factor = positive(name, wanted) / (height if name == "rms_height" else slope)
    return k, psd * factor**2


def psd_moments(wavenumber: ArrayLike, psd: ArrayLike) -> tuple[float, float]:
    """Return the rms height (m) and the rms slope of an isotropic power spectral density.

    Parameters
    ----------
    wavenumber, psd : array_like, shape (m,)
        Knots, rad/m, ascending, and the density at the knots, m^4; see `persson`.

    Returns
    -------
    (float, float)
        Rms height, m, and rms slope.

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    panels = panels_of(wavenumber, psd)
    return (
        math.sqrt(panels.total(panels.psd * panels.k) / (2.0 * math.pi)),
        math.sqrt(panels.total(panels.psd * panels.k**3) / (2.0 * math.pi)),
    )


def surface_psd(
    height: ArrayLike, lx: float, ly: float | None = None, *, bands_per_decade: int = 10
) -> tuple[FloatArray, FloatArray]:
    """Return the knots of the PSD of a given map, for `persson` and `persson_speed_step`.

    The modes of `asperity.surface.psd_map` are sorted into bands of the wave number, regardless of
    their direction. In each band the PSD is a power law with the same mean square height and slope
    as the modes, so that `psd_moments` gives the rms height and slope of the map.

    Parameters
    ----------
    height : array_like, shape (ny, nx)
        Heights of a periodic map, m, with ny >= 2; the map must not be flat.
    lx, ly : float
        Lengths of the map, m; by default `ly` makes the cells square.
    bands_per_decade : int
        Number of bands per decade, 1 to 200. Bands with fewer than 16 modes are joined to the next.

    Returns
    -------
    wavenumber : ndarray, shape (m,)
        Wave numbers of the knots, rad/m, ascending. Inner edges of bands occur twice, 1e-9 apart.
    psd : ndarray, shape (m,)
        Density at the knots, m^4.

    Raises
    ------
    ValueError
        If a value is out of range or the map is flat.

    Examples
    --------
    >>> import asperity
    >>> map_ = asperity.surface.self_affine(64, lx=1e-3, wavelength_short=1e-4, rms_slope=0.2)
    >>> round(psd_moments(*surface_psd(map_, 1e-3))[1], 6)
    0.2
    """
    map_ = array_of("height", height, ndim=2)
    if min(map_.shape) < 2:
        raise ValueError(f"height: has the shape {map_.shape}: must have at least 2 x 2 cells")
    across = positive("lx", lx)
    along = across * map_.shape[0] / map_.shape[1] if ly is None else positive("ly", ly)
    per_decade = number("bands_per_decade", bands_per_decade, 1, 200)
    rows, columns = map_.shape
    wave_x = 2.0 * math.pi * np.fft.fftfreq(columns, across / columns)
    wave_y = 2.0 * math.pi * np.fft.fftfreq(rows, along / rows)
    k = np.hypot(wave_x, wave_y[:, None]).ravel()[1:]
    share = surface.psd_map(map_, across, along).ravel()[1:] / (across * along)
    slope = share * k**2
    # Values far below all others are round-off of the Fourier transform.
    present = slope > 1e-20 * slope.max()
    if not np.any(present):
        raise ValueError("height: the map is flat: must have roughness")
    k, share, slope = k[present], share[present], slope[present]
    mesh = 2.0 * math.pi / max(across, along)
    start, end = k.min() - 0.5 * mesh, k.max() + 0.5 * mesh
    count = max(1, round(math.log10(end / start) * per_decade))
    edges = [start]
    for edge in np.geomspace(start, end, count + 1)[1:-1]:
        if np.count_nonzero((k > edges[-1]) & (k <= edge)) >= _FEWEST:
            edges.append(float(edge))
    if len(edges) > 1 and np.count_nonzero(k > edges[-1]) < _FEWEST:
        edges.pop()
    edges.append(end)
    knots, levels = [], []
    for low, high in pairwise(edges):
        inside = (k > low) & (k <= high)
        ratio = float(np.sum(slope[inside]) / np.sum(share[inside]))
        exponent = _band_exponent(ratio / low**2, high / low)
        level = 2.0 * math.pi * float(np.sum(slope[inside])) / (
            low**4 * _power_integral(exponent + 4.0, math.log(high / low)))
        knots += [low * (1.0 + 5e-10), high * (1.0 - 5e-10)]
        levels += [level, level * (high / low) ** exponent]
    return np.array(knots), np.array(levels)


def _power_integral(power: float, width: float) -> float:
    """Return int_1^{e^width} x^(power - 1) dx."""
    z = power * width
    return width if abs(z) < 1e-12 else math.expm1(z) / power


def _band_exponent(ratio: float, width: float) -> float:
    """Return a with int x^(a+3) dx = ratio int x^(a+1) dx over 1..width, as far as |a| allows."""
    span = math.log(width)
    most = max(60.0, 30.0 / span)

    def excess(a: float) -> float:
        return _power_integral(a + 4.0, span) / _power_integral(a + 2.0, span) - ratio

    if excess(-most) >= 0.0:
        return -most
    return most if excess(most) <= 0.0 else float(brentq(excess, -most, most, xtol=1e-13))


def persson_area(pressure: ArrayLike, modulus: float, rms_slope: float) -> FloatArray:
    """Return Persson's contact area fraction of an elastic contact, erf(sqrt(2) p/(E* h'rms)).

    Parameters
    ----------
    pressure : array_like
        Mean pressure p, Pa, >= 0, any shape.
    modulus : float
        E*, Pa, > 0.
    rms_slope : float
        Root mean square of |grad h|, > 0.

    Returns
    -------
    ndarray
        Real over apparent area, shape of `pressure`.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840.

    Examples
    --------
    >>> round(float(persson_area(1e4, 1e6, 1.0)) / 1e-2, 4)
    1.5957
    """
    p = array_of("pressure", pressure, low=0.0)
    scale = positive("modulus", modulus) * positive("rms_slope", rms_slope)
    return np.asarray(erf(math.sqrt(2.0) * p / scale))


def bush_gibson_thomas(pressure: ArrayLike, modulus: float, rms_slope: float) -> FloatArray:
    """Return the low-load area fraction of Bush, Gibson and Thomas, sqrt(2 pi) p/(E* h'rms).

    It holds for asperities that do not interact, and is an asymptote that may exceed 1. The slope
    of Persson's theory is smaller, sqrt(8/pi).

    Parameters
    ----------
    pressure : array_like
        Mean pressure p, Pa, >= 0, any shape.
    modulus : float
        E*, Pa, > 0.
    rms_slope : float
        Root mean square of the gradient, > 0.

    Returns
    -------
    ndarray
        Real over apparent area, shape of `pressure`.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    A. W. Bush, R. D. Gibson, T. R. Thomas, Wear 35 (1975) 87.

    Examples
    --------
    >>> round(float(bush_gibson_thomas(1e4, 1e6, 1.0)) / 1e-2, 4)
    2.5066
    """
    p = array_of("pressure", pressure, low=0.0)
    scale = positive("modulus", modulus) * positive("rms_slope", rms_slope)
    return math.sqrt(2.0 * math.pi) * p / scale
