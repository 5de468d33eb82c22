"""Contact of a viscoelastic solid with a rough, rigid surface: adhesion, friction, sliding.

>>> import asperity
>>> asperity.__version__.count(".")
2
"""

from asperity._core import asperity_flat as _flat

from . import material
from .errors import NotConverged
from .result import Run
from .result import open_result as open

__all__ = ["NotConverged", "Run", "__version__", "material", "open"]

__version__ = _flat.library_version().decode().strip()
"""The version of the Fortran library that is loaded, such as ``"0.1.0"``."""
