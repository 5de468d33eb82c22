"""Wavy surfaces: Westergaard's elastic contact, and viscoelastic sliding in full contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of, choice, instance, number, poisson_ratio, positives
from ..rubber.material import Prony

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class WestergaardContact:
    """Elastic contact of the rigid wave D cos(2 pi x/L) with a half-space.

    Attributes
    ----------
    amplitude, wavelength : float
        D and L, m.
    modulus : float
        E*, Pa.
    mean_pressure : float
        Mean pressure, Pa.
    full_pressure : float
        p* = pi E* D/L, the mean pressure that closes the gap everywhere, Pa.
    half_width : float
        Half the width of a contact strip, m; L/2 in full contact.
    area_fraction : float
        Contact area fraction, 2 half_width/L.
    mean_gap : float
        Mean gap, m.
    """

    amplitude: float
    wavelength: float
    modulus: float
    mean_pressure: float
    full_pressure: float
    half_width: float
    area_fraction: float
    mean_gap: float

    def _sines(self, x: ArrayLike) -> tuple[FloatArray, float]:
        psi = math.pi * array_of("x", x) / self.wavelength
        return np.sin(psi), min(1.0, math.sqrt(self.mean_pressure / self.full_pressure))

    def pressure(self, x: ArrayLike) -> FloatArray:
        """Return the pressure p(x), Pa.

        Parameters
        ----------
        x : array_like
            Positions, counted from a summit, m, any shape.

        Returns
        -------
        ndarray
            Pa, shape of `x`.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        s, s_a = self._sines(x)
        if s_a >= 1.0:
            return self.mean_pressure + self.full_pressure * (1.0 - 2.0 * s * s)
        root = np.sqrt(np.clip((s_a - s) * (s_a + s), 0.0, None))
        return 2.0 * self.full_pressure * np.sqrt(1.0 - s * s) * root

    def gap(self, x: ArrayLike) -> FloatArray:
        """Return the gap, m.

        Parameters
        ----------
        x : array_like
            Positions, counted from a summit, m, any shape.

        Returns
        -------
        ndarray
            m, shape of `x`.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        s, s_a = self._sines(x)
        s = np.maximum(np.abs(s), s_a)
        if s_a == 0.0:
            return 2.0 * self.amplitude * s * s
        root = np.sqrt((s - s_a) * (s + s_a))
        return 2.0 * self.amplitude * (s * root - s_a**2 * np.log((s + root) / s_a))


def westergaard(
    amplitude: float, wavelength: float, modulus: float, pressure: float
) -> WestergaardContact:
    """Return the elastic contact of the rigid wave D cos(2 pi x/L) in plane strain.

    The mean pressure is p* sin^2(pi a/L), with half the contact width a and p* = pi E* D/L.

    Parameters
    ----------
    amplitude : float
        D, m, > 0: half of the height from valley to summit.
    wavelength : float
        L, m, > 0.
    modulus : float
        E*, Pa, > 0.
    pressure : float
        Mean pressure, Pa, >= 0. From p* on the contact is full.

    Returns
    -------
    WestergaardContact

    Raises
    ------
    ValueError
        If a value is out of range.

    References
    ----------
    H. M. Westergaard, J. Appl. Mech. 6 (1939) 49; Johnson, Contact Mechanics, section 13.2.

    Examples
    --------
    >>> wave = westergaard(1e-6, 1e-3, 1e6, 0.5 * 3141.592653589793)
    >>> round(wave.area_fraction, 12), round(wave.full_pressure, 6)
    (0.5, 3141.592654)
    """
    d, wave, e = positives(amplitude=amplitude, wavelength=wavelength, modulus=modulus)
    p = number("pressure", pressure, 0.0)
    full = math.pi * e * d / wave
    square = min(1.0, p / full)
    half = wave / math.pi * math.asin(math.sqrt(square))
    logarithm = 0.5 * square * math.log(square) if square > 0.0 else 0.0
    gap = 2.0 * d * (0.5 * (1.0 - square) + logarithm)
    return WestergaardContact(d, wave, e, p, full, half, 2.0 * half / wave, gap)


@dataclass(frozen=True)
class FullContactWaves:
    """Sliding waves in full contact with a viscoelastic half-space.

    Attributes
    ----------
    wavevectors : ndarray, shape (n, 2)
        Wave vectors, rad/m.
    heights : ndarray of complex, shape (..., n)
        Amplitudes of the height of the road, m: h = Re sum heights exp(i q.x). The leading axes are
        those of the times.
    pressures : ndarray of complex, shape (..., n)
        Amplitudes of the deviation of the pressure from its mean, Pa.
    friction_stress : ndarray, shape (..., 2)
        Mean horizontal traction on the rubber, -mean(p grad h), Pa. In steady sliding it acts along
        the velocity of the road.
    """

    wavevectors: FloatArray
    heights: NDArray[np.complex128]
    pressures: NDArray[np.complex128]
    friction_stress: FloatArray

    def _sum(self, amplitudes: NDArray[np.complex128], x: ArrayLike, y: ArrayLike) -> FloatArray:
        points = np.stack(np.broadcast_arrays(array_of("x", x), array_of("y", y)), axis=-1)
        waves = np.exp(1j * np.tensordot(points, self.wavevectors, axes=(-1, 1)))
        return np.tensordot(amplitudes, waves, axes=(-1, -1)).real

    def pressure(self, x: ArrayLike, y: ArrayLike = 0.0) -> FloatArray:
        """Return the deviation of the pressure from its mean.

        The contact is full only if the mean pressure exceeds the largest negative value.

        Parameters
        ----------
        x, y : array_like
            Positions, m; the arrays are broadcast.

        Returns
        -------
        ndarray
            Pa; the axes of the times, followed by those of the positions.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        return self._sum(self.pressures, x, y)

    def height(self, x: ArrayLike, y: ArrayLike = 0.0) -> FloatArray:
        """Return the height of the road.

        Parameters
        ----------
        x, y : array_like
            Positions, m; the arrays are broadcast.

        Returns
        -------
        ndarray
            Heights, m; the axes of the times, followed by those of the positions.

        Raises
        ------
        ValueError
            If a position is not a finite number.
        """
        return self._sum(self.heights, x, y)

    @property
    def full_pressure_bound(self) -> FloatArray:
        """Sum of the amplitudes, Pa; a mean pressure above it keeps the contact full."""
        return np.sum(np.abs(self.pressures), axis=-1)


def full_contact_waves(
    amplitude: ArrayLike,
    wavevector: ArrayLike,
    velocity: ArrayLike,
    material: Prony,
    *,
    poisson: float = 0.5,
    phase: ArrayLike = 0.0,
    times: ArrayLike | None = None,
    start: str = "relaxed",
) -> FullContactWaves:
    """Return pressure and friction of sliding waves in full contact, in closed form.

    The road is h(x, t) = sum D cos(q.(x - V t) + phase). In steady sliding each wave adds the
    friction stress q |q| D^2 G''(q.V)/(2 (1 - nu)), that is q |q| D^2 E''/4. After a start from
    rest each arm relaxes from its value at rest to the steady one. The solution is exact for any
    Prony series.

    Parameters
    ----------
    amplitude : array_like, shape () or (n,)
        D of each wave, m.
    wavevector : array_like, shape (2,) or (n, 2)
        q of each wave, rad/m, not zero. No two may be equal or opposite.
    velocity : array_like, shape (2,)
        Velocity V of the road over the rubber, m/s.
    material : Prony
        Shear relaxation modulus.
    poisson : float
        Poisson ratio, constant in time.
    phase : array_like, shape () or (n,)
        Phase of each wave at t = 0, rad.
    times : array_like, optional
        Times since the start, s, >= 0, any shape. None means steady sliding, at the moment when the
        road is at h(x, 0).
    start : {'relaxed', 'glassy'}
        The rubber has rested on the road for an infinite time before the start ('relaxed'), or
        touches it at the moment of the start ('glassy').

    Returns
    -------
    FullContactWaves

    Raises
    ------
    ValueError
        If a value is out of range or shapes do not fit.

    References
    ----------
    B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840, for steady sliding.

    Examples
    --------
    >>> rubber = Prony(1e6, [2e6], [1e-3])
    >>> wave = full_contact_waves(1e-6, (1e4, 0.0), (0.1, 0.0), rubber)
    >>> wave.friction_stress.tolist()
    [100.0, 0.0]
    """
    d = np.atleast_1d(array_of("amplitude", amplitude))
    q = np.atleast_2d(array_of("wavevector", wavevector))
    v = array_of("velocity", velocity, ndim=1)
    if q.ndim != 2 or q.shape[1] != 2:
        raise ValueError(f"wavevector: has shape {q.shape}, must have (n, 2)")
    if v.shape != (2,):
        raise ValueError(f"velocity: has shape {v.shape}, must have (2,)")
    instance("material", material, Prony)
    n = q.shape[0]
    shift = array_of("phase", phase)
    for name, values in (("amplitude", d), ("phase", shift)):
        if values.shape not in ((), (1,), (n,)):
            raise ValueError(f"{name}: has shape {values.shape}, must have ({n},)")
    norm = np.hypot(q[:, 0], q[:, 1])
    if np.any(norm == 0.0):
        raise ValueError(f"wavevector[{int(np.argmin(norm))}] = 0: must not be zero")
    half_plane = np.where(((q[:, 0] < 0) | ((q[:, 0] == 0) & (q[:, 1] < 0)))[:, None], -q, q)
    if len(np.unique(half_plane, axis=0)) != n:
        raise ValueError("wavevector: two are equal or opposite: must differ; add their amplitudes")
    nu = poisson_ratio(poisson)
    choice("start", start, ("relaxed", "glassy"))

    at_rest = d * np.exp(1j * shift) * np.ones(n)
    omega = q @ v
    if times is None:
        heights = at_rest
        moduli = np.conj(material.complex_modulus(omega))  # time runs as exp(-i omega t)
    else:
        t = array_of("times", times, low=0.0)[..., None]
        heights = at_rest * np.exp(-1j * omega * t)
        # Each arm satisfies dm/dt + m/tau = g du/dt with u = exp(-i omega t).
        turn = np.exp(-1j * omega * t)
        moduli = material.g_inf * np.ones_like(turn)
        for g, tau in zip(material.g, material.tau, strict=True):
            fading = np.exp(-t / tau)
            steady = -1j * omega * tau / (1.0 - 1j * omega * tau)
            moduli = moduli + g * (steady * (1.0 - fading / turn))
            if start == "glassy":
                moduli = moduli + g * fading / turn
    pressures = norm / (1.0 - nu) * moduli * heights
    friction = 0.0 - 0.5 * (np.imag(pressures * np.conj(heights)) @ q)
    return FullContactWaves(q, heights, pressures, friction)
