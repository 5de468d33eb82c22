"""Elastic normal contact of a height map, by the Fortran library."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import library
from ..base.check import choice, exactly_one, positive, whole
from ..base.errors import NotConverged
from ..base.presenters import present

__all__ = ["NormalContact", "solve_normal"]

FloatArray = NDArray[np.float64]

_solve = library.call("contact_normal", interruptible=True)


@dataclass(frozen=True)
class NormalContact:
    """A solved normal contact; fields have the shape of the height map.

    Attributes
    ----------
    pressure : ndarray
        Pressure, Pa, 0 out of contact.
    gap : ndarray
        Gap between the surfaces, m; 0 in contact within the tolerance.
    displacement_z : ndarray
        Normal displacement of the surface of the solid, m.
    mean_pressure, force : float
        The load, Pa and N.
    displacement : float
        Approach of the far solid from the first touch, m.
    contact_area : float
        Fraction of the grid in contact.
    iterations : int
        Iterations of the solver.
    ffts : int
        Real transforms of the size of the grid.
    residual : float
        The larger of the duality gap and the load's error, both relative.
    seconds : float
        Wall time of the solver, s.
    converged : bool
        Whether the residual is within the tolerance.
    reason : str
        Why the solver came back.
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
    """Press an elastic half-space on a rigid rough surface, without adhesion and friction.

    Parameters
    ----------
    height : array_like
        Height of the surface, m, shape (ny, nx); (nx,) or (1, nx) is a plane-strain line
        contact. Any memory order and any real type.
    lx, ly : float
        Lengths, m; ``ly = None`` means square cells.
    modulus : float
        Contact modulus E* = E/(1 - nu^2) = 2 G/(1 - nu), Pa.
    pressure, force, displacement : float
        The load, one of: mean pressure, Pa; force, N; approach from the first touch, m.
    boundary : str
        'periodic' or 'free'.
    tolerance : float
        Of the duality gap over load times rms height, and of the load.
    max_iterations : int
        Most iterations.
    method : str
        'fast' or 'thesis'.
    start : array_like or NormalContact, optional
        A pressure to start from, such as the solution of a similar load.

    Returns
    -------
    NormalContact
        Pressure, gap, displacement, contact area and what the solver did.

    Raises
    ------
    ValueError
        If an argument is wrong.
    NotConverged
        If the tolerance is not reached; its ``result`` holds the best state.

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
    tolerance = positive("tolerance", tolerance)
    steps = whole("max_iterations", max_iterations)
    control = exactly_one(pressure=pressure, force=force, displacement=displacement)
    top = float(array.max())
    if control == "displacement":
        target = positive("displacement", displacement) - top
        if not free:
            library.check_depth(displacement, array)
    elif control == "force":
        target = positive("force", force) / (lx * ly)
    else:
        target = positive("pressure", pressure)

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
    return result
