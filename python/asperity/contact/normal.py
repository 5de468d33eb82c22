"""Elastic normal contact of a height map, by the Fortran library."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import library
from ..base.check import choice, exactly_one, number, positive, whole
from ..base.errors import NotConverged
from ..base.notices import warn_user
from ..base.presenters import present

__all__ = ["NormalContact", "solve_normal"]

FloatArray = NDArray[np.float64]

_solve = library.call("contact_normal", interruptible=True)
_width = library.call("contact_width")


@dataclass(frozen=True)
class NormalContact:
    """A solved normal contact; fields have the shape of the height map.

    Attributes
    ----------
    pressure : ndarray
        Pressure, Pa; it is 0 out of contact.
    gap : ndarray
        Gap between the surfaces, m; in contact it is 0 to the tolerance, and may be slightly
        negative.
    displacement_z : ndarray
        Normal displacement of the surface of the solid, m.
    mean_pressure, force : float
        The load, Pa and N.
    displacement : float
        Approach of the far solid, counted from the first touch, m.
    contact_area : float
        Fraction of the grid in contact.
    iterations : int
        Iterations of the solver.
    ffts : int
        Real transforms of the size of the grid.
    residual : float
        The larger of the relative duality gap and the relative error of the load.
    seconds : float
        Wall time of the solver, s.
    converged : bool
        Whether the residual is within the tolerance.
    reason : str
        Why the solver stopped.
    """

    pressure: FloatArray = field(repr=False)
    gap: FloatArray = field(repr=False)
    displacement_z: FloatArray = field(repr=False)
    mean_pressure: float
    force: float
    displacement: float
    contact_area: float
    iterations: int
    ffts: int
    residual: float
    seconds: float
    converged: bool
    reason: str

    def _repr_html_(self) -> str:
        return present("contact_html", self)


def solve_normal(
    height: ArrayLike,
    lx: float,
    ly: float | None,
    modulus: float,
    *,
    pressure: float | None = None,
    force: float | None = None,
    displacement: float | None = None,
    boundary: str = "periodic",
    tolerance: float = 1e-6,
    max_iterations: int = 1000,
    method: str = "fast",
    start: ArrayLike | NormalContact | None = None,
) -> NormalContact:
    """Press an elastic half-space onto a rigid rough surface, without adhesion and friction.

    The conditions are pressure >= 0, gap >= 0 and pressure gap = 0 (thesis, section 2.1). The
    solver is a preconditioned conjugate gradient method after Polonsky and Keer (Wear 231 (1999)
    206).

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
    pressure : float, optional
        Mean pressure, Pa. Give exactly one of `pressure`, `force` and `displacement`.
    force : float, optional
        Normal force, N.
    displacement : float, optional
        Approach, counted from the first touch, m. At 0 and below nothing touches, and the pressure
        is zero. With ``'periodic'`` it must leave a mean gap, because beyond full contact it does
        not determine the pressure.
    boundary : str
        'periodic' or 'free'.
    tolerance : float
        Largest allowed duality gap over (load times rms height), and largest relative error of the
        load. For a small contact ten times the mean displacement under the load replaces the rms
        height, if it is less. Above 0 and below 1.
    max_iterations : int
        Largest number of iterations.
    method : str
        'fast' or 'thesis'.
    start : array_like or NormalContact, optional
        Initial pressure (Pa, >= 0), for example the solution for a similar load.

    Returns
    -------
    NormalContact
        Pressure, gap, displacement, contact area, and the record of the solver.

    Raises
    ------
    ValueError
        If an argument is not allowed.
    NotConverged
        If the tolerance is not reached. Its ``result`` is the best state.
    KeyboardInterrupt
        If Ctrl-C ends the solver.
    MemoryError
        If there is not enough memory.

    Warns
    -----
    UserWarning
        If the patches of contact are too few cells across.

    Examples
    --------
    >>> import asperity
    >>> sphere = asperity.surface.shape("paraboloid", 64, lx=4e-3, radius=0.05, boundary="free")
    >>> contact = asperity.solve_normal(sphere, 4e-3, None, 344.828e6, force=9.1954,
    ...                                 boundary="free")
    >>> abs(contact.displacement - 2e-5) < 2e-7      # Hertz
    True
    """
    array, lx, ly, free = library.contact_map(height, lx, ly, boundary)
    shape = np.shape(height)
    modulus = positive("modulus", modulus)
    tolerance = number("tolerance", tolerance, 0.0, 1.0, low_open=True, high_open=True)
    steps = whole("max_iterations", max_iterations)
    control, load = exactly_one(pressure=pressure, force=force, displacement=displacement)
    target = number(control, load) if control == "displacement" else positive(control, load)
    top = float(array.max())
    if control == "displacement":
        target -= top
        if not free and load > 0.0:
            library.check_depth(load, array)
    elif control == "force":
        target /= lx * ly

    traction = np.zeros_like(array)
    if start is not None:
        given = start.pressure if isinstance(start, NormalContact) else start
        first = library.height_map(given, "start")
        if first.shape != array.shape:
            raise ValueError(f"start: has shape {np.shape(given)}: must be {shape}")
        if first.min() < 0.0:
            raise ValueError(f"start: has the pressure {first.min()}: must be >= 0")
        traction[...] = first
    gap = np.zeros_like(array)
    level, iterations, ffts, residual, seconds, converged, reason = _solve(
        array.T, traction.T, gap.T, lx, ly, free, modulus, int(control == "displacement"), target,
        int(start is not None), int(choice("method", method, ("fast", "thesis")) == "thesis"),
        tolerance, steps)
    mean = float(traction.mean())
    result = NormalContact(
        traction.reshape(shape), gap.reshape(shape), (gap + array + level).reshape(shape), mean,
        mean * lx * ly, float(level) + top, float(np.count_nonzero(traction) / traction.size),
        int(iterations), int(ffts), float(residual), float(seconds), bool(converged),
        reason.decode().strip())
    if not result.converged:
        raise NotConverged(
            f"the normal contact did not converge: residual {result.residual:.2e} after"
            f" {result.iterations} iterations, tolerance {tolerance:.2e}: {result.reason}", result)
    warn_of_few_cells(traction, gap, lx, ly, free, adhesive=False)
    return result


def warn_of_few_cells(pressure: FloatArray, gap: FloatArray, lx: float, ly: float, free: int, *,
                      adhesive: bool) -> None:
    """Warn if the patches of contact are too few cells across, in the words of the program."""
    (warning,) = _width(pressure.T, gap.T, lx, ly, free, int(adhesive))
    text = warning.decode().strip()
    if text:
        warn_user(text)
