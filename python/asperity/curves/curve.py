"""Friction curves in one call, from files to a data set."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.check import positive, whole
from ..base.names import unknown_name
from ..base.notices import warn_user
from ..results.friction_curve import FrictionCurve
from ..roads.measured import load
from ..runs.means import Means, means_of
from .gathering import gather
from .plan import CurvePlan, plan_curve
from .running import run_pieces
from .sources import compound_of, road_of

if TYPE_CHECKING:
    import xarray

__all__ = ["first_plan", "friction_curve", "run_curve"]

MOST_PATCHES = 64       # that are taken for the sake of `error`
# Patches to begin with for the sake of `error`. An interval that is small enough by chance ends the
# search. With 2 patches to begin with, clearly fewer than 95 % of such intervals cover the mean.
FIRST_PATCHES = 8


def friction_curve(
    roads: Any,
    material: Any,
    *,
    speeds: Sequence[float],
    pressures: Sequence[float],
    temperatures: Sequence[float] | None = None,
    coefficient: float = 0.0,
    slope_effect: bool = False,
    cells: int = 512,
    patches: int = 8,
    side: float | None = None,
    angle: float | None = None,
    join: str | None = None,
    short: float | None = None,
    outliers: str = "report",
    draw: bool = False,
    extend: float | None = None,
    wlf: Sequence[float] | None = None,
    reference: float | None = None,
    vertical: bool = False,
    temperature_tolerance: float | None = None,
    tolerance: float = 1e-5,
    error: float | None = None,
    seed: int = 1,
    folder: str | Path = "friction_runs",
    jobs: int | None = None,
    threads: int = 1,
    resume: bool = True,
    executor: Executor | None = None,
    slurm: str | None = None,
    quiet: bool = False,
    **options: Any,
) -> xarray.Dataset:
    """Return the friction of steady sliding against speed, pressure and temperature.

    Every point is a state of steady sliding on a patch of the road. The results of the runs are in
    `folder`. After an interruption the same call resumes where it stopped, and you can add patches
    or pressures later.

    Parameters
    ----------
    roads : str, path, MeasuredSurface, asperity.roads.spectra.Spectrum, or a list of them
        Measured maps in any format that `asperity.surface.load` reads; ``"spectrum:FILE"``;
        ``"self_affine:hurst=0.8,wavelength_long=1e-3,wavelength_short=1e-5,rms_slope=0.2"``;
        profiles, which stand for isotropic roads.
    material : str, Path, Prony or asperity.rubber.compound.Compound
        A namelist with ``&material``, a DMA table, or a Prony series.
    speeds, pressures : array_like
        Speeds, m/s, and pressures, Pa. The result has them in rising order.
    temperatures : array_like, optional
        Temperatures, C; by default that of the rubber.
    coefficient : float
        Coefficient of Coulomb's law in the interface. With 0 the result is the viscous friction
        alone.
    slope_effect : bool
        Let that law act on the true slope of the road. Only with a coefficient above 0.
    cells, patches : int
        Number of cells along a side of a patch, and number of patches.
    side, short : float, optional
        Length of a side of drawn patches, and shortest wave that is kept, m.
    angle : float, optional
        Angle between the velocity of the road and x, degrees; by default 0 on measured maps and
        31.7 on drawn ones.
    join : str, optional
        How patches of measured maps are made periodic: 'seam', 'blend', 'smooth', 'mirror',
        'window', or 'none', which leaves a step at the edges of maps that are not periodic.
    outliers : {'report', 'remove'}
        What to do about single cells of maps, or points of profiles, that differ strongly from
        their neighbours.
    draw : bool
        Draw random maps from the combined spectrum of the roads instead of cutting patches.
    extend : float, optional
        Shortest wavelength, m, to which the spectrum is extrapolated for ``friction_left_out``, the
        friction that the omitted waves would add; shorter than all waves of the spectrum.
    wlf, reference, vertical, temperature_tolerance
        Options of the fit of a DMA table, see `asperity.dma.fit_dma`.
    tolerance : float
        Tolerance of the solver.
    error : float, optional
        Use at least 8 patches, and add more, up to 64, until half of the 95 % interval of the
        friction is below this value everywhere.
    seed : int
        Seed that selects the patches. The same seed gives the same numbers to the last bit.
    folder : str or path
        Folder of maps, inputs and results.
    jobs, threads, resume, executor, slurm, quiet
        See `asperity.sweep`. By default there are as many runs at a time as processors.
    **options
        Options of `asperity.surface.load`, such as `unit` and `size`. By default maps that are not
        periodic lose their mean plane (`level`).

    Returns
    -------
    xarray.Dataset
        The dimensions are pressure, temperature, speed and patch; see
        `asperity.results.friction_curve.FrictionCurve.to_xarray`.

    Raises
    ------
    ValueError, OSError
        If an argument is wrong, or a file cannot be read.
    RuntimeError
        If runs fail, or were submitted to Slurm and are not there yet.

    Warns
    -----
    UserWarning
        For each kind of warning of the runs, and each reason of states without a solution, with the
        points that it concerns. The variables `warned` and `converged` contain the same.
    """
    means = means_of(jobs, threads, resume, executor, slurm)
    _check_names(options)
    sources = list(roads) if isinstance(roads, list | tuple) else [roads]
    road = road_of(sources, cells=cells, side=side, join=join, short=short, outliers=outliers,
                   draw=draw, seed=seed, **options)
    compound = compound_of(material, wlf=wlf, reference=reference, vertical=vertical,
                           temperature_tolerance=temperature_tolerance)
    plan = plan_curve(road, compound, speeds=speeds, pressures=pressures,
                      temperatures=temperatures, patches=patches, coefficient=coefficient,
                      slope_effect=slope_effect, angle=angle, tolerance=tolerance)
    curve = run_curve(plan, folder, means, error=error, extend=extend, quiet=quiet)
    for line in curve.warnings:
        warn_user(line)
    return curve.to_xarray()


def _check_names(options: dict[str, Any]) -> None:
    """Refuse options that neither `friction_curve` nor `asperity.surface.load` has."""
    of_maps = tuple(signature(load).parameters)[1:]
    own = tuple(signature(friction_curve).parameters)[:-1]
    for name in options:
        if name not in of_maps:
            raise ValueError(unknown_name("option", name, (*own, *of_maps)))


def first_plan(
    plan: CurvePlan,
    error: float | None = None,
    extend: float | None = None,
    most_patches: int = MOST_PATCHES,
) -> CurvePlan:
    """Return the plan of the runs to begin with: with `error` it has at least 8 patches.

    Parameters
    ----------
    plan : CurvePlan
        See `asperity.curves.plan_curve`.
    error, extend, most_patches
        As in `run_curve`. Wrong values raise an error here, before anything runs.

    Returns
    -------
    CurvePlan

    Raises
    ------
    ValueError
        If an argument is not allowed.
    """
    whole("most_patches", most_patches)
    shortest = plan.road.whole_spectrum.band[1]
    if extend is not None and not positive("extend", extend) < shortest:
        raise ValueError(f"extend = {extend:g}: must be shorter than the shortest wave of the"
                         f" spectrum of the road, {shortest:.4g} m (extend, --extend)")
    if error is None:
        return plan
    positive("error", error)
    first = min(FIRST_PATCHES, most_patches, plan.road.count or FIRST_PATCHES)
    return replace(plan, patches=max(plan.patches, first))


def run_curve(
    plan: CurvePlan,
    folder: str | Path,
    means: Means,
    *,
    error: float | None = None,
    most_patches: int = MOST_PATCHES,
    extend: float | None = None,
    quiet: bool = False,
) -> FrictionCurve:
    """Run a plan and return the curve.

    Parameters
    ----------
    plan : CurvePlan
        See `asperity.curves.plan_curve`.
    folder : str or path
        Where maps, inputs and results lie.
    means : Means
        The way in which jobs are run.
    error : float, optional
        Largest allowed half of the 95 % interval of the friction; patches are added until it is
        met.
    most_patches : int
        Largest number of patches.
    extend : float, optional
        See `friction_curve`.
    quiet : bool
        Show no progress.

    Returns
    -------
    FrictionCurve

    Raises
    ------
    ValueError
        If an argument is not allowed.
    RuntimeError
        If runs fail, or were submitted to Slurm and are not complete.
    """
    plan = first_plan(plan, error, extend, most_patches)
    renewed: set[str] = set()  # with more patches, the runs of the first ones are not repeated
    while True:
        curve = gather(plan, run_pieces(plan, Path(folder), means, quiet, renewed), extend)
        found = curve.largest_error
        limit = min(most_patches, plan.road.count or most_patches)
        if error is None or found <= error:
            return curve
        if plan.patches >= limit:
            curve.notes.append(f"half of the 95 % interval of friction is {found:.3g}, not below"
                               f" {error:g}: {plan.patches} patches are the most"
                               + (" that the road has" if plan.road.count == limit else ""))
            return curve
        wanted = 2 * plan.patches
        if math.isfinite(found):
            wanted = min(wanted, math.ceil(plan.patches * (found / error) ** 2))
        plan = replace(plan, patches=min(limit, max(wanted, plan.patches + 1)))
