"""Statistics and power spectral densities of height maps, by the Fortran library."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import library

__all__ = ["RadialPsd", "Statistics", "psd", "psd_map", "statistics"]

FloatArray = NDArray[np.float64]

_psd = library.call("surface_psd")
_radial_psd = library.call("surface_radial_psd")
_statistics = library.call("surface_statistics")


class RadialPsd(NamedTuple):
    """A radially averaged power spectral density.

    Attributes
    ----------
    wavenumber : ndarray
        Mean wave number of each ring in the plane of wave vectors, rad/m, ascending.
    psd : ndarray
        Mean density of each ring, m4; m3 for a profile.
    modes : ndarray
        Number of Fourier modes in each ring.
    """

    wavenumber: FloatArray
    psd: FloatArray
    modes: NDArray[np.int32]


class Statistics(NamedTuple):
    """Statistics of a height map; the moments of the height are about its mean.

    Attributes
    ----------
    mean, lowest, highest, rms_height : float
        Heights, m.
    skewness, kurtosis : float
        0 and 3 for a Gaussian surface; both are 0 for a flat one.
    rms_slope : float
        Root mean square of the gradient, computed in Fourier space as if the map were periodic.
    rms_slope_differences : float
        The same, computed from differences of neighbouring cells.
    rms_curvature : float
        Root mean square of the mean curvature (h_xx + h_yy)/2, computed in Fourier space, 1/m. For
        a profile (ny = 1) it is that of the whole second derivative h_xx, twice its mean curvature.
    nayak : float
        Nayak's parameter m0 m4/m2^2, from the spectral moments of the surface if it is isotropic.
    """

    mean: float
    lowest: float
    highest: float
    rms_height: float
    skewness: float
    kurtosis: float
    rms_slope: float
    rms_slope_differences: float
    rms_curvature: float
    nayak: float


def psd(height: ArrayLike, lx: float, ly: float | None = None) -> RadialPsd:
    """Return the radially averaged power spectral density of a map, without its mean.

    The density is Phi(k) = abs(h_hat)^2/(lx ly) (thesis, eq. 1.5), so that the sum of
    ``psd * modes / (lx ly)`` is the variance of the height.

    Parameters
    ----------
    height : array_like
        Height, m, shape (ny, nx), taken as periodic.
    lx, ly : float
        Lengths, m; `ly` defaults to square cells.

    Returns
    -------
    RadialPsd
        Wave numbers (rad/m), densities (m4; m3 of a profile) and numbers of modes of the rings.

    Raises
    ------
    ValueError
        If the map is no array (ny, nx) of finite numbers, has masked points, or a length is wrong.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> wave = np.cos(2 * np.pi * np.arange(16) / 8) * np.ones((16, 1))
    >>> spectrum = asperity.surface.psd(wave, 1.0)
    >>> round(float(np.sum(spectrum.psd * spectrum.modes)), 12)
    0.5
    """
    array = library.height_map(height)
    lx, ly = library.lengths(array.shape, lx, ly)
    ny, nx = array.shape
    most = nx + ny + 2
    wavenumber, density = np.zeros(most), np.zeros(most)
    modes = np.zeros(most, dtype=np.int32)
    (rings,) = _radial_psd(array.T, lx, ly, wavenumber, density, modes)
    return RadialPsd(wavenumber[:rings], density[:rings], modes[:rings])


def psd_map(height: ArrayLike, lx: float, ly: float | None = None) -> FloatArray:
    """Return the power spectral density of all modes, in the order of `numpy.fft.fftfreq`.

    The first mode contains the mean height, which is not subtracted.

    Parameters
    ----------
    height : array_like
        Height, m, shape (ny, nx), taken as periodic.
    lx, ly : float
        Lengths, m; `ly` defaults to square cells.

    Returns
    -------
    ndarray
        Density, m4 (m3 of a profile), shape (ny, nx).

    Raises
    ------
    ValueError
        If the map is no array (ny, nx) of finite numbers, has masked points, or a length is wrong.
    """
    array = library.height_map(height)
    lx, ly = library.lengths(array.shape, lx, ly)
    density = np.zeros_like(array)
    _psd(array.T, lx, ly, density.T)
    return density


def statistics(
    height: ArrayLike, lx: float, ly: float | None = None, boundary: str = "periodic"
) -> Statistics:
    """Return the statistics of a height map.

    Parameters
    ----------
    height : array_like
        Height, m, shape (ny, nx).
    lx, ly : float
        Lengths, m; `ly` defaults to square cells.
    boundary : str
        'periodic' or 'free'. Only in a periodic map differences extend across the edges.

    Returns
    -------
    Statistics
        Heights in m, slopes as pure numbers, the curvature in 1/m.

    Raises
    ------
    ValueError
        If the map is no array (ny, nx) of finite numbers, has masked points, or a length is wrong.

    Examples
    --------
    >>> import numpy as np, asperity
    >>> wave = np.cos(2 * np.pi * np.arange(64) / 64) * np.ones((64, 1))
    >>> round(asperity.surface.statistics(wave, 2 * np.pi).rms_slope ** 2, 12)
    0.5
    """
    array = library.height_map(height)
    lx, ly = library.lengths(array.shape, lx, ly)
    (values,) = _statistics(array.T, lx, ly, library.flag_of_boundary(boundary))
    return Statistics(*map(float, values))
