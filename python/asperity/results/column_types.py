"""The columns of the history, for type checkers and editors.

Written by `tools/make_types.py` from the program's table of the columns.
"""

# ruff: noqa: E501

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class RowColumns:
    """One row of the history."""

    step: int  # number of the row
    phase: int  # number of the phase, from 1
    time: float  # time, s
    pressure: float  # mean normal pressure, Pa
    force: float  # normal force, N
    displacement: float  # approach of the far rubber from first touch, m
    contact_area: float  # fraction of the grid in contact
    mean_gap: float  # mean gap, m
    road_x: float  # displacement of the road along x, m
    road_y: float  # displacement of the road along y, m
    traction_x: float  # mean tangential traction on the rubber along x, Pa
    traction_y: float  # mean tangential traction on the rubber along y, Pa
    stick_area: float  # fraction of the grid that sticks: its slip is zero to the tolerance
    sliding_speed: float  # mean speed of the road over the rubber's surface along the road's velocity, m/s
    friction_viscous: float  # -mean(P dH/ds)/mean(P) along the road's velocity
    friction: float  # apparent friction coefficient along the road's velocity
    work_normal: float  # work of the normal traction, with the change of the adhesive energy, J
    work_tangential: float  # work of the tangential traction and of the driven mass, J
    work_load: float  # normal force times displacement, summed over the steps, J
    work_drive: float  # horizontal force of the drive times displacement of the road, summed, J
    work_missing: float  # work_load + work_drive - work_normal - work_tangential - energy_radiated, J
    energy_elastic: float  # energy stored in the rubber, J
    energy_adhesive: float  # energy of adhesion, J
    energy_kinetic: float  # kinetic energy of the interface, J
    energy_radiated: float  # energy set free by jumps of an adhesive contact within a step, J
    dissipated_viscous: float  # energy lost in the rubber, including the loss of the time scheme, J
    dissipated_numerical: float  # the part of this energy that the time scheme lost, J
    dissipated_friction: float  # energy lost by friction in the interface, J
    power_viscous: float  # rate of loss in the rubber; mean over the step, or of the steady state, W
    power_friction: float  # rate of loss by friction; mean over the step, or of the steady state, W
    iterations_normal: int  # iterations of the normal solver
    iterations_tangential: int  # iterations of the tangential solver
    residual_normal: float  # residual of the normal solution, recomputed
    residual_tangential: float  # residual of the tangential solution, recomputed
    passes: int  # passes of a step with friction
    residual_coupling: float  # error of the last pass: change of the road under the rubber, relative
    ffts: float  # real transforms of the size of the operator; smaller ones count in part
    seconds: float  # wall time of the solvers, s


class HistoryColumns:
    """The history: one value per row."""

    step: NDArray[np.int32]  # number of the row
    phase: NDArray[np.int32]  # number of the phase, from 1
    time: NDArray[np.float64]  # time, s
    pressure: NDArray[np.float64]  # mean normal pressure, Pa
    force: NDArray[np.float64]  # normal force, N
    displacement: NDArray[np.float64]  # approach of the far rubber from first touch, m
    contact_area: NDArray[np.float64]  # fraction of the grid in contact
    mean_gap: NDArray[np.float64]  # mean gap, m
    road_x: NDArray[np.float64]  # displacement of the road along x, m
    road_y: NDArray[np.float64]  # displacement of the road along y, m
    traction_x: NDArray[np.float64]  # mean tangential traction on the rubber along x, Pa
    traction_y: NDArray[np.float64]  # mean tangential traction on the rubber along y, Pa
    stick_area: NDArray[np.float64]  # fraction of the grid that sticks: its slip is zero to the tolerance
    sliding_speed: NDArray[np.float64]  # mean speed of the road over the rubber's surface along the road's velocity, m/s
    friction_viscous: NDArray[np.float64]  # -mean(P dH/ds)/mean(P) along the road's velocity
    friction: NDArray[np.float64]  # apparent friction coefficient along the road's velocity
    work_normal: NDArray[np.float64]  # work of the normal traction, with the change of the adhesive energy, J
    work_tangential: NDArray[np.float64]  # work of the tangential traction and of the driven mass, J
    work_load: NDArray[np.float64]  # normal force times displacement, summed over the steps, J
    work_drive: NDArray[np.float64]  # horizontal force of the drive times displacement of the road, summed, J
    work_missing: NDArray[np.float64]  # work_load + work_drive - work_normal - work_tangential - energy_radiated, J
    energy_elastic: NDArray[np.float64]  # energy stored in the rubber, J
    energy_adhesive: NDArray[np.float64]  # energy of adhesion, J
    energy_kinetic: NDArray[np.float64]  # kinetic energy of the interface, J
    energy_radiated: NDArray[np.float64]  # energy set free by jumps of an adhesive contact within a step, J
    dissipated_viscous: NDArray[np.float64]  # energy lost in the rubber, including the loss of the time scheme, J
    dissipated_numerical: NDArray[np.float64]  # the part of this energy that the time scheme lost, J
    dissipated_friction: NDArray[np.float64]  # energy lost by friction in the interface, J
    power_viscous: NDArray[np.float64]  # rate of loss in the rubber; mean over the step, or of the steady state, W
    power_friction: NDArray[np.float64]  # rate of loss by friction; mean over the step, or of the steady state, W
    iterations_normal: NDArray[np.int32]  # iterations of the normal solver
    iterations_tangential: NDArray[np.int32]  # iterations of the tangential solver
    residual_normal: NDArray[np.float64]  # residual of the normal solution, recomputed
    residual_tangential: NDArray[np.float64]  # residual of the tangential solution, recomputed
    passes: NDArray[np.int32]  # passes of a step with friction
    residual_coupling: NDArray[np.float64]  # error of the last pass: change of the road under the rubber, relative
    ffts: NDArray[np.float64]  # real transforms of the size of the operator; smaller ones count in part
    seconds: NDArray[np.float64]  # wall time of the solvers, s
