"""Randomly rough surfaces: Persson's theory, and the theory of Bush, Gibson and Thomas at low load.

The power spectral density Phi(k) = |h_hat(k)|^2/A (thesis, eq. 1.5; m^4) is that of an isotropic
surface: mean(h^2) = int Phi k dk/(2 pi), mean(|grad h|^2) = int Phi k^3 dk/(2 pi). Persson's
C(q) is Phi/(4 pi^2). It is given at knots and is a power law between them, a straight line in
log-log. If it is zero at one of two neighbouring knots, it has the value of the other knot in the
half of the interval next to that knot, and is zero in the other half.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import erf

from ..base.check import array_of, exactly_one, instance, number, poisson_ratio, positive
from ..roads import surface
from ..rubber.material import Prony

FloatArray = NDArray[np.float64]

_ORDER = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)

_FEWEST = 16


def _running_weights() -> FloatArray:
    """Return B with int_{-1}^{x_i} f = sum_j B_ij f(x_j) for polynomials through the nodes."""
    legendre = np.polynomial.legendre
    primitive = np.empty((_ORDER, _ORDER))
    for n in range(_ORDER):
        unit = np.zeros(n + 1)
        unit[n] = 1.0
        primitive[:, n] = legendre.legval(_NODES, legendre.legint(unit, lbnd=-1.0))
    return primitive @ np.linalg.inv(legendre.legvander(_NODES, _ORDER - 1))


_RUNNING = _running_weights()


@dataclass(frozen=True)
class _Spectrum:
    """A power spectral density at the Gauss points of panels in log k, for integrals over k."""

    k: FloatArray          # (panels, order) wavenumbers, rad/m
    psd: FloatArray        # (panels, order) m^4
    half: FloatArray       # (panels,) half lengths in log k

    def total(self, f: FloatArray) -> float:
        """Return int f dk."""
        return float(np.sum(self.half[:, None] * _WEIGHTS * self.k * f))

    def running(self, f: FloatArray) -> FloatArray:
        """Return int_{k_0}^{k} f dk at all the points; leading axes of f are kept."""
        g = f * self.k
        panels = self.half * np.sum(_WEIGHTS * g, axis=-1)
        before = np.cumsum(panels, axis=-1) - panels
        return before[..., None] + self.half[:, None] * (g @ _RUNNING.T)


def _spectrum(wavenumber: ArrayLike, psd: ArrayLike) -> _Spectrum:
    k = array_of("wavenumber", wavenumber, low=0.0, low_open=True, ndim=1, increasing=True)
    phi = array_of("psd", psd, low=0.0, ndim=1)
    if k.size < 2 or phi.size != k.size:
        raise ValueError(
            f"wavenumber, psd: have {k.size} and {phi.size} values:"
            " must have the same number, at least 2"
        )
    # Values far below all others are round-off of a Fourier transform.
    moment = phi * k**3
    present = moment > 1e-20 * moment.max()
    if not np.any(present):
        raise ValueError("psd: all values are 0.0: must have one > 0")
    knots, level = np.log(k), np.log(np.where(present, phi, 1.0))
    low: list[float] = []
    high: list[float] = []
    start, rise = [], []
    for i in range(k.size - 1):
        a, b = knots[i], knots[i + 1]
        if present[i] and present[i + 1]:
            slope = (level[i + 1] - level[i]) / (b - a)
        elif present[i]:
            b, slope = 0.5 * (a + b), 0.0
        elif present[i + 1]:
            a, slope = 0.5 * (a + b), 0.0
        else:
            continue
        pieces = max(1, math.ceil((b - a) * max(2.0, 0.25 * abs(slope))))
        edge = np.linspace(a, b, pieces + 1)
        low.extend(edge[:-1])
        high.extend(edge[1:])
        base = level[i] if present[i] else level[i + 1]
        start.extend(base + slope * (edge[:-1] - a))
        rise.extend([slope] * pieces)
    # If E* is far above p, the area falls from 1 close to the first wave number: refine there.
    width = high[0] - low[0]
    parts = width * np.append(0.0, 0.5 ** np.arange(40, -1, -1))
    first = low[0] + parts
    low_edge = np.append(first[:-1], low[1:])
    half = 0.5 * np.append(np.diff(parts), np.subtract(high[1:], low[1:]))
    base_level = np.append(start[0] + rise[0] * parts[:-1], start[1:])
    slopes = np.append(np.full(41, rise[0]), rise[1:])
    offset = half[:, None] * (1.0 + _NODES)
    return _Spectrum(
        np.exp(low_edge[:, None] + offset),
        np.exp(base_level[:, None] + slopes[:, None] * offset),
        half,
    )


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
    s = _spectrum(wavenumber, psd)
    return (
        math.sqrt(s.total(s.psd * s.k) / (2.0 * math.pi)),
        math.sqrt(s.total(s.psd * s.k**3) / (2.0 * math.pi)),
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
    """Return a, |a| <= 60, with int x^(a+3) dx = ratio int x^(a+1) dx over 1..width."""
    span = math.log(width)

    def excess(a: float) -> float:
        return _power_integral(a + 4.0, span) / _power_integral(a + 2.0, span) - ratio

    if excess(-60.0) >= 0.0:
        return -60.0
    return 60.0 if excess(60.0) <= 0.0 else float(brentq(excess, -60.0, 60.0, xtol=1e-13))


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


@dataclass(frozen=True)
class PerssonContact:
    """Viscoelastic rough contact after Persson.

    Attributes
    ----------
    wavenumber : ndarray, shape (n,)
        Wave numbers q, rad/m, ascending, up to the end of the spectrum.
    area : ndarray, shape (..., n)
        P(q), the contact area fraction of a road with waves up to q.
    friction_up_to : ndarray, shape (..., n)
        Friction coefficient due to the waves up to q.
    contact_area : ndarray, shape (...)
        Area fraction with the whole roughness.
    friction : ndarray, shape (...)
        Viscoelastic friction coefficient.
    """

    wavenumber: FloatArray
    area: FloatArray
    friction_up_to: FloatArray
    contact_area: FloatArray
    friction: FloatArray


def _squared_modulus(material: Prony, a: FloatArray) -> FloatArray:
    """Return the mean of |G*(w cos phi)|^2 over phi; a = w tau on the last axis (the arms).

    With d = 1 - 1/sqrt(1 + a^2), by partial fractions:
    G_e^2 + 2 sum_k g_k d_k (G_e + sum_j g_j tau_j/(tau_j + tau_k)).
    """
    root = np.sqrt(1.0 + a * a)
    d = a * a / (root * (root + 1.0))
    tau = material.tau
    shared = np.sum(material.g * tau / (tau + tau[:, None]), axis=1)
    return material.g_inf**2 + 2.0 * np.sum(material.g * (material.g_inf + shared) * d, axis=-1)


def _area_of(variance: FloatArray) -> FloatArray:
    """Return the area fraction erf(1/(2 sqrt(g))), 1 where g = 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(erf(0.5 / np.sqrt(variance)))


def _finish(
    s: _Spectrum,
    squared: FloatArray,
    loss: FloatArray,
    pressure: FloatArray | float,
    gamma: float,
) -> PerssonContact:
    """Return the contact from the angular means of |E*|^2 and cos(phi) Im E*, at the points."""
    load = pressure
    pressure = np.asarray(load)[..., None, None]
    variance = s.running(s.psd * s.k**3 * squared) / (16.0 * math.pi * pressure**2)
    area = _area_of(variance)
    reduced = gamma + (1.0 - gamma) * area**2
    # (1/2) int q^3 C S P int_0^2pi cos(phi) Im E* dphi/p, with C = Phi/(4 pi^2)
    integrand = s.psd * s.k**3 * reduced * area * loss / (4.0 * math.pi * pressure)
    running = s.running(integrand)
    last = s.half[-1] * np.sum(_WEIGHTS * (integrand * s.k)[..., -1, :], axis=-1)
    start = np.sum((s.half[:, None] * _WEIGHTS * s.k * integrand)[..., :-1, :], axis=(-2, -1))
    moment = s.psd * s.k**4 * squared
    whole = np.sum(s.half[:, None] * _WEIGHTS * moment, axis=(-2, -1))
    end_area = _area_of(whole / (16.0 * math.pi * np.asarray(load) ** 2))
    lead = area.shape[:-2]
    edge = math.exp(math.log(s.k[-1, -1]) + s.half[-1] * (1.0 - _NODES[-1]))
    join = np.concatenate
    friction = start + last
    return PerssonContact(
        np.append(s.k.ravel(), edge),
        join([area.reshape(*lead, -1), end_area[..., None]], axis=-1),
        join([running.reshape(*lead, -1), np.asarray(friction)[..., None]], axis=-1),
        end_area,
        np.asarray(friction),
    )


def persson(
    wavenumber: ArrayLike,
    psd: ArrayLike,
    material: Prony,
    pressure: ArrayLike,
    velocity: ArrayLike,
    *,
    poisson: float = 0.5,
    gamma: float = 1.0,
) -> PerssonContact:
    """Return contact area and viscoelastic friction of rubber that slides steadily on a rough road.

    With E*(w) = 2 G*(w)/(1 - nu) and C = Phi/(4 pi^2) ::

        P(q) = erf(1/(2 sqrt(g(q))))
        g(q) = (1/8) int_{q0}^{q} dq q^3 C int_0^{2 pi} dphi |E*(q V cos phi)/p|^2
        friction = (1/2) int dq q^3 C S P int_0^{2 pi} dphi cos(phi) Im E*(q V cos phi)/p
        S = gamma + (1 - gamma) P^2

    For a Prony series the integrals over phi have a closed form. Those over q are computed by Gauss
    panels, to a relative accuracy of 1e-9.

    Parameters
    ----------
    wavenumber : array_like, shape (m,)
        Knots of the PSD, rad/m, > 0, ascending, m >= 2.
    psd : array_like, shape (m,)
        Phi at the knots, m^4, >= 0; a power law between the knots, zero outside. It comes from
        `self_affine_psd`, or for a given map from `surface_psd` (or, without bands,
        `asperity.surface.psd`).
    material : Prony
        Shear relaxation modulus.
    pressure : array_like
        Nominal pressure p, Pa, > 0.
    velocity : array_like
        Sliding speed V, m/s, >= 0; it is broadcast with `pressure`.
    poisson : float
        Poisson ratio, constant in time.
    gamma : float
        Correction for partial contact, 0 to 1. It is 0.45 in the thesis (section 4.3); 1 leaves out
        the correction.

    Returns
    -------
    PerssonContact
        Leading axes: those of `pressure` and `velocity`, broadcast.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840; the factor S: C. Yang, B. N. J. Persson,
    J. Phys.: Condens. Matter 20 (2008) 215214.

    Examples
    --------
    >>> k, phi = self_affine_psd(0.9, 2.5e-4, 2.5e-4, 7.8e-6, rms_slope=0.02)
    >>> at_rest = persson(k, phi, Prony(1e6, [1e7], [1e-4]), 1e4, 0.0)
    >>> abs(at_rest.contact_area - persson_area(1e4, 4e6, 0.02)) < 1e-12
    np.True_
    """
    s = _spectrum(wavenumber, psd)
    instance("material", material, Prony)
    p = array_of("pressure", pressure, low=0.0, low_open=True)
    v = array_of("velocity", velocity, low=0.0)
    for name, values in (("pressure", p), ("velocity", v)):
        if not values.size:
            raise ValueError(f"{name}: has no value, must have at least one")
    p, v = np.broadcast_arrays(p, v)
    nu = poisson_ratio(poisson)
    weight = number("gamma", gamma, 0.0, 1.0)
    a = s.k[..., None] * v[..., None, None, None] * material.tau
    root = np.sqrt(1.0 + a * a)
    # the mean over phi of cos(phi) G''(w cos phi)
    loss = np.sum(material.g * a / (root * (root + 1.0)), axis=-1)
    factor = 2.0 / (1.0 - nu)
    return _finish(s, factor**2 * _squared_modulus(material, a), factor * loss, p, weight)


def persson_speed_step(
    wavenumber: ArrayLike,
    psd: ArrayLike,
    material: Prony,
    pressure: float,
    velocity_before: float,
    velocity_after: float,
    times: ArrayLike,
    *,
    poisson: float = 0.5,
    gamma: float = 1.0,
    angles: int | None = None,
) -> PerssonContact:
    """Return contact area and viscoelastic friction after a sudden change of the sliding speed.

    This is the theory of `persson`, in which the ratio of stress to height of each wave in full
    contact replaces E*(w). This ratio has a closed form: after the change each arm goes from its
    old steady value to the new one as exp(-t/tau), while its phase rotates with the wave. The
    direction of sliding does not change.

    Parameters
    ----------
    wavenumber, psd, material, pressure, poisson, gamma
        As in `persson`; `pressure` is a single number.
    velocity_before, velocity_after : float
        Speeds before and after t = 0, m/s, >= 0. With `velocity_before` = 0 the road rested for an
        infinite time.
    times : array_like, shape (n,)
        Times since the change, s, >= 0.
    angles : int, optional
        Number of points of the angular integrals over a quarter turn, at least 8. The default
        resolves the shortest wave until its arms have relaxed (at most 4096 points, relative
        accuracy 1e-5).

    Returns
    -------
    PerssonContact
        The leading axis is that of the times.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    R. Bugnicourt, thesis, INSA Lyon, 2017, section 4.3 and its reference 28.

    Examples
    --------
    >>> k, phi = self_affine_psd(0.9, 2.5e-4, 2.5e-4, 7.8e-6, rms_slope=0.02)
    >>> rubber = Prony(1e6, [1e7], [1e-4])
    >>> moved = persson_speed_step(k, phi, rubber, 1e5, 0.01, 3.0, [0.0, 1e-2])
    >>> steady = [persson(k, phi, rubber, 1e5, v).friction for v in (0.01, 3.0)]
    >>> bool(np.allclose(moved.friction, steady, rtol=1e-4))
    True
    """
    s = _spectrum(wavenumber, psd)
    instance("material", material, Prony)
    p = positive("pressure", pressure)
    before = number("velocity_before", velocity_before, 0.0)
    after = number("velocity_after", velocity_after, 0.0)
    t = array_of("times", np.atleast_1d(np.asarray(times)), low=0.0, ndim=1)
    factor = 2.0 / (1.0 - poisson_ratio(poisson))
    weight = number("gamma", gamma, 0.0, 1.0)
    if angles is not None:
        number("angles", angles, 8)
    squared = np.empty((t.size, *s.k.shape))
    loss = np.empty_like(squared)
    longest = float(material.tau.max(initial=0.0))
    for i, now in enumerate(t):
        for panel in range(s.k.shape[0]):
            k = s.k[panel]
            memory = min(float(now), 40.0 * longest)
            enough = int(np.clip(96.0 + 2.0 * k[-1] * after * memory, 96.0, 4096.0))
            squared[i, panel], loss[i, panel] = _speed_step_means(
                k, material, before, after, float(now), angles or enough
            )
    return _finish(s, factor**2 * squared, factor * loss, p, weight)


def _speed_step_means(
    k: FloatArray, material: Prony, before: float, after: float, t: float, angles: int
) -> tuple[FloatArray, FloatArray]:
    """Return the means over phi of |M|^2 and -cos(phi) Im M, with the apparent modulus M at time t.

    M = M_s + f has a steady part M_s, whose means have a closed form, and a fading part f, whose
    means are computed by Gauss's rule: |M|^2 = |M_s|^2 + 2 Re(f conj(M_s)) + |f|^2.
    """
    tau, g = material.tau, material.g
    a = k[:, None] * after * tau
    root = np.sqrt(1.0 + a * a)
    squared = _squared_modulus(material, a)
    loss = np.sum(g * a / (root * (root + 1.0)), axis=-1)
    alive = g * np.exp(-t / tau)
    if not np.any(alive > 1e-18 * material.instantaneous_modulus):
        return squared, loss
    # Use panels of 16 points, because a Gauss rule of many hundred nodes takes long to compute.
    panels = math.ceil(angles / 16)
    few, weights = np.polynomial.legendre.leggauss(16)
    nodes = ((2.0 * np.arange(panels)[:, None] + 1.0 + few) / panels - 1.0).ravel()
    weights = np.tile(weights / panels, panels)
    # With phi = pi/2 - psi and psi = (pi/2) z^3 the points are dense near psi = 0, where the
    # response of slow arms changes quickly.
    z = 0.5 * (nodes + 1.0)
    psi = 0.5 * math.pi * z**3
    weights = 1.5 * z**2 * weights
    cosine = np.sin(psi)
    omega = k[:, None] * cosine
    steady = np.full(omega.shape, material.g_inf, dtype=complex)
    fading = np.zeros(omega.shape, dtype=complex)
    turn = np.exp(1j * omega * after * t)
    for g_k, tau_k in zip(g, tau, strict=True):
        new = -1j * omega * after * tau_k
        old = -1j * omega * before * tau_k
        new, old = new / (1.0 + new), old / (1.0 + old)
        steady += g_k * new
        fading += g_k * math.exp(-t / tau_k) * (old - new) * turn
    squared = squared + (2.0 * np.real(fading * np.conj(steady)) + np.abs(fading) ** 2) @ weights
    return squared, loss - (cosine * fading.imag) @ weights
