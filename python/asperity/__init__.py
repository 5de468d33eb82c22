"""Contact of a viscoelastic solid with a rough, rigid surface: adhesion, friction, sliding.

>>> import asperity
>>> asperity.__version__.count(".")
2
"""

from asperity._core import asperity_flat as _flat

__all__ = ["__version__"]

__version__ = _flat.library_version().decode().strip()
"""The version of the Fortran library that is loaded, such as ``"0.1.0"``."""
