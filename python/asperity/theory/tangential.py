"""Tangential contact of a sphere: Cattaneo and Mindlin, Mindlin and Deresiewicz."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of, exactly_one, number, poisson_ratio, positive
from .hertzian import HertzContact, _dome, hertz

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class MindlinContact:
    """A rigid sphere under a constant normal force, moved sideways against Coulomb friction.

    Attributes
    ----------
    normal : HertzContact
        The normal contact.
    coefficient : float
        Coefficient of friction.
    tangential : ndarray
        Tangential force in each state of the path, N; an array without axes for a single state.
    shift : ndarray
        Tangential displacement of the sphere relative to the far half-space, m.
    stick_radius : ndarray
        Radius within which no point has slipped since the last reversal, m; 0 in full sliding.
    slide_shift : float
        Shift at which a first loading begins to slide as a whole, m.
    """

    normal: HertzContact
    coefficient: float
    tangential: FloatArray
    shift: FloatArray
    stick_radius: FloatArray
    slide_shift: float
    _levels: tuple[float, ...] = field(repr=False)

    def traction(self, r: ArrayLike) -> FloatArray:
        """Return the tangential traction in the last state.

        It is positive along the positive tangential force. It is a sum of Cattaneo's tractions, one
        for each reversal that still has an effect.

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
        a, p0 = self.normal.contact_radius, self.normal.peak_pressure
        total = np.zeros_like(distance)
        for step, factor in _segments(self._levels):
            c = a * max(0.0, 1.0 - abs(step) / factor) ** (1.0 / 3.0)
            ring = p0 * (_dome(distance, a) - (c / a) * _dome(distance, c))
            total += math.copysign(factor, step) * self.coefficient * ring
        return total


def _segments(levels: tuple[float, ...] | list[float]) -> list[tuple[float, float]]:
    """Return (step, Masing factor) of the segments between the turning points."""
    steps = [(levels[0], 1.0)]
    steps += [(b - a, 2.0) for a, b in pairwise(levels)]
    return steps


def _respond(levels: list[float], exponent: float) -> float:
    """Return the response to the last level; on the first loading it is 1 - (1 - x)^exponent."""
    total = 0.0
    for step, factor in _segments(levels):
        x = min(1.0, abs(step) / factor)
        total -= math.copysign(factor, step) * math.expm1(
            exponent * math.log1p(-x) if x < 1.0 else -math.inf
        )
    return total


def _advance(levels: list[float], x: float) -> None:
    """Move to level `x`, and remove the turning points of closed loops (return-point memory)."""
    while True:
        if len(levels) == 1:
            if abs(x) >= abs(levels[0]):
                levels[0] = x
            else:
                levels.append(x)
            return
        if (x - levels[-1]) * (levels[-1] - levels[-2]) >= 0.0:  # onwards
            levels.pop()
            if len(levels) == 1:
                continue
        if abs(x - levels[-1]) < abs(levels[-2] - levels[-1]):
            levels.append(x)
            return
        levels.pop()


def mindlin(
    radius: float,
    shear_modulus: float,
    poisson: float,
    coefficient: float,
    force: float,
    *,
    tangential: ArrayLike | None = None,
    shift: ArrayLike | None = None,
) -> MindlinContact:
    """Return the contact of a rigid sphere under constant normal and varying tangential load.

    On the first loading c/a = (1 - Q/(mu F))^(1/3) and
    shift = 3 mu F (2 - nu)/(16 a G) (1 - (1 - Q/(mu F))^(2/3)). Unloading and reloading follow from
    these equations with doubled scales (Masing's rule), and closed loops leave no trace. The theory
    assumes that slip is parallel to the force and that normal and tangential displacements are not
    coupled. It is exact for nu = 0, and accurate to about 1e-3 for nu = 0.42.

    Parameters
    ----------
    radius : float
        Radius of the sphere, m, > 0.
    shear_modulus : float
        G of the half-space, Pa, > 0.
    poisson : float
        Its Poisson ratio.
    coefficient : float
        Coefficient of friction mu, > 0.
    force : float
        Normal force F, N, > 0.
    tangential, shift : array_like, shape () or (n,)
        Give exactly one: the path, in time order from the unloaded state, of the tangential force
        (N, |Q| <= mu F) or of the sphere's displacement (m). Between two values the path is
        monotonic, so that its turning points are enough.

    Returns
    -------
    MindlinContact
        Arrays have the shape of the path. Under a prescribed force of mu F the shift is that at
        which sliding begins.

    Raises
    ------
    ValueError
        If a value is out of range, or not exactly one path is given.

    References
    ----------
    C. Cattaneo, Rend. Accad. Naz. Lincei 27 (1938) 342; R. D. Mindlin, J. Appl. Mech. 16 (1949)
    259; R. D. Mindlin, H. Deresiewicz, J. Appl. Mech. 20 (1953) 327.

    Examples
    --------
    >>> contact = mindlin(0.05, 200e6, 0.0, 0.5, 10.0, tangential=4.375)
    >>> round(float(contact.stick_radius) / contact.normal.contact_radius, 12)
    0.5
    >>> loop = mindlin(0.05, 200e6, 0.0, 0.5, 10.0, tangential=[4.0, -4.0, 4.0])
    >>> bool(abs(loop.shift[2] - loop.shift[0]) < 1e-18)
    True
    """
    g, nu = positive("shear_modulus", shear_modulus), poisson_ratio(poisson)
    mu = positive("coefficient", coefficient)
    normal = hertz(radius, 2.0 * g / (1.0 - nu), force=positive("force", force))
    a, bound = normal.contact_radius, mu * normal.force
    slide = 3.0 * bound * (2.0 - nu) / (16.0 * a * g)
    given: ArrayLike
    name, given = exactly_one(tangential=tangential, shift=shift)
    by_force, path = name == "tangential", array_of(name, given)
    if path.ndim > 1 or path.size == 0:
        raise ValueError(f"path: has shape {path.shape}, must be one value or (n,) with n > 0")
    if by_force:
        for value in np.ravel(path):
            number("tangential", value, -bound, bound)

    levels = [0.0]
    slipped = 0.0
    forces, shifts, sticks = [], [], []
    for value in np.ravel(path):
        x = float(value) / (bound if by_force else slide) - slipped
        if not by_force and abs(x) > 1.0:
            slipped += x - math.copysign(1.0, x)
            x = math.copysign(1.0, x)
        _advance(levels, x)
        answer = _respond(levels, 2.0 / 3.0 if by_force else 1.5)
        step, factor = _segments(levels)[-1]
        stuck = max(0.0, 1.0 - abs(step) / factor)
        sticks.append(a * stuck ** (1.0 / 3.0 if by_force else 0.5))
        forces.append(float(value) if by_force else answer * bound)
        shifts.append(answer * slide if by_force else float(value))
    if not by_force:
        levels = [_respond(levels[: i + 1], 1.5) for i in range(len(levels))]
    return MindlinContact(
        normal, mu,
        np.array(forces).reshape(path.shape),
        np.array(shifts).reshape(path.shape),
        np.array(sticks).reshape(path.shape),
        slide, tuple(levels),
    )
