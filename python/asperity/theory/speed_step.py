"""Persson's theory of rubber on a randomly rough road after a sudden change of the sliding speed.

After the change, each arm of the rubber goes from its old steady stress to the new one, and this
fading part of the stress turns with the wave: it contains exp(i q V t cos phi). Its angular means
are those of u = cos phi from 0 to 1 with the weight 1/sqrt(1 - u^2). If the phase q V t is large,
the path from 0 to 1 is replaced by two paths into the upper half of the complex plane, on which the
exponential decays: a ray from 0 at 45 degrees, and a line that comes back to 1. No pole of the
moduli, which lie on the imaginary axis, is between the old path and the new ones. The line
contributes the part that oscillates with q, the ray the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from ..base.check import array_of, instance, number, poisson_ratio, positive
from ..rubber.material import Prony
from .log_panels import Panels, panels_of
from .sliding_rough import PerssonContact, contact_of, steady_means

__all__ = ["persson_speed_step"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

_NOTHING = 1e-18         # share of a fading modulus that no longer counts
_RESOLVED = 0.2          # rad of the phase per point of an angular integral
_AT_ONCE = 500           # wave numbers
_STEP = 0.1              # of the rule for integrals along a path
_TURN = complex(math.sqrt(0.5), math.sqrt(0.5))  # direction of the ray from 0


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
    angles: int = 160,
) -> PerssonContact:
    """Return contact area and viscoelastic friction after a sudden change of the sliding speed.

    This is the theory of `persson`, in which the ratio of stress to height of each wave in full
    contact replaces E*(w). This ratio has a closed form: after the change each arm goes from its
    old steady value to the new one as exp(-t/tau), while its phase rotates with the wave. The
    direction of sliding does not change. The relative accuracy is about 1e-5 in the area and, where
    it exceeds 1e-5, about 1e-4 in the friction: of waves that have turned by thousands of radians,
    whose contributions to the integral over the wave number cancel, only the mean is used.

    Parameters
    ----------
    wavenumber, psd, material, pressure, poisson, gamma
        As in `persson`; `pressure` is a single number.
    velocity_before, velocity_after : float
        Speeds before and after t = 0, m/s, >= 0. With `velocity_before` = 0 the road rested for an
        infinite time.
    times : array_like, shape (n,)
        Times since the change, s, >= 0.
    angles : int
        Number of points of the angular integrals over a quarter turn, at least 8. They resolve
        waves that have turned by up to a fifth of this number, rad, since the change. The integrals
        of the others are computed along paths in the complex plane on which they do not oscillate.

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
    >>> from asperity.theory import persson, self_affine_psd
    >>> k, phi = self_affine_psd(0.9, 2.5e-4, 2.5e-4, 7.8e-6, rms_slope=0.02)
    >>> rubber = Prony(1e6, [1e7], [1e-4])
    >>> moved = persson_speed_step(k, phi, rubber, 1e5, 0.01, 3.0, [0.0, 1e-2])
    >>> steady = [persson(k, phi, rubber, 1e5, v).friction for v in (0.01, 3.0)]
    >>> bool(np.allclose(moved.friction, steady, rtol=1e-4))
    True
    """
    panels = panels_of(wavenumber, psd)
    instance("material", material, Prony)
    p = positive("pressure", pressure)
    change = _Change(material, number("velocity_before", velocity_before, 0.0),
                     number("velocity_after", velocity_after, 0.0))
    t = array_of("times", np.atleast_1d(np.asarray(times)), low=0.0, ndim=1)
    if not t.size:
        raise ValueError("times: has no value, must have at least one")
    factor = 2.0 / (1.0 - poisson_ratio(poisson))
    weight = number("gamma", gamma, 0.0, 1.0)
    points = int(number("angles", angles, 8))
    found = []
    for now in map(float, t):
        fine, resolved = panels, np.ones(panels.half.size, dtype=bool)
        if change.lasts(now):
            fine, resolved = panels.resolving(change.after * now)
        squared, loss = change.means(fine, resolved, now, points)
        found.append(_at(panels, contact_of(fine, factor**2 * squared, factor * loss, p, weight)))
    over_time = {name: np.array([getattr(one, name) for one in found])
                 for name in ("area", "friction_up_to", "contact_area", "friction")}
    return PerssonContact(found[0].wavenumber, **over_time)


def _at(panels: Panels, contact: PerssonContact) -> PerssonContact:
    """Return a contact at the wave numbers of other panels."""
    wanted = np.append(panels.k.ravel(), panels.end)
    if wanted.size == contact.wavenumber.size:
        return contact
    # The first panels are so short that their points may be equal.
    known, kept = np.unique(np.log(contact.wavenumber), return_index=True)
    area, friction = (PchipInterpolator(known, values[kept])(np.log(wanted))
                      for values in (contact.area, contact.friction_up_to))
    return PerssonContact(wanted, area, friction, contact.contact_area, contact.friction)


@dataclass(frozen=True)
class _Change:
    """A change of the speed.

    Attributes
    ----------
    material : Prony
        Shear relaxation modulus.
    before, after : float
        Speeds, m/s.
    """

    material: Prony
    before: float
    after: float

    def lasts(self, t: float) -> bool:
        """Return whether something of the old stress is left at a time, s."""
        left = self.material.g * np.exp(-t / self.material.tau)
        return bool(np.any(left > _NOTHING * self.material.instantaneous_modulus))

    def means(self, panels: Panels, resolved: NDArray[np.bool_], t: float, angles: int
              ) -> tuple[FloatArray, FloatArray]:
        """Return the means of |M|^2 and -cos(phi) Im M over phi at the points of panels.

        M = M_s + f is the apparent modulus with a steady part M_s, whose means have a closed form,
        and a fading part f: |M|^2 = |M_s|^2 + 2 Re(f conj(M_s)) + |f|^2.

        Parameters
        ----------
        panels : Panels
            The spectrum.
        resolved : ndarray of bool, shape (panels,)
            Whether the phase changes little in a panel. In the others the parts that oscillate with
            the wave number, and cancel, are left out.
        t : float
            Time, s.
        angles : int
            Number of points of the angular integrals.

        Returns
        -------
        squared, loss : ndarray, shape (panels, points)
            Pa^2 and Pa.
        """
        squared, loss = steady_means(self.material,
                                     panels.k[..., None] * self.after * self.material.tau)
        if not self.lasts(t):
            return squared, loss
        k = panels.k.ravel()
        keep = np.repeat(resolved, panels.k.shape[1])
        more = np.concatenate([self._fading_means(part, kept, t, angles) for part, kept in zip(
            np.split(k, range(_AT_ONCE, k.size, _AT_ONCE)),
            np.split(keep, range(_AT_ONCE, k.size, _AT_ONCE)), strict=True)], axis=1)
        return squared + more[0].reshape(squared.shape), loss - more[1].reshape(loss.shape)

    def _fading_means(self, k: FloatArray, keep: NDArray[np.bool_], t: float, angles: int
                      ) -> FloatArray:
        """Return the means of |M|^2 - |M_s|^2 and of cos(phi) Im f, shape (2, wave numbers)."""
        cosine, weights = _quarter(angles)
        phase = k * self.after * t
        slow = phase <= _RESOLVED * angles
        fading, steady = self._moduli(k, cosine.astype(complex), t)
        found = np.array([np.abs(fading) ** 2 @ weights, np.zeros(k.size)])
        turned = fading[slow] * np.exp(1j * phase[slow, None] * cosine)
        found[0, slow] += (2.0 * np.real(turned * steady[slow])) @ weights
        found[1, slow] = (cosine * turned.imag) @ weights
        if not slow.all():
            found[:, ~slow] += self._turned_means(k[~slow], phase[~slow], keep[~slow], t)
        return found

    def _turned_means(self, k: FloatArray, phase: FloatArray, keep: NDArray[np.bool_], t: float
                      ) -> FloatArray:
        """Return the means of 2 Re(f conj(M_s)) and cos(phi) Im f of waves of large phases."""
        x = np.arange(-3.4, 4.3, _STEP)
        distance = np.exp(x - np.exp(-x))  # times the phase; dense at the start of a path
        weights = _STEP * distance * (1.0 + np.exp(-x)) * (2.0 / math.pi)
        s = distance / phase[:, None]
        weights = weights / phase[:, None]

        ray = _TURN * s
        decay = weights * _TURN * np.exp(1j * phase[:, None] * ray) / np.sqrt(1.0 - ray * ray)
        found = self._sums(k, ray, decay, t)
        line = 1.0 + 1j * s[keep]
        # 1 - u^2 in the form without cancellation.
        root = np.sqrt(s[keep] * (s[keep] - 2j))
        decay = weights[keep] * -1j * np.exp(1j * phase[keep, None] * line) / root
        found[:, keep] += self._sums(k[keep], line, decay, t)
        return found

    def _sums(self, k: FloatArray, u: ComplexArray, weights: ComplexArray, t: float) -> FloatArray:
        """Return 2 Re and Im of the integrals of f conj(M_s) and u f along a path."""
        fading, steady = self._moduli(k, u, t)
        return np.array([2.0 * np.sum(weights * fading * steady, axis=1).real,
                         np.sum(weights * fading * u, axis=1).imag])

    def _moduli(self, k: FloatArray, u: ComplexArray, t: float
                ) -> tuple[ComplexArray, ComplexArray]:
        """Return f exp(-i q V t u), and conj(M_s) continued from real to complex u.

        Both have the shape (wave numbers, points of u).
        """
        q = k[:, None] * u
        steady = np.full(q.shape, self.material.g_inf, dtype=complex)
        fading = np.zeros(q.shape, dtype=complex)
        for g, tau in zip(self.material.g, self.material.tau, strict=True):
            turn = 1j * q * self.after * tau
            steady += g * turn / (1.0 + turn)
            left = g * math.exp(-t / tau)
            if left > 0.0:
                old = 1j * q * self.before * tau
                fading += left * (turn / (1.0 - turn) - old / (1.0 - old))
        return fading, steady


def _quarter(count: int) -> tuple[FloatArray, FloatArray]:
    """Return cos(phi) at about `count` points of a quarter turn, and weights with the sum 1.

    With phi = pi/2 - psi and psi = (pi/2) z^3 the points are dense near psi = 0, where the response
    of slow arms changes quickly. They are Gauss points of panels, because a Gauss rule of many
    hundred points takes long to compute.
    """
    panels = math.ceil(count / 16)
    few, weights = np.polynomial.legendre.leggauss(16)
    z = 0.5 * (((2.0 * np.arange(panels)[:, None] + 1.0 + few) / panels).ravel())
    return np.sin(0.5 * math.pi * z**3), 1.5 * z**2 * np.tile(weights / panels, panels)
