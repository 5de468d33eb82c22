"""Height maps: generators, power spectral densities and statistics, by the Fortran library.

Maps have the shape (ny, nx), heights are in m, summits are the largest values.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library
from ._check import choice, exactly_one, number, positive, whole
from .measured import MeasuredSurface, import_topography, load

__all__ = ["MeasuredSurface", "RadialPsd", "Statistics", "import_topography", "load", "psd",
           "psd_map", "self_affine", "shape", "statistics"]

FloatArray = NDArray[np.float64]

_SHAPES = ("sphere", "paraboloid", "cylinder", "sine", "hexagonal_wave")

_height = _library.call("surface_height")
_psd = _library.call("surface_psd")
_radial_psd = _library.call("surface_radial_psd")
_statistics = _library.call("surface_statistics")


class RadialPsd(NamedTuple):
    """A radially averaged power spectral density.

    Attributes
    ----------
    wavenumber : ndarray
        Mean wave number of each ring, rad/m, rising.
    psd : ndarray
        Mean density of each ring, m4; m3 of a profile.
    modes : ndarray
        Number of modes of each ring.
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
        0 and 3 of a Gaussian surface; both 0 of a flat one.
    rms_slope : float
        Root mean square of the gradient, spectral: the map is taken as periodic.
    rms_slope_differences : float
        The same from differences of neighbours.
    rms_curvature : float
        Root mean square of the mean curvature, 1/m, spectral.
    nayak : float
        Nayak's parameter of the isotropic surface.
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


def self_affine(
    nx: int,
    ny: int | None = None,
    lx: float = 1.0,
    ly: float | None = None,
    *,
    hurst: float = 0.8,
    wavelength_short: float,
    wavelength_long: float | None = None,
    wavelength_rolloff: float | None = None,
    rms_height: float | None = None,
    rms_slope: float | None = None,
    seed: int = 1,
    generator: str = "random_phase",
) -> FloatArray:
    """Return a periodic self-affine random surface.

    Its power spectral density is constant from the long wavelength to the roll-off, and falls
    with the exponent -2 (1 + `hurst`) from there to the short wavelength. The same numbers give
    the same surface as the program's ``&surface shape = 'self_affine'``.

    Parameters
    ----------
    nx, ny : int
        Number of cells; `ny` defaults to `nx`, and is 1 for a profile.
    lx, ly : float
        Lengths, m; `ly` defaults to square cells.
    hurst : float
        Hurst exponent, 0 < H <= 1.
    wavelength_short : float
        Smallest wavelength, m.
    wavelength_long : float, optional
        Largest wavelength, m; `lx` if left out.
    wavelength_rolloff : float, optional
        Roll-off wavelength, m; none if left out.
    rms_height, rms_slope : float
        What to scale to: give one of them; m, 1.
    seed : int
        Another seed, another surface.
    generator : str
        'random_phase' (amplitudes of the spectrum exactly) or 'filtered_noise'.

    Returns
    -------
    ndarray
        Height, m, shape (ny, nx).

    Raises
    ------
    ValueError
        If a number is not allowed, or the grid holds no mode of the band.

    Examples
    --------
    >>> import asperity
    >>> height = asperity.surface.self_affine(64, wavelength_short=0.1, rms_slope=0.2)
    >>> height.shape
    (64, 64)
    >>> round(asperity.surface.statistics(height, 1.0).rms_slope, 12)
    0.2
    """
    exactly_one(rms_height=rms_height, rms_slope=rms_slope)
    rolloff = wavelength_rolloff
    longest = wavelength_long if wavelength_long is not None else lx
    shortest = positive("wavelength_short", wavelength_short)
    least, most = f"wavelength_short = {shortest:g}", f"wavelength_long = {longest!r}"
    if wavelength_long is None:
        most = f"lx = {longest!r}, the longest wavelength unless wavelength_long is given"
    elif not number("wavelength_long", longest) >= shortest:
        raise ValueError(f"wavelength_long = {longest!r}: must be at least {least}")
    if not shortest <= positive("lx" if wavelength_long is None else "wavelength_long", longest):
        raise ValueError(f"wavelength_short = {shortest:g}: must be at most {most}")
    if rolloff is not None and not shortest <= number("wavelength_rolloff", rolloff) <= longest:
        raise ValueError(f"wavelength_rolloff = {rolloff!r}: must be at least {least} and at most"
                         f" {most}")
    number("hurst", hurst, 0.0, 1.0, low_open=True)
    choice("generator", generator, ("random_phase", "filtered_noise"))
    return _make(
        nx, nx if ny is None else ny, lx, ly, "periodic", "self_affine", hurst=hurst,
        wavelength_long=longest, wavelength_rolloff=longest if rolloff is None else rolloff,
        wavelength_short=wavelength_short,
        rms_height=0.0 if rms_height is None else positive("rms_height", rms_height),
        rms_slope=0.0 if rms_slope is None else positive("rms_slope", rms_slope),
        seed=seed, generator=generator)


def shape(
    name: str,
    nx: int,
    ny: int | None = None,
    lx: float = 1.0,
    ly: float | None = None,
    *,
    radius: float = 0.0,
    amplitude: float = 0.0,
    wavelength: float = 0.0,
    centre_x: float | None = None,
    centre_y: float | None = None,
    boundary: str = "periodic",
) -> FloatArray:
    """Return an analytic surface.

    Parameters
    ----------
    name : str
        'sphere', 'paraboloid' or 'cylinder' (axis along y), of `radius`; 'sine' or
        'hexagonal_wave', of `amplitude` and `wavelength`.
    nx, ny : int
        Number of cells; `ny` defaults to `nx`, and is 1 for a profile.
    lx, ly : float
        Lengths, m; `ly` defaults to square cells.
    radius, amplitude, wavelength : float
        m.
    centre_x, centre_y : float, optional
        Where the summit is, m; a cell in the middle if left out.
    boundary : str
        'periodic' or 'free'.

    Returns
    -------
    ndarray
        Height, m, shape (ny, nx).

    Raises
    ------
    ValueError
        If a name, a number of cells or a length is wrong, or the shape lacks what it needs.

    Examples
    --------
    >>> import asperity
    >>> sphere = asperity.surface.shape("sphere", 64, lx=2e-3, radius=0.01, boundary="free")
    >>> float(sphere.max())
    0.0
    """
    choice("name", name, _SHAPES)
    return _make(nx, nx if ny is None else ny, lx, ly, boundary, name, radius=radius,
                 amplitude=amplitude, wavelength=wavelength, centre_x=centre_x, centre_y=centre_y)


def psd(height: ArrayLike, lx: float, ly: float | None = None) -> RadialPsd:
    """Return the radially averaged power spectral density of a map, without its mean.

    The density is that of Phi(k) = abs(h_hat)^2/(lx ly), so that the sum of
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
    array = _library.height_map(height)
    lx, ly = _library.lengths(array.shape, lx, ly)
    ny, nx = array.shape
    most = nx + ny + 2
    wavenumber, density = np.zeros(most), np.zeros(most)
    modes = np.zeros(most, dtype=np.int32)
    (rings,) = _radial_psd(array.T, lx, ly, wavenumber, density, modes)
    return RadialPsd(wavenumber[:rings], density[:rings], modes[:rings])


def psd_map(height: ArrayLike, lx: float, ly: float | None = None) -> FloatArray:
    """Return the power spectral density of all modes, in the order of `numpy.fft.fftfreq`.

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
    array = _library.height_map(height)
    lx, ly = _library.lengths(array.shape, lx, ly)
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
        'periodic' or 'free': whether differences reach across the edges.

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
    array = _library.height_map(height)
    lx, ly = _library.lengths(array.shape, lx, ly)
    (values,) = _statistics(array.T, lx, ly, _library.flag_of_boundary(boundary))
    return Statistics(*map(float, values))


def _make(
    nx: int, ny: int, lx: float, ly: float | None, boundary: str, name: str, *,
    radius: float = 0.0, amplitude: float = 0.0, wavelength: float = 0.0, hurst: float = 0.8,
    wavelength_long: float = 0.0, wavelength_rolloff: float = 0.0, wavelength_short: float = 0.0,
    rms_height: float = 0.0, rms_slope: float = 0.0, seed: int = 1,
    generator: str = "random_phase", centre_x: float | None = None,
    centre_y: float | None = None,
) -> FloatArray:
    """Make a map of one term."""
    nx, ny = whole("nx", nx), whole("ny", ny)
    lx, ly = _library.lengths((ny, nx), lx, ly)
    height = np.zeros((ny, nx))
    centre_x = nx // 2 * lx / nx if centre_x is None else number("centre_x", centre_x)
    centre_y = ny // 2 * ly / ny if centre_y is None else number("centre_y", centre_y)
    if not -(2**31) <= seed < 2**31:
        raise ValueError(f"seed = {seed}: must fit 32 bits")
    try:
        _height(lx, ly, _library.flag_of_boundary(boundary), name, radius, amplitude, wavelength,
                hurst, wavelength_long, wavelength_rolloff, wavelength_short, rms_height,
                rms_slope, seed, generator, centre_x, centre_y, height.T)
    except ValueError as error:
        # The library speaks of the input's group; its variables are the arguments here.
        raise ValueError(str(error).replace("&surface: ", "")) from None
    return height
