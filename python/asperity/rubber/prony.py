"""The Prony series of a linear viscoelastic material: its moduli, its shift, and its fit to data.

A material is the shear relaxation modulus ::

    G(t) = g_inf + sum_k g_k exp(-t/tau_k)

with `tau_k` the *relaxation* times. SI units throughout: Pa, s, rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.check import array_of, listed, number, poisson_ratio
from ..base.presenters import present
from .prony_fit import fit_moduli
from .retardation import retardation_spectrum
from .wlf import WLF

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["FitErrors", "Prony"]

FloatArray = NDArray[np.float64]

@dataclass(frozen=True)
class FitErrors:
    """Relative misfit of a fitted series, over the data points.

    Attributes
    ----------
    rms_storage, rms_loss : float
        Root mean square of (fit - data)/data.
    max_storage, max_loss : float
        Largest |fit - data|/data.
    """

    rms_storage: float
    rms_loss: float
    max_storage: float
    max_loss: float


class Prony:
    """A viscoelastic solid in shear: a spring parallel to Prony arms.

    Parameters
    ----------
    g_inf : float
        Long-term (equilibrium) modulus, Pa, >= 0; it may be 0 if there are arms.
    g : array_like, shape (n,)
        Moduli of the arms, Pa, >= 0; n may be 0 (elastic).
    tau : array_like, shape (n,)
        Relaxation times of the arms, s, > 0.

    Raises
    ------
    ValueError
        If a value is out of range or the shapes differ.

    Examples
    --------
    >>> rubber = Prony(1e6, [3e6, 5e6], [1e-3, 1.0])
    >>> rubber.instantaneous_modulus
    9000000.0
    >>> float(rubber.relaxation_modulus(0.0))
    9000000.0
    >>> print(rubber)
    Prony(g_inf=1000000.0, g=[3000000.0, 5000000.0], tau=[0.001, 1.0])
    """

    def __init__(self, g_inf: float, g: ArrayLike = (), tau: ArrayLike = ()) -> None:
        self._g_inf = number("g_inf", g_inf, 0.0)
        self._g = array_of("g", np.atleast_1d(np.asarray(g)), low=0.0, ndim=1)
        self._tau = array_of(
            "tau", np.atleast_1d(np.asarray(tau)), low=0.0, low_open=True, ndim=1
        )
        if self._g.size != self._tau.size:
            raise ValueError(
                f"tau: has {self._tau.size} values, must have as many as g, {self._g.size}"
            )
        if self._g_inf + self._g.sum() <= 0.0:
            raise ValueError("g_inf + sum(g) = 0.0: must be > 0")
        self._g.setflags(write=False)
        self._tau.setflags(write=False)
        self._spectrum: tuple[FloatArray, FloatArray, float] | None = None
        #: The `FitErrors` of a series that was fitted by `fit`, otherwise None.
        self.fit_errors: FitErrors | None = None

    # ---- parameters ------------------------------------------------------------------------

    @property
    def g_inf(self) -> float:
        """Long-term modulus, Pa."""
        return self._g_inf

    @property
    def g(self) -> FloatArray:
        """Moduli of the arms, Pa, shape (n,), read-only."""
        return self._g

    @property
    def tau(self) -> FloatArray:
        """Relaxation times of the arms, s, shape (n,), read-only."""
        return self._tau

    @property
    def equilibrium_modulus(self) -> float:
        """G(infinity), Pa."""
        return self._g_inf

    @property
    def instantaneous_modulus(self) -> float:
        """G(0), Pa."""
        return float(self._g_inf + self._g.sum())

    def __repr__(self) -> str:
        return f"Prony(g_inf={self._g_inf!r}, g={self._g.tolist()}, tau={self._tau.tolist()})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Prony):
            return NotImplemented
        return (
            self._g_inf == other._g_inf
            and np.array_equal(self._g, other._g)
            and np.array_equal(self._tau, other._tau)
        )

    def __hash__(self) -> int:
        return hash((self._g_inf, self._g.tobytes(), self._tau.tobytes()))

    # ---- frequency -------------------------------------------------------------------------

    def complex_modulus(self, omega: ArrayLike) -> NDArray[np.complex128]:
        """Return G* = g_inf + sum g i w tau/(1 + i w tau).

        Parameters
        ----------
        omega : array_like
            Angular frequency, rad/s, any shape; negative frequencies give the conjugate.

        Returns
        -------
        ndarray of complex
            G' + i G'', Pa, shape of `omega`.

        Raises
        ------
        ValueError
            If a frequency is not a finite number.

        Examples
        --------
        >>> complex(Prony(1.0, [2.0], [1.0]).complex_modulus(1.0))
        (2+1j)
        """
        x = array_of("omega", omega)[..., None] * self._tau
        # The smaller of x and 1/x, whose square cannot overflow.
        small = np.divide(1.0, x, out=x.copy(), where=np.abs(x) > 1.0)
        scale = 1.0 / (1.0 + small * small)
        storage = self._g_inf + np.sum(
            self._g * np.where(np.abs(x) > 1.0, scale, small * small * scale), axis=-1)
        return storage + 1j * np.sum(self._g * small * scale, axis=-1)

    def storage_modulus(self, omega: ArrayLike) -> FloatArray:
        """Return G'(omega), Pa.

        Parameters
        ----------
        omega : array_like
            Angular frequencies, rad/s, any shape.

        Returns
        -------
        ndarray
            Pa, shape of `omega`.

        Raises
        ------
        ValueError
            If a frequency is not a finite number.
        """
        return self.complex_modulus(omega).real

    def loss_modulus(self, omega: ArrayLike) -> FloatArray:
        """Return G''(omega), Pa.

        Parameters
        ----------
        omega : array_like
            Angular frequencies, rad/s, any shape.

        Returns
        -------
        ndarray
            Pa, shape of `omega`.

        Raises
        ------
        ValueError
            If a frequency is not a finite number.
        """
        return self.complex_modulus(omega).imag

    def tan_delta(self, omega: ArrayLike) -> FloatArray:
        """Return the loss factor G''/G'.

        Parameters
        ----------
        omega : array_like
            Angular frequencies, rad/s, any shape.

        Returns
        -------
        ndarray
            Pure numbers, shape of `omega`.

        Raises
        ------
        ValueError
            If a frequency is not a finite number.
        """
        modulus = self.complex_modulus(omega)
        return modulus.imag / modulus.real

    # ---- time ------------------------------------------------------------------------------

    def relaxation_modulus(self, t: ArrayLike) -> FloatArray:
        """Return G(t), Pa, at times t >= 0 (s), shape of `t`.

        Parameters
        ----------
        t : array_like
            Times, s, >= 0, any shape.

        Returns
        -------
        ndarray
            G, Pa, shape of `t`.

        Raises
        ------
        ValueError
            If a time is negative or not a finite number.
        """
        times = array_of("t", t, low=0.0)
        return self._g_inf + np.sum(self._g * np.exp(-times[..., None] / self._tau), axis=-1)

    def creep_compliance(self, t: ArrayLike) -> FloatArray:
        """Return the creep compliance J(t), the strain under a unit step of stress.

        J(t) = 1/G(0) + sum_j J_j (1 - exp(-t/theta_j)) + t/eta, with the retardation spectrum of
        `retardation_times` and `retardation_compliances`. The last term, with eta = sum g tau,
        exists for g_inf = 0 only. The formula is exact.

        Parameters
        ----------
        t : array_like
            Times, s, >= 0, any shape.

        Returns
        -------
        ndarray
            J, 1/Pa, shape of `t`.

        Raises
        ------
        ValueError
            If a time is negative or not a finite number.

        Examples
        --------
        >>> solid = Prony(1.0, [3.0], [0.5])      # creep time 0.5 * 4/1 = 2 s
        >>> round(float(solid.creep_compliance(2.0)), 6)
        0.72409
        """
        times = array_of("t", t, low=0.0)
        theta, compliance, fluidity = self._retardation()
        creep = np.sum(compliance * -np.expm1(-times[..., None] / theta), axis=-1)
        return 1.0 / self.instantaneous_modulus + creep + fluidity * times

    @property
    def retardation_times(self) -> FloatArray:
        """Retardation (creep) times theta_j, s, descending: one per arm, one fewer if g_inf = 0."""
        return self._retardation()[0].copy()

    @property
    def retardation_compliances(self) -> FloatArray:
        """Compliances J_j of the `retardation_times`, 1/Pa."""
        return self._retardation()[1].copy()

    @property
    def fluidity(self) -> float:
        """Rate of steady flow 1/eta, 1/(Pa s); it is 0 for a solid (g_inf > 0)."""
        return self._retardation()[2]

    def _retardation(self) -> tuple[FloatArray, FloatArray, float]:
        if self._spectrum is None:
            self._spectrum = retardation_spectrum(self._g_inf, self._g, self._tau)
        return self._spectrum

    # ---- conversion and fit --------------------------------------------------------------------

    @classmethod
    def from_zener(
        cls, g_inf: float, g0: ArrayLike = (), g1: ArrayLike = (), eta: ArrayLike = ()
    ) -> Prony:
        """Return the Prony series that is equivalent to Zener branches.

        A branch is a spring G0 in series with (a spring G1 parallel to a damper eta). All branches
        and the spring `g_inf` are parallel. Each branch is exactly equivalent to a spring
        G0 G1/(G0 + G1) and an arm with g = G0^2/(G0 + G1) and tau = eta/(G0 + G1).

        Parameters
        ----------
        g_inf : float
            Spring parallel to the branches, Pa, >= 0.
        g0, g1 : array_like, shape (n,)
            Moduli of the springs, Pa; g0 > 0, g1 >= 0.
        eta : array_like, shape (n,)
            Viscosities, Pa s, > 0.

        Returns
        -------
        Prony

        Raises
        ------
        ValueError
            If a modulus or viscosity is out of range, or the lists differ in length.

        Examples
        --------
        >>> round(Prony.from_zener(0.0, [1e6], [1e5], [1e5]).equilibrium_modulus, 3)
        90909.091
        """
        parallel = number("g_inf", g_inf, 0.0)
        first = array_of("g0", np.atleast_1d(np.asarray(g0)), low=0.0, low_open=True, ndim=1)
        second = array_of("g1", np.atleast_1d(np.asarray(g1)), low=0.0, ndim=1)
        viscosity = array_of("eta", np.atleast_1d(np.asarray(eta)), low=0.0, low_open=True, ndim=1)
        for name, values in (("g1", second), ("eta", viscosity)):
            if values.size != first.size:
                raise ValueError(
                    f"{name}: has {values.size} values, must have as many as g0, {first.size}"
                )
        total = first + second
        return cls(
            parallel + float(np.sum(first * second / total)), first**2 / total, viscosity / total
        )

    def shifted(self, temperature: float, wlf: Sequence[float]) -> Prony:
        """Return the material at another temperature, with every tau multiplied by a_T.

        Parameters
        ----------
        temperature : float
            Temperature, in the scale of the reference temperature (C or K).
        wlf : WLF or (c1, c2, t_ref)
            Constants of the shift: c1 dimensionless, c2 in K.

        Returns
        -------
        Prony

        Raises
        ------
        ValueError
            If the constants are not three numbers, or the temperature is not above t_ref - c2.

        Examples
        --------
        >>> bool(Prony(1.0, [1.0], [2.0]).shifted(30.0, (10.0, 100.0, 20.0)).tau[0] < 2.0)
        True
        """
        try:
            constants = WLF(*wlf)
        except TypeError:
            raise ValueError(f"wlf = {wlf!r}: must be (c1, c2, t_ref)") from None
        factor = float(constants.shift_factor(number("temperature", temperature)))
        return Prony(self._g_inf, self._g, self._tau * factor)

    @classmethod
    def fit(
        cls,
        omega: ArrayLike,
        storage: ArrayLike,
        loss: ArrayLike,
        *,
        arms_per_decade: float = 1.0,
        tau_range: tuple[float, float] | None = None,
        slack: float = 0.05,
        least_plateau: float = 0.0,
    ) -> Prony:
        """Fit a series to measured storage and loss moduli.

        The relaxation times are spaced evenly on a log scale. The moduli, which are not negative,
        minimise the relative misfit of G' and G'' (non-negative least squares). Of all series whose
        rms misfit is within `slack` of the smallest one, the smoothest is returned: the second
        differences of g/G''(1/tau) are penalised as strongly as this condition allows.

        Parameters
        ----------
        omega : array_like, shape (n,)
            Angular frequencies, rad/s, > 0, in any order.
        storage, loss : array_like, shape (n,)
            G' and G'', Pa, > 0.
        arms_per_decade : float
            Number of relaxation times per decade, > 0.
        tau_range : (float, float), optional
            Shortest and longest relaxation time, s. By default they are a decade beyond the
            reciprocals of the largest and the smallest frequency, where spectra have their tails.
        slack : float
            Relative increase of the rms misfit, in addition to 1e-4, that is allowed in exchange
            for smoothness, >= 0. With 0 the misfit is minimised without regard to smoothness.
        least_plateau : float
            Lower bound of g_inf as a fraction of the smallest storage modulus, 0 to 1. It makes the
            material a solid even if the data do not reach the plateau.

        Returns
        -------
        Prony
            The series, with the attribute `fit_errors` (`FitErrors`). Arms with zero modulus are
            left out.

        Raises
        ------
        ValueError
            If values are out of range or shapes differ.
        NotConverged
            If the least squares find no solution.

        Examples
        --------
        >>> true = Prony(1e6, [1e6, 2e6, 1e6], [1e-2, 1e-1, 1.0])
        >>> omega = np.logspace(-2, 4, 61)
        >>> found = Prony.fit(omega, true.storage_modulus(omega), true.loss_modulus(omega))
        >>> bool(found.fit_errors.max_storage < 1e-2)
        True
        """
        found = fit_moduli(
            omega, storage, loss, arms_per_decade=arms_per_decade, tau_range=tau_range,
            slack=slack, least_plateau=least_plateau)
        result = cls(found.g_inf, found.g, found.tau)
        modulus = result.complex_modulus(found.omega)
        e_real = modulus.real / found.storage - 1.0
        e_imaginary = modulus.imag / found.loss - 1.0
        result.fit_errors = FitErrors(
            float(np.sqrt(np.mean(e_real**2))),
            float(np.sqrt(np.mean(e_imaginary**2))),
            float(np.max(np.abs(e_real))),
            float(np.max(np.abs(e_imaginary))),
        )
        return result

    # ---- output ------------------------------------------------------------------------------

    def to_namelist(
        self,
        *,
        poisson: float = 0.5,
        temperature: float | None = None,
        wlf: Sequence[float] | None = None,
    ) -> str:
        """Return the `&material` group of an input file.

        Parameters
        ----------
        poisson : float
            Poisson ratio.
        temperature : float, optional
            Temperature of the simulation, C; needs `wlf`.
        wlf : WLF or (c1, c2, t_ref), optional
            Constants with which the program shifts the relaxation times; needs `temperature`.

        Returns
        -------
        str
            The group. The numbers have as many digits as needed to read back the same bits.

        Raises
        ------
        ValueError
            If only one of `temperature` and `wlf` is given, or a value is out of range.

        Examples
        --------
        >>> print(Prony(1e6, [2e6], [0.5]).to_namelist())
        &material
           poisson = 0.5
           shear_modulus = 1000000.0
           prony_g = 2000000.0
           prony_tau = 0.5
        /
        """
        lines = [f"poisson = {poisson_ratio(poisson)!r}", f"shear_modulus = {self._g_inf!r}"]
        acts = self._g > 0.0        # the program refuses arms without a modulus
        if acts.any():
            lines.append(_wrapped("prony_g", self._g[acts]))
            lines.append(_wrapped("prony_tau", self._tau[acts]))
        if (temperature is None) != (wlf is None):
            raise ValueError("temperature and wlf: give both or none of them")
        if temperature is not None and wlf is not None:
            constants = WLF(*(number("wlf", value)
                              for value in listed("wlf", wlf, "c1", "c2", "t_ref")))
            constants.shift_factor(number("temperature", temperature))
            lines += [
                f"temperature = {float(temperature)!r}",
                f"reference_temperature = {constants.t_ref!r}",
                f"wlf_c1 = {constants.c1!r}",
                f"wlf_c2 = {constants.c2!r}",
            ]
        return "&material\n" + "".join(f"   {line}\n" for line in lines) + "/"

    def plot(self, ax: Axes | None = None, omega: ArrayLike | None = None) -> Axes:
        """Draw G', G'' and tan delta against the frequency, and the arms at 1/tau.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Axes to draw into; a new figure by default.
        omega : array_like, optional
            Angular frequencies, rad/s; by default they extend two decades beyond the arms.

        Returns
        -------
        matplotlib Axes
            The axes of the moduli. The axis of tan delta is on the right.
        """
        return present("plot_prony", self, ax, omega)


def _wrapped(name: str, values: FloatArray) -> str:
    """Return `name = v1, v2, ...` with three values per line."""
    texts = [repr(float(value)) for value in values]
    rows = [", ".join(texts[i : i + 3]) for i in range(0, len(texts), 3)]
    return f"{name} = " + (",\n" + " " * (6 + len(name))).join(rows)
