"""Smooth viscoelastic contact: Lee and Radok's sphere, Hunter's sliding cylinder."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import ive, kve

from ..base.check import array_of, instance, number, poisson_ratio, positive, positives
from ..rubber.material import Prony

FloatArray = NDArray[np.float64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_MANY_NODES, _MANY_WEIGHTS = np.polynomial.legendre.leggauss(96)


def _graded(length: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Gauss points of [0, length] that are dense near both ends.

    Two arrays contain the distances from either end, without cancellation; the third has the
    weights.
    """
    edges = np.concatenate([[0.0], 0.5 * length * 0.5 ** np.arange(56.0, -1.0, -1.0)])
    half = 0.5 * np.diff(edges)
    near = (0.5 * (edges[1:] + edges[:-1])[:, None] + half[:, None] * _NODES).ravel()
    weights = (half[:, None] * _WEIGHTS).ravel()
    return (
        np.concatenate([near, length - near]),
        np.concatenate([length - near, near]),
        np.concatenate([weights, weights]),
    )


@dataclass(frozen=True)
class LeeRadokContact:
    """A rigid sphere that is pressed onto a viscoelastic half-space; its contact never shrinks.

    Attributes
    ----------
    radius : float
        Radius of the sphere, m.
    material : Prony
        Shear relaxation modulus.
    poisson : float
        Poisson ratio.
    times : ndarray, shape (n,)
        Times, s.
    force, contact_radius, approach : ndarray, shape (n,)
        Normal force (N), contact radius (m), approach (m) at the times.
    """

    radius: float
    material: Prony
    poisson: float
    times: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    approach: FloatArray
    _radius_at: Callable[[FloatArray], FloatArray] = field(repr=False)

    def pressure(self, r: ArrayLike, t: float) -> FloatArray:
        """Return the pressure p(r, t) at one time t, which is at most the last of `times`.

        p = 4/(pi R (1 - nu)) int G(t - s) d/ds sqrt(a(s)^2 - r^2) ds is computed by Gauss
        quadrature, to 1e-9 of the peak.

        Parameters
        ----------
        r : array_like
            Distances from the axis, m, >= 0, any shape.
        t : float
            Time, s, from 0 to the last of `times`.

        Returns
        -------
        ndarray
            Pa, shape of `r`.

        Raises
        ------
        ValueError
            If a distance is negative or the time out of range.
        """
        distance = array_of("r", r, low=0.0)
        time = number("t", t, 0.0, float(self.times[-1]))
        a_now = float(self._radius_at(np.array([time]))[0])
        a_first = float(self._radius_at(np.array([0.0]))[0])
        g, tau = self.material.g, self.material.tau
        result = np.zeros(distance.shape)
        for index, x in np.ndenumerate(distance):
            if x >= a_now:
                continue
            begin = 0.0
            if x > a_first:
                begin = brentq(
                    lambda s, x=x: float(self._radius_at(np.array([s]))[0]) - x,
                    0.0, time, xtol=1e-300, rtol=1e-15,
                )
            since, lag, weight = _graded(time - begin)
            reach = np.sqrt(np.clip(self._radius_at(begin + since) ** 2 - x * x, 0.0, None))
            kernel = np.sum(g / tau * np.exp(-lag[:, None] / tau), axis=1)
            now = math.sqrt((a_now - x) * (a_now + x))
            held = self.material.instantaneous_modulus * now
            result[index] = held - float(np.sum(weight * kernel * reach))
        return 4.0 / (math.pi * self.radius * (1.0 - self.poisson)) * result


def _force_history(
    force: float | ArrayLike | Callable[[FloatArray], ArrayLike], times: FloatArray
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray | None]:
    """Return the function F(t) and, if it is piecewise linear, its values at `times`."""
    if callable(force):
        function = force

        def called(t: FloatArray) -> FloatArray:
            values = array_of("force", function(t))
            if values.shape != t.shape:
                raise ValueError(
                    f"force: returned shape {values.shape} for times of shape {t.shape}:"
                    " must be the same"
                )
            if (values < 0.0).any():
                at = int(np.argmax(values.ravel() < 0.0))
                raise ValueError(f"force: is {values.ravel()[at]:.6g} N at {t.ravel()[at]:.6g} s:"
                                 " must be >= 0")
            return values

        return called, None
    values = array_of("force", force, low=0.0)
    if values.ndim == 0:
        values = np.full(times.shape, float(values))
    if values.shape != times.shape:
        raise ValueError(f"force: has shape {values.shape}, must have {times.shape} or ()")
    return (lambda t: np.interp(t, times, values)), values


def lee_radok(
    radius: float,
    force: float | ArrayLike | Callable[[FloatArray], ArrayLike],
    material: Prony,
    times: ArrayLike,
    *,
    poisson: float = 0.5,
) -> LeeRadokContact:
    """Return the viscoelastic contact of a rigid sphere while its contact does not shrink.

    a^3 = (3/8) (1 - nu) R int J(t - s) dF(s), approach = a^2/R.

    Parameters
    ----------
    radius : float
        Radius of the sphere, m, > 0.
    force : float, array_like of shape (n,), or callable
        Normal force from t = 0 on, N, >= 0. A number is a constant force. An array has the values
        at `times`, with a jump to the first at times[0] = 0 and straight lines between them. Both
        are exact. A function takes an array of times; it should be smooth, and the solution is then
        accurate to about 1e-12 (Gauss quadrature).
    material : Prony
        The material, with any number of arms.
    times : array_like, shape (n,)
        Times, s, >= 0, ascending.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    LeeRadokContact

    Raises
    ------
    ValueError
        If a value is out of range, or if the contact would shrink (for which T. C. T. Ting, J.
        Appl. Mech. 33 (1966) 845, has another solution).

    References
    ----------
    E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438.

    Examples
    --------
    >>> solid = Prony.from_zener(0.0, [1e6], [1e5], [1e5])
    >>> contact = lee_radok(1e-3, 2e-5, solid, [0.0, 1.0, 1e3])
    >>> [round(a * 1e3, 6) for a in contact.contact_radius.tolist()]
    [0.015536, 0.030167, 0.034552]
    """
    r, nu = positive("radius", radius), poisson_ratio(poisson)
    t = array_of("times", np.atleast_1d(np.asarray(times)), low=0.0, ndim=1, increasing=True)
    if t.size == 0:
        raise ValueError("times: has no value, must have at least one")
    load, knots = _force_history(force, t)
    if not callable(force) and np.ndim(force) == 1 and t[0] != 0.0:
        raise ValueError(f"times[0] = {float(t[0])!r}: must be 0 where force is an array")
    instance("material", material, Prony)
    theta, compliance = material.retardation_times, material.retardation_compliances
    glassy, fluidity = 1.0 / material.instantaneous_modulus, material.fluidity

    def creep_integral(s: FloatArray) -> FloatArray:
        x = np.clip(s, 0.0, None)[..., None]
        creep = np.sum(compliance * (x + theta * np.expm1(-x / theta)), axis=-1)
        return glassy * x[..., 0] + creep + 0.5 * fluidity * x[..., 0] ** 2

    def convolved(s: FloatArray) -> FloatArray:
        if knots is not None:
            total = knots[0] * material.creep_compliance(s)
            for i in np.flatnonzero(np.diff(knots)):
                slope = (knots[i + 1] - knots[i]) / (t[i + 1] - t[i])
                total = total + slope * (creep_integral(s - t[i]) - creep_integral(s - t[i + 1]))
            return total
        total = np.empty(s.shape)
        for index, end in np.ndenumerate(s):
            since, lag, weight = _graded(float(end))
            rate = fluidity + np.sum(compliance / theta * np.exp(-lag[:, None] / theta), axis=1)
            history = load(np.append(since, end))
            total[index] = glassy * history[-1] + np.sum(weight * rate * history[:-1])
        return total

    def radius_at(s: FloatArray) -> FloatArray:
        return np.cbrt(0.375 * (1.0 - nu) * r * convolved(s))

    a = radius_at(t)
    if knots is None or np.any(np.diff(knots) < 0.0):
        _refuse_shrinking(t, radius_at)
    return LeeRadokContact(r, material, nu, t, load(t), a, a * a / r, radius_at)


def _refuse_shrinking(t: FloatArray, radius_at: Callable[[FloatArray], FloatArray]) -> None:
    """Raise ValueError if the contact radius falls at the given times or between them."""
    start = np.append(0.0, t) if t[0] > 0.0 else t
    parts = np.concatenate([10.0 ** np.arange(-8.0, -1.0), np.arange(1, 16) / 16.0])
    inner = start[:-1, None] + np.diff(start)[:, None] * parts
    times = np.unique(np.concatenate([start, inner.ravel()]))
    a = radius_at(times)
    fall = np.flatnonzero(np.diff(a) < -1e-10 * a[:-1])
    if fall.size:
        i = int(fall[0])
        raise ValueError(
            f"force: the contact radius of {a[i]:.6g} m falls by {a[i] - a[i + 1]:.2g} m between"
            f" {times[i]:.6g} and {times[i + 1]:.6g} s: must not fall"
        )


@dataclass(frozen=True)
class HunterContact:
    """A rigid cylinder that slides or rolls steadily over a viscoelastic solid, without friction.

    The cylinder moves along +x over the solid, and x is measured from its axis.

    Attributes
    ----------
    radius : float
        Radius of the cylinder, m.
    velocity : float
        Speed, m/s.
    load : float
        Normal force per length, N/m.
    half_width : float
        Half the width of the contact, m.
    centre : float
        Middle of the contact, m, which is ahead of the axis: > 0.
    leading_edge, trailing_edge : float
        Ends of the contact, m.
    friction : float
        Viscoelastic friction coefficient.
    friction_force : float
        Friction coefficient times load, N/m.
    """

    radius: float
    velocity: float
    load: float
    half_width: float
    centre: float
    leading_edge: float
    trailing_edge: float
    friction: float
    friction_force: float
    _length: float = field(repr=False)
    _coefficients: tuple[float, float, float] = field(repr=False)

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Return p(x), Pa, at positions x (m); 0 outside the contact.

        p = (1/l) int_x^end exp((x - s)/l) P(s) ds, with l = V tau and the closed form of
        P = p - l dp/dx, is computed by Gauss quadrature, to about 1e-12 of the peak.

        Parameters
        ----------
        x : array_like
            Positions, m, any shape.

        Returns
        -------
        ndarray
            Pa, shape of `x`.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        position = array_of("x", x)
        xi = (position - self.centre) / self.half_width
        inside = np.abs(xi) < 1.0
        alpha = self.half_width / self._length
        end = np.arccos(np.where(inside, xi, 1.0))
        # parts of the integrand below exp(-40) are negligible
        start = np.arccos(np.clip(np.cos(end) + 40.0 / alpha, -1.0, 1.0))
        half = 0.5 * (end - start)
        phi = (start + half)[..., None] + half[..., None] * _MANY_NODES
        fading = np.exp(
            -2.0 * alpha * np.sin(0.5 * (end[..., None] + phi))
            * np.sin(0.5 * (end[..., None] - phi))
        )
        c0, c1, c2 = self._coefficients
        value = (c0 + c1 * np.cos(phi) + c2 * np.cos(2.0 * phi)) * fading
        return np.where(inside, alpha * half * (value @ _MANY_WEIGHTS), 0.0)

    def total_friction_force(self, coefficient: float, *, slope_effect: bool = True) -> float:
        """Return the horizontal force per length with Coulomb friction in full sliding, N/m.

        With the slope effect the local traction is on the friction cone around the normal of the
        surface, T = P (mu - H')/(1 + mu H') with H' = -x/R. Without it, T = mu P is added to the
        viscoelastic force. Both hold for nu = 1/2, for which tangential and normal displacements
        are not coupled (thesis, section 3.5.1).

        Parameters
        ----------
        coefficient : float
            Local coefficient of friction mu, >= 0, with mu times the slope below 1.
        slope_effect : bool
            Whether the friction cone turns with the slope of the surface.

        Returns
        -------
        float
            Horizontal force per length, N/m.

        Raises
        ------
        ValueError
            If mu is out of range.
        """
        mu = number("coefficient", coefficient, 0.0)
        if not slope_effect:
            return mu * self.load + self.friction_force
        number("coefficient", mu, 0.0, self.radius / self.leading_edge, high_open=True)
        nodes, weights = np.polynomial.legendre.leggauss(200)
        angle = 0.5 * math.pi * (nodes + 1.0)
        x = self.centre + self.half_width * np.cos(angle)
        width = 0.5 * math.pi * self.half_width * np.sin(angle) * weights
        slope = -x / self.radius
        return float(np.sum(width * self.pressure(x) * (mu - slope) / (1.0 + mu * slope)))


def _scaled_bessel(x: float) -> tuple[FloatArray, FloatArray]:
    """Return exp(-x) I_n(x) and exp(x) K_n(x), n = 0, 1, 2.

    Beyond 1e6 the first three terms of the asymptotic series are used, because SciPy's functions
    fail at about 1e9.
    """
    order = np.arange(3)
    if x < 1e6:
        return ive(order, x), kve(order, x)
    correction = (4.0 * order**2 - 1.0) / (8.0 * x)
    second = 0.5 * correction * (4.0 * order**2 - 9.0) / (8.0 * x)
    return (
        (1.0 - correction + second) / math.sqrt(2.0 * math.pi * x),
        (1.0 + correction + second) * math.sqrt(0.5 * math.pi / x),
    )


def hunter(
    radius: float,
    load: float,
    velocity: float,
    material: Prony,
    *,
    poisson: float = 0.5,
) -> HunterContact:
    """Return Hunter's exact solution for a rigid cylinder in steady motion on a standard solid.

    The solid has one arm. With l_r = V tau (relaxation), l_c = l_r G(0)/G_e (creep), alpha = h/l_r,
    beta = h/l_c, the modified Bessel functions I_n(alpha), K_n(beta), and D = I0 K1 + I1 K0 ::

        load = pi G_e h^2/(2 R (1 - nu)) (I2 K1 + I1 K2)/D
        centre = (l_c - l_r) I1 K0/D
        R friction = [centre (rho - 1) + (l_c - l_r) (I2 K1 + I1 K0)/D]/rho,
        rho = (I2 K1 + I1 K2)/D

    Derivation: the operator 1 - l_c d/dx removes the exponential wake from the elastic relation.
    The result is a Cauchy equation on the contact for P = p - l_r dp/dx, with the solution (c0 + c1
    T1 + c2 T2)/sqrt(1 - xi^2). The load determines c0, and the shape of the cylinder c1 and c2. The
    end of the contact (p = 0) and the undisturbed solid ahead give one equation with Bessel
    functions each.

    Parameters
    ----------
    radius : float
        Radius of the cylinder (parabola), m, > 0.
    load : float
        Normal force per length, N/m, > 0.
    velocity : float
        Speed, m/s, > 0.
    material : Prony
        A material with one arm and g_inf > 0.
    poisson : float
        Poisson ratio, constant in time.

    Returns
    -------
    HunterContact

    Raises
    ------
    ValueError
        If a value is out of range or the material has not exactly one arm.

    References
    ----------
    S. C. Hunter, J. Appl. Mech. 28 (1961) 611.

    Examples
    --------
    >>> solid = Prony.from_zener(0.0, [2.75e6], [2.75e6 / 9], [2.75e6 / 9 * 0.01])
    >>> round(hunter(10e-3, 50.0, 0.02, solid).friction, 7)
    0.0154267
    """
    r, w, v = positives(radius=radius, load=load, velocity=velocity)
    nu = poisson_ratio(poisson)
    arms = instance("material", material, Prony).g > 0.0
    if int(arms.sum()) != 1:
        raise ValueError(f"material: has {int(arms.sum())} arms with g > 0, must have one")
    relaxed = positive("material g_inf", material.g_inf)
    ratio = material.instantaneous_modulus / relaxed
    l_r = v * float(material.tau[arms][0])
    l_c = l_r * ratio
    stiffness = math.pi * relaxed / (2.0 * r * (1.0 - nu))

    def bessel(h: float) -> tuple[FloatArray, FloatArray, float, float]:
        i, k = _scaled_bessel(h / l_r)[0], _scaled_bessel(h / l_c)[1]
        d = i[0] * k[1] + i[1] * k[0]
        return i, k, d, (i[2] * k[1] + i[1] * k[2]) / d

    # rho is between 1 (slow) and G(0)/G_e (fast)
    relaxed_width = math.sqrt(w / stiffness)

    def excess(h: float) -> float:
        return stiffness * h * h * bessel(h)[3] / w - 1.0

    low, high = 0.5 * relaxed_width / math.sqrt(ratio), 2.0 * relaxed_width
    h = float(brentq(excess, low, high, xtol=1e-300, rtol=1e-15))
    i, k, d, rho = bessel(h)
    centre = (l_c - l_r) * i[1] * k[0] / d
    skew = (l_c - l_r) * (i[2] * k[1] + i[1] * k[0]) / d
    friction = float((centre * (rho - 1.0) + skew) / rho / r)
    c2 = -relaxed * h / (2.0 * r * (1.0 - nu))
    c0 = w / (math.pi * h)
    c1 = -(c0 * k[0] + c2 * k[2]) / k[1]
    return HunterContact(
        r, v, w, h, float(centre), float(centre + h), float(centre - h),
        friction, friction * w, l_r, (c0, float(c1), c2),
    )
