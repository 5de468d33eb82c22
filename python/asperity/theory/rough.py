"""Randomly rough surfaces: Persson's theory; Bush, Gibson and Thomas at low load.

The power spectral density Phi(k) = |h_hat(k)|^2/A (thesis, eq. 1.5; m^4) is that of an isotropic
surface: mean(h^2) = int Phi k dk/(2 pi), mean(|grad h|^2) = int Phi k^3 dk/(2 pi). Persson's
C(q) is Phi/(4 pi^2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf

from .._check import array_of, exactly_one, number, poisson_ratio, positive
from ..material import Prony

FloatArray = NDArray[np.float64]

_ORDER = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_ORDER)


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
    """Gauss panels in log k: a PSD linear in log-log between its knots is integrated panelwise."""

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
    phi = array_of("psd", psd, low=0.0, low_open=True, ndim=1)
    if k.size < 2 or phi.size != k.size:
        raise ValueError(
            f"wavenumber, psd: have {k.size} and {phi.size} values:"
            " must have the same number, at least 2"
        )
    knots = np.log(k)
    edges = [knots[:1]]
    for low, high in pairwise(knots):
        edges.append(np.linspace(low, high, max(1, math.ceil((high - low) / 0.5)) + 1)[1:])
    edge = np.concatenate(edges)
    # where E* is far above p, the area falls from 1 close to the first wavenumber
    steps = np.diff(edge)
    steps = np.append(steps[0] * np.append(2.0**-40, 0.5 ** np.arange(40, 0, -1)), steps[1:])
    half = 0.5 * steps
    middle = edge[0] + np.cumsum(steps) - half
    x = middle[:, None] + half[:, None] * _NODES
    return _Spectrum(np.exp(x), np.exp(np.interp(x, knots, np.log(phi))), half)


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
        0 < H <= 1.
    wavelength_long, wavelength_rolloff, wavelength_short : float
        m, long >= roll-off > short > 0; equal long and roll-off: no plateau.
    rms_height, rms_slope : float
        Exactly one, > 0: root mean square height (m) or slope.

    Returns
    -------
    wavenumber : ndarray, shape (2,) or (3,)
        rad/m.
    psd : ndarray of the same shape
        m^4; a straight line in log-log between the knots, zero outside.

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
    if exactly_one(rms_height=rms_height, rms_slope=rms_slope) == "rms_height":
        factor = positive("rms_height", rms_height) / height  # type: ignore[arg-type]
    else:
        factor = positive("rms_slope", rms_slope) / slope  # type: ignore[arg-type]
    return k, psd * factor**2


def psd_moments(wavenumber: ArrayLike, psd: ArrayLike) -> tuple[float, float]:
    """Return rms height (m) and rms slope of an isotropic PSD (m^4) at wavenumbers (rad/m)."""
    s = _spectrum(wavenumber, psd)
    return (
        math.sqrt(s.total(s.psd * s.k) / (2.0 * math.pi)),
        math.sqrt(s.total(s.psd * s.k**3) / (2.0 * math.pi)),
    )


def persson_area(pressure: ArrayLike, modulus: float, rms_slope: float) -> FloatArray:
    """Return Persson's contact area fraction of an elastic contact, erf(sqrt2 p/(E* h'rms)).

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

    Asperities that do not interact: an asymptote, not bounded by 1. Persson's slope is
    sqrt(8/pi); arguments, errors as for `persson_area`.

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
        rad/m, ascending, up to the end of the spectrum.
    area : ndarray, shape (..., n)
        P(q): contact area fraction when roughness up to q is seen.
    friction_up_to : ndarray, shape (..., n)
        Friction coefficient by the roughness up to q.
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
    pressure: float,
    gamma: float,
) -> PerssonContact:
    """Return the contact from the angular means of |E*|^2 and cos(phi) Im E*, at the points."""
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
    end_area = _area_of(whole / (16.0 * math.pi * pressure**2))
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
    pressure: float,
    velocity: float,
    *,
    poisson: float = 0.5,
    gamma: float = 1.0,
) -> PerssonContact:
    """Return area and viscoelastic friction of a rubber block sliding steadily on a rough road.

    With E*(w) = 2 G*(w)/(1 - nu) and C = Phi/(4 pi^2) ::

        P(q) = erf(1/(2 sqrt(g(q))))
        g(q) = (1/8) int_{q0}^{q} dq q^3 C int_0^{2 pi} dphi |E*(q V cos phi)/p|^2
        friction = (1/2) int dq q^3 C S P int_0^{2 pi} dphi cos(phi) Im E*(q V cos phi)/p
        S = gamma + (1 - gamma) P^2

    The angular integrals are done in closed form for a Prony series, those over q by Gauss
    panels (1e-9 relative).

    Parameters
    ----------
    wavenumber : array_like, shape (m,)
        Knots of the PSD, rad/m, > 0, ascending, m >= 2.
    psd : array_like, shape (m,)
        Phi at the knots, m^4, > 0: straight in log-log between the knots, zero outside. From
        `self_affine_psd`, or a radial average of a measured surface.
    material : Prony
        Shear relaxation modulus.
    pressure : float
        Nominal pressure p, Pa, > 0.
    velocity : float
        Sliding speed V, m/s, >= 0.
    poisson : float
        Constant in time.
    gamma : float
        0..1; 1 leaves out the correction for partial contact; 0.45 in the thesis (section 4.3).

    Returns
    -------
    PerssonContact

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
    p, v = positive("pressure", pressure), number("velocity", velocity, 0.0)
    nu = poisson_ratio(poisson)
    weight = number("gamma", gamma, 0.0, 1.0)
    a = s.k[..., None] * v * material.tau
    root = np.sqrt(1.0 + a * a)
    # mean over phi of cos(phi) G''(w cos phi)
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
    """Return area and viscoelastic friction after a sudden change of the sliding speed.

    The theory of `persson` with E*(w) replaced by the ratio of the stress to the height of each
    wave in full contact, which is known in closed form: after the change each arm passes from
    its old steady value to the new one as exp(-t/tau), turning with the wave. Same direction of
    sliding before and after.

    Parameters
    ----------
    wavenumber, psd, material, pressure, poisson, gamma
        As for `persson`.
    velocity_before, velocity_after : float
        Speeds before and after t = 0, m/s, >= 0. 0 before: the road had rested for ever.
    times : array_like, shape (n,)
        Times since the change, s, >= 0.
    angles : int, optional
        Points of the angular integrals over a quarter turn; by default enough for the shortest
        wave while its arms still remember, at most 4096 (1e-5 relative).

    Returns
    -------
    PerssonContact
        Leading axis: the times.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    Thesis, section 4.3, and there [28].

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
    """Return the means over phi of |M|^2 and -cos(phi) Im M, M the apparent modulus at time t.

    The steady parts are in closed form; the fading part f is integrated by Gauss's rule:
    |M|^2 = |M_s|^2 + 2 Re(f conj(M_s)) + |f|^2.
    """
    tau, g = material.tau, material.g
    a = k[:, None] * after * tau
    root = np.sqrt(1.0 + a * a)
    squared = _squared_modulus(material, a)
    loss = np.sum(g * a / (root * (root + 1.0)), axis=-1)
    alive = g * np.exp(-t / tau)
    if not np.any(alive > 1e-18 * material.instantaneous_modulus):
        return squared, loss
    # Gauss panels; the rule's own nodes cost too much beyond a few hundred
    panels = math.ceil(angles / 16)
    few, weights = np.polynomial.legendre.leggauss(16)
    nodes = ((2.0 * np.arange(panels)[:, None] + 1.0 + few) / panels - 1.0).ravel()
    weights = np.tile(weights / panels, panels)
    # phi = pi/2 - psi, psi = (pi/2) z^3: crowded towards psi = 0, where the slow arms change
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
