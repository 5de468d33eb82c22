"""Elastic contact of smooth bodies: Hertz's sphere and line contact.

A rigid body is pressed onto an elastic half-space of modulus E* = E/(1 - nu^2) = 2 G/(1 - nu),
without friction. Displacements are positive into the half-space. Slopes are small, so that the
bodies are parabolic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of, exactly_one, number, positive, positives

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class HertzContact:
    """Contact of a rigid sphere with an elastic half-space.

    Attributes
    ----------
    radius : float
        Radius of the sphere, m.
    modulus : float
        E*, Pa.
    force : float
        Normal force, N.
    contact_radius : float
        Radius of the contact, m.
    approach : float
        Distance by which the sphere has moved down from first touch, m.
    peak_pressure : float
        Pressure at the centre, Pa.
    """

    radius: float
    modulus: float
    force: float
    contact_radius: float
    approach: float
    peak_pressure: float

    def pressure(self, r: ArrayLike) -> FloatArray:
        """Return p(r), Pa, at distances r >= 0 (m) from the axis; 0 outside the contact.

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
        return self.peak_pressure * _dome(array_of("r", r, low=0.0), self.contact_radius)

    def displacement(self, r: ArrayLike) -> FloatArray:
        """Return the normal displacement u_z(r), m, inside and outside the contact.

        The equations are 3.41a and 3.42a of Johnson (1985).

        Parameters
        ----------
        r : array_like
            Distances from the axis, m, >= 0, any shape.

        Returns
        -------
        ndarray
            m, shape of `r`.

        Raises
        ------
        ValueError
            If a distance is negative or not a finite number.
        """
        return hertz_displacement(array_of("r", r, low=0.0), self.contact_radius, self.radius)


def _dome(r: FloatArray, a: float) -> FloatArray:
    """Return sqrt(1 - r^2/a^2), 0 where r >= a."""
    if a == 0.0:
        return np.zeros_like(r)
    return np.sqrt(np.clip((1.0 - r / a) * (1.0 + r / a), 0.0, None))


def hertz_displacement(r: FloatArray, a: float, radius: float) -> FloatArray:
    """Return u_z of a Hertzian pressure on a circle of radius `a`: a^2/R - r^2/(2R) inside."""
    outer = np.maximum(r, a)
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.where(outer > 0.0, a / np.where(outer > 0.0, outer, 1.0), 1.0)
    outside = (2.0 * a * a - outer**2) * np.arcsin(t) + outer * a * np.sqrt((1 - t) * (1 + t))
    # Far away the two terms nearly cancel, and a series replaces their sum.
    far = a * a * t * (4.0 / 3.0 + t * t * (2.0 / 15.0 + t * t * (3.0 / 70.0)))
    outside = np.where(t < 1e-2, far, outside)
    return np.where(r <= a, a * a - 0.5 * r * r, outside / math.pi) / radius


def hertz(
    radius: float,
    modulus: float,
    *,
    force: float | None = None,
    contact_radius: float | None = None,
    approach: float | None = None,
) -> HertzContact:
    """Return Hertz's contact of a rigid sphere with an elastic half-space.

    a^3 = 3 F R/(4 E*), approach = a^2/R, p0 = 2 E* a/(pi R) (thesis, eq. 1.1).

    Parameters
    ----------
    radius : float
        Radius of the sphere, m, > 0.
    modulus : float
        E*, Pa, > 0.
    force, contact_radius, approach : float
        Give exactly one, >= 0: normal force (N), contact radius (m) or approach (m).

    Returns
    -------
    HertzContact

    Raises
    ------
    ValueError
        If a value is out of range, or not exactly one of the three is given.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge, 1985, chapter 3.

    Examples
    --------
    >>> contact = hertz(50e-3, 344.828e6, contact_radius=1e-3)
    >>> round(contact.force, 5), round(contact.peak_pressure / 1e6, 5)
    (9.19541, 4.39049)
    >>> float(contact.displacement(0.0)) == contact.approach
    True
    """
    r, e = positives(radius=radius, modulus=modulus)
    name, given = exactly_one(force=force, contact_radius=contact_radius, approach=approach)
    given = number(name, given, 0.0)
    if name == "force":
        a = (0.75 * given * r / e) ** (1.0 / 3.0)
    else:
        a = given if name == "contact_radius" else math.sqrt(r * given)
    load = given if name == "force" else 4.0 * e * a**3 / (3.0 * r)
    return HertzContact(r, e, load, a, a * a / r, 2.0 * e * a / (math.pi * r))


@dataclass(frozen=True)
class HertzLine:
    """Contact of a rigid cylinder with an elastic half-space, per length along the axis.

    Attributes
    ----------
    radius : float
        Radius of the cylinder, m.
    modulus : float
        E*, Pa.
    load : float
        Normal force per length, N/m.
    half_width : float
        Half the width of the contact, m.
    peak_pressure : float
        Pressure in the middle, Pa.
    """

    radius: float
    modulus: float
    load: float
    half_width: float
    peak_pressure: float

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Return p(x), Pa, at positions x (m) across the line; 0 outside the contact.

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
        return self.peak_pressure * _dome(np.abs(array_of("x", x)), self.half_width)

    def displacement(self, x: ArrayLike) -> FloatArray:
        """Return u_z(x) - u_z(0), m. The absolute displacement under a line load is infinite.

        Parameters
        ----------
        x : array_like
            Positions, m, any shape.

        Returns
        -------
        ndarray
            m, shape of `x`.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        t = np.abs(array_of("x", x)) / self.half_width
        outer = np.maximum(t, 1.0)
        root = np.sqrt((outer - 1.0) * (outer + 1.0))
        # Far away this is accurate, unlike the difference of the gap and the cylinder.
        depth = np.where(t < 1.0, t * t, outer / (outer + root) + np.arccosh(outer))
        return np.asarray(-(self.half_width**2) / (2.0 * self.radius) * depth)

    def gap(self, x: ArrayLike) -> FloatArray:
        """Return the gap between cylinder and half-space, m; it is 0 within the contact.

        Parameters
        ----------
        x : array_like
            Positions, m, any shape.

        Returns
        -------
        ndarray
            m, shape of `x`.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        t = np.maximum(np.abs(array_of("x", x)) / self.half_width, 1.0)
        root = np.sqrt((t - 1.0) * (t + 1.0))
        return self.half_width**2 / (2.0 * self.radius) * (t * root - np.arccosh(t))


def hertz_line(
    radius: float,
    modulus: float,
    *,
    load: float | None = None,
    half_width: float | None = None,
) -> HertzLine:
    """Return Hertz's contact of a rigid cylinder with an elastic half-space.

    a^2 = 4 W R/(pi E*), p0 = 2 W/(pi a).

    Parameters
    ----------
    radius : float
        Radius of the cylinder, m, > 0.
    modulus : float
        E*, Pa, > 0.
    load, half_width : float
        Give exactly one, > 0: normal force per length (N/m) or half the contact width (m).

    Returns
    -------
    HertzLine

    Raises
    ------
    ValueError
        If a value is out of range, or not exactly one of the two is given.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge, 1985, chapter 4.

    Examples
    --------
    >>> line = hertz_line(0.01, 1e6, load=100.0)
    >>> round(line.half_width * 1e3, 6), round(line.peak_pressure)
    (1.128379, 56419)
    """
    r, e = positives(radius=radius, modulus=modulus)
    name, given = exactly_one(load=load, half_width=half_width)
    given = positive(name, given)
    a = math.sqrt(4.0 * given * r / (math.pi * e)) if name == "load" else given
    w = given if name == "load" else math.pi * e * a * a / (4.0 * r)
    return HertzLine(r, e, w, a, 2.0 * w / (math.pi * a))
