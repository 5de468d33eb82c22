"""Solve a rough contact with ContactMechanics: Polonsky and Keer's method on muGrid."""

from __future__ import annotations

import time

import numpy as np
from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
from search import Answer, search
from SurfaceTopography import Topography


def solve(height: np.ndarray, load: float, tolerance: float) -> Answer:
    """Solve once on one thread; the tolerance is the largest penetration over h_rms."""
    n = len(height)
    solid = PeriodicFFTElasticHalfSpace((n, n), 1.0, (1.0, 1.0))
    transforms = 0

    def counted(evaluate: object) -> object:
        def call(*arguments: object, **options: object) -> object:
            nonlocal transforms
            transforms += 2
            return evaluate(*arguments, **options)

        return call

    solid.evaluate_disp = counted(solid.evaluate_disp)
    solid.evaluate_force = counted(solid.evaluate_force)
    system = make_system(substrate=solid, surface=Topography(height, (1.0, 1.0), periodic=True))
    start = time.process_time()
    answer = system.minimize_proxy(
        external_force=load,
        initial_displacements=np.zeros((n, n)),
        pentol=tolerance * height.std(),
        maxiter=20000,
    )
    seconds = time.process_time() - start
    if not answer.success:
        raise RuntimeError("ContactMechanics did not converge")
    return np.array(answer.jac) * n * n, seconds, transforms


search(solve, 2e-6)
