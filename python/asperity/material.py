"""Linear viscoelastic materials: Prony series, Zener branches, WLF shift, fit to DMA data.

A material is the shear relaxation modulus ::

    G(t) = g_inf + sum_k g_k exp(-t/tau_k)

with `tau_k` the *relaxation* times. SI units throughout: Pa, s, rad/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, least_squares, minimize_scalar, nnls

from ._check import array_of, number, poisson_ratio, positive

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["WLF", "FitErrors", "MasterCurve", "Prony", "master_curve"]

FloatArray = NDArray[np.float64]

_LEGEND_ABOVE = {
    "loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 4, "frameon": False,
    "columnspacing": 1.2, "handlelength": 1.6,
}

MOST_ARMS = 200  # of a fit: two a decade leave a ripple of 0.1 %, more than ten tell nothing new


class WLF(NamedTuple):
    """Constants of the Williams-Landel-Ferry shift, log10 a_T = -c1 (T - T_ref)/(c2 + T - T_ref).

    Parameters
    ----------
    c1 : float
        First constant, dimensionless.
    c2 : float
        Second constant, K.
    t_ref : float
        Reference temperature, in the scale of the temperatures given later (C or K).

    References
    ----------
    M. L. Williams, R. F. Landel, J. D. Ferry, J. Am. Chem. Soc. 77 (1955) 3701.

    Examples
    --------
    >>> float(WLF(17.44, 51.6, -60.0).shift_factor(-60.0))
    1.0
    """

    c1: float
    c2: float
    t_ref: float

    def shift_factor(self, temperature: ArrayLike) -> FloatArray:
        """Return a_T = tau(T)/tau(T_ref).

        Parameters
        ----------
        temperature : array_like
            Temperatures, any shape; T - t_ref > -c2.

        Returns
        -------
        ndarray
            a_T, dimensionless, shape of `temperature`.

        Raises
        ------
        ValueError
            If a temperature lies at or below t_ref - c2, where the law diverges.
        """
        c2 = positive("wlf c2", self.c2)
        c1 = number("wlf c1", self.c1, 0.0)
        t_ref = number("wlf t_ref", self.t_ref)
        values = array_of("temperature", temperature)
        if np.any(values - t_ref <= -c2):
            raise ValueError(
                f"temperature = {float(np.min(values))!r}: must be > t_ref - c2 = {t_ref - c2:g}"
            )
        return 10.0 ** (-c1 * (values - t_ref) / (c2 + values - t_ref))


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
    """Generalised Maxwell solid in shear.

    Parameters
    ----------
    g_inf : float
        Long-term (equilibrium) modulus, Pa, >= 0; may be 0 where arms exist.
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
        #: FitErrors of a series made by `fit`, else None.
        self.fit_errors: FitErrors | None = None

    # ---- what it is ------------------------------------------------------------------------

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

        Examples
        --------
        >>> complex(Prony(1.0, [2.0], [1.0]).complex_modulus(1.0))
        (2+1j)
        """
        x = array_of("omega", omega)[..., None] * self._tau
        scale = 1.0 / (1.0 + x * x)
        storage = self._g_inf + np.sum(self._g * x * x * scale, axis=-1)
        loss = np.sum(self._g * x * scale, axis=-1)
        return storage + 1j * loss

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
            If a time is negative or no finite number.
        """
        times = array_of("t", t, low=0.0)
        return self._g_inf + np.sum(self._g * np.exp(-times[..., None] / self._tau), axis=-1)

    def creep_compliance(self, t: ArrayLike) -> FloatArray:
        """Return the creep compliance J(t), the strain under a unit step of stress.

        J(t) = 1/G(0) + sum_j J_j (1 - exp(-t/theta_j)) + t/eta with the retardation spectrum
        of `retardation_times` and `retardation_compliances`; the last term exists for g_inf = 0
        only, eta = sum g tau. No approximation is made.

        Parameters
        ----------
        t : array_like
            Times, s, >= 0, any shape.

        Returns
        -------
        ndarray
            J, 1/Pa, shape of `t`.

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
        """Retardation (creep) times theta_j, s, descending; one an arm (one fewer if g_inf = 0)."""
        return self._retardation()[0].copy()

    @property
    def retardation_compliances(self) -> FloatArray:
        """Compliances J_j, 1/Pa, that belong to `retardation_times`."""
        return self._retardation()[1].copy()

    @property
    def fluidity(self) -> float:
        """1/eta in 1/(Pa s), the rate of steady flow: 0 for a solid (g_inf > 0)."""
        return self._retardation()[2]

    def _retardation(self) -> tuple[FloatArray, FloatArray, float]:
        if self._spectrum is None:
            self._spectrum = _retardation_spectrum(self._g_inf, self._g, self._tau)
        return self._spectrum

    # ---- other materials made from it --------------------------------------------------------

    @classmethod
    def from_zener(
        cls, g_inf: float, g0: ArrayLike = (), g1: ArrayLike = (), eta: ArrayLike = ()
    ) -> Prony:
        """Make the Prony series equal to Zener branches.

        A branch is a spring G0 in series with (a spring G1 parallel to a dashpot eta); all
        branches and the spring `g_inf` are parallel. Each is exactly a spring
        G0 G1/(G0 + G1) and a Maxwell arm g = G0^2/(G0 + G1), tau = eta/(G0 + G1).

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
        """Return the material at another temperature: every tau times a_T.

        Parameters
        ----------
        temperature : float
            Temperature, in the scale of the reference temperature.
        wlf : WLF or (c1, c2, t_ref)
            Constants; c2 in K.

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

        Relaxation times are spaced evenly on a log scale; moduli >= 0 minimise the relative
        misfit of G' and G'' (non-negative least squares). Among the series whose rms misfit is
        within `slack` of the smallest possible, the smoothest is returned: the second
        differences of g/G''(1/tau) are penalised as strongly as that allows.

        Parameters
        ----------
        omega : array_like, shape (n,)
            Angular frequencies, rad/s, > 0, in any order.
        storage, loss : array_like, shape (n,)
            G' and G'', Pa, > 0.
        arms_per_decade : float
            Density of the relaxation times, > 0.
        tau_range : (float, float), optional
            Shortest and longest relaxation time, s. Default: the reciprocals of the largest and
            smallest frequency and a decade beyond, where spectra have their tails.
        slack : float
            Allowed relative increase of the rms misfit, plus 1e-4, in exchange for smoothness;
            >= 0, and 0 asks for the smallest misfit alone.
        least_plateau : float
            g_inf is at least this share of the smallest storage modulus, 0 to 1: a solid also
            where the data do not reach the plateau.

        Returns
        -------
        Prony
            With the attribute `fit_errors` (a FitErrors). Arms of zero modulus are left out.

        Raises
        ------
        ValueError
            If values are out of range or shapes differ.

        Examples
        --------
        >>> true = Prony(1e6, [1e6, 2e6, 1e6], [1e-2, 1e-1, 1.0])
        >>> omega = np.logspace(-2, 4, 61)
        >>> found = Prony.fit(omega, true.storage_modulus(omega), true.loss_modulus(omega))
        >>> bool(found.fit_errors.max_storage < 1e-2)
        True
        """
        frequency = array_of("omega", omega, low=0.0, low_open=True, ndim=1)
        real = array_of("storage", storage, low=0.0, low_open=True, ndim=1)
        imaginary = array_of("loss", loss, low=0.0, low_open=True, ndim=1)
        density = positive("arms_per_decade", arms_per_decade)
        slack = number("slack", slack, 0.0)
        floor = number("least_plateau", least_plateau, 0.0, 1.0)
        for name, values in (("storage", real), ("loss", imaginary)):
            if values.size != frequency.size:
                raise ValueError(
                    f"{name}: has {values.size} values, must have as many as omega,"
                    f" {frequency.size}"
                )
        if frequency.size < 2:
            raise ValueError(f"omega: has {frequency.size} values, must have at least 2")
        if tau_range is None:
            tau_range = (0.1 / float(frequency.max()), 10.0 / float(frequency.min()))
        shortest = positive("tau_range[0]", tau_range[0])
        longest = number("tau_range[1]", tau_range[1], shortest)
        count = max(1, round(density * math.log10(longest / shortest)) + 1)
        if count > MOST_ARMS:
            raise ValueError(f"arms_per_decade = {density:g}: gives {count} relaxation times from"
                             f" {shortest:.3g} to {longest:.3g} s: must be at most {MOST_ARMS}")
        tau = np.geomspace(shortest, longest, count) if count > 1 else np.array([shortest])

        order = np.argsort(frequency)
        scale = np.exp(
            np.interp(-np.log(tau), np.log(frequency[order]), np.log(imaginary[order]))
        )
        x = frequency[:, None] * tau
        blocks = scale * x / (1.0 + x * x)
        columns = np.vstack(
            [
                np.column_stack([np.full(frequency.size, real.min()), x * blocks])
                / real[:, None],
                np.column_stack([np.zeros(frequency.size), blocks]) / imaginary[:, None],
            ]
        )
        target = np.ones(2 * frequency.size)
        target -= floor * columns[:, 0]
        penalty = np.zeros((max(count - 2, 0), count + 1))
        for row in range(count - 2):
            penalty[row, row + 1 : row + 4] = 1.0, -2.0, 1.0

        def solve(weight: float) -> tuple[FloatArray, float]:
            system = np.vstack([columns, weight * penalty])
            right = np.concatenate([target, np.zeros(len(penalty))])
            unknowns, _ = nnls(system, right, maxiter=50 * (count + 1))
            misfit = float(np.sqrt(np.mean((columns @ unknowns - target) ** 2)))
            return unknowns, misfit

        best, least = solve(0.0)
        allowed = (1.0 + slack) * least + (1e-4 if slack > 0.0 else 0.0)
        if len(penalty):
            for weight in np.geomspace(1e3, 1e-6, 46):
                candidate, misfit = solve(weight)
                if misfit <= allowed:
                    best = candidate
                    break
        g = best[1:] * scale
        keep = g > 0.0
        result = cls(float((floor + best[0]) * real.min()), g[keep], tau[keep])
        found = result.complex_modulus(frequency)
        e_real = found.real / real - 1.0
        e_imaginary = found.imag / imaginary - 1.0
        result.fit_errors = FitErrors(
            float(np.sqrt(np.mean(e_real**2))),
            float(np.sqrt(np.mean(e_imaginary**2))),
            float(np.max(np.abs(e_real))),
            float(np.max(np.abs(e_imaginary))),
        )
        return result

    # ---- out ---------------------------------------------------------------------------------

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
            Temperature of the simulation; needs `wlf`.
        wlf : WLF or (c1, c2, t_ref), optional
            Constants the program shifts the times with; needs `temperature`.

        Returns
        -------
        str
            Numbers are written so that they are read back exactly.

        Raises
        ------
        ValueError
            If the temperature is given without `wlf` or the other way round, or a value is out of
            range.

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
        if self._g.size:
            lines.append(_wrapped("prony_g", self._g))
            lines.append(_wrapped("prony_tau", self._tau))
        if (temperature is None) != (wlf is None):
            raise ValueError("temperature and wlf: give both or none of them")
        if temperature is not None and wlf is not None:
            constants = WLF(*(number("wlf", value) for value in wlf))
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
            Where to draw; a new figure by default.
        omega : array_like, optional
            Frequencies, rad/s; by default two decades beyond the arms.

        Returns
        -------
        matplotlib Axes
            The axes of the moduli; tan delta has a twin axis on the right.
        """
        import matplotlib.pyplot as plt

        if omega is None:
            ends = (1.0, 1.0) if not self._tau.size else (self._tau.max(), self._tau.min())
            frequency = np.geomspace(1e-2 / ends[0], 1e2 / ends[1], 400)
        else:
            frequency = array_of("omega", omega, low=0.0, low_open=True, ndim=1)
        if ax is None:
            _, ax = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
        modulus = self.complex_modulus(frequency)
        lines = ax.loglog(frequency, modulus.real, color="C0", label="storage modulus $G'$")
        if self._tau.size:
            lines += ax.loglog(frequency, modulus.imag, color="C1", label="loss modulus $G''$")
            lines += ax.loglog(
                1.0 / self._tau, self._g, "k.", markersize=4, label=r"arms $(1/\tau_k, g_k)$"
            )
            twin = ax.twinx()
            lines += twin.semilogx(
                frequency, modulus.imag / modulus.real, "C2--", label=r"$\tan\delta$"
            )
            twin.set_ylabel(r"loss factor $\tan\delta$ (-)")
            twin.set_ylim(bottom=0.0)
            low = 0.3 * min(self._g[self._g > 0].min(initial=np.inf), modulus.real.min())
            ax.set_ylim(low, 2.0 * modulus.real.max())
        ax.set_xlim(frequency[0], frequency[-1])
        ax.set_xlabel(r"angular frequency $\omega$ (rad/s)")
        ax.set_ylabel("shear modulus (Pa)")
        ax.legend(lines, [str(line.get_label()) for line in lines], **_LEGEND_ABOVE)
        return ax


def _wrapped(name: str, values: FloatArray) -> str:
    """Return `name = v1, v2, ...`, three values a line."""
    texts = [repr(float(value)) for value in values]
    rows = [", ".join(texts[i : i + 3]) for i in range(0, len(texts), 3)]
    return f"{name} = " + (",\n" + " " * (6 + len(name))).join(rows)


def _retardation_spectrum(
    g_inf: float, g: FloatArray, tau: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return retardation times, compliances and fluidity of a Prony series.

    With s J~(s) s G~(s) = 1, the retardation rates x are the roots of
    g_inf + sum g x/(x - 1/tau) = 0, one below each relaxation rate and above the one before.
    Each root is sought as its distance from the nearer relaxation rate, on a log scale, so that
    nothing cancels however far apart or close together the times are.
    """
    used = g > 0.0
    rates, inverse = np.unique(1.0 / tau[used], return_inverse=True)
    moduli = np.bincount(inverse, weights=g[used], minlength=rates.size)
    solid = g_inf > 0.0
    fluidity = 0.0 if solid else 1.0 / float(np.sum(moduli / rates))
    theta: list[float] = []
    compliance: list[float] = []
    for j in range(0 if solid else 1, rates.size):
        below = rates[j - 1] if j else 0.0
        half = 0.5 * (rates[j] - below)
        from_rates = np.array([below - rates, rates[j] - rates])

        def balance(offset: float, side: int, below=below, j=j, from_rates=from_rates) -> float:
            x = (rates[j] if side else below) + offset
            return g_inf + float(np.sum(moduli * (x / (from_rates[side] + offset))))

        side = 1 if balance(half, 0) > 0.0 else 0
        sign = -1.0 if side else 1.0

        def logarithmic(y: float, side=side, sign=sign, balance=balance) -> float:
            return balance(sign * math.exp(y), side)

        top = math.log(half)
        bottom = top - 160.0
        if logarithmic(bottom) * logarithmic(top) >= 0.0:
            root = bottom if abs(logarithmic(bottom)) < abs(logarithmic(top)) else top
        else:
            root = brentq(logarithmic, bottom, top, xtol=1e-15, rtol=1e-15, maxiter=500)
        offset = sign * math.exp(root)
        x = (rates[j] if side else below) + offset
        slope = float(np.sum(moduli * rates / (from_rates[side] + offset) ** 2))
        theta.append(1.0 / x)
        compliance.append(1.0 / (x * slope))
    return np.array(theta), np.array(compliance), fluidity


class MasterCurve(NamedTuple):
    """Measurements at several temperatures, brought to one reference temperature.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Reduced frequencies omega a_T, rad/s, ascending.
    storage, loss : ndarray, shape (n,)
        G' and G'', Pa.
    temperatures : ndarray, shape (m,)
        Temperatures, ascending.
    log_shift : ndarray, shape (m,)
        log10 a_T of each temperature.
    wlf : WLF or None
        Law fitted to the shifts; None with fewer than three temperatures or where no law with
        c1, c2 > 0 fits.
    overlap_error : float
        Rms distance of neighbouring curves in log10 of the modulus, where they overlap.
    """

    omega: FloatArray
    storage: FloatArray
    loss: FloatArray
    temperatures: FloatArray
    log_shift: FloatArray
    wlf: WLF | None
    overlap_error: float


def master_curve(
    temperatures: ArrayLike,
    omega: Sequence[ArrayLike],
    storage: Sequence[ArrayLike],
    loss: Sequence[ArrayLike],
    reference: float,
) -> MasterCurve:
    """Shift DMA sweeps at several temperatures along the frequency axis onto one curve.

    Each sweep is shifted onto its neighbour nearer to the reference: the shift minimises the
    mean squared distance of log G' and log G'' over the overlap. No vertical shift.

    Parameters
    ----------
    temperatures : array_like, shape (m,)
        One a sweep, different from each other.
    omega, storage, loss : sequence of m array_like
        Angular frequencies (rad/s), G' and G'' (Pa) of each sweep; all > 0, at least three points.
    reference : float
        Reference temperature: one of `temperatures`.

    Returns
    -------
    MasterCurve
        `Prony.fit(curve.omega, curve.storage, curve.loss)` makes a material of it.

    Raises
    ------
    ValueError
        If shapes differ, values are out of range or `reference` is not among the temperatures.

    Examples
    --------
    >>> rubber, wlf = Prony(1e6, [2e6, 4e6, 2e6], [1e-3, 1e-2, 1e-1]), WLF(8.0, 120.0, 20.0)
    >>> t, w = [10.0, 20.0, 30.0, 40.0], np.logspace(-1, 3, 30)
    >>> cold = [rubber.shifted(x, wlf) for x in t]
    >>> curve = master_curve(t, [w] * 4, [m.storage_modulus(w) for m in cold],
    ...                      [m.loss_modulus(w) for m in cold], 20.0)
    >>> bool(np.allclose(curve.log_shift, np.log10(wlf.shift_factor(t)), atol=0.02))
    True
    """
    values = array_of("temperatures", temperatures, ndim=1)
    count = values.size
    for name, sweeps in (("omega", omega), ("storage", storage), ("loss", loss)):
        if len(sweeps) != count:
            raise ValueError(f"{name}: has {len(sweeps)} sweeps, must have {count}")
    order = np.argsort(values)
    values = values[order]
    if np.any(np.diff(values) == 0.0):
        raise ValueError("temperatures: two are equal: must differ")
    match = np.flatnonzero(values == number("reference", reference))
    if not match.size:
        raise ValueError(
            f"reference = {reference!r}: must be one of the temperatures {values.tolist()}"
        )
    sweeps_log: list[tuple[FloatArray, FloatArray]] = []
    for i in order:
        columns = []
        for name, sweeps in (("omega", omega), ("storage", storage), ("loss", loss)):
            columns.append(
                np.log10(array_of(f"{name}[{i}]", sweeps[i], low=0.0, low_open=True, ndim=1))
            )
        if len({column.size for column in columns}) != 1 or columns[0].size < 3:
            raise ValueError(
                f"sweep {i}: omega, storage, loss have {[c.size for c in columns]} values:"
                " must have the same number, at least 3"
            )
        sort = np.argsort(columns[0])
        sweeps_log.append((columns[0][sort], np.array(columns[1:])[:, sort]))

    start = int(match[0])
    shift = np.zeros(count)
    squares: list[float] = []
    for direction, stop in ((1, count), (-1, -1)):
        for i in range(start + direction, stop, direction):
            step, error = _overlay(sweeps_log[i - direction], sweeps_log[i])
            shift[i] = shift[i - direction] + step
            squares.append(error)
    reduced = np.concatenate([x + s for (x, _), s in zip(sweeps_log, shift, strict=True)])
    moduli = 10.0 ** np.concatenate([y for _, y in sweeps_log], axis=1)
    sort = np.argsort(reduced, kind="stable")
    return MasterCurve(
        10.0 ** reduced[sort],
        moduli[0, sort],
        moduli[1, sort],
        values,
        shift,
        _fit_wlf(values, shift, float(reference)),
        float(np.sqrt(np.mean(squares))) if squares else 0.0,
    )


def _overlay(
    fixed: tuple[FloatArray, FloatArray], moving: tuple[FloatArray, FloatArray]
) -> tuple[float, float]:
    """Return the shift in log10 frequency from `moving` to `fixed`, and the mean square left."""
    x_fixed, y_fixed = fixed
    x_moving, y_moving = moving

    def distance(shift: float) -> float:
        low = max(x_fixed[0], x_moving[0] + shift)
        high = min(x_fixed[-1], x_moving[-1] + shift)
        x = np.linspace(low, high, 200)
        total = 0.0
        for a, b in zip(y_fixed, y_moving, strict=True):
            apart = np.interp(x, x_fixed, a) - np.interp(x - shift, x_moving, b)
            total += float(np.mean(apart**2))
        return 0.5 * total

    # at least a tenth of the shorter sweep overlaps
    margin = 0.1 * min(np.ptp(x_fixed), np.ptp(x_moving))
    lowest = x_fixed[0] - x_moving[-1] + margin
    highest = x_fixed[-1] - x_moving[0] - margin
    trial = np.linspace(lowest, highest, 401)
    near = int(np.argmin([distance(s) for s in trial]))
    bounds = (trial[max(near - 1, 0)], trial[min(near + 1, trial.size - 1)])
    found = minimize_scalar(distance, bounds=bounds, method="bounded", options={"xatol": 1e-8})
    return float(found.x), float(found.fun)


def _fit_wlf(temperatures: FloatArray, log_shift: FloatArray, reference: float) -> WLF | None:
    """Return the WLF constants nearest to the shifts, or None."""
    difference = temperatures - reference
    if difference.size < 3:
        return None
    lowest = max(0.0, -float(difference.min()))

    def residual(unknowns: FloatArray) -> FloatArray:
        c1, c2 = np.exp(unknowns)
        return c1 * difference / (c2 + lowest + difference) + log_shift

    found = least_squares(residual, np.log([10.0, 100.0]), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    c1, c2 = np.exp(found.x)
    if not found.success or c1 > 1e4 or c1 < 1e-6:
        return None
    return WLF(float(c1), float(c2 + lowest), reference)
