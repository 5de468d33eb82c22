"""Dynamic mechanical analysis: tables of storage and loss moduli, and the fit of a Prony series.

A table is a CSV file with a header that names its columns and their units; arguments of the call
supply what the header does not name. Sweeps at several temperatures are combined into one master
curve by time-temperature superposition, with given WLF constants or with shifts found from the
overlap. Users import this module as ``asperity.dma``.
"""

from __future__ import annotations

from .dma_fit import DmaFit, fit_dma
from .dma_table import DmaTable, read_dma

__all__ = ["DmaFit", "DmaTable", "fit_dma", "read_dma"]
