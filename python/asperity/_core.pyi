"""The compiled library, which f2py makes of the Fortran modules in `python/src`."""

from typing import Any

flat_contact: Any
flat_library: Any
flat_roads: Any
flat_runs: Any
flat_simulations: Any
