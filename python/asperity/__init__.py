"""Contact of a viscoelastic solid with a rough, rigid surface: adhesion, friction, sliding.

>>> import asperity
>>> asperity.__version__.count(".")
2
"""

from . import material, surface, theory
from ._library import set_threads, version
from .contact import NormalContact, solve_normal
from .errors import NotConverged
from .result import Run
from .result import open_result as open
from .runner import run

__all__ = ["NormalContact", "NotConverged", "Run", "__version__", "material", "open", "run",
           "set_threads", "solve_normal", "surface", "theory"]

__version__ = version()
"""The version of the Fortran library that is loaded, such as ``"0.1.0"``."""

del version
