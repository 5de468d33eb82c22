"""Solve a rough contact with Tamaas: Polonsky and Keer's method in the form of Rey et al.

Its transforms are in compiled code and cannot be counted from outside.
"""

from __future__ import annotations

import time

import numpy as np
import tamaas as tm
from search import Answer, search


def solve(height: np.ndarray, load: float, tolerance: float) -> Answer:
    """Solve once, on one thread."""
    n = len(height)
    model = tm.Model(tm.model_type.basic_2d, [1.0, 1.0], [n, n])
    model.E, model.nu = 1.0, 0.0
    solver = tm.PolonskyKeerRey(model, height, tolerance)
    solver.max_iter = 20000
    start = time.process_time()
    solver.solve(load)
    seconds = time.process_time() - start
    return np.array(model.traction).reshape(n, n), seconds, None


tm.initialize(1)
search(solve, 1e-6)
