"""Adhesive contact of a sphere: JKR, DMT and Maugis-Dugdale.

A rigid sphere of radius R is in contact with an elastic half-space of modulus E* = 2 G/(1 - nu).
The work of adhesion is w, and K = 4 E*/3. Forces and pressures are positive in compression.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar

from ..base.check import array_of, exactly_one, number, positive, positives
from .hertzian import _dome, hertz_displacement

FloatArray = NDArray[np.float64]

#: lambda over Tabor's parameter if the Dugdale stress is the peak stress of the Lennard-Jones law,
#: 16 w/(9 sqrt(3) z0): 1.1570 (Maugis 1992; Johnson and Greenwood 1997).
LENNARD_JONES_FACTOR = 2.0 * 16.0 / (9.0 * math.sqrt(3.0)) * (9.0 / (16.0 * math.pi)) ** (1 / 3)


def tabor_parameter(radius: float, modulus: float, energy: float, length: float) -> float:
    """Return Tabor's parameter (R w^2/(E*^2 z0^3))^(1/3) (thesis, eq. 1.2).

    Parameters
    ----------
    radius : float
        R, m, > 0.
    modulus : float
        E*, Pa, > 0.
    energy : float
        Work of adhesion w, J/m2, > 0.
    length : float
        Range z0 of the adhesive stress, m, > 0.

    Returns
    -------
    float
        Tabor's parameter, dimensionless. JKR holds above about 5, DMT below about 0.1.

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    D. Tabor, J. Colloid Interface Sci. 58 (1977) 2.

    Examples
    --------
    >>> round(tabor_parameter(1.0, 1.0, 1.0, 0.5), 12)
    2.0
    """
    r, e, w, z = positives(radius=radius, modulus=modulus, energy=energy, length=length)
    return (r * w**2 / e**2) ** (1.0 / 3.0) / z


@dataclass(frozen=True)
class AdhesiveContact:
    """Adhesive contact of a rigid sphere with an elastic half-space.

    Attributes
    ----------
    radius : float
        Radius of the sphere, m.
    modulus : float
        E*, Pa.
    energy : float
        Work of adhesion, J/m2.
    force : float
        Normal force, N, negative in tension.
    contact_radius : float
        Radius of the contact with zero gap, m.
    approach : float
        Distance by which the sphere has moved down from first touch, m; may be negative.
    pull_off_force : float
        Smallest (most negative) force of the curve, N: pull-off under a dead load.
    adhesion_radius : float
        Outer radius of the adhesive stress, m; the contact radius for JKR, infinite for DMT.
    adhesive_stress : float
        Stress outside the contact (Maugis), Pa; 0 otherwise.
    maugis_parameter : float
        lambda; infinite for JKR, 0 for DMT.
    """

    radius: float
    modulus: float
    energy: float
    force: float
    contact_radius: float
    approach: float
    pull_off_force: float
    adhesion_radius: float
    adhesive_stress: float
    maugis_parameter: float

    def pressure(self, r: ArrayLike) -> FloatArray:
        """Return the normal stress, which is positive in compression.

        With JKR it tends to minus infinity at the edge. With DMT the stress outside the contact is
        not resolved and 0.

        Parameters
        ----------
        r : array_like
            Distances from the axis, m, >= 0, any shape.

        Returns
        -------
        ndarray
            Pa, shape of `r`.

        Raises
        ------
        ValueError
            If a distance is negative or not a finite number.
        """
        distance = array_of("r", r, low=0.0)
        a, e = self.contact_radius, self.modulus
        inside = distance < a
        base = 2.0 * e * a / (math.pi * self.radius) * _dome(distance, a)
        if math.isinf(self.maugis_parameter):
            with np.errstate(divide="ignore"):
                punch = math.sqrt(2.0 * self.energy * e / (math.pi * a)) / _dome(distance, a)
            return np.where(distance <= a, base - np.where(distance <= a, punch, 0.0), 0.0)
        if self.maugis_parameter == 0.0:
            return base
        c = self.adhesion_radius
        room = np.where(inside, (a - distance) * (a + distance), 1.0)
        angle = np.arctan(np.sqrt((c - a) * (c + a) / room))
        core = base - 2.0 * self.adhesive_stress / math.pi * angle
        return np.where(inside, core, np.where(distance <= c, -self.adhesive_stress, 0.0))

    def displacement(self, r: ArrayLike) -> FloatArray:
        """Return the normal displacement u_z(r), positive into the half-space (JKR and DMT only).

        Parameters
        ----------
        r : array_like
            Distances from the axis, m, >= 0, any shape.

        Returns
        -------
        ndarray
            Displacement, m, shape of `r`.

        Raises
        ------
        ValueError
            For a Maugis contact, whose displacement has no closed form, or if a distance is
            negative or not a finite number.
        """
        if 0.0 < self.maugis_parameter < math.inf:
            raise ValueError("displacement: known for JKR and DMT only")
        distance = array_of("r", r, low=0.0)
        a = self.contact_radius
        hertzian = hertz_displacement(distance, a, self.radius)
        sunk = a * a / self.radius - self.approach
        ratio = a / np.maximum(distance, a) if a > 0.0 else np.zeros_like(distance)
        return hertzian - sunk * 2.0 / math.pi * np.arcsin(ratio)


def jkr(
    radius: float,
    modulus: float,
    energy: float,
    *,
    force: float | None = None,
    contact_radius: float | None = None,
) -> AdhesiveContact:
    """Return the contact of Johnson, Kendall and Roberts: short-range adhesion, soft solids.

    F = K a^3/R - sqrt(6 pi w K a^3), approach = a^2/R - sqrt(2 pi w a/E*).

    Parameters
    ----------
    radius, modulus, energy : float
        R (m), E* (Pa) and work of adhesion w (J/m2), > 0.
    force, contact_radius : float
        Give exactly one: the force (N, >= -3 pi w R/2), for which the stable contact is returned,
        or the contact radius (m, > 0), which may be that of any state of the curve, stable or not.

    Returns
    -------
    AdhesiveContact

    Raises
    ------
    ValueError
        If a value is out of range, or the force is beyond pull-off.

    References
    ----------
    K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301.

    Examples
    --------
    >>> import math
    >>> r, e, w = 1e-3, 1e6, 0.05
    >>> unit = (math.pi * w * r**2 / (4 * e / 3)) ** (1 / 3)
    >>> round(jkr(r, e, w, force=0.0).contact_radius / unit, 6)
    1.817121
    """
    r, e, w = positives(radius=radius, modulus=modulus, energy=energy)
    k = 4.0 * e / 3.0
    pull_off = -1.5 * math.pi * w * r
    name, given = exactly_one(force=force, contact_radius=contact_radius)
    if name == "force":
        f = number("force", given, pull_off)
        # F = x^2 - 2 b x with x^2 = K a^3/R, b^2 = 3 pi w R/2: x = b + sqrt(b^2 + F)
        root = math.sqrt(-pull_off) + math.sqrt(f - pull_off)
        a = (r * root**2 / k) ** (1.0 / 3.0)
    else:
        a = positive("contact_radius", given)
        f = k * a**3 / r - math.sqrt(6.0 * math.pi * w * k * a**3)
    approach = a * a / r - math.sqrt(2.0 * math.pi * w * a / e)
    return AdhesiveContact(r, e, w, f, a, approach, pull_off, a, 0.0, math.inf)


def dmt(
    radius: float,
    modulus: float,
    energy: float,
    *,
    force: float | None = None,
    contact_radius: float | None = None,
) -> AdhesiveContact:
    """Return the contact of Derjaguin, Muller and Toporov: long-range adhesion, hard solids.

    This is Hertz's contact under the force F + 2 pi w R (in the form of Maugis).

    Parameters
    ----------
    radius, modulus, energy : float
        R (m), E* (Pa) and work of adhesion w (J/m2), > 0.
    force, contact_radius : float
        Give exactly one: the force (N, >= -2 pi w R) or the contact radius (m, >= 0).

    Returns
    -------
    AdhesiveContact

    Raises
    ------
    ValueError
        If a value is out of range, or the force is beyond pull-off.

    References
    ----------
    B. V. Derjaguin, V. M. Muller, Y. P. Toporov, J. Colloid Interface Sci. 53 (1975) 314.

    Examples
    --------
    >>> import math
    >>> contact = dmt(1e-3, 1e6, 0.05, force=-2 * math.pi * 0.05e-3)
    >>> contact.contact_radius
    0.0
    """
    r, e, w = positives(radius=radius, modulus=modulus, energy=energy)
    pull_off = -2.0 * math.pi * w * r
    name, given = exactly_one(force=force, contact_radius=contact_radius)
    if name == "force":
        f = number("force", given, pull_off)
        a = (0.75 * r * (f - pull_off) / e) ** (1.0 / 3.0)
    else:
        a = number("contact_radius", given, 0.0)
        f = 4.0 * e * a**3 / (3.0 * r) + pull_off
    return AdhesiveContact(r, e, w, f, a, a * a / r, pull_off, math.inf, 0.0, 0.0)


def _maugis_state(y: float, lam: float) -> tuple[float, float, float]:
    """Return Maugis's dimensionless a, F and approach for an adhesive ring with c/a = sec(theta).

    `y` = log(tan theta) is the parameter of the curve. The energy balance is quadratic in a, so
    that every state has one theta: a falls from infinity to 0 as theta goes from 0 to pi/2.
    """
    tangent = math.exp(y)
    theta = math.atan(tangent)
    if theta < 2e-2:
        t2 = theta * theta
        excess = theta * t2 * (1 / 3 + t2 * (2 / 15 + t2 * (17 / 315 + t2 * 62 / 2835)))
    else:
        excess = tangent - theta
    f1 = excess + theta * tangent**2
    secant = math.hypot(1.0, tangent)
    f2 = theta * tangent - tangent**2 / (1.0 + secant)
    p, q = 0.5 * lam * f1, 4.0 / 3.0 * lam**2 * f2
    # positive root of p a^2 + q a - 1 = 0
    a = 2.0 / (q + math.sqrt(q * q + 4.0 * p))
    force = a**3 - lam * a * a * (tangent + (1.0 + tangent**2) * theta)
    approach = a * a - 4.0 / 3.0 * lam * a * tangent
    return a, force, approach


def maugis(
    radius: float,
    modulus: float,
    energy: float,
    *,
    force: float | None = None,
    contact_radius: float | None = None,
    range: float | None = None,
    tabor: float | None = None,
    maugis_parameter: float | None = None,
) -> AdhesiveContact:
    """Return Maugis's contact with a constant adhesive stress (Dugdale), for any Tabor parameter.

    The stress sigma_0 acts where the gap is smaller than h_0. Then w = sigma_0 h_0 and
    lambda = 2 sigma_0 (9 R/(16 pi w E*^2))^(1/3).

    Parameters
    ----------
    radius, modulus, energy : float
        R (m), E* (Pa) and work of adhesion w (J/m2), > 0.
    force, contact_radius : float
        Give exactly one: the force (N), for which the stable contact is returned, or the contact
        radius (m, > 0).
    range, tabor, maugis_parameter : float
        Give exactly one, > 0: the range h_0 (m) of the potential 'maugis_dugdale'; Tabor's
        parameter of a Lennard-Jones law with the same peak stress, for which lambda = 1.157 tabor;
        or lambda.

    Returns
    -------
    AdhesiveContact

    Raises
    ------
    ValueError
        If a value is out of range, not exactly one value of each group is given, or the force is
        beyond pull-off.

    References
    ----------
    D. Maugis, J. Colloid Interface Sci. 150 (1992) 243.

    Examples
    --------
    >>> import math
    >>> contact = maugis(1.0, 0.75, 1 / math.pi, contact_radius=1.0, maugis_parameter=1.0)
    >>> round(contact.pull_off_force, 5)
    -1.60073
    """
    r, e, w = positives(radius=radius, modulus=modulus, energy=energy)
    kind, lam = exactly_one(range=range, tabor=tabor, maugis_parameter=maugis_parameter)
    lam = positive(kind, lam)
    per_stress = 2.0 * (9.0 * r / (16.0 * math.pi * w * e * e)) ** (1.0 / 3.0)
    if kind == "range":
        lam = per_stress * w / lam
    elif kind == "tabor":
        lam *= LENNARD_JONES_FACTOR
    stress = lam / per_stress
    k = 4.0 * e / 3.0
    unit_a = (math.pi * w * r * r / k) ** (1.0 / 3.0)
    unit_f = math.pi * w * r
    unit_d = unit_a * unit_a / r

    turn, least = _maugis_turn(lam)
    pull_off = least * unit_f
    name, given = exactly_one(force=force, contact_radius=contact_radius)
    if name == "force":
        f = number("force", given, pull_off * (1.0 + 1e-12))
        y = _maugis_of_force(max(f / unit_f, least), turn, lam)
    else:
        y = _maugis_of_radius(positive("contact_radius", given) / unit_a, turn, lam)
    a_bar, f_bar, d_bar = _maugis_state(y, lam)
    a = a_bar * unit_a
    return AdhesiveContact(
        r, e, w, f_bar * unit_f, a, d_bar * unit_d, pull_off,
        a * math.hypot(1.0, math.exp(y)), stress, lam,
    )


def _maugis_turn(lam: float) -> tuple[float, float]:
    """Return the parameter of the state with the smallest force, and this force over pi w R."""
    # The ring narrows like 1/lambda in the JKR limit and widens like lambda^(-1/2) in the DMT
    # limit.
    low, high = -math.log(1.0 + lam) - 25.0, 0.5 * math.log1p(1.0 / lam) + 25.0
    grid = np.linspace(low, high, 400)
    forces = [_maugis_state(y, lam)[1] for y in grid]
    i = int(np.argmin(forces))
    if not 0 < i < grid.size - 1:
        return float(grid[i]), float(forces[i])
    found = minimize_scalar(
        lambda y: _maugis_state(y, lam)[1],
        bounds=(grid[i - 1], grid[i + 1]),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return float(found.x), float(found.fun)


def _maugis_of_force(target: float, turn: float, lam: float) -> float:
    """Return the parameter of the stable state for a force, which is given over pi w R."""
    bottom = turn
    while _maugis_state(bottom, lam)[1] <= target:
        bottom -= 1.0
    return brentq(lambda y: _maugis_state(y, lam)[1] - target, bottom, turn, xtol=1e-14)


def _maugis_of_radius(target: float, turn: float, lam: float) -> float:
    """Return the parameter of the state for a contact radius, which is given over its unit."""
    bottom, top = turn, turn
    while _maugis_state(bottom, lam)[0] < target:
        bottom -= 1.0
    while _maugis_state(top, lam)[0] > target:
        top += 1.0
    if bottom == top:
        return bottom
    return brentq(lambda y: _maugis_state(y, lam)[0] - target, bottom, top, xtol=1e-14)
