"""Parts that the studies share: paths, the model compound, expected warnings, style of pictures."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import asperity

EXAMPLES = Path(__file__).resolve().parent

#: Processors that a study may use; make.py sets it. For `asperity.sweep(..., jobs=common.jobs)` or
#: `asperity.run(..., threads=common.jobs)`.
jobs = 1

#: Colours that colour-blind readers can distinguish (Okabe and Ito), in the order of use.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = "osD^v<>"


#: Parts of warnings of the program that a study may expect.
#: Steps longer than the shortest relaxation time, whose arm relaxes within the step.
LONG_STEPS = "longer than the shortest active relaxation time"
#: Steps of more than a cell, which do not matter while a block sticks.
LONG_WAYS = "a step moves the road by"
#: Waves of few cells, in quick forms.
FEW_CELLS = "the shortest wave has"
#: Contacts of few cells.
SMALL_CONTACTS = "cells across on average"
#: Waves as long as the map.
LONG_WAVES = "is not below the side of"
#: Cells too wide for the range of adhesion.
WIDE_CELLS = "the edge of the contact sticks to the grid"
#: Passes of a step that alternate between two states.
UNSETTLED = "the passes of the step did not settle"
#: Numerical stick-slip.
STICK_SLIP = "the mean slip rises and falls from step to step"


@contextmanager
def expected(*said: str) -> Iterator[None]:
    """Ignore warnings that contain one of these texts; make.py treats all others as errors."""
    with warnings.catch_warnings():
        for text in said:
            warnings.filterwarnings("ignore", f"(?s).*{re.escape(text)}", UserWarning)
        yield


def subplots(columns: int = 1, rows: int = 1, *, width: float = 4.6, height: float = 3.7,
             **options: Any) -> tuple[Any, Any]:
    """Return a figure and its axes in the colours above; width and height of each are in inches."""
    from cycler import cycler
    from matplotlib import pyplot

    with pyplot.rc_context({"axes.prop_cycle": cycler(color=COLOURS), "legend.fontsize": "small",
                            "axes.grid": True, "grid.alpha": 0.3}):
        return pyplot.subplots(rows, columns, figsize=(width * columns, height * rows),
                               layout="constrained", **options)


def compound() -> asperity.material.Prony:
    """Return the model compound of materials/sbr.txt at 25 degrees."""
    g, tau = np.loadtxt(EXAMPLES / "materials" / "sbr.txt", unpack=True)
    return asperity.material.Prony(g[0], g[1:], tau[1:])


def material_group(rubber: asperity.material.Prony | None = None, **more: Any) -> dict[str, Any]:
    """Return a rubber as the group `material` of an `asperity.Case`; the compound by default."""
    rubber = compound() if rubber is None else rubber
    return dict(shear_modulus=rubber.g_inf, prony_g=rubber.g, prony_tau=rubber.tau, **more)


def run(case: asperity.Case, path: Path) -> asperity.Run:
    """Return the result of a case. A complete result of the same input is reused."""
    if path.exists():
        found = asperity.open(path)
        if found.finished and found.input == str(case):
            return found
    return asperity.run(case, output=path, threads=jobs, overwrite=True)


def shortened(case: asperity.Case, cells: int = 64, steps: int = 20) -> asperity.Case:
    """Return a case with fewer cells and steps, and with waves that the cells resolve."""
    short = case.copy()
    factor = max(1, case.grid.nx // cells)
    short.grid.nx = max(2, case.grid.nx // factor)
    short.grid.ny = max(1, case.grid.ny // factor)
    for surface in short.surface:
        if "wavelength_short" in surface:
            surface.wavelength_short *= factor
    for phase in short.phase:
        if "steps" in phase:
            phase.steps = min(phase.steps, steps)
    short.solver.threads = 1
    return short
