"""Contact of a viscoelastic solid with a rough, rigid surface: adhesion, friction, sliding.

>>> import asperity
>>> asperity.__version__.count(".")
2
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from . import _addresses
from .base import presenters

# Idle threads must soon sleep: if they spin for long, a run becomes ten times slower on a machine
# that others use. They spin for about as long as it takes to wake them (`app/wait_policy.f90`).
# OpenMP reads the variables when its library is loaded, perhaps by another package, so set them
# first.
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ["OMP_WAIT_POLICY"] = "passive"
    os.environ.setdefault("GOMP_SPINCOUNT", "1000")

if TYPE_CHECKING:
    from . import theory
    from .base.errors import NotConverged
    from .base.library import set_threads
    from .contact import (
        AdhesiveNormalContact,
        NormalContact,
        operators,
        solve_adhesive,
        solve_normal,
    )
    from .curves import friction_curve
    from .results import Run
    from .results import open_result as open
    from .roads import surface
    from .rubber import dma, material
    from .runs.case import Case
    from .runs.runner import run
    from .runs.simulation import Simulation
    from .runs.sweep_table import Sweep, SweepError
    from .runs.sweeps import sweep

    __version__: str

__all__ = ["AdhesiveNormalContact", "Case", "NormalContact", "NotConverged", "Run", "Simulation",
           "Sweep", "SweepError", "__version__", "dma", "friction_curve", "material", "open",
           "operators", "run", "set_threads", "solve_adhesive", "solve_normal", "surface", "sweep",
           "theory"]

_addresses.install(__name__)
presenters.register({name: f"{__name__}.{module}"
                     for name, module in _addresses.PRESENTERS.items()})


def __getattr__(name: str) -> Any:
    """Import a public name on first use, because NumPy, HDF5 and SciPy take long to load."""
    if name == "__version__":  # of the Fortran library that is loaded, such as "0.1.0"
        from .base.library import version

        found: Any = version()
    else:
        found = _addresses.find(__name__, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
