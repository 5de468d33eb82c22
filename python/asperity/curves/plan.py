"""The plan of a friction curve: its runs, and how much time and memory they will take."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.check import array_of, number, positive, whole
from ..base.durations import duration
from ..base.names import counted
from ..roads.patches import DrawnRoad, MeasuredRoad, Patch
from ..roads.statistics import statistics
from ..rubber.compound import Compound
from ..rubber.dma_columns import ABSOLUTE_ZERO
from ..runs.case import Case

__all__ = ["CurvePlan", "plan_curve"]

FloatArray = NDArray[np.float64]

# Mean number of real transforms of a steady state in a curve over 6 decades of speed, with and
# without friction, for an elastic rubber and 128 cells per side; the exponent of the ratio of the
# glassy to the relaxed modulus that multiplies it; and that of the number of cells per side over
# 128. Measured on self-affine roads with 64 to 512 cells per side and rubbers of 1 to 12 arms with
# ratios of 1.1 to 1000. With the friction law on the true slope there are more by a factor.
_TRANSFORMS = {True: (220.0, 0.08, 0.25), False: (50.0, 0.1, 0.4)}
_ON_SLOPES = 1.5
# Processor time per transform, with all other work on the cells, over that of a real transform by
# NumPy; and the time to begin a run and to gather it, s; and to begin the command, s.
_OTHER_WORK = 8.0
_RUN, _COMMAND = 0.02, 2.5
_RANGE = 1e-30, 1e30    # allowed speeds, m/s, and pressures, Pa
_LARGEST_COEFFICIENT = 1000.0  # that of steady phases
# Pressures over the relaxed modulus G beyond which one of them may be in another unit. The program
# warns of its runs above 10 E*, which is 40 G if the rubber is incompressible.
_MOST_PRESSURE, _LEAST_PRESSURE = 40.0, 1e-5
_MOST_SPEED = 100.0     # m/s, far above the speed of shear waves in rubber
_STEEP = 3.0            # rms slope far beyond what a theory for small slopes describes
_WEDGING = 0.4          # coefficient times rms slope from which a road may wedge the rubber
_COMMAND_MEMORY = 130e6  # bytes, for the command itself


@dataclass(frozen=True)
class CurvePlan:
    """A friction curve before it is run.

    Attributes
    ----------
    road : DrawnRoad or MeasuredRoad
        The road.
    compound : Compound
        The rubber.
    speed, pressure, temperature : ndarray
        Axes of the curve: m/s, Pa, C.
    patches : int
        Number of patches to begin with.
    coefficient : float
        Coefficient of Coulomb's law in the interface; with 0 there is no friction in it.
    slope_effect : bool
        Whether the law acts on the true slope.
    angle : float
        Angle between the velocity of the road and x, degrees.
    tolerance : float
        Tolerance of the solver.
    notes : list of str
        Remarks for the user.
    """

    road: DrawnRoad | MeasuredRoad
    compound: Compound
    speed: FloatArray
    pressure: FloatArray
    temperature: FloatArray
    patches: int
    coefficient: float = 0.0
    slope_effect: bool = False
    angle: float = 0.0
    tolerance: float = 1e-5
    notes: list[str] = field(default_factory=list)

    @property
    def solves(self) -> int:
        """Number of steady states."""
        return self.patches * self.speed.size * self.pressure.size * self.temperature.size

    @property
    def all_notes(self) -> list[str]:
        """Remarks about the road, the rubber and the plan, each once."""
        return list(dict.fromkeys([*self.road.notes, *self.compound.notes, *self.notes]))

    def case(self, patch: Patch, file: str, i: int, j: int, first: int = 0) -> Case:
        """Return the case of a patch at one pressure and temperature: a phase for each speed.

        Parameters
        ----------
        patch : Patch
            The map.
        file : str
            Name of its file in the input.
        i, j : int
            Indices of the pressure and the temperature.
        first : int
            Index of the first speed.

        Returns
        -------
        Case
        """
        ny, nx = patch.height.shape
        series = self.compound.at(float(self.temperature[j]))
        along, across = (math.cos(math.radians(self.angle)), math.sin(math.radians(self.angle)))
        phases: list[dict[str, Any]] = []
        for speed in self.speed[first:]:
            phase = dict(steady=True, pressure=float(self.pressure[i]),
                         velocity_x=float(speed) * along)
            if self.angle:
                phase["velocity_y"] = float(speed) * across
            phases.append(phase)
        groups: dict[str, Any] = dict(
            grid=dict(nx=nx, ny=ny, lx=patch.lx, ly=patch.ly),
            surface=dict(shape="file", file=file),
            material=dict(poisson=self.compound.poisson, shear_modulus=series.g_inf),
            phase=phases, solver=dict(tolerance=self.tolerance),
            output=dict(snapshot_fields=["pressure"], snapshot_every=0))
        if series.g.size:
            groups["material"] |= dict(prony_g=series.g, prony_tau=series.tau)
        label = f"{patch.label}, {self.pressure[i]:g} Pa"
        celsius = float(self.temperature[j])
        if math.isfinite(celsius):
            # The series is that of this temperature already.
            groups["material"] |= dict(temperature=celsius, reference_temperature=celsius)
            label += f", {celsius:g} °C"
        if self.coefficient > 0.0:
            groups["friction"] = dict(law="coulomb", coefficient=self.coefficient,
                                      slope_effect=self.slope_effect)
        return Case(title=label, **groups)

    def transforms(self, celsius: float) -> float:
        """Return the estimated mean number of real transforms of a steady state.

        The estimate follows from the cells, the law and the ratio of the glassy modulus to the
        relaxed one. For several speeds in a row it is right within a factor of 2.5.

        Parameters
        ----------
        celsius : float
            Temperature, C.

        Returns
        -------
        float
        """
        ny, nx = self.road.patch(0).height.shape
        series = self.compound.at(celsius)
        moduli = 1.0 + float(np.sum(series.g)) / series.g_inf
        elastic, by_moduli, by_cells = _TRANSFORMS[self.coefficient > 0.0]
        transforms = elastic * moduli ** by_moduli * (max(nx, ny) / 128) ** by_cells
        return transforms * (_ON_SLOPES if self.slope_effect else 1.0)

    def seconds(self) -> float:
        """Return the estimated processor time of all solves on this machine, s."""
        ny, nx = self.road.patch(0).height.shape
        field_ = np.random.default_rng(1).standard_normal((ny, nx))
        tries = []
        for _ in range(9):
            start = time.process_time()
            np.fft.irfft2(np.fft.rfft2(field_), s=field_.shape)
            tries.append(time.process_time() - start)
        transforms = np.mean([self.transforms(float(celsius)) for celsius in self.temperature])
        # The least time: other programs make transforms slower, and a plan is for a free machine.
        solve = 0.5 * min(tries) * float(transforms) * _OTHER_WORK
        return solve * self.solves + _RUN * self.solves / self.speed.size

    def memory(self) -> float:
        """Return the memory of one run as `asperity check` estimates it, bytes; NaN if unknown."""
        patch = self.road.patch(0)
        found = re.search(r"memory: about ([\d.]+) (\w?B)",
                          self.case(patch, "patch.h5", 0, 0).check(files=False))
        units = {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}
        return float(found[1]) * units[found[2]] if found else math.nan

    def summary(self, side_by_side: int | None = 1, here: bool = True) -> str:
        """Return a summary of the plan, one line per subject.

        Parameters
        ----------
        side_by_side : int or None
            Number of runs at a time; None where it is not known.
        here : bool
            Whether the runs share the memory of this machine.

        Returns
        -------
        str
        """
        road, patch = self.road, self.road.patch(0)
        ny, nx = patch.height.shape
        band = road.whole_spectrum.band
        # The spectrum of a map lacks the waves of which the map holds few, but its patches do not.
        longest = max(max(lx, ly) for *_, lx, ly in road.maps) if road.is_measured else band[0]
        kept = f"{min(_longest(self), longest):.4g} to {road.short:.4g} m"
        heights = statistics(patch.height, patch.lx, patch.ly)
        lines = [
            f"road       {road.name}: {counted(self.patches, 'patch', 'patches')} of"
            f" {nx} x {ny} cells, {patch.lx:.4g} x {patch.ly:.4g} m"
            + ("" if road.join == "none" else f", made periodic by {road.join!r}"),
            f"waves      {kept} are kept of {longest:.4g} to"
            f" {min(band[1], road.short):.4g} m",
            f"heights    rms {heights.rms_height:.4g} m, rms slope {heights.rms_slope:.4g}"
            f" ({patch.label})",
            f"rubber     {self.compound.name}: {counted(self.compound.series.g.size, 'arm')}",
            f"points     {counted(self.speed.size, 'speed')} x"
            f" {counted(self.pressure.size, 'pressure')} x"
            f" {counted(self.temperature.size, 'temperature')}",
            f"solves     {counted(self.solves, 'steady state')} in"
            f" {counted(self.solves // self.speed.size, 'run')}"
            + ("" if side_by_side is None else f", {side_by_side} at a time"),
            *self._costs(side_by_side, here),
        ]
        maps = [f"{name}: {nx} x {ny} cells, {lx:.4g} x {ly:.4g} m"
                for name, nx, ny, lx, ly in road.maps]
        lines[1:1] = [f"{head:11}{line}" for head, line in zip(
            ["maps", *[""] * len(maps)], maps, strict=False)]
        return "\n".join([*lines, *(f"note       {note}" for note in self.all_notes)])

    def _costs(self, side_by_side: int | None, here: bool) -> list[str]:
        """Return the lines of the summary about time and memory."""
        if side_by_side is None:
            time_ = f"{duration(max(self.seconds(), 1.0))} of one processor in all"
        else:
            time_ = (f"{duration(_COMMAND + self.seconds() / side_by_side)}, if the"
                     " processors have nothing else to do")
        if here and side_by_side is not None:
            memory = f"{(_COMMAND_MEMORY + self.memory() * side_by_side) / 1e6:.0f} MB"
        else:
            memory = f"{self.memory() / 1e6:.0f} MB for each run"
        return [f"time       about {time_}", f"memory     about {memory}"]


def plan_curve(
    road: DrawnRoad | MeasuredRoad,
    compound: Compound,
    *,
    speeds: Sequence[float] | FloatArray,
    pressures: Sequence[float] | FloatArray,
    temperatures: Sequence[float] | FloatArray | None = None,
    patches: int = 8,
    coefficient: float = 0.0,
    slope_effect: bool = False,
    angle: float | None = None,
    tolerance: float = 1e-5,
) -> CurvePlan:
    """Return the plan of a curve. Wrong values raise an error here, before anything runs.

    Parameters
    ----------
    road : DrawnRoad or MeasuredRoad
        See `asperity.curves.sources.road_of`.
    compound : Compound
        See `asperity.curves.sources.compound_of`.
    speeds, pressures : array_like
        Speeds, m/s, and pressures, Pa; > 0 and different from each other.
    temperatures : array_like, optional
        Temperatures, C; by default that of the rubber.
    patches : int
        Number of patches; at most those that the road has.
    coefficient : float
        Coefficient of Coulomb's law in the interface, 0 to 1000.
    slope_effect : bool
        Let the law act on the true slope. Only with a coefficient above 0.
    angle : float, optional
        Angle between the velocity of the road and x, degrees. The default is 0 on measured maps and
        31.7 on drawn ones. Along an axis the rubber meets its own footprint after a travel of one
        side.
    tolerance : float
        Tolerance of the solver.

    Returns
    -------
    CurvePlan

    Raises
    ------
    ValueError
        If a value is not allowed.
    """
    speed = np.sort(_within("speeds", speeds, "m/s"))
    pressure = np.sort(_within("pressures", pressures, "Pa"))
    usual = [compound.temperature] if temperatures is None else temperatures
    if not compound.series.g_inf > 0.0:
        raise ValueError(f"{compound.name}: shear_modulus = 0: steady sliding needs a long-term"
                         " modulus above 0: this material flows")
    temperature = (np.asarray(usual, dtype=float) if temperatures is None
                   else np.sort(array_of("temperatures", usual, ndim=1)))
    for name, values in (("speeds", speed), ("pressures", pressure),
                         ("temperatures", temperature)):
        if not values.size:
            raise ValueError(f"{name}: has no values")
        if np.any(np.diff(values) == 0.0):
            raise ValueError(f"{name}: {values[:-1][np.diff(values) == 0.0][0]:g} is given twice")
    wanted, notes = whole("patches", patches), []
    if road.count is not None and wanted > road.count:
        notes.append(f"the maps have room for {counted(road.count, 'patch', 'patches')} without"
                     f" overlap, not for {wanted}")
        wanted = road.count
    if slope_effect and coefficient == 0.0:
        raise ValueError("slope_effect (--slope): needs a coefficient (--coefficient) above 0,"
                         " because it changes Coulomb's law in the interface")
    if angle is None:
        angle = 0.0 if road.is_measured else 31.7
    plan = CurvePlan(road, compound, speed, pressure, temperature, wanted,
                     number("coefficient", coefficient, 0.0, _LARGEST_COEFFICIENT), slope_effect,
                     number("angle", angle, -360.0, 360.0), positive("tolerance", tolerance), notes)
    for celsius in temperature:
        if celsius < ABSOLUTE_ZERO:
            raise ValueError(f"temperatures: {celsius:g} C: must be >= {ABSOLUTE_ZERO:g} C")
        compound.at(float(celsius))
        notes += _band_note(plan, float(celsius))
    notes += [*_temperature_note(compound, temperature), *_load_notes(plan)]
    if road.is_measured and angle % 90.0 == 0.0:
        notes.append("sliding along an axis of a periodic patch the rubber meets its own footprint"
                     " after one side; an oblique direction (angle, --angle) avoids it")
    return plan


def _within(name: str, values: Sequence[float] | FloatArray, unit: str) -> FloatArray:
    """Return positive values, whose squares and products are numbers, too."""
    found = array_of(name, values, low=0.0, low_open=True, ndim=1)
    low, high = _RANGE
    for value in found:
        if not low <= value <= high:
            raise ValueError(f"{name}: {value:g} {unit}: must be from {low:g} to {high:g} {unit}")
    return found


def _longest(plan: CurvePlan) -> float:
    """Return the longest wave of the patches, m."""
    patch = plan.road.patch(0)
    return min(max(patch.lx, patch.ly), plan.road.whole_spectrum.band[0]) \
        if not plan.road.is_measured else max(patch.lx, patch.ly)


def _temperature_note(compound: Compound, temperature: FloatArray) -> list[str]:
    """Return a note on temperatures outside those at which the rubber was measured."""
    if not compound.shifts:
        return []
    low, high = min(compound.shifts), max(compound.shifts)
    outside = [f"{celsius:g}" for celsius in temperature if not low <= celsius <= high
               and not math.isnan(celsius)]
    return [f"{', '.join(outside)} °C: the rubber was measured from {low:g} to {high:g} °C only;"
            " its shift there is extrapolated"] if outside else []


def _load_notes(plan: CurvePlan) -> list[str]:
    """Return notes on pressures, speeds, slopes and coefficients that may be in another unit."""
    modulus, notes = plan.compound.series.g_inf, []
    if plan.pressure[-1] > _MOST_PRESSURE * modulus:
        notes.append(f"a pressure of {plan.pressure[-1]:g} Pa is {plan.pressure[-1] / modulus:.3g}"
                     f" times the relaxed modulus, {modulus:.3g} Pa: is one of them in another"
                     " unit?")
    if plan.pressure[0] < _LEAST_PRESSURE * modulus:
        notes.append(f"a pressure of {plan.pressure[0]:g} Pa is only"
                     f" {plan.pressure[0] / modulus:.2g} of the relaxed modulus, {modulus:.3g} Pa:"
                     " few cells will touch; is it in another unit?")
    if plan.speed[-1] > _MOST_SPEED:
        notes.append(f"at {plan.speed[-1]:g} m/s the inertia of the rubber counts, which the model"
                     " leaves out: speeds must be far below those of its waves, tens of m/s")
    slope = _rms_slope(plan.road.patch(0))
    if slope > _STEEP:
        notes.append(f"the rms slope of the road is {slope:.3g}, but the solid is linear and its"
                     " surface flat, which holds for small slopes only: are its heights or its"
                     " sides in another unit?")
    wedging = plan.coefficient * slope if plan.slope_effect else 0.0
    if wedging > _WEDGING:
        notes.append(f"the coefficient times the rms slope of the road is {wedging:.2g}: above"
                     f" about {_WEDGING:g} parts of the contact are so steep that friction holds"
                     " any force uphill, and states may end without a solution")
    return notes


def _rms_slope(patch: Patch) -> float:
    """Return the rms slope of a patch."""
    return statistics(patch.height, patch.lx, patch.ly, "periodic").rms_slope_differences


def _band_note(plan: CurvePlan, celsius: float) -> list[str]:
    """Return notes on speeds at which V/wavelength is outside the measured range of the rubber."""
    within = plan.compound.speeds_within(celsius, plan.road.short, _longest(plan))
    if within is None:
        return []
    low, high = within
    below, above = plan.speed[plan.speed < low], plan.speed[plan.speed > high]
    notes = []
    for some, where, end in ((below, "below", low), (above, "above", high)):
        if some.size:
            at = "" if math.isnan(celsius) else f"at {celsius:g} °C, "
            which = f"{some[0]:.3g}" + (f" to {some[-1]:.3g}" if some.size > 1 else "")
            notes.append(f"{at}{some.size} of {counted(plan.speed.size, 'speed')} ({which} m/s)"
                         f" {'loads' if some.size == 1 else 'load'} the rubber in part {where} the"
                         f" measured frequencies: the limit is {end:.3g} m/s, beyond it the series"
                         " is a guess")
    return notes
