"""Gathering of the results of runs into a friction curve."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import theory
from ..base.library import version
from ..results import Run
from ..results.friction_curve import FrictionCurve
from ..roads.joins import load_at_join
from ..roads.patches import Patch
from ..roads.spectra import Spectrum
from .plan import CurvePlan
from .remarks import remarks_of
from .running import Piece

__all__ = ["GAMMA", "gather"]

FloatArray = NDArray[np.float64]

#: Factor of Yang and Persson in the theory that is compared with the runs; the thesis uses 0.45.
GAMMA = 0.45

_MUCH = 0.5     # friction of the omitted waves over that of the others above which a note is given
_NAMES = ("friction", "friction_viscous", "contact_area", "mean_gap")


def gather(plan: CurvePlan, pieces: list[tuple[Piece, Patch]], extend: float | None = None
           ) -> FrictionCurve:
    """Return the curve.

    Parameters
    ----------
    plan : CurvePlan
        What was run.
    pieces : list of (Piece, Patch)
        The runs.
    extend : float, optional
        Shortest wavelength (m) to which the spectrum of the road is extrapolated in order to
        estimate the friction of the omitted waves.

    Returns
    -------
    FrictionCurve
    """
    axes = (plan.pressure.size, plan.temperature.size, plan.speed.size)
    values = {name: np.full((*axes, plan.patches), math.nan)
              for name in (*_NAMES, "friction_loss")}
    sources: dict[tuple[int, int, int], tuple[Path, int]] = {}
    results: list[tuple[Piece, int, Run]] = []
    for piece, _ in pieces:
        run, rows, _ = piece.rows()
        for row in range(rows):
            at = (piece.i, piece.j, piece.first + row)
            for name in _NAMES:
                values[name][(*at, piece.patch)] = run.history[name][row]
            work = plan.pressure[at[0]] * run.grid.lx * run.grid.ly * plan.speed[at[2]]
            values["friction_loss"][(*at, piece.patch)] = run.history["power_viscous"][row] / work
            if piece.patch == 0:
                sources[at] = (piece.job.path, int(run.history["step"][row]))
        results.append((piece, rows, run))
    values["friction_interface"] = values["friction"] - values["friction_viscous"]
    notes = [*plan.all_notes, *_join_note(plan, results)]
    losses, octave = _losses(plan, results)
    curve = FrictionCurve(
        plan.pressure, plan.temperature, plan.speed, _labels(pieces), values,
        _theory(plan, pieces, extend), losses, octave, plan.compound.series.tau,
        np.array([plan.compound.a_t(float(t)) for t in plan.temperature]),
        np.array([plan.compound.b_t(float(t)) for t in plan.temperature]), sources,
        _settings(plan, extend), notes, remarks_of(plan, [piece for piece, _ in pieces]))
    curve.notes.extend(_left_out_note(curve.mean("friction")[0], curve.theory["friction_left_out"]))
    return curve


def _labels(pieces: list[tuple[Piece, Patch]]) -> list[str]:
    """Return the origin of each patch."""
    return list({piece.patch: patch.label for piece, patch in pieces}.values())


def _settings(plan: CurvePlan, extend: float | None) -> dict[str, Any]:
    """Return the settings of the curve."""
    patch = plan.road.patch(0)
    ny, nx = patch.height.shape
    return {
        "title": f"{plan.compound.name} on {plan.road.name}", "road": plan.road.name,
        "rubber": plan.compound.name, "nx": nx, "ny": ny, "lx": patch.lx, "ly": patch.ly,
        "join": plan.road.join, "shortest_wave": plan.road.short,
        "coefficient": plan.coefficient, "slope_effect": plan.slope_effect, "angle": plan.angle,
        "tolerance": plan.tolerance, "poisson": plan.compound.poisson, "gamma_persson": GAMMA,
        "extended_to": "no" if extend is None else extend, "source": f"asperity {version()}"}


def _mean_spectrum(patches: list[Patch]) -> tuple[FloatArray, FloatArray]:
    """Return the mean spectrum of patches of the same size."""
    found = [theory.surface_psd(patch.height, patch.lx, patch.ly) for patch in patches]
    wave = found[0][0]
    same = [psd for k, psd in found if k.shape == wave.shape and np.allclose(k, wave, rtol=1e-6)]
    return wave, np.mean(same, axis=0)


def _theory(plan: CurvePlan, pieces: list[tuple[Piece, Patch]], extend: float | None
            ) -> dict[str, FloatArray]:
    """Return Persson's theory for the patches, and its estimate for the omitted waves."""
    patches = list({piece.patch: patch for piece, patch in pieces}.values())
    spectrum = _mean_spectrum(patches)
    whole = plan.road.whole_spectrum
    if extend is not None:
        whole = whole.extended(extend)
    long = max(patches[0].lx, patches[0].ly)
    axes = (plan.pressure.size, plan.temperature.size, plan.speed.size)
    found = {name: np.zeros(axes) for name in ("friction_persson", "area_persson",
                                               "friction_left_out")}
    for j, celsius in enumerate(plan.temperature):
        series = plan.compound.at(float(celsius))

        def solve(k: FloatArray, psd: FloatArray, series=series) -> theory.PerssonContact:
            return theory.persson(k, psd, series, plan.pressure[:, None], plan.speed,
                                  poisson=plan.compound.poisson, gamma=GAMMA)

        contact = solve(*spectrum)
        found["friction_persson"][:, j] = contact.friction
        found["area_persson"][:, j] = contact.contact_area
        kept = whole.cut(long, plan.road.short)
        if _is_wider(whole, kept):
            found["friction_left_out"][:, j] = (
                solve(whole.wavenumber, whole.psd).friction
                - solve(kept.wavenumber, kept.psd).friction)
    return found


def _left_out_note(friction: FloatArray, left_out: FloatArray) -> list[str]:
    """Return a note if the omitted waves would add much to the friction, by Persson's theory."""
    much = left_out > _MUCH * np.abs(friction)
    if not much.any():
        return []
    at = np.unravel_index(int(np.argmax(np.where(much, left_out, -math.inf))), left_out.shape)
    return [f"by Persson's theory the waves that the patches leave out would add up to"
            f" {left_out[at]:.2g} to the friction, where it is {friction[at]:.2g}: patches with"
            " more cells (--cells) contain more of them"]


def _is_wider(whole: Spectrum, kept: Spectrum) -> bool:
    """Return whether a spectrum has waves that another one does not contain."""
    return (whole.wavenumber[0] < 0.999 * kept.wavenumber[0]
            or whole.wavenumber[-1] > 1.001 * kept.wavenumber[-1])


def _join_note(plan: CurvePlan, results: list[tuple[Piece, int, Run]]) -> list[str]:
    """Return a note on the share of the load that the joins of the patches carry."""
    if plan.road.join == "none":
        return []
    shares = [load_at_join(run.snapshots[-1].pressure, plan.road.join)
              for _, rows, run in results if rows and len(run.snapshots)]
    if not shares:
        return []
    load, area = np.mean(shares, axis=0)
    return [f"the patches are made periodic by {plan.road.join!r}: {100 * load:.1f} % of the load"
            f" lies at the join, on {100 * area:.1f} % of the area"]


def _losses(plan: CurvePlan, results: list[tuple[Piece, int, Run]]
            ) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return the losses by octave and by arm, as means over the patches, and the octaves."""
    axes = (plan.pressure.size, plan.temperature.size, plan.speed.size)
    sums: dict[str, FloatArray] = {}
    count = np.zeros(axes)
    octave = np.zeros(0)
    for piece, rows, run in results:
        for row in range(rows):
            found = run.losses.get(int(run.history["step"][row]))
            if found is None:
                continue
            octave = found.wavelength
            at = (piece.i, piece.j, piece.first + row)
            for name, part in (("loss_octave", found.octave), ("loss_arm", found.arm)):
                table = sums.setdefault(name, np.zeros((*axes, part.size)))
                table[at] += part / (run.grid.lx * run.grid.ly)
            count[at] += 1
    with np.errstate(invalid="ignore", divide="ignore"):
        return {name: table / count[..., None] for name, table in sums.items()}, octave
