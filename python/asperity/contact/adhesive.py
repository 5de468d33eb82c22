"""Elastic normal contact with adhesion, by the Fortran library."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..base import library
from ..base.check import choice, exactly_one, number, positive, stresses_of, whole
from ..base.errors import NotConverged
from ..base.notices import warn_user
from .normal import FloatArray, NormalContact, warn_of_few_cells

__all__ = ["AdhesiveNormalContact", "solve_adhesive"]

POTENTIALS = ("exponential", "gauss", "maugis_dugdale")
STARTS = ("non_adhesive", "full_contact")
INTERVALS = 4096  # number of intervals of the table of a user's attraction

_solve = library.call("contact_adhesive", interruptible=True)


@dataclass(frozen=True)
class AdhesiveNormalContact(NormalContact):
    """A solved contact with adhesion, with the attributes of `NormalContact` and some more.

    `pressure` includes the attraction. ``pressure - adhesive_pressure`` is the pressure of the
    wall, which is zero where the gap is open. The contact area counts the cells whose gap is zero.
    The residual is the largest absolute value of min(gap/range, G range/energy), where G is the
    pressure of the wall. For a function, G is divided by its largest attraction instead.

    Attributes
    ----------
    adhesive_pressure : ndarray
        Attraction -e'(gap), Pa, <= 0.
    energy_adhesive : float
        Energy of adhesion in the area lx by ly, J, <= 0.
    energy_elastic : float
        Elastic energy in this area, J.
    """

    adhesive_pressure: FloatArray = field(repr=False)
    energy_adhesive: float
    energy_elastic: float


def solve_adhesive(
    height: ArrayLike,
    lx: float,
    ly: float | None,
    modulus: float,
    *,
    potential: str | Callable[[FloatArray], ArrayLike] = "exponential",
    energy: float | None = None,
    range: float,
    pressure: float | None = None,
    force: float | None = None,
    displacement: float | None = None,
    boundary: str = "periodic",
    tolerance: float = 1e-6,
    max_iterations: int = 1000,
    method: str = "fast",
    start: str | AdhesiveNormalContact = "non_adhesive",
) -> AdhesiveNormalContact:
    """Press an elastic half-space onto a rigid rough surface that attracts it, or pull it off.

    The solution minimises the energy of the gap (thesis, section 2.3, eq. 2.20 and 2.21). There may
    be several minima, so that the state depends on the starting point (hysteresis).

    Parameters
    ----------
    height : array_like
        Height of the surface, m, shape (ny, nx). With the shape (nx,) or (1, nx) it is a line
        contact in plane strain. Any memory order and any real type are accepted.
    lx : float
        Length along x, m.
    ly : float or None
        Length along y, m; None makes the cells square.
    modulus : float
        Contact modulus E* = E/(1 - nu^2) = 2 G/(1 - nu), Pa.
    potential : str or callable
        'exponential', 'gauss' or 'maugis_dugdale', or a function of your own. The function takes an
        array of gaps, m, and returns the attraction at these gaps, Pa, >= 0. It is called once, for
        4097 equidistant gaps from 0 to `range`; between them the attraction is interpolated.
    energy : float
        Work of adhesion, J/m2, >= 0. It must be left out if `potential` is a function, because it
        is then the integral of the attraction.
    range : float
        Range of the attraction, m. For a function it is the gap beyond which there is no
        attraction. Cells should be smaller than 0.7 modulus range^2/energy (maugis_dugdale: modulus
        range^2/energy; a function: 0.7 modulus over the steepest fall of the attraction in Pa/m).
        Otherwise the edge of the contact sticks to the grid, and a warning says so.
    pressure : float, optional
        Mean pressure, Pa. Give exactly one of `pressure`, `force` and `displacement`.
        A negative pressure or force pulls.
    force : float, optional
        Normal force, N.
    displacement : float, optional
        Approach, counted from the first touch, m.
    boundary : str
        'periodic' or 'free'.
    tolerance : float
        Largest allowed residual, above 0 and below 1.
    max_iterations : int
        Largest number of iterations.
    method : str
        'fast' or 'thesis' ('periodic' only).
    start : str or AdhesiveNormalContact
        Starting point: 'non_adhesive' is the contact without adhesion; 'full_contact'; or the
        solution for a similar load on the same map.

    Returns
    -------
    AdhesiveNormalContact

    Raises
    ------
    ValueError
        If an argument is not allowed.
    NotConverged
        If the tolerance is not reached, or if the surfaces separate under the pull (the reason is
        then 'detached'). From another start they may hold: closed contact bears a larger pull than
        surfaces that only touch. Its ``result`` is the last state.
    KeyboardInterrupt
        If Ctrl-C ends the solver.
    MemoryError
        If there is not enough memory.

    Warns
    -----
    UserWarning
        If the cells are too large for the range of the attraction, or if the patches of contact are
        too few cells across.

    Examples
    --------
    >>> import asperity
    >>> sphere = asperity.surface.shape("paraboloid", 64, lx=40e-6, radius=1e-4, boundary="free")
    >>> contact = asperity.solve_adhesive(sphere, 40e-6, None, 4e6, energy=0.05, range=0.3e-6,
    ...                                   displacement=0.0, boundary="free")
    >>> contact.force < 0 < contact.contact_area
    True

    An attraction that is constant up to a gap of 0.3 um, and then falls linearly to zero:

    >>> import numpy as np
    >>> contact = asperity.solve_adhesive(
    ...     sphere, 40e-6, None, 4e6, displacement=0.0, boundary="free", range=0.6e-6,
    ...     potential=lambda gap: 0.1e6 * np.clip(2 - gap / 0.3e-6, 0, 1))
    >>> contact.force < 0 < contact.contact_area
    True
    """
    array, lx, ly, free = library.contact_map(height, lx, ly, boundary)
    shape = np.shape(height)
    modulus = positive("modulus", modulus)
    range = positive("range", range)
    name, energy, table = _attraction(potential, energy, range)
    tolerance = number("tolerance", tolerance, 0.0, 1.0, low_open=True, high_open=True)
    steps = whole("max_iterations", max_iterations)
    thesis = choice("method", method, ("fast", "thesis")) == "thesis"
    if thesis and free:
        raise ValueError("method = 'thesis': needs boundary = 'periodic'; 'fast' serves both")
    top = float(array.max())
    control, load = exactly_one(pressure=pressure, force=force, displacement=displacement)
    load = number(control, load)
    if control == "displacement" and not free:
        library.check_depth(load, array)
    if control == "force":
        load /= lx * ly

    _look_at_cells(array.shape, lx, ly, modulus, name, energy, range, table)
    traction, gap, attraction = (np.zeros_like(array) for _ in "pga")
    level, origin = _start_from(start, shape, top, traction, gap)
    level, stuck, area, iterations, ffts, residual, seconds, converged, reason = _solve(
        array.T, traction.T, gap.T, attraction.T, lx, ly, free, modulus, name, energy, range,
        table, int(control == "displacement"), load, origin, int(thesis), tolerance, steps, level)
    mean = float(traction.mean())
    displaced = gap + array + level
    result = AdhesiveNormalContact(
        traction.reshape(shape), gap.reshape(shape), displaced.reshape(shape), mean,
        mean * lx * ly, float(level) + top, float(area),
        int(iterations), int(ffts), float(residual), float(seconds), bool(converged),
        reason.decode().strip(), attraction.reshape(shape), float(stuck),
        0.5 * float(np.vdot(traction, displaced)) * lx * ly / array.size)
    if not result.converged:
        raise NotConverged(
            f"the adhesive contact did not converge: {result.reason}; residual"
            f" {result.residual:.2e} after {result.iterations} iterations, tolerance"
            f" {tolerance:.2e}", result)
    warn_of_few_cells(traction, gap, lx, ly, free, adhesive=True)
    return result


def _attraction(potential: str | Callable[[FloatArray], ArrayLike], energy: float | None,
                reach: float) -> tuple[str, float, FloatArray]:
    """Return the name of a potential, its energy and the table of a function.

    The table has the shape (gaps, 2), attraction (Pa) and slope (Pa/m); without a function it is a
    dummy of shape (1, 2).
    """
    if not callable(potential):
        if energy is None:
            raise ValueError("energy: is missing: the work of adhesion, J/m2")
        choice("potential", potential, POTENTIALS)
        return potential, number("energy", energy, 0.0), np.zeros((1, 2), order="F")
    if energy is not None:
        raise ValueError(f"energy = {energy!r}: must be left out where the potential is a function:"
                         " it is the integral of the attraction")
    from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline

    gaps = np.linspace(0.0, reach, INTERVALS + 1)
    try:
        values = stresses_of("potential: the attraction", potential, gaps, "gap", "m")
    except TypeError as error:
        raise ValueError("potential: the function must take an array of gaps and return an array"
                         f" of real numbers: {error}") from error
    values[-1] = 0.0  # there is no attraction beyond the range
    # Akima's slopes do not overshoot beside a jump. The bounds keep every cubic above zero.
    slopes = Akima1DInterpolator(gaps, values).derivative()(gaps)
    steepest = 3.0 * values * INTERVALS / reach
    slopes[:-1] = np.maximum(slopes[:-1], -steepest[:-1])
    slopes[1:] = np.minimum(slopes[1:], steepest[1:])
    work = float(CubicHermiteSpline(gaps, values, slopes).integrate(0.0, reach))
    return "exponential", work, np.asfortranarray(np.stack([values, slopes], axis=1))


def _look_at_cells(shape: tuple[int, int], lx: float, ly: float, modulus: float, potential: str,
                   energy: float, reach: float, table: FloatArray) -> None:
    """Warn if the cells are too large for the range of the attraction."""
    if energy <= 0.0:
        return
    cell = lx / shape[1] if shape[0] == 1 else max(lx / shape[1], ly / shape[0])
    if len(table) > 1:
        fall = -float(np.diff(table[:, 0]).min()) * (len(table) - 1) / reach
        limit = 0.7 * modulus / fall
        formula = "0.7 modulus over the steepest fall of the attraction"
    elif potential == "maugis_dugdale":
        limit, formula = modulus * reach**2 / energy, "modulus range^2/energy"
    else:
        limit, formula = 0.7 * modulus * reach**2 / energy, "0.7 modulus range^2/energy"
    if cell > limit:
        warn_user(f"cells of {cell:.4g} m are larger than {formula} = {limit:.4g} m: the edge of"
                  " the contact sticks to the grid")


def _start_from(start: str | AdhesiveNormalContact, shape: tuple[int, ...], top: float,
                traction: FloatArray, gap: FloatArray) -> tuple[float, int]:
    """Fill in the initial pressure and gap; return the level and the library's code for it."""
    if isinstance(start, AdhesiveNormalContact):
        if start.gap.shape != shape:
            raise ValueError(f"start: has shape {start.gap.shape}: must be {shape}")
        traction[...] = start.pressure.reshape(traction.shape)
        gap[...] = start.gap.reshape(gap.shape)
        return start.displacement - top, 2
    if isinstance(start, str):
        return 0.0, STARTS.index(choice("start", start, STARTS))
    raise ValueError(f"start: is of type {type(start).__name__}: must be one of "
                     f"{', '.join(map(repr, STARTS))} or an AdhesiveNormalContact")
