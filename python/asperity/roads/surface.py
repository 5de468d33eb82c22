"""Height maps: generators, measurements, power spectral densities and statistics.

Maps have the shape (ny, nx). Heights are in m, and summits are maxima. Users import this module as
``asperity.surface``.
"""

from __future__ import annotations

from .generated import self_affine, shape
from .held_maps import save
from .measured import MeasuredSurface, import_topography, load
from .statistics import RadialPsd, Statistics, psd, psd_map, statistics

__all__ = ["MeasuredSurface", "RadialPsd", "Statistics", "import_topography", "load", "psd",
           "psd_map", "save", "self_affine", "shape", "statistics"]
