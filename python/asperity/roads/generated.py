"""Height maps made of analytic shapes and of random waves, by the Fortran library."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..base import library
from ..base.check import choice, exactly_one, number, positive, whole

__all__ = ["self_affine", "shape"]

FloatArray = NDArray[np.float64]

_SHAPES = ("sphere", "paraboloid", "cylinder", "sine", "hexagonal_wave")

_height = library.call("surface_height")


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
    lx, ly = library.lengths((ny, nx), lx, ly)
    height = np.zeros((ny, nx))
    centre_x = nx // 2 * lx / nx if centre_x is None else number("centre_x", centre_x)
    centre_y = ny // 2 * ly / ny if centre_y is None else number("centre_y", centre_y)
    if not -(2**31) <= seed < 2**31:
        raise ValueError(f"seed = {seed}: must fit 32 bits")
    try:
        _height(lx, ly, library.flag_of_boundary(boundary), name, radius, amplitude, wavelength,
                hurst, wavelength_long, wavelength_rolloff, wavelength_short, rms_height,
                rms_slope, seed, generator, centre_x, centre_y, height.T)
    except ValueError as error:
        # The library speaks of the input's group; its variables are the arguments here.
        raise ValueError(str(error).replace("&surface: ", "")) from None
    return height
