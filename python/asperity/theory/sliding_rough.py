"""Persson's theory of rubber that slides on a randomly rough road."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf

from ..base.check import array_of, instance, number, poisson_ratio
from ..rubber.material import Prony
from .log_panels import Panels, panels_of

__all__ = ["PerssonContact", "contact_of", "persson", "steady_means"]

FloatArray = NDArray[np.float64]


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


def steady_means(material: Prony, a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the means of |G*(w cos phi)|^2 and cos(phi) Im G*(w cos phi) over phi.

    With d = 1 - 1/sqrt(1 + a^2), by partial fractions, the first one is
    G_e^2 + 2 sum_k g_k d_k (G_e + sum_j g_j tau_j/(tau_j + tau_k)).

    Parameters
    ----------
    material : Prony
        Shear relaxation modulus.
    a : ndarray, shape (..., arms)
        w tau.

    Returns
    -------
    squared, loss : ndarray, shape (...)
        Pa^2 and Pa.
    """
    root = np.hypot(1.0, a)
    share = a / root / (root + 1.0)
    tau = material.tau
    shared = np.sum(material.g * tau / (tau + tau[:, None]), axis=1)
    squared = material.g_inf**2 + 2.0 * np.sum(
        material.g * (material.g_inf + shared) * a * share, axis=-1)
    return squared, np.sum(material.g * share, axis=-1)


def _area_of(variance: FloatArray) -> FloatArray:
    """Return the area fraction erf(1/(2 sqrt(g))), 1 where g = 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(erf(0.5 / np.sqrt(variance)))


def contact_of(
    panels: Panels,
    squared: FloatArray,
    loss: FloatArray,
    pressure: FloatArray | float,
    gamma: float,
) -> PerssonContact:
    """Return the contact from the angular means of |E*|^2 and cos(phi) Im E*, at the points.

    Parameters
    ----------
    panels : Panels
        The spectrum.
    squared, loss : ndarray, shape (..., panels, points)
        Pa^2 and Pa.
    pressure : float or ndarray, shape (...)
        Nominal pressure, Pa.
    gamma : float
        Correction for partial contact.

    Returns
    -------
    PerssonContact
    """
    p = np.asarray(pressure)
    points = p[..., None, None]
    rate = panels.psd * panels.k**3 * squared / (16.0 * math.pi)
    with np.errstate(over="ignore", divide="ignore"):  # under very small pressures
        area = _area_of(panels.running(rate) / points / points)
        end_area = _area_of(np.sum(panels.parts(rate), axis=-1) / p / p)
    reduced = gamma + (1.0 - gamma) * area**2
    # (1/2) int q^3 C S P int_0^2pi cos(phi) Im E* dphi/p, with C = Phi/(4 pi^2)
    integrand = panels.psd * panels.k**3 * reduced * area * loss / (4.0 * math.pi * points)
    running = panels.running(integrand)
    friction = np.asarray(np.sum(panels.parts(integrand), axis=-1))
    lead = area.shape[:-2]
    return PerssonContact(
        np.append(panels.k.ravel(), panels.end),
        np.concatenate([area.reshape(*lead, -1), end_area[..., None]], axis=-1),
        np.concatenate([running.reshape(*lead, -1), friction[..., None]], axis=-1),
        end_area,
        friction,
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
    panels, to a relative accuracy of about 1e-9, or 1e-7 where the spectrum is very steep.

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
    >>> from asperity.theory import persson_area, self_affine_psd
    >>> k, phi = self_affine_psd(0.9, 2.5e-4, 2.5e-4, 7.8e-6, rms_slope=0.02)
    >>> at_rest = persson(k, phi, Prony(1e6, [1e7], [1e-4]), 1e4, 0.0)
    >>> abs(at_rest.contact_area - persson_area(1e4, 4e6, 0.02)) < 1e-12
    np.True_
    """
    panels = panels_of(wavenumber, psd)
    instance("material", material, Prony)
    p = array_of("pressure", pressure, low=0.0, low_open=True)
    v = array_of("velocity", velocity, low=0.0)
    for name, values in (("pressure", p), ("velocity", v)):
        if not values.size:
            raise ValueError(f"{name}: has no value, must have at least one")
    p, v = np.broadcast_arrays(p, v)
    nu = poisson_ratio(poisson)
    weight = number("gamma", gamma, 0.0, 1.0)
    squared, loss = steady_means(material, panels.k[..., None] * v[..., None, None, None]
                                 * material.tau)
    factor = 2.0 / (1.0 - nu)
    return contact_of(panels, factor**2 * squared, factor * loss, p, weight)
