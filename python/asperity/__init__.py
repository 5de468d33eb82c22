"""Contact of a viscoelastic solid with a rough, rigid surface: adhesion, friction, sliding.

>>> import asperity
>>> asperity.__version__.count(".")
2
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from . import surface
from ._library import set_threads, version
from .adhesive_contact import AdhesiveNormalContact, solve_adhesive
from .case import Case
from .contact import NormalContact, solve_normal
from .errors import NotConverged
from .result import Run
from .result import open_result as open
from .runner import run
from .sweep_table import Sweep, SweepError
from .sweeps import sweep

if TYPE_CHECKING:
    from . import dma, material, theory

__all__ = ["AdhesiveNormalContact", "Case", "NormalContact", "NotConverged", "Run", "Sweep",
           "SweepError", "__version__", "dma", "material", "open", "run", "set_threads",
           "solve_adhesive", "solve_normal", "surface", "sweep", "theory"]

__version__ = version()
"""The version of the Fortran library that is loaded, such as ``"0.1.0"``."""

del version


def __getattr__(name: str) -> Any:
    """Load the modules that need SciPy when they are used first: it takes its time."""
    if name in ("dma", "material", "theory"):
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
